//! How much more a certificate says than there is: proven depths of a written program's blocks
//! against depths at times close together, at places by the kit's own interpreter and kinematics.

use std::fmt::Write;

use facemill::cl_data::{ClPoint, Solid};
use facemill::cutter_location::tool_frame;
use facemill::interference::{Interference, MeshTree};
use facemill::tool_model::Cutter;
use serde_json::Value;

use crate::oracles::interpreter::Motion;
use crate::oracles::read_back::{ReadBack, TipAndAxis};

/// One block that cuts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BlockSlack {
    /// Line of the program.
    pub line: usize,
    /// The largest sampled depth, mm.
    pub sampled: f64,
    /// The proven depth, mm, where one is.
    pub proven: Option<f64>,
}

/// Sums over blocks.
#[derive(Clone, Debug, PartialEq)]
pub struct Slacks {
    /// Blocks with a certificate, rapids included.
    pub blocks: usize,
    /// Those that are certified.
    pub certified: usize,
    /// Blocks that cut and were sampled.
    pub sampled: usize,
    /// Proven minus sampled depth of the blocks with both, where the cutter is below the allowance,
    /// from the smallest, mm.
    pub slacks: Vec<f64>,
    /// Lines on which a sampled depth is more than the proven one by more than rounding.
    pub exceeded: Vec<usize>,
}

/// By what a sampled depth may exceed a certificate, mm: coordinates of metres from two kinematics.
const ROUNDING: f64 = 1e-6;

/// The blocks of a program that cut, each sampled at `times` intervals of its time. `motion.from`
/// to `motion.to` linear in the words, which is the law of a machine with linear axes, and of one
/// under RTCP with linear rotaries.
///
/// # Panics
/// When the cutter has no corner radius: a distance does not give its depth then.
pub fn sample(
    back: &ReadBack,
    cutter: &Cutter,
    motions: &[Motion],
    certificates: &Value,
    times: u32,
    threads: usize,
) -> Vec<BlockSlack> {
    assert!(cutter.corner_radius() > 0.0, "a cutter with a corner radius");
    let grounds: Vec<(MeshTree, f64)> =
        back.grounds.iter().map(|g| (MeshTree::new(&g.bins.mesh()), g.allowance)).collect();
    let proven = proven_depths(certificates);
    let cuts: Vec<&Motion> = motions.iter().filter(|m| !m.rapid && m.from != m.to).collect();
    let one = |m: &Motion| {
        let places = (0..=times).map(|k| back.tool(&m.from.lerp(&m.to, f64::from(k) / f64::from(times)), m.rtcp));
        let sampled = places.map(|p| deepest(&grounds, cutter, &p)).fold(0.0, f64::max);
        BlockSlack { line: m.line, sampled, proven: proven.get(&m.line).copied().flatten() }
    };
    let share = cuts.len().div_ceil(threads.max(1)).max(1);
    std::thread::scope(|scope| {
        let workers: Vec<_> =
            cuts.chunks(share).map(|chunk| scope.spawn(|| chunk.iter().map(|m| one(m)).collect::<Vec<_>>())).collect();
        workers.into_iter().flat_map(|w| w.join().expect("no panic in a worker")).collect()
    })
}

/// Proven depths by line.
fn proven_depths(certificates: &Value) -> std::collections::BTreeMap<usize, Option<f64>> {
    let all = certificates["certificates"].as_array().expect("a list");
    all.iter().map(|c| (c["line"].as_u64().expect("a line") as usize, c["depth_mm"].as_f64())).collect()
}

/// How deep the cutter is in what must stay at a place, up to its corner radius; infinite where it
/// is deeper.
fn deepest(grounds: &[(MeshTree, f64)], cutter: &Cutter, (tip, axis): &TipAndAxis) -> f64 {
    let core = Solid::Frustum(cutter.core());
    let pose = tool_frame(&ClPoint { tip: *tip, axis: *axis });
    let of = |(mesh, allowance): &(MeshTree, f64)| {
        let skin = cutter.corner_radius() + allowance;
        match mesh.core_distance(&core, &pose, skin, None) {
            None => 0.0,
            Some(s) if s.distance > 0.0 => skin - s.distance,
            Some(_) => f64::INFINITY,
        }
    };
    grounds.iter().map(of).fold(0.0, f64::max)
}

impl Slacks {
    /// Of the sampled blocks of a program and the file of its certificates.
    ///
    /// # Panics
    /// When the file is no file of certificates.
    pub fn of(blocks: &[BlockSlack], certificates: &Value) -> Self {
        let count = |key: &str| certificates[key].as_u64().expect("a number") as usize;
        let both = |b: &BlockSlack| b.proven.map(|proven| proven - b.sampled);
        let mut slacks: Vec<f64> = blocks.iter().filter(|b| b.sampled > 0.0).filter_map(both).collect();
        slacks.sort_by(f64::total_cmp);
        let exceeded = blocks.iter().filter(|b| both(b).is_some_and(|s| s < -ROUNDING)).map(|b| b.line).collect();
        Self { blocks: count("blocks"), certified: count("certified"), sampled: blocks.len(), slacks, exceeded }
    }

    /// The slack that a part of the touching blocks does not exceed, mm; NaN where none touches.
    pub fn quantile(&self, part: f64) -> f64 {
        let last = self.slacks.len().saturating_sub(1);
        self.slacks.get((part * last as f64).round() as usize).copied().unwrap_or(f64::NAN)
    }

    /// A few lines for a person.
    pub fn summary(&self) -> String {
        let mut text = String::new();
        let part = 100.0 * self.certified as f64 / self.blocks.max(1) as f64;
        let _ = writeln!(text, "blocks              {}, certified {} ({part:.2} %)", self.blocks, self.certified);
        let _ =
            writeln!(text, "sampled cuts        {}, of them below the allowance {}", self.sampled, self.slacks.len());
        for (name, part) in [("median", 0.5), ("90 %", 0.9), ("largest", 1.0)] {
            let _ = writeln!(text, "slack, {name:<12} {:.2} µm", 1e3 * self.quantile(part));
        }
        let _ = writeln!(text, "sampled deeper than certified: {} blocks", self.exceeded.len());
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slacks_are_of_blocks_that_touch_and_deeper_samples_are_reported() {
        let block = |line, sampled, proven| BlockSlack { line, sampled, proven };
        let file = serde_json::json!({ "blocks": 9, "certified": 6 });
        let all = [
            block(1, 0.0, Some(0.0)),
            block(2, 0.010, Some(0.012)),
            block(3, 0.010, None),
            block(4, 0.010, Some(0.009)),
            block(5, 0.010, Some(0.015)),
        ];
        let s = Slacks::of(&all, &file);
        assert_eq!((s.blocks, s.certified, s.sampled, s.slacks.len()), (9, 6, 5, 3));
        assert!((s.quantile(0.5) - 0.002).abs() < 1e-12 && (s.quantile(1.0) - 0.005).abs() < 1e-12);
        assert_eq!(s.exceeded, [4]);
        assert!(s.summary().contains("certified 6 (66.67 %)"), "{}", s.summary());
    }
}
