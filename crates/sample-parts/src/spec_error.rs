//! Faults of a part's description.

/// Why numbers do not describe a part.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SpecError {
    /// A number is outside its range, or not a number.
    #[error("{field} is {value}, but must be between {least} and {most}")]
    OutOfRange {
        /// The field, in words of the specification.
        field: &'static str,
        /// Its value.
        value: f64,
        /// Least value allowed.
        least: f64,
        /// Greatest value allowed.
        most: f64,
    },
    /// A number of a propeller's table does not fit.
    #[error("row {} of the {part}: {field} {message}", .row + 1)]
    Table {
        /// Part of the table.
        part: TablePart,
        /// Row of that part, from 0: one per radius, or one per station of each section.
        row: usize,
        /// The column, in words of the table.
        field: &'static str,
        /// The fault, with its remedy.
        message: String,
    },
    /// The blade that a table's numbers describe is none.
    #[error("at r/R {radius_ratio:.4} {message}")]
    Shape {
        /// Radius of the fault over R.
        radius_ratio: f64,
        /// The fault, with its remedy.
        message: String,
    },
    /// A root fillet cannot be made.
    #[error("root fillet at x/c {chord_fraction:.4} of the {side} side: {message}")]
    Fillet {
        /// Side of the blade, in words.
        side: &'static str,
        /// Chord fraction of the fault.
        chord_fraction: f64,
        /// The fault, with its remedy.
        message: String,
    },
    /// The hub around the fillets cannot be meshed.
    #[error(
        "the hub around the fillets has no mesh at a chord tolerance of {tolerance} mm: fillets of two blades are too \
         near to each other, which smaller ones are not, or it takes too many triangles"
    )]
    Unmeshed {
        /// Requested tolerance, mm.
        tolerance: f64,
    },
    /// The mesh would need more rows or columns than [`crate::BladeResolution`] allows.
    #[error("a chord tolerance of {tolerance} mm needs more than {most} rows or columns")]
    TooFine {
        /// Requested tolerance, mm.
        tolerance: f64,
        /// Most rows or columns.
        most: usize,
    },
}

/// Part of a propeller's table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TablePart {
    /// Rows by radius.
    Radial,
    /// Ordinates of the sections.
    Sections,
}

impl std::fmt::Display for TablePart {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Radial => "radial table",
            Self::Sections => "table of sections",
        })
    }
}

/// Why sections do not describe a blade; sections and points are counted from 0.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LoftError {
    /// Fewer than two sections, or than eight points each.
    #[error("{sections} sections with {points} points are too few for a blade; it needs 2 with 8")]
    TooFew {
        /// Number of sections.
        sections: usize,
        /// Points of the first one.
        points: usize,
    },
    /// A section has another number of points than the first one.
    #[error("section {section} has {points} points, the first one {first}")]
    Unequal {
        /// The section.
        section: usize,
        /// Its points.
        points: usize,
        /// Points of the first section.
        first: usize,
    },
    /// A section has a number that is not finite.
    #[error("section {section} has a coordinate that is not finite")]
    NotFinite {
        /// The section.
        section: usize,
    },
    /// A point is where its neighbour around or across the sections is.
    #[error("point {point} of section {section} coincides with a neighbour of it")]
    Coincident {
        /// The section.
        section: usize,
        /// The point.
        point: usize,
    },
    /// Marks of an edge are no points, or both edges are one.
    #[error("marks of the edges are no points of the sections, or the same for both edges")]
    WrongMarks,
    /// An edge that is known as flat has no corners.
    #[error(
        "the {edge} edge is said to be cut off, but no two corners of more than 60° are there in all sections; mark \
         them, or say that the edge is rounded"
    )]
    NoFlatEnd {
        /// `leading` or `trailing`.
        edge: &'static str,
    },
    /// The surface folds, because points of equal index do not belong together.
    #[error(
        "the surface folds near point {point} between section {section} and the next; \
         space the points of all sections alike"
    )]
    Folded {
        /// The section.
        section: usize,
        /// The point.
        point: usize,
    },
    /// A hub or shroud is no surface of revolution beside the blade.
    #[error("the {wall} {what}")]
    WrongWall {
        /// `hub` or `shroud`.
        wall: &'static str,
        /// The fault.
        what: &'static str,
    },
    /// The blade meets a wall in part only.
    #[error(
        "the blade meets the {wall} at some points, but ends {gap_mm:.3} mm before it at point {point}; \
         add a section beyond the {wall}, or remove its file to keep the blade's own end"
    )]
    BeforeWall {
        /// `hub` or `shroud`.
        wall: &'static str,
        /// Point of the sections.
        point: usize,
        /// Distance, mm.
        gap_mm: f64,
    },
    /// A sector of the hub is requested, and the blade ends before the hub.
    #[error(
        "the blade ends {gap_mm:.3} mm before the hub, so that it does not stand on a sector of it; add a section on the \
         hub or beyond it, or leave the sector out"
    )]
    HubNotReached {
        /// Largest distance of the first section's points from the hub, mm.
        gap_mm: f64,
    },
    /// Hub and shroud leave nothing of the blade.
    #[error("hub and shroud leave nothing of the blade at point {point}; correct their files")]
    WallsCross {
        /// Point of the sections.
        point: usize,
    },
    /// The sector of the hub around the blade has no mesh.
    #[error("the hub around the blade has no mesh: {what}")]
    NoSector {
        /// The fault, with its remedy.
        what: &'static str,
    },
    /// The mesh would have too many vertices.
    #[error("a chord tolerance of {tolerance} mm needs more than {most} vertices, or is not above zero")]
    TooFine {
        /// Requested tolerance, mm.
        tolerance: f64,
        /// Most vertices.
        most: usize,
    },
}

/// `value` when it is within `least..=most`.
pub(crate) fn in_range(field: &'static str, value: f64, least: f64, most: f64) -> Result<f64, SpecError> {
    if value >= least && value <= most { Ok(value) } else { Err(SpecError::OutOfRange { field, value, least, most }) }
}

/// Whether a value is not above a limit; NaN is not.
pub(crate) fn is_not_above(value: f64, limit: f64) -> bool {
    value.is_nan() || value <= limit
}
