//! Options of a planning run.

/// Options of a planning run.
#[derive(Clone, Copy, Debug)]
pub struct PlanSettings {
    /// Run the written program on the virtual machine.
    pub verify: bool,
    /// Prove the motion of every block between its ends, and write the proofs, too.
    pub certificates: bool,
}
