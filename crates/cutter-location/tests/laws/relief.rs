//! What is told to help helps, and a little less does not.

use facemill_cutter_location::{
    Hints, PoseTest, Relief, SearchCurve, SearchOrder, SearchSettings, Workcell, reliefs, search,
};
use facemill_interference::MeshTree;
use facemill_tool_model::ToolAssembly;
use nalgebra::Point3;

use crate::kit::{Ball, cc_on_plane, curve_deg, machine, obstacle, plane, tool, workcell};

fn finds(cell: &Workcell<'_>, curve: &SearchCurve) -> bool {
    let test = PoseTest::new(cell);
    let settings = SearchSettings::default();
    search(&test, &cc_on_plane(0.0, 0.0), curve, &settings, 0.0, None, &mut Hints::default()).is_ok()
}

/// The change, or a part of the way to it.
fn changed(cell: &Workcell<'_>, curve: &SearchCurve, relief: Relief, part: f64) -> bool {
    let (end, tool) = (curve.end(), cell.tool);
    let to = |from: f64, to: f64| from + part * (to - from);
    let mut posture = end;
    let mut other: Option<ToolAssembly> = None;
    match relief {
        Relief::Tilt(tilt) => posture.tilt = to(end.tilt, tilt),
        Relief::Rotate(rotate) => posture.rotate = to(end.rotate, rotate),
        Relief::Radius(radius) => other = tool.with_radius(to(tool.cutter().radius(), radius)).ok(),
        Relief::StickOut(length) => other = tool.longer_by(part * (length - tool.stick_out())).ok(),
    }
    let curve = curve.with_end(posture).unwrap();
    match &other {
        Some(tool) => finds(&Workcell { tool, ..cell.clone() }, &curve),
        None => finds(cell, &curve),
    }
}

#[test]
fn reported_changes_free_the_point_and_95_percent_of_them_do_not() {
    let floor = MeshTree::new(&plane(900.0));
    let machine = machine();
    let tool = tool(25.0, 2.0, 20.0);
    let curve = curve_deg([2.0, 0.0], [10.0, -20.0], SearchOrder::TiltFirst, 1.0);
    let (mut told, mut kinds) = (0, std::collections::BTreeSet::new());
    // Behind and beside the cutter, at its flute, its body and its holder.
    for (x, y, z) in [
        (-40.0, 0.0, 3.0),
        (-52.0, 0.0, 4.0),
        (-30.0, 25.0, 6.0),
        (-20.0, -32.0, 5.0),
        (10.0, 0.0, 95.0),
        (12.0, 5.0, 70.0),
        (-60.0, 0.0, 75.0),
    ] {
        for radius in [3.0, 8.0] {
            let ball = Ball { center: Point3::new(x, y, z), radius };
            let tree = MeshTree::new(&ball.mesh());
            let cell = workcell(&machine, &tool, vec![obstacle("floor", &floor), obstacle("ball", &tree)]);
            let found = reliefs(&cell, &cc_on_plane(0.0, 0.0), &curve, &SearchSettings::default());
            if finds(&cell, &curve) {
                assert_eq!(found, []);
                continue;
            }
            for relief in found {
                assert!(changed(&cell, &curve, relief, 1.0), "{relief:?} does not help: {ball:?}");
                assert!(!changed(&cell, &curve, relief, 0.95), "less than {relief:?} helps, too: {ball:?}");
                told += 1;
                kinds.insert(match relief {
                    Relief::Tilt(_) => "tilt",
                    Relief::Rotate(_) => "rotate",
                    Relief::Radius(_) => "radius",
                    Relief::StickOut(_) => "stick-out",
                });
            }
        }
    }
    assert!(told >= 10 && kinds.len() == 4, "{told} told, {kinds:?}");
}
