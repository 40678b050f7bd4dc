//! Lines along x and y: walls along z, which no line along z goes through, are compared with the
//! part.

use std::fmt::Write as _;
use std::path::Path;

use facemill::nc_program::Dialect;
use facemill::verify_program;
use facemill::virtual_machine::{FindingKind, Measure};
use facemill::{CutRequest, DeviationRequest, Failure, Job, SilentStages, StockRegion, Verified, VerifyRequest};
use facemill_tests::jobs::JobFolder;

use super::{ALLOWANCE, NEAR, RADIUS, TABLE, plate, report, sum};

const CELL: f64 = 0.5;

/// How deep the pass goes into the wall at y = 15.
const GOUGE: f64 = 0.2;

/// An upright pass along the wall at y = 15, and one along the wall at x = 15 that leaves a tenth
/// on it; below the plate's bottom.
fn program(gouge: f64) -> String {
    let words = |x: f64, y: f64, z: f64| format!("X{x:.4} Y{y:.4} Z{:.4} B0. C0.", z + TABLE);
    let mut text = format!("G21 G90 G94\nG0 G43 {} H1\n", words(-30.0, 25.0, 40.0));
    let passes = [
        [[-30.0, 15.0 + RADIUS - gouge], [30.0, 15.0 + RADIUS - gouge]],
        [[15.0 + RADIUS + 0.1, 30.0], [15.0 + RADIUS + 0.1, -30.0]],
    ];
    for [[x0, y0], [x1, y1]] in passes {
        let _ = writeln!(text, "G0 {}\nG1 {} F2000.", words(x0, y0, 40.0), words(x0, y0, -7.0));
        let _ = writeln!(text, "G1 {}\nG0 {}", words(x1, y1, -7.0), words(x1, y1, 40.0));
    }
    text + "M30\n"
}

fn run(job: &JobFolder, across: bool, region: StockRegion) -> Result<Verified, Failure> {
    run_text(job, &program(GOUGE), across, region)
}

fn run_text(job: &JobFolder, text: &str, across: bool, region: StockRegion) -> Result<Verified, Failure> {
    let deviation = Some(DeviationRequest { tolerance: Some(0.04), painted: false, since_stock: false });
    let cut = CutRequest { region, across, deviation, ..CutRequest::on_lines(CELL, 0.002) };
    let request = VerifyRequest {
        gouge_limit: Some(0.05),
        cut: Some(cut),
        ..VerifyRequest::new(Path::new("program.nc"), Dialect::Fanuc)
    };
    verify_program(&Job::read(&job.job())?, text.as_bytes(), &request, &SilentStages)
}

#[test]
fn walls_along_z_are_measured_on_lines_across() {
    let job = plate();
    let [upright, across] =
        [false, true].map(|across| run(&job, across, StockRegion::Whole).unwrap_or_else(|e| panic!("{e}")));
    let sides = 4.0 * 30.0 * 6.0;
    let part = &report(&upright).part;
    assert!((part.area_mm2.not_measured - sides).abs() < 1e-6, "{part:?}");
    assert!(part.largest_gouge.is_none_or(|g| g.value_mm < NEAR), "no upright line is in the gouge: {part:?}");

    let part = &report(&across).part;
    assert!(part.area_mm2.not_measured == 0.0 && (sum(part) - sum(&report(&upright).part)).abs() < 1e-6, "{part:?}");
    let gouge = part.largest_gouge.expect("the wall is gouged");
    assert!((gouge.value_mm - GOUGE).abs() < NEAR && (gouge.at_mm[1] - 15.0).abs() < 1e-9, "{gouge:?}");
    assert!(report(&across).exceeds_gouge_limit && !report(&upright).exceeds_gouge_limit);
    // One wall is gouged, one has a tenth more than nothing, two are as they were.
    let wall = 30.0 * 6.0;
    assert!((part.area_mm2.gouged - wall).abs() < 0.03 * wall, "{part:?}");
    let excess = part.largest_excess.expect("a tenth is left");
    assert!((excess.value_mm - 0.1).abs() < NEAR && (excess.at_mm[0] - 15.0).abs() < 1e-9, "{excess:?}");
    let left = part.largest_not_reached.expect("nothing was cut elsewhere");
    assert!((left.value_mm - ALLOWANCE).abs() < NEAR, "{left:?}");

    // The same faults of the cutter, and a volume that is nearer to the truth than half a cell
    // along the walls.
    let findings = |found: &Verified| found.file.verification.findings.iter().map(|f| f.kind).collect::<Vec<_>>();
    assert_eq!(findings(&across), findings(&upright));
    let [of_upright, of_across] = [&upright, &across].map(|found| found.file.stock.as_ref().expect("it was cut"));
    assert_eq!((of_upright.lines_along.len(), of_across.lines_along.len()), (1, 3));
    let truth = removed();
    let off = |removed: f64| (removed - truth).abs() / truth;
    assert!(off(of_across.removed_mm3) < 0.05, "{} and {truth}", of_across.removed_mm3);
    let of_blocks: f64 = across.cuts.iter().map(|block| block.removed_mm3).sum();
    assert!((of_blocks - of_across.removed_mm3).abs() < 1e-6 * truth, "{of_blocks}");
}

/// Returns the volume that both passes remove from the stock, which is rounded at its edges, mm³:
/// by columns of a fine lattice.
fn removed() -> f64 {
    let step = 0.02;
    let n = (2.0 * (15.0 + ALLOWANCE) / step) as i32;
    let mut sum = 0.0;
    for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
        let [x, y] = [i, j].map(|k| -15.0 - ALLOWANCE + (f64::from(k) + 0.5) * step);
        if x > 15.1 || y > 15.0 - GOUGE {
            let beyond = [x, y].map(|c| (c.abs() - 15.0).max(0.0));
            let over = (ALLOWANCE * ALLOWANCE - beyond[0] * beyond[0] - beyond[1] * beyond[1]).max(0.0).sqrt();
            let is_stock = beyond[0].hypot(beyond[1]) <= ALLOWANCE;
            sum += if is_stock { (6.0 + 2.0 * over) * step * step } else { 0.0 };
        }
    }
    sum
}

/// Half a line's distance into the wall that a pass has left, where no upright line is: lines along
/// y say how deep.
#[test]
fn a_rapid_into_a_wall_between_upright_lines_is_measured_on_lines_across() {
    let job = plate();
    let (wall, deep) = (0.3, 0.3);
    let words = |y: f64| format!("X{:.4} Y{y:.4} Z{:.4} B0. C0.", 0.0, TABLE - 3.0);
    let text =
        program(wall).replace("M30\n", "") + &format!("G0 {}\nG0 {}\nM30\n", words(60.0), words(25.0 - wall - deep));
    let depths = |across: bool| {
        let found = run_text(&job, &text, across, StockRegion::Whole).unwrap_or_else(|e| panic!("{e}"));
        let findings = found.file.verification.findings;
        let rapids = findings
            .into_iter()
            .filter(|f| f.kind == FindingKind::RapidCollision && f.obstacle.as_deref() == Some("stock"));
        rapids.filter_map(|f| f.measure).collect::<Vec<_>>()
    };
    assert_eq!(depths(false), [], "a line stands in the wall");
    let found = depths(true);
    let is_deep = |m: &Measure| matches!(m, Measure::DepthMm(d) if (d - deep).abs() < 0.02);
    assert!(found.len() == 1 && found.iter().all(is_deep), "{found:?}");
}

#[test]
fn lines_across_are_of_the_whole_stock() {
    let job = plate();
    let why = run(&job, true, StockRegion::Operations).expect_err("a region").to_string();
    assert!(why.contains("lines along x and y") && why.contains("region"), "{why}");
}

/// Half a millimetre on a wall, and lines 3 mm apart, none of the upright ones in it: where a wall
/// is cut, lines across are taken by default.
#[test]
fn the_stock_on_a_cut_wall_is_seen_by_default() {
    let job = plate();
    let mesh = std::fs::read_to_string(job.job().with_file_name("plate.obj")).expect("it was written");
    job.write("plate.obj", mesh.replace("f 2 4 8\n", "g wall\nf 2 4 8\n").as_bytes());
    job.set("job.json", &[("/setups/0/meshes/0/groups", serde_json::json!(["wall"]))]);
    let start = program(GOUGE).lines().take(2).collect::<Vec<_>>().join("\n");
    let pass = program(GOUGE).lines().skip(6).collect::<Vec<_>>().join("\n");
    let text = format!("{start}\n{pass}\n");
    let cut = |across_walls: bool| {
        let cut = CutRequest { across_walls, ..CutRequest::on_lines(3.0, 0.002) };
        let request = VerifyRequest {
            gouge_limit: Some(0.05),
            cut: Some(cut),
            ..VerifyRequest::new(Path::new("program.nc"), Dialect::Fanuc)
        };
        let job = Job::read(&job.job()).unwrap_or_else(|e| panic!("{e}"));
        let found = verify_program(&job, text.as_bytes(), &request, &SilentStages).unwrap_or_else(|e| panic!("{e}"));
        found.file.stock.expect("it was cut")
    };
    let upright = cut(false);
    assert_eq!((upright.lines_along.len(), upright.walls_not_seen, upright.removed_mm3), (1, true, 0.0));
    assert!(upright.summary_lines().iter().any(|line| line.contains("walls")), "{:?}", upright.summary_lines());
    let across = cut(true);
    assert_eq!((across.lines_along.len(), across.walls_not_seen), (3, false));
    assert!(across.blocks_in_air < upright.blocks_in_air, "{} of {}", across.blocks_in_air, upright.blocks_in_air);
    // A layer of 0.4 mm of the wall, which lines along x alone show.
    let truth = 0.4 * 30.0 * 6.0;
    assert!((across.removed_mm3 - truth).abs() < 0.15 * truth, "{} and {truth}", across.removed_mm3);
}
