//! Faults of path files and of passes that cannot be laid.

use facemill_cl_data::{Cancelled, CcPointError};
use nalgebra::Point3;

/// Why there is no path.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
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
        /// Fault.
        source: CcPointError,
    },
    /// A path made in memory is not one that could be read.
    #[error(transparent)]
    File(#[from] crate::path_file::PathFileError),
    /// A setting is not in its range.
    #[error("{setting} is {value}, but has to be {range}")]
    Setting {
        /// Name of the setting.
        setting: &'static str,
        /// Its value.
        value: f64,
        /// Allowed range.
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
    /// A flow names no border of the region.
    #[error(
        "flow.{end}: no border of the region lies within {within} mm of {what}; {}", nearest_border(*nearest, *within)
    )]
    NoFlowEnd {
        /// The end: "from" or "to".
        end: &'static str,
        /// Description of the group, curve, plane or cylinder that it names.
        what: String,
        /// The distance allowed, mm.
        within: f64,
        /// Distance of the nearest edge of the border, by its farthest place, mm; infinite where
        /// there is none.
        nearest: f64,
    },
    /// The border at an end of a flow leaves it for a while.
    #[error(
        "flow.{end}: the border of the region leaves {what} for a while, by up to {farthest:.3} mm at ({:.3}, {:.3}, \
         {:.3}), and {within} mm are allowed; allow within_mm {} or more, or name this part of the border more exactly",
        position.x, position.y, position.z, rounded_up(*farthest)
    )]
    FlowEndBroken {
        /// The end: "from" or "to".
        end: &'static str,
        /// Description of the group, curve, plane or cylinder that it names.
        what: String,
        /// The distance allowed, mm.
        within: f64,
        /// Largest distance of the border between two places that lie on the end, mm.
        farthest: f64,
        /// Where it is, workpiece frame, mm.
        position: Point3<f64>,
    },
    /// Both ends of a flow name the same place of the border.
    #[error(
        "the ends of the flow touch at ({:.6}, {:.6}, {:.6}): \"from\" and \"to\" have to be apart; name a smaller \
         part of the border for one of them, or allow a smaller distance within_mm", position.x, position.y, position.z
    )]
    FlowEndsTouch {
        /// The place, workpiece frame, mm.
        position: Point3<f64>,
    },
    /// A part of the region does not lie between both ends of a flow.
    #[error(
        "the part of the region at ({:.6}, {:.6}, {:.6}) does not touch \"{end}\" of the flow; bound the region to what \
         lies between both ends, or give this part an operation of its own", position.x, position.y, position.z
    )]
    FlowMisses {
        /// The end: "from" or "to".
        end: &'static str,
        /// A place of the part, workpiece frame, mm.
        position: Point3<f64>,
    },
    /// The mesh does not allow a flow to be computed.
    #[error(
        "the flow over the region cannot be computed (residual {residual:.1e}); repair the mesh or bound the region"
    )]
    NoField {
        /// Residual of the equations, as a share of their right side.
        residual: f64,
    },
    /// The levels of a spiral are not closed curves, one inside the other.
    #[error(
        "a spiral needs one closed curve on every level, but level {level:.6} {fault} at ({:.6}, {:.6}, {:.6}); bound the \
         levels or the region to those that close, or let it flow between two closed borders", position.x, position.y,
        position.z
    )]
    NoSpiral {
        /// The level, mm.
        level: f64,
        /// Its fault.
        fault: &'static str,
        /// A place of it, workpiece frame, mm.
        position: Point3<f64>,
    },
    /// A seed of fronts does not meet the region.
    #[error("no curve of the region lies on the seed {seed}")]
    SeedNowhere {
        /// The seed, with a remedy.
        seed: String,
    },
    /// A point of a seed is not on the region.
    #[error(
        "seed, point {point}: ({:.3}, {:.3}, {:.3}) is farther than {most} mm from the region; check frame and \
         unit of the points, or widen the region", position.x, position.y, position.z
    )]
    SeedOff {
        /// Index of the point, from 0.
        point: usize,
        /// The place, workpiece frame, mm.
        position: Point3<f64>,
        /// Distance allowed, mm.
        most: f64,
    },
    /// Between two points of a seed, the nearest place of the region is on another part of it.
    #[error(
        "seed, between points {point} and {}: at ({:.3}, {:.3}, {:.3}) the nearest place hops to another part of the \
         region, as from one side of a blade to the other; put points closer, on the surface", point + 1, position.x,
        position.y, position.z
    )]
    SeedHops {
        /// Index of the point before, from 0.
        point: usize,
        /// Place between both points, workpiece frame, mm.
        position: Point3<f64>,
    },
    /// A strategy names one group where it needs two.
    #[error("{setting} names \"{group}\" twice; name the two groups that meet")]
    SameGroup {
        /// Name of the setting.
        setting: &'static str,
        /// The group.
        group: String,
    },
    /// The groups that an edge is to lie between do not touch.
    #[error(
        "edge.line.between_groups: groups \"{}\" and \"{}\" have no common border in the region; in it \"{}\" borders \
         on {}. Name another group, widen the region, or take the line \"ridge\"",
        groups[0], groups[1], groups[0], list(neighbours)
    )]
    NoGroupBorder {
        /// The groups.
        groups: [String; 2],
        /// The groups that the first borders on.
        neighbours: Vec<String>,
    },
    /// The region has no edge.
    #[error(
        "edge.line: the region has no ridge of curvature{}; the region has to hold the edge with some of the surface on \
         both sides of it, which bends less; or name the groups that it lies between by between_groups",
        sharpest_place(sharpest)
    )]
    NoRidge {
        /// Smallest convex radius in the region, mm, and where; `None` where there is none.
        sharpest: Option<(f64, Point3<f64>)>,
    },
    /// The region has too many edges.
    #[error(
        "edge.line: the region has more than {limit} ridges of curvature; bound the region to fewer edges and take an \
         operation for each part, or name the groups that an edge lies between by between_groups"
    )]
    TooManyRidges {
        /// Most there may be.
        limit: usize,
    },
    /// So many places bend sharply without being an edge that edges may be missed.
    #[error(
        "edge.line: more than {limit} places of the region, apart from each other by half their radius, bend sharply but \
         are no ridge, the last with a radius of {radius:.3} mm at ({:.3}, {:.3}, {:.3}), so that ridges with larger \
         radii may be missed; bound the region to the edges, or name the groups that they lie between by between_groups",
        position.x, position.y, position.z
    )]
    RidgesUnclear {
        /// Most places that are tried.
        limit: usize,
        /// Radius of the last place, mm.
        radius: f64,
        /// Where it is, workpiece frame, mm.
        position: Point3<f64>,
    },
    /// The groups of a root do not meet in a concave corner.
    #[error(
        "root.line.between_groups: a ball of {corner_radius} mm, the cutter's corner radius, touches groups \"{}\" and \
         \"{}\" nowhere at once in the region; name groups that meet in a concave corner, the group of a fillet between them \
         by fillet, or take the strategy edge for a convex edge", groups[0], groups[1]
    )]
    NoCorner {
        /// The groups.
        groups: [String; 2],
        /// Radius of the ball, mm.
        corner_radius: f64,
    },
    /// Neither group of a root belongs to the region.
    #[error(
        "root.line.between_groups: neither \"{}\" nor \"{}\" belongs to the region; add the one that is to be cut to \
         its groups", groups[0], groups[1]
    )]
    RootOutside {
        /// The groups.
        groups: [String; 2],
    },
    /// A group is not a fillet between two others.
    #[error("root.line.fillet: group \"{group}\" is not a fillet between two surfaces: {reason}")]
    NoFillet {
        /// The group.
        group: String,
        /// The lack, with a remedy.
        reason: String,
    },
    /// The cutter does not fit a fillet.
    #[error(
        "root.line.fillet: the fillet has a radius of {radius:.3} mm at ({:.3}, {:.3}, {:.3}), but the cutter's corner has \
         {corner_radius} mm; take a cutter with a corner radius of {radius:.2} mm or less",
        position.x, position.y, position.z
    )]
    FilletTooTight {
        /// Smallest radius of the fillet, mm.
        radius: f64,
        /// Where, workpiece frame, mm.
        position: Point3<f64>,
        /// Corner radius of the cutter, mm.
        corner_radius: f64,
    },
    /// The strip width of the caller is not a number.
    #[error("the strip width at ({:.6}, {:.6}, {:.6}) is not a number", position.x, position.y, position.z)]
    StripWidth {
        /// Where, workpiece frame, mm.
        position: Point3<f64>,
    },
    /// The step-over requires more passes than a plan may have, or for passes across more facets.
    #[error(
        "the step-over asks for more than {limit} passes, or for passes across more than {most_crossings} facets, over \
         {span:.1} mm of levels; {remedy}, or bound the region"
    )]
    TooManyPasses {
        /// Most passes there may be.
        limit: usize,
        /// Most facets that they may cross, each counted once for each pass.
        most_crossings: usize,
        /// From the first level to the last, mm.
        span: f64,
        /// Remedy.
        remedy: Remedy,
    },
    /// The region has to be cut up into more pieces than a plan may hold.
    #[error("the region has to be cut up into about {n_pieces:.1e} pieces, more than {limit}; {remedy}, or bound it")]
    TooManyPieces {
        /// Pieces needed, about.
        n_pieces: f64,
        /// Most there may be.
        limit: usize,
        /// Remedy.
        remedy: Remedy,
    },
    /// The settings ask for more points than a plan may have.
    #[error("the passes, {length:.0} mm long, need about {n_points:.1e} points, more than {limit}; {remedy}")]
    TooManyPoints {
        /// Length of all passes, mm.
        length: f64,
        /// Points needed, about.
        n_points: f64,
        /// Most there may be.
        limit: usize,
        /// Remedy.
        remedy: Remedy,
    },
    /// Stopped by the monitor.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Setting that makes a path small enough, with the least value that does, rounded up to two
/// digits.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Remedy {
    /// [`LaySettings::max_step_over`](crate::strategy::settings::LaySettings::max_step_over), mm.
    #[error("take a largest step-over of {0} mm or more")]
    LargestStepOver(f64),
    /// The strip widths that the caller allows: how many times as wide they have to be.
    #[error("allow strips {0} times as wide, with a higher cusp")]
    StripWidth(f64),
    /// [`LaySettings::max_step`](crate::strategy::settings::LaySettings::max_step), mm.
    #[error("take a largest step of {0} mm or more")]
    LargestStep(f64),
    /// [`LaySettings::chord_tolerance`](crate::strategy::settings::LaySettings::chord_tolerance),
    /// mm.
    #[error("take a chord tolerance of {0} mm or more")]
    ChordTolerance(f64),
}

impl PathError {
    /// Setting that makes a path small enough, where this says that it is too large.
    pub fn remedy(&self) -> Option<Remedy> {
        match self {
            Self::TooManyPasses { remedy, .. }
            | Self::TooManyPieces { remedy, .. }
            | Self::TooManyPoints { remedy, .. } => Some(*remedy),
            _ => None,
        }
    }

    /// Returns the error for a longest edge that is a share of the largest step-over.
    pub(crate) fn with_edge_share(mut self, share: f64) -> Self {
        if let Self::TooManyPieces { remedy: Remedy::LargestStepOver(edge), .. } = &mut self {
            *edge = rounded_up(*edge / share);
        }
        self
    }
}

impl Remedy {
    /// The remedy with its value rounded up to two digits, so that it is enough and can be read.
    pub(crate) fn rounded_up(mut self) -> Self {
        let (Self::LargestStepOver(v) | Self::StripWidth(v) | Self::LargestStep(v) | Self::ChordTolerance(v)) =
            &mut self;
        *v = rounded_up(*v);
        self
    }
}

/// A value above 0, rounded up to two digits.
fn rounded_up(value: f64) -> f64 {
    let digits = 10f64.powi(1 - value.log10().floor() as i32);
    // A tenth of a digit more, so that rounding on the way does not leave it too small.
    (value * digits + 0.1).ceil() / digits
}

fn nearest_border(nearest: f64, within: f64) -> String {
    let bound = "bound it there, as by the region's key between with the same planes or cylinders";
    if nearest <= within {
        format!(
            "a border only crosses it, or lies there for no more than four times within_mm: name what bounds the region, \
             or {bound}"
        )
    } else if nearest.is_finite() {
        format!(
            "the nearest is {nearest:.3} mm away: name what bounds the region, {bound}, or allow a larger distance \
             within_mm"
        )
    } else {
        "there is nothing to measure to: the region has no border, or the group no triangle".to_owned()
    }
}

fn sharpest_place(sharpest: &Option<(f64, Point3<f64>)>) -> String {
    sharpest.map_or_else(String::new, |(radius, p)| {
        format!(": its smallest convex radius is {radius:.3} mm at ({:.3}, {:.3}, {:.3}), as around it", p.x, p.y, p.z)
    })
}

fn list(names: &[String]) -> String {
    if names.is_empty() {
        return "none".to_owned();
    }
    names.iter().map(|n| format!("\"{n}\"")).collect::<Vec<_>>().join(", ")
}
