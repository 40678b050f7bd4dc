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
    let text = "0 BEGIN PGM A MM\n1 CALL PGM TNC:\\nc\\SLOT.H\n2 M30\n3 END PGM A MM\n";
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
