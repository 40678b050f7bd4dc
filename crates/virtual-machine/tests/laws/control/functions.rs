//! Calls, jumps, tool changes and functions of the machine builder are faults on every control;
//! words that are known to do nothing are not.

use facemill_cl_data::Silent;
use facemill_nc_program::Dialect;
use facemill_nc_program::read_program;
use facemill_virtual_machine::verify;
use facemill_virtual_machine::{Finding, FindingKind, VerifySettings, VirtualSetup};

use super::left_unsaid::{FANUC, HEIDENHAIN, LINUXCNC, SIEMENS, shop};

const ALL: [(Dialect, &str); 6] = [
    (Dialect::Fanuc, FANUC),
    (Dialect::Haas, FANUC),
    (Dialect::Mazak, FANUC),
    (Dialect::LinuxCnc, LINUXCNC),
    (Dialect::Siemens840d, SIEMENS),
    (Dialect::Heidenhain, HEIDENHAIN),
];

/// The text for a control, with its words.
fn own_text(dialect: Dialect) -> String {
    let text = ALL.iter().find(|(d, _)| *d == dialect).map_or("", |(_, text)| *text);
    // Haas has its own word.
    if dialect == Dialect::Haas { text.replace("G43.4", "G234") } else { text.to_owned() }
}

/// The text with a line before the one that starts the spindle.
fn before_spindle(dialect: Dialect, line: &str) -> String {
    let text = own_text(dialect);
    let at = if dialect == Dialect::Heidenhain { "8 M3" } else { "S2000 M3" };
    assert_eq!(text.matches(at).count(), 1, "{text}");
    text.replace(at, &format!("{line}\n{at}"))
}

fn faults(text: &str, dialect: Dialect) -> Vec<Finding> {
    let shop = shop();
    let program = read_program(text, dialect).unwrap_or_else(|e| panic!("{e}\n{text}"));
    let length_register = if dialect == Dialect::Siemens840d { 1 } else { shop.tool.number() };
    let setup = VirtualSetup { length_register, ..shop.setup() };
    let v = verify(&program, &setup, &VerifySettings::default(), &Silent).unwrap();
    v.findings.into_iter().filter(|f| f.kind.is_fault()).collect()
}

#[test]
fn what_calls_jumps_or_changes_the_tool_is_a_fault_on_its_line() {
    use Dialect::{Fanuc, Haas, Heidenhain, LinuxCnc, Mazak, Siemens840d};
    for (dialect, codes) in [
        (Fanuc, &["M198 P1000", "M96 P1000", "M97", "M60", "M61", "M88", "M100"][..]),
        (Mazak, &["M198 P1000", "M96 P1000", "M97"]),
        (Haas, &["M198 P1000", "M96 P10 Q5", "M97 P1000", "M39", "M36", "M50", "M61", "M199"]),
        (LinuxCnc, &["M61 Q5", "M60", "M72", "M100", "M150 P1 Q2", "M199", "M62 P0", "M430", "(PY,x=1)", ";py,x"]),
        (Siemens840d, &["M70", "M88", "M98", "H5", "L100", "M140", "START(2)", "G77"]),
        (
            Heidenhain,
            &[
                "M94 C",
                "M97",
                "M98",
                "M101",
                "M112 T0.1",
                "M118 Z1",
                "M120 LA3",
                "M124 T0.1",
                "M138 C",
                "FUNCTION MODE MILL \"KIN2\"",
                "PRESET SELECT #2",
                "M143",
                "M104",
                "M88",
            ],
        ),
    ] {
        let before = faults(&own_text(dialect), dialect);
        for code in codes {
            let text = before_spindle(dialect, code);
            let line = text.lines().position(|l| l == *code).map(|k| k as u32 + 1);
            let after = faults(&text, dialect);
            let is_reported = after.iter().any(|f| {
                Some(f.first_line) == line
                    && matches!(f.kind, FindingKind::UnknownFunction | FindingKind::UnknownBlock | FindingKind::Branch)
            });
            assert!(is_reported && after.len() > before.len(), "{dialect:?} {code}: {after:?}");
        }
    }
}

#[test]
fn functions_that_the_dialect_file_says_are_harmless_are_silent() {
    for (dialect, _) in ALL {
        let before = faults(&own_text(dialect), dialect);
        let harmless = dialect.file().harmless_functions;
        assert!(!harmless.is_empty(), "{dialect:?}");
        for code in harmless {
            let after = faults(&before_spindle(dialect, &format!("M{code}")), dialect);
            assert_eq!(after.len(), before.len(), "{dialect:?} M{code}: {after:?}");
        }
    }
}

/// The word of the dialect file decides, and nothing else.
#[test]
fn a_function_is_harmless_where_the_program_is_read_with_it_in_the_list() {
    let shop = shop();
    let mut program = read_program(before_spindle(Dialect::Fanuc, "M88"), Dialect::Fanuc).unwrap();
    let count = |program: &_| {
        let setup = VirtualSetup { length_register: shop.tool.number(), ..shop.setup() };
        let v = verify(program, &setup, &VerifySettings::default(), &Silent).unwrap();
        v.findings.iter().filter(|f| f.kind == FindingKind::UnknownFunction).count()
    };
    assert_eq!(count(&program), 1);
    program.harmless_functions.push(88);
    assert_eq!(count(&program), 0);
}

#[test]
fn a_tool_length_of_siemens_that_no_d_selects_is_a_fault() {
    let kinds = |text: &str| -> Vec<FindingKind> {
        faults(text, Dialect::Siemens840d)
            .iter()
            .map(|f| f.kind)
            .filter(|k| *k == FindingKind::OtherLengthRegister)
            .collect()
    };
    let other = FindingKind::OtherLengthRegister;
    assert_eq!(kinds(SIEMENS), []);
    assert_eq!(kinds(&SIEMENS.replace("T7 M6\nD1", "T7 M6 D1")), []);
    assert_eq!(kinds(&SIEMENS.replace("T7 M6\nD1\n", "T7 M6\n")), [other]);
    assert_eq!(kinds(&SIEMENS.replace("T7 M6\nD1\n", "D1\nT7 M6\n")), [other]);
}

#[test]
fn a_check_of_another_length_than_the_tools_is_a_fault_on_its_line() {
    let length = shop().tool.gauge_length();
    for (dialect, check) in [
        (Dialect::Fanuc, "IF [ABS[#11007+#10007-LENGTH] LE 0.01] GOTO 9001\n#3000=1(LENGTH)\nN9001"),
        (Dialect::Mazak, "IF [ABS[#11007+#10007-LENGTH] LE 0.01] GOTO 9001\n#3000=1(LENGTH)\nN9001"),
        (Dialect::Haas, "IF [ABS[#2007+#2207-LENGTH] LE 0.01] GOTO 9001\n#3000=1(LENGTH)\nN9001"),
        (Dialect::LinuxCnc, "O100 IF [ABS[#5403-LENGTH] GT 0.01]\n(ABORT,LENGTH)\nO100 ENDIF"),
        (Dialect::Siemens840d, "IF ABS($P_TOOLL[1]-LENGTH)<=0.01 GOTOF OK\nSETAL(65000)\nM0\nOK:"),
        (
            Dialect::Heidenhain,
            "FN 2: Q99 = +Q114 - +LENGTH\nFN 3: Q99 = +Q99 * +Q99\nFN 12: IF +Q99 LT +0.0001 GOTO LBL 99\n\
             FN 14: ERROR = 1004\nM0\nLBL 99",
        ),
    ] {
        let of = |length: f64| {
            let text = before_spindle(dialect, &check.replace("LENGTH", &format!("{length:.3}")));
            let first = check.lines().next().unwrap().split("LENGTH").next().unwrap();
            let line = text.lines().position(|l| l.starts_with(first)).map(|k| k as u32 + 1);
            let found = faults(&text, dialect);
            let reported = found.iter().filter(|f| f.kind == FindingKind::OtherToolLength);
            reported.map(|f| Some(f.first_line) == line).collect::<Vec<_>>()
        };
        assert_eq!(of(length), [false; 0], "{dialect:?}");
        assert_eq!(of(length + 1.0), [true], "{dialect:?}");
    }
}
