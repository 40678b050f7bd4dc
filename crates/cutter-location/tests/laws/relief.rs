//! Proposed remedies help, and a little less does not: by dense scans of the curve, without either
//! search.

use facemill_cutter_location::{
    Hints, PoseTest, Remedy, SearchCurve, SearchOrder, SearchSettings, Workcell, reliefs, search,
};
use facemill_interference::MeshTree;
use facemill_tool_model::ToolAssembly;
use nalgebra::Point3;

use crate::kit::{Ball, Random, cc_on_plane, curve_deg, machine, obstacle, plane, posture_deg, tool, workcell};
use crate::rods::{beside, post, stretches};

/// Width of a blocked point: no feasible stretch of the curve of this length.
const WIDTH: f64 = 0.01;

/// Steps of a dense scan of the curve.
const N: usize = 1500;

fn finds(cell: &Workcell<'_>, curve: &SearchCurve) -> bool {
    let test = PoseTest::new(cell);
    let settings = SearchSettings::default();
    search(&test, &cc_on_plane(0.0, 0.0), curve, &settings, 0.0, None, &mut Hints::default()).is_ok()
}

/// Returns the feasible stretches of the curve with the change, or with a part of it, and whether
/// the paper's steps find one.
fn changed(cell: &Workcell<'_>, curve: &SearchCurve, relief: Remedy, part: f64) -> (Vec<[f64; 2]>, bool) {
    let (end, tool) = (curve.end(), cell.tool);
    let to = |from: f64, to: f64| from + part * (to - from);
    let mut posture = end;
    let mut other: Option<ToolAssembly> = None;
    match relief {
        Remedy::Tilt(tilt) => posture.tilt = to(end.tilt, tilt),
        Remedy::Rotate(rotate) => posture.rotate = to(end.rotate, rotate),
        Remedy::Radius(radius) => other = tool.with_radius(to(tool.cutter().radius(), radius)).ok(),
        Remedy::StickOut(length) => other = tool.longer_by(part * (length - tool.stick_out())).ok(),
        Remedy::CertifiedWidth(_) => panic!("nothing is stepped over without a change"),
    }
    let curve = curve.with_end(posture).unwrap();
    let other = other.as_ref().map(|tool| Workcell { tool, ..cell.clone() });
    let cell = other.as_ref().unwrap_or(cell);
    (stretches(&PoseTest::new(cell), &cc_on_plane(0.0, 0.0), &curve, N), finds(cell, &curve))
}

/// Checks a remedy against its description; returns whether the paper's steps find nothing with it.
fn hold(cell: &Workcell<'_>, curve: &SearchCurve, relief: Remedy) -> bool {
    let (enough, by_steps) = changed(cell, curve, relief, 1.0);
    assert!(!enough.is_empty(), "{relief:?} does not help");
    let (less, _) = changed(cell, curve, relief, 0.95);
    assert!(less.iter().all(|s| s[1] - s[0] < WIDTH), "less than {relief:?} helps, too: {less:?}");
    !by_steps
}

#[test]
fn reported_changes_free_the_point_and_95_percent_of_them_do_not() {
    let floor = MeshTree::new(&plane(900.0));
    let machine = machine();
    let tool = tool(25.0, 2.0, 20.0);
    let curve = curve_deg([2.0, 0.0], [10.0, -20.0], SearchOrder::TiltFirst, 1.0);
    let (mut reported, mut kinds) = (0, std::collections::BTreeSet::new());
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
                hold(&cell, &curve, relief);
                reported += 1;
                kinds.insert(match relief {
                    Remedy::Tilt(_) => "tilt",
                    Remedy::Rotate(_) => "rotate",
                    Remedy::Radius(_) => "radius",
                    Remedy::StickOut(_) => "stick-out",
                    Remedy::CertifiedWidth(_) => "width",
                });
            }
        }
    }
    assert!(reported >= 10 && kinds.len() == 4, "{reported} reported, {kinds:?}");
}

#[test]
fn a_change_that_opens_only_a_short_stretch_is_reported_and_less_of_it_opens_none() {
    let floor = MeshTree::new(&plane(900.0));
    let (machine, tool) = (machine(), tool(25.0, 2.0, 12.0));
    // Toward its end the tilt grows by degrees from one of the paper's steps to the next.
    let curve = curve_deg([2.0, 0.0], [8.0, -20.0], SearchOrder::RotateFirst, 1.0);
    let cc = cc_on_plane(0.0, 0.0);
    let mut random = Random(41);
    let (mut reported, mut past_steps) = (0, 0);
    for _ in 0..16 {
        // A rod under the rear of the cutter until it is tilted so far, and one before its front
        // from slightly later on.
        let free = posture_deg(random.between(11.0, 30.0), -20.0);
        let blocked = posture_deg(free.tilt.to_degrees() + random.between(0.4, 2.0), -20.0);
        let places = [
            beside(tool.cutter(), &cc, free, [-20.0, random.between(-5.0, 5.0), 0.1]),
            beside(tool.cutter(), &cc, blocked, [24.94, random.between(-3.0, 3.0), 10.5]),
        ];
        let rods = places.map(|p| MeshTree::new(&post(&p, 0.03)));
        let mut obstacles = vec![obstacle("floor", &floor)];
        obstacles.extend(rods.iter().map(|rod| obstacle("rod", rod)));
        let cell = workcell(&machine, &tool, obstacles);
        for relief in reliefs(&cell, &cc, &curve, &SearchSettings::default()) {
            reported += 1;
            past_steps += usize::from(hold(&cell, &curve, relief));
        }
    }
    assert!(reported >= 10 && past_steps >= 3, "{reported} reported, {past_steps} past the steps");
}

#[test]
fn a_skipped_posture_is_reported_with_the_width_that_finds_it() {
    let floor = MeshTree::new(&plane(900.0));
    let (machine, tool) = (machine(), tool(25.0, 2.0, 12.0));
    let curve = curve_deg([2.0, 0.0], [30.0, 0.0], SearchOrder::TiltFirst, 1.0);
    let cc = cc_on_plane(0.0, 0.0);
    let places = [
        beside(tool.cutter(), &cc, curve.at(0.43), [-20.0, 1.0, 0.1]),
        beside(tool.cutter(), &cc, curve.at(0.47), [24.94, 2.0, 10.5]),
    ];
    let rods = places.map(|p| MeshTree::new(&post(&p, 0.03)));
    let mut obstacles = vec![obstacle("floor", &floor)];
    obstacles.extend(rods.iter().map(|rod| obstacle("rod", rod)));
    let cell = workcell(&machine, &tool, obstacles);
    let found = stretches(&PoseTest::new(&cell), &cc, &curve, N);
    assert!(found.iter().any(|s| s[1] - s[0] >= WIDTH) && !finds(&cell, &curve), "{found:?}");
    assert_eq!(reliefs(&cell, &cc, &curve, &SearchSettings::default()), [Remedy::CertifiedWidth(WIDTH)]);
}
