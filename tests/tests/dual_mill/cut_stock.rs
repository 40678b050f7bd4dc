//! The stock that a plan of two heads cuts, against samples of the layer on the blade that both
//! flutes of the text go through.

use facemill::nc_program::Dialect;
use facemill::virtual_machine::{Finding, FindingKind};
use facemill::{
    CutRequest, Job, PlanSettings, Planned, SilentStages, StockRegion, VerifyRequest, plan_job, verify_program,
};
use facemill_tests::jobs::{JobFolder, text_of};
use facemill_tests::oracles::brute::{RoundedCylinder, in_tool};
use facemill_tests::oracles::read_back::{TipAndAxis, number};
use facemill_tests::oracles::two_heads::DualBlock;
use nalgebra::{Point3, Unit, Vector3};

use super::{ReadPlan, between};

/// Distance of the stock's lines, mm.
pub(super) const CELL: f64 = 2.0;

/// Where samples are taken, distance from the propeller's axis, mm: all that the narrow band is cut
/// in, with the cutter around it.
const BAND: [f64; 2] = [380.0, 500.0];

/// Blade area for each sample, mm².
const AREA: f64 = 4.0;

/// Way of a tip between two places that are looked at, mm: the corner of the cutter leaves ridges
/// between them, at 1.5 mm of 5 % of the layer.
const STEP: f64 = 0.5;

/// The plan's stock is cut by both heads, each by as much as the samples that its flute is first to
/// reach stand for; what is left is handed on, and the program verified with the job cuts the same,
/// but for a block at rapid rate that is found for both heads.
pub(super) fn both_heads_cut_the_stock(job: &JobFolder, planned: &Planned, read: &ReadPlan) {
    let stock = &planned.report.stock;
    assert_eq!((&stock.not_cut_because, stock.began_as.as_deref()), (&None, Some("the setup's stock")));
    let cut = stock.cut.as_ref().expect("is cut");
    let rest = planned.rest.as_ref().expect("is handed on").volume();
    assert!((cut.before_mm3 - cut.removed_mm3 - rest).abs() < 1e-6 * cut.before_mm3, "{cut:?} {rest}");
    assert_eq!(cut.cell_mm, CELL);
    let sum: f64 = cut.removed_by_heads_mm3.iter().sum();
    assert!((cut.removed_mm3 - sum).abs() <= 1e-9 * sum, "{cut:?}");
    let (samples, blocks_that_cut) = sampled(read);
    for (reported, sampled) in cut.removed_by_heads_mm3.iter().zip(samples) {
        assert!((reported - sampled).abs() < 0.05 * sampled && sampled > 1e3, "{reported} reported, {sampled} sampled");
    }
    let cutting = read.blocks.iter().filter(|b| !b.rapid).count();
    assert!(cut.blocks_in_air > 0 && cut.blocks_in_air <= cutting - blocks_that_cut, "{cut:?} {blocks_that_cut}");
    a_block_at_rapid_rate_is_found_for_both_heads(job, planned, read);
}

/// Links through what both heads have cut keep the plan clean: tools and rapids of both are then
/// run in the stock as it is at that time, on its lines and between them.
#[test]
fn links_of_both_heads_go_through_cut_stock() {
    let job = super::job(446.0);
    job.set("job.json", &[("/setups/0/links", serde_json::json!({ "stock": "as_cut" }))]);
    let settings = PlanSettings { verify: true, certificates: false };
    let of_job = Job::read(&job.job()).unwrap();
    let planned = plan_job(&of_job, settings, Some(CELL), &SilentStages).unwrap().remove(0);
    assert!(planned.is_clean(), "{:?}", planned.report.findings);
    let links = planned.report.links.shortened.as_ref().expect("links are searched");
    assert!(links.changed > 0 && links.time_after_s < links.time_before_s, "{links:?}");
    let is_between = |text: &str| text.contains("between the lines of the stock");
    assert!(planned.report.assumptions.iter().any(|a| is_between(&a.text)), "{:?}", planned.report.assumptions);
    let cut = planned.report.stock.cut.as_ref().expect("is cut");
    assert!(cut.removed_by_heads_mm3.iter().all(|volume| *volume > 0.0), "{cut:?}");
}

fn a_block_at_rapid_rate_is_found_for_both_heads(job: &JobFolder, planned: &Planned, read: &ReadPlan) {
    let reported = planned.report.stock.cut.as_ref().expect("is cut");
    let cut = CutRequest { region: StockRegion::Operations, ..CutRequest::on_lines(CELL, reported.tolerance_mm) };
    let path = job.path("program.nc");
    let request = VerifyRequest { cut: Some(cut), ..VerifyRequest::new(&path, Dialect::Fanuc) };
    let (line, hasty) = with_a_hasty_block(read, &text_of(planned, "program.nc"));
    let verified = verify_program(&Job::read(&job.job()).unwrap(), hasty.as_bytes(), &request, &SilentStages).unwrap();
    let (file, own) = (&verified.file, verified.file.stock.as_ref().expect("is cut"));
    assert_eq!((own.before_mm3, own.region_mm), (reported.before_mm3, reported.region_mm));
    for (own, reported) in own.removed_by_heads_mm3.iter().zip(&reported.removed_by_heads_mm3) {
        assert!(own < reported && *own > 0.95 * reported, "{own} of {reported}");
    }
    let of_blocks: f64 = verified.cuts.iter().map(|block| block.removed_mm3).sum();
    assert!((of_blocks - own.removed_mm3).abs() <= 1e-9 * own.removed_mm3);
    // A head at home, whose tip the table turns under, is not at work.
    let others = file.verification.faults().filter(|f| f.first_line != line);
    assert_eq!(others.map(ToString::to_string).collect::<Vec<_>>(), [""; 0]);
    for head in 1..=2 {
        let cutter = format!("head {head}: cutter");
        let is_it = |f: &&Finding| f.obstacle.as_deref() == Some("stock") && f.body.as_ref() == Some(&cutter);
        let found: Vec<&Finding> = file.verification.findings.iter().filter(is_it).collect();
        let [found] = found[..] else { panic!("{cutter}: {:#?}", file.verification.findings) };
        assert_eq!((found.kind, [found.first_line, found.last_line]), (FindingKind::RapidCollision, [line; 2]));
    }
}

/// The text with a cut of both heads in its middle at rapid rate, and that block's line.
fn with_a_hasty_block(read: &ReadPlan, text: &str) -> (u32, String) {
    let cuts: Vec<usize> = (0..read.blocks.len())
        .filter(|&k| ReadPlan::is_cut(&read.blocks[k]) && read.blocks[k].working == [true; 2])
        .collect();
    let middle = cuts[cuts.len() / 2];
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    for (block, code) in [(&read.blocks[middle], "G0"), (&read.blocks[middle + 1], "G1")] {
        let line = &mut lines[block.line - 1];
        let words: Vec<&str> = line.split(' ').filter(|w| !matches!(*w, "G0" | "G1")).collect();
        let words = words.into_iter().filter(|w| code == "G1" || !w.starts_with('F'));
        let words: Vec<&str> = words.collect();
        *line = [&words[..1], &[code], &words[1..]].concat().join(" ");
    }
    assert!(!read.blocks[middle + 1].rapid);
    (read.blocks[middle].line as u32, lines.join("\n") + "\n")
}

/// A place in the layer of stock on the blade.
struct Sample {
    at: Point3<f64>,
    volume: f64,
    is_there: bool,
}

/// Volume that each head's flute is first to reach, mm³, and how many blocks certainly cut.
fn sampled(read: &ReadPlan) -> ([f64; 2], usize) {
    let thickness = number(&read.files["setups"][0]["stock"]["offset"]["allowance_mm"]);
    let mut samples = samples(read, thickness);
    let cutters = [&read.tools[0], &read.tools[1]].map(|tool| tool.cutter());
    let (mut volumes, mut blocks_that_cut) = ([0.0; 2], 0);
    for block in read.blocks.iter().filter(|b| !b.rapid) {
        let mut hits = 0;
        for (h, cutter) in cutters.iter().enumerate() {
            let places = places(read, block, h);
            // The cutter goes no farther from where it begins.
            let reach = cutter.radius.hypot(cutter.height) + 2.0 * read.ways(block)[h];
            let start = places[0].0;
            for sample in samples.iter_mut().filter(|s| s.is_there && (s.at - start).norm() <= reach) {
                if places.iter().any(|place| is_in(cutter, place, &sample.at)) {
                    sample.is_there = false;
                    volumes[h] += sample.volume;
                    hits += 1;
                }
            }
        }
        // Some lines are among so many.
        blocks_that_cut += usize::from(hits >= 10);
    }
    (volumes, blocks_that_cut)
}

fn is_in(cutter: &RoundedCylinder, (tip, axis): &TipAndAxis, at: &Point3<f64>) -> bool {
    let (rho, z) = in_tool(tip, axis, at);
    cutter.signed_distance(rho, z) < 0.0
}

/// Places of a head's tool on a block, both ends among them.
fn places(read: &ReadPlan, block: &DualBlock, head: usize) -> Vec<TipAndAxis> {
    let n = (read.ways(block)[head] / STEP).ceil().max(1.0) as usize;
    (0..=n).map(|k| read.heads.place(head, &between(block, k as f64 / n as f64))).collect()
}

/// Places in the layer on the blade's band, drawn by a fixed generator.
fn samples(read: &ReadPlan, thickness: f64) -> Vec<Sample> {
    let part = read.back.grounds.iter().find(|g| g.role == "part").expect("a part");
    let mesh = part.bins.mesh();
    let mut state = facemill_test_kit::Random(7);
    let mut draw = || state.unit();
    let mut samples = Vec::new();
    for triangle in mesh.triangles() {
        let [a, b, c] = triangle.map(|v| mesh.vertices()[v as usize]);
        let cross: Vector3<f64> = (b - a).cross(&(c - a));
        let radius = a.x.hypot(a.y);
        if !(BAND[0]..BAND[1]).contains(&radius) {
            continue;
        }
        let area = 0.5 * cross.norm();
        let n = (area / AREA + draw()).floor();
        let normal = Unit::new_normalize(cross);
        for _ in 0..n as usize {
            let (mut u, mut v, t) = (draw(), draw(), draw());
            if u + v > 1.0 {
                (u, v) = (1.0 - u, 1.0 - v);
            }
            let at = a + (b - a) * u + (c - a) * v + normal.into_inner() * (thickness * t);
            samples.push(Sample { at, volume: AREA * thickness, is_there: true });
        }
    }
    samples
}
