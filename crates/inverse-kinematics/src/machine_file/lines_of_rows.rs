use nalgebra::{Isometry3, Vector3};

use crate::machine_file::axis_lines::{angles_xyz, clean, move_body};
use crate::machine_file::{BodyFile, DhRow, Joint, LineChain, LineFile, MachineFile, PlaceFile};

impl MachineFile {
    /// Returns the file with the lines of the axes in place of the rows of its chains; chains that
    /// have lines keep them.
    ///
    /// Directions have 1 as their largest coordinate. Bodies are in the bed's frame; those of rows
    /// before the first joint become bodies of the bed, those of other rows without a joint move
    /// with the joint before. Poses of tool and bodies are the same to rounding (1e-9 mm for
    /// machines of metres).
    ///
    /// ```
    /// use facemill_inverse_kinematics::{Machine, preset};
    /// use facemill_inverse_kinematics::machine_file::MachineFile;
    ///
    /// let file: MachineFile = serde_json::from_str(preset("head-b-nutating-table-c").unwrap())?;
    /// let file = file.by_lines();
    /// let b = &file.tool_chains[0].lines.as_ref().unwrap().axes[3];
    /// assert_eq!((b.direction, b.point_mm), ([0.0, 1.0, 1.0], Some([0.0, 0.0, 900.0])));
    /// assert!(Machine::from_file(file).is_ok());
    /// # Ok::<(), serde_json::Error>(())
    /// ```
    #[must_use]
    pub fn by_lines(mut self) -> Self {
        let table = (&mut self.workpiece_chain.rows, &mut self.workpiece_chain.lines);
        let heads = self.tool_chains.iter_mut().map(|chain| (&mut chain.rows, &mut chain.lines));
        for (rows, lines) in std::iter::once(table).chain(heads) {
            if lines.is_none() {
                *lines = Some(lines_of_rows(&std::mem::take(rows), &mut self.bed_bodies));
            }
        }
        self
    }
}

/// Returns the lines of a chain; bodies before the first joint go to the bed.
fn lines_of_rows(rows: &[DhRow], bed_bodies: &mut Vec<BodyFile>) -> LineChain {
    let mut frame = Isometry3::identity();
    let mut axes: Vec<LineFile> = Vec::new();
    for row in rows {
        frame *= row.transform();
        if let Some(joint) = &row.joint {
            let is_rotary = matches!(joint, Joint::Revolute(_));
            let z = frame.rotation * Vector3::z();
            axes.push(LineFile {
                joint: joint.clone(),
                direction: (z / z.amax()).map(clean).into(),
                point_mm: is_rotary.then(|| frame.translation.vector.map(clean).into()),
                bodies: Vec::new(),
            });
        }
        let bodies = axes.last_mut().map_or(&mut *bed_bodies, |line| &mut line.bodies);
        for mut body in row.bodies.iter().cloned() {
            move_body(&mut body, &frame);
            bodies.push(body);
        }
    }
    let rotation_xyz_deg = angles_xyz(&frame.rotation).map(|angle| clean(angle.to_degrees()));
    LineChain { axes, end: PlaceFile { position_mm: frame.translation.vector.map(clean).into(), rotation_xyz_deg } }
}
