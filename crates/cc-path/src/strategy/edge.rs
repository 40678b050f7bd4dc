//! Settings of passes along edges and roots.

use crate::error::PathError;
use crate::strategy::settings::require;

/// Passes along an edge, such as the leading edge, trailing edge or tip of a blade: the edge line
/// and curves at distances from it on both sides. The level is the distance along the surface, mm,
/// above 0 to the left of the line.
#[derive(Clone, Debug, PartialEq)]
pub struct Edge {
    /// The line.
    pub line: EdgeLine,
    /// Distance from the line up to which passes are laid on each side, mm; they end at the
    /// region's border before.
    pub width: f64,
}

/// The middle line of an edge.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum EdgeLine {
    /// Every line in the region along which the surface bends most sharply across.
    Ridge,
    /// The border between two groups of the mesh; levels rise from the first into the second.
    BetweenGroups([String; 2]),
}

/// Passes along a root, where two surfaces meet in a concave corner: a first pass in which the
/// corner of the cutter rolls along the root, and curves at distances from it. The level is the
/// distance along the surface, mm.
#[derive(Clone, Debug, PartialEq)]
pub struct Root {
    /// The corner.
    pub line: RootLine,
    /// Distance from the first pass up to which passes are laid, mm; they end at the region's
    /// border before.
    pub width: f64,
}

/// The corner that a root follows.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum RootLine {
    /// Two groups of the mesh that meet without a fillet, with or without a common border. The
    /// first pass lies where the corner of the cutter touches both. Passes lie on those of the
    /// groups that belong to the region.
    BetweenGroups([String; 2]),
    /// A group of the mesh that is the fillet between two others. The first pass is its middle
    /// line, and levels rise to the left of it.
    Fillet(String),
}

impl Edge {
    /// # Errors
    /// When the width is out of range or the groups are the same.
    pub(crate) fn check(&self) -> Result<(), PathError> {
        require_width("edge.width_mm", self.width)?;
        match &self.line {
            EdgeLine::BetweenGroups(groups) => require_different("edge.line.between_groups", groups),
            EdgeLine::Ridge => Ok(()),
        }
    }
}

impl Root {
    /// # Errors
    /// When the width is out of range or the groups are the same.
    pub(crate) fn check(&self) -> Result<(), PathError> {
        require_width("root.width_mm", self.width)?;
        match &self.line {
            RootLine::BetweenGroups(groups) => require_different("root.line.between_groups", groups),
            RootLine::Fillet(_) => Ok(()),
        }
    }
}

fn require_width(setting: &'static str, width: f64) -> Result<(), PathError> {
    require(setting, width, "finite and not below 0", width.is_finite() && width >= 0.0)
}

fn require_different(setting: &'static str, [first, second]: &[String; 2]) -> Result<(), PathError> {
    if first == second { Err(PathError::SameGroup { setting, group: first.clone() }) } else { Ok(()) }
}
