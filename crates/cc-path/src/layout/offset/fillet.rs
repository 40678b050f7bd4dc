//! Middle line and radius of a fillet between two surfaces.

use std::collections::BTreeMap;

use nalgebra::{Point3, Unit, Vector3};

use crate::distance::curve_distance::CurveDistance;
use crate::distance::patch_vertices::PatchVertices;
use crate::distance::source_curve::SourceCurve;
use crate::error::PathError;
use crate::layout::offset::edge_lines::{BorderSide, border_sides};
use crate::layout::offset::ridge_profile::turn_about;
use crate::layout::scallop::seeds::chained;
use crate::layout::scallop::surface_path::{SurfacePath, trace_zero};
use crate::layout::section_walk::SectionWalk;
use crate::strategy::patch::Patch;

/// The smallest radius of a fillet.
#[derive(Clone, Copy, Debug, PartialEq)]
struct FilletRadius {
    /// mm.
    radius: f64,
    position: Point3<f64>,
}

/// A group of the surface that is a fillet between two others, on a patch.
pub(crate) struct Fillet<'a> {
    patch: &'a Patch<'a>,
    vertices: &'a PatchVertices,
    /// Index of the group.
    group: usize,
}

/// Place of the middle line of a fillet.
#[derive(Clone, Copy, Debug)]
struct FilletPlace {
    position: Point3<f64>,
    triangle: u32,
    along: Unit<Vector3<f64>>,
}

/// Places along the middle line at which turn and radius are measured, at most.
const MOST_PROFILES: usize = 400;

/// Convex turn of the surface across a group from which it is no fillet, rad (11°): less is the
/// unevenness of a mesh.
const CONVEX: f64 = 0.2;

/// Concave turn across a group below which it is flat, rad (3°).
const FLAT: f64 = 0.05;

impl<'a> Fillet<'a> {
    pub(crate) fn new(patch: &'a Patch<'a>, vertices: &'a PatchVertices, group: usize) -> Self {
        Self { patch, vertices, group }
    }

    fn is_in(&self, triangle: u32) -> bool {
        self.patch.surface.mesh().group_of(self.patch.parent(triangle) as usize) == Some(self.group)
    }

    fn no_fillet(&self, reason: String) -> PathError {
        PathError::NoFillet { group: self.patch.surface.mesh().groups()[self.group].name.clone(), reason }
    }

    /// The line as far from one border of the fillet as from the other.
    ///
    /// # Errors
    /// When the fillet has not two borders in the region, is convex somewhere, or flat.
    pub(crate) fn middle(&self, spacing: f64) -> Result<Vec<SurfacePath>, PathError> {
        let triangles: Vec<u32> = (0..self.patch.mesh.triangles().len() as u32).filter(|&t| self.is_in(t)).collect();
        if triangles.is_empty() {
            return Err(self.no_fillet("no triangle of it lies in the region; add it to the region".to_owned()));
        }
        let borders = self.borders()?;
        let n = self.patch.mesh.vertices().len();
        let mut distances = [vec![f64::NAN; n], vec![f64::NAN; n]];
        let curves =
            borders.map(|paths| paths.iter().filter_map(|p| p.source(self.patch, spacing)).collect::<Vec<_>>());
        let fields = [&curves[0], &curves[1]].map(|curves| self.distance(curves));
        for (values, field) in distances.iter_mut().zip(&fields) {
            field.reached().iter().for_each(|(v, foot)| values[*v as usize] = foot.distance);
        }
        let [from_first, from_second] = &distances;
        let values: Vec<f64> = from_first.iter().zip(from_second).map(|(a, b)| a - b).collect();
        let lines = trace_zero(self.patch, &values, &triangles, |[a, b], t| {
            values[a as usize] * (1.0 - t) + values[b as usize] * t
        });
        if lines.is_empty() {
            return Err(self.no_fillet("both of its borders are nowhere opposite to each other".to_owned()));
        }
        self.check_concave(&lines)?;
        Ok(lines)
    }

    fn distance<'b>(&'b self, curves: &'b [SourceCurve]) -> CurveDistance<'b> {
        let touches = |v: u32| self.vertices.triangles(v).iter().any(|&t| self.is_in(t));
        CurveDistance::new(self.patch, self.vertices, curves, f64::INFINITY, touches)
    }

    /// Both borders of the fillet: with two other groups, or two borders with one.
    fn borders(&self) -> Result<[Vec<SurfacePath>; 2], PathError> {
        let mut by_group: BTreeMap<usize, Vec<(u32, usize)>> = BTreeMap::new();
        for BorderSide { triangle, side, other, .. } in
            border_sides(self.patch).into_iter().filter(|s| s.own == self.group)
        {
            by_group.entry(other).or_default().push((triangle, side));
        }
        let names: Vec<String> =
            by_group.keys().map(|&g| format!("\"{}\"", self.patch.surface.mesh().groups()[g].name)).collect();
        let mut chains: Vec<Vec<SurfacePath>> =
            by_group.into_values().map(|sides| chained(self.patch, sides)).collect();
        if let [only] = chains.as_mut_slice() {
            chains = std::mem::take(only).into_iter().map(|path| vec![path]).collect();
        }
        <[Vec<SurfacePath>; 2]>::try_from(chains).map_err(|chains| {
            self.no_fillet(match (names.as_slice(), chains.len()) {
                ([], _) => "no other group borders on it".to_owned(),
                ([only], n) => format!("it has {n} borders with {only}, but needs two, one on each side"),
                (_, _) => format!("it borders on {}, but has to lie between two groups; split it", names.join(", ")),
            })
        })
    }

    /// Whether a corner of this radius, mm, fits the fillet.
    ///
    /// # Errors
    /// When the fillet is somewhere more than a hundredth tighter: meshes are no more accurate.
    pub(crate) fn check_fit(&self, lines: &[SurfacePath], corner_radius: f64) -> Result<(), PathError> {
        match self.least_radius(lines) {
            Some(FilletRadius { radius, position }) if corner_radius > 1.01 * radius => {
                Err(PathError::FilletTooTight { radius, position, corner_radius })
            }
            _ => Ok(()),
        }
    }

    /// # Errors
    /// When the surface is convex across the group somewhere, or everywhere flat.
    fn check_concave(&self, lines: &[SurfacePath]) -> Result<(), PathError> {
        let mut sharpest: Option<f64> = None;
        for place in places(lines) {
            let Some(turn) = self.profile(&place).and_then(|p| Some(p.last()?.1 - p.first()?.1)) else { continue };
            sharpest = Some(sharpest.map_or(turn, |most| most.max(turn)));
            if turn < -CONVEX {
                let (p, turn) = (place.position, -turn.to_degrees());
                return Err(self.no_fillet(format!(
                    "it is convex at ({:.3}, {:.3}, {:.3}), where the surface turns outward by {turn:.0}° across it; a \
                     fillet lies in a concave corner: take the strategy edge for a convex edge",
                    p.x, p.y, p.z
                )));
            }
        }
        match sharpest.filter(|turn| *turn < FLAT) {
            Some(turn) => Err(self.no_fillet(format!(
                "it is flat: the surface turns inward by no more than {:.1}° across it; name the group that rounds the \
                 corner, or both groups of the corner by between_groups",
                turn.max(0.0).to_degrees()
            ))),
            None => Ok(()),
        }
    }

    /// The smallest radius across the fillet along its middle line: length over turn, over half of
    /// its width. `None` where nothing turns inward.
    fn least_radius(&self, lines: &[SurfacePath]) -> Option<FilletRadius> {
        let radius = |place: FilletPlace| {
            let radius = sharpest(&self.profile(&place)?)?;
            Some(FilletRadius { radius, position: place.position })
        };
        places(lines).filter_map(radius).reduce(|least, next| if next.radius < least.radius { next } else { least })
    }

    /// Way and turn of the normal across the fillet, concave turns rising.
    fn profile(&self, place: &FilletPlace) -> Option<Vec<(f64, f64)>> {
        let FilletPlace { position, triangle, along } = *place;
        let middle = self.patch.normal(triangle, &position);
        let across = middle.cross(&along);
        let half = |toward: Vector3<f64>, axis: Vector3<f64>| -> Option<Vec<(f64, f64)>> {
            let walk = SectionWalk::from_place(self.patch, triangle, position, along, &toward)?;
            let mut profile = vec![(0.0, 0.0)];
            for step in walk.take_while(|s| self.is_in(s.triangle)) {
                // The facet's own smooth normal ends at the border of the fillet.
                let normal = self.patch.normal(step.triangle, &step.position);
                profile.push((step.way, turn_about(&axis, &middle, &normal)));
            }
            Some(profile)
        };
        let (left, right) = (half(across, along.into_inner())?, half(-across, -along.into_inner())?);
        let before = right.into_iter().skip(1).rev().map(|(way, turn)| (-way, -turn));
        Some(before.chain(left).collect())
    }
}

/// Places along lines, evenly by nodes.
fn places(lines: &[SurfacePath]) -> impl Iterator<Item = FilletPlace> + '_ {
    let n: usize = lines.iter().map(|l| l.nodes.len()).sum();
    let every = n.div_ceil(MOST_PROFILES).max(1);
    let place = |line: &SurfacePath, k: usize| {
        let (before, after) = (k.saturating_sub(1), (k + 1).min(line.nodes.len() - 1));
        let along = Unit::try_new(line.nodes[after] - line.nodes[before], 1e-12)?;
        Some(FilletPlace { position: line.nodes[k], triangle: line.triangles[k], along })
    };
    lines.iter().flat_map(move |line| (0..line.nodes.len()).step_by(every).filter_map(move |k| place(line, k)))
}

/// The smallest radius over half of a profile of way and turn, concave turns rising.
fn sharpest(profile: &[(f64, f64)]) -> Option<f64> {
    let (first, last) = (profile.first()?.0, profile.last()?.0);
    let window = 0.5 * (last - first);
    let turn_at = |way: f64| {
        let k = profile.partition_point(|s| s.0 <= way).clamp(1, profile.len() - 1);
        let [(a, from), (b, to)] = [profile[k - 1], profile[k]];
        if b > a { from + (to - from) * ((way - a) / (b - a)).clamp(0.0, 1.0) } else { to }
    };
    if profile.len() < 3 || window <= 0.0 {
        return None;
    }
    let starts = (0..=16).map(|k| first + window * f64::from(k) / 16.0);
    let turn = starts.map(|s| turn_at(s + window) - turn_at(s)).fold(0.0, f64::max);
    (turn > 1e-6).then_some(window / turn)
}
