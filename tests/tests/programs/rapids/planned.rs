//! Links of plans: shorter ones are free by the kit's own kinematics and distances, and change
//! nothing else.

use facemill::rapids::{RetractStrategy, ShortenedLinks};
use facemill::{Job, PlanSettings, Planned, SilentStages, plan_job};
use facemill_tests::jobs::{JobFolder, text_of};
use facemill_tests::oracles::interpreter::{self, Motion};
use facemill_tests::oracles::read_back::ReadBack;
use facemill_tests::variants::{box_obj, variant};
use serde_json::{Value, json};

fn planned(job: &JobFolder) -> Planned {
    let settings = PlanSettings { verify: true, certificates: false };
    let mut all =
        plan_job(&Job::read(&job.job()).unwrap(), settings, Some(1.0), &SilentStages).unwrap_or_else(|e| panic!("{e}"));
    all.pop().unwrap()
}

/// Few passes, from which links are short and plain.
fn few_passes(values: &[(&str, Value)]) -> JobFolder {
    let planes = "/operations/0/path/strategy/strategy/parallel_planes";
    let (from, to) = (format!("{planes}/from_mm"), format!("{planes}/to_mm"));
    let few = [(from.as_str(), json!(-2.2)), (to.as_str(), json!(2.2))];
    variant(&[&few[..], values].concat())
}

/// Plans passes of seven points along x from these x and y, with this step, in either direction.
fn planned_islands(job: &JobFolder, starts: &[[f64; 3]]) -> Planned {
    let pass = |[x, y, step]: &[f64; 3]| {
        let points: Vec<[f64; 3]> = (0..7).map(|k| [x + step * f64::from(k), *y, 0.0]).collect();
        json!({ "points_mm": points })
    };
    let passes: Vec<Value> = starts.iter().map(pass).collect();
    let path = json!({ "format": "facemill-path/1", "frame": "work", "passes": passes });
    job.write("islands.json", path.to_string().as_bytes());
    let file = json!({ "file": { "file": "islands.json", "max_distance_mm": 5.0 } });
    job.set("job.json", &[("/operations/0/path", file), ("/operations/0/direction", json!("either"))]);
    planned(job)
}

fn shortened(planned: &Planned) -> &ShortenedLinks {
    planned.report.links.shortened.as_ref().expect("links that were looked at")
}

/// Within bounds, summed up and in order; for lines that hold a run of rapids between two cuts, and
/// nothing else.
fn adds_up(planned: &Planned) {
    let links = shortened(planned);
    let motions = interpreter::run(&text_of(planned, "program.nc"));
    for link in &links.links {
        let in_it = |m: &Motion| (link.lines[0]..=link.lines[1]).contains(&(m.line as u32));
        let first = motions.iter().position(in_it).unwrap();
        let last = motions.iter().rposition(in_it).unwrap();
        assert!(motions[first..=last].iter().all(|m| m.rapid) && !motions[first - 1].rapid && !motions[last + 1].rapid);
    }
    let sum = |time: fn(&facemill::rapids::PlannedLinkReport) -> f64| links.links.iter().map(time).sum::<f64>();
    let sums = [sum(|l| l.time_before_s), sum(|l| l.time_after_s), sum(|l| l.lower_bound_s)];
    assert_eq!(sums, [links.time_before_s, links.time_after_s, links.lower_bound_s]);
    assert_eq!(links.changed, links.links.iter().filter(|l| l.way != RetractStrategy::Original).count());
    for link in &links.links {
        assert!(link.lower_bound_s <= link.time_after_s + 1e-9 && link.time_after_s <= link.time_before_s, "{link:?}");
        assert_eq!(link.way == RetractStrategy::Original, link.time_after_s == link.time_before_s, "{link:?}");
    }
    assert!(links.links.windows(2).all(|pair| pair[0].lines[1] < pair[1].lines[0]));
}

#[test]
fn links_come_down_to_the_stock_and_cuts_stay_as_they_are() {
    let job = few_passes(&[]);
    let short = planned(&job);
    let links = shortened(&short);
    adds_up(&short);
    assert!(links.changed == links.links.len() && links.changed >= 2, "{links:?}");
    assert!(links.time_after_s < 0.7 * links.time_before_s, "{links:?}");
    assert!(short.report.findings.is_empty(), "{:?}", short.report.findings);
    let long = planned(&few_passes(&[("/setups/0/links", json!({ "shorten": false }))]));
    assert_eq!(long.report.links.not_shortened_because.as_deref(), Some("the job says so (links.shorten)"));

    let [short_text, long_text] = [&short, &long].map(|planned| text_of(planned, "program.nc"));
    let [short_run, long_run] = [&short_text, &long_text].map(|text| interpreter::run(text));
    let cuts = |run: &[Motion]| -> Vec<_> { run.iter().filter(|m| !m.rapid).map(|m| (m.from, m.to, m.feed)).collect() };
    assert_eq!(cuts(&short_run), cuts(&long_run));
    let rapids = |run: &[Motion]| run.iter().filter(|m| m.rapid).count();
    assert!(rapids(&short_run) < rapids(&long_run));
    // The other text has the same ways: as many places at rapid rate, without those of template and
    // header.
    let in_apt = |planned: &Planned| text_of(planned, "program.apt").matches("RAPID").count();
    assert_eq!(rapids(&long_run) - rapids(&short_run), in_apt(&long) - in_apt(&short));

    // The whole tool keeps 0.9 of 5 mm from part and the stock on it, everywhere.
    let kit = ReadBack::of(&job, 0);
    let thickness = kit.grounds.iter().map(|g| g.thickness).fold(0.0, f64::max);
    assert!(thickness > 0.0 && kit.rapid_clearance == 5.0);
    for link in &links.links {
        let own = short_run.iter().filter(|m| (link.lines[0]..=link.lines[1]).contains(&(m.line as u32)));
        for place in own.flat_map(|m| kit.places(m, 2.0)) {
            assert!(kit.distance(&place, 6.0) >= 4.5 - 1e-3, "{place:?}");
        }
    }
}

/// Stock that a first operation cuts away: links go where it was, and nearer to it at their ends.
#[test]
fn links_go_through_stock_that_has_been_cut_where_the_job_lets_them() {
    let of = |stock: &str| {
        let job = few_passes(&[("/setups/0/links", json!({ "stock": stock }))]);
        let first = job.json("job.json")["operations"][0].clone();
        let mut second = first.clone();
        second["name"] = json!("again");
        job.set("job.json", &[("/operations", json!([first, second]))]);
        (planned(&job), job)
    };
    let ((at_first, _), (as_cut, job)) = (of("at_first"), of("as_cut"));
    [&at_first, &as_cut].into_iter().for_each(adds_up);
    assert!(as_cut.report.findings.is_empty(), "{:?}", as_cut.report.findings);
    let [first, cut] = [&at_first, &as_cut].map(shortened);
    assert!(cut.changed == cut.links.len() && cut.time_after_s < first.time_after_s + 1e-9, "{first:?} {cut:?}");
    // Nearer than the stock was, and off the part.
    let kit = ReadBack::of(&job, 0);
    let run = interpreter::run(&text_of(&as_cut, "program.nc"));
    let is_link = |m: &&Motion| cut.links.iter().any(|l| (l.lines[0]..=l.lines[1]).contains(&(m.line as u32)));
    let places: Vec<_> = run.iter().filter(is_link).flat_map(|m| kit.places(m, 2.0)).collect();
    assert!(places.iter().all(|place| kit.depth(place) == 0.0));
    let nearest = places.iter().map(|place| kit.distance(place, 6.0)).fold(f64::INFINITY, f64::min);
    assert!(nearest < 4.5, "{nearest}");
}

#[test]
fn what_is_switched_between_operations_is_switched_far_from_the_part() {
    let two = |change: f64| {
        let job = few_passes(&[]);
        let first = job.json("job.json")["operations"][0].clone();
        let mut second = first.clone();
        second["name"] = json!("again");
        second["feeds"]["spindle_rpm"] = json!(first["feeds"]["spindle_rpm"].as_f64().unwrap() + change);
        job.set("job.json", &[("/operations", json!([first, second]))]);
        planned(&job)
    };
    let (same, other) = (two(0.0), two(-500.0));
    let [same, other] = [&same, &other].map(|planned| {
        adds_up(planned);
        shortened(planned).links.clone()
    });
    assert_eq!(same.len(), other.len());
    let kept: Vec<_> = other.iter().filter_map(|l| l.kept_because.as_deref()).collect();
    assert_eq!(kept, ["spindle or coolant change on it"]);
    let at = other.iter().position(|l| l.kept_because.is_some()).unwrap();
    assert!(same[at].way != RetractStrategy::Original && other[at].way == RetractStrategy::Original);
}

#[test]
fn islands_are_cut_one_after_the_other_where_the_job_allows_it() {
    // Two islands at both ends of the patch, laid by turns.
    let islands = |order: &str| {
        let job = few_passes(&[("/setups/0/links", json!({ "shorten": false, "order": order }))]);
        let starts = [0.0, 2.0, 4.0].map(|y| [[25.0, y, 2.0], [-25.0, y, -2.0]]).concat();
        planned_islands(&job, &starts)
    };
    let [laid, short] = ["as_laid", "shortest"].map(islands);
    let changes = |planned: &Planned| {
        let sides: Vec<usize> = planned.report.passes.iter().map(|p| p.pass % 2).collect();
        sides.windows(2).filter(|pair| pair[0] != pair[1]).count()
    };
    assert!(changes(&laid) == 5 && changes(&short) <= 2, "{:?}", short.report.orders);
    // Passes of an island keep their order, and what they take.
    for island in [0, 1] {
        let of = |planned: &Planned| -> Vec<_> {
            let own = planned.report.passes.iter().filter(|p| p.pass % 2 == island);
            own.map(|p| (p.pass, p.chip_area_mm2, p.cusp_mm)).collect()
        };
        assert_eq!(of(&laid), of(&short));
    }
    let [order] = &short.report.orders[..] else { panic!("{:?}", short.report.orders) };
    assert!(order.timed_links >= 5, "{order:?}");
    assert!(laid.report.orders.is_empty() && order.is_exact && order.pieces == 6 && order.kept_pairs == 6);
    assert!(order.ordered_s < 0.7 * order.as_laid_s && order.lower_bound_s == order.ordered_s, "{order:?}");
    assert!(short.report.totals.rapid_time_s < laid.report.totals.rapid_time_s);
}

#[test]
fn the_order_of_passes_counts_links_as_the_program_makes_them() {
    // Two islands laid by turns, and the same with a clamp between them: links over it lead up, and
    // take longer than their slowest axis.
    let plan = |order: &str, clamp: bool| {
        let clearance = ("/setups/0/clearance/plane/origin_mm", json!([0, 0, 60]));
        let job = few_passes(&[("/setups/0/links", json!({ "order": order })), clearance]);
        if clamp {
            let file = json!({ "file": "clamp.obj", "role": "fixture" });
            job.write("clamp.obj", box_obj([-2.0, -40.0, -5.0], [2.0, 40.0, 12.0]).as_bytes());
            let mut meshes = job.json("job.json")["setups"][0]["meshes"].clone();
            meshes.as_array_mut().unwrap().push(file);
            job.set("job.json", &[("/setups/0/meshes", meshes)]);
        }
        let starts = [0.0, 2.0].map(|y| [[25.0, y, 2.0], [-37.0, y, 2.0]]).concat();
        planned_islands(&job, &starts)
    };
    let as_laid = [false, true].map(|clamp| {
        let [laid, short] = ["as_laid", "shortest"].map(|order| plan(order, clamp));
        let [order] = &short.report.orders[..] else { panic!("{:?}", short.report.orders) };
        let sum = |planned: &Planned| shortened(planned).links.iter().map(|link| link.time_after_s).sum::<f64>();
        // Both begin at the same height, and so the same time from home.
        let (saved, saved_in_text) = (order.as_laid_s - order.ordered_s, sum(&laid) - sum(&short));
        assert!(saved > 0.0 && (saved - saved_in_text).abs() <= 0.01 * sum(&laid), "{order:?} {saved_in_text}");
        assert!(order.is_exact && order.timed_links >= 6, "{order:?}");
        sum(&laid)
    });
    assert!(as_laid[1] > 1.1 * as_laid[0], "{as_laid:?}");
}
