//! Chip areas on trial: area × way of the CC point against what the written program takes out of
//! the stock, block by block.

use facemill::StockRegion;
use facemill::surface_model::{NamedNode, TriMesh, write_obj};
use facemill_tests::jobs::JobFolder;
use facemill_tests::oracles::chip_trial::{PieceTrial, Step, Volumes, plan_and_cut, request, summary, trial};
use facemill_tests::shared::workspace;
use facemill_tests::variants::with_long_flute;
use nalgebra::{Isometry3, Point3};
use serde_json::json;

use super::{STOCK, plate};

/// Distance of the lines, mm.
const CELL: f64 = 0.08;

/// Of the cut stock, mm.
const TOLERANCE: f64 = 0.0005;

/// From the ends of a pass, mm: there the cutter comes and goes.
const MARGIN: f64 = 5.0;

/// Plans a job and cuts lines within these x, and all y that its passes reach.
fn pieces(job: &JobFolder, half_length: f64) -> Vec<PieceTrial> {
    let region = StockRegion::Rectangle([[-half_length, -10.0], [half_length, 10.0]]);
    let (table, verified) = plan_and_cut(&job.job(), request(CELL, TOLERANCE, region));
    verified.rest.expect("the stock was cut").check_invariants().expect("the map is sound");
    let pieces = trial(&table, &verified.cuts);
    println!("{}", summary(&pieces, MARGIN));
    pieces
}

/// Over every pass, and over all of them, the stock loses chip area × way times a factor.
fn assert_volumes(pieces: &[PieceTrial], factor: f64) {
    let of_passes: Vec<Volumes> = pieces.iter().map(|p| Volumes::of(p.inner(MARGIN))).collect();
    assert!(of_passes.len() >= 4 && of_passes.iter().all(|v| v.way > 3.0), "{of_passes:?}");
    for v in &of_passes {
        assert!((v.ratio() / factor - 1.0).abs() < 0.01, "{} for {factor}: {v:?}", v.ratio());
    }
    let all = of_passes.into_iter().reduce(Volumes::with).expect("passes");
    assert!((all.ratio() / factor - 1.0).abs() < 0.003, "{} for {factor}: {all:?}", all.ratio());
    // Block by block, lines beside each other count by whole cells: half a cell at both ends of
    // each.
    for s in pieces.iter().flat_map(|p| p.inner(MARGIN)) {
        let allowed = 0.02 + CELL / s.way;
        assert!((s.removed / (s.area * s.way) / factor - 1.0).abs() < allowed, "{factor}: {s:?}");
    }
}

#[test]
fn a_plate_loses_chip_area_times_way() {
    assert_volumes(&pieces(&plate(&[]), 41.0), 1.0);
}

/// Radius of the arch, mm.
const ARCH: f64 = 20.0;

/// Half the angle of the arch, rad.
const HALF_ANGLE: f64 = 0.4;

/// A part of a cylinder about a line along y, its top line at z = 0.
fn arch() -> TriMesh {
    let (n, half_width) = (160_u32, 8.0);
    let (vertices, triangles) = facemill_test_kit::grid_by_columns([n, 1], |k, side| {
        let (sin, cos) = (HALF_ANGLE * (2.0 * f64::from(k) / f64::from(n) - 1.0)).sin_cos();
        Point3::new(ARCH * sin, if side == 0 { -half_width } else { half_width }, ARCH * (cos - 1.0))
    });
    TriMesh::new(vertices, triangles).expect("indices are in range")
}

/// Along an arc the centroid of the section goes farther than the CC point (Pappus and Guldin): the
/// section is a slanted strip as high as the stock all over, with its centroid at half of that but
/// for cusps.
#[test]
fn an_arch_loses_chip_area_times_the_way_of_the_sections_centroid() {
    let thickness = 0.5;
    let job = plate(&[
        ("/operations/0/search/mode", json!({ "fixed": { "lead_deg": 32.0, "lean_deg": 4.0 } })),
        // Between two blocks the tool is lower than on the arc, by this.
        ("/operations/0/tolerances/linearisation_mm", json!(0.001)),
        ("/operations/0/tolerances/max_step_mm", json!(0.25)),
        ("/setups/0/stock", json!({ "offset": { "allowance_mm": thickness } })),
    ]);
    let nodes = [NamedNode { name: "arch", mesh: 0, transform: Isometry3::identity() }];
    job.write("patch.obj", &write_obj(&[&arch()], &nodes).expect("a mesh"));
    with_long_flute(&job, 3.0);
    assert!(thickness > STOCK);
    assert_volumes(&pieces(&job, 12.0), 1.0 + 0.5 * thickness / ARCH);
}

/// The passes of the sample job's first blade that are cut over the whole step-over: those nearer
/// to the tip of the blade are in full stock, or where the curvature across the feed changes from
/// pass to pass.
const FULL_WIDTH: std::ops::RangeInclusive<u32> = 22..=47;

/// From the ends of the passes of the sample job by cylinders, mm: there the stock ends at the
/// blade's edges.
const BLADE_MARGIN: f64 = 150.0;

/// The table of docs/chip-area.md, on lines 1 mm apart: two minutes with
/// `cargo test -p facemill-tests --test programs -- --ignored full_width_passes`.
#[test]
#[ignore = "plans the sample job and cuts its first blade: two minutes"]
fn full_width_passes_of_the_sample_job_lose_chip_area_times_way() {
    let job = workspace().join("assets/propeller/job-cylinders.json");
    let region = StockRegion::Rectangle([[0.0, -900.0], [1560.0, 900.0]]);
    let (table, verified) = plan_and_cut(&job, request(1.0, 0.005, region));
    let mut pieces = trial(&table, &verified.cuts);
    pieces.retain(|p| p.place == 1 && FULL_WIDTH.contains(&p.pass));
    println!("{}", summary(&pieces, BLADE_MARGIN));
    // Pieces shorter than both margins have none.
    let of_pieces = pieces.iter().map(|p| Volumes::of(p.inner(BLADE_MARGIN)));
    let of_passes: Vec<Volumes> = of_pieces.filter(|v| v.way > 0.0).collect();
    assert!(of_passes.len() == FULL_WIDTH.count() && of_passes.iter().all(|v| v.way > 800.0), "{of_passes:?}");
    for v in &of_passes {
        assert!((v.ratio() - 1.0).abs() < 0.05, "{} of {v:?}", v.ratio());
    }
    let all = of_passes.into_iter().reduce(Volumes::with).expect("passes");
    assert!((all.ratio() - 1.0).abs() < 0.01, "{} of {all:?}", all.ratio());
    // Ways between two points are 5 mm long, and lines 1 mm apart count by whole cells at both ends
    // of each.
    let steps: Vec<&Step> = pieces.iter().flat_map(|p| p.inner(BLADE_MARGIN)).collect();
    let within = steps.iter().filter(|s| (s.removed / (s.area * s.way) - 1.0).abs() < 0.05).count();
    assert!(4 * within >= 3 * steps.len(), "{within} of {} ways between two points within 5 %", steps.len());
}
