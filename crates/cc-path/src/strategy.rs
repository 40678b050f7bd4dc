//! Strategies: settings of the passes on a surface, and their limits.

pub(crate) mod edge;
pub(crate) mod edge_file;
pub(crate) mod field;
pub(crate) mod field_file;
pub(crate) mod file;
pub(crate) mod left_above_file;
pub(crate) mod patch;
pub(crate) mod scallop;
pub(crate) mod scallop_file;
pub(crate) mod settings;
pub(crate) mod size;

use crate::sections::{CylindricalSections, ParallelPlanes, Sections};
use crate::strategy::edge::{Edge, Root};
use crate::strategy::field::{Flow, FlowEnd, Spiral, SpiralLevels};
use crate::strategy::scallop::{ConstantScallop, Seed};

/// How passes are laid.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Strategy {
    /// Sections by parallel planes.
    ParallelPlanes(ParallelPlanes),
    /// Sections by coaxial cylinders.
    CylindricalSections(CylindricalSections),
    /// Curves between two borders of the region that morph from the one to the other.
    Flow(Flow),
    /// One curve that winds around.
    Spiral(Spiral),
    /// Fronts that advance from seeds by the local strip width.
    ConstantScallop(ConstantScallop),
    /// Curves along an edge and at distances from it.
    Edge(Edge),
    /// Curves along a concave corner and at distances from it.
    Root(Root),
}

impl Strategy {
    /// The sections that bound the passes: those that the passes are, or between which they lie;
    /// `None` where the region alone bounds them.
    pub fn sections(&self) -> Option<Sections> {
        match self {
            Self::ParallelPlanes(s) => Some(Sections::ParallelPlanes(*s)),
            Self::CylindricalSections(s) => Some(Sections::CylindricalSections(*s)),
            Self::Spiral(Spiral { levels: SpiralLevels::Sections(s) }) => Some(*s),
            Self::Flow(_) | Self::Spiral(_) | Self::Edge(_) | Self::Root(_) => None,
            Self::ConstantScallop(s) => s.within,
        }
    }

    /// Whether the passes follow a border between groups of the mesh, so that they need the surface
    /// around their region.
    pub fn follows_groups(&self) -> bool {
        match self {
            Self::Edge(_) | Self::Root(_) => true,
            Self::Flow(flow) | Self::Spiral(Spiral { levels: SpiralLevels::Flow(flow) }) => {
                [&flow.from, &flow.to].into_iter().any(|end| matches!(end, FlowEnd::Group(_)))
            }
            Self::ConstantScallop(s) => s.seeds.iter().any(|seed| matches!(seed, Seed::GroupBorder(_))),
            Self::ParallelPlanes(_) | Self::CylindricalSections(_) | Self::Spiral(_) => false,
        }
    }
}

impl From<Sections> for Strategy {
    fn from(sections: Sections) -> Self {
        match sections {
            Sections::ParallelPlanes(s) => Self::ParallelPlanes(s),
            Sections::CylindricalSections(s) => Self::CylindricalSections(s),
        }
    }
}
