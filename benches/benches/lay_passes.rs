//! Passes laid on meshes of two sizes: the time per triangle has to stay the same.
//!
//! Levels (planes, edge fill, a flow between two edges, a spiral around a tube) on 500,000 and
//! 2,000,000 triangles, 1,000 passes with about 1,000,000 points on the larger one, of edge fill
//! also half as many passes with fewer points; fronts of constant scallop, passes along a ridge and
//! along a corner on 125,000 and 2,000,000; distances from one front on 200,000 and 800,000. Where
//! each bench runs once, as a test, there is the smaller size alone.

use std::f64::consts::TAU;
use std::time::Duration;

use criterion::{BenchmarkGroup, Criterion, Throughput, criterion_group, criterion_main, measurement::WallTime};
use facemill::cc_path::strategies::{
    ConstantScallop, Edge, EdgeLine, Flow, FlowEnd, ParallelPlanes, Region, Root, RootLine, Sections, Seed, Spiral,
    SpiralLevels,
};
use facemill::cc_path::{LaySettings, Strategy, lay_passes};
use facemill_cl_data::{CcPoint, Silent};
use facemill_sample_parts::{PatchSpec, patch};
use facemill_surface_model::{Group, Surface, SurfaceSettings, TriMesh};
use facemill_test_kit::{grid_around, grid_by_columns};
use nalgebra::{Point3, Unit, Vector3};

/// Passes to be laid.
struct Case<'a> {
    name: &'a str,
    surface: &'a Surface,
    strategy: Strategy,
    settings: LaySettings,
    /// Strip width allowed at x = 500 mm, mm; at −500 mm half of it.
    widest: f64,
}

impl Case<'_> {
    fn n_passes(&self) -> usize {
        let Self { surface, strategy, settings, widest, .. } = self;
        let width = |cc: &CcPoint| widest * (0.75 + cc.position.x / 2000.0);
        let laid = lay_passes(surface, &Region::default(), strategy, settings, &width, &Silent);
        laid.expect("passes on a sound mesh").passes.len()
    }
}

/// Any width.
const ANY: f64 = f64::INFINITY;

fn planes(normal: Unit<Vector3<f64>>) -> ParallelPlanes {
    ParallelPlanes { origin: Point3::origin(), normal, from: None, to: None }
}

/// A flow between the edges of a patch at y = −`half` and y = `half`.
fn flow(half: f64) -> Strategy {
    let end = |y: f64| FlowEnd::Plane { origin: Point3::new(0.0, y, 0.0), normal: Vector3::y_axis() };
    Strategy::Flow(Flow { from: end(-half), to: end(half), within: 1e-3 })
}

fn spiral() -> Strategy {
    Strategy::Spiral(Spiral { levels: SpiralLevels::Sections(Sections::ParallelPlanes(planes(Vector3::z_axis()))) })
}

/// Fronts to both sides of the middle of a patch.
fn scallop() -> Strategy {
    let seeds = vec![Seed::Plane { origin: Point3::origin(), normal: Vector3::y_axis() }];
    Strategy::ConstantScallop(ConstantScallop { seeds, within: None })
}

/// As many passes as rows of quads, as many points as quads; or `share` of both.
fn settings_of(quads: usize, share: f64) -> LaySettings {
    let step_over = 1000.0 / (share * quads as f64);
    LaySettings {
        max_step_over: step_over,
        min_step_over: 0.05 * step_over,
        max_step: step_over,
        ..LaySettings::default()
    }
}

fn surface(mesh: TriMesh) -> Surface {
    Surface::new(mesh, SurfaceSettings::default())
}

/// A wavy patch of 1,000 mm.
fn sheet(quads: usize) -> Surface {
    let spec = PatchSpec::new([1000.0, 1000.0], 40.0, [3.1, 2.7]).expect("numbers are in range");
    surface(patch(&spec, quads, quads).expect("numbers are in range"))
}

/// A waisted tube of `rows` × `rows` quads, 1,000 mm high.
fn tube(rows: u32) -> Surface {
    // Around against the turn about z, so that the normal points outward.
    let (vertices, triangles) = grid_around([rows, rows], |j, k| {
        let share = f64::from(j) / f64::from(rows);
        let radius = 150.0 + 20.0 * (TAU * share).cos();
        let (sin, cos) = (TAU * f64::from(k) / f64::from(rows)).sin_cos();
        Point3::new(radius * cos, -radius * sin, 1000.0 * share)
    });
    surface(TriMesh::new(vertices, triangles).expect("indices are in range"))
}

/// A square of 1,000 mm of quads, folded along y by a profile that gives z above x from −500 to
/// 500; left and right half are groups.
fn folded(quads: u32, profile: impl Fn(f64) -> f64) -> Surface {
    let at = |k: u32| 1000.0 * f64::from(k) / f64::from(quads) - 500.0;
    let (vertices, triangles) = grid_by_columns([quads, quads], |i, j| Point3::new(at(i), at(j), profile(at(i))));
    let (half, all) = (triangles.len() / 2, triangles.len());
    let group = |name: &str, triangles| Group { name: name.to_owned(), triangles };
    let groups = vec![group("left", 0..half), group("right", half..all)];
    surface(TriMesh::with_groups(vertices, triangles, groups).expect("indices are in range"))
}

/// A roof whose top is rounded by 5 mm.
fn roof(quads: u32) -> Surface {
    folded(quads, |x| -0.8 * x.hypot(6.0))
}

/// A trough of two planes.
fn trough(quads: u32) -> Surface {
    folded(quads, |x| 0.8 * x.abs())
}

/// Whether each bench runs once, to see that it does.
fn is_test() -> bool {
    std::env::args().any(|arg| arg == "--test")
}

/// Of two sizes both, or the smaller one alone.
fn sizes(both: [usize; 2]) -> impl Iterator<Item = usize> {
    both.into_iter().take(if is_test() { 1 } else { 2 })
}

fn group<'c>(c: &'c mut Criterion, name: &str, quads: usize) -> BenchmarkGroup<'c, WallTime> {
    let mut group = c.benchmark_group(format!("{name}_{}k", 2 * quads * quads / 1000));
    group.sample_size(10).measurement_time(Duration::from_secs(2)).warm_up_time(Duration::from_millis(500));
    group.throughput(Throughput::Elements(2 * (quads * quads) as u64));
    group
}

fn run(c: &mut Criterion, name: &str, quads: usize, cases: &[Case<'_>]) {
    let mut group = group(c, name, quads);
    for case in cases {
        group.bench_function(case.name, |b| b.iter(|| case.n_passes()));
    }
    group.finish();
}

fn level_cases<'a>(quads: usize, sheet: &'a Surface, tube: &'a Surface) -> Vec<Case<'a>> {
    let settings = settings_of(quads, 1.0);
    let along_x = Strategy::ParallelPlanes(planes(Vector3::y_axis()));
    let case = |name, surface, strategy| Case { name, surface, strategy, settings: settings.clone(), widest: ANY };
    // Strips that are half as wide at −500 mm as at 500 mm.
    let filled = |name, of_share: LaySettings| {
        let widest = of_share.max_step_over;
        let settings = LaySettings { edge_fill: true, pass_cost: 20.0, min_pass_length: 5.0, ..of_share };
        Case { name, surface: sheet, strategy: along_x.clone(), settings, widest }
    };
    vec![
        case("planes", sheet, along_x.clone()),
        case("flow", sheet, flow(500.0)),
        case("spiral", tube, spiral()),
        filled("edge fill, sparse", settings_of(quads, 0.25)),
        filled("edge fill", LaySettings { max_step: settings.max_step, ..settings_of(quads, 0.6) }),
    ]
}

fn levels(c: &mut Criterion) {
    for quads in sizes([500, 1000]) {
        let (sheet, tube) = (sheet(quads), tube(quads as u32));
        run(c, "lay_passes", quads, &level_cases(quads, &sheet, &tube));
    }
}

fn line_cases<'a>(quads: usize, [sheet, roof, trough]: [&'a Surface; 3]) -> Vec<Case<'a>> {
    let (sparse, settings) = (settings_of(quads, 0.25), settings_of(quads, 1.0));
    let ridge = Strategy::Edge(Edge { line: EdgeLine::Ridge, width: 100.0 });
    let corner = RootLine::BetweenGroups(["left".to_owned(), "right".to_owned()]);
    let root = Strategy::Root(Root { line: corner, width: 100.0 });
    let ball = LaySettings { corner_radius: 10.0, ..settings.clone() };
    let case = |name, surface, strategy| Case { name, surface, strategy, settings: settings.clone(), widest: ANY };
    vec![
        Case { name: "constant scallop", surface: sheet, strategy: scallop(), settings: sparse, widest: ANY },
        case("edge", roof, ridge),
        Case { name: "root", surface: trough, strategy: root, settings: ball, widest: ANY },
    ]
}

fn lines(c: &mut Criterion) {
    for quads in sizes([250, 1000]) {
        let surfaces = [sheet(quads), roof(quads as u32), trough(quads as u32)];
        run(c, "lay_along_lines", quads, &line_cases(quads, [&surfaces[0], &surfaces[1], &surfaces[2]]));
    }
}

/// Fronts so far apart that there are few passes: what remains are distances over all of a patch.
fn front_case(sheet: &Surface) -> Case<'_> {
    let settings = LaySettings { max_step_over: 400.0, max_step: 20.0, ..LaySettings::default() };
    Case { name: "distances from a front", surface: sheet, strategy: scallop(), settings, widest: ANY }
}

fn fronts(c: &mut Criterion) {
    for quads in sizes([316, 632]) {
        run(c, "fronts", quads, &[front_case(&sheet(quads))]);
    }
}

criterion_group!(benches, levels, lines, fronts);
criterion_main!(benches);
