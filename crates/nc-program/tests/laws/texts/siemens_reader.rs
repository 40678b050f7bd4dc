//! Texts that the Siemens reader understands, refuses and keeps.

use facemill_nc_program::read::{
    AxisAt, CallKind, Compensation, Feed, MacroKind, MotionKind, Plane, ReadCall, ReadCommand, ReadMotion, ToolVectors,
    read_siemens,
};
use facemill_nc_program::*;

use crate::kit::{at, word};

fn read(text: &str) -> ReadProgram {
    read_siemens(text).unwrap_or_else(|e| panic!("{e}\n{text}"))
}

fn motions(text: &str) -> Vec<ReadMotion> {
    read(text).motions().map(|(_, m)| m.clone()).collect()
}

fn kinds(text: &str) -> Vec<MacroKind> {
    let blocks = read(text).blocks;
    let of = |c: ReadCommand| if let ReadCommand::Macro { kind, .. } = c { Some(kind) } else { None };
    blocks.into_iter().flat_map(|b| b.commands).filter_map(of).collect()
}

fn calls(text: &str) -> Vec<ReadCall> {
    let blocks = read(text).blocks;
    let of = |c: ReadCommand| if let ReadCommand::Call(call) = c { Some(*call) } else { None };
    blocks.into_iter().flat_map(|b| b.commands).filter_map(of).collect()
}

#[test]
fn words_count_as_they_say() {
    let m = motions(
        "G90 G0 X10 Y=AC(2) Z1\nX=IC(5) Y=IC(-.5)\nG91 G1 X1 Y=AC(7) F100\nG90 X = 2*(3+4) Z=-SIN(30)\nG700\nX1 F2\n\
        G71 X1",
    );
    assert_eq!([0, 1, 2, 3, 4, 5].map(|k| at(&m[k], "X")), [10.0, 15.0, 16.0, 14.0, 25.4, 1.0].map(word));
    assert_eq!([0, 1, 2].map(|k| at(&m[k], "Y")), [2.0, 1.5, 7.0].map(word));
    let Some(AxisAt::Word(z)) = at(&m[3], "Z") else { panic!() };
    assert!((z + 0.5).abs() < 1e-15);
    assert_eq!(m[2].feed, Some(Feed { mode: FeedMode::G94, value: 100.0 }));
    assert_eq!(m[4].feed.map(|f| f.value), Some(50.8));
}

#[test]
fn angles_go_the_way_that_they_name() {
    let m = motions("G0 C350\nC=DC(10)\nC=ACN(5)\nC=ACP(4)\nC=AC(-30)\nC=IC(-1)");
    assert_eq!([0, 1, 2, 3, 4, 5].map(|k| at(&m[k], "C")), [350.0, 370.0, 365.0, 724.0, -30.0, -31.0].map(word));
    let lost = "G0 C=DC(10)";
    assert_eq!((at(&motions(lost)[0], "C"), kinds(lost)), (None, vec![MacroKind::VariableWords]));
}

#[test]
fn machine_values_are_the_axes_own_without_a_length_only() {
    let m = motions("SUPA G0 Z=610 D0\nSUPA X1 Z600 B5 D1\nTRAORI\nSUPA X7 C8\nTRAFOOF\nG153 X4");
    assert_eq!((at(&m[0], "Z"), m[0].compensation), (Some(AxisAt::Machine(610.0)), Compensation::Off));
    assert_eq!((at(&m[1], "X"), at(&m[1], "Z")), (Some(AxisAt::Machine(1.0)), None));
    assert_eq!((at(&m[2], "X"), at(&m[2], "C")), (None, Some(AxisAt::Machine(8.0))));
    assert_eq!((at(&m[3], "X"), m[3].compensation), (Some(AxisAt::Machine(4.0)), Compensation::Length(1)));
}

#[test]
fn tools_and_edges_are_the_compensation() {
    let text = "T=\"FACE;80\" M6\nG0 X1 Z1\nD0\nZ2\nD2 Z3\nTRAORI\nX1 Y1 Z1 A0 C0\nG1 X2 F500\nTRAFOOF\nZ4\nT5\nM6\nT0";
    let program = read(text);
    let said: Vec<_> = program.motions().map(|(_, m)| m.compensation).collect();
    use Compensation::{Length, Off, Rtcp};
    assert_eq!(said, [Length(1), Off, Length(2), Rtcp(2), Rtcp(2), Length(2)]);
    let feed = program.motions().nth(4).unwrap().1.feed;
    assert_eq!(feed, Some(Feed { mode: FeedMode::Rtcp, value: 500.0 }));
    let commands: Vec<_> = program.blocks.iter().flat_map(|b| b.commands.clone()).collect();
    let expected = [
        ReadCommand::ToolName("FACE;80".to_owned()),
        ReadCommand::ToolChange,
        ReadCommand::Tool(5),
        ReadCommand::ToolChange,
        ReadCommand::Tool(0),
    ];
    assert_eq!(commands, expected);
}

#[test]
fn arcs_keep_centres_radii_and_turns() {
    let m = motions(
        "G0 X0 Y0 Z0\nG2 X10 I5 J0 F9\nG3 X0 Y=5 CR=-7.5\nG2 I=AC(3) J=IC(1) TURN=2 Z-5\nG18 G3 X1 Z1 AR=90 K1",
    );
    let arc = |k: usize| **m[k].arc.as_ref().unwrap();
    assert_eq!((m[1].kind, arc(1).i, arc(1).j), (MotionKind::Arc { clockwise: true }, Some(5.0), Some(0.0)));
    assert_eq!(arc(2).r, Some(-7.5));
    assert_eq!((arc(3).centre, arc(3).i, arc(3).j, arc(3).turns), ([Some(3.0), None, None], None, Some(1.0), 2));
    assert_eq!((arc(4).plane, arc(4).angle, arc(4).k), (Plane::Zx, Some(90.0), Some(1.0)));
}

#[test]
fn vectors_are_kept_and_leave_the_rotary_axes_unknown() {
    let text = "TRAORI\nG0 X0 Y0 Z9 A1 C2\nG1 X1 A3=0 B3=-.1 C3=R1 F50\nX2 A3=0 B3=0.6 C3=0.8 A5=0 B5=0 C5=1\nX3 A4 C5";
    let m = motions(text);
    assert_eq!(m[1].tool.as_deref(), Some(&ToolVectors::default()), "C3 is not known");
    let vectors = ToolVectors { axis: Some([0.0, 0.6, 0.8]), normal: Some([0.0, 0.0, 1.0]) };
    assert_eq!(m[2].tool.as_deref(), Some(&vectors));
    assert_eq!((at(&m[2], "A"), at(&m[2], "X"), m[2].position.words().len()), (None, word(2.0), 3));
    assert_eq!((at(&m[3], "A"), at(&m[3], "C"), &m[3].tool), (word(4.0), word(5.0), &None));
    assert_eq!(kinds(text), [MacroKind::VariableWords, MacroKind::ToolVector]);
}

#[test]
fn cycles_and_subprograms_are_kept_with_their_arguments() {
    let text = "N5 CYCLE832(_tol, 1,\"a)b\")\nG0 X1 Y1 Z1\nCYCLE800()\nMCALL CYCLE83(10,0)\nG0 X3\nX4\nMCALL\n\
        MY_SUB(1, R2) P3\nL100\n\
                MCALL POCKET3(1)\nG0 X1 Y2\nX2\nMCALL\nCALL \"OTHER\"\nEXTCALL(\"FAR\")";
    let found = calls(text);
    let names: Vec<_> = found.iter().map(|c| (c.kind, &*c.name, &*c.arguments, c.is_modal)).collect();
    use CallKind::{Cycle, Subprogram};
    let expected = [
        (Cycle, "CYCLE832", "_tol, 1,\"a)b\"", false),
        (Cycle, "CYCLE800", "", false),
        (Cycle, "CYCLE83", "10,0", true),
        (Subprogram, "MY_SUB", "1, R2", false),
        (Subprogram, "L100", "", false),
        (Cycle, "POCKET3", "1", true),
        (Subprogram, "OTHER", "", false),
        (Subprogram, "FAR", "", false),
    ];
    assert_eq!(names, expected);
    let m = motions(text);
    assert_eq!(
        [0, 1, 2, 3].map(|k| m[k].kind),
        [MotionKind::Rapid, MotionKind::Cycle { code: 83 }, MotionKind::Cycle { code: 83 }, MotionKind::Rapid]
    );
    // Positions that the swivel cycle may have changed are unknown, and so is the effect of a cycle
    // behind each position.
    assert_eq!((at(&m[1], "X"), at(&m[1], "Y"), at(&m[4], "X"), at(&m[4], "Y")), (word(3.0), None, word(2.0), None));
    let calls = |kind| kinds(text).into_iter().filter(|k| *k == kind).count();
    assert_eq!(calls(MacroKind::Call), 1 + 2 + 2, "the tolerance cycle moves nothing");
    assert_eq!(calls(MacroKind::CallBehind), 2, "behind each position of MCALL");
}

#[test]
fn frames_make_words_unknown() {
    for frame in ["TRANS X5 Y0 Z0", "AROT Z90", "ROT Z30", "$P_UIFR[1,X,TR]=5", "G500", "TCARR=1", "G58 X5"] {
        let text = format!("G54 G0 X1 Y1\n{frame}\nG1 X2 F5");
        let m = motions(&text);
        assert_eq!((m.len(), at(&m[1], "Y")), (2, None), "{frame}");
        assert_eq!(kinds(&text), [MacroKind::Setting], "{frame}");
        assert!(!read(&text).is_evaluated(), "{frame}");
    }
    let m = motions("G54 G0 X1 Y1\nG54 X2\nG505 X3");
    assert_eq!((at(&m[1], "Y"), at(&m[2], "Y"), m[2].work_offset.number()), (word(1.0), None, 5));
}

#[test]
fn variables_are_evaluated_until_a_branch_or_a_call() {
    let x = |text: &str| at(motions(text).last().unwrap(), "X");
    assert_eq!(x("R1=5 R2=R1+1\nR3=R1*2\nG0 X=R3"), word(10.0));
    assert_eq!(x("R1=5\nR2=R1 G0 X=R2"), None, "assigned in the same block");
    assert_eq!(x("DEF REAL A_B, C_D=3\nG0 X=A_B+C_D"), word(3.0));
    for between in ["IF R9==1 GOTOF LAB", "LAB:", "SUB_P", "R1=R8", "WHILE R1<5", "M5\nREPEAT LAB P=2"] {
        assert_eq!(x(&format!("R1=5\n{between}\nG0 X=R1")), None, "{between}");
    }
    assert_eq!(x("R1=5\nCYCLE832()\nM5\nG0 X=R1"), word(5.0));
    assert_eq!(x("R1=5\n/R1=6\nG0 X=R1"), None, "a switch decides");
    assert_eq!(x("GOTOF N9\nR1=5\nN9 G0 X=R1"), None, "N9 is reached in two ways");
    assert!(read("R1=5\nG0 X=R1").is_evaluated());
    assert!(!read("G0 X=R1").is_evaluated());
}

/// Words of the control are no variables: those of feeds are kept unchanged, those that are not
/// followed are reported, and names that the control does not have stay variables.
#[test]
fn words_of_the_control_are_no_variables() {
    use MacroKind::{Assignment, Setting};
    for word in
        ["FB=50", "FD=1", "FZ=0.1", "SVC=90", "SVC[2]=90", "LIMS=500", "FMA[2,X]=5", "FRC=3", "FRCM=3", "OVRRAP=5"]
    {
        let text = format!("G1 X1 F5\nX2 {word}");
        let last = read(&text).blocks.pop().unwrap();
        assert_eq!(last.commands, [ReadCommand::Mode(word.to_owned())], "{word}");
        assert_eq!(last.motion.map(|m| at(&m, "X")), Some(crate::kit::word(2.0)), "{word}");
    }
    for word in
        ["OFFN=2", "FXS[X]=1", "FXST[X]=20", "STAT=1", "TU=2", "CUTMOD=1", "POLF[Z]=9", "SPP=2", "DISR=3", "fxs[x]=1"]
    {
        let text = format!("G0 X1 Y1\n{word}\nG0 Y2");
        assert_eq!(kinds(&text), [Setting], "{word}");
        assert_eq!(motions(&text).last().map(|m| at(m, "X")), Some(None), "{word}");
        assert!(!read(&text).is_evaluated(), "{word}");
    }
    for word in ["R1=5", "_FB=5", "FBX=5", "LIMS_MAX=5", "OFFN_1=5", "TOUCH=5"] {
        let text = format!("G0 X1 Y1\n{word}\nG0 Y2");
        assert_eq!(kinds(&text), [Assignment], "{word}");
        assert_eq!(motions(&text).last().map(|m| at(m, "X")), Some(crate::kit::word(1.0)), "{word}");
    }
}

#[test]
fn what_is_not_understood_is_refused_with_its_place() {
    for (text, expected) in [
        ("G0 X1\nG1 QX5 X2", "line 2, column 4: `QX5` is not understood"),
        ("N10 G0 X1 TRAORY", "line 1, column 11: `TRAORY` is not understood"),
        ("G0 X1 Q5", "line 1, column 7: `Q5` is not understood"),
        ("G0 X1.5.2", "line 1, column 4: `X1.5.2` has no valid number"),
        ("G0 X1 X2", "line 1, column 7: `X2` occurs twice in the block"),
        ("G0 X=(1+", "line 1, column 8: `X=(1+` is no valid expression"),
        ("G0 X=AC(1", "line 1, column 9: `X=AC(1` is no valid expression"),
        ("G0 *", "line 1, column 4: unexpected character '*'"),
        ("MSG(\"open)", "line 1, column 5: `\"OPEN)` is no valid expression"),
        ("G0 X1 I5", "line 1, column 7: `I5` has no meaning in this block"),
        ("T=\"A", "line 1, column 3: `\"A` is no valid expression"),
    ] {
        assert_eq!(read_siemens(text).map(|_| ()).unwrap_err().to_string(), expected, "{text}");
    }
}

#[test]
fn modes_are_kept_as_they_stand() {
    let text = "G64 COMPCAD Soft FGROUP(X, Y)\nG1 G601 X1 F5 OVR=50\nGROUP_BEGIN(0,\"Op; 1\",0,0)";
    let commands: Vec<_> = read(text).blocks.into_iter().flat_map(|b| b.commands).collect();
    let modes = ["G64", "COMPCAD", "Soft", "FGROUP(X, Y)", "G601", "OVR=50", "GROUP_BEGIN(0,\"Op; 1\",0,0)"];
    assert_eq!(commands, modes.map(|m| ReadCommand::Mode(m.to_owned())));
    assert!(read(text).is_evaluated());
    assert!(!read("GEOAX(1,X1)").is_evaluated());
}

#[test]
fn other_words_are_kept_as_commands() {
    let text =
        "S1000 M3 M8\nS2=500 M2=4\nG4 F1.5\nM1\nMSG(\"Text; here\")\nM88\nSPOS=90\nM17\n;note\nG74 Z1=0\nG75 FP=2 X=0";
    let commands: Vec<_> = read(text).blocks.into_iter().flat_map(|b| b.commands).collect();
    let expected = [
        ReadCommand::SpindleOn { clockwise: true },
        ReadCommand::Coolant(Coolant::Flood),
        ReadCommand::SpindleSpeed(1000.0),
        ReadCommand::Spindle(2),
        ReadCommand::SpindleOn { clockwise: false },
        ReadCommand::Spindle(2),
        ReadCommand::SpindleSpeed(500.0),
        ReadCommand::Dwell(1.5),
        ReadCommand::Stop { optional: true },
        ReadCommand::Comment("Text; here".to_owned()),
        ReadCommand::Function(88),
        ReadCommand::Function(19),
        ReadCommand::End,
        ReadCommand::Comment("note".to_owned()),
    ];
    assert_eq!(commands, expected);
    let m = motions(text);
    assert_eq!((at(&m[0], "Z1"), at(&m[1], "X")), (Some(AxisAt::Reference(1)), Some(AxisAt::Reference(2))));
}
