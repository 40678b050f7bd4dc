use facemill_cl_data::PlacedSolid;
use nalgebra::Translation3;

use crate::axes::axis::Carrier;
use crate::machine::Machine;
use crate::machine::bodies::{LinkId, MachineBody};
use crate::machine::build::build_heads;
use crate::machine_file::MachineFile;
use crate::machine_file::error::MachineError;
use crate::solver::inverse_solution::OwnAxes;
use crate::solver::screw_chain::ScrewChain;

/// Data that the view of one head has of the other one.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct OtherChain {
    /// Chain from the table to the other tool.
    pub(crate) chain: ScrewChain,
    /// Joints between table and bed, with which both chains begin.
    pub(crate) n_shared: usize,
    /// The axes that move this view's tool.
    pub(crate) own: OwnAxes,
    /// Last row of the other tool chain; `None` without rows.
    pub(crate) last_row: Option<usize>,
}

impl Machine {
    /// Returns the machine of a file as each of its heads sees it, one view for each tool chain:
    /// the workpiece chain belongs to all of them.
    ///
    /// Every view has *all* axes of the file in the same order, so one position serves all of them;
    /// only the axes of the workpiece chain and of its own head move its tool. Solutions leave the
    /// other ones unchanged: [`Machine::inverse_near`] at the reference, [`Machine::inverse`] at
    /// home. Bodies of the other head are among [`Machine::bodies`] and move by their own axes.
    ///
    /// ```
    /// use facemill_cl_data::ClPoint;
    /// use facemill_inverse_kinematics::{Machine, preset};
    ///
    /// let text = preset("dual-c-horizontal-xyzb").ok_or("no such preset")?;
    /// let heads = Machine::heads_from_json(text.as_bytes())?;
    /// let both = heads[0].home();
    /// let cl = ClPoint { tip: heads[0].cl_point(&both, 250.0).tip, ..heads[0].cl_point(&both, 250.0) };
    /// // The first head goes elsewhere, the second one's own axes stay.
    /// let lower = ClPoint { tip: cl.tip - cl.axis.into_inner() * 100.0, ..cl };
    /// let q = heads[0].inverse_near(&lower, 250.0, &both)?.iter().next().ok_or("not reached")?.values;
    /// let moved = heads[1].axes().iter().enumerate().filter(|(k, _)| q[*k] != both[*k]);
    /// assert!(moved.map(|(_, axis)| axis.letter.to_string()).eq(["Z1"]));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// As [`Machine::from_file`], for each head. Two heads at most; they must share an axis.
    pub fn heads(file: MachineFile) -> Result<Vec<Self>, MachineError> {
        build_heads(file)
    }

    /// Builds the views as [`Machine::heads`], from the text of a machine file.
    ///
    /// # Errors
    /// As [`Machine::heads`], or when the text is no machine file.
    pub fn heads_from_json(text: &[u8]) -> Result<Vec<Self>, MachineError> {
        Self::heads(facemill_file_format::from_json(text)?)
    }

    /// Returns the number of the head, from 0: that of its chain among the file's `tool_chains`.
    pub fn head(&self) -> usize {
        self.head
    }

    /// Returns the number of heads of the machine that this is a view of.
    pub fn head_count(&self) -> usize {
        self.file.tool_chains.len()
    }

    /// Returns the channel of the control that programs this head, from the file.
    pub fn channel(&self) -> u32 {
        self.file.tool_chains.get(self.head).map_or(1, |chain| chain.channel)
    }

    /// Returns whether an axis is between the workpiece and this head's tool: all axes except those
    /// of the other head.
    pub fn moves_tool(&self, axis: usize) -> bool {
        self.axes[axis].carried_by != Carrier::OtherHead
    }

    /// Returns whether an axis moves the workpiece against the tools of two heads, so both have to
    /// agree on its value.
    pub fn is_shared(&self, axis: usize) -> bool {
        self.other.is_some() && self.axes[axis].carried_by == Carrier::Table
    }

    /// Returns the number of joints between two bodies, by their indices in [`Machine::bodies`]: 0
    /// where they move as one.
    ///
    /// The chains to two heads part at the bed, so the path from a body of one to a body of the
    /// other passes through it.
    pub fn joints_between(&self, body: usize, other: usize) -> usize {
        let [a, b] = [&self.bodies[body], &self.bodies[other]];
        match (&self.other, a.carrier(), b.carrier()) {
            (Some(to), Some(Carrier::Head), Some(Carrier::OtherHead))
            | (Some(to), Some(Carrier::OtherHead), Some(Carrier::Head)) => a.n_joints + b.n_joints - 2 * to.n_shared,
            _ => a.n_joints.abs_diff(b.n_joints),
        }
    }

    /// Returns the number of joints between a body, by its index in [`Machine::bodies`], and the
    /// tool: 0 where it is fixed to the spindle.
    pub fn joints_to_tool(&self, body: usize) -> usize {
        let body = &self.bodies[body];
        let to_tool = self.chain.screws.len();
        match &self.other {
            Some(other) if body.carrier() == Some(Carrier::OtherHead) => to_tool + body.n_joints - 2 * other.n_shared,
            _ => to_tool - body.n_joints,
        }
    }

    /// Returns the same view with a tool in the other head's spindle: its bodies follow those of
    /// the machine, as bodies of the other head that are fixed to its nose.
    ///
    /// `bodies` are given in that tool's frame: origin at the tip, z toward the spindle, the nose's
    /// face at `gauge_length`, mm. The whole dilation of a solid, clearance or corner, counts as
    /// its [`MachineBody::clearance`]. A machine with one head has no other spindle and is returned
    /// unchanged.
    #[must_use]
    pub fn with_tool_in_other_head(&self, bodies: &[PlacedSolid], gauge_length: f64) -> Self {
        let mut machine = self.clone();
        let Some(other) = &self.other else { return machine };
        let link = other.last_row.map_or(LinkId::Bed, |row| LinkId::Row { carrier: Carrier::OtherHead, row });
        let table_from_tool = other.chain.table_from_tool_at_zero(gauge_length);
        machine.bodies.extend(bodies.iter().map(|body| MachineBody {
            body: PlacedSolid {
                frame_from_solid: Translation3::new(0.0, 0.0, -gauge_length) * body.frame_from_solid,
                ..body.clone()
            },
            clearance: body.solid.rounding(),
            link,
            n_joints: other.chain.screws.len(),
            table_from_solid_at_zero: table_from_tool * body.frame_from_solid,
        }));
        machine
    }

    /// Returns the axes that move the tool, where there are others.
    pub(crate) fn own_axes(&self) -> Option<OwnAxes> {
        self.other.as_ref().map(|other| other.own)
    }

    /// Returns the chain from the table that carries a body.
    pub(crate) fn chain_to(&self, body: &MachineBody) -> &ScrewChain {
        match &self.other {
            Some(other) if body.carrier() == Some(Carrier::OtherHead) => &other.chain,
            _ => &self.chain,
        }
    }
}
