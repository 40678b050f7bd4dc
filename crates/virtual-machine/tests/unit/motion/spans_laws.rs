//! Laws of the parts of a move that are looked at.

use facemill_inverse_kinematics::Machine;

use super::*;

const LENGTH: f64 = 200.0;

/// X, Y, Z, B, C, the last one endless.
fn turned(turns: f64, mm: f64) -> [AxisValues; 2] {
    let start = AxisValues::from([100.0, 50.0, 300.0, 0.3, 0.2]);
    let mut end = start;
    end[4] += turns * TAU;
    end[0] += mm;
    [start, end]
}

fn spans(law: BlockLaw, [start, end]: &[AxisValues; 2]) -> Spans {
    Spans::new(&Machine::head_b_table_c().unwrap(), law, [start, end], LENGTH)
}

const LAWS: [BlockLaw; 4] = [
    BlockLaw::Rapid(RapidLaw::PerAxis),
    BlockLaw::Rapid(RapidLaw::Linear),
    BlockLaw::Cutting(CuttingLaw::AxesLinear),
    BlockLaw::Cutting(CuttingLaw::TipAndRotariesLinear),
];

/// The tip's positions on the turns that are left out are those on the turn that is kept.
#[test]
fn whole_turns_of_one_axis_alone_are_looked_at_once() {
    let machine = Machine::head_b_table_c().unwrap();
    for law in LAWS {
        let of_joints = turned(2777.3, 0.0);
        // With the tip held, linear axes go with the table.
        let tip = machine.cl_point(&of_joints[0], LENGTH).tip;
        let held = [of_joints[0], machine.with_tip_at(&of_joints[1], &tip, LENGTH).unwrap()];
        let ends = if law == BlockLaw::Cutting(CuttingLaw::TipAndRotariesLinear) { held } else { of_joints };
        let Spans { parts, repeated } = spans(law, &ends);
        let repeated = repeated.unwrap();
        assert_eq!(parts, [[repeated.to, 1.0]], "{law:?}");
        assert!((repeated.turns - 2776.3).abs() < 1e-6 && repeated.from == 0.0, "{repeated:?}");
        let motion = Motion::new(&machine, law, &ends[0], &ends[1], LENGTH).unwrap();
        for k in 0..40 {
            let t = repeated.to * f64::from(k) / 40.0;
            let turn = 1.0 - repeated.to;
            let again = t + turn * ((1.0 - t) / turn).floor();
            let [a, b] = [t, again].map(|t| motion.cl_at(t).unwrap());
            assert!((a.tip - b.tip).norm() < 1e-6, "{law:?}: {t} is not {again}");
        }
    }
}

#[test]
fn turns_beside_the_motion_of_another_axis_are_all_looked_at() {
    for law in [BlockLaw::Rapid(RapidLaw::Linear), BlockLaw::Cutting(CuttingLaw::AxesLinear)] {
        let Spans { parts, repeated } = spans(law, &turned(60.5, 30.0));
        assert!(repeated.is_none() && parts.len() == 61, "{law:?}: {}", parts.len());
        assert!(parts.windows(2).all(|p| p[0][1] == p[1][0]) && (parts[0][0], parts[60][1]) == (0.0, 1.0));
    }
    // Each axis at its own speed: the table turns on alone when X is there.
    let Spans { parts, repeated } = spans(BlockLaw::Rapid(RapidLaw::PerAxis), &turned(60.5, 30.0));
    let repeated = repeated.unwrap();
    assert!(parts.len() <= 3 && repeated.turns > 50.0, "{parts:?} {repeated:?}");
    assert!(parts[0][0] == 0.0 && parts.last() == Some(&[repeated.to, 1.0]));
    assert!(parts.iter().any(|p| p[1] == repeated.from));
}

#[test]
fn a_move_of_less_than_a_turn_is_one_part() {
    for law in LAWS {
        assert_eq!(spans(law, &turned(0.9, 0.0)), Spans { parts: vec![[0.0, 1.0]], repeated: None });
    }
}

#[test]
fn turns_without_end_beside_another_motion_wind_too_far_and_alone_they_do_not() {
    let machine = Machine::head_b_table_c().unwrap();
    let winds =
        |law, [start, end]: [AxisValues; 2]| LongTurns::default().add(&machine, law, [&start, &end], LENGTH).is_some();
    let (cut, rapid) = (BlockLaw::Cutting(CuttingLaw::AxesLinear), BlockLaw::Rapid(RapidLaw::Linear));
    assert!(winds(cut, turned(51.0, 5.0)) && !winds(cut, turned(49.0, 5.0)));
    assert!(winds(rapid, turned(201.0, 5.0)) && !winds(rapid, turned(199.0, 5.0)));
    assert!(!winds(cut, turned(2777.0, 0.0)));
    assert!(!winds(BlockLaw::Rapid(RapidLaw::PerAxis), turned(2777.0, 5.0)));
}

#[test]
fn turns_of_long_blocks_have_an_end_together_and_those_of_short_ones_do_not() {
    let machine = Machine::head_b_table_c().unwrap();
    let cut = BlockLaw::Cutting(CuttingLaw::AxesLinear);
    let followed = |turns: f64| {
        let mut sum = LongTurns::default();
        let [start, end] = turned(turns, 5.0);
        (0..1000).take_while(|_| sum.add(&machine, cut, [&start, &end], LENGTH).is_none()).count()
    };
    assert_eq!([40.0, 10.0, 0.99].map(followed), [12, 50, 1000]);
}
