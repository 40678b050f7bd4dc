//! Lengths of the tool assembly for a program: what the command returns passes as the ordinary run
//! says, and nothing shorter does; the holder that is chosen; and a plan that lets a shorter one
//! pass.

use facemill::lengths::{FoundLengths, LengthName, LengthsFile, LengthsRequest, Posting, lengths_of_program};
use facemill::nc_program::Dialect;
use facemill::surface_model::{NamedNode, TriMesh, write_obj};
use facemill::tool_model::{HolderLibrary, OpenAssembly, ToolAssembly, ToolFile};
use facemill::virtual_machine::{Finding, FindingKind};
use facemill::{Failure, Job, SilentStages, VerifyRequest, replan_with_shorter_tools, verify_program};
use facemill_tests::jobs::{JobFolder, text_of};
use facemill_tests::variants::{tiny_patch, variant};
use nalgebra::Isometry3;
use serde_json::{Value, json};

#[path = "lengths_command.rs"]
mod lengths_command;
#[path = "lengths_of_programs.rs"]
mod lengths_of_programs;

const MARGIN: f64 = 0.5;

/// Largest error of a length, mm.
const OFF: f64 = 0.05;

/// Part of a clearance that a program may use up, mm.
const SLACK: f64 = 0.1;

/// Distance of the wall's face and height of its top in the workpiece frame, mm.
const WALL: (f64, f64) = (20.0, 25.0);

/// The example's patch with a wall beside its middle.
fn with_wall() -> JobFolder {
    let job = tiny_patch();
    job.set("job.json", &[facemill_tests::jobs::unfinished()]);
    let (vertices, triangles) = facemill_test_kit::box_mesh([WALL.0, -30.0, 5.0], [WALL.0 + 4.0, 30.0, WALL.1]);
    let wall = TriMesh::new(vertices, triangles).unwrap();
    let nodes = [NamedNode { name: "wall", mesh: 0, transform: Isometry3::identity() }];
    job.write("wall.obj", &write_obj(&[&wall], &nodes).unwrap());
    let mut meshes = job.json("job.json")["setups"][0]["meshes"].as_array().unwrap().clone();
    meshes.push(json!({ "file": "wall.obj", "role": "fixture", "unit": "millimetre", "up_axis": "z" }));
    let above = json!([0.0, 0.0, 40.0]);
    job.set("job.json", &[("/setups/0/meshes", Value::Array(meshes)), ("/setups/0/clearance/plane/origin_mm", above)]);
    job
}

/// Upright past the wall, 15 mm from it and 6 mm above the workpiece's zero.
const PAST: &str = "%\nO1\nG21 G90 G94 G49\nT1 M6\nS6000 M3\nG0 G43 X5. Y-10. Z440. B0. C0. H1\nG0 Z306.\nG1 Y10. F1000.\n\
                    G0 Z440.\nM30\n%\n";

/// The top of the wall above the tip there.
const TOP: f64 = WALL.1 - 6.0;

fn lengths(
    job: &JobFolder,
    text: &str,
    holders: Option<&HolderLibrary>,
    replan: bool,
) -> Result<FoundLengths, Failure> {
    let program = job.path("program.nc");
    let (margin, longest) = (MARGIN, 400.0);
    let dialect = Dialect::Fanuc;
    let request = LengthsRequest {
        program: &program,
        dialect,
        setup: 0,
        margin,
        longest,
        cut: None,
        certificates: !replan,
        holders,
        also: Vec::new(),
    };
    let job = Job::read(&job.job()).unwrap();
    let mut found = lengths_of_program(&job, text.as_bytes(), &request, &SilentStages)?;
    if let (true, Some(library)) = (replan, holders) {
        replan_with_shorter_tools(&job, 0, library, &mut found, &SilentStages)?;
    }
    Ok(found)
}

/// Returns the collisions of the ordinary run with this tool in the job.
fn collisions(job: &JobFolder, tool: &ToolFile, text: &str) -> Vec<Finding> {
    let path = job.path("program.nc");
    let read = Job::read(&job.job()).unwrap();
    let read = Job { tool: ToolAssembly::new(tool.clone()).unwrap(), ..read };
    let dialect = Dialect::Fanuc;
    let request = VerifyRequest::new(&path, dialect);
    let verified = verify_program(&read, text.as_bytes(), &request, &SilentStages).unwrap();
    let is_of_bodies = |f: &Finding| matches!(f.kind, FindingKind::HolderCollision | FindingKind::Collision);
    verified.file.verification.findings.into_iter().filter(is_of_bodies).collect()
}

fn obeys_its_schema(found: &FoundLengths) {
    let schema = serde_json::from_str(&facemill::file_format::schema::<LengthsFile>()).unwrap();
    let file = serde_json::from_str(&facemill::file_format::to_json(&found.file)).unwrap();
    let faults: Vec<_> =
        jsonschema::validator_for(&schema).unwrap().iter_errors(&file).map(|e| e.to_string()).collect();
    assert!(faults.is_empty(), "{faults:?}");
}

#[test]
fn a_flange_passes_over_the_wall_by_the_margin() {
    let job = with_wall();
    let found = lengths(&job, PAST, None, false).unwrap_or_else(|e| panic!("{e}"));
    println!("{}", found.file.table());
    obeys_its_schema(&found);
    let tool = found.tool.unwrap();
    let of = |name: LengthName| found.file.lengths.iter().find(|l| l.name == name).unwrap();
    // The arbor passes beside the wall, the flange over it; the flute has a corner.
    let l3 = of(LengthName::L3);
    assert!((l3.length_mm - (TOP + 2.0 - SLACK + MARGIN)).abs() < 0.01, "{l3:?}");
    let forced = l3.forced_by.as_ref().unwrap();
    assert!(forced.obstacle.contains("wall") && forced.body.starts_with("holder section"), "{forced:?}");
    assert!((7..=8).contains(&forced.line) && forced.place_work_mm[2] == WALL.1, "{forced:?}");
    assert_eq!(of(LengthName::L1).rests_on, Some("the corner of the cutter"));
    assert_eq!(found.file.posting, Posting::AsItIs);
    assert_eq!((tool.stick_out_mm, tool.gauge_length_mm), (of(LengthName::L2).length_mm, of(LengthName::L4).length_mm));
    // Between its positions it is proven, and posted again it is the same text.
    let certificates = found.file.certificates.as_ref().unwrap();
    assert_eq!(certificates.certified, certificates.blocks, "{:?}", certificates.uncertified().next());
    assert_eq!(collisions(&job, &tool, PAST), []);
    let open = OpenAssembly::open(&Job::read(&job.job()).unwrap().tool);
    let mut shorter = [LengthName::L1, LengthName::L2, LengthName::L3, LengthName::L4].map(|name| of(name).length_mm);
    shorter[2] -= MARGIN + OFF;
    let met = collisions(&job, &open.built(&shorter).unwrap().tool.to_file(), PAST);
    assert!(met.iter().any(|f| (f.first_line..=f.last_line).contains(&forced.line)), "{met:?}");
    // A collision that no length clears is reported.
    let into = PAST.replace("X5.", "X22.");
    let none = lengths(&job, &into, None, false).unwrap();
    assert!(none.tool.is_some() || none.file.none_is_free.is_some());
    let faults = lengths(&job, &PAST.replace("G1 Y10.", "G1 Y10.5.2"), None, false).unwrap_err().to_string();
    assert!(faults.contains("line 8"), "{faults}");
}

fn holder(name: &str, bore: f64, stick_out: [f64; 2], nose: f64) -> Value {
    let section = |length: f64, d: f64| json!({ "length_mm": length, "diameter_low_mm": d, "diameter_high_mm": d });
    json!({ "name": name, "bore_mm": bore, "stick_out_mm": stick_out, "projection_mm": 100.0, "clearance_mm": 2.0,
        "sections": [section(60.0, nose), section(40.0, 126.0)] })
}

fn library(holders: &[Value]) -> HolderLibrary {
    let file = json!({ "format": "facemill-holders/1", "holders": holders });
    HolderLibrary::from_json(file.to_string().as_bytes()).unwrap()
}

#[test]
fn the_holder_with_the_shortest_stick_out_that_works_is_chosen() {
    let job = with_wall();
    let shank = job.json("tool.json")["body"]["sections"][0]["diameter_high_mm"].as_f64().unwrap();
    let holders = [
        holder("slim and long", shank, [24.0, 60.0], 12.0),
        holder("narrower", shank, [5.0, 60.0], 36.0),
        holder("stout", shank, [5.0, 60.0], 40.0),
        holder("too short", shank, [5.0, 15.0], 40.0),
        holder("other bore", shank + 2.0, [1.0, 60.0], 12.0),
    ];
    let found = lengths(&job, PAST, Some(&library(&holders)), false).unwrap_or_else(|e| panic!("{e}"));
    println!("{}", found.file.table());
    obeys_its_schema(&found);
    assert_eq!(found.file.holder.as_deref(), Some("stout"));
    let needed = TOP + 2.0 - SLACK + MARGIN;
    let outcome: Vec<Option<f64>> = found.file.holders.iter().map(|h| h.stick_out_mm).collect();
    for (outcome, expected) in outcome.iter().zip([Some(24.0), Some(needed), Some(needed), None, None]) {
        assert_eq!(outcome.is_some(), expected.is_some(), "{outcome:?}");
        assert!(outcome.zip(expected).is_none_or(|(a, b)| (a - b).abs() < 0.01), "{outcome:?} {expected:?}");
    }
    assert!(found.file.holders[3].why_not.as_ref().unwrap().contains("15 mm"));
    assert!(found.file.holders[4].why_not.as_ref().unwrap().contains("shanks"));
    let tool = found.tool.unwrap();
    assert!((tool.stick_out_mm - needed).abs() < 0.01 && tool.gauge_length_mm == tool.stick_out_mm + 100.0);
    assert_eq!(collisions(&job, &tool, PAST), []);
    let shorter = ToolAssembly::new(tool).unwrap().longer_by(-MARGIN - OFF).unwrap().to_file();
    assert!(!collisions(&job, &shorter, PAST).is_empty());

    // By the least stick-out of the ordinary run, found by halves, the report is right for each
    // holder by itself.
    for holder in library(&holders[..2]).holders() {
        let open = holder.with_tool(&Job::read(&job.job()).unwrap().tool).unwrap();
        let is_free = |stick_out: f64| {
            let mut lengths = [0.0, stick_out, 0.0, 0.0];
            open.rest(&mut lengths);
            collisions(&job, &open.built(&lengths).unwrap().tool.to_file(), PAST).is_empty()
        };
        let [mut low, mut high] = holder.stick_out_mm;
        if !is_free(low) {
            while high - low > 0.01 {
                let middle = 0.5 * (low + high);
                *(if is_free(middle) { &mut high } else { &mut low }) = middle;
            }
            low = high + MARGIN;
        }
        let outcome = found.file.holders.iter().find(|h| h.name == holder.name).unwrap();
        assert!((outcome.stick_out_mm.unwrap() - low).abs() < 0.02, "{outcome:?} {low}");
    }
}

/// A program that leans a lot needs a long tool; planned again it leans less, and a shorter one
/// passes.
#[test]
fn planned_again_a_shorter_tool_passes() {
    let planes = "/operations/0/path/strategy/strategy/parallel_planes";
    let few = [(&*format!("{planes}/from_mm"), json!(-1.0)), (&*format!("{planes}/to_mm"), json!(1.0))];
    let job = variant(&few);
    let shank = job.json("tool.json")["body"]["sections"][0]["diameter_high_mm"].as_f64().unwrap();
    job.set("job.json", &[("/operations/0/search/mode", json!({ "fixed": { "lead_deg": 20.0 } }))]);
    let planned = job.plan();
    let name = planned.files.iter().find(|(n, _)| n.ends_with(".nc")).unwrap().0.clone();
    let old = text_of(&planned, &name);
    let search =
        [("/operations/0/search/mode", json!("smooth")), ("/operations/0/search/tilt_deg", json!([4.0, 20.0]))];
    job.set("job.json", &search);
    let section = |length: f64, d: f64| json!({ "length_mm": length, "diameter_low_mm": d, "diameter_high_mm": d });
    let squat = json!({ "name": "squat", "bore_mm": shank, "stick_out_mm": [2.0, 60.0], "projection_mm": 160.0,
        "clearance_mm": 1.0, "sections": [section(6.0, 6.0), section(154.0, 60.0)] });
    let found = lengths(&job, &old, Some(&library(&[squat])), true).unwrap_or_else(|e| panic!("{e}"));
    println!("{}", found.file.table());
    let as_it_was = found.file.holders[0].stick_out_mm.unwrap();
    assert!(found.file.holders[0].forced_by.is_some());
    obeys_its_schema(&found);
    let taken = found.file.replans.last().unwrap();
    assert!(taken.taken && taken.lost_points == 0 && taken.faults == 0, "{:?}", found.file.replans);
    assert!(found.file.replans.iter().rev().skip(1).all(|t| !t.taken && t.stick_out_mm <= taken.stick_out_mm));
    let tool = found.tool.unwrap();
    assert!(tool.stick_out_mm == taken.stick_out_mm && tool.stick_out_mm < as_it_was - 1.0);
    let text = String::from_utf8(found.replanned.unwrap().1).unwrap();
    assert_eq!(collisions(&job, &tool, &text), []);
    // The head turns, and the words of the old program hold the old length.
    assert_eq!(lengths(&job, &old, None, false).unwrap().file.posting, Posting::Again);
}

/// Words of the tip have no frame there, so no length can be said to be free.
#[test]
fn a_program_under_rtcp_is_refused_where_x_y_and_z_are_not_at_right_angles() {
    let under_rtcp = PAST.replace("G43 X5.", "G43.4 X5.");
    let refused = |job: &JobFolder, text: &str| match lengths(job, text, None, false) {
        Ok(_) => false,
        Err(why) => why.to_string().contains("no X, Y and Z at right angles"),
    };
    let job = with_wall();
    assert!(!refused(&job, &under_rtcp));
    // X is led by Y's slide, a degree off its right angle.
    job.set("machine.json", &[("/tool_chains/0/rows/1/alpha_deg", json!(89.0))]);
    assert!(refused(&job, &under_rtcp));
    assert!(!refused(&job, PAST), "words that are positions of the axes need no frame");
    let said = lengths(&job, &under_rtcp, None, false).unwrap_err().to_string();
    assert!(said.contains("program.nc") && said.contains("positions of the axes"), "{said}");
}
