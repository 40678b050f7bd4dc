//! Lengths that suit several programs of one tool: each of them needs another length.

use facemill::lengths::{AlsoProgram, LengthName, LengthsRequest, lengths_of_program};
use facemill::nc_program::Dialect;
use facemill::surface_model::{NamedNode, TriMesh, write_obj};
use facemill::tool_model::OpenAssembly;
use facemill::{Job, SilentStages};
use facemill_tests::commands::facemill_in;
use facemill_tests::jobs::JobFolder;
use facemill_tests::variants::blink_patch;
use nalgebra::Isometry3;
use serde_json::{Value, json};

use super::{MARGIN, OFF, PAST, SLACK, TOP, WALL, collisions, holder, library, obeys_its_schema, with_wall};

/// Puts a second setup with an operation of its own behind the first of a job.
fn add_setup(job: &JobFolder, change: impl Fn(&mut Value)) {
    let mut file = job.json("job.json");
    let (mut setup, mut operation) = (file["setups"][0].clone(), file["operations"][0].clone());
    file["operations"][0]["setup"] = setup["name"].clone();
    setup["name"] = json!("again");
    (operation["name"], operation["setup"]) = (json!("again"), json!("again"));
    file["setups"].as_array_mut().unwrap().push(setup);
    file["operations"].as_array_mut().unwrap().push(operation);
    change(&mut file);
    job.write("job.json", file.to_string().as_bytes());
}

/// Nearer to the wall, but higher: the arbor has to pass over it, the flange is higher anyway.
fn near() -> String {
    PAST.replace("X5.", "X15.").replace("Z306.", "Z312.")
}

fn wall_in_two_setups() -> JobFolder {
    let job = with_wall();
    add_setup(&job, |_| {});
    job
}

const NAMES: [LengthName; 4] = [LengthName::L1, LengthName::L2, LengthName::L3, LengthName::L4];

#[test]
fn lengths_suit_all_programs_and_each_is_forced_by_one() {
    let job = wall_in_two_setups();
    let (near, path) = (near(), job.path("program.nc"));
    let read = Job::read(&job.job()).unwrap();
    let of = |texts: [&str; 2], n: usize| {
        let request = LengthsRequest {
            program: &path,
            dialect: Dialect::Fanuc,
            setup: 0,
            margin: MARGIN,
            longest: 400.0,
            cut: None,
            certificates: true,
            holders: None,
            also: [AlsoProgram { program: &path, text: texts[1].as_bytes(), setup: 1 }][..n].to_vec(),
        };
        lengths_of_program(&read, texts[0].as_bytes(), &request, &SilentStages).unwrap_or_else(|e| panic!("{e}"))
    };
    // Needs that differ by less than the margin: the larger has it, whichever program comes first.
    let lower = PAST.replace("Z306.", "Z305.8");
    for texts in [[PAST, lower.as_str()], [lower.as_str(), PAST]] {
        let l3 = of(texts, 1).file.lengths[2].length_mm;
        assert!((l3 - (TOP + 0.2 + 2.0 - SLACK + MARGIN)).abs() < 0.01, "{l3}");
    }
    let alone = [PAST, near.as_str()].map(|text| of([text, text], 0));
    for texts in [[PAST, near.as_str()], [near.as_str(), PAST]] {
        let both = of(texts, 1);
        println!("{}", both.file.table());
        obeys_its_schema(&both);
        let length = |name: LengthName| both.file.lengths.iter().find(|l| l.name == name).unwrap();
        // Each is the larger of what the programs need by themselves; L4 rests on L3.
        for (k, name) in NAMES.into_iter().enumerate() {
            let largest = alone.iter().map(|found| found.file.lengths[k].length_mm).fold(0.0, f64::max);
            assert!((length(name).length_mm - largest).abs() < 0.02, "{name:?}: {:?} {largest}", length(name));
        }
        let of_near = |is_near: bool| Some("again".to_owned()).filter(|_| (texts[1] == near) == is_near);
        assert_eq!((&length(LengthName::L2).setup, &length(LengthName::L3).setup), (&of_near(true), &of_near(false)));
        let other = &both.file.others[0];
        assert!(other.setup == "again" && both.file.is_clean());
        for certificates in [&both.file.certificates, &other.certificates] {
            let certificates = certificates.as_ref().unwrap();
            assert_eq!(certificates.certified, certificates.blocks);
        }
        // The ordinary run says the same: free with the lengths, not with a shorter one.
        let tool = both.tool.clone().unwrap();
        assert_eq!((collisions(&job, &tool, PAST), collisions(&job, &tool, &near)), (Vec::new(), Vec::new()));
        let open = OpenAssembly::open(&read.tool);
        for (k, forcing, free) in [(1, near.as_str(), PAST), (2, PAST, near.as_str())] {
            let mut shorter = NAMES.map(|name| length(name).length_mm);
            shorter[k] -= MARGIN + OFF;
            let tool = open.built(&shorter).unwrap().tool.to_file();
            assert!(!collisions(&job, &tool, forcing).is_empty() && collisions(&job, &tool, free).is_empty(), "{k}");
        }
    }
}

/// Height of the wall's top, mm, after the first setup has cut it down.
const CUT_TO: f64 = 20.0;

/// Cuts the wall down along its middle, half a millimetre at a time.
fn cut_down() -> String {
    let mut text = "%\nO2\nG21 G90 G94 G49\nT1 M6\nS6000 M3\nG0 G43 X22. Y-40. Z440. B0. C0. H1\n".to_owned();
    let mut at = -40.0;
    for k in 1..=((WALL.1 - CUT_TO) / 0.5) as u32 {
        let z = 300.0 + WALL.1 - 0.5 * f64::from(k);
        let to = -at;
        text += &format!("G1 Z{z:.1} F500.\nY{to:.1} F1000.\n");
        at = to;
    }
    text + "G0 Z440.\nM30\n%\n"
}

#[test]
fn a_program_begins_with_what_the_programs_before_leave() {
    let job = wall_in_two_setups();
    // The wall is stock of both setups, on a plate with the part in it, and no fixture.
    let boxes = [[[-41.0, -41.0, -20.0], [41.0, 41.0, 5.5]], [[WALL.0, -30.0, 5.0], [WALL.0 + 4.0, 30.0, WALL.1]]];
    let meshes = boxes.map(|[min, max]| {
        let (vertices, triangles) = facemill_test_kit::box_mesh(min, max);
        TriMesh::new(vertices, triangles).unwrap()
    });
    let node = |mesh: usize| NamedNode { name: ["plate", "wall"][mesh], mesh, transform: Isometry3::identity() };
    job.write("stock.obj", &write_obj(&meshes.each_ref(), &[0, 1].map(node)).unwrap());
    let mut file = job.json("job.json");
    for setup in file["setups"].as_array_mut().unwrap() {
        setup["meshes"].as_array_mut().unwrap().truncate(1);
        setup["stock"] = json!({ "mesh": { "file": "stock.obj", "unit": "millimetre", "up_axis": "z" } });
    }
    job.write("job.json", file.to_string().as_bytes());
    // A flute that a bound of what is left knows to cut layers of half a millimetre.
    let mut tool = job.json("tool.json");
    for key in ["flute_length_mm", "stick_out_mm", "gauge_length_mm"] {
        tool[key] = json!(tool[key].as_f64().unwrap() + 1.4);
    }
    job.write("tool.json", tool.to_string().as_bytes());
    job.write("down.tap", cut_down().as_bytes());
    job.write("past.tap", PAST.as_bytes());
    let l3 = |options: &str| {
        let past = job.path("past.tap").display().to_string();
        let output = facemill_in(&job, &format!("lengths {past} --job job.json --setup again -o l.json {options}"));
        assert!(output.code <= 1, "{}{}", output.errors, output.printed);
        let found = job.json("l.json");
        let length = found["lengths"].as_array().unwrap().iter().find(|l| l["name"] == "L3").unwrap();
        length["length_mm"].as_f64().unwrap()
    };
    let before = format!("--after top={}", job.path("down.tap").display());
    for stock in ["", " --stock-cell-mm 0.5"] {
        let (whole, cut) = (l3(stock), l3(&format!("{before}{stock}")));
        println!("{stock}: {whole} {cut}");
        // The flange passes over the wall, which is lower then, but for the cells of the stock.
        assert!((whole - cut - (WALL.1 - CUT_TO)).abs() < 0.6, "{stock}: {whole} {cut}");
    }
}

#[test]
fn a_holder_suits_all_programs_and_wrong_programs_are_named() {
    let job = wall_in_two_setups();
    job.write("past.tap", PAST.as_bytes());
    let higher = PAST.replace("Z306.", "Z309.");
    job.write("higher.nc", higher.as_bytes());
    let shank = job.json("tool.json")["body"]["sections"][0]["diameter_high_mm"].as_f64().unwrap();
    let holders = [holder("stout", shank, [5.0, 60.0], 40.0), holder("short", shank, [5.0, TOP + 0.5], 40.0)];
    assert_eq!(library(&holders).holders().len(), 2);
    let shelf = json!({ "format": "facemill-holders/1", "holders": holders });
    job.write("shelf.json", shelf.to_string().as_bytes());
    let past = format!("again={}", job.path("past.tap").display());
    let command = format!("lengths higher.nc --job job.json --setup 1 --holders shelf.json -o l.json --also {past}");
    let output = facemill_in(&job, &command);
    assert_eq!(output.code, 0, "{}{}", output.errors, output.printed);
    let file = job.json("l.json");
    assert_eq!((&file["holder"], &file["others"][0]["setup"]), (&json!("stout"), &json!("again")));
    // The program that goes lower forces it: by itself the first needs 3 mm less.
    let stick_out = file["holders"][0]["stick_out_mm"].as_f64().unwrap();
    assert!((stick_out - (TOP + 2.0 - SLACK + MARGIN)).abs() < 0.01, "{stick_out}");
    assert_eq!((&file["holders"][0]["setup"], &file["holders"][1]["setup"]), (&json!("again"), &json!("again")));
    assert!(output.prints(&["* stout", "again, line"]), "{}", output.printed);

    let wrong = |also: &str, says: &str| {
        let output = facemill_in(&job, &format!("lengths higher.nc --job job.json --setup 1 --also {also}"));
        assert!(output.code == 2 && output.errors.contains(says), "{also}: {} {}", output.code, output.errors);
    };
    wrong("past.tap", "SETUP=FILE");
    wrong(&past.replace("again=", "nowhere="), "has no setup \"nowhere\"");
    wrong(&past.replace("again=", "1="), "has two programs");
    let output = facemill_in(&job, "lengths higher.nc --job job.json --setup 1 --tool mill");
    assert!(output.code == 2 && output.errors.contains("--tool"), "{}", output.errors);
}

#[test]
fn a_folder_of_a_plan_has_the_programs_of_each_tool() {
    let job = blink_patch();
    add_setup(&job, |file| {
        let own = file["tool"].take();
        file.as_object_mut().unwrap().remove("tool");
        file["tools"] = json!({ "mill": own, "long mill": "long.json" });
        for (k, tool) in ["mill", "long mill"].into_iter().enumerate() {
            file["operations"][k]["tool"] = json!(tool);
        }
    });
    let mut long = job.json("tool.json");
    let longer = |value: &Value| json!(value.as_f64().unwrap() + 20.0);
    for key in ["stick_out_mm", "gauge_length_mm"] {
        long[key] = longer(&long[key]);
    }
    let top = &mut long["body"]["sections"].as_array_mut().unwrap().last_mut().unwrap()["length_mm"];
    *top = longer(top);
    (long["name"], long["number"]) = (json!("long mill"), json!(2));
    job.write("long.json", long.to_string().as_bytes());
    let out = job.path("out");
    let planned = facemill_in(&job, &format!("plan job.json --no-html --out {}", out.display()));
    assert!(planned.code <= 1, "{}", planned.errors);

    let with = |options: &str| facemill_in(&job, &format!("lengths {} --job job.json {options}", out.display()));
    let several = with("");
    assert!(several.code == 2 && several.errors.contains("\"long mill\", \"mill\""), "{}", several.errors);
    assert!(with("--tool drill").errors.contains("no program of a tool \"drill\""));
    assert_eq!(with("--tool mill --setup 1").code, 2);
    let found = facemill_in(
        &job,
        &format!("lengths {} --job job.json --tool mill -o l.json --tool-out short.json", out.display()),
    );
    assert_eq!(found.code, 0, "{}", found.errors);
    let (file, short) = (job.json("l.json"), job.json("short.json"));
    assert_eq!((&file["tool"], &file["others"]), (&job.json("tool.json")["name"], &json!([])));
    assert!(short["gauge_length_mm"].as_f64().unwrap() <= job.json("tool.json")["gauge_length_mm"].as_f64().unwrap());
    // A changed program is not the plan's.
    let name =
        std::fs::read_dir(&out).unwrap().map(|e| e.unwrap().path()).find(|p| p.extension().is_some_and(|e| e == "nc"));
    let program = name.unwrap();
    let text = std::fs::read_to_string(&program).unwrap();
    std::fs::write(&program, text.replacen("G1", "G01", 1)).unwrap();
    let changed = with("--tool mill");
    assert!(changed.code == 2 && changed.errors.contains("the program was changed"), "{}", changed.errors);
}
