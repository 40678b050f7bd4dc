use std::fmt;

use nalgebra::Vector3;

use crate::axes::axis::{AxisKind, AxisLetter, Carrier};
use crate::axes::axis_values::AxisValues;
use crate::import::joint_lines::JointLine;
use crate::machine::Machine;

/// Arrangement of a machine's rotary axes: the kind of machine.
///
/// Written as in shops: `head B, table C`; `table-table A-C` and `head-head C-A`, the axis nearest
/// to the bed first; `head B (nutating, 45°), table C`.
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
    /// Angle between it and the spindle with all axes at 0, rad, where that is neither 0 nor 90°.
    pub nutating: Option<f64>,
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
                nutating: oblique(&line.direction, &spindle),
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

/// Returns the angle between two lines where it is neither 0 nor 90°.
fn oblique(a: &Vector3<f64>, b: &Vector3<f64>) -> Option<f64> {
    let angle = a.cross(b).norm().atan2(a.dot(b).abs());
    (angle > RIGHT && angle < std::f64::consts::FRAC_PI_2 - RIGHT).then_some(angle)
}

impl fmt::Display for Family {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let side = |roles: &[RotaryRole]| {
            let letters: Vec<&str> = roles.iter().map(|r| r.letter.as_str()).collect();
            let oblique = roles.iter().filter_map(|r| r.nutating.map(|a| (r.letter, a)));
            let notes: Vec<String> = oblique
                .map(|(letter, angle)| match roles.len() {
                    1 => format!("nutating, {}°", Trimmed(angle)),
                    _ => format!("{letter} nutating, {}°", Trimmed(angle)),
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

/// An angle in degrees with four digits, zeros at the end left out.
struct Trimmed(f64);

impl fmt::Display for Trimmed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let text = format!("{:.4}", self.0.to_degrees());
        f.write_str(text.trim_end_matches('0').trim_end_matches('.'))
    }
}
