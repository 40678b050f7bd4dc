use facemill_cl_data::ClPoint;
use nalgebra::{Point3, Unit, Vector3};

use crate::dexel::bodies::body::{Corner, RoundRing, TurnedBody};

/// Body at rest in the frame of a map, queried along lines parallel to +z.
#[derive(Clone, Debug)]
pub(crate) struct Placed<'a> {
    pub(crate) body: &'a TurnedBody,
    pub(crate) tip: Vector3<f64>,
    pub(crate) axis: Vector3<f64>,
    /// A height below all of the body.
    below: f64,
}

/// Where a line enters a body from below.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Entry {
    pub(crate) height: f64,
    /// Outward normal there.
    pub(crate) normal: Vector3<f64>,
}

/// Steps after which a line is said to miss: each at least halves what is left where it only
/// grazes.
const MAX_STEPS: usize = 80;

impl<'a> Placed<'a> {
    pub(crate) fn new(body: &'a TurnedBody, pose: &ClPoint) -> Self {
        let (tip, axis) = (pose.tip.coords, pose.axis.into_inner());
        let mut placed = Self { body, tip, axis, below: 0.0 };
        let low = -placed.height_in(&-Vector3::z());
        placed.below = low - 1.0 - body.middle().1;
        placed
    }

    pub(crate) fn mirrored(&self) -> Self {
        let flip = |v: Vector3<f64>| Vector3::new(v.x, v.y, -v.z);
        let pose = ClPoint { tip: Point3::from(flip(self.tip)), axis: Unit::new_unchecked(flip(self.axis)) };
        Self::new(self.body, &pose)
    }

    /// Largest coordinate of the body along a direction.
    pub(crate) fn height_in(&self, n: &Vector3<f64>) -> f64 {
        let along = n.dot(&self.axis);
        let across = (n - self.axis * along).norm();
        let length = n.norm();
        let reach = |c: &Corner| c.reach(across / length, along / length);
        n.dot(&self.tip) + length * self.body.corners().iter().map(reach).fold(f64::NEG_INFINITY, f64::max)
    }

    /// The boundary point that is farthest along a unit direction.
    pub(crate) fn support(&self, n: &Vector3<f64>) -> Support {
        let along = n.dot(&self.axis);
        let perp = n - self.axis * along;
        let across = perp.norm();
        let out = if across > 0.0 { perp / across } else { Vector3::zeros() };
        let mut corner = self.body.corners()[0];
        for c in &self.body.corners()[1..] {
            corner = if c.reach(across, along) > corner.reach(across, along) { *c } else { corner };
        }
        let ring = corner.flat_end(along);
        let point = self.tip + out * ring.radius + self.axis * ring.height + n * ring.rounding;
        Support { point, ring, out, across }
    }

    /// Signed distance of a point, and the outward normal.
    #[inline(always)]
    fn gap(&self, p: &Vector3<f64>) -> (f64, Vector3<f64>) {
        let v = p - self.tip;
        let height = v.dot(&self.axis);
        let perp = v - self.axis * height;
        let radial = perp.norm();
        let (gap, [across, along]) = self.body.gap(radial, height);
        let out = if radial > 0.0 { across / radial } else { 0.0 };
        (gap, perp * out + self.axis * along)
    }

    pub(crate) fn holds(&self, p: &Vector3<f64>) -> bool {
        self.gap(p).0 <= 0.0
    }

    /// Where the line through (x, y) enters the body, searched from a height near it; `None` where
    /// it misses.
    ///
    /// Newton's method on a convex function: from the left of the root every step stays left of it
    /// and converges, from beyond it the first step comes back.
    #[inline]
    pub(crate) fn entry(&self, x: f64, y: f64, near: Option<f64>) -> Option<Entry> {
        let mut p = Vector3::new(x, y, near.unwrap_or(self.below));
        let mut is_cold = near.is_none();
        for _ in 0..MAX_STEPS {
            let (gap, normal) = self.gap(&p);
            if normal.z >= 0.0 {
                if is_cold {
                    return None;
                }
                (p.z, is_cold) = (self.below, true);
                continue;
            }
            let step = -gap / normal.z;
            p.z += step;
            if step.abs() <= 1e-8 * -normal.z || p.z - step == p.z {
                return Some(Entry { height: p.z, normal });
            }
        }
        None
    }
}

/// Point of a body's boundary with a given outward normal.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Support {
    pub(crate) point: Vector3<f64>,
    pub(crate) ring: RoundRing,
    /// Unit vector from the axis toward the point.
    pub(crate) out: Vector3<f64>,
    /// How much of the normal is across the axis.
    pub(crate) across: f64,
}
