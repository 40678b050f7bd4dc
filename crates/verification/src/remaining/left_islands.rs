//! Islands of what a program leaves too high: parts of a region with no other place between them.

use facemill_cl_data::Aabb;
use facemill_job::format::report::remaining::LeftIslandReport;
use facemill_surface_model::place_islands;

use crate::material_left::MaterialLeft;

/// Most islands of a report.
const MOST_ISLANDS: usize = 16;

/// Largest distance of neighbours, as a multiple of the distance between samples: over the diagonal
/// of a square of them.
const NEIGHBOURS: f64 = 2.0;

/// Islands of places above a limit.
pub(crate) struct LeftIslands {
    /// Number of all islands.
    pub(crate) n: usize,
    /// The largest, by area, then by height.
    pub(crate) largest: Vec<LeftIslandReport>,
}

/// Returns the islands of samples above a limit (mm). Each such sample is in one of them.
pub(crate) fn left_islands(measured: &MaterialLeft, limit: f64) -> LeftIslands {
    let high: Vec<usize> = (0..measured.left.len()).filter(|&k| measured.left[k].height > limit).collect();
    let places: Vec<_> = high.iter().map(|&k| (measured.on[k].position, measured.on[k].normal)).collect();
    let islands = place_islands(&places, NEIGHBOURS * measured.spacing());
    let of = |island: Vec<usize>| report(measured, &island.into_iter().map(|k| high[k]).collect::<Vec<_>>());
    let mut all: Vec<LeftIslandReport> = islands.into_iter().filter_map(of).collect();
    let n = all.len();
    all.sort_by(|a, b| b.area_mm2.total_cmp(&a.area_mm2).then(b.highest.height_mm.total_cmp(&a.highest.height_mm)));
    all.truncate(MOST_ISLANDS);
    LeftIslands { n, largest: all }
}

/// Returns the report on an island of samples.
fn report(measured: &MaterialLeft, members: &[usize]) -> Option<LeftIslandReport> {
    let height = |k: usize| measured.left[k].height;
    let highest = members.iter().copied().reduce(|a, b| if height(b) > height(a) { b } else { a })?;
    let around = Aabb::of_points(members.iter().map(|&k| &measured.on[k].position));
    let sum =
        |is: &dyn Fn(usize) -> bool| members.iter().filter(|&&k| is(k)).fold(0.0, |sum, &k| sum + measured.weights[k]);
    Some(LeftIslandReport {
        area_mm2: sum(&|_| true),
        never_cut_mm2: sum(&|k| measured.is_never_cut(k)),
        highest: measured.place(highest),
        from_mm: around.min.into(),
        to_mm: around.max.into(),
    })
}

#[cfg(test)]
#[path = "../../tests/unit/remaining/left_islands.rs"]
mod tests;
