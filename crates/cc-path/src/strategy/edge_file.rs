use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::error::PathError;
use crate::strategy::edge::{Edge, EdgeLine, Root, RootLine};

/// Passes along an edge of the surface and on both sides of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct EdgeFile {
    /// Middle line of the edge.
    #[serde(default)]
    pub line: EdgeLineFile,
    /// Distance from the line, along the surface, up to which passes are laid on each side.
    #[schemars(range(min = 0))]
    pub width_mm: f64,
}

/// Middle line of an edge: `"ridge"` or `{"between_groups": ["…", "…"]}`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum EdgeLineFile {
    /// Every line in the region along which the surface bends most sharply across.
    #[default]
    Ridge,
    /// The border between two mesh groups; levels rise from the first into the second.
    BetweenGroups([String; 2]),
}

/// Passes along a concave corner, in which the cutter's corner rolls, and away from it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RootFile {
    /// The corner.
    pub line: RootLineFile,
    /// Distance from the first pass, along the surface, up to which passes are laid.
    #[schemars(range(min = 0))]
    pub width_mm: f64,
}

/// Corner that a root follows: `{"between_groups": ["…", "…"]}` or `{"fillet": "…"}`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum RootLineFile {
    /// Two mesh groups that meet in a corner without a fillet. The first pass lies where the
    /// cutter's corner touches both; passes lie on those of the two that belong to the region.
    BetweenGroups([String; 2]),
    /// Name of a mesh group that is the fillet between two others; the first pass is its middle
    /// line.
    Fillet(String),
}

impl EdgeFile {
    pub(crate) fn to_edge(&self) -> Result<Edge, PathError> {
        let line = match &self.line {
            EdgeLineFile::Ridge => EdgeLine::Ridge,
            EdgeLineFile::BetweenGroups(groups) => EdgeLine::BetweenGroups(groups.clone()),
        };
        let edge = Edge { line, width: self.width_mm };
        edge.check().map(|()| edge)
    }
}

impl RootFile {
    pub(crate) fn to_root(&self) -> Result<Root, PathError> {
        let line = match &self.line {
            RootLineFile::BetweenGroups(groups) => RootLine::BetweenGroups(groups.clone()),
            RootLineFile::Fillet(group) => RootLine::Fillet(group.clone()),
        };
        let root = Root { line, width: self.width_mm };
        root.check().map(|()| root)
    }
}
