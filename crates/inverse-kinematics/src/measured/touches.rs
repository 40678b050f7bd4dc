//! Machine files compared with measured poses: readings of the axes with the tip on one point.

use std::fmt;

use nalgebra::{Point3, Vector3};

use crate::axes::axis::AxisKind;
use crate::axes::axis_values::AxisValues;
use crate::machine::Machine;
use crate::machine_file::error::MachineError;
use crate::machine_file::{Joint, LineChain, LineFile, MachineFile, Sense};

/// Readings of the axes in a pose, mm or deg, by address.
pub type Readings = Vec<(String, f64)>;

/// Measured poses of a machine with one head, RTCP off: the tip of a tool of known length touches
/// one and the same point of the table in all of them.
#[derive(Clone, Debug, PartialEq)]
pub struct Touches {
    /// Readings of all axes in each pose. At least two poses, with different rotary readings; one
    /// is enough where `point` is given.
    pub poses: Vec<Readings>,
    /// Distance from the gauge line to the tip, mm, from 0.
    pub tool_length: f64,
    /// Place of the point in the table frame, mm, where it is known. Without it a machine that is
    /// mirrored as a whole agrees, too, so senses of linear axes are taken as right.
    pub point: Option<[f64; 3]>,
    /// Largest distance of two tips that counts as none, mm, above 0: error of the measurements.
    pub tolerance: f64,
}

/// A sign of a machine file that can be swapped.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum SwappedSign {
    /// The sense in which an axis counts.
    Sense {
        /// Address.
        axis: String,
    },
    /// A coordinate of the pivot of a rotary axis: of the table seen from the table's origin, of
    /// the head seen from the spindle nose, all axes at 0.
    Place {
        /// Address.
        axis: String,
        /// Whether the table carries it.
        on_table: bool,
        /// Coordinate: X, Y or Z.
        coordinate: char,
    },
    /// A coordinate of the spindle nose seen from the table's origin, all axes at 0.
    TableAt {
        /// Coordinate: X, Y or Z.
        coordinate: char,
    },
}

/// Signs whose swap brings the tips together.
#[derive(Clone, Debug, PartialEq)]
pub struct SignFault {
    /// One sign, or two where no single one does.
    pub signs: Vec<SwappedSign>,
    /// Largest distance of two tips with these signs swapped, mm.
    pub apart: f64,
}

/// Result of [`check_touches`].
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct TouchCheck {
    /// Largest distance of two tips in the table frame by the file, mm; with a known point, of a
    /// tip from it, too.
    pub apart: f64,
    /// Whether the file agrees with the poses: `apart` is within the tolerance.
    pub agrees: bool,
    /// Readings beyond the limits of the file: number of the pose from 1, address, reading.
    pub beyond_limits: Vec<(usize, String, f64)>,
    /// Swaps that explain poses that do not agree, the closest first; empty if none of one sign or
    /// two does.
    pub faults: Vec<SignFault>,
    /// Signs of a file that agrees which these poses do not test: swapped, it would agree as well.
    pub untested: Vec<SwappedSign>,
}

/// Reason why poses cannot be compared with a file.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TouchError {
    /// A machine with two heads.
    #[error("the machine has {heads} heads; measured poses are compared with machines of one head")]
    Heads {
        /// Number of heads.
        heads: usize,
    },
    /// Too few poses.
    #[error(
        "{poses} pose(s) test nothing: give two that touch the same point with other rotary readings, or the point"
    )]
    TooFew {
        /// Number of poses.
        poses: usize,
    },
    /// All poses have the same rotary readings.
    #[error("the rotary readings of all poses are the same, so they test nothing: turn the rotary axes between them")]
    SameRotaries,
    /// A pose without a reading of an axis.
    #[error("pose {pose} has no reading of {axis}; give all of {axes}")]
    Missing {
        /// Number of the pose, from 1.
        pose: usize,
        /// Address.
        axis: String,
        /// Axes of the machine.
        axes: String,
    },
    /// A reading of an axis that the machine lacks, or a second one.
    #[error("pose {pose} has a reading of {axis} too many; the machine has {axes}")]
    TooMany {
        /// Number of the pose, from 1.
        pose: usize,
        /// Address.
        axis: String,
        /// Axes of the machine.
        axes: String,
    },
    /// A number that is not finite or beyond that of any machine.
    #[error("{what} is {value}: give a number of mm or deg {range}")]
    Number {
        /// Its name: `X of pose 1`, `tool length`.
        what: String,
        /// The number.
        value: f64,
        /// Range that it may have: `above 0 up to 1000000`.
        range: &'static str,
    },
    /// The file describes no machine.
    #[error(transparent)]
    Machine(#[from] MachineError),
}

/// Largest reading, mm or deg.
const LARGEST: f64 = 1e6;

/// Range of readings of both signs.
const EITHER: &str = "from -1000000 to 1000000";

/// Distance below which a swap does not move a line, mm.
const SAME_PLACE: f64 = 1e-6;

/// Compares a machine file with measured poses, and finds signs whose swap explains a difference:
/// senses of axes, places of rotary axes, and the place of the nose above the table.
///
/// Tip and table are those of the forward solution. First each sign alone is swapped, then every
/// pair of them. Signs that no pose distinguishes are all listed. Senses of linear axes are
/// among them where the point is known.
///
/// ```
/// use facemill_inverse_kinematics::machine_file::MachineFile;
/// use facemill_inverse_kinematics::measured::{Touches, check_touches};
/// use facemill_inverse_kinematics::preset;
///
/// let file: MachineFile = serde_json::from_str(preset("table-table-b-c").unwrap())?;
/// let pose = |readings: [f64; 5]| {
///     ["X", "Y", "Z", "B", "C"].map(str::to_owned).into_iter().zip(readings).collect()
/// };
/// // A point 100 mm beside C, touched at C 0 and 90: this table counts against ISO 841.
/// let poses = vec![pose([100.0, 0.0, -500.0, 0.0, 0.0]), pose([0.0, 100.0, -500.0, 0.0, 90.0])];
/// let touches = Touches { poses, tool_length: 150.0, point: None, tolerance: 0.1 };
/// let check = check_touches(&file, &touches)?;
/// assert!(!check.agrees && check.faults[0].signs[0].to_string() == "sense of C");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// For two heads, too few poses, readings that are missing, too many or no numbers, and files that
/// describe no machine.
pub fn check_touches(file: &MachineFile, touches: &Touches) -> Result<TouchCheck, TouchError> {
    if file.tool_chains.len() != 1 {
        return Err(TouchError::Heads { heads: file.tool_chains.len() });
    }
    let mut file = file.clone().by_lines();
    for chain in [file.workpiece_chain.lines.as_mut(), file.tool_chains[0].lines.as_mut()].into_iter().flatten() {
        chain.axes.iter_mut().for_each(|line| line.bodies.clear());
        put_at_pivots(chain);
    }
    file.bed_bodies.clear();
    let machine = Machine::from_file(file.clone())?;
    let values = axis_values(&machine, touches)?;
    let apart = apart(&machine, &values, touches);
    let agrees = apart <= touches.tolerance;
    let signs = signs_of(&file, touches.point.is_some());
    let with_swapped = |swapped: &[&SwappedSign]| {
        let mut file = file.clone();
        swapped.iter().for_each(|sign| swap(&mut file, sign));
        // A swap keeps directions, so that the family and its solution stay.
        Machine::from_file(file).map_or(f64::INFINITY, |machine| self::apart(&machine, &values, touches))
    };
    let explains = |swapped: &[&SwappedSign]| {
        let apart = with_swapped(swapped);
        let signs = || swapped.iter().map(|sign| (*sign).clone()).collect();
        (apart <= touches.tolerance).then(|| SignFault { signs: signs(), apart })
    };
    let alone: Vec<SignFault> = signs.iter().filter_map(|sign| explains(&[sign])).collect();
    let (mut faults, mut untested) = (Vec::new(), Vec::new());
    if agrees {
        untested = alone.into_iter().flat_map(|fault| fault.signs).collect();
    } else if alone.is_empty() {
        let pairs = signs.iter().enumerate().flat_map(|(k, a)| signs[k + 1..].iter().map(move |b| [a, b]));
        faults = pairs.filter_map(|pair| explains(&pair)).collect();
    } else {
        faults = alone;
    }
    faults.sort_by(|a, b| a.apart.total_cmp(&b.apart));
    Ok(TouchCheck { apart, agrees, beyond_limits: beyond_limits(&machine, &values), faults, untested })
}

/// Returns the axis values of the poses, rad for rotary axes.
fn axis_values(machine: &Machine, touches: &Touches) -> Result<Vec<AxisValues>, TouchError> {
    let numbers = [
        ("tool length", touches.tool_length, 0.0, "from 0 to 1000000"),
        ("tolerance", touches.tolerance, f64::MIN_POSITIVE, "above 0 up to 1000000"),
    ];
    let places = touches.point.iter().flatten().map(|&value| ("point", value, -LARGEST, EITHER));
    for (what, value, least, range) in numbers.into_iter().chain(places) {
        if !(least..=LARGEST).contains(&value) {
            return Err(TouchError::Number { what: what.to_owned(), value, range });
        }
    }
    if touches.poses.len() < if touches.point.is_some() { 1 } else { 2 } {
        return Err(TouchError::TooFew { poses: touches.poses.len() });
    }
    let axes = machine.axes();
    let all = || axes.iter().map(|axis| axis.letter.to_string()).collect::<Vec<_>>().join(", ");
    let mut values = Vec::new();
    for (k, pose) in touches.poses.iter().enumerate() {
        let mut q = AxisValues::zeros(axes.len());
        let mut given = vec![false; axes.len()];
        for (name, reading) in pose {
            let index = machine.axis_index(name).filter(|&index| !given[index]);
            let index = index.ok_or_else(|| TouchError::TooMany { pose: k + 1, axis: name.clone(), axes: all() })?;
            if !(-LARGEST..=LARGEST).contains(reading) {
                return Err(TouchError::Number {
                    what: format!("{name} of pose {}", k + 1),
                    value: *reading,
                    range: EITHER,
                });
            }
            given[index] = true;
            q[index] = if axes[index].kind == AxisKind::Rotary { reading.to_radians() } else { *reading };
        }
        if let Some(missing) = given.iter().position(|is_given| !is_given) {
            let axis = axes[missing].letter.to_string();
            return Err(TouchError::Missing { pose: k + 1, axis, axes: all() });
        }
        values.push(q);
    }
    let is_rotary = |k: &usize| axes[*k].kind == AxisKind::Rotary;
    let same = |q: &AxisValues| (0..axes.len()).filter(is_rotary).all(|k| (q[k] - values[0][k]).abs() < 1e-9);
    if touches.point.is_none() && values.iter().all(same) {
        return Err(TouchError::SameRotaries);
    }
    Ok(values)
}

/// Returns the largest distance of two tips in the table frame, or of a tip from the known point.
fn apart(machine: &Machine, values: &[AxisValues], touches: &Touches) -> f64 {
    let mut tips: Vec<Point3<f64>> = values.iter().map(|q| machine.cl_point(q, touches.tool_length).tip).collect();
    tips.extend(touches.point.map(Point3::from));
    let pairs = tips.iter().enumerate().flat_map(|(k, a)| tips[k + 1..].iter().map(move |b| (a - b).norm()));
    pairs.fold(0.0, f64::max)
}

fn beyond_limits(machine: &Machine, values: &[AxisValues]) -> Vec<(usize, String, f64)> {
    let beyond = |(k, q): (usize, &AxisValues)| {
        let axis = &machine.axes()[machine.first_beyond_limit(q)?];
        let reading = axis.in_word_unit(q[machine.axis_index(axis.letter.as_str())?]);
        Some((k + 1, axis.letter.to_string(), reading))
    };
    values.iter().enumerate().filter_map(beyond).collect()
}

/// Returns all signs of a file of lines whose swap changes it, of linear axes where their senses
/// are in question.
fn signs_of(file: &MachineFile, with_linear: bool) -> Vec<SwappedSign> {
    let [Some(table), Some(head)] = [file.workpiece_chain.lines.as_ref(), file.tool_chains[0].lines.as_ref()] else {
        return Vec::new();
    };
    let mut signs: Vec<SwappedSign> = file
        .joints()
        .filter(|joint| with_linear || matches!(joint, Joint::Revolute(_)))
        .map(|joint| SwappedSign::Sense { axis: joint.axis().to_owned() })
        .collect();
    for (chain, on_table) in [(table, true), (head, false)] {
        for line in &chain.axes {
            for (k, coordinate) in LETTERS.into_iter().enumerate() {
                let moved = mirrored(line, chain.end.position_mm[k], k);
                if moved.is_some_and(|moved| from_line(line, moved) > SAME_PLACE) {
                    let axis = line.joint.axis().to_owned();
                    signs.push(SwappedSign::Place { axis, on_table, coordinate });
                }
            }
        }
    }
    for (k, coordinate) in LETTERS.into_iter().enumerate() {
        if (table.end.position_mm[k] - head.end.position_mm[k]).abs() > SAME_PLACE {
            signs.push(SwappedSign::TableAt { coordinate });
        }
    }
    signs
}

const LETTERS: [char; 3] = ['X', 'Y', 'Z'];

/// Returns the pivot of a rotary axis on its line through `point`: the place next to a centre line
/// through `from` (the spindle's, or the table's z), of a line parallel to it that next to `from`.
/// `direction` and `center` are unit vectors.
pub fn pivot_point(
    point: &Point3<f64>,
    direction: &Vector3<f64>,
    from: &Point3<f64>,
    center: &Vector3<f64>,
) -> Point3<f64> {
    let way = from - point;
    let cosine = direction.dot(center);
    let along = if cosine.abs() > PARALLEL {
        way.dot(direction)
    } else {
        (way.dot(direction) - way.dot(center) * cosine) / (1.0 - cosine * cosine)
    };
    point + direction * along
}

/// Cosine above which two directions are parallel.
const PARALLEL: f64 = 1.0 - 1e-9;

/// Puts the points of rotary axes at their pivots, whose coordinates a person measures.
fn put_at_pivots(chain: &mut LineChain) {
    let end = chain.end.pose();
    let (from, center) = (Point3::from(end.translation.vector), end.rotation * Vector3::z());
    for line in &mut chain.axes {
        let direction = Vector3::from(line.direction).normalize();
        if let Some(point) = line.point_mm.as_mut() {
            *point = pivot_point(&Point3::from(*point), &direction, &from, &center).into();
        }
    }
}

/// Returns the point of a rotary axis with a coordinate mirrored at that of the chain's end.
fn mirrored(line: &LineFile, end: f64, k: usize) -> Option<[f64; 3]> {
    let mut point = line.point_mm?;
    point[k] = 2.0 * end - point[k];
    matches!(line.joint, Joint::Revolute(_)).then_some(point)
}

/// Returns the distance of a point from the line of an axis.
fn from_line(line: &LineFile, point: [f64; 3]) -> f64 {
    let way = Vector3::from(point) - Vector3::from(line.point_mm.unwrap_or(point));
    let direction = Vector3::from(line.direction).normalize();
    (way - direction * way.dot(&direction)).norm()
}

/// Swaps a sign of a file of lines.
fn swap(file: &mut MachineFile, sign: &SwappedSign) {
    let [Some(table), Some(head)] = [file.workpiece_chain.lines.as_mut(), file.tool_chains[0].lines.as_mut()] else {
        return;
    };
    let index = |letter: char| LETTERS.iter().position(|other| *other == letter).unwrap_or_default();
    match sign {
        SwappedSign::Sense { axis } => {
            let lines = table.axes.iter_mut().chain(&mut head.axes);
            for line in lines.filter(|line| line.joint.axis() == axis) {
                let sense = match &mut line.joint {
                    Joint::Prismatic(joint) => &mut joint.sense,
                    Joint::Revolute(joint) => &mut joint.sense,
                };
                *sense = if *sense == Sense::Positive { Sense::Negative } else { Sense::Positive };
            }
        }
        SwappedSign::Place { axis, on_table, coordinate } => {
            let chain = if *on_table { table } else { head };
            let (k, end) = (index(*coordinate), chain.end.position_mm);
            for line in chain.axes.iter_mut().filter(|line| line.joint.axis() == axis) {
                line.point_mm = mirrored(line, end[k], k);
            }
        }
        SwappedSign::TableAt { coordinate } => {
            let k = index(*coordinate);
            let shift = 2.0 * (table.end.position_mm[k] - head.end.position_mm[k]);
            head.end.position_mm[k] += shift;
            head.axes.iter_mut().filter_map(|line| line.point_mm.as_mut()).for_each(|point| point[k] += shift);
        }
    }
}

impl fmt::Display for SwappedSign {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Sense { axis } => write!(f, "sense of {axis}"),
            Self::Place { axis, on_table, coordinate } => {
                let from = if *on_table { "table's origin" } else { "spindle nose" };
                write!(f, "{coordinate} of the {axis} axis, seen from the {from}")
            }
            Self::TableAt { coordinate } => write!(f, "{coordinate} of the spindle nose, seen from the table's origin"),
        }
    }
}

impl TouchCheck {
    /// Describes the comparison in lines.
    pub fn lines(&self) -> Vec<String> {
        let joined =
            |signs: &[SwappedSign], and: &str| signs.iter().map(ToString::to_string).collect::<Vec<_>>().join(and);
        let mut lines = vec![format!(
            "measured poses: {}, tips {:.4} mm apart",
            if self.agrees { "agree" } else { "DO NOT AGREE" },
            self.apart
        )];
        for (pose, axis, reading) in &self.beyond_limits {
            lines.push(format!("  pose {pose}: {axis} {reading} is beyond the limits of the file"));
        }
        for fault in &self.faults {
            lines.push(format!(
                "  with the other sign of {}: {:.4} mm apart",
                joined(&fault.signs, " and of "),
                fault.apart
            ));
        }
        if !self.agrees && self.faults.is_empty() {
            lines.push("  no other sign of one value or two explains it: measure pivots and readings again".to_owned());
        }
        if self.faults.len() > 1 {
            lines.push("  these poses do not distinguish them: add one with other rotary readings".to_owned());
        }
        if !self.untested.is_empty() {
            lines.push(format!("  signs that these poses do not test: {}", joined(&self.untested, "; ")));
        }
        lines
    }

    /// Returns the fault of the file in one sentence; `None` if it agrees.
    pub fn fault(&self) -> Option<String> {
        if self.agrees {
            return None;
        }
        let apart = format!("the tips of the measured poses are {:.4} mm apart", self.apart);
        Some(match self.faults.as_slice() {
            [] => format!("{apart}; no other sign of one value or two explains it: measure pivots and readings again"),
            [fault, rest @ ..] => {
                let signs = fault.signs.iter().map(ToString::to_string).collect::<Vec<_>>().join(" and ");
                let others = if rest.is_empty() { "" } else { ", or by another one of those listed" };
                format!("{apart}; {:.4} mm by another sign of {signs}{others}: correct the file", fault.apart)
            }
        })
    }
}
