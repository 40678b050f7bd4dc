//! Laws of anti-singing trailing edges, against the blade without.

use facemill_sample_parts::{
    AntiSingingEdge, BladeSide, BladeSurface, PropellerSeries, PropellerSpec, SolidForm, SpecError, blade,
    propeller_solid,
};
use facemill_surface_model::{Surface, SurfaceSettings};

use crate::kit::{self, Cut};
use crate::solid_laws::{propeller, resolution, varying};

const SERIES: [PropellerSeries; 4] = [
    PropellerSeries::Dtmb4119,
    PropellerSeries::Dtmb4382,
    PropellerSeries::Vp1304,
    PropellerSeries::WageningenB { n_blades: 4, area_ratio: 0.55, pitch_ratio: 0.9 },
];

fn edge(from: f64, to: f64, degrees: f64) -> AntiSingingEdge {
    AntiSingingEdge::new(from, to, degrees.to_radians()).expect("in range")
}

fn cut(series: PropellerSeries, diameter: f64, edge: AntiSingingEdge) -> PropellerSpec {
    propeller(series, diameter).with_anti_singing_edge(edge).expect("room for the chamfer")
}

/// Height of a section above its pitch line at a chord fraction, by the point's place on the
/// cylinder.
fn height(surface: &BladeSurface, radius: f64, side: BladeSide, x: f64) -> f64 {
    let section = surface.section(radius);
    let p = kit::unrolled(&section.point(side, x), radius);
    let (sin, cos) = section.pitch_angle().sin_cos();
    // Less the height of the pitch line, which the middle of the rounded trailing edge gives.
    let end = kit::unrolled(&section.point(BladeSide::Pressure, 1.0), radius);
    (p.y - end.y) * cos - (p.x - end.x) * sin
}

/// Where it has its full depth, the section is the lower one of the blade without it and of the
/// line from the trailing edge at the angle; elsewhere it lies between both, or is the blade
/// without it.
#[test]
fn chamfers_are_straight_at_their_angle() {
    for series in SERIES {
        for degrees in [20.0_f64, 35.0, 60.0] {
            let (plain, chamfered) = (propeller(series, 1000.0), cut(series, 1000.0, edge(0.5, 0.9, degrees)));
            let [plain, chamfered] = [plain, chamfered].map(|spec| BladeSurface::new(&spec));
            for k in 0..=24 {
                let ratio = 0.35 + 0.025 * f64::from(k);
                let radius = 500.0 * ratio;
                let chord = plain.section(radius).chord();
                let mut deepest: f64 = 0.0;
                for j in 0..=200 {
                    let x = 1.0 - 0.3 * (f64::from(j) / 200.0).powi(3);
                    let [before, after] =
                        [&plain, &chamfered].map(|surface| height(surface, radius, BladeSide::Suction, x));
                    let line = degrees.to_radians().tan() * chord * (1.0 - x);
                    let is_near_edge = (1.0 - x) < 0.2;
                    let full = if is_near_edge { before.min(line) } else { before };
                    let place = format!("{series:?} {degrees}° at {ratio} and {x}");
                    if (0.55..=0.85).contains(&ratio) {
                        assert!((after - full).abs() < 1e-9, "{place}: {after} instead of {full}");
                    } else if ratio <= 0.5 || ratio >= 0.9 {
                        assert!((after - before).abs() < 1e-9, "{place}: {after} instead of {before}");
                    } else {
                        assert!(after <= before + 1e-9 && after >= full - 1e-9, "{place}");
                    }
                    let [low, same] = [&plain, &chamfered].map(|s| height(s, radius, BladeSide::Pressure, x));
                    assert_eq!(low, same);
                    assert!(after > low || j == 0, "{place}: no thickness");
                    deepest = deepest.max(before - after);
                }
                if (0.55..=0.85).contains(&ratio) {
                    assert!(deepest > 0.02 * 1e-3 * chord, "{series:?} at {ratio}: {deepest} mm deep");
                }
            }
        }
    }
}

/// On its way along the radius the chamfer has no steps.
#[test]
fn chamfers_run_out() {
    let surface = BladeSurface::new(&cut(PropellerSeries::Dtmb4119, 1000.0, edge(0.4, 0.95, 25.0)));
    let plain = BladeSurface::new(&propeller(PropellerSeries::Dtmb4119, 1000.0));
    let depth = |k: u32| {
        let radius = 150.0 + 345.0 * f64::from(k) / 4000.0;
        let at = |x: f64| {
            let [before, after] = [&plain, &surface].map(|s| height(s, radius, BladeSide::Suction, x));
            before - after
        };
        (1..60).map(|j| at(1.0 - 1e-3 * f64::from(j))).fold(0.0, f64::max)
    };
    let depths: Vec<f64> = (0..=4000).map(depth).collect();
    let deepest = depths.iter().copied().fold(0.0, f64::max);
    let step = depths.windows(2).map(|d| (d[1] - d[0]).abs()).fold(0.0, f64::max);
    assert!(deepest > 0.3 && step < 0.01 * deepest, "{deepest} mm deep, with a step of {step}");
    assert_eq!([depths[0], depths[4000]], [0.0, 0.0]);
}

#[test]
fn chamfered_blades_and_solids_are_closed() {
    for series in SERIES {
        for degrees in [20.0, 45.0] {
            let spec = cut(series, 1000.0, edge(0.45, 0.93, degrees));
            let mesh = blade(&spec, resolution(16, 24));
            assert!(kit::is_closed(&mesh), "{series:?}");
            assert_eq!(kit::self_intersections(&mesh), [], "{series:?}");
            let form = SolidForm { fillet: varying(15.0), bore: None };
            let solid = propeller_solid(&spec, &form, resolution(12, 16), 0.5).expect("a solid");
            assert!(kit::is_closed(&solid), "{series:?}");
        }
    }
}

/// Volume that a chamfer takes from the mesh: that of its sections, over the radius.
#[test]
fn chamfers_take_the_volume_of_their_sections() {
    let specs = [propeller(SERIES[0], 1000.0), cut(SERIES[0], 1000.0, edge(0.45, 0.93, 20.0))];
    let surfaces = [0, 1].map(|k| BladeSurface::new(&specs[k]));
    let area = |radius: f64| {
        let chord = surfaces[0].section(radius).chord();
        let depth = |x: f64| {
            let [before, after] = [0, 1].map(|k| height(&surfaces[k], radius, BladeSide::Suction, x));
            before - after
        };
        (0..500).map(|j| depth(1.0 - 0.1 * (f64::from(j) + 0.5) / 500.0) * chord * 0.1 / 500.0).sum::<f64>()
    };
    let n = 240;
    let step = 500.0 * 0.48 / f64::from(n);
    let expected: f64 = (0..n).map(|k| step * area(225.0 + step * (f64::from(k) + 0.5))).sum();
    let [before, after] = [0, 1].map(|k| kit::volume(&blade(&specs[k], resolution(400, 600))));
    let found = before - after;
    println!("{found} mm³ of {expected}");
    assert!((found / expected - 1.0).abs() < 0.05, "{found} instead of {expected}");
}

/// The mesh has the chamfer's edge between two columns: facets are near the smooth blade there, the
/// suction side beside it has no crease, and the edge keeps its own.
#[test]
fn meshes_have_the_edge_of_the_chamfer() {
    for series in SERIES {
        let spec = cut(series, 1000.0, edge(0.45, 0.93, 30.0));
        let smooth = BladeSurface::new(&spec);
        let bends = [40, 80].map(|n| {
            let mesh = blade(&spec, resolution(n, 3 * n / 2));
            [
                kit::largest_bend(&mesh, kit::group(&mesh, "suction")),
                kit::largest_bend(&mesh, kit::group(&mesh, "edge")),
            ]
        });
        println!("{series:?}: bends {:?}", bends.map(|b| b.map(f64::to_degrees)));
        assert!(bends[1][0] < 0.75 * bends[0][0], "{series:?}: {bends:?}");
        let surface = Surface::new(blade(&spec, resolution(80, 120)), SurfaceSettings::default());
        let mut random = facemill_test_kit::Random(2);
        for _ in 0..400 {
            let radius = 500.0 * (0.4 + 0.55 * random.unit());
            let p = smooth.section(radius).point(BladeSide::Suction, 1.0 - 0.1 * random.unit().powi(2));
            let off = surface.closest_point(&p, f64::INFINITY).expect("a point").distance;
            assert!(off < 0.05, "{series:?}: {off} mm from the mesh at {p}");
        }
    }
}

/// A cut of the mesh has the chamfer's angle between chord and chamfer.
#[test]
fn the_angle_is_measured_back_from_the_mesh() {
    let (degrees, radius) = (30.0_f64, 350.0);
    let mesh = blade(&cut(PropellerSeries::Dtmb4119, 1000.0, edge(0.45, 0.93, degrees)), resolution(120, 150));
    // The pitch of DTMB 4119 at 0.7 R.
    let section = Cut::new(&mesh, radius, 1084.0);
    let chord = section.chord();
    // The trailing edge is 0.0333·0.05418·462.2 mm thick: 0.83.
    let [a, b] = [0.25, 0.55].map(|from_end| section.heights(1.0 - from_end / chord)[1]);
    let found = ((b - a) / 0.3).atan().to_degrees();
    assert!((found - degrees).abs() < 1.0, "{found}°");
}

#[test]
fn chamfers_without_room_are_refused() {
    for (from, to, angle) in [
        (0.1, 0.9, 0.5),
        (0.5, 0.55, 0.5),
        (0.5, 0.99, 0.5),
        (0.9, 0.5, 0.5),
        (0.5, 0.9, 0.05),
        (0.5, 0.9, 1.5),
        (f64::NAN, 0.9, 0.5),
        (0.5, f64::NAN, 0.5),
        (0.5, 0.9, f64::NAN),
    ] {
        assert!(
            matches!(AntiSingingEdge::new(from, to, angle), Err(SpecError::OutOfRange { .. })),
            "{from} {to} {angle}"
        );
    }
    let vp1304 = propeller(PropellerSeries::Vp1304, 250.0);
    let inside = vp1304.clone().with_anti_singing_edge(edge(0.31, 0.9, 30.0));
    assert!(matches!(inside, Err(SpecError::OutOfRange { .. })), "the hub's radius is 0.3 R");
    let flat = vp1304.with_anti_singing_edge(edge(0.4, 0.9, 6.0));
    assert!(matches!(flat, Err(SpecError::Shape { .. })), "{flat:?}");
    // A fillet that reaches the chamfer.
    let spec = cut(PropellerSeries::Dtmb4119, 1000.0, edge(0.3, 0.9, 30.0));
    let form = SolidForm { fillet: varying(40.0), bore: None };
    let found = propeller_solid(&spec, &form, resolution(12, 16), 0.5).expect_err("no room");
    assert!(matches!(found, SpecError::OutOfRange { field: "fillet radius", .. }), "{found}");
}
