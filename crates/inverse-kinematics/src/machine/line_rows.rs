use nalgebra::{Point3, Unit, Vector3};

use crate::machine::check::{Checked, check_bodies, fail, finite, length, limited};
use crate::machine_file::axis_lines::{AxisLine, rows_from_axes};
use crate::machine_file::error::{FieldProblem, MachineError};
use crate::machine_file::{DhRow, Joint, LineChain, LineFile, MachineFile};

/// Machine file whose chains all have rows, and the fields that their author wrote.
pub(crate) struct RowFile {
    pub(crate) file: MachineFile,
    pub(crate) table: ChainFields,
    pub(crate) heads: Vec<ChainFields>,
}

/// Names of the fields of a chain.
pub(crate) struct ChainFields {
    chain: String,
    pub(crate) by_lines: bool,
}

impl RowFile {
    /// Makes rows of the lines of all chains.
    ///
    /// # Errors
    /// If a line is wrong, or a chain has rows beside its lines.
    pub(crate) fn of(mut file: MachineFile) -> Result<Self, MachineError> {
        let chain = &mut file.workpiece_chain;
        let table = ChainFields::of("workpiece_chain".to_owned(), &mut chain.rows, &mut chain.lines)?;
        let heads = file.tool_chains.iter_mut().enumerate();
        let heads =
            heads.map(|(k, chain)| ChainFields::of(format!("tool_chains[{k}]"), &mut chain.rows, &mut chain.lines));
        let heads = heads.collect::<Result<_, _>>()?;
        Ok(Self { file, table, heads })
    }
}

impl ChainFields {
    /// Replaces the lines of a chain by its rows.
    fn of(chain: String, rows: &mut Vec<DhRow>, lines: &mut Option<LineChain>) -> Result<Self, MachineError> {
        let Some(lines) = lines.take() else { return Ok(Self { chain, by_lines: false }) };
        if !rows.is_empty() {
            return Err(fail(format!("{chain}.lines"), None, FieldProblem::BesideRows));
        }
        *rows = rows_of(&chain, &lines)?;
        Ok(Self { chain, by_lines: true })
    }

    /// Returns the field of a row, and of the joint in it: that of a line where rows were made from
    /// lines. `joint` is the number of the row's joint, or of the next one.
    pub(crate) fn joint(&self, row: usize, joint: usize) -> String {
        let chain = &self.chain;
        if self.by_lines { format!("{chain}.lines.axes[{joint}]") } else { format!("{chain}.rows[{row}]") }
    }

    /// Returns the fault of a row as that of the line it was made from: lines are checked before,
    /// so that lengths alone can be at fault.
    pub(crate) fn of_line(&self, field: &str, row: &DhRow, error: MachineError) -> MachineError {
        match error {
            MachineError::Field { problem: FieldProblem::TooFar { value, largest }, .. } if self.by_lines => {
                let axis = row.joint.as_ref().map(Joint::axis);
                let field = if axis.is_some() { field.to_owned() } else { format!("{}.lines", self.chain) };
                fail(field, axis, FieldProblem::FarRow { value, largest })
            }
            other => other,
        }
    }
}

/// Returns the rows of a chain that is given by lines.
fn rows_of(chain: &str, lines: &LineChain) -> Result<Vec<DhRow>, MachineError> {
    let mut axes = Vec::with_capacity(lines.axes.len());
    for (k, line) in lines.axes.iter().enumerate() {
        axes.push(axis_line(&format!("{chain}.lines.axes[{k}]"), line)?);
    }
    let end = format!("{chain}.lines.end");
    check_triple(&format!("{end}.position_mm"), None, &lines.end.position_mm, length)?;
    check_triple(&format!("{end}.rotation_xyz_deg"), None, &lines.end.rotation_xyz_deg, limited)?;
    Ok(rows_from_axes(&axes, &lines.end.pose()))
}

fn axis_line(field: &str, line: &LineFile) -> Result<AxisLine, MachineError> {
    let axis = Some(line.joint.axis());
    let direction = format!("{field}.direction");
    check_triple(&direction, axis, &line.direction, finite)?;
    // Scaled first, so that no square overflows or vanishes.
    let largest = line.direction.iter().fold(0.0_f64, |most, v| most.max(v.abs()));
    if largest == 0.0 {
        return Err(fail(direction, axis, FieldProblem::NoDirection));
    }
    let point = format!("{field}.point_mm");
    match (&line.point_mm, &line.joint) {
        (Some(place), _) => check_triple(&point, axis, place, length)?,
        (None, Joint::Revolute(_)) => return Err(fail(point, axis, FieldProblem::NoPoint)),
        (None, Joint::Prismatic(_)) => {}
    }
    check_bodies(&format!("{field}.bodies"), &line.bodies)?;
    Ok(AxisLine {
        joint: line.joint.clone(),
        direction: Unit::new_normalize(Vector3::from(line.direction.map(|v| v / largest))),
        point: line.point_mm.map_or_else(Point3::origin, Point3::from),
        bodies: line.bodies.clone(),
    })
}

fn check_triple(
    field: &str,
    axis: Option<&str>,
    values: &[f64; 3],
    check: impl Fn(String, Option<&str>, f64) -> Checked,
) -> Checked {
    values.iter().enumerate().try_for_each(|(i, &value)| check(format!("{field}[{i}]"), axis, value))
}
