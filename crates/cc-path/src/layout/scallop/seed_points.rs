use facemill_surface_model::{Surface, SurfacePoint, SurfaceSettings};
use nalgebra::Point3;

use crate::error::PathError;
use crate::layout::scallop::surface_path::SurfacePath;
use crate::strategy::patch::Patch;

/// Points of a seed may be so far off the surface, mm: more is another surface, or another frame.
const MOST_OFF: f64 = 1.0;

/// Cosine of the turn of the normal between neighbouring feet from which the surface may be another
/// one, 60°.
const SAME_SIDE: f64 = 0.5;

/// Feet may be apart by this many times the way between the points above them, and by [`MOST_OFF`]:
/// where a chord lies above a hollow, feet spread, and jump between its facets.
const SPREAD: f64 = 4.0;

/// Halvings by which the place of a jump is found: a step of 1 m comes down to 1 µm.
const HALVINGS: usize = 20;

/// The polyline through some points, put on the patch.
///
/// # Errors
/// When a point is off the patch, or between two points the nearest place of the patch hops to
/// another part of it.
pub(crate) fn projected(patch: &Patch, points: &[Point3<f64>], spacing: f64) -> Result<SurfacePath, PathError> {
    let surface = Surface::new(patch.mesh.clone(), SurfaceSettings::default());
    let closed = points.len() > 3 && points.first() == points.last();
    if let Some(point) = points.iter().position(|p| surface.closest_point(p, MOST_OFF).is_none()) {
        return Err(PathError::SeedOff { point, position: points[point], most: MOST_OFF });
    }
    let (mut nodes, mut triangles): (Vec<Point3<f64>>, Vec<u32>) = (Vec::new(), Vec::new());
    for (k, w) in points.windows(2).enumerate() {
        let chord = Chord { patch, surface: &surface, ends: [w[0], w[1]] };
        let n = (chord.length() / spacing).ceil().clamp(1.0, 1e4) as usize;
        let mut before: Option<(f64, SurfacePoint)> = None;
        for share in (0..=n).map(|i| i as f64 / n as f64) {
            let foot = chord.foot(share).ok_or_else(|| chord.off(k, share))?;
            if let Some(position) = before.and_then(|before| chord.hop(before, (share, foot))) {
                return Err(PathError::SeedHops { point: k, position });
            }
            before = Some((share, foot));
            if k == 0 || share > 0.0 {
                nodes.push(foot.position);
                triangles.push(foot.triangle);
            }
        }
    }
    if closed {
        nodes.pop();
        triangles.pop();
    }
    if nodes.len() < 2 {
        return Err(PathError::SeedNowhere { seed: "of fewer than two points; give at least two".to_owned() });
    }
    Ok(SurfacePath { nodes, triangles, closed })
}

/// Straight line between two points of a seed.
struct Chord<'a> {
    patch: &'a Patch<'a>,
    surface: &'a Surface,
    ends: [Point3<f64>; 2],
}

impl Chord<'_> {
    fn length(&self) -> f64 {
        nalgebra::distance(&self.ends[0], &self.ends[1])
    }

    fn at(&self, share: f64) -> Point3<f64> {
        self.ends[0] + (self.ends[1] - self.ends[0]) * share
    }

    /// Largest distance of the surface from it, mm: between points the chord may leave a curved
    /// surface.
    fn most(&self) -> f64 {
        MOST_OFF + 0.25 * self.length()
    }

    /// The nearest place of the surface a share of the way along it.
    fn foot(&self, share: f64) -> Option<SurfacePoint> {
        self.surface.closest_point(&self.at(share), self.most())
    }

    fn off(&self, point: usize, share: f64) -> PathError {
        PathError::SeedOff { point, position: self.at(share), most: self.most() }
    }

    /// Whether two feet may lie on different parts of the surface.
    fn are_apart(&self, step: f64, a: &SurfacePoint, b: &SurfacePoint) -> bool {
        let normal = |foot: &SurfacePoint| self.patch.normal(foot.triangle, &foot.position);
        nalgebra::distance(&a.position, &b.position) > SPREAD * step + MOST_OFF || normal(a).dot(&normal(b)) < SAME_SIDE
    }

    /// Where the feet hop to another part of the surface between two places of the chord; `None`
    /// where they do not, as across a sharp edge, at which the feet on both sides meet.
    fn hop(&self, a: (f64, SurfacePoint), b: (f64, SurfacePoint)) -> Option<Point3<f64>> {
        let step = (b.0 - a.0) * self.length();
        if !self.are_apart(step, &a.1, &b.1) {
            return None;
        }
        let gap = |a: &SurfacePoint, b: &SurfacePoint| nalgebra::distance(&a.position, &b.position);
        let (mut from, mut to) = (a, b);
        for _ in 0..HALVINGS {
            let share = 0.5 * (from.0 + to.0);
            let Some(foot) = self.foot(share) else { break };
            let middle = (share, foot);
            if gap(&from.1, &middle.1) > gap(&middle.1, &to.1) { to = middle } else { from = middle }
        }
        let left = gap(&from.1, &to.1);
        (left > 1e-3 * step && self.are_apart(step, &from.1, &to.1)).then(|| self.at(from.0))
    }
}
