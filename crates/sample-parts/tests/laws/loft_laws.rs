//! Laws of blades through sections of points.

use std::collections::BTreeSet;

use crate::kit;
use facemill_sample_parts::{BladeLoft, BladeSections, EdgeForm, LoftError, LoftedBlade};
use facemill_test_kit::{Random, open_edges, volume};
use nalgebra::{Point3, Vector3};

/// How a blade's trailing edge ends.
#[derive(Clone, Copy, Debug, PartialEq)]
enum BladeEnd {
    Round,
    Sharp,
    CutOff,
}

const ENDS: [BladeEnd; 3] = [BladeEnd::Round, BladeEnd::Sharp, BladeEnd::CutOff];

/// A twisted, tapered blade along +z in a random pose, leading edge at −x before it; points begin
/// at the trailing edge.
fn random_blade(random: &mut Random, end: BladeEnd, n_sections: usize) -> BladeSections {
    let half = 8 + random.below(30);
    let [chord, thickness, camber, taper] =
        [(20.0, 90.0), (0.04, 0.15), (0.0, 0.12), (0.5, 1.1)].map(|(a, b)| random.between(a, b));
    let (span, twist) = (random.between(30.0, 200.0), random.between(-0.7, 0.7));
    let motion = random.motion(300.0);
    let is_clockwise = random.one_in(2.0);
    let section = |k: usize| -> Vec<Point3<f64>> {
        let share = k as f64 / (n_sections - 1) as f64;
        let size = chord * (1.0 + share * (taper - 1.0));
        let (sin, cos) = (twist * share).sin_cos();
        // Over x from 1 at the trailing edge to 0 at the leading edge.
        let place = |x: f64, side: f64| {
            let tail = match end {
                BladeEnd::Round => (x * (1.0 - x)).sqrt(),
                BladeEnd::Sharp => x.sqrt() * (1.0 - x),
                BladeEnd::CutOff => x.sqrt() * (1.0 - 0.7 * x),
            };
            let y = camber * 4.0 * x * (1.0 - x) + side * thickness * tail;
            let (x, y) = (size * (x - 0.5), size * y);
            motion * Point3::new(x * cos - y * sin, x * sin + y * cos, span * share)
        };
        let x = |k: usize| 0.5 + 0.5 * (std::f64::consts::PI * k as f64 / half as f64).cos();
        let back = if end == BladeEnd::CutOff { half + 1 } else { half };
        let upper = (0..=half).map(|k| place(x(k), 1.0));
        let lower = (1..back).map(|k| place(x(half - k), -1.0));
        let mut points: Vec<_> = upper.chain(lower).collect();
        if is_clockwise {
            let first = usize::from(end != BladeEnd::CutOff);
            points[first..].reverse();
        }
        points
    };
    let sections = (0..n_sections).map(section).collect();
    BladeSections { sections, is_cut_off: end == BladeEnd::CutOff, ..BladeSections::default() }
}

/// The vertex nearest to a point, and its distance.
fn off_vertices(blade: &LoftedBlade, points: &[Vec<Point3<f64>>]) -> f64 {
    let nearest = |p: &Point3<f64>| blade.mesh.vertices().iter().map(|v| (v - p).norm()).fold(f64::INFINITY, f64::min);
    points.iter().flatten().map(nearest).fold(0.0, f64::max)
}

fn check_solid(blade: &LoftedBlade, what: &str) {
    let mesh = &blade.mesh;
    assert_eq!(open_edges(mesh.triangles()), 0, "{what}");
    assert!(kit::is_closed(mesh), "{what}");
    assert!(volume(mesh.vertices(), mesh.triangles()) > 0.0, "{what}: wound inward");
    let names: Vec<_> = mesh.groups().iter().map(|g| &*g.name).collect();
    assert_eq!(names, ["suction", "pressure", "leading-edge", "trailing-edge", "tip", "root"], "{what}");
    assert_eq!(blade.normals.len(), mesh.vertices().len(), "{what}");
}

#[test]
fn lofts_go_through_their_points_and_are_watertight() {
    let mut random = Random(9_120);
    let upstream = |p: &Point3<f64>| p.x;
    for round in 0..45 {
        let end = ENDS[round % 3];
        let given = random_blade(&mut random, end, 2 + round % 6);
        let loft = BladeLoft::new(&given, upstream).unwrap();
        let blade = loft.mesh(0.02).unwrap();
        let what = format!("round {round}, {end:?}");
        check_solid(&blade, &what);
        assert!(blade.chord_mm <= 0.02, "{what}");
        let off = off_vertices(&blade, &given.sections);
        assert!(off < 1e-9, "{what}: {off} mm off a point");
        assert_eq!(blade.mesh, loft.mesh(0.02).unwrap().mesh, "{what}: the same each time");
    }
}

#[test]
fn blades_do_not_cut_themselves() {
    let mut random = Random(31);
    for end in ENDS {
        let blade = BladeLoft::new(&random_blade(&mut random, end, 4), |p| p.x).unwrap().mesh(0.2).unwrap();
        assert_eq!(kit::self_intersections(&blade.mesh), [], "{end:?}");
    }
}

#[test]
fn finer_meshes_of_a_blade_are_within_the_tolerance_of_coarser_ones() {
    let mut random = Random(616);
    for end in ENDS {
        let loft = BladeLoft::new(&random_blade(&mut random, end, 5), |p| p.x).unwrap();
        let [coarse, fine] = [0.1, 0.005].map(|tolerance| loft.mesh(tolerance).unwrap());
        let triangles = kit::TriangleRuns::of(&coarse.mesh);
        let worst = fine.mesh.vertices().iter().step_by(3).map(|v| triangles.distance(v)).fold(0.0, f64::max);
        println!("{end:?}: {} and {} vertices, {worst:.4} mm", coarse.normals.len(), fine.normals.len());
        assert!(worst < 0.1 + 0.005, "{end:?}: {worst}");
    }
}

#[test]
fn normals_are_those_of_the_surface() {
    let mut random = Random(5_511);
    for end in ENDS {
        let blade = BladeLoft::new(&random_blade(&mut random, end, 5), |p| p.x).unwrap().mesh(0.002).unwrap();
        // Facets inside a side, whose three vertices are of that side alone.
        for (name, limit) in [("suction", 5.0_f64), ("pressure", 5.0)] {
            let mut worst = 0.0_f64;
            let edges: BTreeSet<u32> = ["leading-edge", "trailing-edge"]
                .into_iter()
                .flat_map(|edge| kit::group(&blade.mesh, edge))
                .flat_map(|t| blade.mesh.triangles()[t])
                .collect();
            for t in kit::group(&blade.mesh, name) {
                let corners = blade.mesh.triangles()[t];
                if corners.iter().any(|v| edges.contains(v)) {
                    continue;
                }
                let facet = blade.mesh.scaled_normal(t);
                worst = corners.iter().map(|&v| blade.normals[v as usize].angle(&facet)).fold(worst, f64::max);
            }
            println!("{end:?} {name}: {:.2}°", worst.to_degrees());
            assert!(worst.to_degrees() < limit, "{end:?} {name}: {}", worst.to_degrees());
        }
    }
}

/// At a corner each side has its normal: facets of flat ends and of the sides beside them.
#[test]
fn normals_at_corners_are_those_of_the_facets_side() {
    let mut random = Random(5_512);
    for end in [BladeEnd::Sharp, BladeEnd::CutOff] {
        let blade = BladeLoft::new(&random_blade(&mut random, end, 5), |p| p.x).unwrap().mesh(0.002).unwrap();
        assert!(blade.normals_before.is_sorted_by_key(|(vertex, _)| *vertex) && !blade.normals_before.is_empty());
        let (mut worst, mut jump) = (0.0_f64, 0.0_f64);
        for group in ["suction", "pressure", "leading-edge", "trailing-edge"] {
            for t in kit::group(&blade.mesh, group) {
                let facet = blade.mesh.scaled_normal(t);
                let of = |v: u32| blade.normal_in(t, v).angle(&facet);
                worst = blade.mesh.triangles()[t].into_iter().map(of).fold(worst, f64::max);
            }
        }
        for (vertex, before) in &blade.normals_before {
            jump = jump.max(before.angle(&blade.normals[*vertex as usize]));
        }
        println!("{end:?}: {:.2}° off facets, {:.1}° from side to side", worst.to_degrees(), jump.to_degrees());
        // The normal of the other side would be the whole corner off.
        assert!(jump.to_degrees() > 60.0, "{end:?}");
        assert!(worst.to_degrees() < 12.0, "{end:?}: {}", worst.to_degrees());
    }
}

/// Thin, symmetric, both edges ellipses with few points: at the points of both edges the polyline
/// turns by more than 60°.
fn coarse_ellipses() -> BladeSections {
    let n = 12;
    let section = |k: usize| {
        let angle = |j: usize| std::f64::consts::TAU * j as f64 / n as f64;
        (0..n).map(|j| Point3::new(50.0 * angle(j).cos(), 4.0 * angle(j).sin(), 30.0 * k as f64)).collect()
    };
    BladeSections { sections: (0..3).map(section).collect(), ..BladeSections::default() }
}

/// A rounded edge is smooth however few points it has; without its form it is a corner.
#[test]
fn edges_that_are_known_as_rounded_have_no_corners() {
    for (is_cut_off, marks) in [(false, false), (false, true), (true, false)] {
        let mut given = coarse_ellipses();
        given.is_cut_off = is_cut_off;
        if marks {
            (given.leading, given.trailing) = (Some([6; 2]), Some([0; 2]));
        }
        let sharp = BladeLoft::new(&given, |p| p.x).unwrap().mesh(0.01).unwrap();
        assert!(!sharp.normals_before.is_empty());
        given.forms = [Some(EdgeForm::Round); 2];
        let round = BladeLoft::new(&given, |p| p.x).unwrap().mesh(0.01).unwrap();
        check_solid(&round, "rounded");
        assert_eq!(round.normals_before, []);
        assert!(off_vertices(&round, &given.sections) < 1e-9);
        for x in [-50.0, 50.0] {
            let at_edge = (0..round.mesh.vertices().len()).filter(|&v| (round.mesh.vertices()[v].x - x).abs() < 1e-9);
            let tilts: Vec<f64> = at_edge.map(|v| round.normals[v].angle(&(Vector3::x() * x))).collect();
            assert!(tilts.len() >= 3 && tilts.iter().all(|tilt| *tilt < 0.02), "{x}: {tilts:?}");
        }
        // One edge alone.
        given.forms = [None, Some(EdgeForm::Round)];
        let one = BladeLoft::new(&given, |p| p.x).unwrap().mesh(0.01).unwrap();
        let at = one.normals_before.iter().map(|(v, _)| one.mesh.vertices()[*v as usize].x);
        assert!(!one.normals_before.is_empty() && at.into_iter().all(|x| x < -40.0));
    }
}

/// A flat edge is found at its corners, by a mark in it, too; where there are none it is refused.
#[test]
fn edges_that_are_known_as_flat_need_corners() {
    let mut random = Random(89);
    let given = BladeSections { forms: [None, Some(EdgeForm::Flat)], ..random_blade(&mut random, BladeEnd::CutOff, 4) };
    let trailing = given.sections[0][0];
    let downstream = |p: &Point3<f64>| -(p - trailing).norm();
    let found = BladeLoft::new(&given, downstream).unwrap().mesh(0.1).unwrap();
    for corner in [0, given.sections[0].len() - 1] {
        let marked = BladeSections { trailing: Some([corner; 2]), ..given.clone() };
        let marked = BladeLoft::new(&marked, downstream).unwrap().mesh(0.1).unwrap();
        assert_eq!(marked.mesh, found.mesh, "marked at {corner}");
    }
    let round = random_blade(&mut random, BladeEnd::Round, 4);
    let round = BladeSections { forms: [Some(EdgeForm::Flat), None], ..round };
    let why = BladeLoft::new(&round, |p| p.x).map(drop).expect_err("no corners");
    assert_eq!(why, LoftError::NoFlatEnd { edge: "leading" });
}

#[test]
fn edges_are_where_they_are_marked_or_at_the_ends_of_the_chord() {
    let mut random = Random(88);
    for end in ENDS {
        let mut given = random_blade(&mut random, end, 4);
        let n = given.sections[0].len();
        let trailing = given.sections[0][0];
        let downstream = |p: &Point3<f64>| -(p - trailing).norm();
        let found = BladeLoft::new(&given, downstream).unwrap().mesh(0.1).unwrap().mesh;
        let nearest = |name: &str| {
            let corners = kit::group(&found, name).flat_map(|t| found.corners(t));
            corners.map(|p| (p - trailing).norm()).fold(f64::INFINITY, f64::min)
        };
        assert!(nearest("trailing-edge") < 1e-9 && nearest("leading-edge") > 10.0, "{end:?}");
        // The same by marks.
        let corners = if end == BladeEnd::CutOff { [n - 1, 0] } else { [0, 0] };
        given.trailing = Some(corners);
        given.is_cut_off = false;
        let marked = BladeLoft::new(&given, |_| 0.0).unwrap().mesh(0.1).unwrap().mesh;
        assert!(marked == found, "{end:?}");
    }
}

#[test]
fn cut_off_ends_are_flat() {
    let given = random_blade(&mut Random(12), BladeEnd::CutOff, 3);
    let [first, last] = [&given.sections[0][0], &given.sections[0][given.sections[0].len() - 1]];
    let trailing = *first;
    let blade = BladeLoft::new(&given, |p| -(p - trailing).norm()).unwrap().mesh(0.01).unwrap();
    // The row of the first section: all points of the edge are on the line between its corners.
    let line = last - first;
    let on_root = |p: &Point3<f64>| (p - first).dot(&line.normalize()) >= 0.0;
    let root: BTreeSet<u32> = kit::group(&blade.mesh, "root").flat_map(|t| blade.mesh.triangles()[t]).collect();
    let edge: BTreeSet<u32> =
        kit::group(&blade.mesh, "trailing-edge").flat_map(|t| blade.mesh.triangles()[t]).collect();
    let both: Vec<_> = root.intersection(&edge).map(|&v| blade.mesh.vertices()[v as usize]).collect();
    assert!(both.len() >= 2 && both.iter().all(|p| on_root(p) || (p - first).norm() < 1e-9));
    for p in both {
        let off = (p - first).cross(&line).norm() / line.norm();
        assert!(off < 1e-9, "{off}");
    }
}

#[test]
fn sections_that_are_no_blade_are_refused() {
    let good = random_blade(&mut Random(4), BladeEnd::Round, 3);
    let n = good.sections[0].len();
    let refused = |change: &dyn Fn(&mut BladeSections)| {
        let mut given = good.clone();
        change(&mut given);
        BladeLoft::new(&given, |p| p.x).and_then(|loft| loft.mesh(0.1)).expect_err("refused")
    };
    assert!(matches!(refused(&|s| s.sections.truncate(1)), LoftError::TooFew { sections: 1, .. }));
    assert!(matches!(refused(&|s| s.sections[0].truncate(7)), LoftError::TooFew { points: 7, .. }));
    assert!(matches!(refused(&|s| s.sections[1].truncate(n - 1)), LoftError::Unequal { section: 1, .. }));
    assert!(matches!(refused(&|s| s.sections[2][3].y = f64::NAN), LoftError::NotFinite { section: 2 }));
    assert!(matches!(
        refused(&|s| s.sections[1][5] = s.sections[1][4]),
        LoftError::Coincident { section: 1, point: 4 }
    ));
    assert!(matches!(
        refused(&|s| s.sections[1][5] = s.sections[0][5]),
        LoftError::Coincident { section: 1, point: 5 }
    ));
    assert!(matches!(refused(&|s| s.leading = Some([0, n])), LoftError::WrongMarks));
    let loft = BladeLoft::new(&good, |p| p.x).unwrap();
    for tolerance in [0.0, -1.0, f64::NAN, 1e-12] {
        assert!(matches!(loft.mesh(tolerance), Err(LoftError::TooFine { .. })), "{tolerance}");
    }
}

#[test]
fn samples_become_solids_through_their_points() {
    for name in ["rotor37/BladeGen.inf", "hannover_rotor1/1_Rotor1_Blade.inf"] {
        let Some((file, given)) = kit::shared_blade(name) else { continue };
        let blade = BladeLoft::new(&given, |p| file.downstream(p)).unwrap().mesh(0.01).unwrap();
        check_solid(&blade, name);
        let (off, mesh) = (off_vertices(&blade, &given.sections), &blade.mesh);
        let of = |group: &str| kit::group(mesh, group).map(|t| mesh.scaled_normal(t)).sum::<Vector3<f64>>() * 0.5;
        println!(
            "{name}: {} triangles, {:.1} mm³, chord {:.4} mm, {off:.1e} mm off its points; suction {:.0?} mm²",
            mesh.triangles().len(),
            volume(mesh.vertices(), mesh.triangles()),
            blade.chord_mm,
            of("suction").as_slice(),
        );
        assert!(off < 1e-6 && blade.chord_mm <= 0.01, "{name}: {off} mm");
        // The flow comes along +z: the leading edge is before, and faces it.
        assert!(of("leading-edge").z < 0.0 && of("trailing-edge").z > 0.0, "{name}");
    }
}
