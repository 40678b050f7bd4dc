use facemill_cl_data::Aabb;
use nalgebra::{Point3, Unit, Vector3};

use crate::surface::tree::Tree;

/// Returns the islands of places on a surface, with the normals there: two places are in one island
/// if they are at most `reach` (mm) apart and face the same half space, or places between them lead
/// from one to the other so.
///
/// Each place is in one island. Islands are in the order of their first places, and their indices
/// rise.
pub fn place_islands(places: &[(Point3<f64>, Unit<Vector3<f64>>)], reach: f64) -> Vec<Vec<usize>> {
    let boxes: Vec<Aabb> = places.iter().map(|(position, _)| Aabb::of_points([position])).collect();
    let tree = Tree::build(&boxes);
    let mut is_taken = vec![false; places.len()];
    let mut islands = Vec::new();
    for first in 0..places.len() {
        if std::mem::replace(&mut is_taken[first], true) {
            continue;
        }
        let (mut members, mut next) = (vec![first], 0);
        while next < members.len() {
            let (position, normal) = &places[members[next]];
            next += 1;
            tree.visit_boxes(
                |b| b.distance_sq(position) <= reach * reach,
                |k| {
                    let k = k as usize;
                    if !is_taken[k] && places[k].1.dot(normal) > 0.0 {
                        is_taken[k] = true;
                        members.push(k);
                    }
                },
            );
        }
        members.sort_unstable();
        islands.push(members);
    }
    islands
}

#[cfg(test)]
#[path = "../../tests/unit/surface/place_islands.rs"]
mod tests;
