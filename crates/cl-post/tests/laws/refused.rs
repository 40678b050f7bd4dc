//! Files and settings that are refused, with the line.

use facemill_cl_data::Monitor;
use facemill_cl_post::{PostFault, PostOptions, post_on};
use facemill_nc_program::FeedMode;
use facemill_nc_program::dialect::{Orientation, PostFile};
use facemill_test_kit::Random;

use crate::kit::*;

#[test]
fn faults_name_the_line_and_what_to_do() {
    let stage = Stage::fanuc("head-b-table-c", 3);
    for (text, expected) in [
        ("PARTNO/1\nFINI\n".to_owned(), "no statement moves the tool"),
        ("LOADTL/7\nRAPID\nGOTO/0,0,60\n".to_owned(), "line 3: the tool moves, and no SPINDL gives the speed"),
        ("RAPID\nGOTO/0,0,60\nFEDRAT/5\nGOTO/0,0,50\n".to_owned(), "line 4: the tool cuts, and no SPINDL"),
        (format!("{HEAD}GOTO/0,0,50\n"), "line 8: the tool ends in a cut, and would go home from there at rapid rate"),
        (HEAD.replace("UNITS/MM\n", "").replace("MMPM", "IPM"), "line 6: the feed is in inches, and UNITS is missing"),
        (format!("{HEAD}UNITS/INCHES\n"), "line 8: UNITS changes the unit behind points, frames or feeds"),
        (format!("FEDRAT/600,MMPM\nUNITS/INCH\n{HEAD}"), "line 2: UNITS changes the unit behind points"),
        (HEAD.replace("UNITS/MM\n", "") + "UNITS/INCHES\n", "line 7: UNITS changes the unit behind points"),
        (
            format!("$$-> CSYS / 1,0,0,0,0,1,0,0,0,0,1,0\n{HEAD}$$-> CSYS / 1,0,0,5,0,1,0,0,0,0,1,0\n"),
            "line 9: CSYS of Creo differs from the one before",
        ),
        (format!("$$-> CSYS / 1,0,a\n{HEAD}"), "line 1: CSYS of Creo: its values are not all numbers"),
        (
            format!("$$-> CUTCOM_GEOMETRY_TYPE / OUTPUT_ON_PROFILE\n{HEAD}CUTCOM/LEFT\nGOTO/0,0,50\n"),
            "line 9: CUTCOM is not written, and the points are of the profile (line 1)",
        ),
        (format!("{HEAD}CYCLE/DRILL,RAPTO,1e9\nGOTO/0,0,20\n"), "line 8: the cycle's height is beyond 1000000 mm"),
        (HEAD.replace("FEDRAT/600,MMPM\n", "") + "GOTO/0,0,50\n", "line 7: the tool cuts, and no FEDRAT was given"),
        (HEAD.replace("600", "0") + "GOTO/0,0,50\n", "line 8: its feed is 0 mm/min; it must be above 0"),
        (HEAD.replace("600", "-5") + "GOTO/0,0,50\n", "line 8: its feed is -5 mm/min; it must be above 0"),
        (format!("{HEAD}SPINDL/OFF\nGOTO/0,0,50\n"), "line 9: the tool cuts with the spindle off"),
        (format!("{HEAD}GOTO/0,0,5000\nRAPID\nGOTO/0,0,60\n"), "line 8: the machine does not reach it"),
        (format!("{HEAD}GOTO/0,0,50,0,0,-1\nRAPID\nGOTO/0,0,60,0,0,1\n"), "line 8: the machine does not reach it"),
        (format!("{HEAD}GOTO/1e7,0,5\n"), "line 8: a coordinate is beyond 1000000 mm"),
        (format!("{HEAD}TRACUT/M1\nGOTO/0,0,50\n"), "line 8: TRACUT is not followed"),
        (format!("{HEAD}RAPID\nGOTO/0,0,9\nGOHOME\nGOTO/0,0,9\n"), "line 10: GOHOME, and the tool moves again"),
        (format!("{HEAD}CSYS/FIXTURE\n"), "line 8: CSYS is not followed"),
        (format!("{HEAD}CSYS/1,0,0,0,0,1,0,0,0,0,2,0\n"), "line 8: CSYS: its directions are not unit vectors"),
        (format!("{HEAD}CSYS/1,0,0,0,0,1,0,0,0,0,-1,0\n"), "line 8: CSYS: its directions are not unit vectors"),
        (format!("MSYS/0,0,0,1,0,0,0,1,0\n{HEAD}MSYS/5,0,0,1,0,0,0,1,0\n"), "line 9: MSYS differs"),
        (format!("{HEAD}DELAY/-1\n"), "line 8: DELAY of -1 s"),
        (format!("{HEAD}FINI\nGOTO/0,0,50\n"), "line 9: the tool moves behind FINI"),
    ] {
        let why = stage.refused(&text);
        assert!(why.starts_with(expected), "{why}\nexpected {expected}\n{text}");
    }
    assert!(stage.post(&format!("MSYS/0,0,0,1,0,0,0,1,0\n{HEAD}MSYS/0,0,0, 1,0,0,0,1,0\nFINI")).report.is_clean());
}

#[test]
fn settings_are_checked() {
    let stage = Stage::fanuc("head-b-table-c", 3);
    let with = |options: PostOptions| stage.post_with(HEAD, &options).unwrap_err().to_string();
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY, 5.0] {
        assert!(with(PostOptions { tolerance: bad, ..PostOptions::new("t") }).contains("the tolerance is"));
        assert!(
            with(PostOptions { rapid_tolerance: Some(bad), ..PostOptions::new("t") }).contains("tolerance of rapids")
        );
    }
    for bad in [0.0, -1.0, f64::NAN, 1e9] {
        assert!(with(PostOptions { retract: Some(bad), ..PostOptions::new("t") }).contains("the retract is"));
    }
    let rtcp = PostFile { feed_mode: FeedMode::Rtcp, ..PostFile::default() };
    let why = post_on(&stage.machine, &rtcp.settings(None).unwrap()).unwrap_err().to_string();
    assert!(why.contains("motion.cutting"), "{why}");
    let dialect = facemill_nc_program::Dialect::Siemens840d;
    let vectors = PostFile { dialect, orientation: Orientation::Vectors, ..rtcp };
    let turned = machine("head-b-table-c", Some("tip_and_rotaries_linear"));
    if let Ok(settings) = vectors.settings(None) {
        assert!(post_on(&turned, &settings).unwrap_err().to_string().contains("rotary words"));
    }
}

/// A frame of Creo that is not the file's is noted, one that is repeated is not.
#[test]
fn a_frame_in_comments_of_creo_is_noted() {
    let stage = Stage::fanuc("head-b-table-c", 3);
    let notes = |system: &str| {
        let text = format!("$$-> CSYS / {system}\n{HEAD}$$-> CSYS / {system}\nFINI");
        stage.post(&text).report.notes.into_iter().map(|n| (n.line, n.text)).collect::<Vec<_>>()
    };
    assert_eq!(notes("1,0,0,0,0,1,0,0,0,0,1,0"), []);
    let moved = notes("1,0,0,5,0,1,0,0,0,0,1,0");
    assert!(moved.len() == 1 && moved[0].0 == Some(1) && moved[0].1.starts_with("CSYS of Creo is taken"), "{moved:?}");
}

/// More tools than any magazine, and words without end, are read in time that grows as the file.
#[test]
fn many_words_and_tools_are_bounded() {
    let stage = Stage::fanuc("head-b-table-c", 3);
    let many: String = (0..20_000).map(|k| format!("WORD{k}/1\n")).collect();
    let posted = stage.post(&format!("{HEAD}{many}FINI"));
    assert_eq!(posted.report.faults.len(), 21);
    assert_eq!(posted.report.faults[20].text, "19980 more words are not understood; the list of words has them");
    let tools: String = (0..1000).map(|k| format!("LOADTL/{}\nRAPID\nGOTO/0,0,60\n", k + 1)).collect();
    let why = stage.refused(&format!("SPINDL/100\n{tools}"));
    assert!(why.starts_with("line 2999: the file has more than 999 parts with a tool each"), "{why}");
    // 100,000 chords of one arc, two hundred times.
    let arc = "CIRCLE/0,0,0,0,0,1,900000\nGOTO/900000,0,0\n";
    let why = stage.post_with(
        &format!("{HEAD}GOTO/900000,0,0\n{}", arc.repeat(2000)),
        &PostOptions { tolerance: 1e-3, ..PostOptions::new("t") },
    );
    let why = why.unwrap_err().to_string();
    assert!(why.starts_with("line ") && why.contains("more than 20000000 moves"), "{why}");
}

/// The number of positions is bounded, those inserted with them: with the line at which it is
/// reached, and to the position.
#[test]
fn positions_are_bounded() {
    let stage = Stage::fanuc("head-b-table-c", 3);
    let text = file_of(&random_walk(&mut Random(91), 200), ("MM", 1.0));
    let of = |max_positions: usize| PostOptions { max_positions, ..PostOptions::new("t") };
    let posted = stage.post(&text);
    let n = stage.reached(&posted.text).len();
    assert!(n > 220, "{n} positions: none is inserted");
    assert_eq!(stage.post_with(&text, &of(n)).map(|p| p.text), Ok(posted.text));
    let mut last = 0;
    for most in [1, 10, 50, n / 2, n - 1] {
        let why = stage.post_with(&text, &of(most)).map(|p| p.text).unwrap_err().to_string();
        assert!(why.contains(&format!("more than {most} positions keep the tolerance")), "{why}");
        let line = why.strip_prefix("line ").and_then(|rest| rest.split(':').next()?.parse::<u32>().ok());
        let line = line.unwrap_or_else(|| panic!("{why}"));
        assert!(line > last && line <= 7 + 2 * 200, "{why}");
        last = line;
    }
}

/// Cancels behind so many steps.
struct Impatient {
    steps: std::sync::atomic::AtomicUsize,
    most: usize,
}

impl Monitor for Impatient {
    fn advance(&self, steps: usize) {
        self.steps.fetch_add(steps, std::sync::atomic::Ordering::SeqCst);
    }

    fn is_cancelled(&self) -> bool {
        self.steps.load(std::sync::atomic::Ordering::SeqCst) >= self.most
    }
}

/// A monitor stops it at every stage, within a step.
#[test]
fn it_is_cancelled_at_every_step() {
    let stage = Stage::fanuc("head-b-table-c", 3);
    let text = file_of(&random_walk(&mut Random(92), 60), ("MM", 1.0));
    let run = |most: usize| {
        let monitor = Impatient { steps: 0.into(), most };
        let posted = stage.post_watched(&text, &PostOptions::new("t"), &monitor);
        (posted.map(|p| p.text), monitor.steps.into_inner())
    };
    let (posted, all) = run(usize::MAX);
    assert!(posted.is_ok() && all >= 60, "{all} steps");
    for most in 0..all {
        let (stopped, steps) = run(most);
        assert!(matches!(stopped, Err(PostFault::Cancelled(_))), "{most} of {all}: {:?}", stopped.map(drop));
        assert!(steps <= most + 1, "{steps} steps behind {most}");
    }
}

/// Text of random statements is posted or refused, and never panics.
#[test]
fn no_file_makes_it_panic() {
    let stage = Stage::fanuc("head-b-table-c", 3);
    let mut random = facemill_test_kit::Random(77);
    let statements = [
        "GOTO/1,2,30",
        "GOTO/1,2,30,0,0,1",
        "GOTO/5,5,25,0.3,0.1,1",
        "GOTO/5,5,25,-0.3,0.1,0.2",
        "GODLTA/0,0,1",
        "FROM/0,0,60",
        "RAPID",
        "FEDRAT/100,MMPM",
        "FEDRAT/0.1,MMPR",
        "SPINDL/100",
        "SPINDL/OFF",
        "SPINDL/ON",
        "LOADTL/7",
        "CIRCLE/0,0,20,0,0,1,5",
        "CIRCLE/5,0,25,0,1,0",
        "CYCLE/DRILL,RAPTO,3",
        "CYCLE/OFF",
        "MULTAX/OFF",
        "UNITS/INCHES",
        "CSYS/0,-1,0,4,1,0,0,5,0,0,1,6",
        "COOLNT/THRU",
        "STOP",
        "FINI",
        "PPRINT/",
        "DELAY/1",
        "TLAXIS/0.1,0,1",
    ];
    let mut n_posted = 0;
    for _ in 0..400 {
        let n = random.below(30);
        let text: String = (0..n).map(|_| format!("{}\n", statements[random.below(statements.len())])).collect();
        let text = format!("{HEAD}{text}");
        let options = PostOptions { retract: Some(5.0), ..PostOptions::new("test") };
        if facemill_cl_file::read_apt(&text).is_err() {
            continue;
        }
        if let Ok(posted) = stage.post_with(&text, &options) {
            assert!(posted.is_as_meant, "{:?}\n{text}", posted.report.faults);
            n_posted += 1;
        }
    }
    assert!(n_posted > 30, "{n_posted}");
}
