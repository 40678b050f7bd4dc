//! Cuts of a file: which motion is one, of which tool, and in which frame.

use facemill_cl_file::read_apt;
use facemill_cl_path::*;
use facemill_tool_model::Cutter;

fn cuts_of(text: &str, tool: Option<u32>) -> Result<ToolCuts, String> {
    let cutter = Cutter::new(20.0, 1.5, 10.0).expect("a cutter");
    let settings = CutSettings { cutter: &cutter, tool, chord: 0.01, max_points: 2000 };
    read_cuts(&read_apt(text).expect("an APT file"), &settings).map_err(|e| e.to_string())
}

fn lines(cuts: &ToolCuts) -> Vec<Vec<u32>> {
    cuts.cuts.iter().map(|cut| cut.iter().map(|p| p.line).collect()).collect()
}

#[test]
fn a_cut_is_motion_at_feed_from_where_the_tool_is_to_the_next_rapid() {
    let text = "UNITS/MM\nFROM/0,0,9\nRAPID\nGOTO/1,0,5\nFEDRAT/100\nGOTO/1,0,0\nGOTO/2,0,0\nRAPID\nGOTO/2,0,5\nRAPID\nGOTO/3,0,5\n\
                GOTO/3,0,0\nGODLTA/1,0,0\nFINI\n";
    let cuts = cuts_of(text, None).unwrap();
    assert_eq!(lines(&cuts), [vec![4, 6, 7], vec![11, 12, 13]]);
    assert_eq!(cuts.cuts[1][2].cl.tip.x, 4.0);
    assert!(cuts.notes.is_empty(), "{:?}", cuts.notes);
}

#[test]
fn a_tool_is_taken_by_its_number_and_must_be_named_among_several() {
    let text = "UNITS/MM\nLOADTL/3\nRAPID\nGOTO/0,0,0\nFEDRAT/100\nGOTO/1,0,0\nLOADTL/7\nRAPID\nGOTO/5,0,0\nGOTO/6,0,0\nLOADTL/9\n\
                RAPID\nGOTO/8,0,0\nFINI\n";
    assert_eq!(lines(&cuts_of(text, Some(3)).unwrap()), [vec![4, 6]]);
    assert_eq!(lines(&cuts_of(text, Some(7)).unwrap()), [vec![9, 10]]);
    let none = cuts_of(text, None).unwrap_err();
    assert!(none.contains("3 (line 6), 7 (line 10)") && none.contains("`tool`"), "{none}");
    // Tool 9 makes no cut.
    assert!(cuts_of(text, Some(9)).unwrap_err().contains("no cut is made with tool 9"));
    let alone = cuts_of(&text.replace("LOADTL/7\n", "LOADTL/3\n"), None).unwrap();
    assert_eq!((alone.tool, alone.cuts.len()), (Some(3), 2));
}

#[test]
fn units_frames_and_arcs_are_those_of_the_file() {
    let inch = cuts_of("UNITS/INCHES\nRAPID\nGOTO/0,0,0\nFEDRAT/10,IPM\nGOTO/1,2,3\nFINI\n", None).unwrap();
    assert!((inch.cuts[0][1].cl.tip.coords - nalgebra::Vector3::new(25.4, 50.8, 76.2)).norm() < 1e-12);
    // x of the frame is y of the part.
    let frame = "UNITS/MM\nCSYS/0,1,0,10,-1,0,0,20,0,0,1,30\nRAPID\nGOTO/0,0,0\nFEDRAT/10\nGOTO/5,0,0\nFINI\n";
    let cuts = cuts_of(frame, None).unwrap();
    assert!((cuts.cuts[0][1].cl.tip.coords - nalgebra::Vector3::new(10.0, 25.0, 30.0)).norm() < 1e-12);
    let arc = "UNITS/MM\nRAPID\nGOTO/10,0,0\nFEDRAT/10\nCIRCLE/0,0,0,0,0,1,10\nGOTO/0,10,0\nFINI\n";
    let cut = &cuts_of(arc, None).unwrap().cuts[0];
    assert!(cut.len() > 8 && cut.iter().all(|p| (p.cl.tip.coords.norm() - 10.0).abs() < 1e-9));
    assert!(cut.windows(2).all(|w| 10.0 - nalgebra::center(&w[0].cl.tip, &w[1].cl.tip).coords.norm() < 0.0101));
    // Off MULTAX the axis is +z.
    let off = "UNITS/MM\nMULTAX/ON\nTLAXIS/1,0,0\nMULTAX/OFF\nRAPID\nGOTO/0,0,0\nFEDRAT/10\nGOTO/1,0,0\nFINI\n";
    assert_eq!(cuts_of(off, None).unwrap().cuts[0][0].cl.axis.z, 1.0);
}

#[test]
fn what_would_be_elsewhere_is_refused_with_its_line() {
    let cut = "RAPID\nGOTO/0,0,0\nFEDRAT/10\nGOTO/1,0,0\n";
    let refused = |head: &str, tail: &str, words: &[&str]| {
        let why = cuts_of(&format!("{head}{cut}{tail}"), None).unwrap_err();
        assert!(words.iter().all(|word| why.contains(word)), "{why}");
    };
    refused(
        "UNITS/MM\nCUTTER/50,1.5\n",
        "FINI\n",
        &["line 2", "diameter 50.000", "diameter 40.000", "the file's tool"],
    );
    refused("UNITS/MM\nCUTTER/40,3\n", "FINI\n", &["line 2", "corner radius 3.000 mm"]);
    // A flat end mill, with its corner of zero and without, is no bull nose.
    refused("UNITS/MM\nCUTTER/40,0\n", "FINI\n", &["line 2", "corner radius 0.000 mm"]);
    refused("UNITS/MM\nCUTTER/40\n", "FINI\n", &["line 2", "no corner radius", "1.500 mm"]);
    // Its corner elsewhere, a bottom that rises, a side that leans.
    refused("UNITS/MM\nCUTTER/40,1.5,15,1.5,0,0,30\n", "FINI\n", &["line 2", "15.000 mm from the axis", "18.500"]);
    refused("UNITS/MM\nCUTTER/40,1.5,18.5,1.5,2,0,30\n", "FINI\n", &["line 2", "2 deg at its bottom"]);
    refused("UNITS/MM\nCUTTER/40,1.5,18.5,1.5,0,-5,30\n", "FINI\n", &["line 2", "-5 deg at its side"]);
    refused(
        "UNITS/MM\nTLDATA/MILL,50,1.5,75,0,0\n",
        "FINI\n",
        &["line 2: TLDATA/MILL has diameter 50.000", "diameter 40.000"],
    );
    refused("UNITS/MM\nTLDATA/MILL,40,1.5,75,0,3\n", "FINI\n", &["line 2: TLDATA/MILL", "3 deg at its bottom"]);
    refused("UNITS/MM\nTLDATA/DRILL,MILL,40,0,80,118,35\n", "FINI\n", &["line 2: TLDATA/DRILL is no mill"]);
    refused("UNITS/MM\n$$-> CUTTER / 50.0\n", "FINI\n", &["line 2: CUTTER of Creo has diameter 50.000 mm"]);
    refused("UNITS/MM\n", "TRACUT/ON\nFINI\n", &["line 6", "TRACUT is not followed"]);
    refused("UNITS/MM\n", "UNITS/INCHES\nGOTO/1,1,1\nFINI\n", &["line 6", "UNITS changes"]);
    refused("UNITS/MM\n", "FINI\nGOTO/1,1,1\n", &["line 7", "behind FINI"]);
    refused("UNITS/MM\n", "GOTO/2000000,0,0\nFINI\n", &["line 6", "beyond"]);
    refused("UNITS/MM\n", "CIRCLE/0,0,0,0,0,1,5\nGOTO/7,0,0\nFINI\n", &["line 7", "arc begins"]);
    refused("UNITS/MM\n", &"GOTO/1,0,0\n".repeat(2000), &["more than 2000 points", "line 2005"]);
    let none = cuts_of("UNITS/MM\nRAPID\nGOTO/0,0,0\nFINI\n", None).unwrap_err();
    assert!(none.contains("no statement moves the tool at feed"), "{none}");
}

/// A cutter that has cut is not that of the next tool; one that has not may be described first.
#[test]
fn the_cutter_of_one_tool_is_not_compared_with_the_next() {
    let cut = "SPINDL/1000\nRAPID\nGOTO/0,0,9\nFEDRAT/10\nGOTO/1,0,9\nRAPID\nGOTO/0,0,90\n";
    let two = |between: &str| {
        cuts_of(&format!("UNITS/MM\nLOADTL/1\nCUTTER/10,1\n{cut}{between}{cut}FINI\n"), Some(2)).map(|_| ())
    };
    assert_eq!(two("LOADTL/2\n"), Ok(()));
    assert_eq!(two("CUTTER/40,1.5\nLOADTL/2\n"), Ok(()));
    assert!(two("CUTTER/12,1\nLOADTL/2\n").unwrap_err().contains("diameter 12.000"));
    assert!(two("LOADTL/2\nCUTTER/12,1\n").unwrap_err().contains("diameter 12.000"));
}

#[test]
fn what_is_left_out_is_noted_once_with_its_first_line() {
    let cut = "RAPID\nGOTO/0,0,0\nFEDRAT/10\nGOTO/1,0,0\n";
    let text = format!(
        "CUTTER/40,1.5,18.5,1.5,0,0,30\n{cut}CUTCOM/LEFT\nCUTCOM/LEFT\nWOBBLE/3\nCYCLE/DRILL,RAPTO,2\nGOTO/5,5,0\nCYCLE/OFF\n"
    );
    let notes = cuts_of(&text, None).unwrap().notes.join("\n");
    assert!(!notes.contains("CUTTER"), "{notes}");
    for part in ["line 6: CUTCOM", "line 9: CYCLE", "WOBBLE (line 8)", "UNITS", "FINI"] {
        assert_eq!(notes.matches(part).count(), 1, "{part}: {notes}");
    }
}
