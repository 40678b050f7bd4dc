//! Texts that the Heidenhain reader understands, refuses and keeps.

use facemill_nc_program::read::{
    AxisAt, CallKind, Compensation, Feed, MacroKind, MotionKind, ReadCommand, ReadMotion, ToolVectors, read_heidenhain,
};
use facemill_nc_program::*;

use crate::kit::{at, word};

fn read(text: &str) -> ReadProgram {
    read_heidenhain(text).unwrap_or_else(|e| panic!("{e}\n{text}"))
}

fn motions(text: &str) -> Vec<ReadMotion> {
    read(text).motions().map(|(_, m)| m.clone()).collect()
}

fn near(found: Option<AxisAt>, expected: f64) {
    let Some(AxisAt::Word(found)) = found else { panic!("{found:?} is not {expected}") };
    assert!((found - expected).abs() < 1e-9, "{found} {expected}");
}

fn kinds(text: &str) -> Vec<MacroKind> {
    let blocks = read(text).blocks;
    let of = |c: ReadCommand| if let ReadCommand::Macro { kind, .. } = c { Some(kind) } else { None };
    blocks.into_iter().flat_map(|b| b.commands).filter_map(of).collect()
}

#[test]
fn straight_moves_have_the_feed_in_force() {
    let m = motions("0 L X+10 Y-5,5 Z+,25 R0 FMAX M3\n1 L X+11 F1000\n2 L IX-1.5 Z.5\n3 L C+30 FMAX\n4 L C-30");
    use MotionKind::{Linear, Rapid};
    assert_eq!([0, 1, 2, 3, 4].map(|k| m[k].kind), [Rapid, Linear, Linear, Rapid, Linear]);
    assert_eq!([0, 1, 2, 4].map(|k| at(&m[k], "X")), [10.0, 11.0, 9.5, 9.5].map(word));
    assert_eq!((at(&m[4], "Y"), at(&m[4], "Z"), at(&m[4], "C")), (word(-5.5), word(0.5), word(-30.0)));
    let feeds = [0, 1, 2, 3, 4].map(|k| m[k].feed.map(|f| f.value));
    assert_eq!(feeds, [None, Some(1000.0), Some(1000.0), None, Some(1000.0)]);
    let m = motions("BEGIN PGM A INCH\nTOOL CALL 3 Z S100 F20\nL X+1 C+5 F AUTO\nL X+2 F100");
    assert_eq!((at(&m[0], "X"), at(&m[0], "C")), (word(25.4), word(5.0)));
    // Tenths of an inch a minute.
    for (k, expected) in [(0, 50.8), (1, 254.0)] {
        assert!((m[k].feed.unwrap().value - expected).abs() < 1e-9);
    }
    assert_eq!(m[0].compensation, Compensation::Length(3));
}

#[test]
fn the_tip_is_followed_between_m128_and_m129() {
    let text = "TOOL CALL 7 Z S100\nL X+0 Y+0 Z+9 A+0 C+0 FMAX\nL X+1 Y+1 Z+1 F500 M128 F2000\nL A+5\nL X+2 M129\n\
        L X+3\n\
                FUNCTION TCPM F CONT AXIS POS PATHCTRL AXIS\nL X+4 Y+1 Z+1\nFUNCTION RESET TCPM\nL X+5";
    let m = motions(text);
    use Compensation::{Length, Rtcp};
    let said: Vec<_> = m.iter().map(|m| m.compensation).collect();
    assert_eq!(said, [Length(7), Rtcp(7), Rtcp(7), Rtcp(7), Length(7), Rtcp(7), Length(7)]);
    assert_eq!(m[1].feed, Some(Feed { mode: FeedMode::Rtcp, value: 500.0 }), "the F behind M128 is its own");
    assert_eq!(m[5].feed.map(|f| f.mode), Some(FeedMode::G94), "F CONT");
    assert_eq!((at(&m[4], "Y"), at(&m[4], "C")), (None, word(0.0)));
}

#[test]
fn arguments_of_functions_are_no_targets() {
    let text = "L X+1 Z+5 F500 M118 Z1 W+0.5\nL X+2 M138 A C\nL X+3 M94 C M8\nL X+4 M140 MB MAX F750\n\
        L X+5 F600 M103 F0.5\nM120 LA5";
    let m = motions(text);
    assert_eq!([0, 1, 2, 3, 4].map(|k| at(&m[k], "X")), [1.0, 2.0, 3.0, 4.0, 5.0].map(word));
    assert_eq!((at(&m[0], "Z"), m[0].position.words().len(), m[2].position.words().len()), (word(5.0), 2, 2));
    let feeds = [0, 3, 4].map(|k| m[k].feed.map(|f| f.value));
    assert_eq!(feeds, [500.0, 500.0, 600.0].map(Some));
    assert_eq!(at(&m[4], "Z"), None, "M140 goes away along the tool");
}

#[test]
fn vectors_of_ln_are_kept() {
    let text = "L X+0 Y+0 Z+5 A+1 C+2 F100\nLN X+1 Y+2 Z+3 NX+0 NY-0.6 NZ+0.8 TX+0 TY+0 TZ+1\nLN X+4 NX+0 NY+0 NZ+1\n\
        L C+2 A+1\n\
                LN X+5 NX+0 NY+0 NZ+1";
    let m = motions(text);
    let vectors = |axis, normal| ToolVectors { axis, normal };
    assert_eq!(m[1].tool.as_deref(), Some(&vectors(Some([0.0, 0.0, 1.0]), Some([0.0, -0.6, 0.8]))));
    assert_eq!((at(&m[1], "A"), at(&m[1], "Z")), (None, word(3.0)));
    assert_eq!(m[2].tool.as_deref(), Some(&vectors(None, Some([0.0, 0.0, 1.0]))));
    assert_eq!((at(&m[4], "A"), kinds(text)), (word(1.0), vec![MacroKind::ToolVector]));
    // Further open questions are beside it.
    let open = [MacroKind::ToolVector, MacroKind::VariableWords];
    assert_eq!(kinds("L X+0 A+0 F9 M128\nLN X+Q1 NX+0 NY+0 NZ+1 TX+0 TY+0 TZ+1"), open);
    assert_eq!(kinds("L X+0 A+0 F9 M128\nLN X+1 NX+0 NY+0 NZ+1 TX+0 TY+0 TZ+Q2"), [MacroKind::VariableWords]);
    // Under TCPM the control keeps the tool along the normal.
    assert_eq!(kinds("L X+0 A+0 F9 M128\nLN X+5 NX+0 NY+0 NZ+1"), [MacroKind::VariableWords]);
}

#[test]
fn poles_radii_and_polar_words_lead_where_they_say() {
    let m = motions(
        "L X+70 Y+50 Z+5 F300\nCC X+50 Y+50\nC X+50 Y+70 DR+\nCR X+60 Y+60 R+20 DR- R0\nLP PR+20 PA+30\n\
        CP IPA+90 DR+ IZ-2\n\
         CC IX+5 IY+0\nLP IPR+1 IPA-10\nTOOL CALL 1 Y S1\nL X+0 Y+0 Z+0\nCC X+10 Z+20\nLP PR+5 PA+90",
    );
    let arc = |k: usize| **m[k].arc.as_ref().unwrap();
    assert_eq!((m[1].kind, arc(1).centre), (MotionKind::Arc { clockwise: false }, [Some(50.0), Some(50.0), None]));
    assert_eq!((m[2].kind, arc(2).r, arc(2).centre), (MotionKind::Arc { clockwise: true }, Some(20.0), [None; 3]));
    let (sin, cos) = 30f64.to_radians().sin_cos();
    near(at(&m[3], "X"), 50.0 + 20.0 * cos);
    near(at(&m[3], "Y"), 50.0 + 20.0 * sin);
    // A quarter further.
    near(at(&m[4], "X"), 50.0 - 20.0 * sin);
    near(at(&m[4], "Y"), 50.0 + 20.0 * cos);
    assert_eq!((at(&m[4], "Z"), arc(4).angle), (word(3.0), Some(90.0)));
    // From the new pole the tool is 5 mm to the left, with the radius of before and one more.
    near(at(&m[5], "X"), 55.0 - 20.0 * sin + 21.0 * 170f64.to_radians().cos());
    // In the plane across Y the angle begins at Z.
    near(at(&m[7], "X"), 15.0);
    near(at(&m[7], "Z"), 20.0);
    let lost = "L X+0 F9\nLP PR+5 PA+1";
    assert_eq!((at(&motions(lost)[1], "X"), kinds(lost)), (None, vec![MacroKind::VariableWords]));
}

#[test]
fn parameters_are_evaluated_until_a_label_or_call() {
    let x = |text: &str| at(motions(text).last().unwrap(), "X");
    for (text, expected) in [
        ("FN 0: Q1 = +5", 5.0),
        ("FN0:Q2=+4\nFN 1: Q1 = +Q2 + -6", -2.0),
        ("FN 2: Q1 = +8 - +1.5", 6.5),
        ("FN 3: Q1 = +2 * +3", 6.0),
        ("FN 4: Q1 = +7 DIV +2", 3.5),
        ("FN 5: Q1 = SQRT 16", 4.0),
        ("FN 6: Q1 = SIN 30", 0.5),
        ("FN 8: Q1 = +3 LEN +4", 5.0),
        ("FN 13: Q1 = +1 ANG -1", 135.0),
        ("Q1 = 2 + 3 * SQ 2", 14.0),
        ("QL5 = 2 ^ 3\nQ1 = - QL5 / ( 1 + 3 )", -2.0),
        ("CYCL DEF 200 DRILLING ~\n Q1=+9 ;DEPTH ~\n Q201=-5", 9.0),
    ] {
        near(x(&format!("{text}\nL X+Q1 F9")), expected);
        near(x(&format!("{text}\nL X-Q1 F9")), -expected);
        for behind in
            ["LBL 1", "CALL LBL 5", "FN 9: IF +Q1 EQU +Q77 GOTO LBL 7", "FN 18: SYSREAD Q1 = ID10", "Q1 = Q77"]
        {
            assert_eq!(x(&format!("{text}\n{behind}\nL X+Q1 F9")), None, "{behind}");
        }
    }
}

#[test]
fn cycles_and_calls_are_kept_with_their_arguments() {
    let text = "CYCL DEF 200 DRILLING ~\n  Q200=+2 ;SET-UP ~\n  Q201=-20 ;DEPTH\nL X+1 Y+1 FMAX M99\n\
        CYCL DEF 32.1 T0.01\n\
                CYCL DEF 7.1 X+5\nCYCL CALL POS X+1\nTCH PROBE 411 DATUM ~\n  Q321=+1\nCALL LBL \"A b\" REP 2\n\
                    CALL PGM X.H\nLBL 5\n\
                PLANE SPATIAL SPA+1 TURN FMAX\nPLANE RESET STAY\nCYCL DEF 444 NEW";
    let blocks = read(text).blocks;
    let of = |c: &ReadCommand| if let ReadCommand::Call(call) = c { Some((**call).clone()) } else { None };
    let found: Vec<_> = blocks.iter().flat_map(|b| &b.commands).filter_map(of).collect();
    let said: Vec<_> = found.iter().map(|c| (c.kind, &*c.name, &*c.arguments)).collect();
    use CallKind::{Arguments, Cycle, Defined, Definition, Label, Subprogram};
    let expected = [
        (Definition, "200", "DRILLING"),
        (Arguments, "200", "Q200=+2"),
        (Arguments, "200", "Q201=-20"),
        (Defined, "M99", ""),
        (Definition, "32", ".1 T0.01"),
        (Definition, "7", ".1 X+5"),
        (Defined, "CYCL CALL", "POS X+1"),
        (Cycle, "TCH PROBE 411", "411 DATUM"),
        (Arguments, "TCH PROBE 411", "Q321=+1"),
        (Subprogram, "LBL \"A b\"", "REP 2"),
        (Subprogram, "PGM X.H", ""),
        (Label, "LBL 5", ""),
        (Cycle, "PLANE SPATIAL", "SPA+1 TURN FMAX"),
        (Cycle, "PLANE RESET", "STAY"),
        (Cycle, "444", "NEW"),
    ];
    assert_eq!(said, expected);
    use MacroKind::{Call, CallBehind, Setting};
    assert_eq!(kinds(text), [CallBehind, Setting, Call, Call, Call, Call, Call, Call]);
    assert_eq!(blocks.len(), text.lines().count());
}

#[test]
fn other_words_are_kept_as_commands() {
    let text = "TOOL CALL \"Mill; 5\" Z S100\nTOOL DEF 6\nTOOL CALL 0 Z\nL M13\nSTOP M9\nM30\n\
        CYCL DEF 9.1 DWELL 0.5\nFN 16: F-PRINT A/B";
    let blocks = read(text).blocks;
    let commands: Vec<_> = blocks.into_iter().flat_map(|b| b.commands).collect();
    let is_plain = |c: &&ReadCommand| !matches!(c, ReadCommand::Call(_));
    let expected = [
        ReadCommand::ToolName("Mill; 5".to_owned()),
        ReadCommand::ToolChange,
        ReadCommand::SpindleSpeed(100.0),
        ReadCommand::NextTool(6),
        ReadCommand::Tool(0),
        ReadCommand::ToolChange,
        ReadCommand::SpindleOn { clockwise: true },
        ReadCommand::Coolant(Coolant::Flood),
        ReadCommand::Stop { optional: false },
        ReadCommand::Coolant(Coolant::Off),
        ReadCommand::End,
        ReadCommand::Dwell(0.5),
        ReadCommand::Macro { kind: MacroKind::Output, text: "FN 16: F-PRINT A/B".to_owned() },
    ];
    assert_eq!(commands.iter().filter(is_plain).cloned().collect::<Vec<_>>(), expected);
}

#[test]
fn machine_values_and_the_shorter_way_are_reported_where_the_text_says_them() {
    let m = motions(
        "L Z+0 C+5 FMAX M91\nTOOL CALL 1 Z\nL Z+0 X+1 FMAX M91\nL C+0 FMAX M126\nL C+170\nL C-170\nL C+10 M127",
    );
    assert_eq!((at(&m[0], "Z"), at(&m[0], "C")), (Some(AxisAt::Machine(0.0)), Some(AxisAt::Machine(5.0))));
    // The tool's length does not count there.
    assert_eq!((at(&m[1], "Z"), at(&m[1], "X")), (Some(AxisAt::Machine(0.0)), Some(AxisAt::Machine(1.0))));
    // From a machine value nobody knows the way, nor which of two ways it is beyond half a turn.
    assert_eq!([2, 3, 4, 5].map(|k| at(&m[k], "C")), [None, None, None, word(10.0)]);
    let m = motions("L C+0 FMAX\nL C+170 M126\nL C-170");
    assert_eq!([1, 2].map(|k| at(&m[k], "C")), [word(170.0), None]);
}

#[test]
fn machine_values_are_not_reported_where_the_frame_or_the_tip_counts() {
    let z = |before: &str| at(&motions(&format!("TOOL CALL 1 Z\n{before}\nL Z+5 B+3 FMAX M91"))[0], "Z");
    let known = Some(AxisAt::Machine(5.0));
    for before in ["PLANE RESET STAY", "M128\nM129", "FUNCTION TCPM F TCP AXIS POS PATHCTRL AXIS\nFUNCTION RESET TCPM"]
    {
        assert_eq!(z(before), known, "{before}");
    }
    assert_eq!(z("PLANE SPATIAL SPA+1 SPB+0 SPC+0 STAY\nPLANE RESET STAY"), known);
    for before in ["PLANE SPATIAL SPA+1 SPB+0 SPC+0 STAY", "CYCL DEF 19.1 A+5", "M128", "FUNCTION TCPM F TCP AXIS POS"]
    {
        assert_eq!(z(before), None, "{before}");
    }
    // A rotary axis goes to its programmed value under TCPM, too.
    let b = motions("TOOL CALL 1 Z\nM128\nL B+3 FMAX M91");
    assert_eq!(at(&b[0], "B"), Some(AxisAt::Machine(3.0)));
}

#[test]
fn a_reset_of_the_plane_that_stays_moves_nothing_and_gives_the_frame_back() {
    let text = |planes: &str| format!("L X+1 Z+5 B+2 FMAX\n{planes}\nL Y+1 FMAX");
    let x = |planes: &str| at(&motions(&text(planes))[1], "X");
    assert_eq!((x("PLANE RESET STAY"), kinds(&text("PLANE RESET STAY"))), (word(1.0), vec![]));
    // Words of the tilted frame are no words of the one behind it.
    let tilted = "PLANE SPATIAL SPA+1 SPB+0 SPC+0 STAY";
    assert_eq!((x(tilted), kinds(&text(tilted))), (None, vec![MacroKind::Setting]));
    let within = format!("{tilted}\nL X+4 FMAX\nPLANE RESET STAY");
    assert_eq!(at(&motions(&text(&within))[1], "X"), word(4.0));
    assert_eq!(at(&motions(&text(&within))[2], "X"), None);
    for turns in ["PLANE RESET TURN FMAX", "PLANE RESET MOVE DIST50 F1000", "PLANE RESET"] {
        assert_eq!((x(turns), kinds(&text(turns))), (None, vec![MacroKind::Call]), "{turns}");
    }
}

#[test]
fn the_preset_of_cycle_247_is_the_offset_of_the_words_behind_it() {
    let of = |text: &str| motions(&format!("L X+1 FMAX\n{text}\nL Y+1 FMAX"))[1].clone();
    for text in ["CYCL DEF 247 DATUM SETTING ~\n  Q339=+12 ;DATUM NUMBER", "CYCL DEF 247 DATUM SETTING Q339=+12"] {
        let m = of(text);
        assert_eq!((m.work_offset.number(), at(&m, "X")), (12, None), "{text}");
        assert_eq!(kinds(text), [], "{text}");
    }
    // The same again changes nothing.
    let m = of("CYCL DEF 247 DATUM SETTING Q339=+1");
    assert_eq!((m.work_offset.number(), at(&m, "X")), (1, word(1.0)));
    for text in
        ["CYCL DEF 247 DATUM SETTING", "CYCL DEF 247 DATUM SETTING ~\nQ339=+Q7", "CYCL DEF 247 DATUM SETTING Q339=+0"]
    {
        assert_eq!((kinds(text), at(&of(text), "X")), (vec![MacroKind::Setting], None), "{text}");
    }
}

#[test]
fn what_is_not_understood_is_refused_with_its_place() {
    for (text, expected) in [
        ("5 L X+1 E+5", "line 1, column 9: `E` is not understood"),
        ("LL X+1", "line 1, column 1: `LL` is not understood"),
        ("L X+1 X+2", "line 1, column 7: `X+2` occurs twice in the block"),
        ("L X+1 DR+", "line 1, column 7: `DR+` has no meaning in this block"),
        ("L X+", "line 1, column 3: `X+` has no valid number"),
        ("L X+1.2.3", "line 1, column 3: `X+1.2.3` has no valid number"),
        ("C X+1 Y+1", "line 1, column 1: `C` is not supported: an arc without its sense (DR+ or DR-)"),
        ("FN 99: Q1 = 5", "line 1, column 1: `FN` is not understood"),
        ("FN 1: Q1 = 5 + ", "line 1, column 15: `FN 1: Q1 = 5 +` is no valid expression"),
        ("Q1 = 5 5", "line 1, column 8: `Q1 = 5 5` is no valid expression"),
        ("TOOL CALL 5 Q", "line 1, column 13: `Q` is not understood"),
        ("CYCL DEF DRILL", "line 1, column 1: `CYCL DEF` has no valid number"),
        (
            "L X+5 ~\n Y+5",
            "line 1, column 1: `L X+5 ` is not supported: a block that goes on in the next line, other than of a cycle",
        ),
        ("L ?", "line 1, column 3: unexpected character '?'"),
    ] {
        assert_eq!(read_heidenhain(text).map(|_| ()).unwrap_err().to_string(), expected, "{text}");
    }
}
