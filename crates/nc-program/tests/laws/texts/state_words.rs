//! Words that set the state of a control and its path mode: their blocks report them.

use facemill_nc_program::read::ReadCommand;
use facemill_nc_program::words::StateWord;
use facemill_nc_program::*;

/// Blocks report the statements of a text on a control's state, and nothing that it leaves out.
#[test]
fn state_words_are_reported_at_their_blocks() {
    let all = [
        StateWord::WorkOffset,
        StateWord::LengthRegister,
        StateWord::LengthOff,
        StateWord::RtcpOff,
        StateWord::RadiusOff,
        StateWord::Unit,
        StateWord::Distance,
        StateWord::FeedMode,
        StateWord::Return,
        StateWord::RadiusRegister,
    ];
    let [offset, register, length, rtcp, radius, unit, distance, feed, back, radius_register] = all;
    for (dialect, line, said) in [
        (Dialect::Fanuc, "G17 G21 G40 G49 G80 G90 G94", &[length, rtcp, radius, unit, distance, feed][..]),
        (Dialect::Fanuc, "G54 G0 G43 X1. H7", &[offset, register]),
        (Dialect::Fanuc, "G54.1 P3", &[offset]),
        (Dialect::Fanuc, "G1 X1. F100. D2", &[radius_register]),
        (Dialect::Mazak, "M99", &[back]),
        (Dialect::Haas, "G0 X1. Y2. (G54 G40)", &[]),
        (Dialect::LinuxCnc, "G49 G59.1", &[length, offset]),
        (Dialect::LinuxCnc, "M429", &[rtcp]),
        (Dialect::Siemens840d, "G710 G17 G40 G90 G94", &[radius, unit, distance, feed]),
        (Dialect::Siemens840d, "TRAFOOF D1 G505", &[rtcp, register, offset]),
        (Dialect::Siemens840d, "T7 M6 ; D1", &[]),
        (Dialect::Heidenhain, "0 BEGIN PGM A MM", &[unit]),
        (Dialect::Heidenhain, "1 FUNCTION RESET TCPM", &[rtcp]),
        (Dialect::Heidenhain, "2 M129", &[rtcp]),
        (Dialect::Heidenhain, "3 CYCL DEF 247 DATUM SETTING Q339=+1", &[offset]),
        (Dialect::Heidenhain, "4 L X+1 R0 FMAX", &[]),
    ] {
        let read = read_program(line, dialect).unwrap_or_else(|e| panic!("{line}: {e}"));
        let found: Vec<StateWord> = all.into_iter().filter(|w| read.blocks[0].said.has(*w)).collect();
        let said: Vec<StateWord> = all.into_iter().filter(|w| said.contains(w)).collect();
        assert_eq!(found, said, "{line}");
    }
}

/// Words that say how a path is kept stay with their own words, and with nothing else of the block.
#[test]
fn modes_of_fanuc_and_its_relatives_are_kept() {
    for (dialect, line, kept) in [
        (Dialect::LinuxCnc, "G17 G64 P0.01 Q.001", "G64 P0.01 Q.001"),
        (Dialect::LinuxCnc, "g64", "G64"),
        (Dialect::LinuxCnc, "G61.1 G0 X1.", "G61.1"),
        (Dialect::Fanuc, "G9 G1 X1. F100.", "G9"),
        (Dialect::Fanuc, "N7 G5.1 Q1", "G5.1 Q1"),
        (Dialect::Fanuc, "G5 P10000", "G5 P10000"),
        (Dialect::Haas, "G187 P3 E0.02", "G187 P3 E0.02"),
        (Dialect::Mazak, "G61.1", "G61.1"),
    ] {
        let read = read_program(line, dialect).unwrap();
        let modes: Vec<&str> = read.blocks[0]
            .commands
            .iter()
            .filter_map(|c| if let ReadCommand::Mode(text) = c { Some(text.as_str()) } else { None })
            .collect();
        assert_eq!(modes, [kept], "{line}");
    }
}
