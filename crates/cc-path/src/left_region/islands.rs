//! Islands of stock that is left.

use nalgebra::Point3;

use crate::left_region::StockHeight;
use crate::left_region::ball_tree::BallTree;

/// Group of places on which stock is left, and whose surface to be cut hangs together.
#[derive(Clone, Debug, PartialEq)]
pub struct LeftIsland {
    /// Indices of its places, rising.
    pub places: Vec<usize>,
    /// Area of its places, mm².
    pub area: f64,
    /// Its highest place; of equal ones the first.
    pub highest: Point3<f64>,
}

/// The islands, in the order of their first places.
pub(crate) fn islands(places: &[StockHeight], tree: &BallTree, overlap: f64) -> Vec<LeftIsland> {
    let mut open = tree.all_open();
    let mut found = Vec::new();
    for first in 0..places.len() {
        if !open.take(first) {
            continue;
        }
        let mut members = vec![first as u32];
        let mut next = 0;
        while let Some(&k) = members.get(next) {
            open.take_near(k as usize, 2.0 * overlap, &mut members);
            next += 1;
        }
        members.sort_unstable();
        found.push(island(places, members.into_iter().map(|k| k as usize).collect()));
    }
    found
}

fn island(places: &[StockHeight], members: Vec<usize>) -> LeftIsland {
    let area = members.iter().fold(0.0, |sum, &k| sum + places[k].area);
    let higher = |a: usize, b: usize| if places[b].height > places[a].height { b } else { a };
    let highest = members.iter().copied().reduce(higher).map_or_else(Point3::origin, |k| places[k].position);
    LeftIsland { places: members, area, highest }
}
