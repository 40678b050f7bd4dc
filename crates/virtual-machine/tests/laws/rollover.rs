//! Words of axes that count to 360 deg, as each kind of control takes them.

use crate::kit::{HEAD, Shop, Text};
use facemill_inverse_kinematics::machine_file::Joint;
use facemill_inverse_kinematics::{Machine, Rollover};
use facemill_nc_program::Dialect;
use facemill_nc_program::read_program;
use facemill_virtual_machine::assumptions;
use facemill_virtual_machine::{FindingKind, Verification};

fn shop(rollover: Option<Rollover>, wind_up: Option<f64>) -> Shop {
    let mut file = Shop::new().machine.to_file();
    for row in &mut file.workpiece_chain.rows {
        if let Some(Joint::Revolute(joint)) = &mut row.joint {
            (joint.rollover, joint.max_wind_up_turns) = (rollover, wind_up);
        }
    }
    Shop::with_machine(Machine::from_file(file).unwrap())
}

fn start(shop: &Shop) -> Text<'_> {
    Text::new(shop).line("G0 X0. Y0. Z1000. B0. C0.")
}

/// Degrees that C turns in the last of these blocks, by the time of a rapid of it alone.
fn turned(shop: &Shop, blocks: &[&str]) -> f64 {
    let time = |n: usize| blocks[..n].iter().fold(start(shop), |text, block| text.line(block)).verify().rapid_time_s;
    let c = shop.machine.axis_index("C").unwrap();
    (time(blocks.len()) - time(blocks.len() - 1)) * shop.machine.axes()[c].max_velocity.to_degrees()
}

#[test]
fn a_word_behind_another_turns_the_table_as_its_rollover_says() {
    use Rollover::{None as WindsOn, Shortest, SignDirected};
    let cases: [(&[&str], [f64; 3]); 8] = [
        (&["C350.", "C10."], [340.0, 20.0, 20.0]),
        (&["C350.", "C-10."], [360.0, 0.0, 340.0]),
        (&["C90.", "C-90."], [180.0, 180.0, 0.0]),
        (&["C10.", "C350."], [340.0, 20.0, 340.0]),
        (&["C10.", "C-350."], [360.0, 0.0, 20.0]),
        (&["C30.", "C720."], [690.0, 30.0, 330.0]),
        // Increments are ways, and blocks without the word leave the axis alone.
        (&["C350.", "G91 C-340."], [340.0, 340.0, 340.0]),
        (&["C350.", "C10.", "C20.", "G91 C400."], [400.0, 400.0, 400.0]),
    ];
    for (blocks, expected) in cases {
        for (rollover, expected) in [WindsOn, Shortest, SignDirected].into_iter().zip(expected) {
            let found = turned(&shop(Some(rollover), None), blocks);
            assert!((found - expected).abs() < 1e-6, "{rollover:?} {blocks:?}: {found}, not {expected}");
        }
    }
    // The way home is the nearer one, and that of a block that names other axes nothing.
    let shortest = shop(Some(Shortest), None);
    let offset = 0.2_f64.to_degrees();
    assert!((turned(&shortest, &["C170.", "C340.", "G91 G28 C0."]) - (20.0 - offset)).abs() < 1e-6);
    assert!(turned(&shop(Some(SignDirected), None), &["C350.", "C10.", "M8"]).abs() < 1e-9);
}

/// The pose is that of the same word, whatever turns the way has.
#[test]
fn rollover_changes_the_way_and_not_the_place() {
    let gouge = |rollover| {
        let shop = shop(rollover, None);
        let text = Text::new(&shop).rapid([10.0, 20.0, 300.0]).line("G0 C350.").line("C10.");
        text.rapid([10.0, 20.0, 5.0]).cut([10.0, 20.0, -1.0]).verify().largest_gouge.unwrap().depth_mm
    };
    let plain = gouge(None);
    for rollover in [Rollover::Shortest, Rollover::SignDirected] {
        assert!((gouge(Some(rollover)) - plain).abs() < 1e-6);
    }
}

#[test]
fn unstated_rollover_is_reported_where_it_matters() {
    let reported = |rollover, blocks: &str| {
        let shop = shop(rollover, None);
        let text = start(&shop).line(blocks).text;
        let all = assumptions(&read_program(&text, Dialect::Fanuc).unwrap(), &shop.machine);
        all.into_iter().find(|a| a.text.contains("rollover")).map(|a| a.line.unwrap() - HEAD)
    };
    assert_eq!(reported(None, "C170.\nC350."), None);
    assert_eq!(reported(None, "C170.\nC350.\nC10.\nC350."), Some(4));
    assert_eq!(reported(None, "G91 C200."), None);
    assert_eq!(reported(Some(Rollover::None), "C170.\nC350.\nC10."), None);
    assert_eq!(reported(Some(Rollover::Shortest), "C170.\nC350.\nC10."), None);
    let shop = shop(None, None);
    let first = read_program(&Text::new(&shop).line("G0 C-20.").text, Dialect::Fanuc).unwrap();
    assert!(assumptions(&first, &shop.machine).iter().any(|a| a.text.contains("rollover")));
}

/// Controls do not agree on the way round where both are as short.
#[test]
fn half_a_turn_of_the_shorter_way_is_reported_where_it_is_gone_first() {
    let reported = |rollover, blocks: &str| {
        let shop = shop(Some(rollover), None);
        let text = start(&shop).line(blocks).text;
        let all = assumptions(&read_program(&text, Dialect::Fanuc).unwrap(), &shop.machine);
        all.into_iter().find(|a| a.text.starts_with("C goes half a turn")).map(|a| a.line.unwrap() - HEAD)
    };
    assert_eq!(reported(Rollover::Shortest, "C170.\nC10.\nC190.\nC10."), Some(4));
    assert_eq!(reported(Rollover::Shortest, "C-180."), Some(2));
    assert_eq!(reported(Rollover::Shortest, "C90.\nC630."), Some(3));
    assert_eq!(reported(Rollover::Shortest, "C179.99\nC1.\nG91 C180."), None);
    assert_eq!(reported(Rollover::SignDirected, "C180."), None);
    // The accepted program is the one that runs.
    let shop = shop(Some(Rollover::Shortest), None);
    let v = start(&shop).line("C180.").line("C0.").verify();
    let offset = 0.2_f64.to_degrees();
    assert!((v.wind_up[0].greatest_deg - offset - 360.0).abs() < 1e-6, "{:?}", v.wind_up);
}

#[test]
fn wind_up_is_reported_and_a_limit_to_it_held() {
    let offset = 0.2_f64.to_degrees();
    let wound = |v: &Verification| {
        let [w] = &v.wind_up[..] else { panic!("{:?}", v.wind_up) };
        assert!((w.greatest_deg - w.least_deg - 360.0 * w.turns).abs() < 1e-9 && w.axis == "C");
        (w.least_deg - offset, w.greatest_deg - offset)
    };
    let blocks = |shop: &Shop| start(shop).line("C-90.").line("C21600.").line("G91 G28 C0.").verify();
    let v = blocks(&shop(None, None));
    let (least, greatest) = wound(&v);
    assert!((least + 90.0).abs() < 1e-6 && (greatest - 21600.0).abs() < 1e-6, "{least} {greatest}");
    assert_eq!(v.findings, []);
    let v = blocks(&shop(None, Some(40.0)));
    let [f] = &v.findings[..] else { panic!("{:?}", v.findings) };
    assert_eq!((f.kind, f.axis.as_deref(), f.first_line), (FindingKind::AxisLimit, Some("C"), HEAD + 3));
    assert!((f.measure.unwrap().value() - (7200.0 + offset)).abs() < 1e-6);
    assert_eq!(blocks(&shop(None, Some(61.0))).findings, []);
    // Where words count to 360 deg they do not wind it.
    let v = blocks(&shop(Some(Rollover::Shortest), None));
    assert_eq!(v.findings, []);
    assert!(v.wind_up[0].turns < 1.0, "{:?}", v.wind_up);
}

#[test]
fn keys_of_endless_axes_are_refused_where_they_mean_nothing() {
    let refused = |change: &dyn Fn(&mut facemill_inverse_kinematics::machine_file::RevoluteJoint)| {
        let mut file = Machine::head_b_table_c().unwrap().to_file();
        let rows = file.workpiece_chain.rows.iter_mut().chain(&mut file.tool_chains[0].rows);
        for row in rows {
            if let Some(Joint::Revolute(joint)) = &mut row.joint {
                change(joint);
            }
        }
        Machine::from_file(file).map(|_| ()).unwrap_err().to_string()
    };
    assert!(refused(&|j| j.rollover = Some(Rollover::Shortest)).contains("range is endless"));
    assert!(refused(&|j| j.max_wind_up_turns = Some(3.0)).contains("range is endless"));
    let of_c = |turns: f64, rollover: Option<Rollover>| {
        refused(&|j| {
            if j.axis == "C" {
                (j.max_wind_up_turns, j.rollover) = (Some(turns), rollover);
            }
        })
    };
    for turns in [0.0, 0.5, -3.0, 1e300, f64::NAN] {
        assert!(of_c(turns, None).contains("max_wind_up_turns"), "{}", of_c(turns, None));
    }
    assert!(of_c(5.0, Some(Rollover::SignDirected)).contains("nothing winds up"));
}
