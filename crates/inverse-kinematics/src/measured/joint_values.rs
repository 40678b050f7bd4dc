use crate::machine_file::assumed::AssumedValue;
use crate::machine_file::{Joint, RevoluteRange, Sense};
use crate::measured::{MeasureError, ReportedValue};

/// Measured values of one axis, in the units of machine files: mm, mm/min, mm/s², mm/s³ for a
/// linear axis, deg in place of mm for a rotary one.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AxisMeasurement {
    /// Address: X, Y, Z, A, B or C.
    pub axis: String,
    /// Smallest and largest value; `Endless` for a rotary axis without stops.
    pub limits: Option<AxisLimits>,
    /// Home position.
    pub home: Option<f64>,
    /// Rapid velocity.
    pub max_velocity: Option<f64>,
    /// Largest acceleration.
    pub max_acceleration: Option<f64>,
    /// Largest jerk.
    pub max_jerk: Option<f64>,
    /// Sense in which the axis counts.
    pub sense: Option<MeasuredSense>,
}

/// Sense in which an axis counts, compared with ISO 841.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MeasuredSense {
    /// As ISO 841 has it.
    Iso,
    /// Against ISO 841, as rotary tables of LinuxCNC's old convention do.
    Reversed,
}

impl MeasuredSense {
    /// Returns its name: `iso` or `reversed`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Iso => "iso",
            Self::Reversed => "reversed",
        }
    }
}

impl AxisMeasurement {
    pub(crate) fn is_reversed(&self) -> bool {
        self.sense == Some(MeasuredSense::Reversed)
    }
}

/// Travel of an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AxisLimits {
    /// From the first to the second value, mm or deg.
    Between(f64, f64),
    /// Without stops.
    Endless,
}

/// All values of axes, and the axes for which nobody measured them.
pub(crate) struct JointValues {
    pub(crate) values: Vec<ReportedValue>,
    pub(crate) unmeasured: Vec<(AssumedValue, Vec<String>)>,
}

/// Kind of an axis's values: key, kind in machine files, and whether an entry has one.
type ValueKind = (&'static str, AssumedValue, fn(&AxisMeasurement) -> bool);

/// Puts measured values into joints.
pub(crate) fn replace_values(
    joints: &mut [&mut Joint],
    measured: &[AxisMeasurement],
) -> Result<JointValues, MeasureError> {
    let none = AxisMeasurement::default();
    let entries: Vec<&AxisMeasurement> =
        joints.iter().map(|joint| measured.iter().find(|entry| entry.axis == joint.axis()).unwrap_or(&none)).collect();
    for (joint, entry) in joints.iter_mut().zip(&entries) {
        replace(joint, entry)?;
    }
    let kinds: [ValueKind; 5] = [
        ("limits", AssumedValue::Limits, |entry| entry.limits.is_some()),
        ("home", AssumedValue::Home, |entry| entry.home.is_some()),
        ("rapid", AssumedValue::MaxVelocity, |entry| entry.max_velocity.is_some()),
        ("acceleration", AssumedValue::MaxAcceleration, |entry| entry.max_acceleration.is_some()),
        ("jerk", AssumedValue::MaxJerk, |entry| entry.max_jerk.is_some()),
    ];
    let mut all = JointValues { values: Vec::new(), unmeasured: Vec::new() };
    for (key, kind, has) in kinds {
        let mut unmeasured = Vec::new();
        for (joint, entry) in joints.iter().zip(&entries) {
            let is_measured = has(entry);
            let text = format!("{}={}", joint.axis(), text_of(joint, kind));
            all.values.push(ReportedValue { key, text, is_measured });
            if !is_measured {
                unmeasured.push(joint.axis().to_owned());
            }
        }
        all.unmeasured.push((kind, unmeasured));
    }
    let mut unmeasured = Vec::new();
    for (joint, entry) in joints.iter().zip(&entries) {
        let is_measured = entry.sense.is_some();
        let is_rotary = matches!(**joint, Joint::Revolute(_));
        if is_rotary || is_measured {
            let sense = entry.sense.unwrap_or(MeasuredSense::Iso);
            let text = format!("{}={}", joint.axis(), sense.name());
            all.values.push(ReportedValue { key: "sense", text, is_measured });
        }
        if is_rotary && !is_measured {
            unmeasured.push(joint.axis().to_owned());
        }
    }
    all.unmeasured.push((AssumedValue::Sense, unmeasured));
    Ok(all)
}

fn replace(joint: &mut Joint, entry: &AxisMeasurement) -> Result<(), MeasureError> {
    let axis = joint.axis().to_owned();
    if let Some(AxisLimits::Between(min, max)) = entry.limits {
        let ordered = min.is_finite() && max.is_finite() && min <= max;
        if !ordered {
            return Err(MeasureError::Limits { axis, min, max });
        }
    }
    let reversed = entry.is_reversed();
    let range = entry.limits.unwrap_or_else(|| if reversed { mirrored(range_of(joint)) } else { range_of(joint) });
    let reading = |preset: f64| if reversed { 0.0 - preset } else { preset };
    match joint {
        Joint::Prismatic(j) => {
            let AxisLimits::Between(min, max) = range else { return Err(MeasureError::EndlessLinear { axis }) };
            (j.min_mm, j.max_mm) = (min, max);
            j.home_mm = home(axis, entry, reading(j.home_mm), range)?;
            j.sense = turned(j.sense, reversed);
            j.max_velocity_mm_min = entry.max_velocity.unwrap_or(j.max_velocity_mm_min);
            j.max_acceleration_mm_s2 = entry.max_acceleration.or(j.max_acceleration_mm_s2);
            j.max_jerk_mm_s3 = entry.max_jerk.or(j.max_jerk_mm_s3);
        }
        Joint::Revolute(j) => {
            j.range = match range {
                AxisLimits::Between(min_deg, max_deg) => RevoluteRange::Limited { min_deg, max_deg },
                AxisLimits::Endless => RevoluteRange::Endless,
            };
            j.home_deg = home(axis, entry, reading(j.home_deg), range)?;
            j.sense = turned(j.sense, reversed);
            j.max_velocity_deg_min = entry.max_velocity.unwrap_or(j.max_velocity_deg_min);
            j.max_acceleration_deg_s2 = entry.max_acceleration.or(j.max_acceleration_deg_s2);
            j.max_jerk_deg_s3 = entry.max_jerk.or(j.max_jerk_deg_s3);
        }
    }
    Ok(())
}

fn range_of(joint: &Joint) -> AxisLimits {
    match joint {
        Joint::Prismatic(j) => AxisLimits::Between(j.min_mm, j.max_mm),
        Joint::Revolute(j) => match j.range {
            RevoluteRange::Limited { min_deg, max_deg } => AxisLimits::Between(min_deg, max_deg),
            RevoluteRange::Endless => AxisLimits::Endless,
        },
    }
}

/// Returns the readings of a range on a scale that counts the other way.
fn mirrored(range: AxisLimits) -> AxisLimits {
    match range {
        AxisLimits::Between(min, max) => AxisLimits::Between(0.0 - max, 0.0 - min),
        AxisLimits::Endless => AxisLimits::Endless,
    }
}

/// Returns the measured home, else the preset's, moved into the limits.
fn home(axis: String, entry: &AxisMeasurement, preset: f64, range: AxisLimits) -> Result<f64, MeasureError> {
    let AxisLimits::Between(min, max) = range else { return Ok(entry.home.unwrap_or(preset)) };
    match entry.home {
        Some(home) if !(min..=max).contains(&home) => Err(MeasureError::HomeOutside { axis, home, min, max }),
        Some(home) => Ok(home),
        None => Ok(preset.clamp(min, max)),
    }
}

fn turned(sense: Sense, reversed: bool) -> Sense {
    match (sense, reversed) {
        (Sense::Positive, true) => Sense::Negative,
        (Sense::Negative, true) => Sense::Positive,
        (sense, false) => sense,
    }
}

fn text_of(joint: &Joint, kind: AssumedValue) -> String {
    let (home, velocity, acceleration, jerk) = match joint {
        Joint::Prismatic(j) => (j.home_mm, j.max_velocity_mm_min, j.max_acceleration_mm_s2, j.max_jerk_mm_s3),
        Joint::Revolute(j) => (j.home_deg, j.max_velocity_deg_min, j.max_acceleration_deg_s2, j.max_jerk_deg_s3),
    };
    let optional = |value: Option<f64>| value.map_or("none".to_owned(), |v| v.to_string());
    match kind {
        AssumedValue::Limits => match range_of(joint) {
            AxisLimits::Between(min, max) => format!("{min}:{max}"),
            AxisLimits::Endless => "endless".to_owned(),
        },
        AssumedValue::Home => home.to_string(),
        AssumedValue::MaxVelocity => velocity.to_string(),
        AssumedValue::MaxAcceleration => optional(acceleration),
        _ => optional(jerk),
    }
}
