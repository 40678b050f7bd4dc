//! Blades of random tables: they pass through their points, are watertight, and mirror.

use std::collections::HashMap;

use facemill_sample_parts::{BladeResolution, BladeSide, BladeSurface, blade, chord_error, hub};
use facemill_surface_model::TriMesh;
use facemill_test_kit::Random;
use nalgebra::Point3;

use crate::kit::{DTMB_4382, HEADER, placed, radial_csv, random_rows, read, refused};

/// Places where NACA 66 (modified) and a = 0.8 are tabulated: x/c, full thickness over the largest,
/// ordinate of the mean line over the largest.
const STATIONS: [[f64; 3]; 5] = [
    [0.0125, 0.2088, 0.00616 / 0.0679],
    [0.1, 0.5814, 0.03043 / 0.0679],
    [0.45, 1.0, 0.06709 / 0.0679],
    [0.7, 0.807, 0.06037 / 0.0679],
    [0.9, 0.3754, 0.02435 / 0.0679],
];

#[test]
fn blades_pass_through_the_points_of_their_tables() {
    let mut random = Random(41);
    for round in 0..20 {
        let rows = random_rows(&mut random, 0.2, 5 + round % 9);
        let text = format!("{HEADER}# section: naca66_a08\n{}", radial_csv(&rows));
        let spec = read(&text).unwrap().spec(None).unwrap();
        let surface = BladeSurface::new(&spec);
        // The tip is rounded over half its thickness.
        for row in &rows[..rows.len() - 1] {
            let section = surface.section(500.0 * row[0]);
            for [x, thickness, mean] in STATIONS {
                for (side, sign) in [(BladeSide::Suction, 0.5), (BladeSide::Pressure, -0.5)] {
                    let n = 1000.0 * row[1] * (row[4] * mean + sign * row[3] * thickness);
                    let apart = (section.point(side, x) - placed(1000.0, *row, x, n)).norm();
                    assert!(apart < 1e-6, "r/R {}, x/c {x}: {apart} mm", row[0]);
                }
            }
        }
    }
}

/// How often each directed edge is there less its reverse.
fn unbalanced_edges(mesh: &TriMesh) -> usize {
    let mut count: HashMap<[u32; 2], i32> = HashMap::new();
    for [a, b, c] in mesh.triangles() {
        for [from, to] in [[a, b], [b, c], [c, a]] {
            *count.entry([*from.min(to), *from.max(to)]).or_default() += if from < to { 1 } else { -1 };
        }
    }
    count.values().filter(|n| **n != 0).count()
}

fn volume(mesh: &TriMesh) -> f64 {
    let corners = mesh.triangles().iter().map(|t| t.map(|v| mesh.vertices()[v as usize].coords));
    corners.map(|[a, b, c]| a.dot(&b.cross(&c)) / 6.0).sum()
}

#[test]
fn meshes_of_random_tables_are_closed_and_have_all_groups() {
    let mut random = Random(42);
    for round in 0..8 {
        let rows = random_rows(&mut random, 0.25, 6);
        let hand = if round % 2 == 0 { "right" } else { "left" };
        let header = HEADER.replace("0.2\n", "0.25\n").replace("right", hand);
        let spec = read(&format!("{header}# section: naca66_a08\n{}", radial_csv(&rows))).unwrap().spec(None).unwrap();
        let mesh = blade(&spec, BladeResolution::new(12, 12).unwrap());
        assert_eq!(unbalanced_edges(&mesh), 0);
        assert!(volume(&mesh) > 0.0);
        let names: Vec<&str> = mesh.groups().iter().map(|g| g.name.as_str()).collect();
        assert_eq!(names, ["suction", "pressure", "edge", "tip", "root"]);
    }
}

/// The facets are as near to the surface as `chord_error` says, by points that it does not take.
#[test]
fn facets_are_within_the_chord_error() {
    let spec = read(DTMB_4382).unwrap().spec(Some(1000.0)).unwrap();
    let resolution = BladeResolution::new(24, 24).unwrap();
    let mesh = blade(&spec, resolution);
    let error = chord_error(&spec, resolution).sides;
    let suction = mesh.groups().iter().find(|g| g.name == "suction").unwrap().triangles.clone();
    let surface = BladeSurface::new(&spec);
    let mut random = Random(43);
    let mut largest: f64 = 0.0;
    for _ in 0..300 {
        let section = surface.section(500.0 * random.between(0.3, 0.97));
        let point = section.point(BladeSide::Suction, random.between(0.06, 0.94));
        let near = suction.clone().map(|t| distance(&point, &mesh.triangles()[t].map(|v| mesh.vertices()[v as usize])));
        largest = largest.max(near.fold(f64::INFINITY, f64::min));
    }
    assert!(largest < 1.2 * error && largest > 0.2 * error, "{largest} against {error}");
}

/// Distance of a point from a triangle by its definition: over the plane, or from an edge.
fn distance(p: &Point3<f64>, [a, b, c]: &[Point3<f64>; 3]) -> f64 {
    let normal = (b - a).cross(&(c - a)).normalize();
    let foot = p - normal * normal.dot(&(p - a));
    let inside = [[a, b], [b, c], [c, a]].iter().all(|[q, r]| (*r - *q).cross(&(foot - *q)).dot(&normal) >= 0.0);
    if inside {
        return (p - foot).norm();
    }
    let edge = |q: &Point3<f64>, r: &Point3<f64>| {
        let along = r - q;
        (p - (q + along * (along.dot(&(p - q)) / along.norm_squared()).clamp(0.0, 1.0))).norm()
    };
    edge(a, b).min(edge(b, c)).min(edge(c, a))
}

#[test]
fn a_left_handed_propeller_is_the_mirror_image() {
    let right = read(DTMB_4382).unwrap().spec(None).unwrap();
    let left = read(&DTMB_4382.replace("hand: right", "hand: left")).unwrap().spec(None).unwrap();
    let resolution = BladeResolution::new(16, 16).unwrap();
    let [of_right, of_left] = [&right, &left].map(|spec| blade(spec, resolution));
    let mirrored: Vec<Point3<f64>> = of_right.vertices().iter().map(|p| Point3::new(p.x, -p.y, p.z)).collect();
    assert_eq!(of_left.vertices(), mirrored);
    let turned: Vec<[u32; 3]> = of_right.triangles().iter().map(|[a, b, c]| [*a, *c, *b]).collect();
    assert_eq!(of_left.triangles(), turned);
    assert_eq!(of_left.groups(), of_right.groups());
    assert!((volume(&of_left) - volume(&of_right)).abs() < 1e-9 * volume(&of_right) && volume(&of_left) > 0.0);
}

#[test]
fn a_hub_is_as_long_as_its_table_says() {
    let rows = random_rows(&mut Random(44), 0.2, 6);
    let text = |length: &str| format!("{HEADER}{length}# section: naca66_a08\n{}", radial_csv(&rows));
    let ends = |text: &str| {
        let mesh = hub(&read(text).unwrap().spec(None).unwrap(), 0.1).unwrap();
        assert_eq!(unbalanced_edges(&mesh), 0);
        let z = mesh.vertices().iter().map(|p| p.z);
        [z.clone().fold(f64::INFINITY, f64::min), z.fold(f64::NEG_INFINITY, f64::max)]
    };
    let [low, high] = ends(&text("# hub_length_mm: 400\n"));
    assert!((high - low - 400.0).abs() < 1e-9);
    let [free_low, free_high] = ends(&text(""));
    assert!((low + high - free_low - free_high).abs() < 1e-9, "both have the middle of the roots as their middle");
    let short = read(&text("# hub_length_mm: 30\n")).unwrap().spec(None).unwrap_err().to_string();
    assert!(short.contains("hub length is 30"), "{short}");
}

/// The blade begins 0.15 hub radii inside the hub, where the rows go on along straight lines: rows
/// that fall steeply to the hub have no thickness or chord there, and a row below the hub helps.
#[test]
fn blades_without_a_root_inside_the_hub_are_refused() {
    let header = HEADER.replace("0.2\n", "0.5\n");
    let head = format!("{header}# section: naca66_a08\nr_R,c_D,P_D,t_D,f_c\n");
    let rows = |chord: [f64; 2], thickness: [f64; 2], pitch: [f64; 2]| {
        let row = |share: f64| {
            let between = |[hub, tip]: [f64; 2]| hub + (tip - hub) * share;
            format!("{},{},{},{},0.02\n", 0.5 + 0.5 * share, between(chord), between(pitch), between(thickness))
        };
        [0.0, 0.25, 0.5, 0.75, 1.0].map(row).concat()
    };
    let good = rows([0.3, 0.2], [0.02, 0.01], [1.0, 1.0]);
    read(&format!("{head}{good}")).unwrap().spec(None).unwrap();
    // From the hub to 0.85 hub radii all fall by 0.15 of what they grow from the hub to the tip.
    for (text, below) in [
        (rows([0.3, 0.2], [0.002, 0.02], [1.0, 1.0]), "0.42,0.3,1,0.002,0.02\n"),
        (rows([0.3, 0.2], [0.02, 0.01], [0.1, 1.0]), "0.42,0.3,0.1,0.02,0.02\n"),
        (rows([0.02, 0.3], [0.02, 0.01], [1.0, 1.0]), "0.42,0.02,1,0.02,0.02\n"),
    ] {
        let why = refused(&format!("{head}{text}"));
        assert!(why.starts_with("own.csv: at r/R 0.425") && why.contains("add a row below the hub"), "{why}");
        read(&format!("{head}{below}{text}")).unwrap().spec(None).unwrap();
    }
}
