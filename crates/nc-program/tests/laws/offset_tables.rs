//! Work offsets as controls load them, read back by the tests alone.

use facemill_nc_program::dialect::PostFile;
use facemill_nc_program::*;
use facemill_test_kit::{linuxcnc_interpreter, run_linuxcnc};

use crate::kit::{AXES, Random};

fn axes(random: &mut Random) -> Vec<AxisSpec> {
    let axis = |letter: AxisLetter| AxisSpec {
        letter,
        min: -900.0,
        max: 900.0,
        along_spindle: false,
        work_offset: (random.between(-300.0, 300.0) * 1e3).round() / 1e3,
    };
    AXES.map(axis).to_vec()
}

fn settings(dialect: Dialect) -> PostSettings {
    let feed_mode = if dialect == Dialect::LinuxCnc { FeedMode::G93 } else { FeedMode::G94 };
    PostFile { dialect, feed_mode, ..PostFile::default() }.settings(None).unwrap()
}

/// The number behind a begin, up to the next blank, comma or parenthesis.
fn number_behind(text: &str, begin: &str) -> f64 {
    let at = text.find(begin).unwrap_or_else(|| panic!("{begin} in {text}")) + begin.len();
    let end = text[at..].find([' ', ',', ')', '\n']).map_or(text.len(), |end| at + end);
    text[at..end].parse().unwrap_or_else(|_| panic!("{begin} in {text}"))
}

#[test]
fn offsets_have_the_register_and_the_values_of_all_axes() {
    let mut random = Random(21);
    for (dialect, number, register) in [
        (Dialect::Fanuc, 2, "G10 L2 P2 "),
        (Dialect::Fanuc, 10, "G10 L20 P4 "),
        (Dialect::Haas, 105, "G10 L20 P99 "),
        (Dialect::Mazak, 6, "G10 L2 P6 "),
        (Dialect::LinuxCnc, 9, "G10 L2 P9 "),
        (Dialect::Siemens840d, 1, "$P_UIFR[1]=CTRANS("),
        (Dialect::Siemens840d, 5, "$P_UIFR[5]=CTRANS("),
    ] {
        let axes = axes(&mut random);
        let offset = WorkOffset::new(number).unwrap();
        let table = write_work_offset("part (1) - top", offset, &axes, &settings(dialect)).unwrap();
        let lines: Vec<&str> = table.text.lines().filter(|line| line.starts_with(register)).collect();
        assert_eq!(lines.len(), 1, "{dialect:?}\n{}", table.text);
        for axis in &axes {
            let comma = if dialect == Dialect::Siemens840d { "," } else { "" };
            let separator = if lines[0].contains(&format!("({}", axis.letter)) {
                "("
            } else if comma.is_empty() {
                " "
            } else {
                ","
            };
            let found = number_behind(lines[0], &format!("{separator}{}{comma}", axis.letter));
            assert_eq!(found, axis.work_offset, "{dialect:?} {}: {}", axis.letter, lines[0]);
        }
        assert_eq!(
            table.extension,
            if dialect == Dialect::Siemens840d { "spf".to_owned() } else { settings(dialect).extension().to_owned() }
        );
        if dialect == Dialect::Siemens840d {
            // Values are mm on a control that counts in inches, too.
            assert_eq!(table.text.lines().find(|line| !line.starts_with(';')), Some("G710"), "{}", table.text);
        }
        // Readers of the control understand it: it moves nothing.
        let read = read_program(&table.text, dialect).unwrap();
        assert_eq!(read.motions().count(), 0);
    }
    let far = WorkOffset::new(150).unwrap();
    let why = write_work_offset("part", far, &axes(&mut random), &settings(Dialect::Haas)).unwrap_err();
    assert!(why.to_string().contains("Haas"), "{why}");
}

#[test]
fn a_preset_has_rotary_axes_in_columns_of_their_own() {
    let axes = axes(&mut Random(22));
    let offset = WorkOffset::new(12).unwrap();
    let table = write_work_offset("top", offset, &axes, &settings(Dialect::Heidenhain)).unwrap();
    let [begin, head, row, end] = table.text.lines().collect::<Vec<_>>().try_into().unwrap();
    assert_eq!((begin, end), ("BEGIN PRESET.PR MM", "[END]"));
    let cell = |column: &str| {
        let at = format!(" {head} ").find(&format!(" {column} ")).unwrap_or_else(|| panic!("{column} in {head}"));
        row[at..].split(' ').next().unwrap().to_owned()
    };
    assert_eq!((cell("NO").as_str(), cell("DOC").as_str(), cell("SPA").as_str()), ("12", "TOP", "0."));
    for axis in &axes {
        let letter = axis.letter.to_string();
        let column = if ["X", "Y", "Z"].contains(&letter.as_str()) { letter } else { format!("{letter}_OFFS") };
        assert_eq!(cell(&column).parse::<f64>().unwrap(), axis.work_offset, "{column}");
    }
}

/// LinuxCNC has the values in its parameters, and no rotation, whatever was there before.
#[test]
fn linuxcnc_takes_offsets() {
    let Some(rs274) = linuxcnc_interpreter() else { return };
    let axes = axes(&mut Random(23));
    let table = write_work_offset("top", WorkOffset::new(3).unwrap(), &axes, &settings(Dialect::LinuxCnc)).unwrap();
    // Parameters of G56 from 5261 on: X, Y, Z, A, B, C, …, rotation at 5270.
    let print = "(DEBUG,AT X#5261 Y#5262 Z#5263 A#5264 B#5265 C#5266 R#5270)\nM2\n";
    let text = format!("G10 L2 P3 X1 Y2 Z3 R30\n{}", table.text.replace("M2\n", print));
    let (is_taken, printed) = run_linuxcnc(&rs274, &text, "T1 P1 Z1 D1\n", "offset-table");
    assert!(is_taken, "{printed}");
    let said = printed.lines().find(|line| line.contains("AT X")).unwrap_or_else(|| panic!("{printed}"));
    let said = said.replace(['"', ')'], " ");
    for axis in &axes {
        // Without a configuration its parameters are in inches.
        let unit = if ["X", "Y", "Z"].contains(&axis.letter.to_string().as_str()) { 25.4 } else { 1.0 };
        let found = unit * number_behind(&said, &format!(" {}", axis.letter));
        assert!((found - axis.work_offset).abs() < 1e-4, "{}: {said}", axis.letter);
    }
    assert_eq!(number_behind(&said, " R"), 0.0);
}
