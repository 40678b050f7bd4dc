use crate::motion::turned_rotaries::*;
use facemill_cl_data::CuttingLaw;
use facemill_inverse_kinematics::BlockLaw;

/// At any time, also at the pole, an axis that is said to go alone does so evenly.
#[test]
fn an_axis_that_turns_the_vector_alone_goes_evenly() {
    let machine = Machine::head_b_table_c().unwrap();
    let law = BlockLaw::Cutting(CuttingLaw::TipLinearVectorTurned);
    // B and C at both ends, and whether one of them does it alone.
    for (start, end, alone) in [
        ([0.0, 2.9], [0.3, 2.9], true),
        ([-0.4, -1.0], [-0.1, -1.0], true),
        ([0.5, 1.0], [0.0, 1.0], true),
        ([-0.4, -1.0], [0.5, -1.0], false),
        ([0.0, 0.0], [0.0, 2.9], true),
        ([0.0, 0.0], [0.0, 3.2], false),
        ([0.2, 0.0], [0.2, 1.0], false),
        ([0.2, 0.0], [0.3, 0.1], false),
    ] {
        let at = |[b, c]: [f64; 2]| AxisValues::from([100.0, -40.0, 700.0, b, c]);
        let (a, b) = (at(start), at(end));
        let b = machine.with_tip_at(&b, &machine.cl_point(&at(end), 200.0).tip, 200.0).unwrap();
        let motion = Motion::new(&machine, law, &a, &b, 200.0).unwrap();
        let turned = TurnedRotaries::new(&machine, motion, [&a, &b], 200.0).unwrap();
        assert_eq!(turned.alone.is_some(), alone, "{start:?} {end:?}");
        let way = (end[0] - start[0]).abs() + (end[1] - start[1]).abs();
        if alone {
            let [speed, change] = turned.over(0.25, 0.5).unwrap();
            assert!((speed - 0.25 * way).abs() < 1e-12 && change == 0.0);
            for k in 0..=200 {
                let t = f64::from(k) / 200.0;
                let (found, even) = (motion.at(t).unwrap(), a.lerp(&b, t));
                let off = (found[3] - even[3]).abs() + (found[4] - even[4]).abs();
                assert!(off < 1e-7, "{start:?} {end:?} {t}: {found:?}");
            }
        }
    }
}
