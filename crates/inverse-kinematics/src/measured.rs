//! Machine files from the values that a person can measure on a machine of a common family, and
//! machine files compared with measured poses.
//!
//! Chains and joints are those of the family's preset; measured values replace its numbers, and the
//! rows are made anew from the lines of the axes.

pub(crate) mod family;
pub(crate) mod joint_values;
pub(crate) mod places;
pub(crate) mod touches;

pub use crate::measured::family::{MeasuredFamily, MeasuredLean};
pub use crate::measured::joint_values::{AxisLimits, AxisMeasurement, MeasuredSense};
pub use crate::measured::places::PlaceMeasurements;
pub use crate::measured::touches::{
    Readings, SignFault, SwappedSign, TouchCheck, TouchError, Touches, check_touches, pivot_point,
};

use nalgebra::Vector3;

use crate::machine::Machine;
use crate::machine_file::assumed::{AssumedFile, AssumedValue};
use crate::machine_file::axis_lines::rows_from_axes;
use crate::machine_file::error::MachineError;
use crate::machine_file::{Joint, MachineFile};
use crate::measured::joint_values::replace_values;
use crate::measured::places::Lines;

/// Measured values of a machine; those left out are the preset's.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Measurements {
    /// Places of table and axes.
    pub places: PlaceMeasurements,
    /// Values of single axes, at most one entry for an axis.
    pub axes: Vec<AxisMeasurement>,
}

/// A value of a machine made from measurements.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ReportedValue {
    /// Name, such as `table_tilt`, `limits` or `sense`.
    pub key: &'static str,
    /// The value: `0,0,110` in mm, `B=-120:120` in mm or deg, `C=iso` or `C=reversed`, `+y`.
    pub text: String,
    /// False where the preset gave it.
    pub is_measured: bool,
}

/// A machine made from measurements.
#[derive(Clone, Debug, PartialEq)]
pub struct MeasuredMachine {
    /// Its file: without bodies, and with all values that were not measured under `assumed`.
    pub file: MachineFile,
    /// Its values: places, then limits, homes and rates of all axes, then the senses of rotary
    /// axes and of those that have a measured one.
    pub values: Vec<ReportedValue>,
}

/// Reason why measurements make no machine. Keys are names of fields.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MeasureError {
    /// A place that machines of the family lack.
    #[error("{key} is no value of {family}, which has {known}")]
    NotOfFamily {
        /// The place.
        key: &'static str,
        /// The family.
        family: MeasuredFamily,
        /// Places of the family.
        known: String,
    },
    /// An axis that machines of the family lack.
    #[error("{axis} is no axis of {family}, which has X, Y, Z, {rotary}")]
    NoSuchAxis {
        /// Address.
        axis: String,
        /// The family.
        family: MeasuredFamily,
        /// Rotary axes of the family.
        rotary: String,
    },
    /// Two entries for one axis.
    #[error("{axis} has two entries")]
    AxisTwice {
        /// Address.
        axis: String,
    },
    /// A length that is not finite or beyond that of any machine.
    #[error("{key} has {value} mm, beyond the {most} mm of machine files")]
    Length {
        /// The place.
        key: &'static str,
        /// Value, mm.
        value: f64,
        /// Largest length, mm.
        most: f64,
    },
    /// A pivot length that is not above 0.
    #[error("pivot_length is {value} mm, but it is measured from the nose up and has to be above 0: turn its sign")]
    PivotLength {
        /// Value, mm.
        value: f64,
    },
    /// Limits whose end is below their beginning, or that are not finite.
    #[error("limits of {axis} are {min} to {max}: the first has to be the smaller one")]
    Limits {
        /// Address.
        axis: String,
        /// Lower end, mm or deg.
        min: f64,
        /// Upper end, mm or deg.
        max: f64,
    },
    /// A linear axis without limits.
    #[error("limits of {axis} are endless, but it is a linear axis")]
    EndlessLinear {
        /// Address.
        axis: String,
    },
    /// A home position outside the limits.
    #[error("home of {axis} is {home}, outside its limits {min} to {max}")]
    HomeOutside {
        /// Address.
        axis: String,
        /// Home, mm or deg.
        home: f64,
        /// Lower limit.
        min: f64,
        /// Upper limit.
        max: f64,
    },
    /// The values are not those of a machine.
    #[error(transparent)]
    Machine(#[from] MachineError),
}

impl MeasureError {
    /// Returns the name of the value at fault where there is one: `table_tilt`, `limits`, `home`.
    pub fn key(&self) -> Option<&'static str> {
        match self {
            Self::NotOfFamily { key, .. } | Self::Length { key, .. } => Some(key),
            Self::PivotLength { .. } => Some("pivot_length"),
            Self::Limits { .. } | Self::EndlessLinear { .. } => Some("limits"),
            Self::HomeOutside { .. } => Some("home"),
            _ => None,
        }
    }
}

/// Returns the machine of a family with these measured values.
///
/// Without any it moves as the family's preset does. A home position that nobody measured is the
/// preset's, or the nearest one within measured limits; limits and home of the preset are turned
/// to the readings of a reversed axis. Rotary axes whose sense nobody measured count as ISO 841 has
/// it, and the file lists that under `assumed`. The file has no bodies: those of a preset are not
/// those of the machine.
///
/// ```
/// use facemill_inverse_kinematics::Machine;
/// use facemill_inverse_kinematics::measured::*;
///
/// let mut measured = Measurements::default();
/// measured.places.table_tilt = Some([0.0, 0.0, 62.5]);
/// let made = machine_from_measurements(MeasuredFamily::TableTableBc, &measured)?;
/// assert_eq!(Machine::from_file(made.file)?.family().to_string(), "table-table B-C");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// With the key or axis of a value that the family lacks, that contradicts another one, or that no
/// machine has.
pub fn machine_from_measurements(
    family: MeasuredFamily,
    measured: &Measurements,
) -> Result<MeasuredMachine, MeasureError> {
    let mut file = Machine::from_json(family.preset_text().as_bytes())?.to_file();
    check_axes(family, &file, &measured.axes)?;
    let mut lines = Lines::of(family, &file);
    let (mut values, unmeasured_places) = lines.measure(&measured.places, reading_signs(&measured.axes))?;
    let mut assumed = vec![(AssumedValue::Dimensions, unmeasured_places)];
    let mut joints: Vec<&mut Joint> = lines.joints().collect();
    joints.sort_by_key(|joint| "XYZABC".find(joint.axis()));
    let rates = replace_values(&mut joints, &measured.axes)?;
    values.extend(rates.values);
    assumed.extend(rates.unmeasured);

    file.workpiece_chain.rows = rows_from_axes(&lines.table, &lines.bed_from_table());
    file.tool_chains[0].rows = rows_from_axes(&lines.head, &lines.bed_from_nose());
    file.bed_bodies = Vec::new();
    file.name = format!("measured machine, {family}");
    file.source = Some(format!("measured; values under assumed: preset {}", family.preset_name()));
    let n_axes = file.joints().count();
    let listed = |(value, axes): (AssumedValue, Vec<String>)| {
        let all = axes.len() == n_axes;
        (!axes.is_empty()).then(|| AssumedFile { value, axes: if all { Vec::new() } else { axes } })
    };
    file.assumed = assumed.into_iter().filter_map(listed).collect();
    let whole = |value| AssumedFile { value, axes: Vec::new() };
    file.assumed.extend([AssumedValue::Motion, AssumedValue::Feed].map(whole));
    Machine::from_file(file.clone())?;
    Ok(MeasuredMachine { file, values })
}

fn check_axes(family: MeasuredFamily, file: &MachineFile, axes: &[AxisMeasurement]) -> Result<(), MeasureError> {
    for (k, entry) in axes.iter().enumerate() {
        let axis = entry.axis.clone();
        if !file.joints().any(|joint| joint.axis() == axis) {
            let rotary = format!("{}, C", family.tilting_axis());
            return Err(MeasureError::NoSuchAxis { axis, family, rotary });
        }
        if axes[..k].iter().any(|other| other.axis == axis) {
            return Err(MeasureError::AxisTwice { axis });
        }
    }
    Ok(())
}

/// Returns −1 for each of X, Y, Z whose readings grow against ISO 841, else 1.
fn reading_signs(axes: &[AxisMeasurement]) -> Vector3<f64> {
    let is_reversed = |axis: &str| axes.iter().any(|entry| entry.axis == axis && entry.is_reversed());
    Vector3::from(["X", "Y", "Z"].map(|axis| if is_reversed(axis) { -1.0 } else { 1.0 }))
}
