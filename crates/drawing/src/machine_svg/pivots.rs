//! Lines of a machine's axes and the offsets between them.

use facemill_inverse_kinematics::machine_file::AssumedValue;
use facemill_inverse_kinematics::measured::pivot_point;
use facemill_inverse_kinematics::{AxisKind, Carrier, Machine};
use nalgebra::{Point3, Vector3};

use crate::machine_svg::{short, zero};

/// Lines of a head's chain in the table frame, all axes at 0.
pub(crate) struct Chain {
    /// Centre of the spindle nose, and direction from it into the spindle.
    pub(crate) nose: Point3<f64>,
    pub(crate) spindle: Vector3<f64>,
    pub(crate) linear: Vec<ChainLine>,
    pub(crate) rotary: Vec<ChainLine>,
}

/// A line of an axis.
pub(crate) struct ChainLine {
    pub(crate) axis: usize,
    pub(crate) carrier: Carrier,
    /// Direction along or about which the tool moves against the workpiece.
    pub(crate) direction: Vector3<f64>,
    /// Pivot of a rotary axis: where it is next to the table's z or to the spindle's centre line.
    pub(crate) point: Point3<f64>,
}

/// Cosine above which two directions are parallel.
const PARALLEL: f64 = 1.0 - 1e-9;

impl Chain {
    pub(crate) fn of(head: &Machine) -> Self {
        let pose = head.cl_point(&zero(head), 0.0);
        let (nose, spindle) = (pose.tip, pose.axis.into_inner());
        let (mut linear, mut rotary) = (Vec::new(), Vec::new());
        for line in head.joint_lines() {
            let (direction, point) = (line.direction.into_inner(), line.point);
            let (from, center) = match line.carrier {
                Carrier::Table => (Point3::origin(), Vector3::z()),
                _ => (nose, spindle),
            };
            let point = pivot_point(&point, &direction, &from, &center);
            let all = if line.kind == AxisKind::Linear { &mut linear } else { &mut rotary };
            all.push(ChainLine { axis: line.axis, carrier: line.carrier, direction, point });
        }
        Self { nose, spindle, linear, rotary }
    }

    /// Returns all points that a drawing shows.
    pub(crate) fn points(&self) -> impl Iterator<Item = Point3<f64>> + '_ {
        self.rotary.iter().map(|line| line.point).chain([self.nose])
    }
}

/// An offset between two points by its name.
pub(crate) struct Pivot {
    pub(crate) name: String,
    pub(crate) from: Point3<f64>,
    pub(crate) to: Point3<f64>,
    pub(crate) is_assumed: bool,
}

impl Pivot {
    /// Whether it has a length along a coordinate.
    pub(crate) fn is_seen(&self, k: usize) -> bool {
        (self.to[k] - self.from[k]).abs() > 5e-5
    }

    fn mark(&self) -> &'static str {
        if self.is_assumed { " *" } else { "" }
    }

    /// Returns the text of its dimension along a coordinate.
    pub(crate) fn label(&self, k: usize) -> String {
        format!("{} {}{}", self.name, short(self.to[k] - self.from[k]), self.mark())
    }

    /// Returns its line below the drawing.
    pub(crate) fn line(&self) -> String {
        let way = self.to - self.from;
        format!("{}: X {}, Y {}, Z {}{}", self.name, short(way.x), short(way.y), short(way.z), self.mark())
    }
}

/// Returns the offsets of a head: of the table's axes from its origin, of the nose from there, and
/// of the head's axes from the nose.
pub(crate) fn named(chain: &Chain, head: &Machine) -> Vec<Pivot> {
    let file = head.to_file();
    let letter = |axis: usize| head.axes()[axis].letter.to_string();
    let pivot = |name: String, from: Point3<f64>, to: Point3<f64>, axis: &str| {
        let is_assumed = file.is_assumed(AssumedValue::Dimensions, axis);
        Pivot { name, from, to, is_assumed }
    };
    let number = if head.head_count() > 1 { format!(" {}", head.head() + 1) } else { String::new() };
    let linear = chain.linear.first().map_or(String::new(), |line| letter(line.axis));
    let mut all = vec![pivot(format!("nose{number}"), Point3::origin(), chain.nose, &linear)];
    for line in &chain.rotary {
        let axis = letter(line.axis);
        if line.carrier == Carrier::Table {
            if head.head() == 0 && line.point.coords.norm() > 5e-5 {
                all.push(pivot(format!("table tilt {axis}"), Point3::origin(), line.point, &axis));
            }
            continue;
        }
        if line.direction.dot(&chain.spindle).abs() > PARALLEL {
            all.push(pivot(format!("{axis} offset"), chain.nose, line.point, &axis));
            continue;
        }
        let along = (line.point - chain.nose).dot(&chain.spindle);
        let beside = chain.nose + chain.spindle * along;
        all.push(pivot(format!("pivot length {axis}"), chain.nose, beside, &axis));
        if (line.point - beside).norm() > 5e-5 {
            all.push(pivot(format!("pivot offset {axis}"), beside, line.point, &axis));
        }
    }
    all
}
