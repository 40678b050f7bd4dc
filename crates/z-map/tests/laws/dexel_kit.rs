//! Cutters as implicit functions, and lines through them by search: nothing of the code under test.

use facemill_cl_data::ClPoint;
use facemill_tool_model::Cutter;
use facemill_z_map::{Cut, DexelMap, Interval, Sweep, TurnedBody};
use nalgebra::{Isometry3, Point3, Unit, Vector3};

use crate::kit::Random;

/// Pose with this tip and axis, in any length.
pub(crate) fn pose(tip: [f64; 3], axis: [f64; 3]) -> ClPoint {
    ClPoint { tip: Point3::from(tip), axis: Unit::new_normalize(Vector3::from(axis)) }
}

pub(crate) fn upright(tip: [f64; 3]) -> ClPoint {
    pose(tip, [0.0, 0.0, 1.0])
}

/// A box whose lines are along the workpiece's z.
pub(crate) fn block(low: [f64; 3], high: [f64; 3], cell: f64) -> DexelMap {
    DexelMap::of_box(&Isometry3::identity(), low, high, cell).expect("the box is a box")
}

pub(crate) fn body(radius: f64, corner_radius: f64, flute_length: f64) -> TurnedBody {
    TurnedBody::of_cutter(&Cutter::new(radius, corner_radius, flute_length).expect("lengths are in range"))
}

/// Removes one sweep, and checks the map and that the volume is what the map lost.
pub(crate) fn cut(map: &mut DexelMap, body: &TurnedBody, from: ClPoint, to: ClPoint, tolerance: f64) -> Cut {
    cut_all(map, &[Sweep { body, from, to }], tolerance)[0]
}

/// Removes sweeps at once, and checks the map and that their volume is what the map lost.
pub(crate) fn cut_all(map: &mut DexelMap, sweeps: &[Sweep], tolerance: f64) -> Vec<Cut> {
    let before = map.volume();
    let cuts = map.remove_all(sweeps, tolerance).expect("the motions are in range");
    map.check_invariants().expect("the map is sound");
    let lost: f64 = cuts.iter().map(|cut| cut.volume).sum();
    assert!((before - map.volume() - lost).abs() < 1e-9 * before.max(1.0), "{cuts:?}");
    cuts
}

/// How far a point is outside a cutter, or less; 0 or below inside. Convex.
pub(crate) fn outside(cutter: [f64; 3], pose: &ClPoint, p: &Point3<f64>) -> f64 {
    let [radius, corner, flute] = cutter;
    let v = p - pose.tip;
    let z = v.dot(&pose.axis);
    let radial = v.cross(&pose.axis).norm();
    let out = radial - (radius - corner);
    let rounded = if out > 0.0 && z < corner { out.hypot(z - corner) } else { out.max(corner - z) } - corner;
    rounded.max(z - flute)
}

/// Where a line along z is inside a cutter dilated by a length (or a little more at sharp edges).
pub(crate) fn stamp(cutter: [f64; 3], dilation: f64, pose: &ClPoint, [x, y]: [f64; 2]) -> Option<[f64; 2]> {
    let f = |z: f64| outside(cutter, pose, &Point3::new(x, y, z)) - dilation;
    let reach = 2.0 * (cutter[0] + cutter[2] + dilation + 1.0);
    let (far_low, far_high) = (pose.tip.z - reach, pose.tip.z + reach);
    let (mut low, mut high) = (far_low, far_high);
    for _ in 0..70 {
        let (a, b) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
        if f(a) < f(b) { high = b } else { low = a }
    }
    let inside = 0.5 * (low + high);
    if f(inside) > 0.0 {
        return None;
    }
    let root = |mut out: f64| {
        let mut within = inside;
        for _ in 0..46 {
            let middle = 0.5 * (out + within);
            if f(middle) > 0.0 { out = middle } else { within = middle }
        }
        within
    };
    Some([root(far_low), root(far_high)])
}

/// The union of the intervals of stamps along a sweep.
pub(crate) fn stamps(cutter: [f64; 3], dilation: f64, sweep: &Sweep, n: u32, at: [f64; 2]) -> Vec<[f64; 2]> {
    let along = (0..=n).filter_map(|k| stamp(cutter, dilation, &sweep.at(f64::from(k) / f64::from(n)), at));
    let mut parts: Vec<[f64; 2]> = along.collect();
    parts.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let mut union: Vec<[f64; 2]> = Vec::new();
    for part in parts {
        match union.last_mut() {
            Some(last) if part[0] <= last[1] => last[1] = last[1].max(part[1]),
            _ => union.push(part),
        }
    }
    union
}

/// Returns the longest piece of `inner` outside of `outer`.
pub(crate) fn longest_outside(inner: &[[f64; 2]], outer: &[[f64; 2]]) -> f64 {
    let mut longest: f64 = 0.0;
    for &[from, to] in inner {
        let mut at = from;
        for o in outer.iter().filter(|o| o[1] > from && o[0] < to) {
            longest = longest.max(o[0] - at);
            at = at.max(o[1]);
        }
        longest = longest.max(to - at);
    }
    longest
}

/// Returns the losses of a line of a block that reached from `low` to `high`.
pub(crate) fn lost(left: impl Iterator<Item = Interval>, low: f64, high: f64) -> Vec<[f64; 2]> {
    let mut lost = Vec::new();
    let mut at = low;
    for Interval { bottom, top } in left {
        if bottom > at {
            lost.push([at, bottom]);
        }
        at = top;
    }
    if at < high {
        lost.push([at, high]);
    }
    lost
}

pub(crate) fn direction(random: &mut Random) -> [f64; 3] {
    random.vector(1.0).into()
}
