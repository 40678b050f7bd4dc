//! Turns with both tools down, and rounds of widths, of a pair.

use super::*;

/// Passes of both heads back and forth on both sides of a plate: where one ends beside the start of
/// the next, both heads turn with their tools down; the text is as sound as with links, and faster.
#[test]
fn passes_of_both_heads_are_joined_by_turns() {
    let job = job(440.0);
    std::fs::write(job.path("plate.obj"), plate()).unwrap();
    let mesh = |groups: &[&str], role: &str| json!({ "file": "plate.obj", "groups": groups, "role": role, "unit": "millimetre", "up_axis": "z" });
    job.set("job.json", &[("/setups/0/meshes", json!([mesh(&["top", "bottom"], "drive"), mesh(&["*"], "part")]))]);
    for (k, group) in ["top", "bottom"].into_iter().enumerate() {
        let feed = job.json("job.json")["operations"][k]["feeds"]["cutting_mm_min"].clone();
        let planes = json!({ "parallel_planes": { "normal": [1.0, 0.0, 0.0], "from_mm": 365.0, "to_mm": 395.0 } });
        let operation = format!("/operations/{k}");
        let strategy = format!("{operation}/path/strategy");
        job.set(
            "job.json",
            &[
                (&format!("{strategy}/strategy"), planes),
                (&format!("{strategy}/region/groups"), json!([group])),
                (&format!("{strategy}/min_pass_length_mm"), json!(5.0)),
                (&format!("{strategy}/linking"), json!("zigzag")),
                (&format!("{operation}/direction"), json!("either")),
                (&format!("{operation}/feeds/turn_mm_min"), feed),
                (&format!("{operation}/feeds/approach_mm_min"), json!(200.0)),
            ],
        );
    }
    let by_turns = plan(&job, true);
    job.set("job.json", &[("/setups/0/links", json!({ "turns": false }))]);
    let by_links = plan(&job, false);
    let report = by_turns.report.links.turns.as_ref().unwrap();
    assert!(by_turns.is_clean(), "{:?}", by_turns.report.findings);
    assert!(report.turns_on_surface >= 4 && report.links == 0 && by_links.report.links.turns.is_none(), "{report:?}");
    let read = ReadPlan::of(&job, &by_turns);
    both_tools_stand_where_they_were_planned(&read);
    tools_are_apart_and_no_deeper_than_allowed(&read);
    let rapids = |planned: &Planned| dual_blocks(&text_of(planned, "program.nc")).iter().filter(|b| b.rapid).count();
    assert!(rapids(&by_turns) < rapids(&by_links));
    let time = |planned: &Planned| planned.report.time_law.as_ref().unwrap().total_time_s;
    assert!(time(&by_turns) < time(&by_links), "{} s, {} s by links", time(&by_turns), time(&by_links));
}

/// A pair that leaves more than the cusp is laid again with narrower strips; the round that is cut
/// leaves too much on less of the region than the first one.
#[test]
fn rounds_of_widths_lower_what_a_pair_leaves() {
    let job = job(440.0);
    let of_operations: Vec<(String, Value)> = (0..2)
        .flat_map(|k| {
            [
                (format!("/operations/{k}/path/strategy/width_rounds"), json!(2)),
                (format!("/operations/{k}/path/strategy/edge_fill"), json!(true)),
                (format!("/operations/{k}/tolerances/cusp_mm"), json!(0.01)),
                (format!("/operations/{k}/tolerances/max_step_over_mm"), json!(20.0)),
            ]
        })
        .collect();
    let values: Vec<(&str, Value)> = of_operations.iter().map(|(p, v)| (p.as_str(), v.clone())).collect();
    job.set("job.json", &values);
    let planned = plan(&job, false);
    for cusp in &planned.report.cusps {
        let rounds = &cusp.width_rounds;
        let cut = rounds.iter().find(|round| round.is_cut).unwrap();
        assert!(rounds.len() >= 2 && cut.above_fraction <= rounds[0].above_fraction, "{rounds:?}");
    }
    let lowered = |cusp: &facemill::report::CuspsKeptReport| {
        let rounds = &cusp.width_rounds;
        let cut = rounds.iter().find(|round| round.is_cut);
        cut.is_some_and(|cut| cut.above_fraction < rounds[0].above_fraction && cut.length_mm > rounds[0].length_mm)
    };
    assert!(planned.report.cusps.iter().any(lowered), "{:?}", planned.report.cusps);
}

/// Plate of 60 by 60 by 12 mm beside C, its faces at 45° to it: `top` for head 1, `bottom` for
/// head 2.
fn plate() -> String {
    let half = 0.5f64.sqrt();
    let corner = |k: usize| {
        let [across, along, over] = [k & 1, k >> 1 & 1, k >> 2].map(|high| 2.0 * high as f64 - 1.0);
        let (v, n) = (30.0 * along, 6.0 * over);
        format!("v {} {:.9} {:.9}", 380.0 + 30.0 * across, (v - n) * half, (v + n) * half)
    };
    let faces = [
        "top\nf 5 6 8\nf 5 8 7",
        "bottom\nf 1 3 4\nf 1 4 2",
        "a\nf 1 2 6\nf 1 6 5",
        "b\nf 3 7 8\nf 3 8 4",
        "c\nf 1 5 7\nf 1 7 3",
        "d\nf 2 4 8\nf 2 8 6",
    ];
    let corners: Vec<String> = (0..8).map(corner).collect();
    format!("{}\ng {}\n", corners.join("\n"), faces.join("\ng "))
}
