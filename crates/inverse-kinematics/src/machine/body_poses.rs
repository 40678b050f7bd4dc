//! Poses of the bodies of a machine.

use nalgebra::Isometry3;

use crate::axes::axis_values::AxisValues;
use crate::machine::Machine;
use crate::machine::bodies::{BodyPose, MachineBody};
use crate::solver::screw_chain::ScrewChain;

impl Machine {
    /// Returns the same machine with more clearance around its bodies: `by` returns the increase
    /// for each, mm.
    #[must_use]
    pub fn with_more_clearance(&self, by: impl Fn(&MachineBody) -> f64) -> Self {
        let mut machine = self.clone();
        for body in &mut machine.bodies {
            let more = by(body).max(0.0);
            body.body.solid = body.body.solid.dilated(more);
            body.clearance += more;
        }
        machine
    }

    /// Returns the pose of every body in the table frame, in the order of [`Machine::bodies`].
    ///
    /// The axes of the other head place its bodies. The result includes a table's bodies, which
    /// touch the part by design, so filter by [`MachineBody::carrier`].
    pub fn body_poses<'a>(&'a self, q: &'a AxisValues) -> impl ExactSizeIterator<Item = BodyPose<'a>> + 'a {
        // Bodies of one chain come in its order: a joint that moves one also moves the next.
        let mut before: Option<(&ScrewChain, usize, Isometry3<f64>)> = None;
        self.bodies.iter().map(move |body| {
            let chain = self.chain_to(body);
            let motion = match before {
                Some((same, n, motion)) if std::ptr::eq(same, chain) && n <= body.n_joints => {
                    chain.motion_on(motion, n..body.n_joints, q)
                }
                _ => chain.motion_behind(body.n_joints, q),
            };
            before = Some((chain, body.n_joints, motion));
            BodyPose { body, table_from_solid: motion * body.table_from_solid_at_zero }
        })
    }
}
