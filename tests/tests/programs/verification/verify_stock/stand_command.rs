//! `facemill verify` on part, stock, machine and tool named one by one: exit codes, what it tells,
//! and what it writes.

use facemill_tests::commands::{CommandOutput, facemill_in, files_of};
use facemill_tests::jobs::JobFolder;
use facemill_tests::variants::box_obj;
use serde_json::{Value, json};

use super::{GOUGED_AT, NEAR, TABLE, plate, program, words};

/// The plate with [`program`] beside it, with tool, spindle and points behind all numbers, so that
/// nothing else is to be found.
fn with_program(last: i32, gouge: f64) -> JobFolder {
    let job = plate();
    let text = program(last, gouge).replace("G94\n", "G94\nT1 M6\nS6000 M3\n").replace("B10 ", "B10. ");
    job.write("program.nc", text.as_bytes());
    job
}

/// The plate as a job has it.
fn stand() -> String {
    format!("--part plate.obj --stock offset:0.5 --machine machine.json --tool tool.json --mount 0,0,{TABLE}")
}

/// Runs `facemill verify program.nc` with these words behind it, and the file that it wrote.
fn verify(job: &JobFolder, words: &str) -> (CommandOutput, Value) {
    let output = facemill_in(job, &format!("verify program.nc --out found.json {words}"));
    assert!(output.code < 2, "{words}: {}", output.errors);
    (output, job.json("found.json"))
}

/// Returns the assumptions of a verification.
fn assumptions(file: &Value) -> Vec<&str> {
    file["assumptions"].as_array().unwrap().iter().map(|a| a["text"].as_str().unwrap()).collect()
}

/// Depth and line of the largest gouge.
fn gouge(file: &Value) -> (f64, u64) {
    let gouge = &file["largest_gouge"];
    (gouge["depth_mm"].as_f64().unwrap(), gouge["line"].as_u64().unwrap())
}

#[test]
fn a_clean_program_is_exit_0_and_unstated_data_is_reported() {
    let job = with_program(3, 0.0);
    let (output, mut file) = verify(&job, &stand());
    assert_eq!((output.code, &file["findings"]), (0, &json!([])), "{}", output.printed);
    let texts: Vec<String> = assumptions(&file).into_iter().map(str::to_owned).collect();
    assert!(texts.iter().all(|text| output.printed.contains(text)), "{texts:?}");
    for option in ["dialect", "work-offset", "work-register", "length-register", "mesh-unit", "mesh-up"] {
        let of_option = texts.iter().filter(|text| text.starts_with(&format!("no --{option}: ")));
        assert_eq!(of_option.count(), 1, "{option} {texts:?}");
    }
    assert!(!texts.iter().any(|text| text.starts_with("no --mount")), "{texts:?}");

    // Once stated, they are no longer reported, and nothing else changes.
    let said = "--dialect fanuc --work-offset 0,0,0 --work-register G54 --length-register 1 --mesh-unit millimetre \
                --mesh-up z";
    let (all, said) = verify(&job, &format!("{} {said}", stand()));
    let others: Vec<&String> = texts.iter().filter(|text| !text.starts_with("no --")).collect();
    assert_eq!((all.code, assumptions(&said)), (0, others.into_iter().map(|text| &**text).collect()));
    file["assumptions"] = said["assumptions"].clone();
    assert_eq!(file, said);

    // Unsaid, the workpiece is on the table, where the program reaches no stock.
    let on_table = stand().replace(&format!("--mount 0,0,{TABLE}"), "--stock-cell-mm 2");
    let (output, file) = verify(&job, &on_table);
    assert!(assumptions(&file).iter().any(|text| text.starts_with("no --mount: ")), "{}", output.printed);
    assert!(output.prints(&["no cutting block removes stock", "mounting"]), "{}", output.printed);
}

/// Moving workpiece and zero together changes nothing between tool and part, and a mesh means the
/// same in any unit.
#[test]
fn mount_work_offset_and_unit_say_where_the_part_is() {
    let job = with_program(1, 0.15);
    let whole = format!("{} --gouge-mm 0.05", stand());
    let (output, at_home) = verify(&job, &whole);
    let (depth, line) = gouge(&at_home);
    assert!(output.code == 1 && (depth - 0.15).abs() < NEAR, "{depth}");
    let is_same = |file: &Value| (gouge(file).0 - depth).abs() < 1e-6 && gouge(file).1 == line;

    let moved = whole.replace(&format!("--mount 0,0,{TABLE}"), &format!("--mount 4,-3,{}", TABLE - 2.0));
    let (output, together) = verify(&job, &format!("{moved} --work-offset 4,-3,-2"));
    assert!(output.code == 1 && is_same(&together), "{}", output.printed);
    // The plate alone 2 mm lower is not reached.
    let (output, alone) = verify(&job, &moved);
    assert!(output.code == 0 && alone["largest_gouge"].is_null(), "{}", output.printed);

    let plate = std::fs::read_to_string(job.path("plate.obj")).unwrap();
    job.write("small.obj", plate.lines().map(in_centimetres).collect::<String>().as_bytes());
    let small = whole.replace("plate.obj", "small.obj");
    let (output, scaled) = verify(&job, &format!("{small} --mesh-unit centimetre"));
    assert!(output.code == 1 && is_same(&scaled), "{}", output.printed);
    let (output, taken) = verify(&job, &small);
    assert!(output.prints(&["no --mesh-unit", "small.obj", "millimetres"]), "{}", output.printed);
    assert_ne!(taken["smallest_clearance"], scaled["smallest_clearance"]);
}

/// The program in the language of a control.
fn in_dialect(fanuc: &str, dialect: &str) -> String {
    let plain = fanuc.replace("G43 ", "").replace(" H1", "");
    match dialect {
        "siemens_840d" => plain.replace("G21", "G710").replace("T1 M6", "T1 M6\nD1"),
        "heidenhain" => {
            let block = |line: &str| match line.split_once(' ') {
                Some(("G0", words)) => format!("L {words} R0 FMAX\n"),
                Some(("G1", words)) => format!("L {words}\n"),
                Some(("T1", _)) => "TOOL CALL 1 Z S6000\n".to_owned(),
                Some(("S6000", _)) => "M3\n".to_owned(),
                Some(_) => String::new(),
                None => format!("{line}\n"),
            };
            format!("BEGIN PGM A MM\n{}END PGM A MM\n", plain.lines().map(block).collect::<String>())
        }
        _ => fanuc.to_owned(),
    }
}

/// The limits of a control's own post do not matter where nothing is written.
#[test]
fn every_dialect_is_verified_without_a_job() {
    let job = with_program(0, 0.15);
    let fanuc = std::fs::read_to_string(job.path("program.nc")).unwrap();
    for dialect in ["fanuc", "haas", "mazak", "linuxcnc", "siemens_840d", "heidenhain"] {
        job.write("program.nc", in_dialect(&fanuc, dialect).as_bytes());
        let (output, file) = verify(&job, &format!("{} --dialect {dialect} --fast", stand()));
        let (depth, _) = gouge(&file);
        assert!((depth - 0.15).abs() < NEAR && output.code == 1, "{dialect}: {depth} {}", output.printed);
        assert_eq!(file["dialect"], json!(dialect));
        let kinds: Vec<&str> =
            file["findings"].as_array().unwrap().iter().map(|f| f["kind"].as_str().unwrap()).collect();
        assert!(kinds.iter().all(|kind| *kind == "gouge"), "{dialect}: {kinds:?}");
    }
}

#[test]
fn a_cl_file_in_place_of_a_program_is_called_one() {
    let job = with_program(0, 0.0);
    job.write("program.nc", b"PARTNO/PLATE\nMULTAX/ON\nGOTO/0,0,10,0,0,1\nFINI\n");
    for words in [stand(), "--job job.json".to_owned()] {
        let output = facemill_in(&job, &format!("verify program.nc {words}"));
        assert!(output.code == 2 && output.errors.contains("is a CL file"), "{}", output.errors);
    }
    let output = facemill_in(&job, "feedrate program.nc --machine machine.json --tool-length-mm 100");
    assert!(output.code == 2 && output.errors.contains("is a CL file"), "{}", output.errors);
}

/// A line of an OBJ file in mm as it is in cm.
fn in_centimetres(line: &str) -> String {
    let Some(place) = line.strip_prefix("v ") else { return format!("{line}\n") };
    let scaled = place.split(' ').map(|word| (0.1 * word.parse::<f64>().unwrap()).to_string());
    format!("v {}\n", scaled.collect::<Vec<_>>().join(" "))
}

/// A post beside the plate, where the holder leans over the ends of passes.
#[test]
fn a_holder_that_meets_a_fixture_is_exit_1() {
    let job = with_program(3, 0.0);
    let text = std::fs::read_to_string(job.path("program.nc")).unwrap();
    job.write("clamp.obj", box_obj([42.0, -4.0, -6.0], [48.0, 4.0, 100.0]).as_bytes());
    job.write("beside.obj", box_obj([-4.0, 80.0, -6.0], [4.0, 88.0, 100.0]).as_bytes());
    assert_eq!(verify(&job, &format!("{} --fixture beside.obj", stand())).0.code, 0);
    let (output, file) = verify(&job, &format!("{} --fixture beside.obj --fixture clamp.obj", stand()));
    assert_eq!(output.code, 1, "{}", output.printed);
    let findings = file["findings"].as_array().unwrap();
    let obstacles: Vec<&str> = findings.iter().map(|f| f["obstacle"].as_str().unwrap()).collect();
    assert!(obstacles.iter().all(|obstacle| obstacle.contains("clamp")), "{obstacles:?}");
    assert_eq!(findings[0]["kind"], "holder_collision");
    assert!(output.prints(&["collision of the tool assembly", "clamp"]), "{}", output.printed);
    // The report says so for a block that goes to the far end of a pass.
    let line = text.lines().nth(findings[0]["worst_line"].as_u64().unwrap() as usize - 1).unwrap();
    let x: f64 = line.split(" X").nth(1).and_then(|rest| rest.split(' ').next()).unwrap().parse().unwrap();
    assert!(x > 20.0, "{line}");
    // With y up the post lies down, and is in nobody's way.
    let (output, _) = verify(&job, &format!("{} --fixture clamp.obj --mesh-up y", stand()));
    assert!(!output.prints(&["collision of the tool assembly", "clamp"]), "{}", output.printed);
}

#[test]
fn a_gouge_beyond_the_limit_is_exit_1_and_one_within_it_is_not() {
    let depth = 0.03;
    let job = with_program(1, depth);
    // Nobody said how deep, and what is allowed without operations is less.
    let (output, file) = verify(&job, &stand());
    assert_eq!((output.code, &file["gouge_limit_mm"]), (1, &json!(0.02)), "{}", output.printed);
    assert!(output.prints(&[" gouge ", "cutter, part"]) && output.prints(&["largest gouge", "allowed 0.020 mm"]));
    for (limit, code) in [(depth - NEAR, 1), (depth + NEAR, 0)] {
        let (output, file) = verify(&job, &format!("{} --gouge-mm {limit}", stand()));
        assert_eq!(
            (output.code, file["findings"].as_array().unwrap().len()),
            (code, code as usize),
            "{}",
            output.printed
        );
    }

    // The same in the cut stock: beyond the limit by more than what it is cut to.
    let cut = format!("{} --stock-cell-mm 0.5 --stock-tolerance-mm 0.002 --deviation-tolerance-mm 0.04", stand());
    let (output, file) = verify(&job, &cut);
    assert_eq!((output.code, &file["deviation"]["exceeds_gouge_limit"]), (1, &json!(true)), "{}", output.printed);
    assert!(output.prints(&["DEEPER THAN ALLOWED"]), "{}", output.printed);
    let place = &file["deviation"]["part"]["largest_gouge"];
    assert!((place["value_mm"].as_f64().unwrap() - depth).abs() < NEAR, "{place}");
    assert!((place["at_mm"][0].as_f64().unwrap() - GOUGED_AT).abs() < 2.0, "{place}");
    let (output, file) = verify(&job, &format!("{cut} --gouge-mm 0.04"));
    assert_eq!((output.code, &file["deviation"]["exceeds_gouge_limit"]), (0, &json!(false)), "{}", output.printed);
    assert!(!output.prints(&["DEEPER THAN ALLOWED"]), "{}", output.printed);
}

/// A sheet of the part on stock that ends less deep below it than the cutter may go: there the
/// sheet is cut through.
#[test]
fn an_open_surface_that_is_cut_through_is_exit_1_without_a_finding() {
    let job = with_program(1, 0.015);
    job.write("sheet.obj", b"v -15 -15 0\nv 15 -15 0\nv 15 15 0\nv -15 15 0\nf 1 2 3\nf 1 3 4\n");
    let sheet = stand().replace("plate.obj", "sheet.obj").replace("offset:0.5", "block.obj");
    let cut = "--stock-cell-mm 0.5 --stock-tolerance-mm 0.002 --deviation-tolerance-mm 0.1";
    for (bottom, is_through) in [(-6.0, false), (-0.01, true)] {
        job.write("block.obj", box_obj([-15.0, -15.0, bottom], [15.0, 15.0, 0.5]).as_bytes());
        let (output, file) = verify(&job, &format!("{sheet} {cut}"));
        assert_eq!(file["findings"], json!([]), "{}", output.printed);
        assert_eq!(file["deviation"]["exceeds_gouge_limit"], is_through, "{}", output.printed);
        assert_eq!((output.code, output.prints(&["DEEPER THAN ALLOWED"])), (i32::from(is_through), is_through));
    }
}

#[test]
fn what_contradicts_itself_or_is_missing_is_exit_2_and_writes_nothing() {
    let job = with_program(-3, 0.0);
    job.write("broken.obj", b"v 1 2\nf 1 2 3\n");
    let before = files_of(&job);
    let whole = stand();
    let without = |option: &str| {
        let words: Vec<&str> = whole.split(' ').collect();
        words.chunks(2).filter(|pair| pair[0] != option).flatten().copied().collect::<Vec<_>>().join(" ")
    };
    let and = |more: &str| format!("{whole} {more}");
    let wrong: [(String, &[&str]); 21] = [
        (String::new(), &["--job"]),
        (without("--tool"), &["--tool"]),
        (without("--stock"), &["--stock"]),
        (without("--machine"), &["--machine"]),
        (and("--job job.json"), &["--part", "--job"]),
        ("--job job.json --fixture plate.obj".to_owned(), &["--part"]),
        ("--job job.json --mount 0,0,1".to_owned(), &["--part"]),
        (and("--mesh-unit furlong"), &["--mesh-unit", "furlong", "millimetre"]),
        (and("--work-offset 1,2"), &["--work-offset", "X,Y,Z"]),
        (and("--work-register G99"), &["register", "G99", "G54"]),
        (and("--length-register 0"), &["tool.json", "length_register"]),
        (and("--gouge-mm -0.1"), &["--gouge-mm", "at least 0"]),
        (and("--rest-out rest.stock"), &["--rest-out", "--stock-cell-mm"]),
        (and("--rest-mesh rest.json"), &["--rest-mesh", ".obj"]),
        (and("--fixture gone.obj"), &["cannot read", "gone.obj"]),
        (whole.replace("plate.obj", "gone.obj"), &["cannot read", "gone.obj"]),
        (whole.replace("plate.obj", "broken.obj"), &["broken.obj", "line 1"]),
        (whole.replace("offset:0.5", "tool.json"), &["tool.json", ".stl"]),
        (whole.replace("--tool tool.json", "--tool machine.json"), &["machine.json", "format"]),
        // One file for two outputs leaves neither, and what was read is not written over.
        (and("--stock-cell-mm 2 --rest-out found.json"), &["found.json", "named for two files"]),
        (and("--stock-cell-mm 2 --rest-out plate.obj"), &["plate.obj", "is an input"]),
    ];
    for (words, expected) in wrong {
        let output = facemill_in(&job, &format!("verify program.nc --out found.json {words}"));
        assert!(output.is_refused_for(expected), "{words}: exit {}: {}{}", output.code, output.errors, output.printed);
        assert!(files_of(&job) == before, "{words}");
    }
}

/// A fin between the lines is beside the plate, and a rapid goes through it, or over it.
#[test]
fn cutting_the_stock_hides_nothing_that_is_between_its_lines() {
    let job = with_program(3, 0.0);
    let text = std::fs::read_to_string(job.path("program.nc")).unwrap();
    // Lines of 1 mm from the plate's side on are at half millimetres.
    let (plate, fin) =
        (box_obj([-15.0, -15.0, -6.0], [15.0, 15.0, 0.5]), box_obj([22.1, -60.0, -6.0], [22.4, -40.0, 30.0]));
    job.write("stock.obj", joined_obj(&plate, &fin).as_bytes());
    let stand = stand().replace("offset:0.5", "stock.obj");
    for (height, code) in [(10.0, 1), (31.0, 0)] {
        let [above, beside, behind] = [[-30.0, -50.0, 60.0], [-30.0, -50.0, height], [70.0, -50.0, height]].map(words);
        let rapids = format!("G0 {above}\nG0 {beside}\nG0 {behind}\nM30").replace("B10 ", "B10. ");
        job.write("program.nc", text.replace("M30", &rapids).as_bytes());
        let line = text.lines().count() as u64 + 2;
        for cell in ["", "--stock-cell-mm 1", "--stock-cell-mm 0.7"] {
            let (output, file) = verify(&job, &format!("{stand} {cell}"));
            let findings = file["findings"].as_array().unwrap();
            let rapid: Vec<&Value> = findings.iter().filter(|f| f["kind"] == "rapid_collision").collect();
            assert_eq!((output.code, rapid.len()), (code, code as usize), "{cell}: {}", output.printed);
            assert!(rapid.iter().all(|f| f["worst_line"] == json!(line)), "{cell}: {}", output.printed);
            assert!(
                cell.is_empty() || output.prints(&["between the lines of the stock", "is more than"]),
                "{}",
                output.printed
            );
        }
    }
    let output = facemill_in(&job, &format!("verify program.nc {stand} --stock-cell-mm 1 --stock-tolerance-mm 0.6"));
    assert!(output.code == 2 && output.errors.contains("to 0.5 mm"), "{}", output.errors);
    let output = facemill_in(&job, &format!("verify program.nc {stand} --stock-cell-mm 500"));
    assert!(output.code == 2 && output.errors.contains("none of its lines, 500 mm apart"), "{}", output.errors);
}

/// Both boxes in one file.
fn joined_obj(one: &str, other: &str) -> String {
    let n = one.lines().filter(|line| line.starts_with("v ")).count();
    let moved = |line: &str| match line.strip_prefix("f ") {
        Some(face) => {
            let corners: Vec<String> = face.split(' ').map(|k| (k.parse::<usize>().unwrap() + n).to_string()).collect();
            format!("f {}\n", corners.join(" "))
        }
        None => format!("{line}\n"),
    };
    format!("{one}\n{}", other.lines().map(moved).collect::<String>())
}
