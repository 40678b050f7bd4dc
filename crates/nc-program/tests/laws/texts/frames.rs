//! Words that set the frame of words are reported, and words that switch it off are silent.

use facemill_nc_program::read::{AxisAt, MacroKind, ReadCommand};
use facemill_nc_program::*;

/// Whether the last line sets something that words depend on, and whether X is still known behind
/// it, from a text that has moved to X5 in its frame before.
fn behind(dialect: Dialect, lines: &str) -> (bool, bool) {
    let [home, moved] = match dialect {
        Dialect::Heidenhain => ["L Y+1 R0 FMAX", "L Y+2 R0 FMAX"],
        _ => ["G90 G0 Y1.", "G0 Y2."],
    };
    let x = if dialect == Dialect::Heidenhain { "L X+5 R0 FMAX" } else { "G0 X5." };
    let program = read_program(format!("{home}\n{x}\n{lines}\n{moved}\n"), dialect).unwrap_or_else(|e| panic!("{e}"));
    let last = &program.blocks[program.blocks.len() - 2];
    let is_set = last.commands.iter().any(|c| matches!(c, ReadCommand::Macro { kind: MacroKind::Setting, .. }));
    // A mark of a block is one of the program, for all that hold on to it.
    assert!(!is_set || !program.is_evaluated(), "{lines}");
    let (_, motion) = program.motions().last().unwrap();
    (is_set, motion.position.get(AxisLetter::X).is_some())
}

const SET: [(Dialect, &str); 50] = [
    (Dialect::Fanuc, "G52 X10."),
    (Dialect::Fanuc, "G52 X0. Y1."),
    (Dialect::Fanuc, "G52 X#500"),
    (Dialect::Fanuc, "G52"),
    (Dialect::Fanuc, "G92 X0. Y0."),
    (Dialect::Fanuc, "G54.2 P1"),
    (Dialect::Fanuc, "G54.4 P2"),
    (Dialect::Fanuc, "G54.2"),
    (Dialect::Fanuc, "G54.2 P#500"),
    (Dialect::Fanuc, "G54.2 P0 X1."),
    (Dialect::Fanuc, "G54.2 P0 G52 X10."),
    (Dialect::Fanuc, "G50 X10."),
    (Dialect::Fanuc, "G69 X10. Y1."),
    (Dialect::Fanuc, "G11 X10."),
    (Dialect::Fanuc, "G13.1 X10."),
    (Dialect::Fanuc, "G15 X10. Y3."),
    (Dialect::Mazak, "G23 X10."),
    (Dialect::Fanuc, "G10 L2 P1 X10."),
    (Dialect::Fanuc, "G0 G50.1 X10."),
    (Dialect::Fanuc, "G28 G50.1 X0."),
    (Dialect::Fanuc, "G69 G50.1 X0."),
    (Dialect::Mazak, "G69.5 X10."),
    (Dialect::LinuxCnc, "G69 X10"),
    (Dialect::Mazak, "G54.4 P1"),
    (Dialect::Haas, "G52 Y3."),
    (Dialect::Mazak, "G52 Z-3."),
    (Dialect::LinuxCnc, "G92 X0"),
    (Dialect::LinuxCnc, "G52 X1"),
    (Dialect::LinuxCnc, "G92.3"),
    (Dialect::LinuxCnc, "G92.1 X3"),
    (Dialect::Siemens840d, "TRANS X10"),
    (Dialect::Siemens840d, "ATRANS Y=5"),
    (Dialect::Siemens840d, "ATRANS"),
    (Dialect::Siemens840d, "ROT RPL=45"),
    (Dialect::Siemens840d, "AROT X90"),
    (Dialect::Siemens840d, "MIRROR X0"),
    (Dialect::Siemens840d, "SCALE X2 Y2"),
    (Dialect::Siemens840d, "TOFRAME"),
    (Dialect::Heidenhain, "CYCL DEF 7.0 DATUM SHIFT X+5"),
    (Dialect::Heidenhain, "CYCL DEF 7.0 NULLPUNKT X +5"),
    (Dialect::Heidenhain, "CYCL DEF 8.0 MIRROR IMAGE X"),
    (Dialect::Heidenhain, "CYCL DEF 10.0 ROT+5"),
    (Dialect::Heidenhain, "CYCL DEF 7.0 #3"),
    (Dialect::Heidenhain, "CYCL DEF 7.0 DATUM SHIFT\nCYCL DEF 7.1 X+10"),
    (Dialect::Heidenhain, "CYCL DEF 7.0 DATUM SHIFT\nCYCL DEF 7.1 #3"),
    (Dialect::Heidenhain, "CYCL DEF 8.0 MIRROR IMAGE\nCYCL DEF 8.1 X"),
    (Dialect::Heidenhain, "CYCL DEF 10.0 ROTATION\nCYCL DEF 10.1 ROT+12.5"),
    (Dialect::Heidenhain, "CYCL DEF 11.0 SCALING\nCYCL DEF 11.1 SCL 0.9995"),
    (Dialect::Heidenhain, "CYCL DEF 26.0 AXIS-SPEC. SCALING\nCYCL DEF 26.1 X1 Y1.1"),
    (Dialect::Heidenhain, "TRANS DATUM AXIS X+10"),
];

const OFF: [(Dialect, &str); 30] = [
    (Dialect::Fanuc, "G52 X0. Y0. Z0."),
    (Dialect::Fanuc, "G69"),
    (Dialect::Fanuc, "G50"),
    (Dialect::Fanuc, "G50.1"),
    (Dialect::Fanuc, "G11"),
    (Dialect::Fanuc, "G13.1"),
    (Dialect::Fanuc, "G15 G80"),
    (Dialect::Mazak, "G23"),
    (Dialect::Fanuc, "G54.2 P0"),
    (Dialect::Fanuc, "N5 G54.4 P0 (OFF)"),
    (Dialect::Mazak, "G54.2 P0"),
    (Dialect::Mazak, "G54.4 P0."),
    (Dialect::Haas, "G52 X0"),
    (Dialect::Mazak, "G69.5"),
    (Dialect::LinuxCnc, "G92.1"),
    (Dialect::LinuxCnc, "G92.2"),
    (Dialect::LinuxCnc, "G52 X0 Y0"),
    (Dialect::Siemens840d, "TRANS"),
    (Dialect::Siemens840d, "N10 ROT ; off"),
    (Dialect::Siemens840d, "SCALE"),
    (Dialect::Siemens840d, "MIRROR"),
    (Dialect::Siemens840d, "TOROTOF"),
    (Dialect::Heidenhain, "CYCL DEF 7.0 DATUM SHIFT"),
    (Dialect::Heidenhain, "CYCL DEF 7.0 NULLPUNKT\nCYCL DEF 7.1 X+0\nCYCL DEF 7.2 Y +0,0"),
    (Dialect::Heidenhain, "CYCL DEF 8.0 MIRROR IMAGE\nCYCL DEF 8.1"),
    (Dialect::Heidenhain, "CYCL DEF 10.0 ROTATION\nCYCL DEF 10.1 ROT+0"),
    (Dialect::Heidenhain, "CYCL DEF 11.0 SCALING\nCYCL DEF 11.1 SCL 1"),
    (Dialect::Heidenhain, "CYCL DEF 26.0 AXIS-SPEC. SCALING\nCYCL DEF 26.1 X1 Y1 CCX+5 CCY+0"),
    (Dialect::Heidenhain, "TRANS DATUM RESET"),
    (Dialect::Heidenhain, "TRANS MIRROR RESET"),
];

/// Nothing that changes coordinates is passed in silence, and no number of the frame before is
/// taken for one of the new frame.
#[test]
fn words_that_set_a_frame_are_reported_and_positions_forgotten() {
    for (dialect, lines) in SET {
        assert_eq!(behind(dialect, lines), (true, false), "{}: {lines}", dialect.name());
    }
}

#[test]
fn what_switches_a_frame_off_is_silent_and_changes_nothing_where_none_was_set() {
    for (dialect, lines) in OFF {
        assert_eq!(behind(dialect, lines), (false, true), "{}: {lines}", dialect.name());
    }
}

/// Axis words that name what is switched off, or are shown, move nothing, and those of a motion
/// beside the same words do.
#[test]
fn axes_whose_mirror_ends_do_not_move() {
    for (dialect, line, x) in [
        (Dialect::Fanuc, "G50.1 X0. Y0.", 5.0),
        (Dialect::Haas, "N5 G50.1 X0.", 5.0),
        (Dialect::Mazak, "G50.1 X0. Y0. Z0.", 5.0),
        (Dialect::Haas, "G100 X0. Y0.", 5.0),
        (Dialect::Haas, "G102 X0. Y0.", 5.0),
        (Dialect::Fanuc, "G0 G40 G50 G69 G90 X0. Y0.", 0.0),
        (Dialect::Haas, "G69 G1 F9. X7.", 7.0),
        (Dialect::Fanuc, "G69 G53 X3.", 3.0),
        (Dialect::Fanuc, "G22 X9. Y9. Z9. I-9. J-9. K-9.", 5.0),
        (Dialect::Fanuc, "G15 G0 X7.", 7.0),
        (Dialect::Haas, "G40 G80 X7.", 7.0),
        (Dialect::Fanuc, "G97 S900 X7.", 7.0),
        (Dialect::Mazak, "G98 X7.", 7.0),
        (Dialect::LinuxCnc, "G99 X7.", 7.0),
    ] {
        let text = format!("G90 G0 X5. Y1.\n{line}\nG0 Z2.\n");
        let program = read_program(&text, dialect).unwrap_or_else(|e| panic!("{e}"));
        let moved = if x == 5.0 { 2 } else { 3 };
        assert_eq!(program.motions().count(), moved, "{}: {line}", dialect.name());
        let (_, last) = program.motions().last().unwrap();
        let at = last.position.get(AxisLetter::X);
        assert!(at == Some(AxisAt::Word(x)) || at == Some(AxisAt::Machine(x)), "{}: {line}: {at:?}", dialect.name());
    }
}

/// Speeds and tools of calls and settings are none of the spindle's.
#[test]
fn s_of_a_setting_and_words_of_a_macro_are_no_commands() {
    for (dialect, line, commands) in [
        (Dialect::Fanuc, "G97 S900", vec![ReadCommand::SpindleSpeed(900.0)]),
        (Dialect::Fanuc, "G92 S900", vec![]),
        (Dialect::Haas, "G65 P9010 S900 T5", vec![]),
        (Dialect::Fanuc, "G66 P9010 S900 T5", vec![]),
        (Dialect::Mazak, "M98 P9010 S900", vec![ReadCommand::SpindleSpeed(900.0)]),
    ] {
        let read = read_program(line, dialect).unwrap_or_else(|e| panic!("{line}: {e}"));
        let is_spindle_or_tool = |c: &&ReadCommand| matches!(c, ReadCommand::SpindleSpeed(_) | ReadCommand::Tool(_));
        let found: Vec<ReadCommand> = read.blocks[0].commands.iter().filter(is_spindle_or_tool).cloned().collect();
        assert_eq!(found, commands, "{line}");
    }
}

/// A return to the reference without axes takes all of them there, wherever that is, or none.
#[test]
fn a_reference_return_without_axes_leaves_no_place_known_where_it_moves_all() {
    for (dialect, line, is_known) in [
        (Dialect::Haas, "G28", false),
        (Dialect::Haas, "G91 G28", false),
        (Dialect::LinuxCnc, "G30", false),
        (Dialect::Fanuc, "G28", true),
        (Dialect::Haas, "G91 G28 Z0.\nG90", true),
    ] {
        assert_eq!(behind(dialect, line).1, is_known, "{}: {line}", dialect.name());
    }
}

/// Words from within a frame are other numbers behind it.
#[test]
fn words_of_a_frame_are_not_known_behind_it() {
    for (dialect, lines) in [
        (Dialect::Fanuc, "G52 X10.\nG0 X5.\nG52 X0."),
        (Dialect::Fanuc, "G54.2 P1\nG0 X5.\nG54.2 P0"),
        (Dialect::LinuxCnc, "G92 X10\nG0 X5\nG92.1"),
        (Dialect::Siemens840d, "TRANS X10\nG0 X5\nTRANS"),
        (Dialect::Heidenhain, "CYCL DEF 7.1 X+10\nL X+5 R0 FMAX\nCYCL DEF 7.1 X+0"),
    ] {
        assert_eq!(behind(dialect, lines), (false, false), "{}: {lines}", dialect.name());
    }
}
