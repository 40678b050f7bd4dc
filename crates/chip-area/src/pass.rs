use std::f64::consts::FRAC_PI_2;

use nalgebra::{Point2, Vector2};

use crate::pass_error::{PassError, Pose};
use crate::rim::Rim;
use crate::section::SectionSurface;
use crate::slab::{Border, Cut, Layer};
use crate::tool_section::{Contact, PARALLEL, ToolSection};
use crate::turned::BesideTurned;

/// End of a cutter; above it the flute goes on along the axis without end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CutterEnd {
    /// Radius R, mm.
    pub radius: f64,
    /// Corner radius r, mm, that of a round insert: 0 for a flat end, R for a ball, between them a bull-nose.
    pub corner_radius: f64,
}

/// What is on one side of a pass, as seen along the feed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Beside {
    /// Stock without end.
    Stock,
    /// The same cutter has passed there, with its axis as [`NeighbourAxis`] says.
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
/// A first pass has [`Beside::Stock`] (in the middle of the stock) or [`Beside::Border`] (at its edge) where others have
/// a neighbour; a last one has a border opposite to its neighbour, or neighbours on both sides, whose step-overs need not
/// be equal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Engagement {
    /// Thickness of the stock over the surface, along its normal (ta), mm.
    pub depth_of_cut: f64,
    /// What is on the left.
    pub left: Beside,
    /// What is on the right.
    pub right: Beside,
}

/// Direction of the tool axis against the surface normal N at the CC point: along N + feed·tan(lead) + left·tan(lean).
///
/// CLOPT's tilt α and rotate β are the same: tan(lead) = tan α·cos β and tan(lean) = tan α·sin β.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Orientation {
    /// Along the feed, rad, in (−π/2, π/2).
    pub lead: f64,
    /// Across the feed, toward the left, rad, in (−π/2, π/2); CHIP's tilt.
    pub lean: f64,
}

impl Orientation {
    /// That of CLOPT's posture: tilt α in [0, π/2) and rotate β, rad.
    pub fn from_tilt_rotate(tilt: f64, rotate: f64) -> Self {
        let ((sin, cos), tan) = (rotate.sin_cos(), tilt.tan());
        Self { lead: (tan * cos).atan(), lean: (tan * sin).atan() }
    }
}

/// Axis of the neighbouring passes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum NeighbourAxis {
    /// Parallel to that of this pass: three axes, or CHIP's sections.
    #[default]
    Parallel,
    /// With the same lead and lean against the normal at its own CC point, as five axes cut a curved surface.
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

/// How an area was computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Circles and lines: crossings and areas by formula. Flat and bull-nose cutters with their axis in the section
    /// plane, and balls in every orientation.
    ClosedForm,
    /// The rim is seen as an ellipse, offset by the corner: areas under it by formula (with the elliptic integral of its
    /// length), its crossings by bracketed iteration to the last digits.
    IteratedCrossings,
    /// Integrated over heights above the surface: neighbours on a curved surface whose axis has turned with it.
    Quadrature,
}

/// Section area of a chip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChipArea {
    /// Area, mm².
    pub area: f64,
    /// How it was computed.
    pub method: Method,
    /// The area is not farther than this from the exact one, mm²: rounding, and what is left of the iteration. Of a
    /// quadrature it is an estimate, the difference of Kronrod's and Gauss's rules summed over all parts.
    pub error_bound: f64,
}

/// Section area of the chip of a pass: the stock inside the cutter that hangs together with the CC point, less what the
/// neighbouring passes have cut.
///
/// The cutter is what is seen of it along the feed: its profile when the axis is in the section plane (CHIP), else the
/// silhouette of its rim, corner and flute (CLOPT's postures). The flute counts where the stock reaches it. A flat bottom
/// along the surface touches it with its middle, which is the limit of a cutter that leads along the feed; one that
/// leans, however little, touches with its corner. `docs/chip-area.md` derives each case.
///
/// Limits: 0 for a depth of cut of 0 or, beside a neighbour, a step-over of 0; a plane is the limit of both curved
/// surfaces, a flat end and a ball those of the bull-nose, and the axis in the section plane that of a vanishing lead.
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
/// When a value is not finite or out of its range, or the cutter cannot be where the section puts it: see [`PassError`].
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

impl Beside {
    /// The distance it is told by, with its name.
    fn distance(&self, [step_over, border]: [&'static str; 2]) -> Option<(&'static str, f64)> {
        match *self {
            Self::Stock => None,
            Self::Cut { step_over: length } => Some((step_over, length)),
            Self::Border { distance } => Some((border, distance)),
        }
    }
}

impl Engagement {
    /// The distances to both sides, with the paths of their fields.
    fn distances(&self) -> [Option<(&'static str, f64)>; 2] {
        [
            self.left.distance(["engagement.left.step_over", "engagement.left.distance"]),
            self.right.distance(["engagement.right.step_over", "engagement.right.distance"]),
        ]
    }
}

/// Fields of a section with their values; what is not there has a value that is good.
fn fields(section: &PassSection) -> [(&'static str, f64, Rule); 8] {
    let PassSection { cutter, surface, engagement, orientation, .. } = section;
    let [(left, to_left), (right, to_right)] = engagement.distances().map(|distance| distance.unwrap_or(("", 0.0)));
    [
        ("cutter.radius", cutter.radius, Rule::Positive),
        ("cutter.corner_radius", cutter.corner_radius, Rule::NotNegative),
        ("surface.radius", surface.radius().unwrap_or(1.0), Rule::Positive),
        ("engagement.depth_of_cut", engagement.depth_of_cut, Rule::NotNegative),
        (left, to_left, Rule::NotNegative),
        (right, to_right, Rule::NotNegative),
        ("orientation.lead", orientation.lead, Rule::Acute),
        ("orientation.lean", orientation.lean, Rule::Acute),
    ]
}

/// What a value must be.
#[derive(Clone, Copy)]
enum Rule {
    Positive,
    NotNegative,
    /// An angle between −90° and 90°.
    Acute,
}

fn check_values(section: &PassSection) -> Result<(), PassError> {
    for (field, value, rule) in fields(section) {
        match rule {
            _ if !value.is_finite() => return Err(PassError::NotFinite { field, value }),
            Rule::Positive if value <= 0.0 => return Err(PassError::NotPositive { field, value }),
            Rule::NotNegative if value < 0.0 => return Err(PassError::Negative { field, value }),
            Rule::Acute if value.abs() >= FRAC_PI_2 - PARALLEL => {
                return Err(PassError::AxisNotAbove { field, value });
            }
            _ => {}
        }
    }
    let PassSection { cutter, surface, engagement, .. } = section;
    let CutterEnd { radius, corner_radius } = *cutter;
    if corner_radius > radius {
        return Err(PassError::CornerTooLarge { corner_radius, radius });
    }
    let Some(surface_radius) = surface.radius() else { return Ok(()) };
    if surface.curvature() < 0.0 {
        let depth_of_cut = engagement.depth_of_cut;
        if corner_radius >= surface_radius {
            return Err(PassError::CornerDoesNotFit { corner_radius, surface_radius });
        }
        if depth_of_cut >= surface_radius {
            return Err(PassError::DepthReachesCentre { depth_of_cut, surface_radius });
        }
    }
    match engagement.distances().into_iter().flatten().find(|(_, value)| *value >= FRAC_PI_2 * surface_radius) {
        Some((field, value)) => Err(PassError::TooFarAround { field, value, surface_radius }),
        None => Ok(()),
    }
}

/// The section in the tool's frame: origin at the CC point of this pass, x to the right of the feed, y along the axis as
/// seen in the section.
struct Placed {
    layer: Layer,
    tool: ToolSection,
    /// What is on the left and on the right.
    borders: [Option<Border>; 2],
    before: [Option<(ToolSection, Contact)>; 2],
    /// Neighbours whose axis has turned: how far along the surface to the right.
    turned: [Option<f64>; 2],
    to_the_right: Vector2<f64>,
}

impl Placed {
    fn new(section: &PassSection) -> Self {
        let Engagement { depth_of_cut, left, right } = section.engagement;
        let curvature = section.surface.curvature();
        let (sin, cos) = section.orientation.lean.sin_cos();
        let (normal, to_the_right) = (Vector2::new(sin, cos), Vector2::new(cos, -sin));
        let contact = Contact { point: Point2::origin(), normal };
        let rim = rim_seen(&section.cutter, &section.orientation);
        let mut placed = Self {
            layer: Layer::new(curvature, normal, depth_of_cut),
            tool: ToolSection::touching(rim, &contact, 0.0),
            borders: [None; 2],
            before: [None; 2],
            turned: [None; 2],
            to_the_right,
        };
        // On a plane the axis does not turn.
        let turns = section.neighbour_axis == NeighbourAxis::Turned && curvature != 0.0;
        for (i, (beside, side)) in [(left, -1.0), (right, 1.0)].into_iter().enumerate() {
            let toward = to_the_right * side;
            match beside {
                Beside::Stock => {}
                Beside::Cut { step_over } if turns => placed.turned[i] = Some(side * step_over),
                Beside::Cut { step_over } => {
                    let there = contact.stepped(curvature, toward, step_over);
                    placed.before[i] = Some((ToolSection::touching(rim, &there, 0.0), there));
                }
                Beside::Border { distance } => {
                    let there = contact.stepped(curvature, toward, distance);
                    let angle = distance * curvature;
                    let outward = toward * angle.cos() - normal * angle.sin();
                    placed.borders[i] = Some(Border { outward, level: outward.dot(&there.point.coords) });
                }
            }
        }
        placed
    }

    fn check(&self, section: &PassSection) -> Result<(), PassError> {
        if self.layer.is_gouged_by(&self.tool, Point2::origin()) {
            return Err(PassError::BelowSurface { pose: Pose::This });
        }
        let poses = self.before.iter().zip([Pose::Left, Pose::Right]).zip(section.engagement.distances());
        for ((before, pose), distance) in poses {
            let (Some((tool, contact)), Some((field, step_over))) = (before, distance) else { continue };
            if contact.normal.y < PARALLEL || self.layer.is_gouged_by(tool, contact.point) {
                return Err(PassError::BelowSurface { pose });
            }
            let width = 2.0 * tool.rim.half_width();
            if (tool.center.x - self.tool.center.x).abs() >= width {
                return Err(PassError::StepBeyondCutter { field, step_over, width });
            }
        }
        Ok(())
    }

    fn area_beside_turned(&self, section: &PassSection, cut: Cut<'_>) -> (f64, f64) {
        // Of the area of a strip as deep as the stock and as wide as the step.
        const ACCURACY: f64 = 1e-7;
        let Engagement { depth_of_cut, left, right } = section.engagement;
        let end = |beside| match beside {
            Beside::Border { distance } => distance,
            _ => f64::INFINITY,
        };
        let beside = BesideTurned {
            cut,
            normal: Vector2::new(-self.to_the_right.y, self.to_the_right.x),
            to_the_right: self.to_the_right,
            neighbours: self.turned,
            ends: [-end(left), end(right)],
        };
        let step = self.turned.iter().flatten().map(|step| step.abs()).fold(f64::INFINITY, f64::min);
        let strip = depth_of_cut * step.min(2.0 * self.tool.rim.half_width());
        beside.area(depth_of_cut, ACCURACY * strip)
    }

    /// Rounding of the integrals under the edges, each of the order of the extent of what is cut; the crossings, which
    /// are as exact as their x, count only by the square of their error.
    fn rounding(&self, section: &PassSection) -> f64 {
        let width = 2.0 * self.tool.rim.half_width();
        let height = width + section.engagement.depth_of_cut;
        1e-13 * width * height
    }
}

/// What is seen of the cutter along the feed.
fn rim_seen(cutter: &CutterEnd, orientation: &Orientation) -> Rim {
    // A rim that is seen higher than this share of its width is an ellipse; one that is lower changes areas by less
    // than rounding.
    const EDGE_ON: f64 = 1e-14;
    let (along, across) = (orientation.lead.tan().abs(), orientation.lean.tan());
    let squash = along / (1.0 + along * along + across * across).sqrt();
    let rim = cutter.radius - cutter.corner_radius;
    // A ball looks the same from everywhere.
    let is_round = rim == 0.0 || squash < EDGE_ON;
    Rim { rim, corner: cutter.corner_radius, squash: if is_round { 0.0 } else { squash } }
}
