//! Two heads that share an axis.

use facemill_cl_data::{CcPoint, Silent};
use facemill_cutter_location::cusp::cut_point::Strip;
use facemill_cutter_location::{
    Configuration, PairBlocked, PairPose, PairSettings, PairStation, PairTest, PoseTest, PostureRange, Workcell,
    plan_pair,
};
use facemill_interference::MeshTree;
use facemill_inverse_kinematics::{Machine, preset_dual_xyzb};
use facemill_sample_parts::PatchSpec;
use facemill_surface_model::TriMesh;
use facemill_tool_model::{Cusp, Outline, ToolAssembly, cl_from_cc, cusp_height_between};
use nalgebra::{Isometry3, Point3, Unit, Vector3};

use crate::kit::{obstacle, tool, workcell};

/// Middle of the part above the table frame's origin, along C; and its distance from C, along which
/// the heads' B turns, mm.
const ALONG: f64 = 150.0;
const OUT: f64 = 350.0;

/// The plate lies across the heads like a blade at its pitch: along C itself neither head's
/// solution would be regular.
fn table_from_work() -> Isometry3<f64> {
    Isometry3::translation(0.0, OUT, ALONG) * Isometry3::rotation(Vector3::y() * 35.0_f64.to_radians())
}

/// A plate 20 mm thick across C, waves on both sides.
fn plate() -> (PatchSpec, TriMesh) {
    let spec = PatchSpec::new([160.0, 60.0], 3.0, [1.0, 1.0]).unwrap();
    let front = facemill_sample_parts::patch(&spec, 80, 30).unwrap();
    let vertices: Vec<Point3<f64>> = front.vertices().iter().map(|p| Point3::new(p.x, p.y, p.z - 20.0)).collect();
    let back = front.triangles().iter().map(|t| [t[0], t[2], t[1]]).collect();
    (spec, front.joined(&TriMesh::new(vertices, back).unwrap()))
}

/// CC points of both sides at the same places.
fn stations(spec: &PatchSpec, n: usize) -> Vec<PairStation> {
    let mut last: Option<[CcPoint; 2]> = None;
    (0..n)
        .map(|k| {
            let x = -60.0 + 120.0 * k as f64 / (n - 1) as f64;
            let p = spec.at(x, 5.0);
            let front = CcPoint::new(p.point, p.normal.into_inner(), Vector3::x()).unwrap();
            let below = Point3::new(p.point.x, p.point.y, p.point.z - 20.0);
            let back = CcPoint::new(below, -p.normal.into_inner(), Vector3::x()).unwrap();
            let cc = [front, back];
            let way = last.map_or([0.0; 2], |l| [0, 1].map(|h: usize| (cc[h].position - l[h].position).norm()));
            last = Some(cc);
            PairStation { cc, way }
        })
        .collect()
}

fn heads(tools: &[ToolAssembly; 2]) -> [Machine; 2] {
    heads_of(preset_dual_xyzb(), tools)
}

fn heads_of(file: &str, tools: &[ToolAssembly; 2]) -> [Machine; 2] {
    let views = Machine::heads_from_json(file.as_bytes()).unwrap();
    [0, 1].map(|h: usize| views[h].with_tool_in_other_head(&tools[1 - h].whole(), tools[1 - h].gauge_length()))
}

fn cells<'a>(machines: &'a [Machine; 2], tools: &'a [ToolAssembly; 2], part: &'a MeshTree) -> [Workcell<'a>; 2] {
    [0, 1].map(|h: usize| Workcell {
        table_from_work: table_from_work(),
        ..workcell(&machines[h], &tools[h], vec![obstacle("plate", part)])
    })
}

fn settings(tilt: [f64; 2], shared_tests: f64) -> PairSettings {
    let range = PostureRange { tilt: tilt.map(f64::to_radians), rotate: [-85.0, 85.0].map(f64::to_radians) };
    PairSettings {
        ranges: [range; 2],
        feeds: [20.0, 25.0],
        cusps: [0.1; 2],
        strips: [Strip::on_plane(5.0); 2],
        max_turn_per_mm: 0.02,
        spacing: shared_tests,
    }
}

/// Returns the configuration of the first head at the first station, by the machine's own solution.
fn start(test: &PoseTest<'_>, station: &PairStation, tilt_deg: f64) -> Configuration {
    let posture = crate::kit::posture_deg(tilt_deg, 0.0);
    let cl = cl_from_cc(test.cell.tool.cutter(), &station.cc[0], posture).transformed(&test.cell.table_from_work);
    let all = test.cell.machine.inverse(&cl, test.cell.tool.gauge_length()).unwrap();
    let upper = all.iter().max_by(|a, b| a.values[2].total_cmp(&b.values[2])).unwrap();
    Configuration { axes: upper.values, branch: upper.branch }
}

struct Planned {
    stations: Vec<PairStation>,
    poses: Vec<Result<PairPose, PairBlocked>>,
    machines: [Machine; 2],
    tools: [ToolAssembly; 2],
}

fn planned(spacing: f64) -> Planned {
    planned_on(preset_dual_xyzb(), spacing)
}

fn planned_on(machine_file: &str, spacing: f64) -> Planned {
    let (spec, mesh) = plate();
    let part = MeshTree::new(&mesh);
    let tools = [tool(16.0, 2.0, 6.0), tool(12.0, 1.5, 5.0)];
    let machines = heads_of(machine_file, &tools);
    let of_heads = cells(&machines, &tools, &part);
    let tests = [PoseTest::new(&of_heads[0]), PoseTest::new(&of_heads[1])];
    let shared = (0..9).find(|&k| machines[0].is_shared(k)).unwrap();
    let pair = PairTest { tests: [&tests[0], &tests[1]], shared };
    let stations = stations(&spec, 61);
    // The position of an endless axis: a reference only.
    let endless = heads(&tools);
    let start = start(&PoseTest::new(&cells(&endless, &tools, &part)[0]), &stations[0], 3.0);
    let poses = plan_pair(&pair, &stations, &settings([3.0, 15.0], spacing), &start, &Silent).unwrap();
    drop(tests);
    Planned { stations, poses, machines, tools }
}

/// Every pose has one value of the shared axis, both tips and axes as their postures define them,
/// postures in range, cutters outside the plate, and heads that are apart.
#[test]
fn both_heads_stand_where_they_were_planned() {
    let planned = planned(6.0);
    let n_ok = planned.poses.iter().filter(|p| p.is_ok()).count();
    assert_eq!(n_ok, planned.poses.len(), "{:?}", planned.poses.iter().find(|p| p.is_err()));
    for (station, pose) in planned.stations.iter().zip(&planned.poses) {
        let pose = pose.as_ref().unwrap();
        for h in 0..2 {
            let (machine, tool) = (&planned.machines[h], &planned.tools[h]);
            let work_from_table = table_from_work().inverse();
            let stands = machine.cl_point(&pose.axes, tool.gauge_length()).transformed(&work_from_table);
            let cc = station.cc[h];
            let lifted = CcPoint { position: cc.position + cc.normal.into_inner() * pose.poses[h].lift, ..cc };
            let wanted = cl_from_cc(tool.cutter(), &lifted, pose.poses[h].posture);
            assert!((stands.tip - wanted.tip).norm() < 1e-7, "head {h}: {} from {}", stands.tip, wanted.tip);
            assert!(angle(&stands.axis, &wanted.axis) < 1e-9);
            let tilt = pose.poses[h].posture.tilt.to_degrees();
            assert!((3.0 - 1e-9..=15.0 + 1e-9).contains(&tilt), "tilt {tilt}");
            assert!(machine.first_beyond_limit(&pose.axes).is_none());
            let outline = Outline::new(tool.cutter(), pose.poses[h].posture);
            let strip = settings([3.0, 15.0], 1.0).strips[h];
            let cusp = cusp_height_between(&outline, &outline, strip.step_over, &strip.curvature);
            assert!(matches!(cusp, Cusp::Height(height) if height <= 0.1), "head {h}: {cusp:?}");
        }
    }
}

fn angle(a: &Unit<Vector3<f64>>, b: &Unit<Vector3<f64>>) -> f64 {
    a.cross(b).norm().atan2(a.dot(b))
}

/// The shared axis moves evenly: its steps are no larger than the normals' own turn and the tilts'
/// range explain.
#[test]
fn the_shared_axis_does_not_jump() {
    let planned = planned(6.0);
    let machine = &planned.machines[0];
    let shared = (0..9).find(|&k| machine.is_shared(k)).unwrap();
    let values: Vec<f64> = planned.poses.iter().map(|p| p.as_ref().unwrap().axes[shared]).collect();
    let steps: Vec<f64> = values.windows(2).map(|w| w[1] - w[0]).collect();
    let bends = steps.windows(2).map(|w| (w[1] - w[0]).abs()).fold(0.0, f64::max);
    assert!(steps.iter().all(|s| s.abs() < 0.06), "{steps:?}");
    assert!(bends < 0.02, "{bends}");
}

/// A limited shared axis has the values of an endless one, at turns within its limits, and changes
/// the turn once where one end of its travel lies on the way.
#[test]
fn a_limited_shared_axis_goes_as_far_as_its_limits_and_on_from_the_other() {
    let file: serde_json::Value = serde_json::from_str(preset_dual_xyzb()).unwrap();
    let endless = planned(6.0);
    let shared = (0..9).find(|&k| endless.machines[0].is_shared(k)).unwrap();
    let value = |p: &Result<PairPose, PairBlocked>| p.as_ref().unwrap().axes[shared].to_degrees();
    let values: Vec<f64> = endless.poses.iter().map(value).collect();
    let (low, high) = values.iter().fold((f64::MAX, f64::MIN), |(a, b), v| (a.min(*v), b.max(*v)));
    assert!(high - low > 2.0, "{low} to {high}");
    let part_way = 0.5 * (low + high);
    for (limits, changes) in [([low - 1.0, high + 1.0], 0), ([part_way - 360.0, part_way], 1), ([-900.0, -180.0], 0)] {
        let mut limited = file.clone();
        let joint = limited.pointer_mut("/workpiece_chain/rows/1/joint/revolute").unwrap();
        joint["range"] = serde_json::json!({ "limited": { "min_deg": limits[0], "max_deg": limits[1] } });
        joint["home_deg"] = serde_json::json!(limits[0] + 1.0);
        let found = planned_on(&limited.to_string(), 6.0);
        let turned: Vec<f64> = found.poses.iter().map(value).collect();
        for (a, b) in turned.iter().zip(&values) {
            assert!((limits[0] - 1e-9..=limits[1] + 1e-9).contains(a), "{a} in {limits:?}");
            let turns = (a - b) / 360.0;
            assert!((turns - turns.round()).abs() < 1e-6, "{a} for {b}");
        }
        let jumps = turned.windows(2).filter(|w| (w[1] - w[0]).abs() > 180.0).count();
        // The way may pass the limit more than once where it turns back there.
        let crossings = values.windows(2).filter(|w| (w[0] > limits[1]) != (w[1] > limits[1])).count();
        assert!(
            jumps == 0 && changes == 0 || changes == 1 && (1..=crossings).contains(&jumps),
            "{limits:?}: {turned:?}"
        );
    }
}

/// Both heads are refused because of each other where they should be at the same place with nothing
/// between them.
#[test]
fn heads_in_one_place_are_refused() {
    let far = crate::kit::plane(10.0).transformed(&Isometry3::translation(0.0, 0.0, -2000.0));
    let part = MeshTree::new(&far);
    let tools = [tool(16.0, 2.0, 6.0), tool(16.0, 2.0, 6.0)];
    let machines = heads(&tools);
    let cells = cells(&machines, &tools, &part);
    let tests = [PoseTest::new(&cells[0]), PoseTest::new(&cells[1])];
    let shared = (0..9).find(|&k| machines[0].is_shared(k)).unwrap();
    let pair = PairTest { tests: [&tests[0], &tests[1]], shared };
    // A plate of negative thickness: each head cuts 30 mm beyond the other's side.
    let at =
        |z: f64, up: f64| CcPoint::new(Point3::new(0.0, 0.0, z), Vector3::new(0.3, 0.0, up), Vector3::x()).unwrap();
    for (apart, collides) in [(-30.0, true), (60.0, false)] {
        let stations: Vec<PairStation> = (0..3)
            .map(|k| {
                let shift = Vector3::new(2.0 * f64::from(k), 0.0, 0.0);
                let mut cc = [at(0.5 * apart, 1.0), at(-0.5 * apart, -1.0)];
                cc.iter_mut().for_each(|cc| cc.position += shift);
                PairStation { cc, way: [if k > 0 { 2.0 } else { 0.0 }; 2] }
            })
            .collect();
        let start = start(&tests[0], &stations[0], 3.0);
        let poses = plan_pair(&pair, &stations, &settings([3.0, 15.0], 1.0), &start, &Silent).unwrap();
        for pose in &poses {
            assert_eq!(matches!(pose, Err(PairBlocked::Together { .. })), collides, "{apart}: {pose:?}");
            assert_eq!(pose.is_ok(), !collides, "{apart}: {pose:?}");
        }
    }
}
