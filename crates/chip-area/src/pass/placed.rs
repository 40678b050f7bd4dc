use nalgebra::{Point2, Vector2};

use crate::pass::error::{PassError, Pose};
use crate::pass::{Beside, CutterEnd, Engagement, NeighbourAxis, Orientation, PassSection};
use crate::section::rim::Rim;
use crate::section::slab::{Border, Cut, Layer};
use crate::section::tool_section::{Contact, PARALLEL, ToolSection};
use crate::section::turned::BesideTurned;

/// The section in the tool's frame: origin at the CC point of this pass, x to the right of the
/// feed, y along the axis as seen in the section.
pub(crate) struct Placed {
    pub(crate) layer: Layer,
    pub(crate) tool: ToolSection,
    /// Borders on the left and on the right.
    pub(crate) borders: [Option<Border>; 2],
    pub(crate) before: [Option<(ToolSection, Contact)>; 2],
    /// Neighbours whose axis has turned: distance along the surface to the right.
    pub(crate) turned: [Option<f64>; 2],
    to_the_right: Vector2<f64>,
}

impl Placed {
    pub(crate) fn new(section: &PassSection) -> Self {
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

    pub(crate) fn check(&self, section: &PassSection) -> Result<(), PassError> {
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

    pub(crate) fn area_beside_turned(&self, section: &PassSection, cut: Cut<'_>) -> (f64, f64) {
        // Fraction of the area of a strip as deep as the stock and as wide as the step.
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

    /// Bounds the rounding of the integrals under the edges, each of the order of the extent of the
    /// cut; the crossings, which are as exact as their x, count only by the square of their error.
    pub(crate) fn rounding(&self, section: &PassSection) -> f64 {
        let width = 2.0 * self.tool.rim.half_width();
        let height = width + section.engagement.depth_of_cut;
        1e-13 * width * height
    }
}

/// Returns the outline of the cutter seen along the feed.
fn rim_seen(cutter: &CutterEnd, orientation: &Orientation) -> Rim {
    // A rim with a visible height over this fraction of its width is an ellipse; a lower one
    // changes areas by less than rounding.
    const EDGE_ON: f64 = 1e-14;
    let (along, across) = (orientation.lead.tan().abs(), orientation.lean.tan());
    let squash = along / (1.0 + along * along + across * across).sqrt();
    let rim = cutter.radius - cutter.corner_radius;
    // A ball looks the same from all sides.
    let is_round = rim == 0.0 || squash < EDGE_ON;
    Rim { rim, corner: cutter.corner_radius, squash: if is_round { 0.0 } else { squash } }
}
