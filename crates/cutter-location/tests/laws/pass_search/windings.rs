//! The cheapest sequence over all configurations: branches, and full turns of a limited axis.

use std::f64::consts::TAU;

use facemill_cl_data::{CcPoint, Pass, Silent};
use facemill_cutter_location::{
    Hints, PassSettings, PassTask, PoseTest, PostureMode, SearchCurve, SearchOrder, SearchSettings, Workcell,
    plan_passes, search,
};
use facemill_interference::MeshTree;
use facemill_inverse_kinematics::machine_file::{Joint, RevoluteRange};
use facemill_inverse_kinematics::{BranchPreference, Machine};
use facemill_tool_model::cl_from_cc;
use nalgebra::{Point3, Vector3};

use crate::kit::{Ball, Random, curve_deg, machine, obstacle, plane, posture_deg, tool, workcell};
use crate::pass_search::pass_costs::{Cost, SMOOTH, Stood};

/// How far the table turns to either side, rad.
const C_LIMIT: f64 = 400.0 * TAU / 360.0;
/// The only postures of the scenes, with rotates as the search takes them.
const ROTATES: [f64; 2] = [-20.0, -24.0];
const TILT: f64 = 12.0;

/// The preset with a table that turns a little more than once to either side, and its ram beside
/// the tool, so that the two branches hold it over different sides of the part.
fn wound() -> Machine {
    let mut file = machine().to_file();
    file.tool_chains[0].rows[2].bodies[0].position_mm[0] = 400.0;
    for row in &mut file.workpiece_chain.rows {
        if let Some(Joint::Revolute(c)) = &mut row.joint {
            c.range = RevoluteRange::Limited { min_deg: -C_LIMIT.to_degrees(), max_deg: C_LIMIT.to_degrees() };
        }
    }
    Machine::from_file(file).unwrap()
}

/// Points of the plane most of the way around a circle, where the table has to turn with the feed.
fn around() -> Vec<CcPoint> {
    let at = |angle: f64| {
        let (sin, cos) = angle.sin_cos();
        CcPoint::new(Point3::new(60.0 * cos, 60.0 * sin, 0.0), Vector3::z(), Vector3::new(-sin, cos, 0.0)).unwrap()
    };
    (0..4).map(|k| at(1.8 * f64::from(k))).collect()
}

/// Returns every configuration at a point: of both postures and the one that is searched, on both
/// branches, at every number of full turns of the table within its limits; with each, whether it is
/// free of collisions.
fn ways_to_stand(test: &PoseTest<'_>, cc: &CcPoint, curve: &SearchCurve) -> Vec<(Stood, bool)> {
    let (cell, hints) = (test.cell, &mut Hints::default());
    let c = cell.machine.axis_index("C").unwrap();
    let mut postures = ROTATES.map(|rotate| posture_deg(TILT, rotate)).to_vec();
    let found = search(test, cc, curve, &SearchSettings::default(), 0.0, None, hints);
    postures.extend(found.ok().map(|f| f.pose.posture).filter(|p| postures.iter().all(|q| q != p)).as_ref());
    let mut all = Vec::new();
    for posture in postures {
        let lifted = cl_from_cc(cell.tool.cutter(), cc, posture).translated(cc.normal.into_inner() * cell.max_lift);
        let solutions =
            cell.machine.inverse(&lifted.transformed(&cell.table_from_work), cell.tool.gauge_length()).unwrap();
        assert_eq!(solutions.iter().count(), 2, "both branches are within the limits");
        for solution in solutions.iter() {
            for turns in -3..=3 {
                let mut axes = solution.values;
                axes[c] += TAU * f64::from(turns);
                if axes[c].abs() <= C_LIMIT {
                    let free = test.gouge(&lifted, hints).is_none() && test.collision(&axes, hints).is_none();
                    all.push(((posture, axes), free));
                }
            }
        }
    }
    all
}

/// Selects some of the configurations.
fn only(ways: &[Vec<(Stood, bool)>], keep: impl Fn(&Stood, bool) -> bool) -> Vec<Vec<Stood>> {
    ways.iter().map(|of| of.iter().filter(|(s, free)| keep(s, *free)).map(|(s, _)| *s).collect()).collect()
}

/// Number of scenes in which each criterion decides.
#[derive(Debug, Default)]
struct Decides {
    blocked: usize,
    windings: usize,
    start: usize,
}

#[test]
fn the_graphs_optimum_is_that_of_all_branches_and_windings() {
    let machine = wound();
    let tool = tool(16.0, 2.0, 12.0);
    let part = MeshTree::new(&plane(400.0));
    let curve = curve_deg([TILT, ROTATES[0]], [TILT, ROTATES[1]], SearchOrder::TiltFirst, 1.0);
    let points = around();
    let c = machine.axis_index("C").unwrap();
    let length: f64 = points.windows(2).map(|p| (p[1].position - p[0].position).norm()).sum();
    let layer_time = length / SMOOTH.feed / (points.len() - 1) as f64;
    let mut random = Random(41);
    let mut decides = Decides::default();
    for preferred in [BranchPreference::Nearest, BranchPreference::Positive, BranchPreference::Negative] {
        let mut scenes = 0;
        while scenes < 6 {
            // As high as the ram, which is over another side of the part on the other branch.
            let mut at = |low: f64, high: f64| random.between(low, high);
            let center = Point3::new(at(-600.0, 600.0), at(-600.0, 600.0), at(700.0, 1300.0));
            let ball = MeshTree::new(&Ball { center, radius: 150.0 }.mesh());
            let obstacles = vec![obstacle("part", &part), obstacle("ball", &ball)];
            let cell = Workcell { preferred_branch: preferred, ..workcell(&machine, &tool, obstacles) };
            let test = PoseTest::new(&cell);
            let ways: Vec<_> = points.iter().map(|cc| ways_to_stand(&test, cc, &curve)).collect();
            let free = only(&ways, |_, free| free);
            let is_met = ways.iter().flatten().any(|(_, free)| !free);
            if !is_met || free.iter().any(Vec::is_empty) {
                continue;
            }
            scenes += 1;
            let task = PassTask { pass: Pass::new(points.clone()), curve, strips: Vec::new(), given: Vec::new() };
            let settings = PassSettings {
                search: SearchSettings::default(),
                mode: PostureMode::Smooth(SMOOTH),
                max_turn_per_mm: 1.0,
            };
            let planned = plan_passes(&test, &[task], &settings, &Silent).unwrap().remove(0);
            let cost = Cost { cell: &cell, points: &points, max_turn_per_mm: 1.0, feed: SMOOTH.feed, layer_time };
            let least = cost.least(&free);
            let optimum = planned.optimum.expect("a sequence was sought");
            assert!((optimum.graph - least).abs() < 1e-9 * least, "{preferred:?}: {} {least}", optimum.graph);
            let poses = planned.outcomes.points.iter().map(|o| o.as_ref().unwrap());
            let way: Vec<Stood> = poses.map(|pose| (pose.posture, pose.configuration.axes)).collect();
            let smoothed = cost.of(&way);
            assert!((optimum.smoothed - smoothed).abs() < 1e-9 * smoothed, "{} {smoothed}", optimum.smoothed);
            // The cheapest choice without one of the criteria.
            let differs = |other: f64| usize::from((other - least).abs() > 1e-6 * least);
            decides.blocked += differs(cost.least(&only(&ways, |_, _| true)));
            decides.windings += differs(cost.least(&only(&ways, |s, free| free && s.1[c].abs() <= 0.5 * TAU)));
            let anywhere = Workcell { preferred_branch: BranchPreference::Nearest, ..cell.clone() };
            decides.start += differs(Cost { cell: &anywhere, ..cost }.least(&free));
        }
    }
    println!("{decides:?} of 18 scenes");
    assert!(decides.blocked >= 3 && decides.windings >= 3 && decides.start >= 3, "{decides:?} of 18 scenes");
}
