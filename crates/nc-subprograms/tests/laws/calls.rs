//! Calls that are followed, and those that stay as they are.

use facemill_nc_program::Dialect;
use facemill_nc_subprograms::{ExpandError, expand};

fn expanded(text: &str, dialect: Dialect, files: &[(&str, &str)]) -> Option<String> {
    let beside = |names: &[String]| {
        let own = files.iter().find(|(file, _)| names.iter().any(|n| n.eq_ignore_ascii_case(file)))?;
        Some((own.0.to_owned(), own.1.as_bytes().to_vec()))
    };
    let found = expand(text.as_bytes(), "main", dialect, &beside).expect("no fault");
    found.map(|found| String::from_utf8(found.text).expect("text"))
}

#[test]
fn calls_run_as_often_as_they_say() {
    let text = "%\nO1\nN1 M98 P2 L3\nM30\nO2 (SLOT)\nG1 X5.\nM99\n%\n";
    assert_eq!(expanded(text, Dialect::Fanuc, &[]).unwrap(), "%\nO1\nG1 X5.\nG1 X5.\nG1 X5.\nM30\n%\n");
    assert_eq!(expanded("M97P9\nM30\nN9 G1 X5.\nM99\n", Dialect::Haas, &[]).unwrap(), "N9 G1 X5.\nM30\n");
}

#[test]
fn subprograms_call_others_and_are_found_beside_the_program() {
    let sub = "%\nO0002\nG1 X1.\nM98 P3\nM99\n%\n";
    let files = [("o0002.NC", sub), ("3", "O3\nG1 X2.\nM99\n")];
    assert_eq!(expanded("O1\nM98 P2\nM30\n", Dialect::Fanuc, &files).unwrap(), "O1\nG1 X1.\nG1 X2.\nM30\n");
    let files = [("slot.spf", "PROC SLOT\nG1 X1\nRET\n")];
    assert_eq!(
        expanded("TRAFOOF\nN5 SLOT ; CALL\nM30\n", Dialect::Siemens840d, &files).unwrap(),
        "TRAFOOF\nG1 X1\nM30\n"
    );
    let files = [("SLOT.H", "0 BEGIN PGM SLOT MM\n1 L X+1\n2 END PGM SLOT MM\n")];
    let text = "0 BEGIN PGM A MM\n1 CALL PGM SLOT.H\n2 M30\n3 END PGM A MM\n";
    let flat = "0 BEGIN PGM A MM\n1 L X+1\n2 M30\n3 END PGM A MM\n";
    assert_eq!(expanded(text, Dialect::Heidenhain, &files).unwrap(), flat);
    let files = [("slot.ngc", "o<slot> sub\nG1 X1\no<slot> endsub\nM2\n")];
    assert_eq!(expanded("o<Slot> call\nM2\n", Dialect::LinuxCnc, &files).unwrap(), "G1 X1\nM2\n");
}

/// Each would do something else in place of the call, so a reader has to see the call.
#[test]
fn calls_that_depend_on_more_than_their_blocks_stay() {
    let stay = [
        (Dialect::Fanuc, "O1\nM98 P2\nM30\n"),
        (Dialect::Fanuc, "O1\nG1 X1. M98 P2\nM30\nO2\nG1 X5.\nM99\n"),
        (Dialect::Fanuc, "O1\n/M98 P2\nM30\nO2\nG1 X5.\nM99\n"),
        (Dialect::Fanuc, "O1\nM98 P2\nM30\nO2\nIF [#1 EQ 0] GOTO 5\nG1 X5.\nM99\n"),
        (Dialect::Fanuc, "O1\nM98 P2\nM30\nO2\nG1 X5.\nM30\nM99\n"),
        (Dialect::Fanuc, "O1\nM98 P2\nM30\nO2\nG1 X5.\nM99 P7\n"),
        // The first digits are repetitions.
        (Dialect::Fanuc, "O1\nM98 P30002\nM30\nO2\nG1 X5.\nM99\n"),
        (Dialect::LinuxCnc, "O100 SUB\nG1 X#1\nO100 ENDSUB\nO100 CALL\nM2\n"),
        (Dialect::LinuxCnc, "O100 SUB\nG1 X1\nO100 ENDSUB\nO100 CALL [3]\nM2\n"),
        (Dialect::Heidenhain, "0 BEGIN PGM A MM\n1 LBL 1\n2 L X+1\n3 LBL 0\n4 CALL LBL 1\n5 M30\n6 END PGM A MM\n"),
        (
            Dialect::Heidenhain,
            "0 BEGIN PGM A MM\n1 CALL LBL 1 REP 2\n2 M30\n3 LBL 1\n4 L X+1\n5 LBL 0\n6 END PGM A MM\n",
        ),
    ];
    for (dialect, text) in stay {
        assert_eq!(expanded(text, dialect, &[]), None, "{text}");
    }
    let saves = [("slot.spf", "PROC SLOT SAVE\nG91\nRET\n")];
    assert_eq!(expanded("SLOT\nM30\n", Dialect::Siemens840d, &saves), None);
}

#[test]
fn calls_without_end_are_refused_with_their_line() {
    let text = b"O1\nM98 P2\nM30\nO2\nG1 X5.\nM98 P2\nM99\n";
    let why = expand(text, "main.nc", Dialect::Fanuc, &|_| None).unwrap_err();
    assert_eq!(why, ExpandError::TooDeep { file: "main.nc".to_owned(), line: 6 });
    // Repetitions of repetitions end at a size.
    let long = format!("G1 X{}.\n", "1".repeat(400_000));
    let many = |n: u32| format!("O{n}\n{}M99\n", format!("M98 P{} L9999\n", n + 1).repeat(2));
    let text = format!("O1\nM98 P2\nM30\n{}{}O4\n{}M99\n", many(2), many(3), long);
    let why = expand(text.as_bytes(), "main.nc", Dialect::Fanuc, &|_| None).unwrap_err();
    assert!(matches!(why, ExpandError::TooLarge { .. }), "{why}");
}

/// Subprograms that end elsewhere than a return alone in its block, or not at all.
#[test]
fn calls_without_a_clear_end_stay() {
    let of = |calls: &str, sub: &str| format!("%\nO1\n{calls}\nM30\nO2\nG1 X5.\n{sub}O3\nG1 X6.\nM99\n%\n");
    assert!(expanded(&of("M98 P2", "M99\n"), Dialect::Fanuc, &[]).is_some());
    // The call would vanish.
    assert_eq!(expanded(&of("M98 P2 L0", "M99\n"), Dialect::Fanuc, &[]), None);
    for sub in ["", "%\n", "M30\n"] {
        assert_eq!(expanded(&of("M98 P2", sub), Dialect::Fanuc, &[]), None, "{sub}");
    }
    for end in ["G0 Z9. M2", "G0 Z9. M02", "X1 M 030", "M5 M30", "Z9. M99", "M#1", "M[2]"] {
        assert_eq!(expanded(&of("M98 P2", &format!("{end}\nM99\n")), Dialect::Fanuc, &[]), None, "{end}");
    }
    for word in ["M20", "M3 S200", "M230"] {
        assert!(expanded(&of("M98 P2", &format!("{word}\nM99\n")), Dialect::Fanuc, &[]).is_some(), "{word}");
    }
    let siemens = |sub: &str| expanded("SLOT\nM30\n", Dialect::Siemens840d, &[("SLOT.SPF", sub)]);
    assert!(siemens("G1 X1 M2=3\nM17\n").is_some());
    for sub in ["G1 X1 M17\nRET\n", "G1 X1 M=R1\nRET\n", "G1 X1\nG0 Z9 M2\nRET\n", "G1 X1\n"] {
        assert_eq!(siemens(sub), None, "{sub}");
    }
    let klartext = |line: &str| {
        format!("0 BEGIN PGM A MM\n1 CALL LBL 1\n2 M30\n3 LBL 1\n4 L X+1 {line}\n5 LBL 0\n6 END PGM A MM\n")
    };
    assert!(expanded(&klartext("FMAX M3"), Dialect::Heidenhain, &[]).is_some());
    for line in ["FMAX M30", "R0 M2", "M99"] {
        assert_eq!(expanded(&klartext(line), Dialect::Heidenhain, &[]), None, "{line}");
    }
}

/// Words of the control are no calls, whatever files are beside the program.
#[test]
fn words_of_siemens_are_no_names_of_files() {
    for word in ["G0", "M30", "T7", "TRAFOOF", "STOPRE", "SUPA", "RET", "ORIMKS ORIAXES", "G0X5", "SLOT A"] {
        let file = format!("{}.SPF", word.replace(' ', ""));
        let found = expanded(&format!("{word}\nM30\n"), Dialect::Siemens840d, &[(&file, "G1 X1\nRET\n")]);
        assert_eq!(found, None, "{word}");
    }
    for name in ["L123", "PASS_1001_1", "_N1"] {
        let file = format!("{name}.SPF");
        let found = expanded(&format!("{name}\nM30\n"), Dialect::Siemens840d, &[(&file, "G1 X1\nRET\n")]);
        assert_eq!(found.as_deref(), Some("G1 X1\nM30\n"), "{name}");
    }
}

/// The interpreter knows a subprogram from the line on that ends it.
#[test]
fn subprograms_of_linuxcnc_are_defined_before_their_call() {
    let sub = "O1 SUB\nG1 X1\nO1 ENDSUB\n";
    let linuxcnc = |text: &str| expanded(text, Dialect::LinuxCnc, &[]);
    assert_eq!(linuxcnc(&format!("{sub}O1 CALL\nM2\n")).as_deref(), Some("G1 X1\nM2\n"));
    assert_eq!(linuxcnc(&format!("O1 CALL\n{sub}M2\n")), None);
    let second = format!("O1 CALL\n{sub}O1 CALL\nM2\n");
    assert_eq!(linuxcnc(&second).as_deref(), Some("O1 CALL\nG1 X1\nM2\n"));
    // Within another one it counts where that is called.
    let outer = "O2 SUB\nO1 CALL\nO2 ENDSUB\n";
    assert_eq!(linuxcnc(&format!("{outer}{sub}O2 CALL\nM2\n")).as_deref(), Some("G1 X1\nM2\n"));
    // Lines behind the end do not run.
    assert_eq!(linuxcnc(&format!("{sub}O1 CALL\nM2\nO3 SUB\nO3 ENDSUB\nG1 X7\n")).as_deref(), Some("G1 X1\nM2\n"));
}

/// A called program runs only in the caller's unit, and from the caller's folder.
#[test]
fn programs_of_another_unit_or_folder_stay() {
    let text = |call: &str, unit: &str| format!("0 BEGIN PGM A {unit}\n1 CALL PGM {call}\n2 M30\n3 END PGM A {unit}\n");
    let run = |call: &str, unit: &str, of_file: &str| {
        let sub = format!("0 BEGIN PGM SAFE{of_file}\n1 L X+1\n2 END PGM SAFE{of_file}\n");
        expanded(&text(call, unit), Dialect::Heidenhain, &[("SAFE.H", &sub)]).is_some()
    };
    assert!(run("SAFE.H", "MM", " MM") && run("SAFE", "INCH", " INCH"));
    assert!(!run("SAFE.H", "MM", " INCH") && !run("SAFE.H", "INCH", " MM") && !run("SAFE.H", "MM", ""));
    for call in ["TNC:\\LIB\\SAFE.H", "LIB/SAFE.H", "..\\SAFE.H", "TNC:SAFE.H"] {
        assert!(!run(call, "MM", " MM"), "{call}");
    }
}

/// Repetitions within repetitions of nothing make no text, but would run for ever.
#[test]
fn repetitions_of_nothing_end_at_a_number_of_blocks() {
    let levels: String = (2..16).map(|n| format!("O{n}\nM98 P{} L9999\nM99\n", n + 1)).collect();
    let text = format!("O1\nM98 P2 L9999\nM30\n{levels}O16\nM99\n");
    let why = expand(text.as_bytes(), "main.nc", Dialect::Fanuc, &|_| None).unwrap_err();
    assert!(matches!(why, ExpandError::TooLong { line: 44, .. }), "{why}");
}

#[test]
fn files_are_sought_once_and_bounded_together() {
    let n_sought = std::cell::Cell::new(0);
    let beside = |_: &[String]| {
        n_sought.set(n_sought.get() + 1);
        None::<(String, Vec<u8>)>
    };
    let subs: String = (2..50).map(|n| format!("O{n}\nM98 P900\nM99\n")).collect();
    let calls: String = (2..50).map(|n| format!("M98 P{n}\n")).collect();
    let text = format!("O1\n{calls}{calls}M98 P900\nM30\n{subs}");
    let found = expand(text.as_bytes(), "main.nc", Dialect::Fanuc, &beside).expect("no fault").expect("calls");
    assert_eq!((found.n_calls, n_sought.get()), (96, 1));
    // Zeroes take no memory before they are touched.
    let file = |names: &[String]| {
        let is_large = names[0] == "O0003";
        Some((names[0].clone(), if is_large { vec![0; 1 << 28] } else { b"O2\nM99\n".to_vec() }))
    };
    let why = expand(b"O1\nM98 P2\nM98 P3\nM30\n", "main.nc", Dialect::Fanuc, &file).unwrap_err();
    assert_eq!(why, ExpandError::FilesTooLarge { file: "main.nc".to_owned(), line: 3 });
}

/// Any bytes are expanded or left, without a panic.
#[test]
fn any_text_is_taken() {
    let mut random = facemill_test_kit::Random(5);
    let parts: [&[u8]; 14] = [
        b"M98 P2\n",
        b"O2\n",
        b"M99\n",
        b"%\n",
        b"M30\n",
        b"O<A> SUB\n",
        b"O<A> CALL\n",
        b"O<A> ENDSUB\n",
        b"LBL 1\n",
        b"CALL LBL 1\n",
        b"LBL 0\n",
        b"\xff(\n",
        b"SLOT\n",
        b"N12",
    ];
    for _ in 0..300 {
        let text: Vec<u8> = (0..12).flat_map(|_| parts[random.below(parts.len())].to_vec()).collect();
        for dialect in Dialect::ALL {
            let _ =
                expand(&text, "main", dialect, &|_| Some(("slot".to_owned(), b"PROC SLOT\nM98 P2\nRET\n".to_vec())));
        }
    }
}

/// Numbers of an expanded program of Klartext count on; lines without a number, and all else, stay.
#[test]
fn lines_of_an_expanded_program_are_numbered_anew() {
    let text = b"0 BEGIN PGM A MM\n1 L X+1 F100\n17 L Y+2\n18 L Y+3\n; no number\n2 END PGM A MM\n";
    let expected = "0 BEGIN PGM A MM\n1 L X+1 F100\n2 L Y+2\n3 L Y+3\n; no number\n4 END PGM A MM\n";
    assert_eq!(String::from_utf8(facemill_nc_subprograms::renumbered(text)).unwrap(), expected);
    assert_eq!(facemill_nc_subprograms::renumbered(expected.as_bytes()), expected.as_bytes());
    assert_eq!(facemill_nc_subprograms::renumbered(b"5 A\r\n5 B"), b"5 A\r\n6 B");
}

/// A program has calls that are expanded only where a line may be one, by every control.
#[test]
fn lines_that_may_call_are_those_of_programs_with_calls() {
    use facemill_nc_program::Dialect;
    for (dialect, call, other) in [
        (Dialect::Fanuc, "N10 M98 P2 (SUB)", "N10 M98 P#1"),
        (Dialect::Haas, "M97 P100", "M99"),
        (Dialect::LinuxCnc, "o<pass_1> call", "o<pass_1> sub"),
        (Dialect::Siemens840d, "N7 PASS_1", "N7 TRAORI"),
        (Dialect::Heidenhain, "7 CALL LBL 101", "7 LBL 101"),
    ] {
        assert!(facemill_nc_subprograms::may_call(call.as_bytes(), dialect), "{call}");
        assert!(!facemill_nc_subprograms::may_call(other.as_bytes(), dialect), "{other}");
    }
}
