use crate::pairs::shared_axis::*;
use facemill_inverse_kinematics::{Branch, Machine};
use nalgebra::{Isometry3, Point3, Vector3};

use crate::test_scene::{bare_cell, tool};

/// Postures with the axis at a value, compared with its signs along a scan forty times as dense, on
/// machines of both kinds.
#[test]
fn every_posture_with_the_value_is_found_and_has_it() {
    let views = Machine::heads_from_json(include_bytes!("../../../../../assets/machines/dual-c-horizontal-xzab.json"));
    let machines = [(Machine::head_b_table_c().unwrap(), 900.0), (views.unwrap().swap_remove(0), 150.0)];
    for (machine, mount) in machines {
        let tool = tool();
        let cell = bare_cell(&machine, &tool, Isometry3::translation(0.0, 350.0, mount));
        let test = PoseTest::new(&cell);
        let axis = machine.axis_index("C").unwrap();
        let range = PostureRange { tilt: [0.05, 0.25], rotate: [-1.5, 1.5] };
        let mut found = 0;
        for k in 0..12 {
            let lean = Vector3::new(0.5, 0.03 * f64::from(k) - 0.15, 1.0);
            let cc = CcPoint::new(Point3::new(3.0 * f64::from(k), 2.0, 0.0), lean, Vector3::x()).unwrap();
            let plain = Posture { tilt: 0.1, rotate: 0.0 };
            let cl = cl_from_cc(tool.cutter(), &cc, plain);
            let on_table = cl.transformed(&cell.table_from_work);
            let all = machine.inverse(&on_table, tool.gauge_length()).unwrap();
            let first = all.iter().next().unwrap();
            let near = Configuration { axes: first.values, branch: first.branch };
            assert!(matches!(near.branch, Branch::Positive | Branch::Negative));
            let shared = SharedAxis::new(&test, axis, range, cc, near);
            let Some([low, high]) = shared.values() else { continue };
            for part in [0.2, 0.5, 0.8] {
                let (value, tilt) = (low + part * (high - low), 0.05 + 0.2 * part);
                let roots = shared.on_tilt(tilt, value);
                for posture in &roots {
                    assert!((shared.value(*posture).unwrap() - value).abs() <= SHARED_ACCURACY);
                    found += 1;
                }
                let scan = (0..=1200).map(|i| {
                    let rotate = -1.5 + 3.0 * f64::from(i) / 1200.0;
                    shared.value(Posture { tilt, rotate }).map(|v| v - value)
                });
                let scan: Vec<Option<f64>> = scan.collect();
                let crosses = |w: &&[Option<f64>]| matches!((w[0], w[1]), (Some(a), Some(b)) if (a < 0.0) != (b < 0.0) && (a - b).abs() < 0.05);
                let crossings: Vec<usize> = (0..1200).filter(|&i| crosses(&&scan[i..i + 2])).collect();
                assert!(crossings.len() <= roots.len(), "{k} {part}: {crossings:?} {roots:?}");
            }
        }
        assert!(found > 10, "{found}");
    }
}
