use std::fmt;

use nalgebra::{Unit, Vector3};

use crate::axes::axis::{AxisKind, AxisLetter, Carrier};
use crate::axes::axis_values::AxisValues;
use crate::import::joint_lines::JointLine;
use crate::machine::Machine;

/// Arrangement of a machine's rotary axes: the kind of machine.
///
/// Written as in shops: `head B, table C`; `table-table A-C` and `head-head C-A`, the axis nearest
/// to the bed first; `head B (nutating, 45° toward +y), table C`.
#[derive(Clone, Debug, PartialEq)]
pub struct Family {
    /// Rotary axes of the head, from the bed outward.
    pub head: Vec<RotaryRole>,
    /// Rotary axes of the table, from the bed outward.
    pub table: Vec<RotaryRole>,
    /// Linear axes of the head, from the bed outward.
    pub linear_head: Vec<AxisLetter>,
    /// Linear axes of the table, from the bed outward.
    pub linear_table: Vec<AxisLetter>,
}

/// A rotary axis and its direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RotaryRole {
    /// The axis.
    pub letter: AxisLetter,
    /// How it leans with all axes at 0, if that is neither along the spindle nor square to it.
    pub nutating: Option<Nutation>,
}

/// How an axis leans from the spindle with all axes at 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nutation {
    /// Angle between its line and the spindle's, rad.
    pub angle: f64,
    /// Direction square to the spindle toward which the line leans, followed the way the spindle
    /// looks: upward for one that looks up. In the table frame.
    pub toward: Unit<Vector3<f64>>,
}

/// An axis within this angle of a right one counts as right, rad: the accuracy of workshop
/// drawings.
const RIGHT: f64 = 1e-4;

impl Machine {
    /// Returns the kind of the machine.
    pub fn family(&self) -> Family {
        let lines = self.joint_lines();
        let of = |kind, carrier| -> Vec<&JointLine> {
            let mut all: Vec<_> = lines.iter().filter(|l| l.kind == kind && l.carrier == carrier).collect();
            // The table's axes come from the table inward.
            if carrier == Carrier::Table {
                all.reverse();
            }
            all
        };
        let letters = |all: Vec<&JointLine>| all.iter().map(|l| self.axes()[l.axis].letter).collect();
        let spindle = self.cl_point(&AxisValues::zeros(self.axes().len()), 0.0).axis.into_inner();
        let roles = |all: Vec<&JointLine>| {
            let role = |line: &&JointLine| RotaryRole {
                letter: self.axes()[line.axis].letter,
                nutating: lean(&line.direction, &spindle),
            };
            all.iter().map(role).collect::<Vec<_>>()
        };
        Family {
            head: roles(of(AxisKind::Rotary, Carrier::Head)),
            table: roles(of(AxisKind::Rotary, Carrier::Table)),
            linear_head: letters(of(AxisKind::Linear, Carrier::Head)),
            linear_table: letters(of(AxisKind::Linear, Carrier::Table)),
        }
    }
}

/// Returns how a line leans from the spindle, if neither along it nor square to it.
fn lean(line: &Vector3<f64>, spindle: &Vector3<f64>) -> Option<Nutation> {
    let angle = line.cross(spindle).norm().atan2(line.dot(spindle).abs());
    let is_oblique = angle > RIGHT && angle < std::f64::consts::FRAC_PI_2 - RIGHT;
    is_oblique.then(|| {
        let along = line.dot(spindle);
        Nutation { angle, toward: Unit::new_normalize((line - spindle * along) * along.signum()) }
    })
}

impl fmt::Display for Nutation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}° toward ", Trimmed(self.angle.to_degrees()))?;
        let names = ["+x", "-x", "+y", "-y", "+z", "-z"];
        let along = |k: usize| Vector3::ith(k / 2, if k.is_multiple_of(2) { 1.0 } else { -1.0 });
        match (0..6).find(|&k| self.toward.cross(&along(k)).norm() < RIGHT && self.toward.dot(&along(k)) > 0.0) {
            Some(k) => f.write_str(names[k]),
            None => write!(f, "({}, {}, {})", Trimmed(self.toward.x), Trimmed(self.toward.y), Trimmed(self.toward.z)),
        }
    }
}

impl fmt::Display for Family {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let side = |roles: &[RotaryRole]| {
            let letters: Vec<&str> = roles.iter().map(|r| r.letter.as_str()).collect();
            let oblique = roles.iter().filter_map(|r| r.nutating.map(|a| (r.letter, a)));
            let notes: Vec<String> = oblique
                .map(|(letter, nutation)| match roles.len() {
                    1 => format!("nutating, {nutation}"),
                    _ => format!("{letter} nutating, {nutation}"),
                })
                .collect();
            let notes = if notes.is_empty() { String::new() } else { format!(" ({})", notes.join("; ")) };
            format!("{}{notes}", letters.join("-"))
        };
        match (self.head.len(), self.table.len()) {
            (0, 0) => write!(f, "no rotary axes"),
            (0, n) => write!(f, "{} {}", ["table"; 9][..n.min(9)].join("-"), side(&self.table)),
            (n, 0) => write!(f, "{} {}", ["head"; 9][..n.min(9)].join("-"), side(&self.head)),
            _ => write!(f, "head {}, table {}", side(&self.head), side(&self.table)),
        }
    }
}

/// A number with four digits, zeros at the end left out.
struct Trimmed(f64);

impl fmt::Display for Trimmed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let text = format!("{:.4}", self.0 + 0.0);
        f.write_str(text.trim_end_matches('0').trim_end_matches('.'))
    }
}
