//! Feeds that depend on chips: programs of a flat plate, whose chips are known in closed form, read
//! back.

mod volumes;

use facemill::chip_area::{
    Beside, CutterEnd, Engagement, NeighbourAxis, Orientation, PassSection, SectionSurface, chip_of_pass,
};
use facemill::sample_parts::{PatchSpec, patch};
use facemill::surface_model::{NamedNode, write_obj};
use facemill_tests::jobs::JobFolder;
use facemill_tests::oracles::interpreter::Motion;
use facemill_tests::oracles::read_back::number;
use facemill_tests::variants::{CUTTING, Written, box_obj, tiny_patch, written};
use nalgebra::{Isometry3, Vector3};
use serde_json::{Value, json};

/// Lead and lean of the plate's passes, deg.
const LEAD: f64 = 14.0;
const LEAN: f64 = 4.0;

/// Thickness of the stock on the plate, mm.
const STOCK: f64 = 0.4;

/// The kit's small job with a flat plate instead of the wavy patch, all passes with the same
/// posture.
fn plate(values: &[(&str, Value)]) -> JobFolder {
    let job = tiny_patch();
    let spec = PatchSpec::new([80.0, 80.0], 0.0, [1.0, 1.0]).expect("numbers in range");
    let mesh = patch(&spec, 8, 8).expect("numbers in range");
    let nodes = [NamedNode { name: "plate", mesh: 0, transform: Isometry3::identity() }];
    job.write("patch.obj", &write_obj(&[&mesh], &nodes).expect("a mesh"));
    job.set(
        "job.json",
        &[
            ("/operations/0/search/mode", json!({ "fixed": { "lead_deg": LEAD, "lean_deg": LEAN } })),
            ("/operations/0/feeds/approach_mm_min", json!(5000.0)),
            ("/setups/0/stock", json!({ "offset": { "allowance_mm": STOCK } })),
        ],
    );
    job.set("job.json", values);
    job
}

/// Plans a job and reads back what it wrote.
fn planned(job: &JobFolder) -> Written {
    let planned = job.plan();
    let out = job.path("out");
    std::fs::create_dir_all(&out).expect("a folder");
    for (name, bytes) in &planned.files {
        std::fs::write(out.join(name), bytes).expect("a file in it");
    }
    written(job, 0, "")
}

/// A cutting block of a program: where its tip ends, how far and how fast it goes.
struct Cut {
    y: f64,
    x: [f64; 2],
    length: f64,
    feed: f64,
}

/// Cutting blocks of each pass. The passes run along x with the same height of the tip.
fn passes(w: &Written) -> Vec<Vec<Cut>> {
    let mut passes: Vec<Vec<Cut>> = Vec::new();
    let ends = |m: &Motion| [w.back.tool(&m.from, m.rtcp).0, w.back.end(m).0];
    let floor = w.motions.iter().filter(|m| !m.rapid).map(|m| ends(m)[1].z).fold(f64::INFINITY, f64::min);
    for m in w.motions.iter().filter(|m| !m.rapid) {
        let [a, b] = ends(m);
        if (a.z - floor).max(b.z - floor) > 2e-3 {
            continue;
        }
        let length = (b - a).norm();
        let cut = Cut { y: b.y, x: [a.x, b.x], length, feed: 60.0 * length / m.seconds() };
        match passes.last_mut().filter(|p| p.last().is_some_and(|last: &Cut| (last.y - b.y).abs() < 0.01)) {
            Some(pass) => pass.push(cut),
            None => passes.push(vec![cut]),
        }
    }
    passes
}

/// Section of the chip with what lies on the side of the pass before, mm². The plate's first pass
/// has the smallest y, with climb milling the uncut stock on the right: its passes run to −x.
fn area(job: &JobFolder, right: Beside) -> f64 {
    let tool = job.json("tool.json");
    let section = PassSection {
        cutter: CutterEnd { radius: number(&tool["radius_mm"]), corner_radius: number(&tool["corner_radius_mm"]) },
        surface: SectionSurface::Plane,
        engagement: Engagement { depth_of_cut: STOCK, left: right, right: Beside::Stock },
        // Toward the uncut stock, on the right.
        orientation: Orientation { lead: LEAD.to_radians(), lean: -LEAN.to_radians() },
        neighbour_axis: NeighbourAxis::Parallel,
    };
    chip_of_pass(&section).expect("a section").area
}

/// Returns the largest change of a feed that is read back by the rounding of words to 0.001 mm, as
/// part of it.
fn rounding(cut: &Cut) -> f64 {
    3e-3 / cut.length
}

#[test]
fn removal_rate_is_kept_between_its_bounds_in_every_block() {
    let plain = plate(&[]);
    let before = planned(&plain);
    let own = passes(&before);
    assert!(own.len() >= 4, "{} passes", own.len());
    let step = (own[1][0].y - own[0][0].y).abs();
    let (full, beside) = (area(&plain, Beside::Stock), area(&plain, Beside::Cut { step_over: step }));
    assert!(full > 2.0 * beside, "{full} mm², {beside} mm²");
    // At 900 mm/min beside the pass before; in full stock it would be slower than the smallest
    // feed.
    let (target, min) = (900.0 * beside / 1000.0, 1.2 * 900.0 * beside / full);
    let w = planned(&plate(&[(
        "/operations/0/feeds/removal_rate",
        json!({ "target_cm3_min": target, "min_mm_min": min }),
    )]));
    let after = passes(&w);
    assert_eq!(after.len(), own.len());
    for (k, pass) in after.iter().enumerate() {
        let area = if k == 0 { full } else { beside };
        for (at, cut) in pass.iter().enumerate() {
            let slack = 1.0 + 1e-3 + rounding(cut);
            assert!(cut.feed <= CUTTING * slack);
            let at_min = cut.feed <= min * slack;
            assert!(at_min || cut.feed * area <= 1000.0 * target * slack, "pass {k}: {} mm/min", cut.feed);
            // Not slower than the law asks for: the last block's end may be in stock of which
            // nothing is known.
            let requested = if k == 0 { min } else { 900.0 };
            let is_inside = at > 0 && at + 1 < pass.len();
            assert!(!is_inside || cut.feed >= requested * (2.0 - slack) - 0.2, "pass {k}: {} mm/min", cut.feed);
        }
    }
    let chips = &w.report["chips"][0];
    let variation = |when: &str| number(&chips[format!("removal_rate_{when}_cm3_min")]["variation"]);
    assert!(variation("after") < 0.6 * variation("before"), "{chips}");
    let largest = number(&chips["removal_rate_before_cm3_min"]["max"]);
    assert!((largest - full * CUTTING / 1000.0).abs() < 2e-3 * largest, "{largest}");
    let smallest = number(&chips["area_mm2"]["min"]);
    assert!((smallest - beside).abs() < 2e-3 * beside, "{smallest} for {beside} mm²");
    // The time that the passes take longer: by the law of both programs, which at constant feeds
    // would be more.
    let by_law = |w: &Written| number(&w.report["time_law"]["passes_time_s"]);
    let added = by_law(&w) - by_law(&before);
    assert!((number(&chips["added_time_s"]) - added).abs() < 0.03 * added, "{added} s, {chips}");
    // Entries in the stock are not faster than the first cut.
    let ends_at_first_cut = |k: &usize| {
        let is_cut = |k: usize| w.feeds[k].is_some_and(|f| f <= CUTTING);
        let z = |k: usize| w.back.end(&w.motions[k]).0.z;
        is_cut(*k) && is_cut(k + 1) && z(k - 1) > z(*k) + 2e-3 && (z(k + 1) - z(*k)).abs() < 2e-3
    };
    let entries: Vec<usize> = (1..w.motions.len() - 1).filter(ends_at_first_cut).collect();
    assert_eq!(entries.len(), after.len());
    assert!(entries.iter().all(|&k| w.feeds[k] <= w.feeds[k + 1]));
}

/// Casting beyond the ends of the passes, mm.
const AROUND: f64 = 5.0;

#[test]
fn entries_and_exits_are_slow_in_the_casting_alone() {
    let arc = json!({ "tangential_arc": { "radius_mm": 30.0, "angle_deg": 30.0, "straight_mm": 40.0 } });
    let end = 40.0 + AROUND;
    let of_casting = |values: &[(&str, Value)]| {
        let stock = json!({ "mesh": { "file": "casting.obj", "unit": "millimetre", "up_axis": "z" } });
        let job = plate(&[
            ("/setups/0/stock", stock),
            ("/operations/0/entry", arc.clone()),
            ("/operations/0/exit", arc.clone()),
        ]);
        job.write("casting.obj", box_obj([-end, -end, -6.0], [end, end, STOCK]).as_bytes());
        job.set("job.json", values);
        (planned(&job), job)
    };
    let (before, plain) = of_casting(&[]);
    let own = passes(&before);
    let step = (own[1][0].y - own[0][0].y).abs();
    let (full, beside) = (area(&plain, Beside::Stock), area(&plain, Beside::Cut { step_over: step }));
    let target = 300.0 * beside / 1000.0;
    let (w, _) =
        of_casting(&[("/operations/0/feeds/removal_rate", json!({ "target_cm3_min": target, "min_mm_min": 10.0 }))]);

    // The contact from the tip: the lowest point of the corner.
    let tool = plain.json("tool.json");
    let (radius, corner) = (number(&tool["radius_mm"]), number(&tool["corner_radius_mm"]));
    let axis = Vector3::new(-LEAD.to_radians().tan(), LEAN.to_radians().tan(), 1.0).normalize();
    let lowest = (axis * axis.z - Vector3::z()).normalize();
    let contact = axis.x * corner + lowest.x * (radius - corner);
    let passes = passes(&w);
    assert!(passes.len() >= 4, "{} passes", passes.len());
    for (k, pass) in passes.iter().enumerate() {
        let area = if k == 0 { full } else { beside };
        let (mut fast, mut slow) = ([0, 0], 0);
        for cut in pass {
            let slack = 1.0 + 1e-3 + rounding(cut);
            let [from, to] = cut.x.map(|x| x + contact);
            if to < end && from > -end {
                assert!(cut.feed * area <= 1000.0 * target * slack, "pass {k}: {} mm/min at {to}", cut.feed);
                slow += 1;
            }
            // Half of the rim cuts: behind the contact, and a little before it; and sections are
            // some millimetres apart.
            if to - 0.25 * radius - 5.0 > end || from + 1.4 * radius + 5.0 < -end {
                assert!(cut.feed >= CUTTING * (2.0 - slack), "pass {k}: {} mm/min at {to}", cut.feed);
                fast[usize::from(to < 0.0)] += 1;
            }
        }
        assert!(slow > 20 && fast.iter().all(|n| *n > 2), "pass {k}: {slow} blocks in the casting, {fast:?} beyond");
    }
}

/// Largest part of the unit feed along the normal of what of the cutter is below the stock's top,
/// in full stock: from points of the corner and the flute.
fn steepest(job: &JobFolder) -> f64 {
    let tool = job.json("tool.json");
    let (radius, corner) = (number(&tool["radius_mm"]), number(&tool["corner_radius_mm"]));
    let (feed, up) = (Vector3::x(), Vector3::z());
    // To the left of the feed; the axis leans to the right.
    let axis = Vector3::new(LEAD.to_radians().tan(), -LEAN.to_radians().tan(), 1.0).normalize();
    let toward = axis.cross(&up).cross(&axis).normalize();
    let middle = up * corner + toward * (radius - corner);
    let beside = axis.cross(&toward);
    let mut steepest = 0.0;
    for k in 0..20_000 {
        let (sin, cos) = (f64::from(k) / 20_000.0 * std::f64::consts::TAU).sin_cos();
        let out = toward * cos + beside * sin;
        for i in 0..=200 {
            let (sin, cos) = (f64::from(i) / 200.0 * std::f64::consts::FRAC_PI_2).sin_cos();
            let normal = out * sin - axis * cos;
            let place = middle + out * (radius - corner) + normal * corner;
            if place.z <= STOCK {
                steepest = f64::max(steepest, normal.dot(&feed));
            }
        }
    }
    steepest
}

#[test]
fn chips_are_nowhere_thicker_than_requested_even_where_the_removal_rate_has_its_smallest_feed() {
    let plain = plate(&[]);
    let teeth = number(&plain.json("tool.json")["n_inserts"]);
    let rpm = number(&plain.json("job.json")["operations"][0]["feeds"]["spindle_rpm"]);
    let share = steepest(&plain);
    // Half of what the job's feed gives in full stock, with a smallest feed above that.
    let max = 0.5 * share * CUTTING / (rpm * teeth);
    let w = planned(&plate(&[
        ("/operations/0/feeds/chip_thickness", json!({ "max_mm": max })),
        ("/operations/0/feeds/removal_rate", json!({ "target_cm3_min": 1e-3, "min_mm_min": 0.75 * CUTTING })),
    ]));
    let passes = passes(&w);
    for cut in passes.iter().flatten() {
        assert!(cut.feed <= 0.75 * CUTTING * (1.0 + rounding(cut)), "{} mm/min", cut.feed);
    }
    for cut in &passes[0] {
        let thickness = share * cut.feed / (rpm * teeth);
        assert!(thickness <= max * (1.0 + 1e-3 + rounding(cut)), "{thickness} mm");
        // The corner is sampled, and the bound is up to 0.001 too large.
        assert!(thickness >= max * 0.99 - 0.2 / (rpm * teeth), "{thickness} mm");
    }
    let chips = &w.report["chips"][0];
    assert!(number(&chips["largest_chip_thickness_mm"][1]) <= max * (1.0 + 1e-9), "{chips}");
    assert!(number(&chips["feeds_set_by"]["chip_thickness"]) > 0.0, "{chips}");
}

#[test]
fn the_table_of_points_has_every_point_with_the_chip_of_the_plate() {
    let job = plate(&[]);
    let planned = job.plan();
    let (name, bytes) = &planned.chip_table;
    assert_eq!(name, "chips.csv");
    let program = &planned.files.iter().find(|(name, _)| name == "program.nc").expect("a program").1;
    let stamp = format!("# program.nc blake3 {}\n", facemill::formats::checksum(program));
    assert!(bytes.starts_with(stamp.as_bytes()), "{stamp}");
    assert_eq!(planned.report.programs, [facemill::formats::ProgramStamp::new("program.nc".as_ref(), program)]);
    let text = String::from_utf8(bytes.clone()).expect("text");
    let rows: Vec<Vec<&str>> = text.lines().filter(|l| !l.starts_with('#')).map(|l| l.split(',').collect()).collect();
    let column = |name: &str| rows[0].iter().position(|n| *n == name).expect("a column");
    assert_eq!(rows.len() - 1, planned.report.totals.planned_points);
    let full = area(&job, Beside::Stock);
    let (pass, area_of, feed) = (column("pass"), column("area_mm2"), column("tip_feed_after_mm_min"));
    let rate = column("removal_rate_after_cm3_min");
    for row in rows[1..].iter().filter(|r| r[pass] == "1") {
        let area: f64 = row[area_of].parse().expect("a number");
        assert!((area - full).abs() < 2e-3 * full, "{area} for {full}");
        if let (Ok(feed), Ok(rate)) = (row[feed].parse::<f64>(), row[rate].parse::<f64>()) {
            assert!((rate - area * feed / 1000.0).abs() < 2e-3 * rate, "{row:?}");
        }
    }
    let svg = planned.files.iter().find(|(n, _)| n == "chips.svg").expect("a picture");
    assert!(svg.1.starts_with(b"<svg") && svg.1.len() < 200_000);
}

#[test]
fn a_removal_rate_that_is_never_reached_changes_no_byte() {
    let plain = planned(&plate(&[]));
    let lax = planned(&plate(&[(
        "/operations/0/feeds/removal_rate",
        json!({ "target_cm3_min": 1000.0, "min_mm_min": 10.0 }),
    )]));
    assert_eq!((plain.nc, plain.apt), (lax.nc, lax.apt));
    assert_eq!(number(&lax.report["chips"][0]["added_time_s"]), 0.0);
    assert_eq!(plain.report["chips"][0]["by_chips"], false);
}

/// A prism over a profile in x and z, counter-clockwise seen toward +y, as far to both sides.
fn prism_obj(profile: &[[f64; 2]; 6], half_width: f64) -> String {
    let mut text = String::from("o stock\n");
    for y in [-half_width, half_width] {
        for [x, z] in profile {
            text += &format!("v {x} {y} {z}\n");
        }
    }
    // Sides, then both ends as fans of convex parts: the step is between corners 3 and 5.
    for k in 1..=6 {
        let next = k % 6 + 1;
        text += &format!("f {k} {} {} {next}\n", k + 6, next + 6);
    }
    for [a, b, c] in [[1, 2, 4], [2, 3, 4], [1, 4, 5], [1, 5, 6]] {
        text += &format!("f {a} {b} {c}\nf {} {} {}\n", a + 6, c + 6, b + 6);
    }
    text
}

#[test]
fn air_has_its_own_feed_only_where_the_cutter_is_clear_of_the_stock() {
    let air = 4000.0;
    let edge = 10.0;
    let job = plate(&[
        ("/operations/0/feeds/air_mm_min", json!(air)),
        ("/setups/0/stock", json!({ "mesh": { "file": "stock.obj", "unit": "millimetre" } })),
    ]);
    // A slab under all of the plate with a layer on a part of it, as a prism along y.
    let profile = [[-60.0, -5.0], [60.0, -5.0], [60.0, 0.0], [edge, 0.0], [edge, STOCK], [-60.0, STOCK]];
    job.write("stock.obj", prism_obj(&profile, 60.0).as_bytes());
    let w = planned(&job);
    let diameter = 2.0 * w.back.cutter.radius;
    let mut n = [0, 0];
    for cut in passes(&w).iter().flatten() {
        let slack = 1.0 + 1e-3 + rounding(cut);
        let nearest = cut.x[0].min(cut.x[1]);
        if cut.feed > CUTTING * slack {
            assert!(cut.feed <= air * slack, "{} mm/min", cut.feed);
            // Contact is at the rim, so that the tip may be nearer by a radius.
            assert!(nearest > edge, "{} mm/min at x = {nearest}", cut.feed);
            n[0] += 1;
        } else {
            assert!(
                nearest < edge + 2.0 * diameter + 3.0,
                "no air from {} to {}: {} mm/min",
                cut.x[0],
                cut.x[1],
                cut.feed
            );
            n[1] += 1;
        }
    }
    assert!(n[0] > 20 && n[1] > 20, "{n:?}");
    let points = number(&w.report["chips"][0]["air_points"]);
    assert!(points > 20.0, "{points} points in the air");
}

#[test]
fn feeds_that_contradict_each_other_are_refused_by_name() {
    let removal = |target: f64, min: f64| json!({ "target_cm3_min": target, "min_mm_min": min });
    let none = json!({ "offset": { "allowance_mm": 0.0 } });
    let rate = "/operations/0/feeds/removal_rate";
    type Case<'c> = (&'c [(&'c str, Value)], &'c [&'c str]);
    let cases: [Case<'_>; 8] = [
        (&[(rate, removal(0.0, 10.0))], &["operations[0].feeds.removal_rate.target_cm3_min", "more than 0"]),
        (&[(rate, removal(1.0, -1.0))], &["operations[0].feeds.removal_rate.min_mm_min", "more than 0"]),
        (&[(rate, removal(1.0, 1300.0))], &["feeds.removal_rate.min_mm_min", "1300", "1200", "smaller"]),
        (&[("/operations/0/feeds/air_mm_min", json!(900.0))], &["feeds.air_mm_min", "900", "1200", "larger"]),
        (&[("/operations/0/feeds/air_mm_min", json!(1e7))], &["feeds.air_mm_min", "control"]),
        (
            &[(rate, removal(1.0, 10.0)), ("/setups/0/stock", none)],
            &["operations[0].feeds", "setups[0].stock", "nothing"],
        ),
        (&[(rate, json!({ "target_cm3_min": 1.0 }))], &["min_mm_min", "missing"]),
        (&[("/operations/0/feeds/chip_thickness", json!({ "max_mm": 0.0 }))], &["feeds.chip_thickness.max_mm", "more"]),
    ];
    for (values, said) in cases {
        let error = plate(values).try_plan().err().expect("an error").to_string();
        assert!(said.iter().all(|part| error.contains(part)), "{said:?}: {error}");
    }
}

/// Thinner chips than the control's smallest F leaves are refused, and the least thickness that the
/// message names works.
#[test]
fn the_least_chip_thickness_is_reported_and_works() {
    let job = plate(&[]);
    let ask = |max: f64| {
        job.set("job.json", &[("/operations/0/feeds/chip_thickness", json!({ "max_mm": max }))]);
        facemill::Job::read(&job.job()).err().map(|why| why.to_string())
    };
    let why = ask(1e-9).expect("too thin");
    assert!(why.contains("operations[0].feeds.chip_thickness.max_mm"), "{why}");
    let least: f64 = why.rsplit(' ').next().expect("a number").parse().expect("a number");
    let operation = &job.json("job.json")["operations"][0];
    let teeth = number(&job.json("tool.json")["n_inserts"]);
    let slowest = least * number(&operation["feeds"]["spindle_rpm"]) * teeth;
    let smallest = number(&job.json("machine.json")["feed"]["min_mm_min"]);
    assert!(slowest >= smallest && slowest < 1.2 * smallest, "{slowest} mm/min");
    assert_eq!(ask(least), None);
    assert!(ask(0.8 * least).is_some());
}
