//! Times of new feeds for LinuxCNC, against its own planner.

use facemill::feeds::{FeedLaw, FeedRewriteSettings, TipFeed};
use facemill::inverse_kinematics::Machine;
use facemill::nc_program::Dialect;
use facemill::rewrite_feeds;

use super::control_programs::{ControlProgram, control_programs};
use super::linuxcnc;

fn text(program: &ControlProgram) -> String {
    let mode = match program.tolerance {
        0.0 => "G61".to_owned(),
        tolerance => format!("G64 P{tolerance} Q0.0001"),
    };
    let mut text = format!("G21 G90 G94\n{mode}\nG0 X0. Y0. Z0. B0. C0.\nG1 F{}\n", program.feed);
    for [x, y, z, b, c] in &program.ends {
        text += &format!("X{x:.4} Y{y:.4} Z{z:.4} B{b:.4} C{c:.4}\n");
    }
    text + "M2\n"
}

fn own_time(machine: &Machine, program: &ControlProgram) -> f64 {
    let settings = FeedRewriteSettings {
        machine,
        tool_length: 100.0,
        tip_feed: TipFeed::Keep,
        work_offset: Vec::new(),
        dialect: Dialect::LinuxCnc,
        dialect_file: None,
        time_law: Some(FeedLaw { blend_tolerance: Some(program.tolerance) }),
    };
    rewrite_feeds(text(program).as_bytes(), &settings).unwrap().summary.time_law.unwrap().cutting_time_s
}

fn hold(size: usize) {
    if let Some(why) = linuxcnc::missing() {
        println!("skipped: {why}");
        return;
    }
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/machines/table-table-b-c.json");
    let machine = Machine::from_json(&std::fs::read(file).unwrap()).unwrap();
    let limits = ["X", "Y", "Z", "B", "C"].map(|name| {
        let axis = &machine.axes()[machine.axis_index(name).unwrap()];
        let unit = if name < "X" { 1f64.to_degrees() } else { 1.0 };
        [unit * axis.max_velocity, unit * axis.max_acceleration.unwrap()]
    });
    let programs = control_programs(size);
    let times = match linuxcnc::times(&programs.each_ref().map(text), &limits) {
        Ok(times) => times,
        Err(why) => {
            println!("skipped: LinuxCNC's simulator does not run here: {why}");
            return;
        }
    };
    for (program, measured) in programs.iter().zip(times) {
        let own = own_time(&machine, program);
        println!("{}: {own:.3} s, {measured:.3} s in the simulator", program.name);
        assert!((own / measured - 1.0).abs() < 0.05, "{}: {own} s for {measured} s", program.name);
    }
}

/// Sleeps nearly all of its time.
#[test]
fn times_for_linuxcnc_are_those_of_its_simulator_within_five_percent() {
    hold(2);
}

#[test]
#[ignore = "takes two minutes; run after changes to trapezoid_law or with another version of LinuxCNC"]
fn times_of_longer_programs_for_linuxcnc_are_those_of_its_simulator_within_five_percent() {
    hold(20);
}
