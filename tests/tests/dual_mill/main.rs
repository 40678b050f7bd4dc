//! Both sides of a blade at once on the mill with two heads: planned, written, run and certified;
//! and the program compared with the plan, the report and the part by matrices made from the rows
//! of the machine file.

mod cut_stock;
mod dual_refusals;
mod lowered_feeds;
mod turns_and_rounds;

use facemill::cl_file::{AptFile, read_apt};
use facemill::new_job::NewJob;
use facemill::rapids::RetractStrategy;
use facemill::report::SpreadReport;
use facemill::{Job, PlanSettings, Planned, SilentStages, plan_job, plan_setup};
use facemill_tests::jobs::{JobFolder, text_of, write_coarse_propeller};
use facemill_tests::oracles::craig::Words;
use facemill_tests::oracles::read_back::{ReadBack, TipAndAxis, apt_feeds, number};
use facemill_tests::oracles::two_heads::{DualBlock, ToolShape, TwoHeads, bodies_apart, dual_blocks, tools_apart};
use facemill_tests::shared::workspace;
use serde_json::{Value, json};

/// A narrow band of one blade, from a radius on, with few points and facets.
fn job(from_radius: f64) -> JobFolder {
    let job = JobFolder::new(&NewJob::DualPropeller { diameter_mm: 1000.0 });
    write_coarse_propeller(&job, 1000.0);
    let of_operations: Vec<(String, Value)> = (0..2)
        .flat_map(|k| {
            let sections = format!("/operations/{k}/path/strategy/strategy/cylindrical_sections");
            [
                (format!("/operations/{k}/pattern"), Value::Null),
                (format!("{sections}/from_radius_mm"), json!(from_radius)),
                (format!("{sections}/to_radius_mm"), json!(449.0)),
                (format!("/operations/{k}/tolerances/max_step_mm"), json!(12.0)),
                (format!("/operations/{k}/tolerances/path_chord_mm"), json!(0.1)),
            ]
        })
        .collect();
    let values: Vec<(&str, Value)> = of_operations.iter().map(|(p, v)| (p.as_str(), v.clone())).collect();
    job.set("job.json", &values);
    // One tip or axis velocity sets each block's time.
    job.set("job.json", &[("/feeds_within", json!("velocity"))]);
    job
}

/// Half a unit of the words' last decimals in all axes of one head: three of a mm, four of a degree
/// over less than a metre.
const ROUNDING: f64 = 2.0 * 5e-4 + 3.0 * 5e-5 * std::f64::consts::PI / 180.0 * 1000.0;

/// Data of a plan, read without the planner.
struct ReadPlan {
    blocks: Vec<DualBlock>,
    heads: TwoHeads,
    apts: [AptFile; 2],
    files: Value,
    report: Value,
    certificates: Value,
    back: ReadBack,
    tools: [ToolShape; 2],
}

impl ReadPlan {
    fn of(job: &JobFolder, planned: &Planned) -> Self {
        let tools = ["tool.json", "tool-2.json"].map(|name| job.json(name));
        let json = |name: &str| serde_json::from_str(&text_of(planned, name)).unwrap();
        let back = ReadBack::of(job, 0);
        Self {
            blocks: dual_blocks(&text_of(planned, "program.nc")),
            heads: TwoHeads::new(
                job.json("machine.json"),
                [0, 1].map(|h| number(&tools[h]["gauge_length_mm"])),
                back.table_from_work,
            ),
            apts: [1, 2].map(|h| read_apt(text_of(planned, &format!("program-head-{h}.apt"))).unwrap()),
            files: job.json("job.json"),
            report: json("report.json"),
            certificates: json("certificates.json"),
            back,
            tools: [ToolShape::of(&tools[0]), ToolShape::of(&tools[1])],
        }
    }

    /// Both tips' ways in a block, mm.
    fn ways(&self, block: &DualBlock) -> [f64; 2] {
        [0, 1].map(|h| (self.heads.place(h, &block.to).0 - self.heads.place(h, &block.from).0).norm())
    }

    /// Entries and exits stand still in all rotaries; cuts do not.
    fn is_cut(block: &DualBlock) -> bool {
        !block.rapid && block.to.iter().any(|(name, to)| name.starts_with(['B', 'C']) && block.from[name] != *to)
    }

    fn pair(&self) -> &Value {
        &self.report["pairs"][0]
    }
}

/// Words between the ends of a block.
fn between(block: &DualBlock, t: f64) -> Words {
    block.to.iter().map(|(name, to)| (name.clone(), block.from[name] + t * (to - block.from[name]))).collect()
}

fn plan(job: &JobFolder, verify: bool) -> Planned {
    let settings = PlanSettings { verify, certificates: verify };
    plan_setup(&Job::read(&job.job()).unwrap(), 0, settings, &SilentStages).unwrap()
}

#[test]
fn both_sides_of_a_blade_are_planned_run_and_certified_at_once() {
    let (job, one_by_one) = (job(432.0), job(432.0));
    one_by_one.set("job.json", &[("/pairs", Value::Null)]);
    let (planned, alone) = std::thread::scope(|scope| {
        let alone = scope.spawn(|| plan(&one_by_one, false));
        (plan(&job, true), alone.join().unwrap())
    });
    assert!((8..=12).contains(&planned.report.totals.passes), "{:?}", planned.report.totals);
    let read = ReadPlan::of(&job, &planned);
    holds(&planned, &read);
    // Requirements of the whole propeller.
    let pair = read.pair();
    assert!(number(&pair["paired_fraction"]) >= 0.9 && number(&pair["time_ratio"]) <= 0.65, "{pair}");
    obeys("report", &read.report);
    obeys("certificates", &read.certificates);
    for (format, name) in
        [("job", "job.json"), ("tool", "tool.json"), ("tool", "tool-2.json"), ("machine", "machine.json")]
    {
        obeys(format, &job.json(name));
    }
    separate_times_are_those_of_the_sides_one_after_the_other(&alone, &read);
}

/// Three operations one after the other, the first head's second one slower: the program says so
/// before it, for its spindle.
#[test]
fn operations_of_one_head_have_spindle_speeds_of_their_own() {
    let job = job(444.0);
    let mut again = job.json("job.json")["operations"][0].clone();
    let other = job.json("job.json")["operations"][1]["feeds"]["spindle_rpm"].clone();
    (again["name"], again["feeds"]["spindle_rpm"]) = (json!("again"), json!(300.0));
    job.set("job.json", &[("/pairs", Value::Null)]);
    let mut operations = job.json("job.json")["operations"].as_array().unwrap().clone();
    operations.push(again);
    job.set("job.json", &[("/operations", json!(operations))]);
    let planned = job.plan();
    assert!(planned.is_clean() && planned.report.verified, "{:?}", planned.report.findings);
    let spindles = |name: &str| -> Vec<String> {
        let text = text_of(&planned, name);
        let code = |l: &str| l.split(' ').filter(|w| !w.starts_with('N')).collect::<Vec<_>>().join(" ");
        let lines = text.lines().filter(|l| !l.contains(['(', ';'])).map(code);
        lines.filter(|l| l.starts_with('S') && !l.starts_with("SETAL")).collect()
    };
    let first = number(&job.json("job.json")["operations"][0]["feeds"]["spindle_rpm"]);
    let [first, other] = [first, number(&other)].map(|rpm| format!("S{rpm}"));
    let all = spindles("program.nc");
    assert!(all.len() == 3 && all[2].starts_with("S300 M") && all[2].ends_with(" P1"), "{all:?}");
    let channels = [1, 2].map(|n| spindles(&format!("program-channel-{n}.mpf")));
    assert!(channels[0].len() == 2 && channels[0][0].starts_with(&first), "{channels:?}");
    assert!(channels[0][1].starts_with("S300 M"), "{channels:?}");
    assert!(channels[1].len() == 1 && channels[1][0].starts_with(&other), "{channels:?}");
    let text = text_of(&planned, "program.nc");
    let line = |what: &str| text.lines().position(|l| l.contains(what)).unwrap_or_else(|| panic!("{what}"));
    // Behind all cuts of the operations before, before those of its own.
    let (start, name) = (line("S300 M"), line("(AGAIN)"));
    assert!(start == name + 1 && text.lines().skip(start).any(|l| l.contains("G1 ")), "{name} {start}");
    let texts = [1, 2].map(|n| text_of(&planned, &format!("program-channel-{n}.mpf")));
    assert!(facemill::channel_pair::read_siemens_pair([&texts[0], &texts[1]]).is_ok());
}

/// One head keeps a removal rate so small that it always has its smallest feed, the other one has
/// its own feed: blocks of both are as slow as the first one asks for.
#[test]
fn each_head_keeps_the_removal_rate_of_its_own_operation() {
    let job = job(446.0);
    let feeds = &job.json("job.json")["operations"];
    let [slow, cutting] = [0, 1].map(|k| number(&feeds[k]["feeds"]["cutting_mm_min"]) * [0.3, 1.0][k]);
    let removal = json!({ "target_cm3_min": 1e-3, "min_mm_min": slow });
    job.set("job.json", &[("/operations/0/feeds/removal_rate", removal)]);
    let planned = plan(&job, false);
    let chips = &planned.report.chips;
    assert_eq!([chips[0].by_chips, chips[1].by_chips], [true, false]);
    assert_eq!(chips[0].feeds_set_by.removal_rate, chips[0].points - pieces_of(&planned, 0));
    assert_eq!(chips[1].feeds_set_by.removal_rate, 0);
    // The second head is held up in blocks of both.
    assert!(chips[0].added_time_s > 0.0 && chips[1].feeds_set_by.machine > 0, "{chips:?}");
    let largest = |spread: Option<SpreadReport>| spread.expect("cuts").max;
    let rates = [chips[0].removal_rate_after_cm3_min, chips[0].area_mm2].map(largest);
    assert!(rates[0] <= rates[1] * slow / 1000.0 * (1.0 + 1e-9), "{rates:?}");
    // As written: no tip is faster than its point in the APT file says.
    let tools = ["tool.json", "tool-2.json"].map(|name| number(&job.json(name)["gauge_length_mm"]));
    let heads = TwoHeads::new(job.json("machine.json"), tools, ReadBack::of(&job, 0).table_from_work);
    let blocks = dual_blocks(&text_of(&planned, "program.nc"));
    for (h, most) in [slow, cutting].into_iter().enumerate() {
        let apt = apt_feeds(&text_of(&planned, &format!("program-head-{}.apt", h + 1)));
        let own: Vec<&DualBlock> = blocks.iter().filter(|b| b.working[h]).collect();
        assert_eq!(own.len(), apt.len(), "blocks and APT points of head {}", h + 1);
        let mut cuts = 0;
        for (block, requested) in own.into_iter().zip(apt).filter(|(block, _)| ReadPlan::is_cut(block)) {
            assert_eq!(requested, Some(most), "line {}", block.line);
            let way = (heads.place(h, &block.to).0 - heads.place(h, &block.from).0).norm();
            let norm = block.to.iter().map(|(name, to)| (to - block.from[name]).powi(2)).sum::<f64>().sqrt();
            let tip_feed = way / norm * block.feed;
            assert!(tip_feed <= most * (1.0 + 1e-3 + 4.0 * ROUNDING / way), "line {}: {tip_feed}", block.line);
            cuts += 1;
        }
        assert!(cuts > 20, "{cuts} cuts of head {}", h + 1);
    }
}

/// Pieces of a head's operation.
fn pieces_of(planned: &Planned, head: usize) -> usize {
    let name = &planned.report.chips[head].operation;
    planned.report.passes.iter().filter(|p| p.operation == *name).count()
}

/// The committed job, both sides of three blades, as a whole: minutes, so by
/// `cargo test --release -p facemill-tests --test dual_mill -- --ignored`.
#[test]
#[ignore = "takes minutes"]
fn the_whole_propeller_is_paired_in_less_than_two_thirds_of_the_time() {
    let job = workspace().join("assets/propeller-dual/job.json");
    let settings = PlanSettings { verify: true, certificates: true };
    let planned = plan_job(&Job::read(&job).unwrap(), settings, None, &SilentStages).unwrap().remove(0);
    let report: Value = serde_json::from_str(&text_of(&planned, "report.json")).unwrap();
    let pair = &report["pairs"][0];
    assert!(number(&pair["paired_fraction"]) >= 0.9 && number(&pair["time_ratio"]) <= 0.65, "{pair}");
    assert!(report["findings"].as_array().unwrap().is_empty(), "{}", report["findings"]);
    assert!(number(&report["totals"]["planned_fraction"]) >= 0.99, "{}", report["totals"]);
    let (blocks, certified) = (&report["certified"]["blocks"], &report["certified"]["certified"]);
    assert!(number(certified) >= 0.999 * number(blocks), "{}", report["certified"]);
    let cut = planned.report.stock.cut.as_ref().expect("is cut");
    assert!(cut.blocks_not_covered == 0 && cut.removed_by_heads_mm3.iter().all(|v| *v > 0.0), "{cut:?}");
    println!("paired {}, time {}, certified {certified} of {blocks}", pair["paired_fraction"], pair["time_ratio"]);
}

/// With a narrow range of rotate some ends of passes have no entry or exit for both heads at once:
/// each head cuts them alone.
#[test]
fn what_both_heads_cannot_cut_at_once_is_cut_by_each_alone() {
    let job = job(443.0);
    let narrow = |k: usize| (format!("/operations/{k}/search/rotate_deg"), json!([0.0, 15.0]));
    for (pointer, value) in [narrow(0), narrow(1), ("/pairs/0/lean_back_deg".to_owned(), json!(0.0))] {
        job.set("job.json", &[(&pointer, value)]);
    }
    let settings = PlanSettings { verify: true, certificates: true };
    let of_job = Job::read(&job.job()).unwrap();
    let planned = plan_job(&of_job, settings, Some(cut_stock::CELL), &SilentStages).unwrap().remove(0);
    let read = ReadPlan::of(&job, &planned);
    holds(&planned, &read);
    let alone = |h: usize| read.blocks.iter().filter(|b| b.working[h] && !b.working[1 - h]).count();
    assert!(alone(0) + alone(1) > 0 && number(&read.pair()["paired_fraction"]) < 1.0, "{}", read.pair());
    assert!(!read.pair()["splits"].as_array().unwrap().is_empty());
    let home = read.heads.home();
    for block in &read.blocks {
        for h in (0..2).filter(|&h| !block.working[h]) {
            let own = block.to.iter().filter(|(name, _)| name.ends_with(if h == 0 { '1' } else { '2' }));
            for (name, value) in own {
                assert!((value - home[name]).abs() < 5e-4, "line {}: {name} is not at home", block.line);
            }
        }
    }
    links_are_shortened_and_both_tools_keep_apart_on_them(&planned, &read);
    cut_stock::both_heads_cut_the_stock(&job, &planned, &read);
}

/// Checks that every link takes less time than over the clearance surfaces, has a reason if not, or
/// is as fast as its slowest axis alone; and that the tools keep apart on all of them, by the
/// matrices of this test.
fn links_are_shortened_and_both_tools_keep_apart_on_them(planned: &Planned, read: &ReadPlan) {
    let links = planned.report.links.shortened.as_ref().expect("links of two heads are looked at");
    assert!(links.changed > 0 && links.time_after_s < links.time_before_s, "{links:?}");
    for link in &links.links {
        let is_less = link.time_after_s < link.time_before_s;
        let is_least = link.time_after_s < link.lower_bound_s + 1e-4;
        assert!(is_less || is_least || link.kept_because.is_some(), "{link:?}");
        assert!(
            is_less == (link.way != RetractStrategy::Original) && link.time_after_s >= link.lower_bound_s - 1e-9,
            "{link:?}"
        );
        assert!(is_less || link.time_after_s == link.time_before_s, "{link:?}");
        let rapid = read.blocks.iter().filter(|b| (link.lines[0]..=link.lines[1]).contains(&(b.line as u32)));
        assert!(rapid.clone().count() > 0 && rapid.clone().all(|b| b.rapid), "{link:?}");
        for (block, t) in rapid.flat_map(|b| [0.0, 0.25, 0.5, 0.75].map(|t| (b, t))) {
            let at = between(block, t);
            let places: [TipAndAxis; 2] = [0, 1].map(|h| read.heads.place(h, &at));
            let apart = tools_apart(&read.tools, [&places[0], &places[1]], 3.0);
            assert!(apart > 0.0, "line {}: the tools are {apart} mm apart", block.line);
        }
    }
}

/// A C that comes to its limit in the middle of passes parts them; with a pair each head goes the
/// same ways as without.
#[test]
fn what_a_limited_axis_parts_is_driven_from_end_to_end() {
    let job = job(483.0);
    let mut machine = job.json("machine.json");
    let joint = machine.pointer_mut("/workpiece_chain/rows/1/joint/revolute").unwrap();
    joint["range"] = json!({ "limited": { "min_deg": -60.0, "max_deg": 305.0 } });
    for chain in machine["tool_chains"].as_array_mut().unwrap() {
        for row in chain["rows"].as_array_mut().unwrap() {
            let of_head = row.pointer("/joint/revolute/axis").is_some_and(|a| a.as_str().unwrap().starts_with('B'));
            if of_head {
                row["joint"]["revolute"]["range"] = json!({ "limited": { "min_deg": -2.0, "max_deg": 100.0 } });
            }
        }
    }
    job.write("machine.json", serde_json::to_string(&machine).unwrap().as_bytes());
    let plane = |z: f64| json!({ "plane": { "origin_mm": [0.0, 0.0, z], "normal": [0.0, 0.0, z.signum()] } });
    let mut values = vec![
        ("/setups/0/clearance".to_owned(), plane(300.0)),
        ("/setups/0/second_clearance".to_owned(), plane(-300.0)),
        ("/pairs/0/lean_back_deg".to_owned(), json!(0.0)),
    ];
    for k in 0..2 {
        let of = |key: &str| format!("/operations/{k}/{key}");
        values.push((of("path/strategy/strategy/cylindrical_sections/to_radius_mm"), json!(487.5)));
        values.push((of("search/rotate_deg"), json!([0.0, 4.0])));
        values.push((of("tolerances/cusp_mm"), json!(3.0)));
        values.push((of("tolerances/linearisation_mm"), json!(0.1)));
        values.push((of("tolerances/max_step_mm"), json!(4.0)));
    }
    let values: Vec<(&str, Value)> = values.iter().map(|(p, v)| (p.as_str(), v.clone())).collect();
    job.set("job.json", &values);
    let lengths = |planned: &Planned| -> Vec<f64> {
        let of =
            |name: &str| planned.report.passes.iter().filter(|p| p.operation == name).map(|p| p.length_mm).sum::<f64>();
        vec![of("suction side"), of("pressure side")]
    };
    let both = plan(&job, false);
    job.set("job.json", &[("/pairs", Value::Null)]);
    let alone = plan(&job, false);
    let parted = alone.report.rewinds.inserted;
    assert!(parted > 0, "{:?}", alone.report.rewinds);
    assert_eq!(both.report.totals.planned_points, alone.report.totals.planned_points);
    for (paired, single) in lengths(&both).iter().zip(lengths(&alone)) {
        assert!(*paired > single - 1e-6 && *paired < 1.02 * single, "{paired} mm, alone {single} mm");
    }
}

/// Orders the runs of both heads: the same points are cut, and all laws of plans hold.
#[test]
fn runs_of_both_heads_are_cut_in_the_order_with_the_shortest_links() {
    let job = job(445.0);
    let as_laid = plan(&job, false);
    job.set("job.json", &[("/setups/0/links/order", json!("shortest"))]);
    let planned = plan(&job, true);
    assert!(as_laid.report.orders.is_empty());
    let name = "suction side + pressure side";
    let order = planned.report.orders.iter().find(|o| o.operation == name).expect("the order of a pair is reported");
    assert!(order.pieces == planned.report.pairs[0].runs && order.lower_bound_s <= order.ordered_s + 1e-9, "{order:?}");
    assert!(order.ordered_s <= order.as_laid_s, "{order:?}");
    assert_eq!(planned.report.totals.planned_points, as_laid.report.totals.planned_points);
    holds(&planned, &ReadPlan::of(&job, &planned));
}

/// Checks the laws of every plan of both heads.
fn holds(planned: &Planned, read: &ReadPlan) {
    let report = &planned.report;
    assert!(planned.is_clean(), "{:?} {:?}", report.findings, report.infeasible);
    assert!(report.findings.is_empty() && report.infeasible.is_empty() && report.singular_blocks.is_empty());
    assert!(report.totals.trimmed_points == 0 && report.totals.dropped_pieces == 0, "{:?}", report.totals);
    assert_eq!(report.totals.planned_points, report.totals.cc_points);
    every_block_names_what_it_must(read);
    both_tools_stand_where_they_were_planned(read);
    neither_tip_is_faster_than_programmed_and_one_axis_or_tip_sets_the_time(read);
    the_report_tells_the_ways_and_times_of_the_text(read);
    tools_are_apart_and_no_deeper_than_allowed(read);
    certificates_tell_every_block(read);
}

fn every_block_names_what_it_must(read: &ReadPlan) {
    let mut axes = read.heads.axes();
    assert_eq!(axes.len(), 9);
    axes.sort();
    let first = &read.blocks[0];
    let mut named = first.named.clone();
    named.sort();
    assert!(first.rapid && named == axes, "line {}: {named:?}", first.line);
    // The header has brought every axis there one by one.
    assert_eq!(first.from, first.to);
    for block in &read.blocks {
        let mut named = block.named.clone();
        named.sort();
        named.dedup();
        assert!(named.len() == block.named.len() && named.iter().all(|n| axes.contains(n)), "line {}", block.line);
        assert!(block.rapid || block.feed > 0.0, "line {}", block.line);
    }
}

/// One C for both: each head's place comes from its own four words and the C of the block.
fn both_tools_stand_where_they_were_planned(read: &ReadPlan) {
    for h in 0..2 {
        let own: Vec<&DualBlock> = read.blocks.iter().filter(|b| b.working[h]).collect();
        let points = &read.apts[h].points;
        assert_eq!(own.len(), points.len(), "head {}", h + 1);
        for (block, p) in own.iter().zip(points) {
            let (tip, axis) = read.heads.place(h, &block.to);
            let stated = format!("line {} head {}: {tip}, APT line {}: {}", block.line, h + 1, p.line, p.cl.tip);
            assert!((tip - p.cl.tip).norm() < ROUNDING, "{stated}");
            assert!((axis.into_inner() - p.cl.axis.into_inner()).norm() < 5e-6, "{stated}");
            assert_eq!(block.rapid, p.feed.is_none() || p.kind == facemill::cl_file::AptPointKind::Rapid, "{stated}");
        }
    }
    // The tools come from both sides.
    for block in read.blocks.iter().filter(|b| ReadPlan::is_cut(b)) {
        let [(_, a), (_, b)] = [0, 1].map(|h| read.heads.place(h, &block.to));
        assert!(a.dot(&b) < 0.0, "line {}", block.line);
    }
}

fn neither_tip_is_faster_than_programmed_and_one_axis_or_tip_sets_the_time(read: &ReadPlan) {
    let mut n = 0;
    for block in read.blocks.iter().filter(|b| !b.rapid) {
        let time = read.heads.time(block);
        let ways = read.ways(block);
        let key = if ReadPlan::is_cut(block) { "cutting_mm_min" } else { "approach_mm_min" };
        let requested = [0, 1].map(|h| number(&read.files["operations"][h]["feeds"][key]));
        for h in (0..2).filter(|&h| block.working[h]) {
            let most = requested[h] * time / 60.0 + 2.0 * ROUNDING;
            assert!(ways[h] <= most, "line {} head {}: {} mm in {time} s", block.line, h + 1, ways[h]);
        }
        assert!(read.heads.axis_time(block) <= time * (1.0 + 1e-3), "line {}", block.line);
        if ReadPlan::is_cut(block) {
            n += 1;
            let by_tips =
                (0..2).filter(|&h| block.working[h]).map(|h| 60.0 * (ways[h] + 2.0 * ROUNDING) / requested[h]);
            let needed = by_tips.fold(read.heads.axis_time(block), f64::max);
            assert!(time <= needed * (1.0 + 1e-3), "line {}: {time} s, {needed} s are enough", block.line);
        }
    }
    assert!(n > 50, "{n} cuts");
}

fn the_report_tells_the_ways_and_times_of_the_text(read: &ReadPlan) {
    let (mut time, mut paired, mut cut) = (0.0, [0.0; 2], [0.0; 2]);
    let mut fastest = [0.0_f64; 2];
    for block in &read.blocks {
        let own = read.heads.time(block);
        time += own;
        if ReadPlan::is_cut(block) {
            let ways = read.ways(block);
            for h in (0..2).filter(|&h| block.working[h]) {
                cut[h] += ways[h];
                if block.working == [true; 2] {
                    paired[h] += ways[h];
                    fastest[h] = fastest[h].max(60.0 * (ways[h] - 2.0 * ROUNDING) / own);
                }
            }
        }
    }
    let pair = read.pair();
    let near = |stated: &Value, own: f64| {
        let stated = number(stated);
        assert!((stated - own).abs() <= 1e-3 * own, "the report has {stated}, the text {own}");
    };
    near(&pair["time_s"], time);
    for h in 0..2 {
        near(&pair["paired_length_mm"][h], paired[h]);
        near(&pair["cutting_length_mm"][h], cut[h]);
        assert!(number(&pair["tip_feed_mm_min"][h][1]) >= fastest[h]);
    }
    let fraction = (paired[0] + paired[1]) / (cut[0] + cut[1]);
    near(&pair["paired_fraction"], fraction);
    // Like with like: neither has shorter links.
    let before = number(&pair["time_before_shortening_s"]);
    near(&pair["time_ratio"], before / number(&pair["separate_time_s"]));
    if read.report["links"]["shortened"].is_null() {
        near(&pair["time_before_shortening_s"], time);
    } else {
        assert!(before > time, "links of {pair} are no shorter");
    }
    assert_eq!(pair["shared_axis"], "C");
    // All axes of both heads in one law: no quicker than the constant speeds.
    let law = &read.report["time_law"];
    assert!(number(&law["total_time_s"]) > time && law["lowered_blocks"] == 0, "{law} {time}");
}

fn tools_are_apart_and_no_deeper_than_allowed(read: &ReadPlan) {
    let mut deepest = [0.0_f64; 2];
    let certificates = read.certificates["certificates"].as_array().unwrap();
    for block in read.blocks.iter().filter(|b| !b.rapid).step_by(7) {
        for t in [0.5, 1.0] {
            let at = between(block, t);
            let places: [TipAndAxis; 2] = [0, 1].map(|h| read.heads.place(h, &at));
            let apart = tools_apart(&read.tools, [&places[0], &places[1]], 3.0);
            assert!(apart > 0.0, "line {}: the tools are {apart} mm apart", block.line);
            let bodies = bodies_apart(&read.tools, [&places[0], &places[1]], 3.0);
            let proven = certificates.iter().find(|c| c["line"] == block.line && between_bodies(c));
            let proven = proven.and_then(|c| c["clearance_mm"].as_f64()).unwrap_or(0.0);
            assert!(bodies >= proven, "line {}: {bodies} mm apart, proven {proven}", block.line);
            for h in 0..2 {
                deepest[h] = deepest[h].max(read.back.depth(&places[h]));
            }
        }
    }
    for (h, depth) in deepest.into_iter().enumerate() {
        let budget = number(&read.report["budgets"][h]["against_mesh_mm"]);
        assert!(0.0 < depth && depth <= budget, "head {}: {depth} mm deep, {budget} allowed", h + 1);
    }
}

/// Whether a certificate's clearance is one between bodies that do not cut. That from the other
/// head's cutter is measured to the core of its rounded corner, and so may exceed the true one by
/// the corner's radius.
fn between_bodies(certificate: &Value) -> bool {
    let between = certificate["clearance_between"].as_array();
    between.is_some_and(|names| names.iter().all(|n| n.as_str().is_some_and(|n| !n.starts_with("cutter of tool"))))
}

/// Every motion has a certificate, and every certificate holds.
fn certificates_tell_every_block(read: &ReadPlan) {
    let all = read.certificates["certificates"].as_array().unwrap();
    assert_eq!(number(&read.certificates["blocks"]), all.len() as f64);
    assert_eq!(number(&read.certificates["certified"]), all.len() as f64);
    for block in &read.blocks[1..] {
        assert!(all.iter().any(|c| c["line"] == block.line), "no certificate of line {}", block.line);
    }
    for certificate in all {
        assert_eq!(certificate["certified"], true, "{certificate}");
    }
}

/// The time that the report compares with is that of the operations without a pair: of their text
/// all but the rapids over to the second head's first place, which it does not count.
fn separate_times_are_those_of_the_sides_one_after_the_other(alone: &Planned, read: &ReadPlan) {
    assert!(alone.report.pairs.is_empty());
    let blocks = dual_blocks(&text_of(alone, "program.nc"));
    assert!(blocks.iter().all(|b| ReadPlan::is_cut(b) <= (b.working != [true; 2])));
    let time = |rapids: bool| blocks.iter().filter(|b| rapids || !b.rapid).map(|b| read.heads.time(b)).sum::<f64>();
    let stated = number(&read.pair()["separate_time_s"]);
    assert!(stated > time(false) && stated <= time(true) * (1.0 + 1e-3), "{stated}: {} to {}", time(false), time(true));
}

/// Checks a file against the schema that is checked in.
fn obeys(format: &str, file: &Value) {
    let schema = std::fs::read(workspace().join(format!("docs/schemas/{format}.json"))).unwrap();
    let validator = jsonschema::validator_for(&serde_json::from_slice(&schema).unwrap()).unwrap();
    let faults: Vec<String> = validator.iter_errors(file).map(|e| format!("{}: {e}", e.instance_path())).collect();
    assert!(faults.is_empty(), "{format}: {}", faults.join("; "));
}
