use facemill_cl_data::PlacedSolid;
use nalgebra::{Isometry3, Point3, Unit, Vector3};

use crate::axes::axis::{Axis, AxisKind, AxisLetter, Carrier};
use crate::axes::axis_values::AxisValues;
use crate::machine::Machine;
use crate::machine::bodies::{LinkId, MachineBody, pose_of, solid_of};
use crate::machine::check::{
    check_assumed, check_bodies, check_feed, check_motion, check_name, check_row, check_tool_change, joint_axis,
};
use crate::machine::heads::OtherChain;
use crate::machine::line_rows::{ChainFields, RowFile};
use crate::machine_file::error::{FieldProblem, MachineError};
use crate::machine_file::{BodyFile, DhRow, Joint, MachineFile, Sense};
use crate::solver::Solver;
use crate::solver::inverse_solution::OwnAxes;
use crate::solver::screw_chain::{Screw, ScrewChain};

/// One chain walked from the bed at the zero pose.
struct WalkedChain {
    /// Axis, sense and frame of every joint, from the bed outward; the joint acts along or about
    /// the frame's z.
    joints: Vec<(Axis, Sense, Isometry3<f64>)>,
    /// Fields of the joints: those of their rows or lines.
    fields: Vec<String>,
    /// Whether the chain was given by lines.
    by_lines: bool,
    /// Frame behind every row.
    bed_from_link: Vec<Isometry3<f64>>,
    /// Joints up to and including every row.
    joints_up_to: Vec<usize>,
}

/// All chains of a file, each walked from the bed.
struct Walked {
    table: WalkedChain,
    heads: Vec<WalkedChain>,
}

/// Validates a file and sets up the machine of its one head.
pub(crate) fn build(file: MachineFile) -> Result<Machine, MachineError> {
    if file.tool_chains.len() == 2 {
        return Err(MachineError::TwoHeads);
    }
    build_view(file, 0)
}

/// Validates a file and sets up a view for each of its heads.
pub(crate) fn build_heads(file: MachineFile) -> Result<Vec<Machine>, MachineError> {
    let file = RowFile::of(file)?;
    let walked = Walked::new(&file)?;
    (0..walked.heads.len()).map(|head| walked.view(file.file.clone(), head)).collect()
}

/// Sets up the view of one head as [`build_heads`] does.
pub(crate) fn build_view(file: MachineFile, head: usize) -> Result<Machine, MachineError> {
    let file = RowFile::of(file)?;
    Walked::new(&file)?.view(file.file, head)
}

impl Walked {
    fn new(row_file: &RowFile) -> Result<Self, MachineError> {
        let file = &row_file.file;
        check_name("name", &file.name)?;
        check_assumed(file)?;
        check_motion(&file.motion)?;
        check_feed(&file.feed)?;
        check_tool_change(file.tool_change_s)?;
        check_bodies("bed_bodies", &file.bed_bodies)?;
        let n_heads = file.tool_chains.len();
        if !(1..=2).contains(&n_heads) {
            return Err(MachineError::HeadCount { n_heads });
        }
        let table = walk(&row_file.table, &file.workpiece_chain.rows, Carrier::Table)?;
        let mut heads = Vec::new();
        for (fields, chain) in row_file.heads.iter().zip(&file.tool_chains) {
            heads.push(walk(fields, &chain.rows, Carrier::Head)?);
        }
        refuse_duplicates(&table, &heads)?;
        for (head, chain) in heads.iter().enumerate() {
            refuse_structure(&table, head, chain)?;
            refuse_one_line(&table, chain)?;
        }
        if n_heads > 1 && table.joints.is_empty() {
            return Err(MachineError::NothingShared);
        }
        Ok(Self { table, heads })
    }

    /// Returns the machine as one head sees it.
    fn view(&self, file: MachineFile, head: usize) -> Result<Machine, MachineError> {
        let axes = self.axes(head);
        let chain = self.chain(head, &axes);
        let solver = Solver::new(&chain, &axes)?;
        let bodies = self.bodies(&file, head)?;
        let other = self.other(&file, head, &axes, &chain);
        let machine = Machine { file, axes, chain, solver, bodies, head, other };
        refuse_dependent_linears(&machine)?;
        Ok(machine)
    }

    /// Returns the axes in the order of NC words.
    fn axes(&self, head: usize) -> Vec<Axis> {
        let mut axes: Vec<Axis> = self.table.joints.iter().map(|j| j.0.clone()).collect();
        for (k, chain) in self.heads.iter().enumerate() {
            let carried_by = if k == head { Carrier::Head } else { Carrier::OtherHead };
            axes.extend(chain.joints.iter().map(|j| Axis { carried_by, ..j.0.clone() }));
        }
        axes.sort_by_key(|a| a.letter);
        axes
    }

    /// Returns the joints in the order from the table to the tool of a head.
    fn chain(&self, head: usize, axes: &[Axis]) -> ScrewChain {
        let table_from_bed = self.table.end().inverse();
        // A table joint moves the table relative to the bed, so relative to the table the bed moves
        // the opposite way.
        let from_table = self.table.joints.iter().rev().map(|(a, s, frame)| (a, -s.sign(), frame));
        let to_tool = self.heads[head].joints.iter().map(|(a, s, frame)| (a, s.sign(), frame));
        let screws = from_table.chain(to_tool).map(|(axis, sign, frame)| {
            let frame = table_from_bed * frame;
            let axis = axes.iter().position(|a| a.letter == axis.letter).unwrap_or_default();
            let direction = Unit::new_normalize(frame.rotation * Vector3::z() * sign);
            Screw::new(axis, axes[axis].kind, direction, frame.translation.vector)
        });
        ScrewChain { screws: screws.collect(), table_from_nose: table_from_bed * self.heads[head].end() }
    }

    /// Returns the data of the other head in the view of a head.
    fn other(&self, file: &MachineFile, head: usize, axes: &[Axis], chain: &ScrewChain) -> Option<OtherChain> {
        let other = (0..self.heads.len()).find(|&k| k != head)?;
        let mut own: OwnAxes = std::array::from_fn(|k| chain.screws[k].axis as u8);
        own.sort_unstable();
        Some(OtherChain {
            chain: self.chain(other, axes),
            n_shared: self.table.joints.len(),
            own,
            last_row: file.tool_chains[other].rows.len().checked_sub(1),
        })
    }

    fn bodies(&self, file: &MachineFile, head: usize) -> Result<Vec<MachineBody>, MachineError> {
        let table_from_bed = self.table.end().inverse();
        let n_table = self.table.joints.len();
        let mut bodies = Vec::new();
        let mut add = |list: &[BodyFile], link, n_joints, bed_from_link: &Isometry3<f64>| {
            for body in list {
                let frame_from_solid = pose_of(body);
                bodies.push(MachineBody {
                    body: PlacedSolid { name: body.name.clone(), solid: solid_of(body)?, frame_from_solid },
                    clearance: body.clearance_mm,
                    link,
                    n_joints,
                    table_from_solid_at_zero: table_from_bed * bed_from_link * frame_from_solid,
                });
            }
            Ok::<(), MachineError>(())
        };
        add(&file.bed_bodies, LinkId::Bed, n_table, &Isometry3::identity())?;
        for (row, dh) in file.workpiece_chain.rows.iter().enumerate() {
            let link = LinkId::Row { carrier: Carrier::Table, row };
            add(&dh.bodies, link, n_table - self.table.joints_up_to[row], &self.table.bed_from_link[row])?;
        }
        let others = (0..self.heads.len()).filter(|&k| k != head).map(|k| (k, Carrier::OtherHead));
        for (k, carrier) in [(head, Carrier::Head)].into_iter().chain(others) {
            for (row, dh) in file.tool_chains[k].rows.iter().enumerate() {
                let walked = &self.heads[k];
                let link = LinkId::Row { carrier, row };
                add(&dh.bodies, link, n_table + walked.joints_up_to[row], &walked.bed_from_link[row])?;
            }
        }
        Ok(bodies)
    }
}

impl WalkedChain {
    fn end(&self) -> Isometry3<f64> {
        self.bed_from_link.last().copied().unwrap_or_else(Isometry3::identity)
    }
}

fn walk(fields: &ChainFields, rows: &[DhRow], carrier: Carrier) -> Result<WalkedChain, MachineError> {
    let mut walked = WalkedChain {
        joints: Vec::new(),
        fields: Vec::new(),
        by_lines: fields.by_lines,
        bed_from_link: Vec::new(),
        joints_up_to: Vec::new(),
    };
    for (k, row) in rows.iter().enumerate() {
        let field = fields.joint(k, walked.joints.len());
        check_row(&field, row).map_err(|e| fields.of_line(&field, row, e))?;
        let frame = walked.end() * row.transform();
        if let Some(joint) = &row.joint {
            let sense = match joint {
                Joint::Prismatic(j) => j.sense,
                Joint::Revolute(j) => j.sense,
            };
            walked.joints.push((joint_axis(&field, joint, carrier)?, sense, frame));
            walked.fields.push(field);
        }
        walked.bed_from_link.push(frame);
        walked.joints_up_to.push(walked.joints.len());
    }
    Ok(walked)
}

fn refuse_duplicates(table: &WalkedChain, heads: &[WalkedChain]) -> Result<(), MachineError> {
    let mut seen: Vec<AxisLetter> = Vec::new();
    for chain in std::iter::once(table).chain(heads) {
        for ((axis, ..), field) in chain.joints.iter().zip(&chain.fields) {
            if seen.contains(&axis.letter) {
                return Err(MachineError::Field {
                    field: format!("{field}.joint"),
                    axis: Some(axis.letter.to_string()),
                    problem: FieldProblem::DuplicateAxis,
                });
            }
            seen.push(axis.letter);
        }
    }
    Ok(())
}

/// Refuses two rotary axes on one line with no other joint between them, where one of them is given
/// by its line: they turn as one in every pose. A linear axis between them moves one line away.
fn refuse_one_line(table: &WalkedChain, head: &WalkedChain) -> Result<(), MachineError> {
    // Parallel to rounding of directions, and nearer than the rounding of places, mm: lines that
    // differ by more are refused as parallel, or used.
    const PARALLEL: f64 = 1e-12;
    const APART: f64 = 1e-9;
    let of_table = table.joints.iter().zip(&table.fields).rev();
    let all: Vec<_> = of_table.chain(head.joints.iter().zip(&head.fields)).collect();
    for pair in all.windows(2) {
        let [((other, _, first), first_field), ((axis, _, second), field)] = pair else { continue };
        let [z, along] = [first, second].map(|frame| frame.rotation * Vector3::z());
        let between = second.translation.vector - first.translation.vector;
        if [other, axis].iter().any(|axis| axis.kind != AxisKind::Rotary) {
            continue;
        }
        if z.cross(&along).norm() < PARALLEL && z.cross(&between).norm() < APART && (table.by_lines || head.by_lines) {
            return Err(MachineError::Field {
                field: (*field).clone(),
                axis: Some(axis.letter.to_string()),
                problem: FieldProblem::OnLineOf { other: other.letter.to_string(), field: (*first_field).clone() },
            });
        }
    }
    Ok(())
}

fn refuse_structure(table: &WalkedChain, head: usize, chain: &WalkedChain) -> Result<(), MachineError> {
    let count = |kind| table.joints.iter().chain(&chain.joints).filter(|(axis, ..)| axis.kind == kind).count();
    match (count(AxisKind::Linear), count(AxisKind::Rotary)) {
        (3, 2) | (2, 3) => Ok(()),
        (n_linear, n_rotary) => Err(MachineError::UnsupportedStructure { head, n_linear, n_rotary }),
    }
}

/// Refuses machines that cannot move the tip in every direction while the tool axis is fixed, in
/// any pose (tried in a few).
fn refuse_dependent_linears(machine: &Machine) -> Result<(), MachineError> {
    let free_somewhere = [0.0, 0.7, -1.1].iter().any(|&angle| {
        let q = AxisValues::from_fn(machine.axes.len(), |k| {
            if machine.is_rotary(k) { angle * (1.0 + 0.37 * k as f64) } else { 50.0 }
        });
        match &machine.solver {
            Solver::Closed { .. } => machine.linear_map(&q, 0.0).solve(&Point3::origin()).is_some(),
            Solver::Numeric(_) => moves_tool_freely(&machine.chain, &q),
        }
    });
    if free_somewhere {
        return Ok(());
    }
    let axes = machine.solver.linears().iter().map(|&k| machine.axes[k].letter).collect();
    Err(MachineError::DependentLinears { axes })
}

/// Returns whether five joints move tip and tool axis in every direction at a pose.
fn moves_tool_freely(chain: &ScrewChain, q: &AxisValues) -> bool {
    // Directions known to 1e-9 turn zero into 1e-9.
    const LEAST: f64 = 1e-9;
    chain.tool_velocities(q, 0.0).0.determinant().abs() > LEAST
}
