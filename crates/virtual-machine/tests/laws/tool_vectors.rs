//! Programs that name the tool's axis as a vector: the control finds the rotary positions, and the
//! machine follows it where that is clear.

mod surface_normals;

use std::fmt::Write;

use crate::kit;
use crate::kit::Shop;
use facemill_cl_data::Silent;
use facemill_inverse_kinematics::machine_file::{CuttingLawFile, RapidLawFile};
use facemill_inverse_kinematics::{AxisValues, Machine};
use facemill_nc_program::Dialect;
use facemill_nc_program::read_program;
use facemill_nc_program::words::AxisKind;
use facemill_virtual_machine::verify;
use facemill_virtual_machine::{Certificates, FindingKind, Verification, VerifySettings, VirtualSetup, certify};

fn shop() -> Shop {
    let mut file = Machine::head_b_table_c().unwrap().to_file();
    file.motion.cutting = CuttingLawFile::TipLinearVectorTurned;
    file.motion.rapid = RapidLawFile::Linear;
    Shop::with_machine(Machine::from_file(file).unwrap())
}

/// A pose: tip and tool axis, workpiece frame.
type Pose = ([f64; 3], [f64; 3]);

/// A round of the tool over the plate, leaning out by `slope` and dipping in now and then.
fn round(slope: f64, n: usize) -> Vec<Pose> {
    let turn = |k: usize| 0.04 * k as f64;
    let depth = |k: usize| if k.is_multiple_of(7) { 0.05 } else { -3.0 };
    let axis = |k: usize| [slope * turn(k).cos(), slope * turn(k).sin(), 1.0];
    let tip = |k: usize| [40.0 * turn(k).cos(), 40.0 * turn(k).sin(), kit::lift_of(slope) - depth(k)];
    (0..n).map(|k| (tip(k), axis(k))).collect()
}

fn unit([x, y, z]: [f64; 3]) -> [f64; 3] {
    let length = (x * x + y * y + z * z).sqrt();
    [x / length, y / length, z / length]
}

fn rotary(shop: &Shop, (tip, axis): Pose) -> String {
    rotary_words(shop, &shop.axes_at(tip, axis))
}

fn rotary_words(shop: &Shop, axes: &AxisValues) -> String {
    let words = shop.words.words(axes.as_slice()).unwrap();
    let of = words.iter().filter(|w| w.letter.kind() == AxisKind::Rotary);
    of.fold(String::new(), |mut line, w| {
        write!(line, " {}{:.6}", w.letter, w.value).unwrap();
        line
    })
}

fn linear([x, y, z]: [f64; 3]) -> String {
    format!(" X{x:.6} Y{y:.6} Z{z:.6}")
}

fn vector(axis: [f64; 3]) -> String {
    let [a, b, c] = unit(axis);
    format!(" A3={a:.6} B3={b:.6} C3={c:.6}")
}

/// A program for Siemens that goes to the first pose with rotary words.
fn start(shop: &Shop, first: Pose) -> String {
    let (tip, above) = (first.0, [first.0[0], first.0[1], 200.0]);
    let at = rotary(shop, first);
    // At the pole the table turns alone: a vector turned out of it by both axes would have one of
    // them jump.
    let table = &at[at.find(" C").unwrap()..];
    format!(
        "G710 G90 G94\nT7 M6\nS2000 M3\nG0 B0 C0\nD1\nTRAORI\nORIWKS ORIVECT\nFGROUP(X,Y,Z)\nG0{table}\nG0{}{at}\nG1{} F20\n",
        linear(above),
        linear(tip)
    )
}

fn with_vectors(shop: &Shop, poses: &[Pose]) -> String {
    let mut text = start(shop, poses[0]);
    poses[1..].iter().for_each(|(tip, axis)| writeln!(text, "G1{}{}", linear(*tip), vector(*axis)).unwrap());
    text
}

/// The axes go on from where they are: a jump to the other branch would be no even turn of the
/// tool's vector.
fn with_words(shop: &Shop, poses: &[Pose]) -> String {
    let mut text = start(shop, poses[0]);
    let mut at = shop.axes_at(poses[0].0, poses[0].1);
    for (tip, axis) in &poses[1..] {
        at = shop.axes_near(*tip, *axis, &at);
        writeln!(text, "G1{}{}", linear(*tip), rotary_words(shop, &at)).unwrap();
    }
    text
}

/// A program for Heidenhain that goes to the first pose with rotary words, and from there with
/// vectors and these normals.
fn with_normals(shop: &Shop, poses: &[Pose], mut normal: impl FnMut(usize) -> [f64; 3]) -> String {
    let (first, above) = (poses[0], [poses[0].0[0], poses[0].0[1], 200.0]);
    let mut text = format!(
        "TOOL CALL 7 Z S2000\nM3\nL B0 C0 FMAX\nFUNCTION TCPM F TCP AXIS POS PATHCTRL VECTOR\nL{}{} FMAX\nL{} F20\n",
        linear(above),
        rotary(shop, first),
        linear(first.0)
    );
    for (k, (tip, axis)) in poses.iter().enumerate().skip(1) {
        let ([x, y, z], [i, j, k]) = (unit(*axis), unit(normal(k)));
        let vectors = format!("NX{i:+.7} NY{j:+.7} NZ{k:+.7} TX{x:+.7} TY{y:+.7} TZ{z:+.7}");
        writeln!(text, "LN{} {vectors}", linear(*tip)).unwrap();
    }
    text
}

/// The length is that of the edge D1 with Siemens, of the tool T7 with Heidenhain.
fn setup(shop: &Shop, dialect: Dialect) -> VirtualSetup<'_> {
    let length_register = if dialect == Dialect::Siemens840d { 1 } else { shop.tool.number() };
    VirtualSetup { length_register, ..shop.setup() }
}

fn run(shop: &Shop, text: &str, dialect: Dialect) -> Verification {
    let program = read_program(text, dialect).unwrap();
    let settings = VerifySettings { gouge_limit: 0.2, ..VerifySettings::default() };
    verify(&program, &setup(shop, dialect), &settings, &Silent).unwrap()
}

fn prove(shop: &Shop, text: &str) -> Certificates {
    let program = read_program(text, Dialect::Siemens840d).unwrap();
    let settings = VerifySettings { gouge_limit: 0.2, ..VerifySettings::default() };
    certify(&program, &setup(shop, Dialect::Siemens840d), &settings, &Silent).unwrap()
}

fn reported(v: &Verification) -> Vec<(FindingKind, &str)> {
    v.findings.iter().map(|f| (f.kind, f.note.as_str())).collect()
}

#[test]
fn vectors_run_and_are_proven_like_the_rotary_words_they_stand_for() {
    let shop = shop();
    let poses = round(0.35, 120);
    let texts = [with_vectors(&shop, &poses), with_words(&shop, &poses)];
    assert!(texts[0].matches("A3=").count() == 119 && !texts[1].contains("A3="));
    let [vectors, words] = [0, 1].map(|k| run(&shop, &texts[k], Dialect::Siemens840d));
    assert_eq!((reported(&vectors), reported(&words)), (vec![], vec![]));
    // A tool axis is off by less than 1e-6, and the rim by less than that of its radius.
    let apart = 1e-4;
    let depth = |v: &Verification| v.largest_gouge.as_ref().unwrap().depth_mm;
    assert!(depth(&vectors) > 0.03 && (depth(&vectors) - depth(&words)).abs() < apart);
    assert!((vectors.cutting_length_mm - words.cutting_length_mm).abs() < apart);
    assert!((vectors.cutting_time_s - words.cutting_time_s).abs() < apart);
    assert!(vectors.n_blocks == words.n_blocks && vectors.n_blocks > 119);
    let [vectors, words] = [0, 1].map(|k| prove(&shop, &texts[k]));
    assert_eq!(vectors.blocks, words.blocks);
    for (a, b) in vectors.certificates.iter().zip(&words.certificates) {
        assert!(a.certified, "{a:?}");
        let [a, b] = [a, b].map(|c| c.depth_mm.unwrap());
        assert!((a - b).abs() < 10.0 * apart, "{a} {b}");
    }
}

#[test]
fn heidenhain_vectors_run_like_those_of_siemens() {
    let shop = shop();
    let poses = round(0.35, 60);
    let siemens = run(&shop, &with_vectors(&shop, &poses), Dialect::Siemens840d);
    let heidenhain = run(&shop, &with_normals(&shop, &poses, |_| [0.0, 0.0, 1.0]), Dialect::Heidenhain);
    let unknown = heidenhain.findings.iter().filter(|f| f.kind == FindingKind::UnknownPosition).count();
    assert_eq!(unknown, 0, "{:?}", reported(&heidenhain));
    let depth = |v: &Verification| v.largest_gouge.as_ref().unwrap().depth_mm;
    assert!((depth(&siemens) - depth(&heidenhain)).abs() < 1e-4);
    assert!((siemens.cutting_length_mm - heidenhain.cutting_length_mm).abs() < 1e-4);
}

/// An unclear choice is reported at its block, nothing behind it is proven, and rotary words
/// restore the axes' positions.
#[test]
fn a_choice_that_is_not_clear_is_a_finding() {
    let shop = shop();
    let high = |axis: [f64; 3]| -> Pose { ([0.0, 0.0, 150.0], axis) };
    let lean = high([0.5, 0.0, 1.0]);
    let block = |axis: [f64; 3]| format!("G1 X1.{}\n", vector(axis));
    for (what, line, kind, note) in [
        (
            "pole",
            block([0.01, 0.0, 1.0]),
            FindingKind::UnknownPosition,
            "comes within 0.573 deg of the direction of axis C",
        ),
        ("through the pole", block([-0.5, 0.001, 1.0]), FindingKind::UnknownPosition, "of the direction of axis C"),
        ("two ways", block([-0.05, 0.5, 1.0]), FindingKind::UnknownPosition, "which way a control takes is not clear"),
        ("no length", "G1 X1. A3=0 B3=0 C3=0\n".to_owned(), FindingKind::UnknownPosition, "has no length"),
        ("out of reach", block([1.0, 0.0, -4.0]), FindingKind::UnknownPosition, "beyond its limit"),
        (
            "words too",
            "G1 X1. B25. A3=0.5 B3=0 C3=1\n".to_owned(),
            FindingKind::UnknownPosition,
            "in a block with a tool vector",
        ),
        ("variable", "G1 X=R1 A3=0.5 B3=0 C3=1\n".to_owned(), FindingKind::UnknownBlock, "may move any axis"),
        ("not whole", "G1 X1. A3=0.5 B3=0\n".to_owned(), FindingKind::UnknownBlock, "may move any axis"),
        (
            "no RTCP",
            format!("TRAFOOF\n{}", block([0.5, 0.1, 1.0])),
            FindingKind::UnknownBlock,
            "a tool vector without RTCP",
        ),
    ] {
        let text = format!("{}{line}", start(&shop, lean));
        let found = run(&shop, &text, Dialect::Siemens840d);
        let line = text.lines().count() as u32;
        let of_block: Vec<_> = found.findings.iter().filter(|f| f.first_line == line).collect();
        assert!(of_block.iter().any(|f| f.kind == kind && f.note.contains(note)), "{what}: {:?}", reported(&found));
        assert!(found.faults().count() > 0, "{what}");
        let behind = format!("{text}G1 X2. Y1.\n");
        assert!(prove(&shop, &behind).certificates.iter().filter(|c| c.line >= line).all(|c| !c.certified), "{what}");
    }
    let clear = format!("{}{}", start(&shop, lean), block([0.5, 0.1, 1.0]));
    assert_eq!(reported(&run(&shop, &clear, Dialect::Siemens840d)), []);
    // A pose with rotary words is known again, and what is wrong behind it is seen.
    let deep: Pose = ([10.0, 0.0, -1.0], lean.1);
    let lost = format!("{}{}", start(&shop, lean), block([0.01, 0.0, 1.0]));
    let again = format!("{lost}G1{}{}\nG1{}\n", linear(lean.0), rotary(&shop, lean), linear(deep.0));
    let found = run(&shop, &again, Dialect::Siemens840d);
    assert!(found.findings.iter().any(|f| f.kind == FindingKind::Gouge), "{:?}", reported(&found));
}
