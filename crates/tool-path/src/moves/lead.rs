//! Straight lines at the ends of pieces, as long as the border of the surface leans there.

use facemill_cl_data::{Aabb, CcPoint};
use facemill_cutter_location::links::approach::{ApproachSettings, ApproachShape, PassEnd};
use facemill_surface_model::Tree;
use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use crate::segments::PassSegment;

/// Region that passes are to cut, in all places of a pattern.
pub trait CutRegion: Sync {
    /// Returns whether the region holds the foot of a point near its surface, in a place of the
    /// pattern, from 0; a point beside the region has none.
    fn holds(&self, copy: u32, point: &Point3<f64>) -> bool;

    /// Returns half of the widest strip that a pass may cut, mm.
    fn half_strip(&self) -> f64;
}

/// One end of a piece.
struct SegmentEnd<'p> {
    cc: &'p CcPoint,
    /// Away from the piece.
    outward: Vector3<f64>,
    which: PassEnd,
    /// Way of the rim outward for each mm to the left of the contact: where the tool leans aside,
    /// its rim runs aslant of the feed, and cuts one half of the strip later than the other.
    slant: f64,
}

/// Largest slant of a rim that a line makes up for: beyond it (63°) the cutter is turned so far
/// that its strip ends near the contact.
const MOST_SLANT: f64 = 2.0;

/// Largest distance along the feed from one end to that of the piece beside, as a multiple of the
/// distance aside: where the other one ends farther out, no border runs from end to end.
const MOST_AHEAD: f64 = 3.0;

/// Least cosine between both outward directions.
const LEAST_ALONG: f64 = 0.5;

/// Ends farther aside than so many times the nearest one belong to the next strip.
const BESIDE: f64 = 1.5;

/// Largest distance aside from an end to that of the piece beside, in radii of the cutter.
const MOST_ASIDE: f64 = 1.0;

/// Returns settings of entry and exit of each piece. The straight line is as long as the strips
/// beside the end need, up to the border of the region if it is known: of the shortest shape at
/// most as long as given, of others at least so long.
pub(crate) fn leads(
    pieces: &[PassSegment],
    shapes: [&ApproachSettings; 2],
    region: Option<&dyn CutRegion>,
    radius: f64,
) -> Vec<[ApproachSettings; 2]> {
    let ends = SegmentEnds::of(pieces);
    let of_piece = |k: usize| {
        [PassEnd::Entry, PassEnd::Exit].map(|which| {
            let settings = shapes[usize::from(which == PassEnd::Exit)];
            let is_shortest = matches!(settings.shape, ApproachShape::Shortest { .. });
            let Some(end) = SegmentEnd::of(&pieces[k], which).filter(|_| is_shortest || region.is_some()) else {
                return *settings;
            };
            let beside = ends.beside(&end, k, radius);
            let to_border = region.and_then(|region| end.lead_to_border(&beside, (region, pieces[k].copy), radius));
            let bend = end_curvature(&pieces[k], which);
            if is_shortest {
                let lead = to_border.map_or_else(|| end.lead_to_beside(&beside, radius), |border| border.lead);
                return ApproachSettings { straight: lead.min(settings.straight), bend, ..*settings };
            }
            match to_border.filter(|border| border.is_aslant && border.lead > settings.straight) {
                Some(border) => ApproachSettings { straight: border.lead, bend, ..*settings },
                None => *settings,
            }
        })
    };
    (0..pieces.len()).into_par_iter().map(of_piece).collect()
}

/// Both ends of all pieces.
struct SegmentEnds<'p> {
    pieces: &'p [PassSegment],
    /// Each with the number of its piece.
    ends: Vec<(usize, SegmentEnd<'p>)>,
    tree: Tree,
}

impl<'p> SegmentEnds<'p> {
    fn of(pieces: &'p [PassSegment]) -> Self {
        let of_piece = |(k, piece): (usize, &'p PassSegment)| {
            [PassEnd::Entry, PassEnd::Exit]
                .into_iter()
                .filter_map(move |which| Some((k, SegmentEnd::of(piece, which)?)))
        };
        let ends: Vec<(usize, SegmentEnd<'p>)> = pieces.iter().enumerate().flat_map(of_piece).collect();
        let boxes: Vec<Aabb> = ends.iter().map(|(_, end)| Aabb::of_points([&end.cc.position])).collect();
        Self { pieces, ends, tree: Tree::build(&boxes) }
    }

    /// Returns the ends beside one in the same place of the pattern, by distances aside and ahead.
    fn beside(&self, of: &SegmentEnd<'_>, own: usize, radius: f64) -> Vec<(f64, f64)> {
        let (left, at) = (of.cc.left(), of.cc.position);
        let farthest = radius * MOST_ASIDE * MOST_AHEAD.hypot(1.0);
        let mut found: Vec<(f64, f64)> = Vec::new();
        self.tree.visit_boxes(
            |b| b.distance_sq(&at) <= farthest * farthest,
            |k| {
                let (piece, other) = &self.ends[k as usize];
                let way = other.cc.position - at;
                let (aside, ahead) = (left.dot(&way), of.outward.dot(&way));
                let is_beside = *piece != own
                    && self.pieces[*piece].copy == self.pieces[own].copy
                    && other.outward.dot(&of.outward) > LEAST_ALONG
                    && aside.abs() <= MOST_ASIDE * radius
                    && ahead.abs() <= MOST_AHEAD * aside.abs();
                if is_beside {
                    found.push((aside, ahead));
                }
            },
        );
        found
    }
}

impl<'p> SegmentEnd<'p> {
    fn of(piece: &'p PassSegment, which: PassEnd) -> Option<Self> {
        let cut = match which {
            PassEnd::Entry => piece.cuts.first()?,
            PassEnd::Exit => piece.cuts.last()?,
        };
        let cc = &cut.cc;
        let outward = if which == PassEnd::Entry { -cc.feed.into_inner() } else { cc.feed.into_inner() };
        // The rim at the contact runs across the lean of the axis.
        let rim = cc.normal.cross(&cut.pose.cl.axis);
        let (ahead, aside) = (rim.dot(&outward), rim.dot(&cc.left()));
        let slant = if aside == 0.0 { 0.0 } else { (ahead / aside).clamp(-MOST_SLANT, MOST_SLANT) };
        Some(Self { cc, outward, which, slant })
    }

    /// Returns the length beyond the end over which the cutter has to stay down: to the middle of
    /// the line between this end and that of the piece beside.
    fn lead_to_beside(&self, found: &[(f64, f64)], radius: f64) -> f64 {
        [-1.0, 1.0].map(|side| self.lead_of_side(found, side, radius)).into_iter().fold(0.0, f64::max)
    }

    /// Returns the length over which the region goes on beside the way outward, within half of the
    /// strips to the ends beside it, given by distances aside and ahead; `None` where it goes on
    /// straight ahead, so that the end is not at its border.
    fn lead_to_border(
        &self,
        found: &[(f64, f64)],
        (region, copy): (&dyn CutRegion, u32),
        radius: f64,
    ) -> Option<BorderLead> {
        let half = |side: f64| {
            let of_side = found.iter().filter(|(aside, _)| side * aside > 0.0);
            of_side.map(|(aside, _)| 0.5 * aside.abs()).fold(region.half_strip(), f64::min)
        };
        let halves = [-1.0, 1.0].map(half);
        let unit = halves[0].max(halves[1]);
        let (left, at) = (self.cc.left().into_inner(), self.cc.position);
        let holds = |aside: f64, ahead: f64| region.holds(copy, &(at + left * aside + self.outward * ahead));
        let border = |aside: f64| border_ahead(|ahead| holds(aside, ahead), unit);
        if border(0.0).is_some_and(|ahead| ahead > AT_BORDER * unit) {
            return None;
        }
        let n = i32::from(ACROSS);
        let asides = (-n..=n).map(|k| f64::from(k) / f64::from(n) * halves[usize::from(k > 0)]);
        let mut found = BorderLead { lead: 0.0, is_aslant: false };
        for (aside, ahead) in asides.filter_map(|aside| Some((aside, border(aside)?))) {
            // The rim cuts a place aside behind the contact.
            let behind = if self.which == PassEnd::Exit { aside * aside / (2.0 * radius) } else { 0.0 };
            found.lead = found.lead.max((ahead - aside * self.slant).max(0.0) + behind);
            found.is_aslant |= ahead > ASLANT * unit;
        }
        Some(found)
    }

    /// Returns the length that the ends on one side require, by distances aside and ahead. Beside
    /// the last pass of a region there is none: its border is taken to run on as on the other side.
    fn lead_of_side(&self, found: &[(f64, f64)], side: f64, radius: f64) -> f64 {
        let next = |side: f64| -> Vec<(f64, f64)> {
            let of_side: Vec<(f64, f64)> = found
                .iter()
                .filter(|(aside, _)| side * aside > 0.0)
                .map(|(aside, ahead)| (aside.abs(), *ahead))
                .collect();
            let nearest = of_side.iter().map(|(aside, _)| *aside).fold(f64::INFINITY, f64::min);
            of_side.into_iter().filter(|(aside, _)| *aside <= BESIDE * nearest).collect()
        };
        let mut ends = next(side);
        if ends.is_empty() {
            ends = next(-side).into_iter().map(|(aside, ahead)| (aside, -ahead)).collect();
        }
        let lead = |(aside, ahead): (f64, f64)| {
            // The rim cuts the middle of the strip behind the contact.
            let behind = if self.which == PassEnd::Exit { aside * aside / (8.0 * radius) } else { 0.0 };
            let slanted = (-0.5 * side * aside * self.slant).max(0.0);
            (0.5 * ahead + slanted).max(0.0) + behind
        };
        ends.into_iter().map(lead).fold(0.0, f64::max)
    }
}

/// Line that leads over the border of a region.
#[derive(Clone, Copy, Debug, PartialEq)]
struct BorderLead {
    /// Its length, mm.
    lead: f64,
    /// Whether the region goes on beside it: else it is for the rim alone.
    is_aslant: bool,
}

/// Way that a region goes on beside the end of a pass, in half strips, from which its border leans.
const ASLANT: f64 = 0.1;

/// Distance of an end from the border straight ahead, in half strips, up to which it is at the
/// border.
const AT_BORDER: f64 = 0.25;

/// Places on each half of a strip at which the border is sought.
const ACROSS: u8 = 6;

/// Steps to a half strip in which the border is sought, before it is halved between two.
const STEPS: i32 = 8;

/// Halvings between two steps.
const HALVINGS: usize = 5;

/// Returns how far ahead of an end places are held, one after the other from just behind it, at
/// most [`MOST_AHEAD`] half strips; `None` if not even that behind it is.
fn border_ahead(holds: impl Fn(f64) -> bool, half_strip: f64) -> Option<f64> {
    let at = |step: i32| half_strip * f64::from(step) / f64::from(STEPS);
    let last = (MOST_AHEAD * f64::from(STEPS)) as i32;
    // Half a step behind: the end itself is on the border, up to rounding.
    let behind = -0.5 * at(1);
    if !holds(behind) {
        return None;
    }
    let Some(beyond) = (0..=last).find(|&step| !holds(at(step))) else { return Some(at(last)) };
    let (mut held, mut not) = (if beyond == 0 { behind } else { at(beyond - 1) }, at(beyond));
    for _ in 0..HALVINGS {
        let middle = 0.5 * (held + not);
        if holds(middle) { held = middle } else { not = middle }
    }
    Some(not)
}

/// Length of the part of a pass that the curvature at its end is taken from, mm: longer than the
/// facets of fine meshes.
const CURVED_OVER: f64 = 10.0;

/// Returns the curvature of a piece in the plane of feed and normal at an end, 1/mm, positive where
/// the surface is convex; 0 where it is not known.
fn end_curvature(piece: &PassSegment, which: PassEnd) -> f64 {
    let n = piece.cuts.len();
    let at = |k: usize| &piece.cuts[if which == PassEnd::Entry { k } else { n - 1 - k }].cc;
    let away = |k: usize| (at(k).position - at(0).position).norm();
    let Some(inner) = (1..n).find(|&k| away(k) >= CURVED_OVER).or_else(|| n.checked_sub(1).filter(|&k| k > 0)) else {
        return 0.0;
    };
    let way = at(inner).position - at(0).position;
    let turn = at(inner).normal.into_inner() - at(0).normal.into_inner();
    let length_sq = way.norm_squared();
    if length_sq > 0.0 { turn.dot(&way) / length_sq } else { 0.0 }
}

#[cfg(test)]
#[path = "../../tests/unit/moves/lead.rs"]
mod tests;
