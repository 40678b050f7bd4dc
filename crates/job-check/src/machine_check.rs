//! Description of a machine, as `machine check` prints it.

use facemill_cl_data::SplitMix64;
use facemill_inverse_kinematics::inverse::AxisReach;
use facemill_inverse_kinematics::machine_file::{AssumedValue, DhRow, MachineFile};
use facemill_inverse_kinematics::{Axis, AxisKind, AxisValues, Carrier, LinkId, Machine, Rollover};
use nalgebra::{Point3, Vector3};

use facemill_job::load::machine_load::BodyHull;

/// Description of a machine in lines, and whether the inverse solution returned every pose tried.
#[non_exhaustive]
pub struct MachineCheck {
    /// Lines of the description.
    pub lines: Vec<String>,
    /// Fault found; `None` if the round trip closes.
    pub fault: Option<String>,
}

/// Number of poses of the round trip.
const POSES: usize = 2000;

/// Tool length of the round trip, mm.
const TOOL_LENGTH: f64 = 200.0;

/// Accuracy that the inverse solution guarantees, mm and rad; the second forward solution adds
/// rounding.
const CLOSED: [f64; 2] = [2e-9, 2e-12];

/// Describes chain, axes, zero pose, family, reach and assumed values of a machine, and tries poses
/// there and back.
///
/// # Errors
/// If the reach cannot be found; the error is that of the kinematics.
pub fn describe_machine(machine: &Machine) -> Result<MachineCheck, facemill_inverse_kinematics::MachineError> {
    let file = machine.to_file();
    let reach = machine.axis_reach()?;
    let mut lines = vec![format!("machine \"{}\": {}", machine.name(), machine.family())];
    lines.extend(file.source.iter().map(|s| format!("  numbers from: {s}")));
    lines.extend(linear_axes(machine));
    lines.extend(rows_of(machine, &file));
    lines.push("axes at 0, from the table to the tool, in the table frame (* assumed)".to_owned());
    lines.extend(axis_table(machine, &file));
    lines.extend(zero_pose(machine, &file));
    lines.extend(bodies_of(machine));
    lines.extend(reach_lines(&reach));
    lines.push(assumed_line(&file));
    let trip = round_trip(machine);
    lines.push(format!(
        "round trip over {POSES} poses within the limits: tip off by {:.1e} mm at most, tool axis by {:.1e} rad; {} not \
         found again",
        trip.worst[0], trip.worst[1], trip.lost
    ));
    let closed = trip.lost == 0 && trip.worst[0] <= CLOSED[0] && trip.worst[1] <= CLOSED[1];
    let fault = || {
        format!(
            "the round trip is not closed: {} of {POSES} poses within the limits not found again, tip off by up to {:.1e} \
             mm, tool axis by {:.1e} rad",
            trip.lost, trip.worst[0], trip.worst[1]
        )
    };
    Ok(MachineCheck { lines, fault: (!closed).then(fault) })
}

/// Describes a machine as each of its heads sees it: every head in turn, then what the heads share
/// and whether both views agree on where everything is.
///
/// # Errors
/// As [`describe_machine`].
pub fn describe_heads(views: &[Machine]) -> Result<MachineCheck, facemill_inverse_kinematics::MachineError> {
    let [first, second] = views else {
        return views.first().map_or(Ok(MachineCheck { lines: Vec::new(), fault: None }), describe_machine);
    };
    let (mut lines, mut fault) = (Vec::new(), None);
    for view in views {
        let checked = describe_machine(view)?;
        let (number, chain, channel) = (view.head() + 1, view.head(), view.channel());
        lines.push(format!("HEAD {number} of {}: tool_chains[{chain}], channel {channel}", views.len()));
        lines.extend(checked.lines);
        lines.push(String::new());
        fault = fault.or(checked.fault.map(|f| format!("head {number}: {f}")));
    }
    let letters = |wanted: &dyn Fn(usize) -> bool| {
        let all = (0..first.axes().len()).filter(|&k| wanted(k)).map(|k| first.axes()[k].letter.to_string());
        all.collect::<Vec<_>>().join(" ")
    };
    lines.push("BOTH HEADS".to_owned());
    lines.push(format!("axes in the order of words: {}", letters(&|_| true)));
    lines.push(format!("shared, so that both heads need the same value: {}", letters(&|k| first.is_shared(k))));
    let off = views_differ_by(first, second);
    lines.push(format!(
        "views of both heads over {POSES} positions: bodies of bed, table and both heads at the same places to {off:.1e} mm"
    ));
    if off > CLOSED[0] {
        fault = fault.or(Some(format!("the views of both heads differ by {off:.1e} mm in where a body is")));
    }
    let common = first
        .joint_lines()
        .iter()
        .zip(&second.joint_lines())
        .all(|(a, b)| !first.is_shared(a.axis) || (a.axis, a.direction, a.point) == (b.axis, b.direction, b.point));
    if common {
        lines.push("views of both heads have the shared axes on the same lines".to_owned());
    } else {
        fault = fault.or(Some("the views of both heads have a shared axis on different lines".to_owned()));
    }
    Ok(MachineCheck { lines, fault })
}

/// Returns the largest distance between the positions that two views give the origin and corners of
/// a body, mm.
fn views_differ_by(first: &Machine, second: &Machine) -> f64 {
    // A body of this head in one view belongs to the other head in the other view.
    let groups = [
        (None, None),
        (Some(Carrier::Table), Some(Carrier::Table)),
        (Some(Carrier::Head), Some(Carrier::OtherHead)),
        (Some(Carrier::OtherHead), Some(Carrier::Head)),
    ];
    let mut random = SplitMix64(2);
    let mut worst = 0.0_f64;
    for _ in 0..POSES {
        let q = within_limits(first, &mut random);
        for (of_first, of_second) in groups {
            let a = first.body_poses(&q).filter(|p| p.body.carrier() == of_first);
            let b = second.body_poses(&q).filter(|p| p.body.carrier() == of_second);
            for (a, b) in a.zip(b) {
                let corner = a.body.body.solid.aabb().max;
                let apart =
                    [Point3::origin(), corner].map(|p| (a.table_from_solid * p - b.table_from_solid * p).norm());
                worst = apart.into_iter().fold(worst, f64::max);
            }
        }
    }
    worst
}

/// Formats a number without trailing zeros, and 0 without a sign.
fn short(value: f64) -> String {
    let text = format!("{value:.4}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

fn triple(v: &Vector3<f64>) -> String {
    format!("({}, {}, {})", short(v.x), short(v.y), short(v.z))
}

fn linear_axes(machine: &Machine) -> Vec<String> {
    let family = machine.family();
    let list = |letters: &[facemill_inverse_kinematics::AxisLetter]| {
        let text: Vec<String> = letters.iter().map(ToString::to_string).collect();
        if text.is_empty() { "none".to_owned() } else { text.join(" ") }
    };
    vec![format!(
        "  linear axes from the bed outward: head {}, table {}",
        list(&family.linear_head),
        list(&family.linear_table)
    )]
}

fn rows_of(machine: &Machine, file: &MachineFile) -> Vec<String> {
    let mut lines = vec!["rows (a mm, alpha deg, d mm, theta deg)".to_owned()];
    let mut chain = |name: String, rows: &[DhRow]| {
        for (k, row) in rows.iter().enumerate() {
            let joint = row.joint.as_ref().map_or("fixed", |j| j.axis());
            let bodies = if row.bodies.is_empty() { String::new() } else { format!("   bodies: {}", row.bodies.len()) };
            let numbers = [row.a_mm, row.alpha_deg, row.d_mm, row.theta_deg].map(|v| format!("{:>10}", short(v)));
            lines.push(format!("  {name}.rows[{k}]  {joint:>5} {}{bodies}", numbers.join(" ")));
        }
    };
    chain("workpiece_chain".to_owned(), &file.workpiece_chain.rows);
    for (k, c) in file.tool_chains.iter().enumerate().filter(|(k, _)| *k == machine.head()) {
        chain(format!("tool_chains[{k}]"), &c.rows);
    }
    lines
}

fn axis_table(machine: &Machine, file: &MachineFile) -> Vec<String> {
    let lines = machine.joint_lines();
    let about = lines.iter().map(|line| {
        let axis = &machine.axes()[line.axis];
        let letter = axis.letter.to_string();
        let (kind, through) = match line.kind {
            AxisKind::Linear => ("moves along", String::new()),
            AxisKind::Rotary => ("turns about", format!(" through {}", triple(&line.point.coords))),
        };
        let side = if line.carrier == Carrier::Head { "head" } else { "table" };
        let is_assumed = [AssumedValue::Dimensions, AssumedValue::Sense].iter().any(|&v| file.is_assumed(v, &letter));
        let star = if is_assumed { " *" } else { "" };
        format!("  {letter:<2} {side:<5} {kind} {}{through}{star}", triple(&line.direction))
    });
    let limits = lines.iter().map(|line| limits_line(&machine.axes()[line.axis], file));
    about.chain(limits).collect()
}

fn limits_line(axis: &Axis, file: &MachineFile) -> String {
    let letter = axis.letter.to_string();
    let star = |value| if file.is_assumed(value, &letter) { " *" } else { "" };
    let unit = if axis.kind == AxisKind::Linear { "mm" } else { "deg" };
    let word = |v: f64| short(axis.in_word_unit(v));
    let range = match (axis.endless, axis.max_wind_up) {
        (true, _) => "endless".to_owned(),
        (false, Some(far)) => format!("endless, wound {} turns from home at most", short(far / std::f64::consts::TAU)),
        (false, None) => format!("{} to {} {unit}", word(axis.min), word(axis.max)),
    };
    let wrap = match (axis.kind, axis.has_no_stops(), axis.rollover) {
        (AxisKind::Linear, ..) => "",
        (AxisKind::Rotary, true, Some(Rollover::Shortest)) => ", words go the shorter way",
        (AxisKind::Rotary, true, Some(Rollover::SignDirected)) => ", the sign of words says the way round",
        (AxisKind::Rotary, true, _) => ", words wind on",
        (AxisKind::Rotary, false, _) => ", between stops",
    };
    let rate = |value: Option<f64>, power: &str, kind| match value {
        Some(v) => format!("{} {unit}/{power}{}", word(v), star(kind)),
        None => "not known".to_owned(),
    };
    format!(
        "  {letter:<2} {range}{}{wrap}; home {} {unit}{}; velocity {} {unit}/min{}; acceleration {}; jerk {}",
        star(AssumedValue::Limits),
        word(axis.home),
        star(AssumedValue::Home),
        short(60.0 * axis.in_word_unit(axis.max_velocity)),
        star(AssumedValue::MaxVelocity),
        rate(axis.max_acceleration, "s²", AssumedValue::MaxAcceleration),
        rate(axis.max_jerk, "s³", AssumedValue::MaxJerk)
    )
}

fn zero_pose(machine: &Machine, file: &MachineFile) -> Vec<String> {
    let zero = AxisValues::zeros(machine.axes().len());
    let pose = machine.forward(&zero, 0.0);
    let axis = machine.cl_point(&zero, 0.0).axis;
    let nose = triple(&pose.translation.vector);
    let mut lines = vec![format!("zero pose: spindle nose at {nose} mm, tool axis {}", triple(&axis))];
    if let Some(k) = machine.first_beyond_limit(&zero) {
        lines.push(format!("  (axis {} cannot be at 0)", machine.axes()[k].letter));
    }
    let takes = file.tool_chains.get(machine.head()).and_then(|c| c.tool_interface.as_ref()).into_iter();
    lines.extend(takes.map(|t| format!("  the nose takes {t}")));
    lines
}

fn bodies_of(machine: &Machine) -> Vec<String> {
    if machine.bodies().is_empty() {
        return vec!["bodies: none, so nothing is tested against the machine itself".to_owned()];
    }
    let on = |link: LinkId| match link {
        LinkId::Bed => "bed".to_owned(),
        LinkId::Row { carrier: Carrier::Head, row } => format!("head, row {row}"),
        LinkId::Row { carrier: Carrier::OtherHead, row } => format!("other head, row {row}"),
        LinkId::Row { carrier: Carrier::Table, row } => format!("table, row {row}"),
    };
    let own = machine.bodies().iter().filter(|b| b.carrier() != Some(Carrier::OtherHead));
    let each = own.map(|b| format!("{} ({}; {} mm)", b.name(), on(b.link), short(b.clearance)));
    vec![format!("bodies (link; clearance): {}", each.collect::<Vec<_>>().join(", "))]
}

/// Describes the hulls of bodies that are meshes: number of vertices, and by how much the volume
/// exceeds that of the mesh.
pub fn describe_hulls(hulls: &[BodyHull]) -> Vec<String> {
    let mut lines = Vec::new();
    if !hulls.is_empty() {
        lines.push("bodies that are meshes, tested as their convex hulls".to_owned());
    }
    lines.extend(hulls.iter().map(|hull| {
        let larger = match hull.excess() {
            Some(excess) => format!("{:.1} % more volume than the mesh", 100.0 * excess),
            None => "the mesh is not closed, so there is no volume to compare with".to_owned(),
        };
        format!("  {} ({}): {} vertices, {larger}", hull.body, hull.file, hull.n_vertices)
    }));
    lines
}

fn reach_lines(reach: &AxisReach) -> Vec<String> {
    let deg = |angle: f64| format!("{:.2}°", angle.to_degrees());
    let mut lines = vec![format!(
        "reach of the tool axis: {:.1} % of all directions, {} to {} from the table's z; every direction up to {}",
        100.0 * reach.share,
        deg(reach.smallest_tilt),
        deg(reach.largest_tilt),
        deg(reach.full_cone)
    )];
    lines.extend(reach.tip.map(|tip| {
        format!(
            "  computed for the tip {} in the table frame, bare nose, all axes in the middle of their travel: with two linear \
             axes the reach depends on the tip",
            triple(&tip.coords)
        )
    }));
    lines.extend(reach.singular.iter().filter(|s| s.is_reached).map(|s| {
        format!("singular: with the tool along {} axis {} has no effect on it", triple(&s.direction), s.axis)
    }));
    lines
}

fn assumed_line(file: &MachineFile) -> String {
    if file.assumed.is_empty() {
        return "assumed values: none are marked".to_owned();
    }
    let one =
        |a: &facemill_inverse_kinematics::machine_file::AssumedFile| match (a.value.is_of_axes(), a.axes.is_empty()) {
            (false, _) => a.value.as_str().to_owned(),
            (true, true) => format!("{} of all axes", a.value.as_str()),
            (true, false) => format!("{} of {}", a.value.as_str(), a.axes.join(" ")),
        };
    let all: Vec<String> = file.assumed.iter().map(one).collect();
    format!("assumed values, to be replaced by those of the machine before a program is run: {}", all.join(", "))
}

struct RoundTrip {
    /// Largest errors, mm and rad.
    worst: [f64; 2],
    /// Number of poses that no solution returns.
    lost: usize,
}

/// Solves poses from seeded axis values within the limits and drives them again.
fn round_trip(machine: &Machine) -> RoundTrip {
    let mut random = SplitMix64(1);
    let mut trip = RoundTrip { worst: [0.0; 2], lost: 0 };
    for _ in 0..POSES {
        let q = within_limits(machine, &mut random);
        let cl = machine.cl_point(&q, TOOL_LENGTH);
        let Ok(solutions) = machine.inverse_near(&cl, TOOL_LENGTH, &q) else {
            trip.lost += 1;
            continue;
        };
        let mut found = false;
        for solution in solutions.iter() {
            let reached = machine.cl_point(&solution.values, TOOL_LENGTH);
            trip.worst[0] = trip.worst[0].max((reached.tip - cl.tip).norm());
            trip.worst[1] = trip.worst[1].max((*reached.axis - *cl.axis).norm());
            let same = |k: usize| {
                let d = solution.values.get_or_zero(k) - q.get_or_zero(k);
                let d = if machine.axes()[k].kind == AxisKind::Rotary { 2.0 * (0.5 * d).sin() } else { d };
                d.abs() < 1e-4
            };
            found |= (0..machine.axes().len()).all(same);
        }
        trip.lost += usize::from(!found);
    }
    trip
}

fn within_limits(machine: &Machine, random: &mut SplitMix64) -> AxisValues {
    AxisValues::from_fn(machine.axes().len(), |k| {
        let axis = &machine.axes()[k];
        let (min, max) = if axis.endless { (-3.0, 3.0) } else { (axis.min, axis.max) };
        min + (max - min) * random.unit()
    })
}

#[cfg(test)]
#[path = "../tests/unit/machine_check.rs"]
mod tests;
