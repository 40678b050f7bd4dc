//! Cusps between fronts of constant scallop on plain shapes, by closed forms of the shape and of
//! the ball: the widths are those that jobs take, from curvatures of the mesh.

use facemill::cc_path::strategies::{ConstantScallop, Region, Seed};
use facemill::cc_path::{LaidPass, LaySettings, Strategy, lay_passes};
use facemill::cl_data::{CcPoint, Posture, Silent};
use facemill::cutter_location::cusp::cut_point::feed_curvature;
use facemill::cutter_location::cusp::strips::strip_width;
use facemill::surface_model::{Surface, SurfaceSettings, TriMesh};
use facemill::tool_model::Cutter;
use facemill_test_kit::grid_by_rows;
use nalgebra::{Point2, Point3, Unit, Vector2, Vector3};

const BALL: f64 = 6.0;
const CUSP: f64 = 0.05;
const WIDEST: f64 = 8.0;

/// A shape that a profile sweeps: along a line, or around the z axis.
struct Shape {
    name: &'static str,
    /// Profile over its length, mm: distance from the axis, or place across the sweep, and height.
    profile: fn(f64) -> Point2<f64>,
    /// Length of the profile, mm.
    length: f64,
    /// Length of the sweep along x, mm; `None` around z.
    along: Option<f64>,
}

/// Turn of shapes around z, rad.
const TURN: f64 = 2.0;

impl Shape {
    fn at(&self, s: f64, u: f64) -> Point3<f64> {
        let p = (self.profile)(s);
        match self.along {
            Some(length) => Point3::new(length * u, p.x, p.y),
            None => Point3::new(p.x * (TURN * u).cos(), p.x * (TURN * u).sin(), p.y),
        }
    }

    /// Share of the sweep and place in the plane of the profile.
    fn seen(&self, p: &Point3<f64>) -> (f64, Point2<f64>) {
        match self.along {
            Some(length) => (p.x / length, Point2::new(p.y, p.z)),
            None => (p.y.atan2(p.x) / TURN, Point2::new(p.x.hypot(p.y), p.z)),
        }
    }

    /// Normal of the profile that faces the tool: to the left of its direction.
    fn normal(&self, s: f64) -> Vector2<f64> {
        let d = (self.profile)(s + 1e-5) - (self.profile)(s - 1e-5);
        let left = Vector2::new(-d.y, d.x).normalize();
        if self.along.is_some() { left } else { -left }
    }

    /// Place along the profile nearest to a point, and the distance.
    fn nearest(&self, p: &Point2<f64>) -> (f64, f64) {
        let n = 4000;
        let at = |k: usize| self.length * k as f64 / n as f64;
        let off = |s: f64| ((self.profile)(s) - p).norm();
        let k = (0..=n).min_by(|a, b| off(at(*a)).total_cmp(&off(at(*b)))).unwrap();
        let [mut low, mut high] = [at(k.saturating_sub(1)), at((k + 1).min(n))];
        for _ in 0..60 {
            let [a, b] = [low + (high - low) / 3.0, high - (high - low) / 3.0];
            if off(a) < off(b) { high = b } else { low = a }
        }
        let s = 0.5 * (low + high);
        (s, off(s))
    }

    /// Place along the profile at which a pass crosses a plane of the sweep.
    fn crossing(&self, pass: &LaidPass, u: f64) -> Option<f64> {
        let seen: Vec<_> = pass.pass.points.iter().map(|cc| self.seen(&cc.position)).collect();
        seen.windows(2).find(|w| (w[0].0 - u) * (w[1].0 - u) <= 0.0 && w[0].0 != w[1].0).map(|w| {
            let t = (u - w[0].0) / (w[1].0 - w[0].0);
            let [a, b] = [self.nearest(&w[0].1).0, self.nearest(&w[1].1).0];
            a + t * (b - a)
        })
    }

    /// Height of the ridge between two balls that touch the profile at two places.
    fn ridge(&self, s: [f64; 2]) -> f64 {
        let [a, b] = s.map(|s| (self.profile)(s) + self.normal(s) * BALL);
        let half = 0.5 * (b - a);
        let down = (BALL * BALL - half.norm_squared()).sqrt();
        let toward = -(self.normal(s[0]) + self.normal(s[1])).normalize();
        let across = Vector2::new(-half.y, half.x).normalize();
        let across = across * across.dot(&toward).signum();
        self.nearest(&(a + half + across * down)).1
    }
}

#[test]
fn fronts_leave_the_cusp_within_one_percent_on_plain_shapes() {
    let shapes = [
        Shape { name: "plane", profile: |s| Point2::new(s, 0.0), length: 60.0, along: Some(50.0) },
        Shape {
            name: "ramp of 30°",
            profile: |s| Point2::new(s * 0.75f64.sqrt(), 0.5 * s),
            length: 60.0,
            along: Some(50.0),
        },
        Shape {
            name: "ramp of 45°",
            profile: |s| Point2::new(s * 0.5f64.sqrt(), s * 0.5f64.sqrt()),
            length: 60.0,
            along: Some(50.0),
        },
        Shape {
            name: "cylinder along its rulings",
            profile: |s| Point2::new(40.0 * (s / 40.0 - 0.7).sin(), 40.0 * (s / 40.0 - 0.7).cos()),
            length: 56.0,
            along: Some(50.0),
        },
        Shape { name: "cylinder around", profile: |s| Point2::new(40.0, s), length: 60.0, along: None },
        Shape { name: "cone", profile: |s| Point2::new(60.0 - 0.6 * s, 0.8 * s), length: 60.0, along: None },
        Shape {
            name: "sphere",
            profile: |s| Point2::new(60.0 * (0.2 + s / 60.0).cos(), 60.0 * (0.2 + s / 60.0).sin()),
            length: 60.0,
            along: None,
        },
        Shape {
            name: "torus",
            profile: |s| Point2::new(80.0 + 30.0 * (s / 30.0 - 1.0).cos(), 30.0 * (s / 30.0 - 1.0).sin()),
            length: 60.0,
            along: None,
        },
    ];
    let ball = Cutter::new(BALL, BALL, 30.0).unwrap();
    for shape in shapes {
        let (rows, columns) = (120, 60);
        let place =
            |i: u32, j: u32| shape.at(shape.length * f64::from(i) / f64::from(rows), f64::from(j) / f64::from(columns));
        let (vertices, mut triangles) = grid_by_rows([rows, columns], place);
        let mut mesh = TriMesh::new(vertices.clone(), triangles.clone()).unwrap();
        // The side of the tool: that of the profile's normal.
        let [a, b, c] = mesh.corners(0);
        let (s, n) = (shape.nearest(&shape.seen(&a).1).0, (b - a).cross(&(c - a)));
        let [at, off] = [shape.seen(&a).1, shape.seen(&(a + n.normalize() * 0.01)).1];
        if (off - at).dot(&shape.normal(s)) < 0.0 {
            triangles.iter_mut().for_each(|t| t.swap(1, 2));
            mesh = TriMesh::new(vertices, triangles).unwrap();
        }
        let surface = Surface::new(mesh, SurfaceSettings::default());
        // What jobs take: the widest strip of the posture on the mesh's curvature.
        let width = |cc: &CcPoint| {
            let foot = surface.closest_point(&cc.position, 1.0).unwrap();
            let curvature = feed_curvature(surface.curvature_at(&foot).as_ref(), cc);
            strip_width(&ball, Posture::default(), &curvature, CUSP, WIDEST)
        };
        let start = shape.at(1e-6, 0.5);
        let way = shape.at(1e-3, 0.5) - shape.at(0.0, 0.5);
        let normal = if shape.along.is_some() { way } else { Vector3::z() };
        let seed = Seed::Plane { origin: start, normal: Unit::new_normalize(normal) };
        let strategy = Strategy::ConstantScallop(ConstantScallop { seeds: vec![seed], within: None });
        let settings =
            LaySettings { max_step_over: WIDEST, chord_tolerance: 0.001, max_step: 1.0, ..LaySettings::default() };
        let laid = lay_passes(&surface, &Region::default(), &strategy, &settings, &width, &Silent).unwrap();
        let mut n = 0;
        for k in 1..20 {
            let u = f64::from(k) / 20.0;
            let mut at: Vec<f64> = laid.passes.iter().filter_map(|pass| shape.crossing(pass, u)).collect();
            at.sort_by(f64::total_cmp);
            // The last pass lies nearer: a part of a strip before the border.
            for pair in at[..at.len() - 1].windows(2) {
                let left = shape.ridge([pair[0], pair[1]]);
                assert!((left / CUSP - 1.0).abs() < 0.01, "{}, {u}: {left} between {pair:?}", shape.name);
                n += 1;
            }
        }
        assert!(n > 19 * 10, "{}: {n} ridges", shape.name);
    }
}
