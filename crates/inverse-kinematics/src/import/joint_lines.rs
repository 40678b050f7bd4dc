use nalgebra::{Isometry3, Point3, Unit, Vector3};

use crate::axes::axis::{AxisKind, Carrier};
use crate::machine::Machine;
use crate::machine_file::{DhRow, Joint, Sense};

/// A joint's line in the table frame with all axes at 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointLine {
    /// Index of its axis.
    pub axis: usize,
    /// Linear or rotary.
    pub kind: AxisKind,
    /// Head or table.
    pub carrier: Carrier,
    /// Row of its chain, from 0.
    pub row: usize,
    /// Direction in which, or about which (right-handed), a growing value moves the tool relative
    /// to the table.
    pub direction: Unit<Vector3<f64>>,
    /// Origin of its row, mm: for a rotary joint a point on its axis.
    pub point: Point3<f64>,
}

impl Machine {
    /// Returns the joints that move the tool, in the order from the table to it: the table's from
    /// the table inward, then the head's outward.
    pub fn joint_lines(&self) -> Vec<JointLine> {
        let file = self.to_file();
        let (table, bed_from_table) = walk(&file.workpiece_chain.rows);
        let head = file.tool_chains.get(self.head).map(|c| walk(&c.rows).0).unwrap_or_default();
        let table_from_bed = bed_from_table.inverse();
        // A table joint moves the table against the bed, so relative to the table the tool moves
        // the other way.
        let from_table = table.into_iter().rev().map(|j| (j, Carrier::Table, -1.0));
        let to_tool = head.into_iter().map(|j| (j, Carrier::Head, 1.0));
        let line = |((joint, row, frame), carrier, side): ((Joint, usize, Isometry3<f64>), Carrier, f64)| {
            let (kind, sense) = match &joint {
                Joint::Prismatic(j) => (AxisKind::Linear, j.sense),
                Joint::Revolute(j) => (AxisKind::Rotary, j.sense),
            };
            let sign = if sense == Sense::Negative { -side } else { side };
            let frame = table_from_bed * frame;
            Some(JointLine {
                axis: self.axis_index(joint.axis())?,
                kind,
                carrier,
                row,
                direction: Unit::new_normalize(frame.rotation * Vector3::z() * sign),
                point: Point3::from(frame.translation.vector),
            })
        };
        from_table.chain(to_tool).filter_map(line).collect()
    }
}

pub(crate) type JointFrames = Vec<(Joint, usize, Isometry3<f64>)>;

/// Returns the joints of a chain with their row's number and frame, and the frame at the end.
pub(crate) fn walk(rows: &[DhRow]) -> (JointFrames, Isometry3<f64>) {
    let mut frame = Isometry3::identity();
    let mut joints = Vec::new();
    for (k, row) in rows.iter().enumerate() {
        frame *= row.transform();
        joints.extend(row.joint.clone().map(|joint| (joint, k, frame)));
    }
    (joints, frame)
}
