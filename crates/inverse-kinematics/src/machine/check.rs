use crate::axes::axis::{Axis, AxisKind, AxisLetter, Carrier, Rollover};
use crate::machine::limits::beyond_limits;
use crate::machine_file::error::{FieldProblem, MachineError};
use crate::machine_file::{
    BodyFile, DhRow, FeedFile, Joint, MachineFile, MotionFile, PrismaticJoint, RevoluteJoint, RevoluteRange, ShapeFile,
};

pub(crate) type Checked = Result<(), MachineError>;

pub(crate) fn fail(field: String, axis: Option<&str>, problem: FieldProblem) -> MachineError {
    MachineError::Field { field, axis: axis.map(str::to_owned), problem }
}

pub(crate) fn check_name(field: &str, name: &str) -> Checked {
    if name.trim().is_empty() {
        return Err(fail(field.to_owned(), None, FieldProblem::Empty));
    }
    Ok(())
}

pub(crate) fn finite(field: String, axis: Option<&str>, value: f64) -> Checked {
    if value.is_finite() { Ok(()) } else { Err(fail(field, axis, FieldProblem::NotFinite)) }
}

/// Checks that a value is in the range of its key.
pub(crate) fn limited(field: String, axis: Option<&str>, value: f64) -> Checked {
    finite(field.clone(), axis, value)?;
    beyond_limits(&field, value).map_or(Ok(()), |problem| Err(fail(field, axis, problem)))
}

fn positive(field: String, axis: Option<&str>, value: f64) -> Checked {
    finite(field.clone(), axis, value)?;
    if value > 0.0 { Ok(()) } else { Err(fail(field, axis, FieldProblem::NotPositive { value })) }
}

fn not_negative(field: String, axis: Option<&str>, value: f64) -> Checked {
    finite(field.clone(), axis, value)?;
    if value >= 0.0 { Ok(()) } else { Err(fail(field, axis, FieldProblem::Negative { value })) }
}

/// Largest length on a machine, mm: a kilometre.
const FARTHEST: f64 = 1e6;

pub(crate) fn length(field: String, axis: Option<&str>, value: f64) -> Checked {
    finite(field.clone(), axis, value)?;
    let is_near = value.abs() <= FARTHEST;
    if is_near { Ok(()) } else { Err(fail(field, axis, FieldProblem::TooFar { value, largest: FARTHEST })) }
}

fn range(field: String, axis: Option<&str>, min: f64, max: f64) -> Checked {
    if max < min { Err(fail(field, axis, FieldProblem::EmptyRange { min, max })) } else { Ok(()) }
}

pub(crate) fn check_row(field: &str, row: &DhRow) -> Checked {
    let axis = row.joint.as_ref().map(|j| match j {
        Joint::Prismatic(j) => j.axis.as_str(),
        Joint::Revolute(j) => j.axis.as_str(),
    });
    let values = [("a_mm", row.a_mm), ("alpha_deg", row.alpha_deg), ("d_mm", row.d_mm), ("theta_deg", row.theta_deg)];
    for (key, value) in values {
        let field = format!("{field}.{key}");
        if key.ends_with("_mm") { length(field, axis, value)? } else { limited(field, axis, value)? }
    }
    check_bodies(&format!("{field}.bodies"), &row.bodies)
}

/// Returns the axis of a joint, in mm, rad and s.
pub(crate) fn joint_axis(field: &str, joint: &Joint, carrier: Carrier) -> Result<Axis, MachineError> {
    match joint {
        Joint::Prismatic(j) => prismatic_axis(&format!("{field}.joint.prismatic"), j, carrier),
        Joint::Revolute(j) => revolute_axis(&format!("{field}.joint.revolute"), j, carrier),
    }
}

fn prismatic_axis(field: &str, j: &PrismaticJoint, carried_by: Carrier) -> Result<Axis, MachineError> {
    let axis = Some(j.axis.as_str());
    let key = |key: &str| format!("{field}.{key}");
    let letter = letter(field, &j.axis)?;
    for (name, value) in [("min_mm", j.min_mm), ("max_mm", j.max_mm), ("home_mm", j.home_mm)] {
        length(key(name), axis, value)?;
    }
    range(key("max_mm"), axis, j.min_mm, j.max_mm)?;
    home_inside(key("home_mm"), axis, j.home_mm, j.min_mm, j.max_mm)?;
    limited(key("max_velocity_mm_min"), axis, j.max_velocity_mm_min)?;
    for (name, value) in [("max_acceleration_mm_s2", j.max_acceleration_mm_s2), ("max_jerk_mm_s3", j.max_jerk_mm_s3)] {
        value.map_or(Ok(()), |v| limited(key(name), axis, v))?;
    }
    Ok(Axis {
        letter,
        kind: AxisKind::Linear,
        min: j.min_mm,
        max: j.max_mm,
        max_velocity: j.max_velocity_mm_min / 60.0,
        max_acceleration: j.max_acceleration_mm_s2,
        max_jerk: j.max_jerk_mm_s3,
        home: j.home_mm,
        endless: false,
        max_wind_up: None,
        rollover: None,
        carried_by,
    })
}

fn revolute_axis(field: &str, j: &RevoluteJoint, carried_by: Carrier) -> Result<Axis, MachineError> {
    let axis = Some(j.axis.as_str());
    let key = |key: &str| format!("{field}.{key}");
    let letter = letter(field, &j.axis)?;
    limited(key("home_deg"), axis, j.home_deg)?;
    let (min, max) = match j.range {
        RevoluteRange::Limited { min_deg, max_deg } => {
            limited(key("range.limited.min_deg"), axis, min_deg)?;
            limited(key("range.limited.max_deg"), axis, max_deg)?;
            range(key("range.limited.max_deg"), axis, min_deg, max_deg)?;
            home_inside(key("home_deg"), axis, j.home_deg, min_deg, max_deg)?;
            (min_deg.to_radians(), max_deg.to_radians())
        }
        RevoluteRange::Endless => (f64::NEG_INFINITY, f64::INFINITY),
    };
    let max_wind_up = wind_up(field, j)?;
    let home = j.home_deg.to_radians();
    let (min, max) = max_wind_up.map_or((min, max), |far| (home - far, home + far));
    limited(key("max_velocity_deg_min"), axis, j.max_velocity_deg_min)?;
    for (name, value) in
        [("max_acceleration_deg_s2", j.max_acceleration_deg_s2), ("max_jerk_deg_s3", j.max_jerk_deg_s3)]
    {
        value.map_or(Ok(()), |v| limited(key(name), axis, v))?;
    }
    Ok(Axis {
        letter,
        kind: AxisKind::Rotary,
        min,
        max,
        max_velocity: j.max_velocity_deg_min.to_radians() / 60.0,
        max_acceleration: j.max_acceleration_deg_s2.map(f64::to_radians),
        max_jerk: j.max_jerk_deg_s3.map(f64::to_radians),
        home,
        endless: j.range == RevoluteRange::Endless && max_wind_up.is_none(),
        max_wind_up,
        rollover: j.rollover,
        carried_by,
    })
}

/// Returns the largest wind-up of an axis from home, rad, after refusing contradictory keys.
fn wind_up(field: &str, j: &RevoluteJoint) -> Result<Option<f64>, MachineError> {
    let axis = Some(j.axis.as_str());
    let problem = |key: &str, problem| Err(fail(format!("{field}.{key}"), axis, problem));
    let rolls = matches!(j.rollover, Some(Rollover::Shortest | Rollover::SignDirected));
    if j.range != RevoluteRange::Endless && rolls {
        return problem("rollover", FieldProblem::OnlyEndless);
    }
    let Some(turns) = j.max_wind_up_turns else { return Ok(None) };
    if j.range != RevoluteRange::Endless {
        return problem("max_wind_up_turns", FieldProblem::OnlyEndless);
    }
    if rolls {
        return problem("max_wind_up_turns", FieldProblem::RollsOver);
    }
    limited(format!("{field}.max_wind_up_turns"), axis, turns)?;
    Ok(Some(turns * std::f64::consts::TAU))
}

fn letter(field: &str, axis: &str) -> Result<AxisLetter, MachineError> {
    AxisLetter::parse(axis).ok_or_else(|| fail(format!("{field}.axis"), Some(axis), FieldProblem::NoAxisLetter))
}

fn home_inside(field: String, axis: Option<&str>, home: f64, min: f64, max: f64) -> Checked {
    if (min..=max).contains(&home) {
        return Ok(());
    }
    Err(fail(field, axis, FieldProblem::HomeOutside { home, min, max }))
}

pub(crate) fn check_bodies(field: &str, bodies: &[BodyFile]) -> Checked {
    for (k, body) in bodies.iter().enumerate() {
        let field = format!("{field}[{k}]");
        check_name(&format!("{field}.name"), &body.name)?;
        for (i, (place, angle)) in body.position_mm.into_iter().zip(body.rotation_xyz_deg).enumerate() {
            length(format!("{field}.position_mm[{i}]"), None, place)?;
            limited(format!("{field}.rotation_xyz_deg[{i}]"), None, angle)?;
        }
        not_negative(format!("{field}.clearance_mm"), None, body.clearance_mm)?;
        length(format!("{field}.clearance_mm"), None, body.clearance_mm)?;
        check_shape(&format!("{field}.shape"), &body.shape)?;
    }
    Ok(())
}

fn check_shape(field: &str, shape: &ShapeFile) -> Checked {
    let positive = |field: String, axis: Option<&str>, value: f64| {
        positive(field.clone(), axis, value)?;
        length(field, axis, value)
    };
    let not_negative = |field: String, axis: Option<&str>, value: f64| {
        not_negative(field.clone(), axis, value)?;
        length(field, axis, value)
    };
    match *shape {
        ShapeFile::Box { size_mm } => size_mm
            .into_iter()
            .enumerate()
            .try_for_each(|(i, v)| positive(format!("{field}.box.size_mm[{i}]"), None, v)),
        ShapeFile::Cylinder { radius_mm, height_mm } => {
            positive(format!("{field}.cylinder.radius_mm"), None, radius_mm)?;
            positive(format!("{field}.cylinder.height_mm"), None, height_mm)
        }
        ShapeFile::Frustum { radius_low_mm, radius_high_mm, height_mm } => {
            not_negative(format!("{field}.frustum.radius_low_mm"), None, radius_low_mm)?;
            not_negative(format!("{field}.frustum.radius_high_mm"), None, radius_high_mm)?;
            positive(format!("{field}.frustum.height_mm"), None, height_mm)
        }
        ShapeFile::Mesh(ref mesh) => {
            check_name(&format!("{field}.mesh.file"), &mesh.file)?;
            mesh.read(&format!("{field}.mesh")).map(|_| ())
        }
    }
}

pub(crate) fn check_motion(motion: &MotionFile) -> Checked {
    let tolerance = &motion.control_tolerance;
    limited("motion.control_tolerance.path_mm".to_owned(), None, tolerance.path_mm)?;
    limited("motion.control_tolerance.orientation_deg".to_owned(), None, tolerance.orientation_deg)
}

pub(crate) fn check_tool_change(seconds: Option<f64>) -> Checked {
    seconds.map_or(Ok(()), |seconds| limited("tool_change_s".to_owned(), None, seconds))
}

pub(crate) fn check_feed(feed: &FeedFile) -> Checked {
    limited("feed.min_mm_min".to_owned(), None, feed.min_mm_min)?;
    limited("feed.max_mm_min".to_owned(), None, feed.max_mm_min)?;
    range("feed.max_mm_min".to_owned(), None, feed.min_mm_min, feed.max_mm_min)?;
    feed.rapid_mm_min.map_or(Ok(()), |v| limited("feed.rapid_mm_min".to_owned(), None, v))
}

/// Checks that the items marked as assumed exist.
pub(crate) fn check_assumed(file: &MachineFile) -> Checked {
    if let Some(source) = &file.source {
        check_name("source", source)?;
    }
    for (k, chain) in file.tool_chains.iter().enumerate() {
        if let Some(interface) = &chain.tool_interface {
            check_name(&format!("tool_chains[{k}].tool_interface"), interface)?;
        }
    }
    for (k, assumed) in file.assumed.iter().enumerate() {
        for (i, axis) in assumed.axes.iter().enumerate() {
            let field = format!("assumed[{k}].axes[{i}]");
            if !assumed.value.is_of_axes() {
                return Err(fail(field, Some(axis), FieldProblem::NotOfAnAxis));
            }
            if !file.joints().any(|j| j.axis() == axis) {
                return Err(fail(field, Some(axis), FieldProblem::NoSuchAxis));
            }
        }
    }
    Ok(())
}
