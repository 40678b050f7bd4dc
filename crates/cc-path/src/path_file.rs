//! Path files: passes of CC points as a user writes them.

use facemill_cl_data::{CcPoint, Pass};
use facemill_file_format::{FormatError, from_json, to_json};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A path file, `"format": "facemill-path/1"`: passes of points that somebody else laid, to be
/// [projected](crate::project) on the drive surface.
///
/// ```json
/// {
///   "format": "facemill-path/1",
///   "frame": "work",
///   "passes": [
///     { "points_mm": [[0, 0, 5], [10, 0, 5]], "normals": [[0, 0, 1], [0, 0, 1]] }
///   ]
/// }
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PathFile {
    /// Always `"facemill-path/1"`.
    pub format: PathFormat,
    /// Frame of all points and normals.
    pub frame: PathFrame,
    /// Passes in cutting order.
    #[schemars(length(min = 1))]
    pub passes: Vec<PassFile>,
}

/// Format of a path file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[non_exhaustive]
pub enum PathFormat {
    /// The first version.
    #[default]
    #[serde(rename = "facemill-path/1")]
    V1,
}

/// The frame that a path file's coordinates are given in.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum PathFrame {
    /// The workpiece frame, in which everything is planned.
    #[default]
    Work,
    /// The frame of the drive mesh, in mm with +Z up: the path moves with the part.
    Mesh,
}

/// One pass of a path file: points cut without lifting, in cutting order.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PassFile {
    /// Points on or near the drive surface, at least two, in cutting order; coordinates up to 1e9.
    #[schemars(length(min = 2))]
    pub points_mm: Vec<[f64; 3]>,
    /// One direction out of the material for each point, of any length above 0, less than 90° from
    /// the surface's. Default: the surface's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub normals: Option<Vec<[f64; 3]>>,
}

/// Fault of a path file. Indices are from 0, written as the field's path.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PathFileError {
    /// Not the JSON of a path file.
    #[error(transparent)]
    Format(#[from] FormatError),
    /// There is nothing to cut.
    #[error("passes: there are none; a path needs at least one")]
    NoPasses,
    /// A pass needs two points to have a feed direction.
    #[error("passes[{pass}].points_mm: {n_points} points; a pass needs at least two to have a feed direction")]
    TooFewPoints {
        /// Index of the pass.
        pass: usize,
        /// How many points it has.
        n_points: usize,
    },
    /// Normals and points do not belong together.
    #[error("passes[{pass}].normals: {n_normals} normals for {n_points} points; give one for each or none")]
    NormalCount {
        /// Index of the pass.
        pass: usize,
        /// How many points it has.
        n_points: usize,
        /// How many normals it has.
        n_normals: usize,
    },
    /// A normal has no direction.
    #[error("passes[{pass}].normals[{point}]: length zero, so it has no direction")]
    ZeroNormal {
        /// Index of the pass.
        pass: usize,
        /// Index of the point in the pass.
        point: usize,
    },
    /// A coordinate cannot be computed with.
    #[error("passes[{pass}], point {point}: a coordinate of point or normal is larger than 1e9")]
    TooLarge {
        /// Index of the pass.
        pass: usize,
        /// Index of the point in the pass.
        point: usize,
    },
}

/// Largest coordinate a path may have, mm (a thousand kilometres): what is larger is a fault of the
/// file, and its square must stay finite.
const LARGEST_COORDINATE: f64 = 1e9;

/// Reads a path file.
///
/// # Errors
/// When the bytes are not a path file, or a pass has fewer than two points, not one normal for each
/// point, a normal of length zero or a coordinate beyond 1e9. The error names the field.
pub fn read_path_file(bytes: &[u8]) -> Result<PathFile, PathFileError> {
    let file: PathFile = from_json(bytes)?;
    file.check()?;
    Ok(file)
}

/// Writes a path file; the same path always gives the same bytes, and [`read_path_file`] gives the
/// same path back.
pub fn write_path_file(file: &PathFile) -> String {
    to_json(file)
}

impl PathFile {
    /// The path file of laid passes, with their normals, in the workpiece frame.
    pub fn from_passes<'a>(passes: impl IntoIterator<Item = &'a Pass<CcPoint>>) -> Self {
        let pass_file = |pass: &Pass<CcPoint>| PassFile {
            points_mm: pass.points.iter().map(|cc| cc.position.coords.into()).collect(),
            normals: Some(pass.points.iter().map(|cc| cc.normal.into_inner().into()).collect()),
        };
        Self { format: PathFormat::V1, frame: PathFrame::Work, passes: passes.into_iter().map(pass_file).collect() }
    }

    /// Checks a path as [`read_path_file`] does beyond the form of the JSON, for paths made in
    /// memory.
    ///
    /// # Errors
    /// As [`read_path_file`].
    pub fn check(&self) -> Result<(), PathFileError> {
        if self.passes.is_empty() {
            return Err(PathFileError::NoPasses);
        }
        self.passes.iter().enumerate().try_for_each(|(pass, p)| p.check(pass))
    }
}

impl PassFile {
    fn check(&self, pass: usize) -> Result<(), PathFileError> {
        let n_points = self.points_mm.len();
        if n_points < 2 {
            return Err(PathFileError::TooFewPoints { pass, n_points });
        }
        if let Some(point) = self.points_mm.iter().position(is_too_large) {
            return Err(PathFileError::TooLarge { pass, point });
        }
        let Some(normals) = &self.normals else { return Ok(()) };
        if normals.len() != n_points {
            return Err(PathFileError::NormalCount { pass, n_points, n_normals: normals.len() });
        }
        if let Some(point) = normals.iter().position(is_too_large) {
            return Err(PathFileError::TooLarge { pass, point });
        }
        match normals.iter().position(|n| *n == [0.0; 3]) {
            Some(point) => Err(PathFileError::ZeroNormal { pass, point }),
            None => Ok(()),
        }
    }
}

/// NaN counts as too large: paths made in memory may hold it.
fn is_too_large(v: &[f64; 3]) -> bool {
    !v.iter().all(|c| c.abs() <= LARGEST_COORDINATE)
}

#[cfg(test)]
#[path = "../tests/unit/path_file.rs"]
mod tests;
