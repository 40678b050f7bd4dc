//! Words of straight motions, to compare a program posted from an APT file with that of the plan.

use std::collections::BTreeMap;

use facemill::nc_program::read::{AxisAt, MotionKind};
use facemill::nc_program::{Dialect, read_program};

/// Straight motion of a program: whether it is a rapid, and the word of each axis.
pub type StraightWords = (bool, BTreeMap<String, f64>);

/// Words of every straight motion of a FANUC program.
///
/// # Panics
/// When the text is no program.
pub fn straight_words(text: &str) -> Vec<StraightWords> {
    let program = read_program(text.as_bytes(), Dialect::Fanuc).expect("a program");
    let moves = program.motions().filter(|(_, m)| matches!(m.kind, MotionKind::Linear | MotionKind::Rapid));
    let words = moves.map(|(_, m)| {
        let at = m.position.iter().filter_map(|(letter, at)| match at {
            AxisAt::Word(word) => Some((letter.to_string(), word)),
            _ => None,
        });
        (m.kind == MotionKind::Rapid, at.collect())
    });
    words.collect()
}

/// Asserts that the words of two programs with six decimals are the same to 1e-6 mm and degrees:
/// none differs by more than a unit of the last decimal, and by this unit only words that lie in
/// the middle between two, one of a hundred at most.
///
/// # Panics
/// When they are not.
pub fn assert_same_words(planned: &[StraightWords], posted: &[StraightWords]) {
    assert_eq!(planned.len(), posted.len());
    let units = |value: f64| (value * 1e6).round() as i64;
    let (mut n, mut n_turned) = (0, 0);
    for (k, ((is_rapid, of_plan), (also_rapid, of_post))) in planned.iter().zip(posted).enumerate() {
        assert_eq!(is_rapid, also_rapid, "motion {k}");
        for (axis, value) in of_plan {
            let apart = (units(*value) - units(of_post[axis])).abs();
            assert!(apart <= 1, "motion {k}, {axis}: {value} and {}", of_post[axis]);
            n += 1;
            n_turned += apart;
        }
    }
    assert!(n > 100 && 100 * n_turned <= n, "{n_turned} of {n} words differ in the last decimal");
}
