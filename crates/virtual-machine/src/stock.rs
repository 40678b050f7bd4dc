//! Runs of programs against stock that they cut.

pub(crate) mod bodies;
pub(crate) mod cover;
pub(crate) mod engagement;
pub(crate) mod heads;
pub(crate) mod machine_bodies;
pub(crate) mod now;
pub(crate) mod probe;
pub(crate) mod remaining;
pub(crate) mod retract;
pub(crate) mod run;
pub(crate) mod unresolved_findings;
