use std::collections::HashMap;

use nalgebra::Point3;

/// Returns for each point the lowest-numbered point that it is merged with; itself where there is
/// none.
///
/// In their order, each point joins the first representative (or becomes one itself) within
/// `tolerance`; with tolerance 0, one with equal coordinates. Representatives are thus farther than
/// `tolerance` apart, and no chain of near points merges distant ones.
pub(crate) fn weld(points: &[Point3<f64>], tolerance: f64) -> Vec<u32> {
    // Cells wide enough that most points have no second cell within the tolerance, narrow enough to
    // hold few representatives.
    let width = 4.0 * tolerance;
    let cell = |x: f64| if width > 0.0 { (x / width).floor() as i64 } else { (x + 0.0).to_bits() as i64 };
    let tolerance_sq = tolerance * tolerance;
    let mut cells: HashMap<[i64; 3], Vec<u32>> = HashMap::new();
    let mut stands_for = Vec::with_capacity(points.len());
    for (k, p) in points.iter().enumerate() {
        let (low, high) = (p.map(|x| cell(x - tolerance)), p.map(|x| cell(x + tolerance)));
        let mut found: Option<u32> = None;
        for x in span(low.x, high.x) {
            for y in span(low.y, high.y) {
                for z in span(low.z, high.z) {
                    let near = cells.get(&[x, y, z]).into_iter().flatten().copied();
                    let near = near.filter(|&q| (points[q as usize] - p).norm_squared() <= tolerance_sq);
                    found = found.into_iter().chain(near).min();
                }
            }
        }
        stands_for.push(found.unwrap_or(k as u32));
        if found.is_none() {
            cells.entry([cell(p.x), cell(p.y), cell(p.z)]).or_default().push(k as u32);
        }
    }
    stands_for
}

/// Returns one or two neighbouring cells.
fn span(low: i64, high: i64) -> impl Iterator<Item = i64> {
    std::iter::once(low).chain((high != low).then_some(high))
}

#[cfg(test)]
#[path = "../../tests/unit/mesh/weld.rs"]
mod tests;
