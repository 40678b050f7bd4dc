//! The Bézier search at the CC points of the peer harness' scenes, and smooth passes over them, on
//! one thread: cutter R 25 r 2, holder and box of the harness on the head of the B-head, C-table
//! mill.
//!
//! `PEER_DATA=… cargo run --release -p facemill-benches --bin peer-search -- [SCENE] [RUNS]`

use facemill_benches::peer::{cpu_time, load_cc, load_mesh};
use facemill_benches::{search_curve, work_cell};
use facemill_cl_data::{CcPoint, Pass, Silent};
use facemill_cutter_location::cusp::cut_point::Strip;
use facemill_cutter_location::{
    Hints, PassSettings, PassTask, PoseTest, PostureMode, SearchSettings, SmoothSettings, plan_passes, search,
};
use facemill_interference::MeshTree;
use facemill_inverse_kinematics::Machine;
use facemill_inverse_kinematics::machine_file::{BodyFile, ShapeFile};
use facemill_surface_model::{Surface, SurfaceSettings, TriMesh};
use facemill_tool_model::{FormatTag, Section, SpindleRotation, Stack, ToolAssembly, ToolFile};
use nalgebra::{Point3, Vector3};

/// Passes over a scene, and points of each.
const PASSES: [usize; 2] = [50, 200];

/// mm between passes, for the cusp.
const STEP_OVER: f64 = 3.4;

fn main() {
    let mut arguments = std::env::args().skip(1);
    let scene = arguments.next().unwrap_or_else(|| "patch_200k".to_owned());
    let runs: usize = arguments.next().and_then(|n| n.parse().ok()).unwrap_or(3);
    let family = scene.split('_').next().unwrap_or("");
    let mesh = load_mesh(&scene);
    let tree = MeshTree::new(&mesh);
    let (machine, tool) = (machine(), tool());
    let cell = work_cell(&machine, &tool, &tree, 0.05);
    let test = PoseTest::new(&cell);
    let (curve, settings) = (search_curve(), SearchSettings::default());
    let points: Vec<CcPoint> = load_cc(family)
        .into_iter()
        .map(|(p, normal)| CcPoint::new(p, normal.into_inner(), Vector3::x()).expect("no normal lies along x"))
        .collect();
    let single = |scene: &str| {
        let (seconds, planned) = median_time(runs, || {
            let mut hints = Hints::default();
            points.iter().filter(|cc| search(&test, cc, &curve, &settings, 0.0, None, &mut hints).is_ok()).count()
        });
        println!("{scene}: search at {} points {seconds:.2} s, {planned} feasible", points.len());
    };
    single(&scene);
    let task =
        |points: Vec<CcPoint>| PassTask { pass: Pass::new(points), curve, strips: Vec::new(), given: Vec::new() };
    let tasks: Vec<PassTask> = passes(family, mesh).into_iter().map(task).collect();
    let n: usize = tasks.iter().map(|t| t.pass.points.len()).sum();
    let smooth = SmoothSettings { feed: 20.0, cusp: 0.1, strip: Strip::on_plane(STEP_OVER), widest: STEP_OVER };
    let settings =
        PassSettings { search: settings, mode: PostureMode::Smooth(smooth), max_turn_per_mm: 0.1f64.to_radians() };
    let one_core = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    let (seconds, planned) = one_core.install(|| {
        median_time(runs, || {
            let planned = plan_passes(&test, &tasks, &settings, &Silent).expect("nobody cancels");
            planned.iter().flat_map(|p| &p.outcomes.points).filter(|o| o.is_ok()).count()
        })
    });
    println!("{scene}: smooth passes of {n} points {seconds:.2} s, {planned} feasible");
}

/// Median processor time of this thread, and the last result.
fn median_time<T>(runs: usize, mut f: impl FnMut() -> T) -> (f64, T) {
    let mut timed = || {
        let start = cpu_time();
        let result = f();
        (cpu_time() - start, result)
    };
    let (first, mut result) = timed();
    let mut times = vec![first];
    for _ in 1..runs.max(1) {
        let (time, next) = timed();
        times.push(time);
        result = next;
    }
    times.sort_by(f64::total_cmp);
    (times[times.len() / 2], result)
}

/// Passes seen from above: along x over the patch, on cylinders about z over the harness' first
/// blade.
fn passes(family: &str, mesh: TriMesh) -> Vec<Vec<CcPoint>> {
    let surface = Surface::new(mesh, SurfaceSettings::default());
    let down = -Vector3::z_axis();
    let seen = |x: f64, y: f64, feed: Vector3<f64>| {
        let hit = surface.ray(&Point3::new(x, y, 1000.0), &down, 2000.0)?;
        let normal = surface.normal_at(&hit.point).into_inner();
        CcPoint::new(hit.point.position, normal, feed).ok().filter(|_| normal.z > 0.3)
    };
    let share = |k: usize, n: usize| k as f64 / (n - 1) as f64;
    let at = |j: usize, k: usize| {
        let (across, along) = (share(j, PASSES[0]), share(k, PASSES[1]));
        if family == "prop" {
            let radius = 75.0 + 160.0 * across;
            let (sin, cos) = (0.9 * along - 0.3).sin_cos();
            seen(radius * cos, radius * sin, Vector3::new(-sin, cos, 0.0))
        } else {
            seen(170.0 * along - 85.0, 170.0 * across - 85.0, Vector3::x())
        }
    };
    (0..PASSES[0]).map(|j| (0..PASSES[1]).filter_map(|k| at(j, k)).collect()).collect()
}

/// The harness' cutter and holder.
fn tool() -> ToolAssembly {
    let holder = Section { length_mm: 100.0, diameter_low_mm: 63.0, diameter_high_mm: 63.0 };
    ToolAssembly::new(ToolFile {
        format: FormatTag::V1,
        name: "R 25 r 2".to_owned(),
        number: 1,
        length_register: None,
        radius_mm: 25.0,
        corner_radius_mm: 2.0,
        n_inserts: 6,
        flute_length_mm: 50.0,
        dead_core_radius_mm: 12.0,
        max_ramp_angle_deg: 2.0,
        spindle_rotation: SpindleRotation::Clockwise,
        cutting_edge_angle_deg: None,
        stick_out_mm: 50.0,
        gauge_length_mm: 150.0,
        body: Stack { clearance_mm: 0.0, sections: Vec::new() },
        holder: Stack { clearance_mm: 0.0, sections: vec![holder] },
        assumed: Vec::new(),
    })
    .expect("lengths fit together")
}

/// The B-head, C-table mill with the harness' box above the holder as its only body.
fn machine() -> Machine {
    let mut file = Machine::head_b_table_c().expect("the preset is valid").to_file();
    let rows = file.tool_chains[0].rows.iter_mut().chain(&mut file.workpiece_chain.rows);
    rows.for_each(|row| row.bodies.clear());
    file.bed_bodies.clear();
    let shape = ShapeFile::Box { size_mm: [200.0, 200.0, 300.0] };
    let position_mm = [0.0, 0.0, 150.0];
    let head = BodyFile { name: "box".to_owned(), shape, position_mm, rotation_xyz_deg: [0.0; 3], clearance_mm: 0.0 };
    file.tool_chains[0].rows.last_mut().expect("the head has rows").bodies.push(head);
    Machine::from_file(file).expect("the box fits")
}
