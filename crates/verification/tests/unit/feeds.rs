use crate::feeds::*;
use facemill_nc_program::Dialect;
use facemill_nc_program::read_program;

fn found(text: &str) -> Vec<([u32; 2], String)> {
    let asked = Asked { cuts: 1000.0, all: 1000.0, least: None, speeds: vec![6000.0], rounding: [0.0; 2] };
    let program = read_program(text, Dialect::Fanuc).unwrap();
    let all = asked.other_speeds(&program);
    all.into_iter().map(|f| ([f.first_line, f.last_line], f.note)).collect()
}

#[test]
fn other_spindle_speeds_that_follow_each_other_are_one_finding() {
    let head = "G21 G90 G94\nG0 X0. Y0. Z0.\nS6000 M3\n";
    let cuts = |speeds: &[u32]| -> String {
        speeds.iter().enumerate().map(|(k, s)| format!("G1 X{k}. F100. S{s}\n")).collect()
    };
    let lines = |speeds: &[u32]| found(&(head.to_owned() + &cuts(speeds)));
    let same = lines(&[100; 50]);
    assert_eq!(same.len(), 1);
    assert!(same[0].0 == [4, 53] && same[0].1.ends_with("6000 1/min"), "{same:?}");
    let other = lines(&[100, 200, 100, 300]);
    assert!(other.len() == 1 && other[0].0 == [4, 7] && other[0].1.ends_with(OTHERS), "{other:?}");
    // A cut at the job's speed ends it; an S in the air does not, and is not reported.
    let apart: Vec<[u32; 2]> = lines(&[100, 100, 6000, 100]).into_iter().map(|(lines, _)| lines).collect();
    assert_eq!(apart, [[4, 5], [7, 7]]);
    assert_eq!(found(&format!("{head}S100\nS6000\nG1 X1. F100.\n")), []);
    let air = found(&format!("{head}G1 X1. F100. S100\nS6000\nS100\nG1 X2.\n"));
    assert!(air.len() == 1 && air[0].0 == [4, 6], "{air:?}");
}
