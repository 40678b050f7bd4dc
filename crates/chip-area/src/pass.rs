//! Passes of a cutter over a surface: area and thickness of the chip, and tables of them.

pub(crate) mod check;
pub(crate) mod error;
pub(crate) mod placed;
pub mod table;
pub(crate) mod table_error;
pub(crate) mod thickness;

use nalgebra::Point2;

use crate::pass::check::check_values;
use crate::pass::error::PassError;
use crate::pass::placed::Placed;
use crate::section::SectionSurface;
use crate::section::slab::Cut;

/// End of a cutter; above it the flute continues along the axis without end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CutterEnd {
    /// Radius R, mm.
    pub radius: f64,
    /// Corner radius r of a round insert, mm: 0 for a flat end, R for a ball, between them a
    /// bull-nose.
    pub corner_radius: f64,
}

/// Neighbour on one side of a pass, as seen along the feed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Beside {
    /// Stock without end.
    Stock,
    /// The same cutter has passed there, with the axis given by [`NeighbourAxis`].
    Cut {
        /// Distance of the CC points along the surface (lf), mm.
        step_over: f64,
    },
    /// The stock ends there, at the plane of the surface's normal and the feed.
    Border {
        /// Distance from the CC point along the surface, mm.
        distance: f64,
    },
}

/// The stock around a pass. Left and right are as seen along the feed.
///
/// A first pass has [`Beside::Stock`] (in the middle of the stock) or [`Beside::Border`] (at its
/// edge) where others have a neighbour; a last one has a border opposite to its neighbour, or
/// neighbours on both sides, whose step-overs may differ.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Engagement {
    /// Thickness of the stock over the surface, along its normal (ta), mm.
    pub depth_of_cut: f64,
    /// Neighbour on the left.
    pub left: Beside,
    /// Neighbour on the right.
    pub right: Beside,
}

/// Direction of the tool axis against the surface normal N at the CC point: along N +
/// feed·tan(lead) + left·tan(lean).
///
/// CLOPT's tilt α and rotate β are the same: tan(lead) = tan α·cos β and tan(lean) = tan α·sin β.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Orientation {
    /// Angle along the feed, rad, in (−π/2, π/2).
    pub lead: f64,
    /// Angle across the feed, toward the left, rad, in (−π/2, π/2); CHIP's tilt.
    pub lean: f64,
}

/// Axis of the neighbouring passes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum NeighbourAxis {
    /// Parallel to that of this pass: three axes, or CHIP's sections.
    #[default]
    Parallel,
    /// With the same lead and lean against the normal at its own CC point, as five axes cut a
    /// curved surface.
    Turned,
}

/// Section across the feed through a pass and its neighbours.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PassSection {
    /// The cutter.
    pub cutter: CutterEnd,
    /// The part's surface in the section.
    pub surface: SectionSurface,
    /// The stock around the pass.
    pub engagement: Engagement,
    /// The axis of this pass.
    pub orientation: Orientation,
    /// The axis of its neighbours.
    pub neighbour_axis: NeighbourAxis,
}

/// Method by which an area was computed.
///
/// Exhaustive, so that a new one is handled everywhere: reports name each.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Circles and lines: crossings and areas by formula. Flat and bull-nose cutters with their
    /// axis in the section plane, and balls in every orientation.
    ClosedForm,
    /// The rim appears as an ellipse, offset by the corner: areas under it by formula (with the
    /// elliptic integral of its length), its crossings by bracketed iteration to the last digits.
    IteratedCrossings,
    /// Integrated over heights above the surface: neighbours on a curved surface whose axis has
    /// turned with it.
    Quadrature,
}

/// Section area of a chip.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct ChipArea {
    /// Area, mm².
    pub area: f64,
    /// Method of the computation.
    pub method: Method,
    /// Bound on the error, mm²: rounding, and the residual of the iteration. For a quadrature it is
    /// an estimate, the difference of Kronrod's and Gauss's rules summed over all parts.
    pub error_bound: f64,
}

/// Returns the section area of the chip of a pass: the stock inside the cutter that is connected to
/// the CC point, minus the cuts of the neighbouring passes.
///
/// The cutter counts as seen along the feed: its profile when the axis is in the section plane
/// (CHIP), else the silhouette of its rim, corner and flute (CLOPT's postures). The flute counts
/// where the stock reaches it. A flat bottom along the surface touches it with its middle, which is
/// the limit of a cutter that leads along the feed; one that leans, however little, touches with
/// its corner. `docs/chip-area.md` derives each case.
///
/// Limits: 0 for a depth of cut of 0 or, beside a neighbour, a step-over of 0; a plane is the limit
/// of both curved surfaces, a flat end and a ball those of the bull-nose, and the axis in the
/// section plane that of a vanishing lead.
///
/// ```
/// use facemill_chip_area::*;
///
/// // A face mill tilted by 5° along the feed, 30 mm beside the pass before, which was on its right.
/// let section = PassSection {
///     cutter: CutterEnd { radius: 40.0, corner_radius: 6.0 },
///     surface: SectionSurface::Plane,
///     engagement: Engagement { depth_of_cut: 2.0, left: Beside::Stock, right: Beside::Cut { step_over: 30.0 } },
///     orientation: Orientation { lead: 5f64.to_radians(), lean: 0.0 },
///     neighbour_axis: NeighbourAxis::Parallel,
/// };
/// let chip = chip_of_pass(&section)?;
/// assert!(chip.area > 50.0 && chip.area < 60.0);
/// # Ok::<(), PassError>(())
/// ```
///
/// # Errors
/// When a value is not finite or out of its range, or the section has an impossible cutter
/// position: see [`PassError`].
pub fn chip_of_pass(section: &PassSection) -> Result<ChipArea, PassError> {
    check_values(section)?;
    let placed = Placed::new(section);
    placed.check(section)?;
    let method = if placed.tool.rim.squash == 0.0 { Method::ClosedForm } else { Method::IteratedCrossings };
    let Engagement { depth_of_cut, left, right } = section.engagement;
    let nothing = |beside| matches!(beside, Beside::Cut { step_over: 0.0 });
    if depth_of_cut == 0.0 || nothing(left) || nothing(right) {
        return Ok(ChipArea { area: 0.0, method, error_bound: 0.0 });
    }
    let cut = Cut {
        layer: &placed.layer,
        tool: &placed.tool,
        borders: placed.borders,
        before: placed.before.map(|before| before.map(|(tool, _)| tool)),
        seed: Point2::origin(),
    };
    let rounding = placed.rounding(section);
    if placed.turned == [None; 2] {
        return Ok(ChipArea { area: cut.area(), method, error_bound: rounding });
    }
    let (area, estimate) = placed.area_beside_turned(section, cut);
    Ok(ChipArea { area, method: Method::Quadrature, error_bound: estimate + 10.0 * rounding })
}
