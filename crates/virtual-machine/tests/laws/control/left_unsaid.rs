//! Statements that programs lack, states that they leave on, and their ends: each beside its twin
//! that has it.

use facemill_cl_data::Silent;
use facemill_inverse_kinematics::Machine;
use facemill_inverse_kinematics::machine_file::{CuttingLawFile, RapidLawFile};
use facemill_nc_program::Dialect;
use facemill_nc_program::read_program;
use facemill_virtual_machine::assumptions;
use facemill_virtual_machine::verify;
use facemill_virtual_machine::{FindingKind, VerifySettings, VirtualSetup};

use crate::kit::Shop;

/// A shop whose control may leave the path by 0.01 mm and 0.005 deg.
pub(super) fn shop() -> Shop {
    let mut file = Machine::head_b_table_c().unwrap().to_file();
    file.motion.cutting = CuttingLawFile::TipAndRotariesLinear;
    file.motion.rapid = RapidLawFile::Linear;
    file.motion.control_tolerance.path_mm = 0.01;
    file.motion.control_tolerance.orientation_deg = 0.005;
    Shop::with_machine(Machine::from_file(file).unwrap())
}

pub(super) const SIEMENS: &str = "\
G710 G17 G40 G90 G94\nTRAFOOF\nRTLION\nG0 SUPA Z3000. D0\nG0 SUPA X0. Y0. D0\nG0 SUPA B0. C0. D0\nT7 M6\nD1\nG54\nS2000 M3\n\
G0 B0. C0.\nTRAORI\nORIMKS ORIAXES\nFGROUP(X,Y,Z)\nG0 X0. Y0. Z900.\nCYCLE832(0.0100,11,0.0050)\nG0 X0. Y0. Z200. B1. C1.\n\
G1 X1. B2. C2. F500.\nX2. B3.\nCYCLE832(0,0,1)\nM5\nTRAFOOF\nG0 SUPA Z3000. D0\nM30\n";

pub(super) const HEIDENHAIN: &str = "\
0 BEGIN PGM A MM\n1 FUNCTION RESET TCPM\n2 PLANE RESET STAY\n3 L Z+3000 R0 FMAX M91\n4 L X+0 Y+0 R0 FMAX M91\n\
5 L B+0 C+0 R0 FMAX M91\n6 TOOL CALL 7 Z S2000\n7 CYCL DEF 247 DATUM SETTING Q339=+1\n8 M3\n9 L B+0 C+0 R0 FMAX\n\
10 FUNCTION TCPM F TCP AXIS POS PATHCTRL AXIS\n11 L X+0 Y+0 Z+900 R0 FMAX\n12 CYCL DEF 32.0 TOLERANCE\n\
13 CYCL DEF 32.1 T0.0100\n14 CYCL DEF 32.2 HSC-MODE:0 TA0.0050\n15 L X+0 Y+0 Z+200 B+10 C+5 R0 FMAX\n\
16 LN X+1 Y+0 Z+200 NX+0 NY+0 NZ+1 TX+0.173648 TY+0 TZ+0.984808 F500\n17 M5\n18 FUNCTION RESET TCPM\n\
19 L Z+2000 R0 FMAX\n20 M30\n21 END PGM A MM\n";

pub(super) const LINUXCNC: &str = "\
G17 G21 G40 G49 G80 G90 G94\nM429\nG53 G0 Z3000.\nG53 G0 X0. Y0.\nG53 G0 B0. C0.\nT7 M6\nG43 H7\nG54\nS2000 M3\n\
G0 B0. C0.\nM428\nG0 X0. Y0. Z900.\nG64 P0.0100 Q0.0001\nG1 X1. Y0. Z880. B1. F500.\nM5\nM429\nG53 G0 Z3000.\nG49\nM2\n";

pub(super) const FANUC: &str = "\
%\nO1\nG17 G21 G40 G80 G90 G94\nG91 G28 Z0.\nG49\nG91 G28 X0. Y0.\nG91 G28 B0. C0.\nG90\nT7 M6\nG54\nS2000 M3\n\
G0 G90 B0. C0.\nG0 G90 G43.4 X0. Y0. Z900. H7\nG1 X1. Z880. B1. F500.\nM5\nG91 G28 Z0.\nG49\nG91 G28 X0. Y0.\n\
G91 G28 B0. C0.\nG90\nM30\n%\n";

const M6: &str = "M6 is taken to leave all axes where they are";

const TOOL_CALL: &str = "TOOL CALL is taken to leave all axes where they are";

/// Texts of all assumptions.
fn rests_on(text: &str, dialect: Dialect) -> Vec<String> {
    let program = read_program(text, dialect).unwrap_or_else(|e| panic!("{e}\n{text}"));
    let all = assumptions(&program, &shop().machine);
    assert!(all.is_sorted() && all.iter().all(|a| a.line.is_none_or(|n| n > 0)), "{all:?}");
    all.into_iter().map(|a| a.text).collect()
}

/// Kinds and lines of what is about smoothing, vectors, RTCP and the end.
fn found(text: &str, dialect: Dialect) -> Vec<(FindingKind, u32)> {
    use FindingKind::{NoEnd, NotUnitVector, OtherMotion, RtcpLeftOn};
    let shop = shop();
    let program = read_program(text, dialect).unwrap_or_else(|e| panic!("{e}\n{text}"));
    let length_register = if dialect == Dialect::Siemens840d { 1 } else { shop.tool.number() };
    let setup = VirtualSetup { length_register, ..shop.setup() };
    let settings = VerifySettings { is_whole: true, ..VerifySettings::default() };
    let v = verify(&program, &setup, &settings, &Silent).unwrap();
    let reports = v.findings.iter().filter(|f| matches!(f.kind, NoEnd | NotUnitVector | OtherMotion | RtcpLeftOn));
    reports.map(|f| (f.kind, f.first_line)).collect()
}

/// The text with one place changed, which must be there once.
fn with(text: &str, from: &str, to: &str) -> String {
    assert_eq!(text.matches(from).count(), 1, "{from} in\n{text}");
    text.replace(from, to)
}

/// Each removed word is reported, and nothing else changes.
#[test]
fn unstated_data_is_reported_and_stated_data_is_not() {
    let (siemens, heidenhain) = (Dialect::Siemens840d, Dialect::Heidenhain);
    let (linuxcnc, fanuc) = (Dialect::LinuxCnc, Dialect::Fanuc);
    let m91 = "M91 is taken to count without the tool's length";
    let m428 = "M428 is taken to switch to kinematics of the tip, and M429 to those of the joints";
    assert_eq!(rests_on(SIEMENS, siemens), [M6]);
    assert_eq!(rests_on(&with(HEIDENHAIN, "19 L Z+2000 R0 FMAX\n", ""), heidenhain), [TOOL_CALL]);
    let home = with(HEIDENHAIN, "19 L Z+2000 R0 FMAX\n", "19 L Z+3000 R0 FMAX M91\n");
    assert_eq!(rests_on(&home, heidenhain), [TOOL_CALL, m91]);
    assert_eq!(rests_on(LINUXCNC, linuxcnc), [M6, m428]);
    let of_fanuc = rests_on(FANUC, fanuc);
    assert!(of_fanuc.len() == 4 && of_fanuc[0].starts_with("a setting of the control says how rapids go"));
    assert!(of_fanuc.iter().any(|t| t.starts_with("the control's settings say how far a cut")), "{of_fanuc:?}");
    assert!(of_fanuc.iter().any(|t| t.starts_with("no word of this control says how the tool turns")), "{of_fanuc:?}");
    for (dialect, text, from, to, reports) in [
        (siemens, SIEMENS, "CYCLE832(0.0100,11,0.0050)\n", "", "no CYCLE832, ADIS, G60 or G9"),
        (siemens, SIEMENS, "CYCLE832(0.0100,11,0.0050)\n", "G641\n", "G641 without ADIS"),
        (siemens, SIEMENS, "CYCLE832(0.0100,11,0.0050)\n", "G641 ADIS=0.005\n", "G641 with ADIS does not say"),
        (
            siemens,
            SIEMENS,
            "CYCLE832(0.0100,11,0.0050)\n",
            "G642 ADIS=0.005\n",
            "G642 rounds corners as machine data say",
        ),
        (siemens, SIEMENS, "CYCLE832(0.0100,11,0.0050)\n", "CYCLE832(5,0,1)\n", "no CYCLE832, ADIS"),
        (siemens, SIEMENS, "CYCLE832(0.0100,11,0.0050)\n", "CYCLE832(0.01,_OFF,1)\n", "no CYCLE832, ADIS"),
        (
            siemens,
            SIEMENS,
            "CYCLE832(0.0100,11,0.0050)\n",
            "CYCLE832(0.01,11)\n",
            "CYCLE832 without a tolerance of the",
        ),
        (siemens, SIEMENS, "CYCLE832(0.0100,11,0.0050)\n", "CYCLE832(0.01,11,0.005)\nG64\n", "no CYCLE832, ADIS"),
        (siemens, SIEMENS, " ORIAXES", "", "no ORIAXES or ORIVECT"),
        (siemens, SIEMENS, "ORIMKS ", "ORIWKS ", "ORIMKS or ORIWKS says another turn"),
        (siemens, SIEMENS, "RTLION\n", "", "no RTLION: rapids under TRAORI"),
        (siemens, SIEMENS, "FGROUP(X,Y,Z)\n", "", "no FGROUP: F is taken as the speed of the tip"),
        (
            siemens,
            SIEMENS,
            "FGROUP(X,Y,Z)\n",
            "FGROUP(X,Y,Z)\nFGROUP()\n",
            "FGROUP() leaves to machine data which axes F counts: F is taken as the speed of the tip",
        ),
        (siemens, SIEMENS, "G54\n", "", "no work offset is selected: G54"),
        (siemens, SIEMENS, "TRAFOOF\nRTLION", "RTLION", "no TRAFOOF"),
        (siemens, SIEMENS, "G40 ", "", "no G40"),
        (siemens, SIEMENS, "G710 ", "", "no unit is said"),
        (fanuc, FANUC, " G94", "", "neither G93 nor G94"),
        (linuxcnc, LINUXCNC, " G90", "", "neither G90 nor G91"),
        (siemens, SIEMENS, "G0 SUPA X0. Y0. D0\n", "", "X Y not sent home before"),
        (siemens, SIEMENS, "M5\n", "", "the spindle is on where the program ends"),
        (heidenhain, HEIDENHAIN, "13 CYCL DEF 32.1 T0.0100\n", "", "no cycle 32"),
        (heidenhain, HEIDENHAIN, " TA0.0050", "", "cycle 32 without TA"),
        (heidenhain, HEIDENHAIN, " PATHCTRL AXIS", "", "no PATHCTRL"),
        (heidenhain, HEIDENHAIN, "FUNCTION TCPM F TCP AXIS POS PATHCTRL AXIS", "M128", "no PATHCTRL"),
        (heidenhain, HEIDENHAIN, "2 PLANE RESET STAY\n", "", "no PLANE RESET"),
        (heidenhain, HEIDENHAIN, "7 CYCL DEF 247 DATUM SETTING Q339=+1\n", "", "no preset is selected (cycle 247)"),
        (heidenhain, HEIDENHAIN, "1 FUNCTION RESET TCPM\n", "", "no FUNCTION RESET TCPM or M129"),
        (linuxcnc, LINUXCNC, "G64 P0.0100 Q0.0001\n", "", "no G64 P or G61"),
        (linuxcnc, LINUXCNC, " G49 G80", "", "no G49"),
        (linuxcnc, LINUXCNC, "M429\nG53 G0 Z3000.\nG53 G0 X", "G53 G0 Z3000.\nG53 G0 X", "no M429"),
        (
            fanuc,
            FANUC,
            "Z0.\nG49\nG91 G28 X0. Y0.\nG91 G28 B0. C0.\nG90\nT7",
            "Z0.\nG91 G28 X0. Y0.\nG90\nT7",
            "no G49",
        ),
        (fanuc, FANUC, "G54\n", "", "no work offset is selected: G54"),
        (fanuc, FANUC, "G1 X1. Z880. B1. F500.\n", "", "no cutting move"),
    ] {
        let (before, after) = (rests_on(text, dialect), rests_on(&with(text, from, to), dialect));
        assert!(!before.iter().any(|t| t.starts_with(reports)), "{reports}: {before:?}");
        assert!(after.iter().any(|t| t.starts_with(reports)), "{reports}: {after:?}");
    }
    for (to, reports) in [
        ("CTOL=0.01\nOTOL=0.005\n", "CTOL and OTOL are said, and machine data decide whether corners of G64 keep"),
        ("G642\nOTOL=0.005 CTOL=R1\n", "CTOL and OTOL are said, and machine data decide whether corners of G642"),
        ("CTOL=0.01\n", "CTOL without OTOL does not say how far rotary axes"),
        ("OTOL=0.005\n", "OTOL without CTOL says of rotary axes alone"),
        ("CTOL=0.01\nOTOL=0.005\nCTOL=-1\nOTOL=-1\n", "no CYCLE832, ADIS, G60 or G9"),
        ("CTOL=0.01\nOTOL=0.005\nCYCLE832()\n", "no CYCLE832, ADIS, G60 or G9"),
        ("CYCLE832(0.01,11,0.005)\nCTOL=-1\n", "no CYCLE832, ADIS, G60 or G9"),
        ("CYCLE832(0.01,11,0.005)\nOTOL=-1\n", "CYCLE832 without a tolerance of the orientation"),
    ] {
        let after = rests_on(&with(SIEMENS, "CYCLE832(0.0100,11,0.0050)\n", to), siemens);
        assert!(after.len() == 2 && after[0] == M6 && after[1].starts_with(reports), "{to}: {after:?}");
    }
    // A tolerance of its own behind that of the cycle, and exact stop, which no tolerance takes
    // back.
    for to in ["CYCLE832(0.01,11,0.005)\nCTOL=0.005\nOTOL=0.001\n", "G60\nCTOL=-1\nOTOL=-1\n"] {
        assert_eq!(rests_on(&with(SIEMENS, "CYCLE832(0.0100,11,0.0050)\n", to), siemens), [M6], "{to}");
    }
    // G61 says it on LinuxCNC, G60 and G9 of every block on Siemens.
    assert_eq!(rests_on(&with(LINUXCNC, "G64 P0.0100 Q0.0001", "G61"), linuxcnc), [M6, m428]);
    assert_eq!(rests_on(&with(SIEMENS, "CYCLE832(0.0100,11,0.0050)", "G60"), siemens), [M6]);
}

/// Motion of a tool change and reference positions, which no text gives, are reported once, at the
/// first line that rests on them.
#[test]
fn tool_changes_and_reference_positions_of_the_control_are_assumptions() {
    let lines = |text: &str, dialect: Dialect, reports: &str| -> Vec<u32> {
        let program = read_program(text, dialect).unwrap_or_else(|e| panic!("{e}\n{text}"));
        let all = assumptions(&program, &shop().machine);
        all.into_iter().filter(|a| a.text.starts_with(reports)).map(|a| a.line.unwrap()).collect()
    };
    let (siemens, linuxcnc) = (Dialect::Siemens840d, Dialect::LinuxCnc);
    assert_eq!(lines(SIEMENS, siemens, M6), [11]);
    assert_eq!(lines(HEIDENHAIN, Dialect::Heidenhain, TOOL_CALL), [10]);
    assert_eq!(lines(LINUXCNC, linuxcnc, M6), [10]);
    assert_eq!(lines(FANUC, Dialect::Fanuc, M6), [12]);
    let twice = with(SIEMENS, "T7 M6\n", "T7 M6\nG0 SUPA B1. D0\nT7 M6\n");
    assert_eq!(lines(&twice, siemens, M6), [8]);
    assert_eq!(lines(&with(SIEMENS, "T7 M6\n", "T7\n"), siemens, M6), [0; 0]);
    assert_eq!(lines("G710 G90\nG0 SUPA X0. D0\nT7 M6\nM30\n", siemens, M6), [0; 0]);
    let home = "G0 SUPA Z3000. D0\nG0 SUPA X0";
    for (word, expected) in [("G74", vec![4]), ("G75", vec![4]), ("G75 FP=1", vec![4]), ("G75 FP=2", vec![])] {
        let text = with(SIEMENS, home, &format!("{word} Z0\nG0 SUPA X0"));
        assert_eq!(lines(&text, siemens, "G74 and G75 FP=1 are taken"), expected, "{word}");
    }
    let text = with(LINUXCNC, "G53 G0 Z3000.\nG53 G0 X0", "G91 G28 Z0.\nG90\nG53 G0 X0");
    assert_eq!(lines(&text, linuxcnc, "G28 is taken"), [3]);
    assert_eq!(lines(FANUC, Dialect::Fanuc, "G28 is taken"), [0; 0]);
}

/// Smoothing beyond the machine file's, vectors that are none of length 1, RTCP that stays on, and
/// programs without an end.
#[test]
fn what_is_said_wrongly_is_a_finding_and_its_twin_is_none() {
    use FindingKind::{NoEnd, NotUnitVector, OtherMotion, RtcpLeftOn};
    let (siemens, heidenhain) = (Dialect::Siemens840d, Dialect::Heidenhain);
    let (linuxcnc, fanuc) = (Dialect::LinuxCnc, Dialect::Fanuc);
    for (dialect, text) in [(siemens, SIEMENS), (heidenhain, HEIDENHAIN), (linuxcnc, LINUXCNC), (fanuc, FANUC)] {
        assert_eq!(found(text, dialect), [], "{dialect:?}");
    }
    let g64 = "G64 P0.0100 Q0.0001";
    let haas = with(FANUC, "G43.4", "G234").replace("%\nO1\n", "%\nO1\nG187 E0.01\n");
    assert_eq!(found(&haas, Dialect::Haas), []);
    for (dialect, text, from, to, kind, line) in [
        (linuxcnc, LINUXCNC, g64, "G64 P0.0101 Q0.0001", OtherMotion, 13),
        (linuxcnc, LINUXCNC, g64, "G64", OtherMotion, 13),
        (linuxcnc, LINUXCNC, g64, "G64 P0.01", OtherMotion, 13),
        (linuxcnc, LINUXCNC, g64, "G64 P0.005 Q0.006", OtherMotion, 13),
        (linuxcnc, LINUXCNC, g64, "G64 P#9 Q0.0001", OtherMotion, 13),
        (Dialect::Haas, &haas, "E0.01", "E0.011", OtherMotion, 3),
        (heidenhain, HEIDENHAIN, "T0.0100", "T0.0101", OtherMotion, 14),
        (heidenhain, HEIDENHAIN, "TA0.0050", "TA0.0051", OtherMotion, 15),
        (siemens, SIEMENS, "CYCLE832(0.0100,11,0.0050)", "CTOL=0.02", OtherMotion, 16),
        (siemens, SIEMENS, "11,0.0050)", "11,0.0050)\nATOL[X]=5", OtherMotion, 17),
        (siemens, SIEMENS, "11,0.0050)", "11,0.0050)\nSTOLF=50", OtherMotion, 17),
        (heidenhain, HEIDENHAIN, "NX+0 NY", "NX+0.05 NY", NotUnitVector, 17),
        (heidenhain, HEIDENHAIN, "TX+0.173648", "TX+0.18", NotUnitVector, 17),
        (fanuc, FANUC, "M5\nG91 G28 Z0.\nG49\n", "M5\nG91 G28 Z0.\n", RtcpLeftOn, 17),
        (fanuc, FANUC, "M30\n", "", NoEnd, 21 - 1),
        (siemens, SIEMENS, "M30\n", "", NoEnd, 23),
        (linuxcnc, LINUXCNC, "M2\n", "%\n", NoEnd, 18),
    ] {
        let reports = found(&with(text, from, to), dialect);
        assert!(reports.first() == Some(&(kind, line)), "{to}: {reports:?}");
    }
    // Both parts of a tolerance within the file's; M17 and END PGM are ends.
    assert_eq!(found(&with(LINUXCNC, g64, "G64 P0.005 Q0.005"), linuxcnc), []);
    assert_eq!(found(&with(SIEMENS, "M30\n", "M17\n"), siemens), []);
    assert_eq!(found(&with(HEIDENHAIN, "20 M30\n", ""), heidenhain), []);
    // A part of a program need not end; RTCP on at its end is reported where it does.
    let on = with(FANUC, "M5\nG91 G28 Z0.\nG49\nG91 G28 X0. Y0.\nG91 G28 B0. C0.\nG90\n", "");
    assert_eq!(found(&on, fanuc), [(RtcpLeftOn, 15)]);
    assert!(NoEnd.is_fault() && NotUnitVector.is_fault() && RtcpLeftOn.is_fault());
}

/// Frames that are not simulated are reported where they are set; words that switch them off are
/// not, and change nothing.
#[test]
fn frames_are_reported_where_they_are_set_and_nothing_where_they_are_off() {
    let (siemens, heidenhain) = (Dialect::Siemens840d, Dialect::Heidenhain);
    let (linuxcnc, fanuc) = (Dialect::LinuxCnc, Dialect::Fanuc);
    let faults = |text: &str, dialect: Dialect| -> Vec<(FindingKind, u32)> {
        let shop = shop();
        let program = read_program(text, dialect).unwrap_or_else(|e| panic!("{e}\n{text}"));
        let length_register = if dialect == siemens { 1 } else { shop.tool.number() };
        let setup = VirtualSetup { length_register, ..shop.setup() };
        let v = verify(&program, &setup, &VerifySettings::default(), &Silent).unwrap();
        v.faults().map(|f| (f.kind, f.first_line)).collect()
    };
    for (dialect, text, at, off, on) in [
        (siemens, SIEMENS, "TRAORI\n", "TRANS\nROT\n", "TRANS X5"),
        (siemens, SIEMENS, "TRAORI\n", "MIRROR\nSCALE\n", "AROT Z10"),
        (heidenhain, HEIDENHAIN, "8 M3\n", "TRANS DATUM RESET\n", "CYCL DEF 7.1 Z-5"),
        (heidenhain, HEIDENHAIN, "8 M3\n", "CYCL DEF 10.0 ROTATION\nCYCL DEF 10.1 ROT+0\n", "CYCL DEF 10.1 ROT+5"),
        (linuxcnc, LINUXCNC, "G54\n", "G92.1\n", "G92 X5"),
        (fanuc, FANUC, "G54\n", "G69\nG50\nG52 X0. Y0.\n", "G52 X5."),
    ] {
        let before = faults(text, dialect);
        let is_other = |f: &(FindingKind, u32)| f.0 == FindingKind::UnknownBlock;
        assert!(!before.iter().any(is_other), "{text}: {before:?}");
        let kinds = |found: &[(FindingKind, u32)]| -> Vec<FindingKind> { found.iter().map(|f| f.0).collect() };
        let behind = |what: &str| with(text, at, &format!("{at}{what}"));
        assert_eq!(kinds(&faults(&behind(off), dialect)), kinds(&before), "{off}");
        let line = text[..text.find(at).unwrap() + at.len()].lines().count() as u32 + 1;
        let reports = faults(&behind(&format!("{on}\n")), dialect);
        assert!(reports.contains(&(FindingKind::UnknownBlock, line)), "{on}: {reports:?}");
    }
}

/// M functions of Heidenhain that change what F gives are a fault at the next cut, and no function
/// of the machine's builder; those that switch back are silent.
#[test]
fn functions_that_change_feeds_are_reported_and_their_end_is_not() {
    let found = |word: &str| -> Vec<(FindingKind, String)> {
        let text = with(HEIDENHAIN, "8 M3\n", &format!("8 M3\n{word}"));
        let shop = shop();
        let program = read_program(&text, Dialect::Heidenhain).unwrap_or_else(|e| panic!("{e}\n{text}"));
        let setup = VirtualSetup { length_register: shop.tool.number(), ..shop.setup() };
        let v = verify(&program, &setup, &VerifySettings::default(), &Silent).unwrap();
        v.findings.iter().map(|f| (f.kind, f.note.clone())).collect()
    };
    let kinds = |of: &[(FindingKind, String)], kind| of.iter().filter(|f| f.0 == kind).count();
    let before = found("");
    for silent in ["L M111\n", "L M117\n"] {
        assert_eq!(found(silent), before, "{silent}");
    }
    for (word, code) in [("L M103 F0.5\n", "M103"), ("L M109\n", "M109"), ("L M110\n", "M110"), ("L M116\n", "M116")] {
        let after = found(word);
        let reports = after.iter().filter(|f| f.0 == FindingKind::NoFeed && f.1.contains(code)).count();
        assert_eq!(reports, 1, "{word}: {after:?}");
        assert_eq!(kinds(&after, FindingKind::UnknownFunction), kinds(&before, FindingKind::UnknownFunction), "{word}");
    }
    // Elsewhere these are the builder's.
    assert_eq!(kinds(&found("L M88\n"), FindingKind::UnknownFunction), 1);
}
