//! What of a part is gouged, left or within tolerance behind a program, in figures.

use facemill_surface_model::Surface;
use facemill_z_map::Place;
use nalgebra::Point3;
use schemars::JsonSchema;
use serde::Serialize;

use crate::deviation_cusps::CuspReport;

/// How far the cut stock is from the part and the allowance on it: the surface that the program should have left.
///
/// Largest values are exact on every line of the stock within `uncertainty_mm`; between lines nothing is said. Areas
/// are estimates: those of small triangles, each with the deviation of the line's place that is nearest to it.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct DeviationReport {
    /// Deviation up to which a place is within tolerance, to both sides, mm.
    pub tolerance_mm: f64,
    /// How far deviations on lines may be off, mm: twice the tolerance with which the stock was cut.
    pub uncertainty_mm: f64,
    /// Whether the program has cut deeper than the gouge limit and the uncertainty allow, or through a surface that is
    /// not closed. The findings tell where the cutter was too deep; this says that it shows in the stock.
    pub exceeds_gouge_limit: bool,
    /// Of the surface that the setup's operations cut.
    pub drive: DeviationFigures,
    /// Of all the setup's part surfaces, these included.
    pub part: DeviationFigures,
    /// The deepest place within the part that is not stock any more, with material over and under it on its line,
    /// where there is one; told by at most a twentieth and 0.01 mm too deep.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cavity: Option<DeviationPlace>,
    /// Cusps between passes against what was to be expected; absent where the program has no passes on the part that
    /// can be followed by their words (positions with tool vectors cannot).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cusps: Option<CuspReport>,
}

/// Figures of a surface.
#[derive(Clone, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct DeviationFigures {
    /// The deepest place below the surface, as a positive length; `None` where nothing is missing.
    pub largest_gouge: Option<DeviationPlace>,
    /// The most that stands over the surface where the program has cut.
    pub largest_excess: Option<DeviationPlace>,
    /// The most that stands over it where the program has cut nothing.
    pub largest_not_reached: Option<DeviationPlace>,
    /// Area by what it is like.
    pub area_mm2: DeviationAreas,
    /// Measured area by deviation, in steps of half the tolerance within four times the tolerance, and beyond.
    pub histogram: Vec<DeviationBin>,
}

/// A deviation and where it is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct DeviationPlace {
    /// How much, mm.
    pub value_mm: f64,
    /// Place on the part (of a cavity: in it), workpiece frame, mm.
    pub at_mm: [f64; 3],
}

/// Areas of a surface, mm²; they add up to the surface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct DeviationAreas {
    /// Within the tolerance, and cut by the program or without stock on it.
    pub within: f64,
    /// Deeper than the tolerance.
    pub gouged: f64,
    /// Higher than the tolerance, and cut by the program.
    pub excess: f64,
    /// As it was before the program, with stock on it.
    pub not_reached: f64,
    /// Of a surface that is not closed: no stock at all under it.
    pub no_stock: f64,
    /// No line goes through the surface near it: walls along the lines, what lies inside another shell, and what the
    /// lines of the stock do not reach.
    pub not_measured: f64,
}

/// Area of a surface whose deviation is in a range.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct DeviationBin {
    /// From this deviation on, mm; absent for all that is less.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub from_mm: Option<f64>,
    /// Up to less than this, mm; absent for all that is more.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub to_mm: Option<f64>,
    /// Area, mm².
    pub area_mm2: f64,
}

/// What a place of a surface is like.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Condition {
    Within(f64),
    Gouged(f64),
    Excess(f64),
    NotReached,
    NoStock,
    NotMeasured,
}

/// A small triangle of a part.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Patch {
    pub area: f64,
    pub is_drive: bool,
    pub place: Option<Place>,
}

impl Condition {
    /// Condition of a place within a tolerance, deviations being known to an uncertainty, mm.
    pub(crate) fn of(place: Option<&Place>, [tolerance, uncertainty]: [f64; 2]) -> Self {
        match place {
            None => Self::NotMeasured,
            Some(p) if p.deviation == f64::NEG_INFINITY => Self::NoStock,
            Some(p) if p.deviation < -tolerance => Self::Gouged(p.deviation),
            // Stock as it was before the cut is not finished, however little of it there is.
            Some(p) if !p.is_cut && p.deviation > uncertainty => Self::NotReached,
            Some(p) if p.deviation <= tolerance => Self::Within(p.deviation),
            Some(p) if p.is_cut => Self::Excess(p.deviation),
            Some(_) => Self::NotReached,
        }
    }
}

/// Steps of the histogram between no deviation and its last bin, to each side.
const STEPS: i32 = 8;

impl DeviationFigures {
    /// Figures of the places and patches that are asked for, within a tolerance and told to an uncertainty (mm); deviations are those from the surface with its allowance.
    pub(crate) fn of(
        places: impl Iterator<Item = Place>,
        patches: impl Iterator<Item = Patch> + Clone,
        accuracy: [f64; 2],
    ) -> Self {
        let mut figures = Self { histogram: histogram(patches.clone(), accuracy[0]), ..Self::default() };
        for place in places.filter(|p| p.deviation.is_finite()) {
            let kind = match place.deviation {
                d if d < 0.0 => &mut figures.largest_gouge,
                d if d > 0.0 && place.is_cut => &mut figures.largest_excess,
                d if d > 0.0 => &mut figures.largest_not_reached,
                _ => continue,
            };
            let value_mm = place.deviation.abs();
            if kind.is_none_or(|k| k.value_mm < value_mm) {
                *kind = Some(DeviationPlace { value_mm, at_mm: place.position.into() });
            }
        }
        let areas = &mut figures.area_mm2;
        for patch in patches {
            *match Condition::of(patch.place.as_ref(), accuracy) {
                Condition::Within(_) => &mut areas.within,
                Condition::Gouged(_) => &mut areas.gouged,
                Condition::Excess(_) => &mut areas.excess,
                Condition::NotReached => &mut areas.not_reached,
                Condition::NoStock => &mut areas.no_stock,
                Condition::NotMeasured => &mut areas.not_measured,
            } += patch.area;
        }
        figures
    }
}

fn histogram(patches: impl Iterator<Item = Patch>, tolerance: f64) -> Vec<DeviationBin> {
    let step = 0.5 * tolerance;
    let mut areas = vec![0.0; 2 * STEPS as usize + 2];
    for patch in patches {
        let Some(place) = patch.place.filter(|p| p.deviation.is_finite()) else { continue };
        let bin = (place.deviation / step).floor().clamp(f64::from(-STEPS - 1), f64::from(STEPS));
        areas[(bin as i32 + STEPS + 1) as usize] += patch.area;
    }
    let edge = |k: i32| (-STEPS..=STEPS).contains(&k).then(|| f64::from(k) * step);
    let bins = areas.into_iter().zip(-STEPS - 1..);
    bins.map(|(area_mm2, k)| DeviationBin { from_mm: edge(k), to_mm: edge(k + 1), area_mm2 }).collect()
}

/// Which triangles of a part are of the surface that is cut: those that lie in it, and look the same way.
pub(crate) fn drive_triangles(part: &Surface, drive: &Surface) -> Vec<bool> {
    let is_drive = |t: u32| {
        let [a, b, c] = part.mesh().corners(t as usize).map(|p| p.coords);
        let nearest = drive.closest_point(&Point3::from((a + b + c) / 3.0), SAME_PLACE);
        let normals = nearest.and_then(|p| drive.facet_normal(p.triangle)).zip(part.facet_normal(t));
        normals.is_some_and(|(n, m)| n.dot(&m) > 0.0)
    };
    (0..part.mesh().triangles().len() as u32).map(is_drive).collect()
}

/// Distance that is none, mm: the same triangles, moved in the same way.
const SAME_PLACE: f64 = 1e-6;

/// A place with its deviation from the surface and the allowance on it.
pub(crate) fn beyond(place: Place, allowances: &[f64]) -> Place {
    Place { deviation: place.deviation - allowances[place.triangle as usize], ..place }
}
