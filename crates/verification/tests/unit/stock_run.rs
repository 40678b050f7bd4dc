use facemill_cl_data::SplitMix64;

use super::*;

fn block(line: u32, removed_mm3: f64, way_mm: f64) -> BlockCut {
    BlockCut { line, removed_mm3, way_mm, is_certain: false, may_be_near: false }
}

/// Whether a block is in air, as its definition says: distances between the blocks one by one.
fn is_in_air(blocks: &[BlockCut], beyond: &BTreeSet<u32>, around: f64, k: usize) -> bool {
    (0..blocks.len()).all(|other| {
        let cuts = blocks[other].removed_mm3 > 0.0 || beyond.contains(&blocks[other].line);
        let between = other.min(k) + 1..other.max(k);
        let way: f64 = blocks.get(between).unwrap_or(&[]).iter().map(|b| b.way_mm).sum();
        !cuts || (other != k && way > around)
    })
}

#[test]
fn blocks_in_air_are_far_from_every_block_that_cuts_or_is_not_covered() {
    let mut random = SplitMix64(22);
    for round in 0..200 {
        // Ways of halves: sums are exact in any order.
        let mut way = || (random.unit() * 8.0).floor() / 2.0;
        let ways: Vec<f64> = (0..round % 40).map(|_| way()).collect();
        let mut chance = |share: f64| random.unit() < share;
        let blocks: Vec<BlockCut> = (1..).zip(ways).map(|(n, way)| block(n, f64::from(chance(0.2)), way)).collect();
        let beyond: BTreeSet<u32> = blocks.iter().map(|b| b.line).filter(|_| chance(0.05)).collect();
        let expected: Vec<bool> = (0..blocks.len()).map(|k| is_in_air(&blocks, &beyond, 4.0, k)).collect();
        let found: Vec<bool> = removals(&blocks, &beyond, 4.0).iter().map(|b| b.is_in_air).collect();
        assert_eq!(found, expected, "{blocks:?}");
    }
}
