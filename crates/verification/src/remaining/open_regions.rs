//! Regions on which a program does not keep the limits of its operations, followed through the
//! later programs.

use facemill_job::format::job_file::FinishFile;
use facemill_job::format::job_report::{CuspsAtEnd, LeftAtEnd, LeftAtEndPlace};
use facemill_job::format::report::remaining::RemainingOnRegion;
use facemill_z_map::{LeftHeight, SurfacePlace};
use nalgebra::{Isometry3, Point3};

use crate::material_left::ACCURACY;
use crate::remaining::LeftPlace;

/// Region of an operation whose limits its program does not keep. Places are in the workpiece frame
/// of its setup.
#[derive(Clone, Debug)]
pub struct OpenRegion {
    operation: String,
    limit: f64,
    allowed: FinishFile,
    /// Area of the region, on a line its length; 0 if no sample lies in it.
    all: f64,
    /// Part of the area above the limit that no place stands for.
    uncertain: f64,
    /// Share above the limit after the own program.
    above_before: f64,
    is_exceeded: bool,
    /// Places above the limit, or never cut.
    places: Vec<OpenPlace>,
    cusps: Option<OpenCusps>,
    lowered_by: Vec<String>,
}

#[derive(Clone, Debug)]
struct OpenPlace {
    /// The place, with the height left on it.
    on: SurfacePlace,
    weight: f64,
    is_never_cut: bool,
}

/// Places beside the points of an operation whose predicted cusps its text is not measured to keep.
#[derive(Clone, Debug)]
pub struct OpenCusps {
    points: usize,
    /// Largest cusp permitted, mm.
    cusp: f64,
    /// Height at most left on the places where the cusps are kept, mm.
    limit: f64,
    /// The places, with the heights left on them.
    on: Vec<SurfacePlace>,
    /// Whether the places show all that may stay beside the points.
    is_known: bool,
    /// Whether a later program has cut deeper on one of them.
    is_lowered: bool,
    /// Whether the places have the heights left on them, rather than [`UNCUT`].
    has_heights: bool,
}

/// Height that places have at least, so that a later program has to cut them to make them low, mm.
const UNCUT: f64 = 1.0;

impl OpenCusps {
    /// Returns cusps beside points, with places beside all of them; `is_known` says whether these
    /// show all that may stay.
    #[must_use]
    pub fn beside(points: usize, cusp: f64, on: Vec<SurfacePlace>, is_known: bool) -> Self {
        Self { points, cusp, limit: cusp, on, is_known, is_lowered: false, has_heights: true }
    }

    /// Returns cusps beside so many points that they are not measured one by one: they are kept
    /// where later programs cut all of the region deeper than its operation. `is_known` says
    /// whether all of the points are on the region.
    #[must_use]
    pub fn all_over(points: usize, cusp: f64, region: &[LeftPlace], is_known: bool) -> Self {
        let uncut = |place: &LeftPlace| SurfacePlace { stock: place.left.stock.max(UNCUT), ..place.left };
        let on = region.iter().map(uncut).collect();
        Self { limit: ACCURACY.min(cusp), has_heights: false, ..Self::beside(points, cusp, on, is_known) }
    }

    /// Returns whether later programs keep the cusps; without a place nothing is known.
    fn are_kept(&self) -> bool {
        let is_low = |on: &SurfacePlace| on.stock <= self.limit;
        self.is_known && self.is_lowered && !self.on.is_empty() && self.on.iter().all(is_low)
    }

    fn at_end(&self) -> CuspsAtEnd {
        let higher = |a: SurfacePlace, b: SurfacePlace| if b.stock > a.stock { b } else { a };
        let highest = self.on.iter().copied().filter(|_| self.has_heights && self.is_known).reduce(higher);
        CuspsAtEnd {
            points: self.points,
            kept: self.are_kept(),
            limit_mm: self.cusp,
            highest_at_end: highest.map(|on| LeftAtEndPlace { height_mm: on.stock, at_mm: on.position.into() }),
        }
    }
}

impl OpenRegion {
    /// Returns the region of an operation with the places measured on it; `None` where the program
    /// keeps the operation's limits.
    #[must_use]
    pub fn of(left: &RemainingOnRegion, measured: &[LeftPlace], cusps: Option<OpenCusps>) -> Option<Self> {
        if !left.exceeded && cusps.is_none() {
            return None;
        }
        let open = |place: &LeftPlace| {
            let is_open = place.height > left.limit_mm || place.is_never_cut;
            is_open.then_some(OpenPlace { on: place.left, weight: place.weight, is_never_cut: place.is_never_cut })
        };
        Some(Self {
            operation: left.operation.clone(),
            limit: left.limit_mm,
            allowed: left.allowed,
            all: if left.samples == 0 { 0.0 } else { left.length_mm.unwrap_or(left.area_mm2) },
            uncertain: left.level.map_or(0.0, |level| level.uncertain_mm2),
            above_before: left.above_fraction,
            is_exceeded: left.exceeded,
            places: measured.iter().filter_map(open).collect(),
            cusps,
            lowered_by: Vec::new(),
        })
    }

    /// Lowers the places to what the program `by` leaves: `heights` of places of its workpiece
    /// frame, in which `motion` has this region's frame.
    ///
    /// # Errors
    /// As `heights`.
    pub fn lower<E>(
        &mut self,
        by: &str,
        motion: Option<Isometry3<f64>>,
        heights: impl Fn(&[SurfacePlace]) -> Result<Vec<LeftHeight>, E>,
    ) -> Result<(), E> {
        let motion = motion.unwrap_or_default();
        let moved = |on: &SurfacePlace| SurfacePlace {
            position: motion * on.position,
            normal: motion * on.normal,
            stock: on.stock,
        };
        let of_places: Vec<SurfacePlace> = self.places.iter().map(|place| moved(&place.on)).collect();
        let mut is_lower = false;
        for (place, left) in self.places.iter_mut().zip(heights(&of_places)?) {
            is_lower |= left.cut_by.is_some();
            place.is_never_cut &= left.cut_by.is_none();
            place.on.stock = left.height;
        }
        let limit = self.limit;
        self.places.retain(|place| place.on.stock > limit || place.is_never_cut);
        if let Some(cusps) = &mut self.cusps {
            let of_cusps: Vec<SurfacePlace> = cusps.on.iter().map(moved).collect();
            for (on, left) in cusps.on.iter_mut().zip(heights(&of_cusps)?) {
                cusps.is_lowered |= left.cut_by.is_some();
                is_lower |= left.cut_by.is_some();
                on.stock = left.height;
            }
        }
        if is_lower {
            self.lowered_by.push(by.to_owned());
        }
        Ok(())
    }

    /// Returns what is left on it after all programs; `setup` is its own.
    #[must_use]
    pub fn at_end(&self, setup: &str) -> LeftAtEnd {
        let area = |is: &dyn Fn(&OpenPlace) -> bool| {
            self.places.iter().filter(|place| is(place)).fold(0.0, |sum, place| sum + place.weight)
        };
        let share = |part: f64, of: f64| if of > 0.0 { part / of } else { 0.0 };
        let above = area(&|place| place.on.stock > self.limit) + self.uncertain;
        let above_at_end = share(above, self.all + self.uncertain);
        let never_cut_at_end = share(area(&|place| place.is_never_cut), self.all);
        let higher = |a: &OpenPlace, b: &OpenPlace| b.on.stock > a.on.stock;
        let highest = self.places.iter().filter(|place| place.on.stock > self.limit);
        let highest = highest.reduce(|a, b| if higher(a, b) { b } else { a });
        let is_known = self.all > 0.0;
        let cusps = self.cusps.as_ref().map(OpenCusps::at_end);
        LeftAtEnd {
            setup: setup.to_owned(),
            operation: self.operation.clone(),
            region: self.all,
            limit_mm: self.limit,
            allowed: self.allowed,
            exceeded: self.is_exceeded,
            above_fraction: self.above_before,
            above_at_end,
            never_cut_at_end,
            highest_at_end: highest.map(|place| {
                let at: Point3<f64> = place.on.position;
                LeftAtEndPlace { height_mm: place.on.stock, at_mm: at.into() }
            }),
            cusps,
            lowered_by: self.lowered_by.clone(),
            exceeded_at_end: self.is_exceeded
                && !(is_known
                    && above_at_end <= self.allowed.max_above_fraction
                    && never_cut_at_end <= self.allowed.max_never_cut_fraction),
        }
    }
}

#[cfg(test)]
#[path = "../../tests/unit/remaining/open_regions.rs"]
mod tests;
