//! Figures of a surface compared with the stock that a program leaves.

use facemill_job::format::report::deviation::{DeviationBin, DeviationFigures, DeviationPlace};
use facemill_surface_model::Surface;
use facemill_z_map::DeviationPoint;
use nalgebra::Point3;

/// Condition of a place of a surface.
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
    pub(crate) area: f64,
    pub(crate) is_drive: bool,
    pub(crate) place: Option<DeviationPoint>,
}

impl Condition {
    /// Returns the condition of a place within a tolerance; deviations are known to an uncertainty,
    /// mm.
    pub(crate) fn of(place: Option<&DeviationPoint>, [tolerance, uncertainty]: [f64; 2]) -> Self {
        match place {
            None => Self::NotMeasured,
            Some(p) if p.deviation == f64::NEG_INFINITY => Self::NoStock,
            Some(p) if p.deviation < -tolerance => Self::Gouged(p.deviation),
            // Stock unchanged by the cut is not finished, however thin.
            Some(p) if !p.is_cut && p.deviation > uncertainty => Self::NotReached,
            Some(p) if p.deviation <= tolerance => Self::Within(p.deviation),
            Some(p) if p.is_cut => Self::Excess(p.deviation),
            Some(_) => Self::NotReached,
        }
    }
}

/// Steps of the histogram between no deviation and its last bin, to each side.
pub(crate) const STEPS: i32 = 8;

/// Returns the figures of these places and patches, for a tolerance and an uncertainty (mm);
/// deviations are those from the surface with its allowance.
pub(crate) fn deviation_figures(
    places: impl Iterator<Item = DeviationPoint>,
    patches: impl Iterator<Item = Patch> + Clone,
    accuracy: [f64; 2],
) -> DeviationFigures {
    let mut figures =
        DeviationFigures { histogram: histogram(patches.clone(), accuracy[0]), ..DeviationFigures::default() };
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

pub(crate) fn histogram(patches: impl Iterator<Item = Patch>, tolerance: f64) -> Vec<DeviationBin> {
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

/// Returns which triangles of a part belong to the surface that is cut: those in it that face the
/// same way.
pub(crate) fn drive_triangles(part: &Surface, drive: &Surface) -> Vec<bool> {
    let is_drive = |t: u32| {
        let [a, b, c] = part.mesh().corners(t as usize).map(|p| p.coords);
        let nearest = drive.closest_point(&Point3::from((a + b + c) / 3.0), SAME_PLACE);
        let normals = nearest.and_then(|p| drive.facet_normal(p.triangle)).zip(part.facet_normal(t));
        normals.is_some_and(|(n, m)| n.dot(&m) > 0.0)
    };
    (0..part.mesh().triangles().len() as u32).map(is_drive).collect()
}

/// Distance that counts as none, mm: the same triangles, moved in the same way.
pub(crate) const SAME_PLACE: f64 = 1e-6;

/// Returns a place with its deviation from the surface with its allowance; none at all under it
/// where nothing was cut and more is missing than `lacks` permits, if that is given, mm.
pub(crate) fn beyond(place: DeviationPoint, allowances: &[f64], lacks: Option<f64>) -> DeviationPoint {
    let deviation = place.deviation - allowances[place.triangle as usize];
    let is_lacking = !place.is_cut && lacks.is_some_and(|tolerance| deviation < -tolerance);
    DeviationPoint { deviation: if is_lacking { f64::NEG_INFINITY } else { deviation }, ..place }
}

#[cfg(test)]
#[path = "../../tests/unit/deviation/figures.rs"]
mod tests;
