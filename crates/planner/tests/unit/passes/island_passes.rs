use facemill_surface_model::{SurfaceSettings, TriMesh};
use facemill_test_kit::{Random, grid_by_rows};

use super::*;

fn place(position: Point3<f64>, normal: Vector3<f64>, height: f64) -> HighPlace {
    HighPlace { position, normal: Unit::new_normalize(normal), height, round: 1 }
}

/// Places on a plane, thrown on ellipses.
fn thrown(rng: &mut Random, n: usize) -> Vec<HighPlace> {
    let at = |rng: &mut Random| Point3::new(rng.between(-30.0, 30.0), rng.between(-8.0, 8.0), 0.0);
    (0..n).map(|_| place(at(rng), Vector3::z(), rng.between(0.1, 0.3))).collect()
}

/// Every place is in one island; islands are farther apart than the reach, and none falls into two.
#[test]
fn islands_are_the_groups_that_steps_of_the_reach_connect() {
    let mut rng = Random(11);
    for n in [1, 7, 60, 200] {
        let places = thrown(&mut rng, n);
        for reach in [0.5, 2.0, 5.0] {
            let found = islands(&places, reach);
            assert_eq!(found.iter().map(Vec::len).sum::<usize>(), n);
            let near = |a: &HighPlace, b: &HighPlace| (a.position - b.position).norm() <= reach;
            for (k, island) in found.iter().enumerate() {
                let others = found[k + 1..].iter().flatten();
                assert!(others.clone().all(|other| island.iter().all(|own| !near(own, other))));
                // Steps from its first place reach all others.
                let mut reached = vec![island[0]];
                let mut rest: Vec<HighPlace> = island[1..].to_vec();
                while let Some(k) = rest.iter().position(|p| reached.iter().any(|r| near(r, p))) {
                    reached.push(rest.swap_remove(k));
                }
                assert!(rest.is_empty(), "{reach}: {} of {} not reached", rest.len(), island.len());
            }
            let highest = found.iter().map(|i| i.iter().map(|p| p.height).fold(0.0, f64::max));
            assert!(highest.is_sorted_by(|a, b| a >= b));
        }
    }
    let walls = [Vector3::z(), -Vector3::z()].map(|normal| place(Point3::origin(), normal, 0.2));
    assert_eq!(islands(&walls, 1.0).len(), 2, "both sides of a thin wall");
}

#[test]
fn every_place_of_an_island_is_within_half_a_strip_of_a_line_over_it() {
    let mut rng = Random(12);
    for _ in 0..50 {
        let island = thrown(&mut rng, 40);
        let middle = Vector3::new(rng.between(-3.0, 3.0), rng.between(-3.0, 3.0), 0.0);
        let ways = ways_over(&island, &middle, &Vector3::z_axis(), &Vector3::x_axis());
        assert!((2..=4).contains(&ways.len()) && ways.iter().all(|w| w.x >= 0.0 && w.z.abs() < 1e-12), "{ways:?}");
        for along in ways {
            let frame = IslandFrame { middle: middle.into(), normal: Vector3::z_axis(), along };
            for (wide, least_length) in [(20.0, 10.0), (30.0, 90.0)] {
                let lines = frame.lines(&island, wide, least_length);
                assert!(lines.reach[1] - lines.reach[0] >= least_length - 1e-9);
                for p in &island {
                    let way = p.position - frame.middle;
                    let (ahead, aside) = (way.dot(&along), way.dot(&frame.across()));
                    assert!(lines.asides.iter().any(|line| (aside - line).abs() <= 0.5 * wide + 1e-9), "{aside}");
                    assert!(ahead >= lines.reach[0] + 0.5 * wide - 1e-9 && ahead <= lines.reach[1] - 0.5 * wide + 1e-9);
                }
            }
        }
    }
}

/// The region ahead of a border at x = 12.
struct Before12;

impl CutRegion for Before12 {
    fn holds(&self, _: u32, point: &Point3<f64>) -> bool {
        point.x <= 12.0
    }

    fn half_strip(&self) -> f64 {
        5.0
    }
}

/// On a cylinder of 40 mm about y, in planes aslant of it.
#[test]
fn a_pass_lies_on_the_surface_in_its_plane_up_to_the_border_of_the_region() {
    let radius = 40.0;
    let at = |i: u32, j: u32| {
        let (angle, y) = (f64::from(i) / 200.0 - 0.5, f64::from(j) - 30.0);
        Point3::new(radius * angle.sin(), y, radius * (angle.cos() - 1.0))
    };
    let (vertices, triangles) = grid_by_rows([200, 60], at);
    let surface = Surface::new(TriMesh::new(vertices, triangles).unwrap(), SurfaceSettings::default());
    let settings = IslandSettings { region: &Before12, step: 1.5, most_step_over: 10.0 };
    for (degrees, allowance) in [(0.0_f64, 0.0), (25.0, 0.5), (-40.0, 0.2)] {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let (along, across) = (Vector3::new(cos, sin, 0.0), Vector3::new(-sin, cos, 0.0));
        let plane = Plane { through: Point3::new(0.0, 1.0, allowance), across };
        let walk = Walk { surface: &surface, allowance, plane, settings: &settings };
        let start = walk.start(&[]).unwrap();
        let mut last = start.0;
        let walked = walk.walked(start, along, 30.0);
        for (on, normal) in &walked {
            let distance = Vector3::new(on.x, 0.0, on.z + radius).norm();
            assert!((distance - radius - allowance).abs() < 0.01, "{degrees}: {distance}");
            assert!((on - start.0).dot(&across).abs() < 2.0 * IN_PLANE);
            assert!((on - last).norm() <= 1.6 && (on - last).dot(&along) > 0.0);
            assert!(normal.dot(&Vector3::new(on.x, 0.0, on.z + radius).normalize()) > 0.999);
            last = *on;
        }
        assert!(last.x <= 12.0 && last.x > 12.0 - 0.2, "{degrees}: {last}");
        // The middle of an island beside a border may be off the region.
        let beyond = Walk { plane: Plane { through: Point3::new(14.0, 1.0, 0.0), across }, ..walk };
        assert!(beyond.start(&[]).is_none());
        let on_it = place(Point3::new(8.0, 2.0, 0.0), Vector3::z(), 0.2);
        let inside = beyond.start(&[on_it]).unwrap().0;
        assert!(inside.x <= 12.0 && (inside - beyond.plane.through).dot(&across).abs() <= IN_PLANE, "{inside}");
        let short = walk.walked(start, along, 5.0);
        let length: f64 = short.windows(2).map(|w| (w[1].0 - w[0].0).norm()).sum();
        assert!(length < 5.0, "{length}");
    }
}
