//! A machine of two heads and one table in one channel, for tests.

use crate::kit::{Random, spec, words};
use facemill_nc_program::words::AxisKind;
use facemill_nc_program::*;

pub(crate) const LENGTHS: [f64; 2] = [420.125, 231.5];

pub(crate) fn axis(name: &str) -> AxisLetter {
    name.parse().unwrap()
}

pub(crate) fn letters() -> Vec<AxisLetter> {
    ["C", "X1", "Y1", "Z1", "B1", "X2", "Y2", "Z2", "B2"].map(axis).to_vec()
}

pub(crate) fn heads() -> Vec<HeadSpec> {
    let one = spec(Vec::new());
    let second = ToolSpec {
        number: 12,
        name: "face mill D100".into(),
        length: LENGTHS[1],
        length_register: 31,
        ..one.tool.clone()
    };
    let head = |name: &str, n: u32, tool, spindle| HeadSpec {
        name: name.into(),
        spindle_axis: axis(&format!("Z{n}")),
        spindle_number: n,
        tool,
        spindle,
    };
    vec![
        head("left", 1, ToolSpec { length: LENGTHS[0], ..one.tool }, one.spindle),
        head("right", 2, second, SpindleSpec { rpm: 512.0, clockwise: false }),
    ]
}

pub(crate) fn map() -> WordMap {
    map_of(&heads()).unwrap()
}

/// Z2 points into the work.
pub(crate) fn map_of(heads: &[HeadSpec]) -> Result<WordMap, WordMapError> {
    let along = |l: &AxisLetter| match l.to_string().as_str() {
        "Z1" => 1.0,
        "Z2" => -1.0,
        _ => 0.0,
    };
    let offset = |k: usize| [0.3, 12.0, -7.5, 100.0, 0.0, -40.25, 3.0, 955.0, -0.1][k];
    let axes = letters().into_iter().enumerate();
    let axes = axes.map(|(k, l)| MappedAxis { letter: l, offset: offset(k), along_spindle: along(&l) });
    WordMap::with_heads(axes.collect(), WorkOffset::default(), heads.iter().map(HeadSpec::mapped).collect())
}

pub(crate) fn nine_axis_spec(blocks: Vec<Block>) -> ProgramSpec {
    let heads = heads();
    let one = spec(blocks);
    let is_z = |l: &AxisLetter| l.letter() == 'Z';
    let axis = |l: &AxisLetter| AxisSpec { letter: *l, min: -2e3, max: 2e3, along_spindle: is_z(l), work_offset: 1.5 };
    ProgramSpec {
        tool: heads[0].tool.clone(),
        spindle: heads[0].spindle,
        axes: letters().iter().map(axis).collect(),
        approach: None,
        ..one
    }
}

/// Joint values (mm, rad) of a start and `n` positions, in which axes often stand still.
pub(crate) fn random_joints(random: &mut Random, n: usize) -> Vec<Vec<f64>> {
    let value = |random: &mut Random, k: usize| {
        let span = if letters()[k].kind() == AxisKind::Linear { 900.0 } else { 3.0 };
        (random.unit() - 0.5) * span
    };
    let mut at: Vec<f64> = (0..9).map(|k| value(random, k)).collect();
    let mut all = vec![at.clone()];
    for _ in 0..n {
        let only_one_head = random.below(4);
        for (k, axis) in at.iter_mut().enumerate() {
            let stands = matches!((only_one_head, k), (1, 5..) | (2, 1..=4));
            if !stands && random.below(3) > 0 {
                *axis = value(random, k);
            }
        }
        all.push(at.clone());
    }
    all
}

pub(crate) fn words_of(values: &[(&str, f64)]) -> AxisWords {
    words(&values.iter().map(|(name, value)| (axis(name), *value)).collect::<Vec<_>>())
}
