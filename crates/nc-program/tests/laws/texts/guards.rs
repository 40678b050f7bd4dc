//! Checks that raise an alarm or go on are no branches; whatever may skip or repeat blocks is one.

use facemill_nc_program::read::{AxisAt, LengthRelation, NoteKind};
use facemill_nc_program::*;

fn branches(text: &str, dialect: Dialect) -> usize {
    let read = read_program(text, dialect).unwrap();
    read.notes.iter().filter(|n| n.kind == NoteKind::Branch).map(|n| n.count).sum()
}

#[test]
fn words_of_linuxcnc_around_comments_guard_an_alarm() {
    let program = |check: &str| format!("G21 G90 G94 G54\nG43 H1\n{check}G1 X1. F100.\nM2\n");
    for (check, n) in [
        ("O100 IF [ABS[#5403-103.2] GT 0.01]\n(ABORT,WRONG LENGTH)\nO100 ENDIF\n", 0),
        ("o100 if [#5403 LT 1]\n(abort,x)\n\n(MSG,y)\no100 endif\n", 0),
        // The lines between may be skipped.
        ("O100 IF [#5403 GT 1]\nG1 X5. F100.\nO100 ENDIF\n", 2),
        ("O100 IF [#5403 GT 1]\n(ABORT,x)\nO100 ELSE\nG0 Z1.\nO100 ENDIF\n", 3),
        ("O100 IF [#5403 GT 1]\n(ABORT,x)\nO101 ENDIF\n", 2),
        ("O100 WHILE [#5403 GT 1]\n(x)\nO100 ENDWHILE\n", 2),
        ("O100 IF [#5403 GT 1]\n(ABORT,x)\n", 1),
    ] {
        assert_eq!(branches(&program(check), Dialect::LinuxCnc), n, "{check}");
    }
}

#[test]
fn a_jump_of_siemens_over_an_alarm_guards_it() {
    let program = |check: &str| format!("G54 G71 G90 G94\nD1\n{check}G1 X1. F100.\nM30\n");
    for (check, n) in [
        ("IF ABS($P_TOOLL[1]-103.2)<=0.01 GOTOF OK\nSETAL(65000)\nM0\nOK:\n", 0),
        ("N5 IF R1==2 GOTOF OK_1 ; comment\nN6 SETAL(65000)\nN7 OK_1: G0 Z5\n", 0),
        ("IF R1==2 GOTOF OK\nM0\nOK:\n", 1),
        ("IF R1==2 GOTOF OK\nSETAL(65000)\nG0 Z5\nOK:\n", 1),
        ("IF R1==2 GOTOB OK\nSETAL(65000)\nOK:\n", 2),
        ("GOTOF OK\nSETAL(65000)\nOK:\n", 2),
        ("SETAL(65000)\n", 1),
    ] {
        assert_eq!(branches(&program(check), Dialect::Siemens840d), n, "{check}");
    }
}

#[test]
fn a_jump_of_heidenhain_over_an_alarm_guards_it() {
    let program = |check: &str| format!("BEGIN PGM A MM\nTOOL CALL 7 Z S100\n{check}L X+1 F100\nM30\nEND PGM A MM\n");
    let jump = "FN 12: IF +Q99 LT +0.0001 GOTO LBL 99\n";
    for (check, n) in [
        ("; WRONG\nFN 14: ERROR = 1004\nM0\nLBL 99\n", 0),
        ("4 FN 14: ERROR=5\n5 STOP\n6 LBL 99 ; on\n", 0),
        ("FN14: ERROR=5\nLBL 99\n", 0),
        // The lines between may be skipped; a stop alone lets the program go on.
        ("M0\nLBL 99\n", 1),
        ("FN 14: ERROR=5\nL Z+5 FMAX\nLBL 99\n", 1),
        ("FN 14: ERROR=5\nM30\nLBL 99\n", 1),
        ("FN 14: ERROR=5\nLBL 98\n", 1),
        ("FN 14: ERROR=5\nFN 14: ERROR=6\nLBL 99\n", 2),
        ("", 1),
    ] {
        assert_eq!(branches(&program(&format!("{jump}{check}")), Dialect::Heidenhain), n, "{check}");
    }
    assert_eq!(branches(&program("FN 14: ERROR=5\n"), Dialect::Heidenhain), 1);
    // At its end the program is not known to jump anywhere.
    assert_eq!(branches("BEGIN PGM A MM\nFN 9: IF +Q1 EQU +2 GOTO LBL 7", Dialect::Heidenhain), 1);
    assert_eq!(branches("FN 9: IF +Q1 EQU +2 GOTO LBL 0\nFN 14: ERROR=5\nLBL 0", Dialect::Heidenhain), 2);
}

#[test]
fn a_branch_of_heidenhain_whose_values_say_that_it_does_not_jump_is_passed_by() {
    let after = |q: &str, branch: &str| {
        let text = format!("FN 0: {q}\nFN {branch} GOTO LBL 7\nL X+Q1 FMAX\nLBL 7\nM30\n");
        let program = read_program(&text, Dialect::Heidenhain).unwrap();
        let x = program.motions().next().and_then(|(_, m)| m.position.get(AxisLetter::X));
        (branches(&text, Dialect::Heidenhain), x)
    };
    let passed = (0, Some(AxisAt::Word(3.0)));
    for branch in ["9: IF +Q1 EQU +2", "10: IF +Q1 NE +3", "11: IF +Q1 GT +3", "12: IF +Q1 LT +Q1"] {
        assert_eq!(after("Q1 = +3", branch), passed, "{branch}");
    }
    let open = (1, None);
    for branch in ["9: IF +Q1 EQU +3", "10: IF +Q1 NE +2", "11: IF +Q1 GT +2", "12: IF +Q1 LT +4", "9: IF +Q5 EQU +2"] {
        assert_eq!(after("Q1 = +3", branch), open, "{branch}");
    }
    // The program has not set values that the control sets by itself, and FN 11 asks for no less.
    assert_eq!(after("Q114 = +3", "9: IF +Q114 EQU +2"), open);
    assert_eq!(after("Q1 = +3", "11: IF +Q1 LT +2"), open);
}

/// The tool has to be so long for the alarm not to be raised.
#[test]
fn a_bound_of_the_tool_length_that_guards_an_alarm_is_kept() {
    use LengthRelation::{AtLeast, AtMost, Less, More};
    let siemens = |check: &str| format!("G54 G71 G90 G94\nD1\n{check}G1 X1. F100.\nM30\n");
    let fanuc = |check: &str| format!("G21 G90 G94 G54\n{check}G1 X1. F100.\nM30\n");
    let heidenhain = |check: &str| format!("BEGIN PGM A MM\n{check}L X+1 F100\nM30\nEND PGM A MM\n");
    for (dialect, text, expected) in [
        (Dialect::Fanuc, fanuc("IF[#11002 GE 142.]GOTO 5\n#3000=1(SHORT)\nN5\n"), Some((142.0, AtLeast))),
        (Dialect::Haas, fanuc("IF [#2002 LT 142.] GOTO 5\n#3000=1(LONG)\nN5\n"), Some((142.0, Less))),
        (Dialect::Fanuc, fanuc("G20\nIF[#11002 LE 5.]GOTO 5\n#3000=1\nN5\nG21\n"), Some((127.0, AtMost))),
        (Dialect::LinuxCnc, fanuc("o1 if [#5403 LT 142]\n(ABORT,short)\no1 endif\n"), Some((142.0, AtLeast))),
        (Dialect::LinuxCnc, fanuc("o1 if [#5403 GE 142]\n(ABORT,long)\no1 endif\n"), Some((142.0, Less))),
        (Dialect::Siemens840d, siemens("IF $P_TOOLL[1]>142 GOTOF OK\nSETAL(65000)\nM0\nOK:\n"), Some((142.0, More))),
        (
            Dialect::Heidenhain,
            heidenhain("FN 11: IF +Q114 GT +142 GOTO LBL 99\nFN 14: ERROR=5\nLBL 99\n"),
            Some((142.0, More)),
        ),
        // A branch to anywhere else is reported as a branch.
        (Dialect::Fanuc, fanuc("IF[#11002 LT 142.]GOTO 900\nG1 Y5. F100.\nN900\n"), None),
    ] {
        let program = read_program(&text, dialect).unwrap();
        let bounds: Vec<_> = program.tool_lengths.iter().map(|n| (n.length, n.relation)).collect();
        assert_eq!(bounds, Vec::from_iter(expected), "{dialect:?} {text}");
        assert_eq!(branches(&text, dialect), usize::from(expected.is_none()), "{text}");
        assert_eq!(program.tool_length(), None);
    }
}
