//! Laws of blades and hubs of all series.

use std::f64::consts::{PI, TAU};

use crate::kit;
use crate::kit::Cut;
use facemill_sample_parts::blade;
use facemill_sample_parts::chord_error;
use facemill_sample_parts::hub;
use facemill_sample_parts::{
    BladeResolution, BladeSide, BladeSurface, Hand, PropellerSeries, PropellerSpec, PropellerTable, SpecError,
    TableSections, TableThickness, blade_pose,
};
use nalgebra::Vector3;

const SERIES: [PropellerSeries; 9] = [
    PropellerSeries::Dtmb4119,
    PropellerSeries::Dtmb4382,
    PropellerSeries::Vp1304,
    PropellerSeries::WageningenB { n_blades: 2, area_ratio: 0.3, pitch_ratio: 0.5 },
    PropellerSeries::WageningenB { n_blades: 3, area_ratio: 0.8, pitch_ratio: 1.0 },
    PropellerSeries::WageningenB { n_blades: 4, area_ratio: 0.55, pitch_ratio: 0.9 },
    PropellerSeries::WageningenB { n_blades: 5, area_ratio: 1.05, pitch_ratio: 1.4 },
    PropellerSeries::WageningenB { n_blades: 6, area_ratio: 0.3, pitch_ratio: 1.4 },
    PropellerSeries::WageningenB { n_blades: 7, area_ratio: 0.85, pitch_ratio: 0.7 },
];

fn propeller(series: PropellerSeries, diameter: f64) -> PropellerSpec {
    PropellerSpec::new(series, diameter).expect("in range")
}

fn resolution(n_radial: usize, n_chord: usize) -> BladeResolution {
    BladeResolution::new(n_radial, n_chord).expect("in range")
}

#[test]
fn blades_and_hubs_are_closed_and_wound_outward() {
    for series in SERIES {
        for diameter in [250.0, 3048.0] {
            let spec = propeller(series, diameter);
            let hub = hub(&spec, 1e-3 * spec.hub_radius()).expect("in range");
            for mesh in [blade(&spec, resolution(16, 24)), blade(&spec, resolution(9, 8)), hub] {
                assert!(kit::is_closed(&mesh), "{series:?}");
                assert!(kit::volume(&mesh) > 0.0, "{series:?}");
            }
        }
    }
}

/// In a corner of the tip both sides share three vertices of a quad: with a diagonal between two of
/// them, both had the same triangle.
#[test]
fn corners_of_tips_are_no_triangle_of_both_sides() {
    let table = PropellerTable {
        n_blades: 5,
        hand: Hand::Right,
        hub_ratio: 0.12,
        hub_length_ratio: None,
        radii: vec![0.12, 0.296, 0.472, 0.648, 0.824, 1.0],
        chord: vec![0.088, 0.094, 0.093, 0.083, 0.065, 0.039],
        pitch: vec![0.66, 1.33, 1.48, 1.88, 1.09, 0.49],
        skew: vec![0.0, 0.17, 0.33, 0.5, 0.67, 0.83],
        rake: vec![-0.022, -0.055, -0.088, -0.121, -0.154, -0.187],
        sections: TableSections::Naca66A08 {
            thickness: TableThickness::OfChord(vec![0.135, 0.111, 0.086, 0.062, 0.038, 0.0138]),
            camber: vec![-0.033; 6],
        },
    };
    let spec = PropellerSpec::from_table(table, 1000.0).expect("a propeller");
    for n in 8..40 {
        assert!(kit::is_closed(&blade(&spec, resolution(n, 8))), "{n}");
    }
}

#[test]
fn no_blade_cuts_through_itself() {
    for series in SERIES {
        for resolution in [resolution(12, 16), resolution(40, 40)] {
            let mesh = blade(&propeller(series, 1000.0), resolution);
            assert_eq!(kit::self_intersections(&mesh), [], "{series:?}");
        }
    }
}

#[test]
fn no_triangle_is_degenerate_at_any_usual_resolution() {
    for series in SERIES {
        for (resolution, least) in [(resolution(30, 40), 1e-4), (BladeResolution::default(), 1e-4)] {
            let mesh = blade(&propeller(series, 1000.0), resolution);
            for t in 0..mesh.triangles().len() {
                let [a, b, c] = mesh.corners(t);
                let longest = (b - a).norm().max((c - b).norm()).max((a - c).norm());
                let height = mesh.scaled_normal(t).norm() / longest;
                assert!(height > least * longest, "{series:?}: triangle {t} is {height} high on {longest}");
            }
        }
    }
}

/// Sides have no kinks: bends between facets shrink with the spacing. A kink would stay.
#[test]
fn sides_are_smooth() {
    for series in SERIES {
        let bend = |n: usize| {
            let mesh = blade(&propeller(series, 1000.0), resolution(n, 3 * n / 2));
            let side = |name| kit::largest_bend(&mesh, kit::group(&mesh, name));
            side("suction").max(side("pressure"))
        };
        let bends = [40, 80, 160].map(bend);
        println!("{series:?}: largest bends {:?}", bends.map(f64::to_degrees));
        assert!(bends[2] < 0.62 * bends[1] && bends[1] < 0.75 * bends[0], "{series:?}: {bends:?}");
    }
}

#[test]
fn facets_are_as_near_as_requested() {
    for series in SERIES {
        let spec = propeller(series, 500.0);
        let requested = BladeResolution::for_chord_tolerance(&spec, 0.05).expect("can be met");
        let found = chord_error(&spec, requested).sides;
        assert!(found <= 0.05 && found > 0.01, "{series:?}: {found}");
    }
    let spec = propeller(PropellerSeries::Dtmb4119, 3048.0);
    let found = chord_error(&spec, BladeResolution::default());
    println!("DTMB 4119 of 3048 mm at the default resolution: {found:?}");
    assert!(found.sides < 0.08 && found.edges < 0.15 && found.tip < 0.03, "{found:?}");
}

/// The estimate against points of the smooth surface taken elsewhere, and all triangles.
#[test]
fn the_chord_error_covers_points_between_those_it_looks_at() {
    let spec = propeller(PropellerSeries::Vp1304, 250.0);
    let resolution = resolution(20, 30);
    let (mesh, surface) = (blade(&spec, resolution), BladeSurface::new(&spec));
    let estimate = chord_error(&spec, resolution).sides;
    let mut random = facemill_test_kit::Random(12_345);
    let mut uniform = || random.unit();
    let triangles = kit::TriangleRuns::of(&mesh);
    let mut worst: f64 = 0.0;
    for _ in 0..400 {
        let section = surface.section(spec.hub_radius() + (0.97 * 125.0 - spec.hub_radius()) * uniform());
        let side = if uniform() < 0.5 { BladeSide::Suction } else { BladeSide::Pressure };
        let point = section.point(side, 0.02 + 0.96 * uniform());
        worst = worst.max(triangles.distance(&point));
    }
    assert!(worst < 1.05 * estimate && worst > 0.3 * estimate, "{worst} against {estimate}");
}

#[test]
fn vertices_lie_on_the_smooth_blade() {
    let spec = propeller(PropellerSeries::Dtmb4382, 600.0);
    let (mesh, surface) = (blade(&spec, resolution(20, 30)), BladeSurface::new(&spec));
    for &v in mesh.triangles()[kit::group(&mesh, "suction")].iter().flatten() {
        let vertex = mesh.vertices()[v as usize];
        let section = surface.section(vertex.x.hypot(vertex.y));
        let distance = |x: f64| (section.point(BladeSide::Suction, x) - vertex).norm();
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..100 {
            let (a, b) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
            if distance(a) < distance(b) { high = b } else { low = a }
        }
        assert!(distance(0.5 * (low + high)) < 1e-5, "vertex {v}");
    }
}

/// Driving ahead is +Z: the leading edge is ahead of the trailing edge in z and in the sense of the
/// turn about +Z, the suction side faces +Z and the turn moves the pressure side against the water
/// behind it.
#[test]
fn propellers_are_right_handed_with_the_suction_side_up() {
    for series in SERIES {
        let spec = propeller(series, 1000.0);
        let mesh = blade(&spec, resolution(30, 40));
        let surface = BladeSurface::new(&spec);
        for ratio in [0.3, 0.6, 0.9] {
            let section = surface.section(500.0 * ratio);
            let [leading, trailing] =
                [0.0, 1.0].map(|x| kit::unrolled(&section.point(BladeSide::Suction, x), section.radius()));
            assert!(leading.x > trailing.x && leading.y > trailing.y, "{series:?}");
        }
        let summed = |name| -> Vector3<f64> { kit::group(&mesh, name).map(|t| mesh.scaled_normal(t)).sum() };
        assert!(summed("suction").z > 0.0 && summed("pressure").z < 0.0, "{series:?}");
        let turn_of_pressure_side: f64 = kit::group(&mesh, "pressure")
            .map(|t| Vector3::z().cross(&mesh.corners(t)[0].coords).dot(&mesh.scaled_normal(t)))
            .sum();
        assert!(turn_of_pressure_side > 0.0, "{series:?}");
    }
}

#[test]
fn the_generator_line_is_along_x() {
    // Without skew the middle of the chord is on the generator line, without rake that is in z = 0.
    let section_of = |spec: PropellerSpec, r: f64| {
        let mesh = blade(&spec, resolution(80, 80));
        let [leading, trailing] = Cut::new(&mesh, r, pitch_4119(r / 500.0) * 1000.0).ends();
        nalgebra::center(&leading, &trailing)
    };
    for ratio in [0.3, 0.5, 0.7] {
        let middle = section_of(propeller(PropellerSeries::Dtmb4119, 1000.0), 500.0 * ratio);
        assert!(middle.x.abs() < 0.05 && middle.y.abs() < 0.05, "{middle}");
    }
}

/// Rows of the DTMB 4119 table that the tests retype.
fn pitch_4119(ratio: f64) -> f64 {
    [(0.3, 1.102), (0.5, 1.093), (0.7, 1.084)].iter().find(|row| row.0 == ratio).expect("a table radius").1
}

/// Chord, pitch, skew, rake and thickness measured on the mesh by cutting it with cylinders,
/// against rows of the tables: `[r/R, c/D, P/D, skew in degrees, rake/D, t/c, f/c]`.
#[test]
fn tables_are_measured_back_from_the_mesh() {
    let rows_4119 = [
        [0.3, 0.3625, 1.102, 0.0, 0.0, 0.1553, 0.02318],
        [0.5, 0.4392, 1.093, 0.0, 0.0, 0.09016, 0.02182],
        [0.7, 0.4622, 1.084, 0.0, 0.0, 0.05418, 0.02003],
        [0.9, 0.3613, 1.079, 0.0, 0.0, 0.03321, 0.01817],
        [0.95, 0.2775, 1.077, 0.0, 0.0, 0.03228, 0.01631],
    ];
    let rows_4382 = [
        [0.3, 0.229, 1.433, 4.655, 0.0, 0.1562, 0.037],
        [0.5, 0.312, 1.361, 13.948, 0.0, 0.0768, 0.0305],
        [0.7, 0.347, 1.2, 22.747, 0.0, 0.0421, 0.0199],
        [0.9, 0.28, 1.027, 31.575, 0.0, 0.0239, 0.0134],
        [0.95, 0.21, 0.985, 33.788, 0.0, 0.0229, 0.014],
    ];
    let rows_vp1304 = [
        [0.35, 0.225, 1.455, -1.1844, -0.002, 0.21422, 0.02],
        [0.5, 0.325, 1.578, -7.4375, -0.0134, 0.10015, 0.02899],
        [0.7, 0.41667, 1.635, -5.0358, -0.03, 0.04248, 0.0297],
        [0.9, 0.41667, 1.531, 4.1427, -0.0218, 0.0228, 0.02565],
        [0.95, 0.37667, 1.458, 7.695, -0.01613, 0.02137, 0.0233],
    ];
    for (series, rows) in [
        (PropellerSeries::Dtmb4119, rows_4119),
        (PropellerSeries::Dtmb4382, rows_4382),
        (PropellerSeries::Vp1304, rows_vp1304),
    ] {
        let d = 1000.0;
        let mesh = blade(&propeller(series, d), resolution(120, 150));
        for [ratio, chord, pitch, skew_deg, rake, thickness, camber] in rows {
            let r = 0.5 * d * ratio;
            let cut = Cut::new(&mesh, r, pitch * d);
            let [leading, trailing] = cut.ends();
            let at = format!("{series:?} at {ratio} R");
            assert!((cut.chord() / (chord * d) - 1.0).abs() < 5e-4, "{at}: chord {}", cut.chord() / d);
            let pitch_error = ((leading.y - trailing.y) / cut.chord()).atan().to_degrees();
            assert!(pitch_error.abs() < 0.05, "{at}: pitch angle is {pitch_error}° off");
            let (sin, cos) = (pitch * d).atan2(TAU * r).sin_cos();
            let middle = nalgebra::center(&leading, &trailing);
            // Back from section coordinates to (r·θ, z).
            let around = (middle.x * cos - middle.y * sin) / r;
            assert!((around.to_degrees() + skew_deg).abs() < 0.05, "{at}: skew {}", -around.to_degrees());
            let rake_found = middle.x * sin + middle.y * cos + r * skew_deg.to_radians() * (sin / cos);
            assert!((rake_found / d - rake).abs() < 1e-4, "{at}: rake {}", rake_found / d);
            // At half the chord the form has 0.9924 of its largest thickness and all of its camber.
            let [low, high] = cut.heights(0.5);
            assert!(((high - low) / (0.9924 * thickness * chord * d) - 1.0).abs() < 2e-3, "{at}: {}", (high - low) / d);
            let camber_found = 0.5 * (low + high) - 0.5 * (leading.y + trailing.y);
            assert!((camber_found / (camber * chord * d) - 1.0).abs() < 0.01, "{at}: camber {camber_found}");
        }
    }
}

/// Sections of the Wageningen series from published ordinates, measured on the mesh: `[P, y_face,
/// y_back]` over t at 0.8 R, where V1 is 0, but for the edge thickness that both ends have.
#[test]
fn wageningen_sections_have_a_flat_face_and_the_published_back() {
    let (n_blades, area_ratio, pitch_ratio, d) = (5, 0.7, 0.95, 1000.0);
    let mesh =
        blade(&propeller(PropellerSeries::WageningenB { n_blades, area_ratio, pitch_ratio }, d), resolution(120, 150));
    let cut = Cut::new(&mesh, 400.0, pitch_ratio * d);
    let chord = 1.97 * area_ratio / 5.0 * d;
    assert!((cut.chord() / chord - 1.0).abs() < 1e-3, "{}", cut.chord());
    let thickness = (0.0154 - 0.001 * 5.0) * d;
    // The pitch line is the face: it goes through the generator line, which is raked 15° aft.
    let (sin, cos) = (pitch_ratio * d).atan2(TAU * 400.0).sin_cos();
    let face = -400.0 * 15f64.to_radians().tan() * cos;
    let leading = cut.ends()[0].x + 400.0 * 15f64.to_radians().tan() * sin;
    assert!((leading / chord - 0.463).abs() < 2e-3, "leading edge {}", leading / chord);
    let thickest = 0.479;
    for (p, v2) in [(0.0, 1.0), (0.5, 0.7635), (0.8, 0.3765), (-0.5, 0.75), (-0.8, 0.36)] {
        let x = if p > 0.0 { thickest * (1.0 - p) } else { thickest - (1.0 - thickest) * p };
        let [low, high] = cut.heights(x);
        assert!((low - face).abs() < 0.05, "face at P = {p}: {}", low - face);
        let edge = (high - face - v2 * thickness) / (1.0 - v2).max(1e-3) / thickness;
        if v2 < 1.0 {
            assert!((0.03..0.07).contains(&edge), "back at P = {p}: {} t, edge {edge} t", (high - face) / thickness);
        } else {
            assert!(((high - face) / thickness - 1.0).abs() < 5e-3, "thickness {}", high - face);
        }
    }
}

#[test]
fn the_expanded_area_is_the_requested_one() {
    for (n_blades, area_ratio) in [(2, 0.35), (3, 0.5), (4, 0.7), (5, 1.05), (6, 0.8), (7, 0.85)] {
        let spec = propeller(PropellerSeries::WageningenB { n_blades, area_ratio, pitch_ratio: 1.0 }, 1000.0);
        let mesh = blade(&spec, resolution(60, 40));
        let hub = spec.hub_radius();
        let n = 60;
        let chord = |k: usize| {
            let r = hub + (500.0 - hub) * (k as f64 + 0.5) / n as f64;
            let pitch = BladeSurface::new(&spec).section(r).pitch();
            Cut::new(&mesh, r, pitch).chord()
        };
        let area: f64 = (0..n).map(chord).sum::<f64>() * (500.0 - hub) / n as f64;
        let found = n_blades as f64 * area / (PI * 500.0 * 500.0);
        println!("B{n_blades}-{area_ratio}: expanded area ratio {found:.4}");
        assert!((found / area_ratio - 1.0).abs() < 0.03, "B{n_blades}-{area_ratio}: {found}");
    }
}

#[test]
fn four_blades_have_less_pitch_at_the_hub() {
    for (n_blades, ratio) in [(3, 1.0), (4, 0.822), (5, 1.0)] {
        let spec = propeller(PropellerSeries::WageningenB { n_blades, area_ratio: 0.6, pitch_ratio: 1.1 }, 800.0);
        assert!((BladeSurface::new(&spec).section(80.0).pitch() / (1.1 * 800.0) - ratio).abs() < 1e-9);
    }
}

#[test]
fn size_goes_with_the_diameter() {
    for series in SERIES {
        let [small, large] = [250.0, 2000.0].map(|d| blade(&propeller(series, d), resolution(12, 16)));
        assert_eq!(small.triangles(), large.triangles(), "{series:?}");
        for (a, b) in small.vertices().iter().zip(large.vertices()) {
            // 8 is a power of two, so not even rounding differs where all goes through the
            // diameter.
            assert!((a * 8.0 - b).norm() < 1e-9, "{series:?}");
        }
    }
}

#[test]
fn the_propeller_has_as_many_fold_symmetry_as_blades() {
    for series in SERIES {
        let spec = propeller(series, 1000.0);
        let z = spec.n_blades();
        let step = blade_pose(&spec, 1);
        assert!((step.rotation.angle() - TAU / z as f64).abs() < 1e-14);
        assert!(step.translation.vector.norm() == 0.0 && step.rotation.axis().is_some_and(|a| a.z > 0.999_999));
        for k in 0..2 * z {
            let difference = (step * blade_pose(&spec, k)).rotation.angle_to(&blade_pose(&spec, k + 1).rotation);
            assert!(difference.abs() < 1e-7, "{difference}");
        }
        let hub = hub(&spec, 0.2).expect("in range");
        let turned = hub.transformed(&step);
        for p in turned.vertices() {
            assert!(hub.vertices().iter().any(|q| (p - q).norm() < 1e-9), "{series:?}: {p}");
        }
    }
}

#[test]
fn blades_grow_out_of_the_hub() {
    for series in SERIES {
        let spec = propeller(series, 1000.0);
        let (mesh, hub) = (blade(&spec, resolution(20, 30)), hub(&spec, 0.1).expect("in range"));
        let r = spec.hub_radius();
        let heights =
            hub.triangles()[kit::group(&hub, "cylinder")].iter().flatten().map(|&v| hub.vertices()[v as usize].z);
        let (low, high) = heights.fold((0.0, 0.0), |(a, b): (f64, f64), z| (a.min(z), b.max(z)));
        for (k, p) in mesh.vertices().iter().enumerate() {
            let radius = p.x.hypot(p.y);
            assert!(radius <= 500.0 + 1e-9, "vertex {k}");
            if radius < 1.02 * r {
                assert!(p.z > low && p.z < high, "{series:?}: {} {low} {high}", p.z);
            }
        }
        let deepest = mesh.vertices().iter().map(|p| p.x.hypot(p.y)).fold(f64::INFINITY, f64::min);
        assert!((deepest - 0.85 * r).abs() < 1e-9);
        for name in ["suction", "pressure", "edge", "tip"] {
            for &v in mesh.triangles()[kit::group(&mesh, name)].iter().flatten() {
                let p = mesh.vertices()[v as usize];
                assert!(p.x.hypot(p.y) > r - 1e-9, "{series:?} {name}");
            }
        }
        let top = mesh.vertices().iter().map(|p| p.x.hypot(p.y)).fold(0.0, f64::max);
        assert!((top - 500.0).abs() < 1e-9, "the blade ends at R");
    }
}

#[test]
fn the_same_arguments_give_the_same_mesh() {
    for series in SERIES {
        let make = || (blade(&propeller(series, 777.0), resolution(13, 17)), hub(&propeller(series, 777.0), 0.1));
        assert_eq!(make(), make());
    }
}

#[test]
fn impossible_propellers_are_refused_by_name() {
    let field = |result: Result<PropellerSpec, SpecError>| match result {
        Err(SpecError::OutOfRange { field, .. }) => field,
        other => panic!("{other:?}"),
    };
    let b = |n_blades, area_ratio, pitch_ratio| {
        PropellerSpec::new(PropellerSeries::WageningenB { n_blades, area_ratio, pitch_ratio }, 1000.0)
    };
    for d in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e9] {
        assert_eq!(field(PropellerSpec::new(PropellerSeries::Dtmb4119, d)), "diameter");
    }
    assert_eq!(field(b(1, 0.5, 1.0)), "number of blades");
    assert_eq!(field(b(8, 0.5, 1.0)), "number of blades");
    assert_eq!(field(b(4, f64::NAN, 1.0)), "expanded area ratio");
    assert_eq!(field(b(4, 0.5, 3.0)), "pitch ratio");
    assert!(BladeResolution::new(0, 10).is_err() && BladeResolution::new(10, usize::MAX).is_err());
    let spec = propeller(PropellerSeries::Dtmb4119, 3048.0);
    for tolerance in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(BladeResolution::for_chord_tolerance(&spec, tolerance).is_err());
        assert!(hub(&spec, tolerance).is_err());
    }
    assert_eq!(
        BladeResolution::for_chord_tolerance(&spec, 1e-9),
        Err(SpecError::TooFine { tolerance: 1e-9, most: 2000 })
    );
}
