//! Programs of one small job in its variants: entries, directions, path files, cones, allowances,
//! patterns. Each is planned by the command, ends with exit code 0, and is held to what every clean
//! program is held to and to a law of its own.

use facemill::surface_model::TriMesh;
use facemill_tests::jobs::{JobFolder, unfinished};
use facemill_tests::oracles::brute::in_tool;
use facemill_tests::oracles::interpreter::Motion;
use facemill_tests::oracles::read_back::{TipAndAxis, number};
use facemill_tests::variants::{APPROACH, CUTTING, Written, planned, strays, tiny_patch, tiny_patch_planned, variant};
use nalgebra::{Point3, Rotation3, Unit, Vector3};
use serde_json::{Value, json};

/// Runs of motions at approach feed: of each its places, the place before it, and whether it is an
/// entry.
fn approaches(w: &Written) -> Vec<(Vec<TipAndAxis>, bool)> {
    let mut runs: Vec<(Vec<TipAndAxis>, bool)> = Vec::new();
    for (k, m) in w.motions.iter().enumerate() {
        if w.feeds[k] != Some(APPROACH) {
            continue;
        }
        let starts = w.feeds[k - 1] != Some(APPROACH);
        if starts {
            // An entry comes out of a rapid.
            runs.push((vec![w.back.tool(&m.from, m.rtcp)], w.feeds[k - 1].is_none()));
        }
        runs.last_mut().unwrap().0.push(w.back.end(m));
    }
    runs
}

#[test]
fn roll_ins_and_roll_outs_stay_on_the_cut_side() {
    let arc = json!({ "roll_in": { "radius_mm": 15, "angle_deg": 60 } });
    for (order, cut_side) in [("increasing", -1.0), ("decreasing", 1.0)] {
        let w = planned(&variant(&[
            ("/operations/0/entry", arc.clone()),
            ("/operations/0/exit", arc.clone()),
            ("/operations/0/path/strategy/order", json!(order)),
        ]));
        w.check();
        let runs = approaches(&w);
        assert_eq!(runs.len(), 2 * w.total("passes") as usize);
        for (mut places, entry) in runs {
            // From the pass outward.
            if entry {
                places.reverse();
            }
            let tip = places[0].0;
            let sideways = |p: &TipAndAxis| (p.0 - tip).y * cut_side;
            let mut last = 0.0;
            for p in &places[1..] {
                // Words are rounded.
                assert!(sideways(p) >= last - 2e-3, "{order}: {} mm after {last}", sideways(p));
                last = sideways(p);
            }
            assert!(last > 1.0, "{order}: it rolls sideways by {last} mm only");
        }
    }
}

/// Signs of the x motions of the passes in order.
fn senses(w: &Written) -> Vec<f64> {
    let mut senses: Vec<f64> = Vec::new();
    let mut cutting = false;
    for (m, feed) in w.motions.iter().zip(&w.feeds) {
        let cuts = *feed == Some(CUTTING);
        let dx = w.back.end(m).0.x - w.back.tool(&m.from, m.rtcp).0.x;
        if cuts && !cutting {
            senses.push(0.0);
        }
        if cuts {
            *senses.last_mut().unwrap() += dx;
        }
        cutting = cuts;
    }
    senses
}

#[test]
fn zigzag_turns_round_at_every_pass_and_goes_less_in_rapids() {
    let one_way = tiny_patch_planned();
    let zigzag = planned(&variant(&[
        ("/operations/0/direction", json!("either")),
        ("/operations/0/path/strategy/linking", json!("zigzag")),
    ]));
    zigzag.check();
    let (straight, turning) = (senses(one_way), senses(&zigzag));
    assert_eq!((straight.len(), turning.len()), (6, 6));
    assert!(straight.iter().chain(&turning).all(|s| s.abs() > 60.0), "{straight:?} {turning:?}");
    assert!(straight.windows(2).all(|s| s[0] * s[1] > 0.0), "{straight:?}");
    assert!(turning.windows(2).all(|s| s[0] * s[1] < 0.0), "{turning:?}");
    let rapids = |w: &Written| -> f64 {
        let way = |m: &Motion| (w.back.end(m).0 - w.back.tool(&m.from, m.rtcp).0).norm();
        w.motions.iter().filter(|m| m.rapid).map(way).sum()
    };
    assert!(rapids(&zigzag) < 0.5 * rapids(one_way), "{} {}", rapids(&zigzag), rapids(one_way));
}

#[test]
fn conventional_is_climb_the_other_way_round() {
    let climb = senses(tiny_patch_planned());
    let w = planned(&variant(&[("/operations/0/direction", json!("conventional"))]));
    w.check();
    let conventional = senses(&w);
    assert_eq!(climb.len(), conventional.len());
    assert!(climb.iter().zip(&conventional).all(|(a, b)| a * b < 0.0), "{climb:?} {conventional:?}");
}

/// The nearest point of a mesh, to a few hundredths of a millimetre: the best of many samples of
/// the triangles near it.
fn nearest_of(mesh: &TriMesh, p: &Point3<f64>) -> Point3<f64> {
    let near = (0..mesh.triangles().len()).map(|k| mesh.corners(k)).filter(|t| (t[0] - p).norm() < 4.0);
    let n = 16;
    let samples = near.flat_map(|t| {
        (0..=n).flat_map(move |i| {
            (0..=n - i)
                .map(move |j| t[0] + ((t[1] - t[0]) * f64::from(i) + (t[2] - t[0]) * f64::from(j)) / f64::from(n))
        })
    });
    samples.min_by(|a, b| (a - p).norm().total_cmp(&(b - p).norm())).expect("a mesh near the point")
}

#[test]
fn every_point_of_a_path_file_is_touched_and_nothing_else_is_cut() {
    let rows = [-6.0, -3.0, 0.0];
    let passes: Vec<Value> = rows
        .iter()
        .map(|y| json!({ "points_mm": (0..37).map(|k| json!([-36.0 + 2.0 * f64::from(k), y, 0.0])).collect::<Vec<_>>() }))
        .collect();
    let job = variant(&[
        ("/operations/0/path", json!({ "file": { "file": "path.json", "max_distance_mm": 5, "uncut_side": "left" } })),
        unfinished(),
    ]);
    let file = json!({ "format": "facemill-path/1", "frame": "work", "passes": passes });
    job.write("path.json", file.to_string().as_bytes());
    let w = planned(&job);
    w.check();
    assert_eq!(w.total("cc_points"), 111.0);
    let mesh = facemill::read_mesh(&job.path("patch.obj"), None, None).unwrap().mesh;
    let cuts = w.with_feed(CUTTING);
    // The first point of a pass ends its entry.
    let mut all = w.with_feed(APPROACH);
    all.extend(cuts.iter().copied());
    let mut farthest = 0.0;
    for y in rows {
        for k in 0..37 {
            let touched = nearest_of(&mesh, &Point3::new(-36.0 + 2.0 * f64::from(k), y, 0.0));
            let gap = |place: &TipAndAxis| {
                let (rho, z) = in_tool(&place.0, &place.1, &touched);
                w.back.cutter.signed_distance(rho, z).abs()
            };
            farthest = f64::max(farthest, all.iter().map(|c| gap(&c.1)).fold(f64::INFINITY, f64::min));
        }
    }
    let lift = number(&w.report["worst"]["lift_mm"]);
    assert!(farthest < lift + 0.02, "{farthest} mm, lift {lift}");
    // The tip stays over the rows: no farther than the cutter's radius.
    assert!(cuts.iter().all(|c| c.1.0.y > -6.0 - 4.1 && c.1.0.y < 4.1));
}

#[test]
fn the_tool_axis_stays_in_its_cone() {
    let half_angle = 17.0_f64;
    let ranges = [("/operations/0/search/tilt_deg", json!([5.0, 20.0]))];
    let outside = |w: &Written, from: f64| {
        let lean = |m: &Motion| w.back.end(m).1.z.clamp(-1.0, 1.0).acos().to_degrees();
        w.motions.iter().filter(|m| lean(m) > from).count()
    };
    let job = variant(&ranges);
    job.set("job.json", &[("/operations/0/search/tilt_deg", json!([14.0, 20.0]))]);
    assert!(outside(&planned(&job), half_angle) > 20, "a cone that forbids nothing");
    let job = variant(&ranges);
    let cone = json!({ "axis": [0, 0, 1], "half_angle_deg": half_angle });
    job.set("job.json", &[("/operations/0/search/tool_axis_cone", cone)]);
    let w = planned(&job);
    w.check();
    // Words have four decimals.
    assert_eq!(outside(&w, half_angle + 1e-3), 0);
    // A cone beside the vertical asks for other directions than the search would take.
    let beside = Vector3::new(-0.25, 0.1, 1.0).normalize();
    let cone = json!({ "axis": beside.as_slice(), "half_angle_deg": 7.0 });
    job.set(
        "job.json",
        &[
            ("/operations/0/search/tool_axis_cone", cone),
            ("/operations/0/infeasible/trim/max_trimmed_fraction", json!(0.6)),
        ],
    );
    let w = planned(&job);
    w.check();
    let lean = |m: &&Motion| w.back.end(m).1.dot(&beside).clamp(-1.0, 1.0).acos().to_degrees();
    assert!(w.motions.iter().filter(|m| !m.rapid).all(|m| lean(&m) < 7.0 + 1e-3));
    let reasons = w.report["infeasible"].to_string();
    assert!(w.total("trimmed_points") == 0.0 || reasons.contains("cone"), "{reasons}");
}

#[test]
fn the_cutter_leaves_exactly_the_allowance_of_the_drive_surface() {
    let allowance = 0.3;
    let w = planned(&variant(&[
        ("/setups/0/meshes/0/allowance_mm", json!(allowance)),
        ("/setups/0/stock/offset/allowance_mm", json!(0.8)),
    ]));
    // No deeper than the budget below the allowance.
    w.check();
    let lift = number(&w.report["worst"]["lift_mm"]);
    let linearisation = 0.02;
    let mut most = f64::NEG_INFINITY;
    for (m, place) in w.with_feed(CUTTING) {
        let left = w.back.grounds[0].bins.gap(&w.back.cutter, &place.0, &place.1, 2.0);
        most = f64::max(most, left);
        assert!(left > 0.2, "line {}: leaves {left}", m.line);
    }
    // At no block does it leave more than the lift and what a block may be off.
    assert!(most <= allowance + lift + linearisation, "leaves up to {most}, lift {lift}");
    assert!(most > 0.9 * allowance, "{most}");
}

/// Three patches about the z axis as one OBJ, each a group.
fn three_patches(job: &JobFolder) -> String {
    let mesh = facemill::read_mesh(&job.path("patch.obj"), None, None).unwrap().mesh;
    let mut text = String::new();
    for k in 0..3u32 {
        let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), f64::from(k) * std::f64::consts::TAU / 3.0);
        text += &format!("o patch{k}\n");
        for v in mesh.vertices() {
            let p = turn * (v + Vector3::new(90.0, 10.0, 0.0));
            text += &format!("v {} {} {}\n", p.x, p.y, p.z);
        }
        let first = k * mesh.vertices().len() as u32 + 1;
        for [a, b, c] in mesh.triangles() {
            text += &format!("f {} {} {}\n", a + first, b + first, c + first);
        }
    }
    text
}

#[test]
fn copies_of_a_pattern_are_the_first_place_turned() {
    let job = tiny_patch();
    job.write("three.obj", three_patches(&job).as_bytes());
    let meshes = json!([
        { "file": "three.obj", "role": "drive", "groups": ["patch0"] },
        { "file": "three.obj", "role": "part" },
    ]);
    job.set(
        "job.json",
        &[
            ("/setups/0/meshes", meshes),
            ("/operations/0/pattern", json!({ "copies": 3, "index_angle_deg": 120 })),
            ("/operations/0/path/strategy/strategy/parallel_planes/from_mm", json!(9.0)),
            ("/operations/0/path/strategy/strategy/parallel_planes/to_mm", json!(11.0)),
        ],
    );
    let w = planned(&job);
    w.check();
    let mut places: Vec<Vec<TipAndAxis>> = vec![Vec::new(); 3];
    for (m, place) in w.with_feed(CUTTING) {
        let comments = w.nc.lines().take(m.line).filter_map(|l| l.strip_suffix(')')?.split_once("PLACE "));
        let at: usize = comments.last().unwrap().1.parse().unwrap();
        places[at - 1].push(place);
    }
    assert!(places[0].len() > 50 && w.total("planned_points") == w.total("cc_points"));
    for k in 1..3 {
        let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), -(k as f64) * std::f64::consts::TAU / 3.0);
        let back: Vec<TipAndAxis> =
            places[k].iter().map(|p| (turn * p.0, Unit::new_unchecked(turn * p.1.into_inner()))).collect();
        // Words are rounded, and rounding may end the bisection of a lift one step apart.
        for (a, b) in [(&back, &places[0]), (&places[0], &back)] {
            assert!(strays(a, b, w.back.cutter.radius) < 6e-3, "place {}: {}", k + 1, strays(a, b, 4.0));
        }
    }
}

#[test]
fn entries_go_down_into_stock_no_steeper_than_the_tool_may() {
    // Passes begin inside the part.
    let job = variant(&[("/operations/0/path/strategy/edge_margin_mm", json!(12.0)), unfinished()]);
    let w = planned(&job);
    w.check();
    let steepest = number(&job.json("tool.json")["max_ramp_angle_deg"]);
    let part = &w.back.grounds[0];
    let mut in_stock = 0;
    for (places, _) in approaches(&w).iter().filter(|a| a.1) {
        for pair in places.windows(2) {
            let (from, to) = (&pair[0], &pair[1]);
            if part.bins.gap(&w.back.cutter, &to.0, &to.1, part.thickness) >= part.thickness {
                continue;
            }
            in_stock += 1;
            let way = to.0 - from.0;
            let down = -way.dot(&to.1);
            let angle = down.atan2((way + to.1.into_inner() * down).norm()).to_degrees();
            // Blocks of a third of a millimetre with words of a micrometre.
            assert!(angle < steepest + 0.4, "{angle} deg into the stock at {}", to.0);
        }
    }
    assert!(in_stock > 10, "no entry goes through stock");
}
