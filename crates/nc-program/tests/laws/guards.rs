//! Checks that raise an alarm or go on are no branches; whatever may skip or repeat blocks is one.

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
        // What stands between may be skipped.
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
