//! Files with several tools, and controls with RTCP.

use facemill_nc_program::Dialect;

use crate::kit::*;

const TWO_TOOLS: &str = "LOADTL/7\nSPINDL/3000,RPM,CLW\nCOOLNT/ON\nRAPID\nGOTO/0,0,60\nFEDRAT/600,MMPM\nGOTO/0,0,50\n\
                         RAPID\nGOTO/0,0,60\nPPRINT/SECOND\nLOADTL/9\nSPINDL/1500,RPM,CLW\nRAPID\nGOTO/5,5,60\n\
                         GOTO/5,5,40\nRAPID\nGOTO/5,5,60\nLOADTL/7\nSPINDL/2500,RPM,CLW\nRAPID\nGOTO/9,9,60\n\
                         GOTO/9,9,40\nRAPID\nGOTO/9,9,60\nFINI\n";

#[test]
fn each_tool_has_its_change_length_and_speed_on_every_control() {
    for dialect in Dialect::ALL {
        let mut stage = Stage::control("table-table-a-c", dialect, None);
        stage.tools.push(tool(9, 120.0));
        let posted = stage.post(TWO_TOOLS);
        assert!(posted.report.is_clean(), "{}: {:?}", dialect.name(), posted.report.faults);
        let tools: Vec<(u32, u32)> = posted.report.tools.iter().map(|t| (t.number, t.cl_line)).collect();
        assert_eq!(tools, [(7, 1), (9, 11), (7, 18)], "{}", dialect.name());
        let at = |word: &str, from: usize| {
            posted.text[from..].find(word).map(|k| from + k).unwrap_or_else(|| panic!("{}: no {word}", dialect.name()))
        };
        // The comment before LOADTL is of the next tool.
        let mut place = 0;
        for word in ["3000", "1500", "SECOND", "2500"] {
            place = at(word, place);
        }
        for length in ["150.000", "120.000"] {
            at(length, 0);
        }
    }
}

/// A cutter that has cut is not that of the next tool, which has none of its own, or one behind its
/// first rapids.
#[test]
fn the_cutter_of_one_tool_is_not_compared_with_the_next() {
    let mut stage = Stage::control("table-table-a-c", Dialect::Fanuc, None);
    stage.tools.push(tool(9, 120.0));
    let with = |first: &str, second: &str| {
        let text = TWO_TOOLS.replacen("LOADTL/7\n", &format!("LOADTL/7\n{first}"), 1);
        let text = text.replacen("GOTO/5,5,60\n", &format!("GOTO/5,5,60\n{second}"), 1);
        stage.post(&text).report.faults.into_iter().map(|n| n.text).collect::<Vec<_>>()
    };
    assert_eq!(with("CUTTER/12,0\n", "").len(), 1, "that of T7 alone");
    assert!(with("", "CUTTER/12,0\n")[0].contains("the file of T9"));
    assert_eq!(with("CUTTER/12,0\n", "CUTTER/14,0\n").len(), 2);
}

/// The program calls the register of the tool file: another one in the file is noted with its line,
/// also behind the first call of the tool.
#[test]
fn a_length_register_of_the_file_that_is_not_the_tools_is_noted() {
    let stage = Stage::fanuc("head-b-table-c", 3);
    let posted = |call: &str| {
        let posted = stage.post(&(HEAD.replace("LOADTL/7", call) + "FINI"));
        assert!(posted.report.is_clean() && posted.text.contains("H7"), "{call}");
        posted.report.notes.into_iter().map(|n| (n.line.unwrap(), n.text)).collect::<Vec<_>>()
    };
    let note = |line: u32, called: &str| {
        (line, format!("the file calls {called} for T7, and the file of T7 has 7: that is taken"))
    };
    for same in ["LOADTL/7", "LOAD/TOOL,7,ADJUST,7", "LOADTL/7,OSETNO,7", "LOADTL/7,ADJUST,ON", "LOADTL/7,1"] {
        assert_eq!(posted(same), [], "{same}");
    }
    for other in ["LOAD/TOOL,7,ADJUST,9", "LOADTL/7,OSETNO,9", "LOADTL/7,LENGTH,150,ADJUST,9"] {
        assert_eq!(posted(other), [note(3, "length register 9")], "{other}");
    }
    assert_eq!(posted("LOADTL/7,ADJUST,NONE"), [note(3, "no length register")]);
    assert_eq!(posted("LOADTL/7,ADJUST,7\nLOADTL/7,ADJUST,8"), [note(4, "length register 8")]);
    // A tool that is called and does not move is not of the program.
    assert_eq!(posted("LOADTL/5,ADJUST,5\nLOADTL/7,ADJUST,7"), []);
}

#[test]
fn a_tool_that_is_not_given_is_refused() {
    let stage = Stage::fanuc("table-table-a-c", 3);
    let why = stage.refused(TWO_TOOLS);
    assert!(why.starts_with("line 11: LOADTL calls T9; the tools given are T7"), "{why}");
    let mut two = Stage::fanuc("table-table-a-c", 3);
    two.tools.push(tool(9, 120.0));
    let unnamed = HEAD.replace("LOADTL/7\n", "");
    assert!(two.refused(&unnamed).ends_with("no LOADTL says which of the tools is used from here on"));
    assert!(stage.post(&unnamed).text.contains("T7 M6"));
}

/// Under RTCP the words are the coordinates of the tip in the frame of the file, where the
/// program's zero is that of the file.
#[test]
fn words_under_rtcp_are_the_coordinates_of_the_file() {
    let stage = Stage::control("head-head-c-a", Dialect::Fanuc, Some("tip_and_rotaries_linear"));
    let poses = random_walk(&mut facemill_test_kit::Random(900), 120);
    let posted = stage.post(&file_of(&poses, ("MM", 1.0)));
    assert!(posted.report.is_clean(), "{:?}", posted.report.faults);
    assert!(posted.text.contains("G43.4"));
    // Words count from the machine's zero here, which is a place in the frame of the file.
    let motions = motions(&posted.text);
    let zero = ["X", "Y", "Z"].map(|axis| motions[0].words[axis]);
    let zero = nalgebra::Vector3::from(zero) - poses[0].cl.tip.coords;
    let mut at = 0;
    for pose in &poses {
        let is_it = |m: &Motion| {
            let word = |axis: &str, k: usize| (m.words[axis] - zero[k] - pose.cl.tip[k]).abs() <= 0.001 + 1e-6;
            word("X", 0) && word("Y", 1) && word("Z", 2)
        };
        at += motions[at..].iter().position(is_it).expect("the point in the text");
    }
}

#[test]
fn laws_under_rtcp_are_kept_on_every_control_that_has_them() {
    let poses = random_walk(&mut facemill_test_kit::Random(901), 80);
    let text = file_of(&poses, ("MM", 1.0));
    for (dialect, law) in [
        (Dialect::Fanuc, "tip_and_rotaries_linear"),
        (Dialect::Fanuc, "tip_linear_vector_turned"),
        (Dialect::Haas, "tip_and_rotaries_linear"),
        (Dialect::Mazak, "tip_and_rotaries_linear"),
        (Dialect::LinuxCnc, "tip_and_rotaries_linear"),
        (Dialect::Siemens840d, "tip_and_rotaries_linear"),
        (Dialect::Siemens840d, "tip_linear_vector_turned"),
        (Dialect::Heidenhain, "tip_and_rotaries_linear"),
        (Dialect::Heidenhain, "tip_linear_vector_turned"),
    ] {
        for name in MACHINES {
            let stage = Stage::control(name, dialect, Some(law));
            let posted = stage.post(&text);
            assert!(posted.report.is_clean(), "{name} {} {law}: {:?}", dialect.name(), posted.report.faults);
        }
    }
}

/// Under RTCP the tip is where it should be with rotary words of any decimals: the rim of the
/// cutter shows that the axis is not.
#[test]
fn coarse_rotary_words_under_rtcp_are_a_fault_of_the_rim() {
    let poses = random_walk(&mut facemill_test_kit::Random(902), 60);
    let options = facemill_cl_post::PostOptions { tolerance: 0.005, ..facemill_cl_post::PostOptions::new("test") };
    let posted = |rotary: u8| {
        let stage = Stage::rtcp("head-head-c-a", 4, rotary);
        stage.post_with(&file_of(&poses, ("MM", 1.0)), &options).unwrap()
    };
    let coarse = posted(1);
    let d = &coarse.report.deviation;
    assert!(!coarse.is_as_meant && d.tip_mm < 0.001 && d.rim_mm > 0.005, "{d:?}");
    assert!(
        coarse.report.faults.iter().any(|f| f.line == Some(d.rim_cl_line) && f.text.contains("the rim of the cutter"))
    );
    assert!(posted(4).report.is_clean());
}
