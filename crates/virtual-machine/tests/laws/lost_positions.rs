//! Words and functions after which positions are not those that the text seems to say: each is
//! found, and the position behind it is unknown until the program names it.

use facemill_cl_data::Silent;
use facemill_nc_program::read::{MacroKind, ReadCommand};
use facemill_nc_program::{Dialect, read_program};
use facemill_virtual_machine::{FindingKind, VerifySettings, VirtualSetup, verify};

use crate::kit::Shop;

/// Returns the lines with findings of a program.
fn lines_found(text: &str, dialect: Dialect) -> Vec<u32> {
    let shop = Shop::new();
    let setup = shop.setup();
    let program = read_program(text, dialect).unwrap();
    let found = verify(&program, &setup, &VerifySettings::default(), &Silent).unwrap().findings;
    found.iter().flat_map(|f| f.first_line..=f.last_line).collect()
}

/// Checks that a program has a finding on this line, and without it none on the lines that follow
/// the same words.
fn is_found(text: &str, dialect: Dialect, line: u32, instead: &str) {
    let found = lines_found(text, dialect);
    assert!(found.contains(&line), "{text}: lines {found:?}");
    let harmless: Vec<&str> =
        text.lines().enumerate().map(|(k, l)| if k + 1 == line as usize { instead } else { l }).collect();
    let found = lines_found(&harmless.join("\n"), dialect);
    assert!(!found.contains(&line), "{harmless:?}: lines {found:?}");
}

/// Without X, Y and Z at right angles, words of the tip have no frame.
#[test]
fn words_of_the_tip_without_a_frame_lead_nowhere() {
    let shop = Shop::new();
    let unknown = |text: &str, table_from_rtcp_words| {
        let setup = VirtualSetup { table_from_rtcp_words, ..shop.setup() };
        let program = read_program(text, Dialect::Fanuc).unwrap();
        let found = verify(&program, &setup, &VerifySettings::default(), &Silent).unwrap().findings;
        found.iter().any(|f| f.kind == FindingKind::UnknownPosition && (f.first_line..=f.last_line).contains(&4))
    };
    let under = |code: &str| format!("G21 G90 G94 G54\nG0 X0. Y0. Z300. B0. C0.\n{code} H7\nG1 X10. Y0. Z300. F500.\n");
    let frame = shop.setup().table_from_rtcp_words;
    assert!(frame.is_some() && !unknown(&under("G43.4"), frame) && unknown(&under("G43.4"), None));
    assert!(!unknown(&under("G43"), None));
}

#[test]
fn the_point_that_a_return_goes_over_has_the_work_offset_of_its_words() {
    is_found("G90 G54\nG0 X0. Y0. Z800. B0. C0.\nG55\nG90 G28 Z750.\n", Dialect::Fanuc, 4, "G91 G28 Z0.");
}

#[test]
fn half_a_turn_to_the_reference_is_not_followed() {
    is_found("G90 G54\nG0 X0. Y0. Z800. B0. C0.\nG91 G28 C270.\n", Dialect::Fanuc, 3, "G91 G28 C27.");
}

#[test]
fn a_function_that_turns_the_tool_is_not_a_mode() {
    let text = "G90 G54\nG0 X0 Y0 Z800 B0 C0\nTRAORI\nORIRESET(90,45)\nG1 X1 F500\n";
    is_found(text, Dialect::Siemens840d, 4, "ORIWKS");
}

#[test]
fn a_second_transformation_is_not_the_first() {
    let is_followed = |transformation: &str| {
        let program = read_program(format!("G0 X0\n{transformation}\nG1 X1 F500\n"), Dialect::Siemens840d).unwrap();
        let is_open = |c: &ReadCommand| matches!(c, ReadCommand::Macro { kind: MacroKind::NotFollowed, .. });
        !program.blocks.iter().any(|block| block.commands.iter().any(is_open))
    };
    assert!(is_followed("TRAORI") && is_followed("TRAORI(1)") && !is_followed("TRAORI(2)"));
}

#[test]
fn a_position_of_the_machine_in_one_sense_is_not_followed() {
    is_found("G90 G54\nG0 X0 Y0 Z800 B0 C20\nSUPA G0 C=ACP(10) D0\n", Dialect::Siemens840d, 3, "SUPA G0 C=DC(10) D0");
}

#[test]
fn words_of_another_point_than_the_tip_are_not_followed() {
    let text = |point: &str| {
        format!(
            "BEGIN PGM A MM\nL X+0 Y+0 Z+800 B+0 C+0 R0 FMAX\nFUNCTION TCPM F TCP AXIS POS PATHCTRL AXIS{point}\n\
             L X+1 F500\nEND PGM A MM\n"
        )
    };
    let of = |point: &str| lines_found(&text(point), Dialect::Heidenhain).contains(&4);
    assert!(of(" REFPNT CENTER-CENTER") && of(" REFPNT TIP-CENTER"));
    assert_eq!(of(" REFPNT TIP-TIP"), of(""));
}

/// A cycle acts after the motion of its block: the motion is followed, and the axes are anywhere
/// after it.
#[test]
fn a_cycle_behind_a_motion_leaves_the_axes_anywhere() {
    let at = "X+0 Y+0 Z+800 B+0 C+0 R0 FMAX";
    let heidenhain = |behind: &str| format!("BEGIN PGM A MM\nL {at}\nL X+10 R0 FMAX{behind}\nL X+20 R0 FMAX\n");
    let siemens = |call: &str| format!("G90 G54\nG0 X0 Y0 Z800 B0 C0\n{call}\nG0 X10 Z800\nMCALL\nG0 X20\n");
    for (text, plain, line, dialect) in [
        (heidenhain(" M99"), heidenhain(""), 3, Dialect::Heidenhain),
        (heidenhain(" M89"), heidenhain(""), 3, Dialect::Heidenhain),
        (siemens("MCALL POCKET3(1)"), siemens("MCALL"), 4, Dialect::Siemens840d),
    ] {
        let found = |text: &str| {
            let shop = Shop::new();
            let program = read_program(text, dialect).unwrap();
            let v = verify(&program, &shop.setup(), &VerifySettings::default(), &Silent).unwrap();
            let all = v.findings.iter().flat_map(|f| (f.first_line..=f.last_line).map(|line| (line, f.kind)));
            all.collect::<Vec<_>>()
        };
        let (found, twin) = (found(&text), found(&plain));
        let of = |line: u32, kind| (line, kind);
        assert!(found.contains(&of(line, FindingKind::UnknownBlock)), "{text}: {found:?}");
        assert!(!found.contains(&of(line, FindingKind::UnknownPosition)), "{text}: {found:?}");
        let last = text.lines().count() as u32;
        assert!(found.contains(&of(last, FindingKind::UnknownPosition)), "{text}: {found:?}");
        assert!(!twin.contains(&of(last, FindingKind::UnknownPosition)), "{plain}: {twin:?}");
    }
}

/// Words of the point in a frame that is not followed lead nowhere, so nothing is run over it.
#[test]
fn a_return_is_not_run_over_a_point_in_a_frame_that_is_not_followed() {
    let beyond = |frame: &str| {
        let text = format!("G90 G54\nG0 X0. Y0. Z800. B0. C0.\n{frame}\nG28 X0. Y0. Z-99999. B0. C0.\n");
        let shop = Shop::new();
        let program = read_program(&text, Dialect::Fanuc).unwrap();
        let v = verify(&program, &shop.setup(), &VerifySettings::default(), &Silent).unwrap();
        let on_line = |kind| v.findings.iter().any(|f| f.kind == kind && (f.first_line..=f.last_line).contains(&4));
        [FindingKind::AxisLimit, FindingKind::UnknownBlock].map(on_line)
    };
    assert_eq!(beyond("G69"), [true, false]);
    assert_eq!(beyond("G68 X0. Y0. R30."), [false, true]);
}
