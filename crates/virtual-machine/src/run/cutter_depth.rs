use std::f64::consts::SQRT_2;

use facemill_cl_data::{RoundFrustum, Solid};
use facemill_interference::{Interference, Verdict, Witness};
use facemill_tool_model::Cutter;
use nalgebra::{Isometry3, Point3};

use crate::run::track::{Placement, Shape, Track};

/// The cutter as what its depth in a mesh is measured with.
///
/// The depth is the smallest t for which a body within the cutter that leaves no cutter point farther than t from it is
/// free: no cutter point is deeper than that. Up to the corner radius r it is r − distance(core, mesh), exactly; the core
/// is the cylinder whose r-neighbourhood is the cutter. Deeper, for sharp cutters (r = 0) and at the upper rim of the
/// flute it is found by bisection over t. Of several bodies that serve for a t one free one is enough: the test body of
/// `docs/architecture.md`, the cutter raised by t, the cutter narrowed by t, its upper part lowered by t. So the depth of a
/// flat bottom, a straight wall or a flat ceiling is the true one, and that of an edge at most √2 times it.
#[derive(Clone, Debug)]
pub(crate) struct CutterDepth {
    cutter: Cutter,
    core: Shape,
    /// The cutter above its core, where the core's neighbourhood is rounded and the cutter is not.
    band: Option<Shape>,
}

/// Where the cutter is relative to one obstacle, from pose to pose.
#[derive(Clone, Debug, Default)]
pub(crate) struct CutterTrack {
    core: Track,
    band: Track,
}

/// The cutter somewhere, workpiece frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CutterPlacement {
    work_from_tool: Isometry3<f64>,
    core: Placement,
    band: Option<Placement>,
}

/// How deep, and a point of the mesh in the cutter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Depth {
    pub(crate) depth: f64,
    pub(crate) place: Point3<f64>,
}

/// Accuracy of depths found by bisection, mm: a tenth of what findings are told with. Smaller costs verdicts only.
const RESOLUTION: f64 = 1e-3;

impl CutterDepth {
    pub(crate) fn new(cutter: &Cutter) -> Self {
        let shape = |f| Shape::core_of(&Solid::Frustum(f));
        Self { cutter: *cutter, core: shape(cutter.core()), band: band(cutter, 0.0).map(shape) }
    }

    /// The same that only looks whether an edge is in the mesh: the bottom with its corner, and the upper end of the flute. How
    /// deep the cutter then is, is measured of all of it.
    pub(crate) fn at_edges(cutter: &Cutter) -> Self {
        let core = disc(cutter.corner_radius(), cutter.rim_radius());
        Self { cutter: *cutter, core, band: Some(disc(cutter.flute_length(), cutter.radius())) }
    }

    pub(crate) fn placed(&self, work_from_tool: &Isometry3<f64>) -> CutterPlacement {
        CutterPlacement {
            work_from_tool: *work_from_tool,
            core: self.core.placed(*work_from_tool),
            band: self.band.as_ref().map(|s| s.placed(*work_from_tool)),
        }
    }

    /// How deep the cutter is in `mesh` with material of thickness `allowance` on it, where that is more than `floor`
    /// (both mm, at least 0).
    pub(crate) fn beyond(
        &self,
        floor: f64,
        allowance: f64,
        at: &CutterPlacement,
        track: &mut CutterTrack,
        mesh: &dyn Interference,
    ) -> Option<Depth> {
        let skin = self.cutter.corner_radius() + allowance;
        let nearest = track.core.nearest_within((skin - floor).max(0.0), &self.core, &at.core, mesh);
        let exact = nearest.filter(|s| s.distance > 0.0 && skin - s.distance > floor);
        let exact = exact.map(|s| Depth { depth: skin - s.distance, place: s.point });
        let is_deep = nearest.is_some_and(|s| s.distance <= 0.0);
        let is_above =
            self.band.as_ref().zip(at.band.as_ref()).is_some_and(|(shape, placement)| {
                track.band.nearest_within(allowance, shape, placement, mesh).is_some()
            });
        let bisected = (is_deep || is_above)
            .then(|| self.bisect(exact.map_or(floor, |d| d.depth), allowance, &at.work_from_tool, mesh))
            .flatten();
        bisected.or(exact)
    }

    /// Smallest t above `floor` that [`CutterDepth::hit`] finds free; `None` where `floor` is.
    fn bisect(
        &self,
        floor: f64,
        allowance: f64,
        work_from_tool: &Isometry3<f64>,
        mesh: &dyn Interference,
    ) -> Option<Depth> {
        let hit = |t: f64| self.hit(t, allowance, work_from_tool, mesh);
        let mut place = hit(floor)?.point;
        // At this tolerance nothing is left of the cutter but a line: the depth is at least that.
        let r = self.cutter.corner_radius();
        let deepest = r + (self.cutter.radius().min(self.cutter.flute_length()) - r) * SQRT_2;
        if let Some(w) = hit(deepest) {
            return Some(Depth { depth: deepest.max(floor), place: w.point });
        }
        let (mut cut, mut free) = (floor, deepest);
        while free - cut > RESOLUTION {
            let middle = 0.5 * (cut + free);
            match hit(middle) {
                Some(w) => (cut, place) = (middle, w.point),
                None => free = middle,
            }
        }
        Some(Depth { depth: free, place })
    }

    /// A point of the mesh that may be deeper than `tolerance` in the cutter dilated by the allowance; `None` where none is.
    fn hit(
        &self,
        tolerance: f64,
        allowance: f64,
        work_from_tool: &Isometry3<f64>,
        mesh: &dyn Interference,
    ) -> Option<Witness> {
        let witness =
            |body: RoundFrustum| match mesh.verdict(&Solid::Frustum(body).dilated(allowance), work_from_tool, None) {
                Verdict::Hit(w) => Some(w),
                Verdict::Free => None,
            };
        let (c, t) = (&self.cutter, tolerance);
        let lower = witness(c.test_body(t));
        if t < c.corner_radius() {
            // Below the band the test body alone tells, in it all bodies do.
            return lower.or_else(|| {
                let upper = c.upper_test_body(t).and_then(witness)?;
                band(c, t).and_then(witness)?;
                lowered_band(c, t).and_then(witness).and(Some(upper))
            });
        }
        let raised = || witness(cylinder(c.radius(), t.min(c.flute_length()), c.flute_length()));
        let narrowed = || witness(cylinder((c.radius() - t).max(0.0), 0.0, c.flute_length()));
        lower.filter(|_| raised().is_some() && narrowed().is_some())
    }
}

/// The part of the cutter above its core, narrowed by `by`; `None` for a sharp cutter, which has none.
fn band(cutter: &Cutter, by: f64) -> Option<RoundFrustum> {
    let z_low = cutter.core().z_high;
    let band = || cylinder((cutter.radius() - by).max(0.0), z_low, cutter.flute_length());
    (z_low < cutter.flute_length()).then(band)
}

/// The same with its top `by` lower.
fn lowered_band(cutter: &Cutter, by: f64) -> Option<RoundFrustum> {
    let (z_low, z_high) = (cutter.core().z_high, cutter.flute_length() - by);
    (z_low < z_high).then(|| cylinder(cutter.radius(), z_low, z_high))
}

fn cylinder(radius: f64, z_low: f64, z_high: f64) -> RoundFrustum {
    RoundFrustum { z_low, z_high, radius_low: radius, radius_high: radius, rounding: 0.0 }
}

/// A disc square to z.
pub(crate) fn disc(z: f64, radius: f64) -> Shape {
    let disc = RoundFrustum { z_low: z, z_high: z, radius_low: radius, radius_high: radius, rounding: 0.0 };
    Shape::core_of(&Solid::Frustum(disc))
}

#[cfg(test)]
mod tests {
    use crate::run::cutter_depth::*;
    use facemill_interference::MeshTree;
    use facemill_surface_model::TriMesh;
    use nalgebra::{Translation3, UnitQuaternion, Vector3};

    /// Uniform numbers in 0..1.
    struct Lcg(u64);

    impl Lcg {
        fn next(&mut self) -> f64 {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 11) as f64 / (1u64 << 53) as f64
        }

        fn between(&mut self, low: f64, high: f64) -> f64 {
            low + (high - low) * self.next()
        }
    }

    /// Bumpy open patch of 2·n² triangles, 100 mm square, about z = 0.
    fn patch(n: u32, rng: &mut Lcg) -> TriMesh {
        let mut vertices = Vec::new();
        for j in 0..=n {
            for i in 0..=n {
                let [x, y] = [i, j].map(|k| 100.0 * (f64::from(k) / f64::from(n) - 0.5));
                vertices.push(Point3::new(x, y, rng.between(-2.0, 2.0)));
            }
        }
        let mut triangles = Vec::new();
        for j in 0..n {
            for i in 0..n {
                let a = j * (n + 1) + i;
                triangles.push([a, a + 1, a + n + 2]);
                triangles.push([a, a + n + 2, a + n + 1]);
            }
        }
        TriMesh::new(vertices, triangles).unwrap()
    }

    fn square(half: f64) -> MeshTree {
        let corner = |x: f64, y: f64| Point3::new(x * half, y * half, 0.0);
        let vertices = vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
        MeshTree::new(&TriMesh::new(vertices, vec![[0, 1, 2], [0, 2, 3]]).unwrap())
    }

    fn pose(tip: [f64; 3], turn: Vector3<f64>) -> Isometry3<f64> {
        Isometry3::from_parts(Translation3::from(tip), UnitQuaternion::from_scaled_axis(turn))
    }

    /// Points of every triangle, at most `spacing` from any other point of it.
    fn samples(mesh: &TriMesh, spacing: f64) -> Vec<Point3<f64>> {
        let mut points = Vec::new();
        for k in 0..mesh.triangles().len() {
            let [a, b, c] = mesh.corners(k);
            let n = ((b - a).norm().max((c - b).norm()).max((a - c).norm()) / spacing).ceil();
            for i in 0..=n as u32 {
                for j in 0..=(n as u32 - i) {
                    points.push(a + (b - a) * (f64::from(i) / n) + (c - a) * (f64::from(j) / n));
                }
            }
        }
        points
    }

    /// Depth of a point in the cutter as a solid, from its outline in the half plane; negative outside.
    fn depth_in_cutter(c: &Cutter, p: &Point3<f64>) -> f64 {
        let (rho, r) = (p.x.hypot(p.y), c.corner_radius());
        let (out, up) = (rho - c.rim_radius(), r - p.z);
        if out > 0.0 && up > 0.0 { r - out.hypot(up) } else { (c.radius() - rho).min(p.z) }
    }

    #[test]
    fn depth_of_random_poses_is_that_of_a_dense_cloud_of_mesh_points() {
        let mut rng = Lcg(3);
        let mesh = patch(6, &mut rng);
        let (tree, spacing) = (MeshTree::new(&mesh), 0.5);
        let cloud = samples(&mesh, spacing);
        let cutter = Cutter::new(16.0, 5.0, 60.0).unwrap();
        let probe = CutterDepth::new(&cutter);
        let mut track = CutterTrack::default();
        let mut n_deep = 0;
        for _ in 0..150 {
            let turn = Vector3::new(rng.between(-0.3, 0.3), rng.between(-0.3, 0.3), rng.between(-3.0, 3.0));
            let at = pose([rng.between(-30.0, 30.0), rng.between(-30.0, 30.0), rng.between(1.0, 7.0)], turn);
            let deepest = cloud.iter().map(|p| depth_in_cutter(&cutter, &at.inverse_transform_point(p)));
            let sampled = deepest.fold(f64::NEG_INFINITY, f64::max);
            let found = probe.beyond(0.0, 0.0, &probe.placed(&at), &mut track, &tree).map_or(0.0, |d| d.depth);
            // Below r the depth of a point is its distance from the cutter's surface; deeper, sharp bodies bound it.
            if sampled < 4.0 {
                assert!(found >= sampled - 1e-9, "{found} {sampled}");
                assert!(found <= sampled.max(0.0) + spacing, "{found} {sampled}");
            } else {
                assert!(found >= sampled - 2.0 * RESOLUTION && found <= 1.5 * sampled + 1.0, "{found} {sampled}");
            }
            n_deep += i32::from(found > 0.0);
        }
        assert!((30..145).contains(&n_deep), "{n_deep} of 150 poses are in the mesh");
    }

    #[test]
    fn flat_bottom_and_deep_torus_have_their_true_depth_in_a_plane() {
        let plane = square(100.0);
        for (r, h) in [(0.0, 0.02), (0.0, 1.0), (2.0, 0.5), (2.0, 1.999), (2.0, 3.0), (8.0, 0.1)] {
            let probe = CutterDepth::new(&Cutter::new(8.0, r, 30.0).unwrap());
            let at = probe.placed(&pose([3.0, -4.0, -h], Vector3::zeros()));
            let d = probe.beyond(0.0, 0.0, &at, &mut CutterTrack::default(), &plane).unwrap();
            assert!((d.depth - h).abs() < 2.0 * RESOLUTION, "r {r} h {h}: {d:?}");
            // 1 mm that has to stay makes it 1 mm deeper.
            let d = probe.beyond(0.0, 1.0, &at, &mut CutterTrack::default(), &plane).unwrap();
            assert!(d.depth >= h + 1.0 - 1e-9 && d.depth < 1.5 * (h + 1.0), "r {r} h {h}: {d:?}");
        }
    }

    #[test]
    fn tilted_flat_cutter_is_at_least_as_deep_as_its_lowest_point_and_at_most_root_two_of_it() {
        let plane = square(100.0);
        let probe = CutterDepth::new(&Cutter::new(8.0, 0.0, 30.0).unwrap());
        for tilt in [0.05_f64, 0.3, 0.7] {
            for h in [0.05, 0.4] {
                let at = probe.placed(&pose([0.0, 0.0, 8.0 * tilt.sin() - h], Vector3::new(0.0, tilt, 0.0)));
                let d = probe.beyond(0.0, 0.0, &at, &mut CutterTrack::default(), &plane).unwrap();
                assert!(d.depth >= h - 1e-9 && d.depth <= SQRT_2 * h + RESOLUTION, "tilt {tilt} h {h}: {d:?}");
                assert_eq!(probe.beyond(SQRT_2 * h + 0.01, 0.0, &at, &mut CutterTrack::default(), &plane), None);
            }
        }
    }

    #[test]
    fn upper_rim_of_a_short_flute_is_part_of_the_cutter() {
        // The wall at x = 0 ends below: only the top corner of the flute reaches it.
        let wall = |low: f64| {
            let corner = |y, z| Point3::new(0.0, y, z);
            let v = vec![corner(-50.0, low), corner(50.0, low), corner(50.0, 40.0), corner(-50.0, 40.0)];
            MeshTree::new(&TriMesh::new(v, vec![[0, 1, 2], [0, 2, 3]]).unwrap())
        };
        let probe = CutterDepth::new(&Cutter::new(20.0, 6.0, 10.0).unwrap());
        let at = probe.placed(&pose([-19.7, 0.0, 0.0], Vector3::zeros()));
        let depth = |low| probe.beyond(0.0, 0.0, &at, &mut CutterTrack::default(), &wall(low)).unwrap().depth;
        assert!((depth(8.0) - 0.3).abs() < 2.0 * RESOLUTION, "{}", depth(8.0));
        // A tenth below the top it is nearer to the top than to the wall.
        assert!((0.1..=0.1 * SQRT_2 + RESOLUTION).contains(&depth(9.9)), "{}", depth(9.9));
        assert_eq!(probe.beyond(0.0, 0.0, &at, &mut CutterTrack::default(), &wall(10.1)), None);
    }

    #[test]
    fn cutter_wholly_inside_a_closed_part_is_deep() {
        let s = 200.0;
        let corner = |k: u32| Point3::from([0, 1, 2].map(|axis| if k >> axis & 1 == 0 { -s } else { s }));
        let sides = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let triangles = sides.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
        let cube = MeshTree::new(&TriMesh::new((0..8).map(corner).collect(), triangles).unwrap());
        let probe = CutterDepth::new(&Cutter::new(8.0, 2.0, 30.0).unwrap());
        let mut track = CutterTrack::default();
        let outside = probe.placed(&pose([0.0, 0.0, 300.0], Vector3::zeros()));
        assert_eq!(probe.beyond(0.0, 0.0, &outside, &mut track, &cube), None);
        let inside = probe.placed(&pose([0.0, 0.0, -50.0], Vector3::zeros()));
        assert!(probe.beyond(0.0, 0.0, &inside, &mut track, &cube).is_some_and(|d| d.depth >= 8.0));
        assert_eq!(probe.beyond(0.0, 0.0, &outside, &mut track, &cube), None);
    }
}
