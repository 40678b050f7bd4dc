use facemill_cl_data::{Cancelled, CcPointError};
use nalgebra::Point3;

/// Why there is no path.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PathError {
    /// A point of a path file is too far from the drive surface.
    #[error(
        "pass {pass}, point {point} at ({:.6}, {:.6}, {:.6}) is farther than {max_distance} mm from the drive surface; \
         check frame and unit of the path, or allow a larger distance", position.x, position.y, position.z
    )]
    TooFar {
        /// Index of the pass, from 0.
        pass: usize,
        /// Index of the point in the pass, from 0.
        point: usize,
        /// The point in the workpiece frame, mm.
        position: Point3<f64>,
        /// The distance allowed, mm.
        max_distance: f64,
    },
    /// Two points of a pass in a row are the same point of the surface.
    #[error(
        "pass {pass}: point {point} is the same point of the drive surface as the one before it; remove one of them"
    )]
    RepeatedPoint {
        /// Index of the pass, from 0.
        pass: usize,
        /// Index of the second of the two, from 0.
        point: usize,
    },
    /// A normal of a path file points into the material.
    #[error(
        "pass {pass}, point {point}: the file's normal is {angle_deg:.1}° from the drive surface's, so it points into \
         the material; turn the normals or check the winding of the mesh"
    )]
    NormalOpposed {
        /// Index of the pass, from 0.
        pass: usize,
        /// Index of the point in the pass, from 0.
        point: usize,
        /// Angle between the two normals, degrees.
        angle_deg: f64,
    },
    /// Position, normal and feed direction are not a CC point.
    #[error("pass {pass}, point {point}: {source}")]
    Point {
        /// Index of the pass, from 0.
        pass: usize,
        /// Index of the point in the pass, from 0.
        point: usize,
        /// What is wrong with them.
        source: CcPointError,
    },
    /// A path made in memory is not one that could be read.
    #[error(transparent)]
    File(#[from] crate::PathFileError),
    /// A setting is not in its range.
    #[error("{setting} is {value}, but has to be {range}")]
    Setting {
        /// Name of the setting.
        setting: &'static str,
        /// Its value.
        value: f64,
        /// What it may be.
        range: &'static str,
    },
    /// The region names a mesh group that does not exist.
    #[error("the drive surface has no group \"{group}\"; it has {}", list(known))]
    UnknownGroup {
        /// The name.
        group: String,
        /// The groups there are.
        known: Vec<String>,
    },
    /// Nothing of the drive surface belongs to the region.
    #[error("no triangle of the drive surface lies in the region: {reason}")]
    EmptyRegion {
        /// The first condition that nothing fulfils.
        reason: &'static str,
    },
    /// The region has no section as long as a pass.
    #[error(
        "no pass is left: {n_dropped_pieces} pieces are shorter than the shortest pass with its margins; check the \
         direction of the strategy against the region"
    )]
    NoPasses {
        /// How many pieces were left out.
        n_dropped_pieces: usize,
    },
    /// The strip width asked of the caller is not a number.
    #[error("the strip width at ({:.6}, {:.6}, {:.6}) is not a number", position.x, position.y, position.z)]
    StripWidth {
        /// Where, workpiece frame, mm.
        position: Point3<f64>,
    },
    /// The step-over would need more passes than can be meant.
    #[error(
        "the step-over would need more than {limit} passes; raise the smallest step-over, or leave out of the region \
         what lies along the levels (normal cone)"
    )]
    TooManyPasses {
        /// The most there may be.
        limit: usize,
    },
    /// The settings would need more points than can be meant.
    #[error("a pass at level {level:.3} would need more than {limit} points; raise chord tolerance or largest step")]
    TooManyPoints {
        /// Level of the pass, mm.
        level: f64,
        /// The most there may be.
        limit: usize,
    },
    /// Stopped by the monitor.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

fn list(names: &[String]) -> String {
    if names.is_empty() {
        return "none".to_owned();
    }
    names.iter().map(|n| format!("\"{n}\"")).collect::<Vec<_>>().join(", ")
}
