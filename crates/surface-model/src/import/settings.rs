//! Units, axes and faults of imported meshes.

use std::io;

use nalgebra::{Point3, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Kinds of mesh files that can be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum MeshFormat {
    /// Wavefront OBJ. Polygons are cut into fans; `o` and `g` names become groups; materials are
    /// not read.
    Obj,
    /// glTF 2.0 as text or as GLB container. Nodes with a mesh become groups under the node's name.
    Gltf,
    /// STL, binary or ASCII. Each `solid` of an ASCII file becomes a group.
    Stl,
    /// 3MF. Objects with a mesh become groups under their names, in each of their places; the unit
    /// is the file's own. Colours and materials are not read, supports are left out.
    ThreeMf,
}

impl MeshFormat {
    /// Returns the format by the ending of a file name, with or without the dot, in any case;
    /// `None` for others.
    pub fn from_extension(extension: &str) -> Option<Self> {
        match extension.trim_start_matches('.').to_ascii_lowercase().as_str() {
            "obj" => Some(Self::Obj),
            "gltf" | "glb" => Some(Self::Gltf),
            "stl" => Some(Self::Stl),
            "3mf" => Some(Self::ThreeMf),
            _ => None,
        }
    }
}

/// The unit of a mesh file's coordinates.
// Exhaustive for callers: a unit must not be taken for another.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LengthUnit {
    /// 1000 mm.
    Metre,
    /// 10 mm.
    Centimetre,
    /// 1 mm.
    Millimetre,
    /// 25.4 mm.
    Inch,
}

impl LengthUnit {
    /// Returns its length in mm.
    pub fn in_mm(self) -> f64 {
        match self {
            Self::Metre => 1000.0,
            Self::Centimetre => 10.0,
            Self::Millimetre => 1.0,
            Self::Inch => 25.4,
        }
    }
}

/// The axis of a mesh file's frame that becomes +Z.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum UpAxis {
    /// Turned about the diagonal: file (x, y, z) becomes (y, z, x).
    X,
    /// Turned about x: file (x, y, z) becomes (x, −z, y).
    Y,
    /// As it is.
    Z,
}

impl UpAxis {
    /// Returns the vector in the frame with +Z up. A proper rotation: it mirrors nothing.
    pub fn to_z_up(self, v: Vector3<f64>) -> Vector3<f64> {
        match self {
            Self::X => Vector3::new(v.y, v.z, v.x),
            Self::Y => Vector3::new(v.x, -v.z, v.y),
            Self::Z => v,
        }
    }
}

/// Interpretation of the numbers in a mesh file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImportSettings {
    /// Unit of the coordinates.
    pub unit: LengthUnit,
    /// Axis that points up.
    pub up_axis: UpAxis,
    /// Vertices nearer to each other than this become one, mm. Larger: thin walls and small
    /// triangles collapse. Smaller: rounding in the file leaves seams open.
    pub weld_tolerance: f64,
}

impl ImportSettings {
    /// Returns the settings for a format. By its specification glTF is in metres with +Y up, and
    /// 3MF has +Z up and its own unit, which reading turns into mm; OBJ and STL specify nothing,
    /// and are taken as mm with +Z up. Vertices are welded within 1 nm, which is above the rounding
    /// of any file and below what matters on a machine.
    pub fn default_for(format: MeshFormat) -> Self {
        let (unit, up_axis) = match format {
            MeshFormat::Gltf => (LengthUnit::Metre, UpAxis::Y),
            MeshFormat::Obj | MeshFormat::Stl | MeshFormat::ThreeMf => (LengthUnit::Millimetre, UpAxis::Z),
        };
        Self { unit, up_axis, weld_tolerance: 1e-6 }
    }

    pub(crate) fn to_mm(self, p: &Point3<f64>) -> Point3<f64> {
        Point3::from(self.up_axis.to_z_up(p.coords * self.unit.in_mm()))
    }
}

/// Fault of a mesh file, with its place.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ImportFault {
    /// A line of a text file is wrong.
    #[error("line {line}: {message}")]
    Line {
        /// Line, from 1.
        line: usize,
        /// Fault.
        message: String,
    },
    /// Binary data is wrong.
    #[error("byte {offset}: {message}")]
    Byte {
        /// Offset from the start of the file.
        offset: usize,
        /// Fault.
        message: String,
    },
    /// A part of a glTF document or 3MF package is wrong.
    #[error("{element}: {message}")]
    Element {
        /// The part, such as `accessors[3]`.
        element: String,
        /// Fault.
        message: String,
    },
    /// The glTF document is not valid JSON or lacks something that the format requires.
    #[error("the glTF document cannot be read: {0}")]
    Document(String),
    /// The file uses an unsupported feature.
    #[error("{feature} is not read; {hint}")]
    Unsupported {
        /// Feature in use.
        feature: String,
        /// Remedy.
        hint: &'static str,
    },
    /// A coordinate is NaN, infinite, or becomes so in mm.
    #[error("{place} has a coordinate that is not a finite number")]
    NotFinite {
        /// Vertex, triangle or line.
        place: String,
    },
    /// There is no triangle with an area.
    #[error("there is no triangle with an area in it ({n_degenerate} without)")]
    Empty {
        /// Triangles without area.
        n_degenerate: usize,
    },
    /// Another file that this one refers to is not available.
    #[error("the buffer \"{uri}\" it refers to cannot be read: {source}")]
    External {
        /// Its name as written in the file, percent signs decoded.
        uri: String,
        /// Reason.
        source: io::Error,
    },
    /// More triangles than supported.
    #[error("there are more than {limit} triangles; split the mesh or reduce it")]
    TooLarge {
        /// Largest number supported.
        limit: usize,
    },
}
