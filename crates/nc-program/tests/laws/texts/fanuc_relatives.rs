//! Codes of Haas, Mazak and LinuxCNC besides FANUC's.

use facemill_nc_program::read::{
    AxisAt, CallKind, Compensation, MotionKind, ReadCall, ReadCommand, ReadError, ReadMotion, read_fanuc, read_haas,
    read_linuxcnc, read_mazak,
};
use facemill_nc_program::*;

fn motions(read: Result<ReadProgram, ReadError>) -> Vec<ReadMotion> {
    read.unwrap_or_else(|e| panic!("{e}")).motions().map(|(_, m)| m.clone()).collect()
}

fn at(motion: &ReadMotion, axis: &str) -> Option<AxisAt> {
    motion.position.get(axis.parse().unwrap())
}

fn word(value: f64) -> Option<AxisAt> {
    Some(AxisAt::Word(value))
}

fn commands(read: Result<ReadProgram, ReadError>) -> Vec<ReadCommand> {
    read.unwrap_or_else(|e| panic!("{e}")).blocks.into_iter().flat_map(|b| b.commands).collect()
}

#[test]
fn haas_codes_are_understood_on_haas_alone() {
    let text = "G21 G0 G154 P7 X1. Y2.\nG187 P2 E0.05\nG234 H3 Z5.\nG1 X2. F10.\nG49\nG110 X1. Z1.\n\
        G13 I5. D1 F90. Q1. K9.\nX1. Y1.\nG153 X1. Z-1. R1.";
    let m = motions(read_haas(text));
    assert_eq!(m[0].work_offset, WorkOffset::new(13).unwrap());
    assert_eq!((m[1].compensation, m[2].feed.unwrap().mode), (Compensation::Rtcp(3), FeedMode::Rtcp));
    assert_eq!(m[3].work_offset, WorkOffset::new(7).unwrap());
    assert_eq!((m[4].feed.unwrap().value, at(&m[4], "Z")), (10.0, None), "F of the pocket is its own");
    assert_eq!(m[5].kind, MotionKind::Cycle { code: 153 });
    let calls = commands(read_haas("G13 I5. D1 F90.\nM97 P20 L3"));
    let call = |kind, name: &str, arguments: &str| {
        let (name, arguments) = (name.to_owned(), arguments.to_owned());
        ReadCommand::Call(Box::new(ReadCall { kind, name, arguments, is_modal: false }))
    };
    assert!(calls.contains(&call(CallKind::Cycle, "G13", "I5. D1 F90.")), "{calls:?}");
    assert!(calls.contains(&call(CallKind::Subprogram, "20", "L3")), "{calls:?}");
    for line in text.lines().filter(|l| l.contains("G1") && !l.starts_with("G1 ") || l.contains("G234")) {
        assert!(!read_fanuc(line).is_ok_and(|program| program.is_evaluated()), "{line}");
    }
}

#[test]
fn mazak_tools_are_distinguished() {
    let found = commands(read_mazak("T001T002M06\nT12.10\nM6"));
    let expected = [
        ReadCommand::ToolChange,
        ReadCommand::Tool(1),
        ReadCommand::NextTool(2),
        ReadCommand::ToolName("12.10".to_owned()),
        ReadCommand::ToolChange,
    ];
    assert_eq!(found, expected);
    assert!(read_fanuc("T1 T2 M6").is_err() && read_fanuc("T12.1").is_err());
    let m = motions(read_mazak("G54.1 P12 G0 X1. Y1.\nG61.1\nG54.2 P1\nG1 X2. F5."));
    assert_eq!((m[0].work_offset, at(&m[1], "Y")), (WorkOffset::new(18).unwrap(), None));
}

#[test]
fn linuxcnc_expressions_are_evaluated_where_they_are_known() {
    let m = motions(read_linuxcnc(
        "#1=5 #<A b>=[2*3]\ng0 x#1 y-#<ab> z[#1+#<ab>]\nx-sin[30]\n#1=6 x#1\nx#1\n#3=[10/0]\ng1 x1 f#3\nf#1\n\
        x2 y#99\no1 if [1]\nx#1",
    ));
    assert_eq!((at(&m[0], "X"), at(&m[0], "Y"), at(&m[0], "Z")), (word(5.0), word(-6.0), word(11.0)));
    let Some(AxisAt::Word(x)) = at(&m[1], "X") else { panic!() };
    assert!((x + 0.5).abs() < 1e-15);
    // In one block words have the values from before its assignments.
    assert_eq!((at(&m[2], "X"), at(&m[3], "X")), (word(5.0), word(6.0)));
    assert_eq!((m[4].feed, m[5].feed.map(|f| f.value)), (None, Some(6.0)));
    assert_eq!((at(&m[5], "X"), at(&m[5], "Y"), at(&m[6], "X")), (word(2.0), None, None));
}

#[test]
fn variables_that_a_switch_or_a_jump_may_have_changed_are_not_known() {
    let x = |text: &str| at(motions(read_fanuc(text)).last().unwrap(), "X");
    assert_eq!(x("#1=5.\nN3 G0 X#1"), word(5.0));
    assert_eq!(x("#1=5.\n/#1=6.\nG0 X#1"), None);
    assert_eq!(x("IF [#9 EQ 1] GOTO 3\n#1=5.\nN3 G0 X#1"), None);
    assert_eq!(x("#1=5.\nM98 P1\nG0 X#1"), None);
    assert_eq!(x("#1=5.\nG65 P1\nG0 X#1"), None);
    assert_eq!(x("#1=5.\n#[#9]=1.\nG0 X#1"), None);
}

#[test]
fn linuxcnc_codes_have_their_own_meaning() {
    let m = motions(read_linuxcnc(
        "g0 x0 y0\ng90.1 g2 x10 i5 j0 f9\ng91.1 g3 x0 i-5 j0 p3\ng59.2 g0 y1\ng38.2 z-5 f10\ng92.1\ng1 x1",
    ));
    let arc = |k: usize| **m[k].arc.as_ref().unwrap();
    assert_eq!((arc(1).i, arc(1).centre), (None, [Some(5.0), Some(0.0), None]));
    assert_eq!((arc(2).i, arc(2).turns), (Some(-5.0), 2));
    assert_eq!((m[3].work_offset.number(), at(&m[3], "X"), at(&m[4], "Y")), (8, None, None));
    assert_eq!(commands(read_linuxcnc("g4 p0.5")), [ReadCommand::Dwell(0.5)]);
    assert_eq!(read_linuxcnc("g1 x10 f5").unwrap().notes, [], "numbers need no point");
    let calls = commands(read_linuxcnc("o<my sub> call [1] [#2]"));
    assert!(
        matches!(&calls[0], ReadCommand::Call(c) if (&*c.name, &*c.arguments) == ("MYSUB", "[1][#2]")),
        "{calls:?}"
    );
    for (text, expected) in [
        ("g1 x[1+ f5", "line 1, column 9: `X[1+F5` is no valid expression"),
        ("g1 x1 #5", "line 1, column 8: `#5` is no valid expression"),
    ] {
        assert_eq!(read_linuxcnc(text).map(|_| ()).unwrap_err().to_string(), expected, "{text}");
    }
    // Controls have more kinds of variables than are read: kept, and nothing is known behind it.
    assert_eq!(at(&motions(read_linuxcnc("#2=1\n#1 5\ng0 x#2"))[0], "X"), None);
}

#[test]
fn kinematics_of_linuxcnc_switch_the_words_to_the_tip_and_back() {
    let text = "G43 H3\nG0 X1 Y2 Z3 B4\nM428\nG1 X5 Y6 Z7 F9\nG43 H4\nX8 Y9 Z1\nM429\nX1 Y1 Z1\nG49\nX2 Y2 Z2\nM428\n\
        X3 Y3 Z3\nG49\nX4 Y4 Z4\nM429\nX5 Y5 Z5";
    let m = motions(read_linuxcnc(text));
    use Compensation::{Length, Off, Rtcp};
    let said: Vec<Compensation> = m.iter().map(|m| m.compensation).collect();
    assert_eq!(said, [Length(3), Rtcp(3), Rtcp(4), Length(4), Off, Rtcp(0), Rtcp(0), Off]);
    assert_eq!(m[1].feed.unwrap().mode, FeedMode::Rtcp);
    // A rotary word stays; linear ones count otherwise behind the switch.
    let m = motions(read_linuxcnc("G43 H3\nG0 X1 Y2 Z3 B4\nM428\nX5\nM429\nY5"));
    assert_eq!((at(&m[1], "Y"), at(&m[1], "B"), at(&m[2], "X")), (None, word(4.0), None));
    // On other controls, and with another number, it is the machine builder's.
    assert_eq!(commands(read_fanuc("M428")), [ReadCommand::Function(428)]);
    assert_eq!(commands(read_linuxcnc("M430")), [ReadCommand::Function(430)]);
    assert_eq!(commands(read_linuxcnc("M428 M429")), []);
}

#[test]
fn a_program_tells_of_its_rapids_under_rtcp_what_the_dialect_file_says() {
    for dialect in Dialect::ALL {
        let file = dialect.file().motion.rtcp.expect("every dialect has RTCP").rapids;
        assert_eq!(read_program("M30\n", dialect).unwrap().rtcp_rapids, file, "{dialect:?}");
    }
}
