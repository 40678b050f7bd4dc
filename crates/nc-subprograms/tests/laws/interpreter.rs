//! The interpreter of LinuxCNC runs a program with subprograms as the flat one, where it is
//! installed.

use facemill_nc_program::Dialect;
use facemill_nc_program::dialect::SubprogramPlace;
use facemill_nc_program::read_program;
use facemill_nc_subprograms::{SplitSettings, pass_sections, split};
use facemill_test_kit::{Random, linuxcnc_interpreter, run_linuxcnc_beside};

use crate::kit::{program, settings};

/// Canonical motions that the interpreter prints, without numbers of lines.
fn motions(printed: &str) -> Vec<String> {
    let behind = |line: &str| {
        ["STRAIGHT_FEED", "STRAIGHT_TRAVERSE", "SET_FEED_RATE", "SET_SPINDLE_SPEED"]
            .iter()
            .find_map(|word| line.find(word).map(|at| line[at..].to_owned()))
    };
    printed.lines().filter_map(behind).collect()
}

#[test]
fn linuxcnc_runs_the_same_motions_in_one_file_and_in_many() {
    let Some(rs274) = linuxcnc_interpreter() else { return };
    for (place, name) in [(SubprogramPlace::Program, "one"), (SubprogramPlace::Files, "many")] {
        let settings = settings(Dialect::LinuxCnc, place).expect("O words");
        let text = program(&mut Random(3), &settings);
        let (_, rule) = settings.subprograms().expect("subprograms");
        let sections = pass_sections(&read_program(&text, Dialect::LinuxCnc).expect("our program"));
        let split_settings = SplitSettings {
            dialect: Dialect::LinuxCnc,
            rules: settings.rules(),
            rule,
            first_number: rule.first_number,
            program_number: 1001,
            prefix: "PASS",
        };
        let made = split(&text, &sections, &split_settings).expect("subprograms");
        let [flat, called] =
            [(&text, &[][..], "flat"), (&made.main, &made.files[..], "called")].map(|(text, files, of)| {
                let table = "T7 P7 Z120 D40 ;mill\n";
                let name = format!("subprograms-{name}-{of}");
                let (is_taken, printed) = run_linuxcnc_beside(&rs274, text, files, table, &name);
                assert!(is_taken, "{printed}\n{text}");
                motions(&printed)
            });
        assert!(flat.len() > 30, "{flat:?}");
        assert_eq!(called, flat, "{name}");
    }
}
