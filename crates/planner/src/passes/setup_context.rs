//! Context of the operations of a setup.

use facemill_job::setup::scene::Scene;
use facemill_z_map::ZMap;

use crate::passes::extra_passes::AddedPasses;

/// Shared context of all operations of a setup.
pub(crate) struct SetupContext<'a> {
    /// Machine, tool, setup and words.
    pub(crate) scene: &'a Scene<'a>,
    /// Z-map of the setup's obstacles.
    pub(crate) map: &'a ZMap,
    /// Passes that operations get besides those of their strategies.
    pub(crate) added: AddedPasses,
}
