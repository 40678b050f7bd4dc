//! Laws of propellers as one solid, by distances, volumes and angles measured here.

use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::{PI, TAU};

use facemill_sample_parts::{
    BladeResolution, BladeSide, BladeSurface, Bore, FilletStation, Hand, PropellerSeries, PropellerSpec, RootFillet,
    SolidForm, blade, blade_pose, fillet_contact, propeller_solid,
};
use facemill_surface_model::{Surface, SurfaceSettings, TriMesh};
use nalgebra::{Isometry3, Point3, Vector3};

use crate::kit;

const WAGENINGEN: PropellerSeries = PropellerSeries::WageningenB { n_blades: 4, area_ratio: 0.55, pitch_ratio: 0.9 };
const SERIES: [PropellerSeries; 6] = [
    PropellerSeries::Dtmb4119,
    PropellerSeries::Dtmb4382,
    PropellerSeries::Vp1304,
    WAGENINGEN,
    PropellerSeries::WageningenB { n_blades: 2, area_ratio: 0.3, pitch_ratio: 0.5 },
    PropellerSeries::WageningenB { n_blades: 7, area_ratio: 0.85, pitch_ratio: 0.7 },
];

pub(crate) fn propeller(series: PropellerSeries, diameter: f64) -> PropellerSpec {
    PropellerSpec::new(series, diameter).expect("in range")
}

pub(crate) fn resolution(n_radial: usize, n_chord: usize) -> BladeResolution {
    BladeResolution::new(n_radial, n_chord).expect("in range")
}

fn station(chord_fraction: f64, suction: f64, pressure: f64) -> FilletStation {
    FilletStation { chord_fraction, suction, pressure }
}

/// Radii that are smaller on the pressure side, and much smaller at the edges.
pub(crate) fn varying(radius: f64) -> RootFillet {
    let edge = 0.15 * radius;
    let stations = [(0.0, edge, edge), (0.3, radius, 0.7 * radius), (0.65, radius, 0.8 * radius), (1.0, edge, edge)];
    RootFillet::varying(&stations.map(|(x, suction, pressure)| station(x, suction, pressure))).expect("radii")
}

pub(crate) fn constant(radius: f64) -> RootFillet {
    RootFillet::constant(radius).expect("a radius")
}

/// Fillets of a propeller, of constant and of varying radius, that fit all series.
fn fillets(spec: &PropellerSpec) -> [RootFillet; 2] {
    let d = spec.diameter();
    [constant(0.004 * d), varying(0.02 * d)]
}

pub(crate) fn solid(spec: &PropellerSpec, fillet: &RootFillet, of: BladeResolution, tolerance: f64) -> TriMesh {
    let form = SolidForm { fillet: fillet.clone(), bore: None };
    propeller_solid(spec, &form, of, tolerance).expect("a solid")
}

fn surface(mesh: TriMesh) -> Surface {
    Surface::new(mesh, SurfaceSettings::default())
}

fn distance(surface: &Surface, p: &Point3<f64>) -> f64 {
    surface.closest_point(p, f64::INFINITY).expect("a point").distance
}

#[test]
fn solids_are_closed_outward_and_of_one_piece() {
    let mut n = 0;
    for series in SERIES {
        for diameter in [250.0, 3048.0] {
            let spec = propeller(series, diameter);
            for fillet in fillets(&spec) {
                let hub = spec.hub_radius();
                n += 1;
                let bores = [None, Some(Bore::cylinder(0.4 * hub)), Some(Bore::taper(0.3 * hub, 0.5 * hub))];
                let bore = bores[n % 3].clone().map(|bore| bore.expect("a bore"));
                let form = SolidForm { fillet, bore };
                let solid = propeller_solid(&spec, &form, resolution(8, 12), 4e-3 * hub).expect("a solid");
                assert!(kit::is_closed(&solid), "{series:?}");
                assert!(kit::volume(&solid) > 0.0, "{series:?}");
                let n_blades = spec.n_blades();
                let names: Vec<&str> = solid.groups().iter().map(|group| group.name.as_str()).collect();
                assert_eq!(names.len(), 10 * n_blades + if form.bore.is_some() { 4 } else { 3 });
                assert_eq!(
                    names[..5].join(" "),
                    "blade-1/suction blade-1/suction-leading-edge blade-1/suction-trailing-edge blade-1/suction-tip \
                     blade-1/suction-fillet"
                );
                assert_eq!(names[5..10].join(" "), names[..5].join(" ").replace("suction", "pressure"));
                assert_eq!(names[10 * n_blades], "hub/cylinder");
                let surface = surface(solid);
                assert_eq!(surface.topology().components.len(), 1, "{series:?}");
                assert!(surface.is_inside(&Point3::new(0.6 * hub, 0.0, 0.0)));
                assert_eq!(surface.is_inside(&Point3::new(0.2 * hub, 0.0, 0.0)), form.bore.is_none());
            }
        }
    }
}

#[test]
fn no_solid_cuts_through_itself() {
    for (k, series) in SERIES.into_iter().enumerate() {
        let spec = propeller(series, 1000.0);
        // Constant radii of every other series, varying ones of all.
        for fillet in fillets(&spec).into_iter().skip(k % 2) {
            let solid = solid(&spec, &fillet, resolution(8, 12), 1e-2 * spec.hub_radius());
            // All other blades are to their neighbours as these two.
            let kept = ["blade-1/", "blade-2/", "hub/cylinder"];
            let solid = solid.select_groups(|name| kept.iter().any(|start| name.starts_with(start)));
            assert_eq!(kit::self_intersections(&solid), [], "{series:?}");
        }
    }
}

/// Each ball touches blade and hub, which are known here as a mesh by another function and as a
/// cylinder, and cuts into neither; the fillet of the mesh lies on it.
#[test]
fn fillets_lie_on_balls_that_touch_blade_and_hub() {
    for series in [PropellerSeries::Dtmb4119, PropellerSeries::Vp1304, WAGENINGEN] {
        for diameter in [250.0, 3048.0] {
            let spec = propeller(series, diameter);
            let hub = spec.hub_radius();
            let tolerance = 1e-3 * hub;
            let fine = surface(blade(&spec, resolution(70, 100)));
            for (k_fillet, fillet) in fillets(&spec).into_iter().enumerate() {
                let mesh = surface(solid(&spec, &fillet, resolution(24, 36), tolerance));
                let mut random = facemill_test_kit::Random(7);
                for k in 0..60 {
                    let side = if random.unit() < 0.5 { BladeSide::Suction } else { BladeSide::Pressure };
                    // Every other one near an edge, which takes up little of the chord.
                    let x = if k % 2 == 0 { random.unit() } else { (0.5 * PI * random.unit()).sin().powi(8) };
                    let ball = fillet_contact(&spec, &fillet, side, x).expect("a ball");
                    let radius = fillet.radius(side, x);
                    let place = format!("{series:?} {diameter} at {x} {side:?}");
                    assert_eq!(ball.radius, radius);
                    assert!(((ball.on_blade - ball.centre).norm() - radius).abs() < 1e-9 * hub, "{place}");
                    assert!(((ball.on_hub - ball.centre).norm() - radius).abs() < 1e-9 * hub, "{place}");
                    assert!((ball.on_hub.x.hypot(ball.on_hub.y) - hub).abs() < 1e-9 * hub, "{place}");
                    assert!((ball.centre.x.hypot(ball.centre.y) - hub - radius).abs() < 1e-9 * hub, "{place}");
                    // Facets of the fine blade are within 1e-4 of the hub radius of it.
                    let to_blade = distance(&fine, &ball.centre);
                    assert!((to_blade - radius).abs() < 5e-4 * hub, "{place}: {to_blade} instead of {radius}");
                    // Where radii vary, a ball does not lie in the arcs beside its own.
                    let to_solid = distance(&mesh, &ball.centre);
                    let is_free = (to_solid - radius).abs() < tolerance;
                    assert!(is_free || k_fillet == 1, "{place}: {to_solid} instead of {radius}");
                    for share in [0.0, 0.2, 0.5, 0.8, 1.0] {
                        let p = ball.on_arc(share);
                        assert!(((p - ball.centre).norm() - radius).abs() < 1e-9 * hub);
                        let off = distance(&mesh, &p);
                        assert!(off < tolerance, "{place}: {off} at {share} of the arc");
                    }
                }
            }
        }
    }
}

/// A fillet adds material alone: what blade and hub have there is in the solid. It leaves the balls
/// free: no place inside of one is.
#[test]
fn fillets_hold_blade_and_hub_and_leave_the_balls_free() {
    for series in SERIES {
        let spec = propeller(series, 1000.0);
        let (smooth, hub, tolerance) = (BladeSurface::new(&spec), spec.hub_radius(), 2e-3 * spec.hub_radius());
        for (k_fillet, fillet) in fillets(&spec).into_iter().enumerate() {
            let fine = BladeResolution::for_chord_tolerance(&spec, 0.5 * tolerance).expect("in range");
            let mesh = surface(solid(&spec, &fillet, fine, tolerance));
            let mut random = facemill_test_kit::Random(5);
            let mut n_deep = 0;
            for _ in 0..300 {
                let side = if random.unit() < 0.5 { BladeSide::Suction } else { BladeSide::Pressure };
                let x = (0.5 * PI * random.unit()).sin().powi(2);
                let section = smooth.section(hub + 2.0 * fillet.radius(side, x) * random.unit());
                let p = section.point(side, x);
                let off = distance(&mesh, &p);
                assert!(off < tolerance || mesh.is_inside(&p), "{series:?}: {off} outside at {p}");
                n_deep += usize::from(off > tolerance);
                let ball = fillet_contact(&spec, &fillet, side, x).expect("a ball");
                let [u, v] = [random.unit(), random.unit()];
                let direction =
                    Vector3::new((TAU * u).cos(), (TAU * u).sin(), 0.0) * (1.0 - v * v).sqrt() + Vector3::z() * v;
                let q =
                    ball.centre + direction * (ball.radius - tolerance) * if random.unit() < 0.5 { -1.0 } else { 1.0 };
                assert!(k_fillet == 1 || !mesh.is_inside(&q), "{series:?}: {q} is in a ball and in the solid");
            }
            assert!(n_deep > 30, "{series:?}: {n_deep} places under the fillet");
        }
    }
}

/// Fitted radii are whole in the middle, fit at any resolution, and are not much smaller at the
/// edges than they must be.
#[test]
fn fitted_fillets_fit() {
    for series in SERIES {
        let spec = propeller(series, 1000.0);
        for radius in [10.0, 20.0] {
            let fillet = RootFillet::fitted(&spec, radius).expect("a fillet");
            assert!([0.25, 0.4, 0.75].iter().all(|x| (fillet.radius(BladeSide::Pressure, *x) - radius).abs() < 1e-9));
            let edges = [0.0, 1.0].map(|x| fillet.radius(BladeSide::Suction, x));
            println!("{series:?}: {radius} mm, at the edges {edges:?}");
            for (of, tolerance) in [(resolution(10, 12), 1.0), (resolution(30, 45), 0.05)] {
                let form = SolidForm { fillet: fillet.clone(), bore: None };
                let solid = propeller_solid(&spec, &form, of, tolerance);
                assert!(kit::is_closed(&solid.expect("a solid")), "{series:?}: {radius}");
            }
            for edge in 0..2 {
                if edges[edge] < radius {
                    let mut larger = edges;
                    larger[edge] = (larger[edge] * 1.7).min(radius);
                    let [leading, trailing] = larger;
                    let stations = [(0.0, leading), (0.25, radius), (0.75, radius), (1.0, trailing)]
                        .map(|(x, r)| station(x, r, r));
                    let fillet = RootFillet::varying(&stations).expect("radii");
                    let form = SolidForm { fillet, bore: None };
                    let folded = propeller_solid(&spec, &form, resolution(30, 45), 0.02);
                    assert!(folded.is_err(), "{series:?}: {radius} mm fits {larger:?}, too");
                }
            }
        }
    }
}

/// Largest bends between facets of the fillet of blade 1 and their neighbours of the blade and of
/// the hub, rad.
fn seam_bends(mesh: &TriMesh) -> [f64; 2] {
    let fillets = ["suction", "pressure"].map(|side| kit::group(mesh, &format!("blade-1/{side}-fillet")));
    let is_fillet = |t: &usize| fillets.iter().any(|fillet| fillet.contains(t));
    let hub = kit::group(mesh, "hub/cylinder");
    let mut beside = BTreeMap::<(u32, u32), Vec<usize>>::new();
    for (t, [a, b, c]) in mesh.triangles().iter().enumerate() {
        for (p, q) in [(a, b), (b, c), (c, a)] {
            beside.entry((*p.min(q), *p.max(q))).or_default().push(t);
        }
    }
    let mut bends: [f64; 2] = [0.0; 2];
    for pair in beside.values() {
        let [s, t] = pair[..] else { panic!("an edge of {} triangles", pair.len()) };
        let (inside, outside) = if is_fillet(&s) { (s, t) } else { (t, s) };
        if is_fillet(&inside) && !is_fillet(&outside) {
            let bend = mesh.scaled_normal(inside).angle(&mesh.scaled_normal(outside));
            let seam = &mut bends[usize::from(hub.contains(&outside))];
            *seam = seam.max(bend);
        }
    }
    bends
}

/// Where surfaces are tangent, bends between facets go with the root of the chord tolerance. A
/// crease would stay.
#[test]
fn fillets_are_tangent_to_blade_and_hub() {
    for series in [PropellerSeries::Dtmb4119, PropellerSeries::Vp1304, WAGENINGEN] {
        let spec = propeller(series, 1000.0);
        for fillet in fillets(&spec) {
            let bends = [1, 2, 4].map(|n| {
                let tolerance = 3e-3 * spec.hub_radius() / f64::from(n * n);
                seam_bends(&solid(&spec, &fillet, resolution(16 * n as usize, 24 * n as usize), tolerance))
            });
            println!("{series:?}: {:?}", bends.map(|b| b.map(f64::to_degrees)));
            for seam in [0, 1] {
                let [coarse, middle, fine] = bends.map(|bend| bend[seam]);
                assert!(fine < 0.5 * coarse && fine < 0.75 * middle, "{series:?}: {bends:?}");
                assert!(fine < 0.25, "{series:?}: {bends:?}");
            }
        }
    }
}

/// Area of a blade's section on a cylinder, unrolled, mm².
fn section_area(surface: &BladeSurface, radius: f64) -> f64 {
    let section = surface.section(radius);
    let n = 400;
    let x = |k: usize| (0.5 * PI * k as f64 / n as f64).sin().powi(2);
    let suction = (0..=n).map(|k| section.point(BladeSide::Suction, x(k)));
    let pressure = (1..n).rev().map(|k| section.point(BladeSide::Pressure, x(k)));
    let points: Vec<_> = suction.chain(pressure).map(|p| kit::unrolled(&p, radius)).collect();
    let pairs = points.iter().zip(points.iter().cycle().skip(1));
    0.5 * pairs.map(|(a, b)| a.x * b.y - b.x * a.y).sum::<f64>().abs()
}

/// Volume of a hub of a length with rounded ends, mm³.
fn hub_volume(radius: f64, length: f64) -> f64 {
    let rounding = 0.25 * radius;
    let n = 20_000;
    let slice = |k: usize| {
        let z = rounding * (k as f64 + 0.5) / n as f64;
        (radius - rounding + (rounding * rounding - z * z).sqrt()).powi(2) * rounding / n as f64
    };
    PI * (radius * radius * (length - 2.0 * rounding) + 2.0 * (0..n).map(slice).sum::<f64>())
}

/// Volume of the fillets of a blade over r², from the angle at which its section meets the hub:
/// tan(ψ/2) − ψ/2 with the angle ψ between both normals, along the section.
fn fillet_volume_over_square(surface: &BladeSurface, hub_radius: f64) -> f64 {
    let h = 1e-4 * hub_radius;
    let point = |radius: f64, beta: f64| {
        let side = if beta.rem_euclid(TAU) <= PI { BladeSide::Suction } else { BladeSide::Pressure };
        surface.section(radius).point(side, (0.5 * beta).sin().powi(2))
    };
    let n = 3000;
    (0..n)
        .map(|k| {
            let [a, b] = [k as f64, k as f64 + 1.0].map(|k| TAU * k / n as f64);
            let beta = 0.5 * (a + b);
            let along = point(hub_radius, b) - point(hub_radius, a);
            let normal = along.cross(&(point(hub_radius + h, beta) - point(hub_radius - h, beta)));
            let p = point(hub_radius, beta);
            let angle = normal.angle(&Vector3::new(p.x, p.y, 0.0));
            ((0.5 * angle).tan() - 0.5 * angle) * along.norm()
        })
        .sum()
}

#[test]
fn volumes_are_those_of_hub_blades_and_fillets() {
    for series in [PropellerSeries::Dtmb4119, WAGENINGEN] {
        let spec = propeller(series, 1000.0);
        let (surface, hub) = (BladeSurface::new(&spec), spec.hub_radius());
        let n = 400;
        let step = (500.0 - hub) / f64::from(n);
        let outside = (0..n).map(|k| step * section_area(&surface, hub + step * (f64::from(k) + 0.5))).sum::<f64>();
        let over_square = fillet_volume_over_square(&surface, hub);
        let [mut volumes, mut expected] = [[0.0; 2]; 2];
        for (k, radius) in [0.04 * hub, 0.08 * hub].into_iter().enumerate() {
            let solid = solid(&spec, &constant(radius), resolution(80, 120), 2e-4 * hub);
            let length = 2.0 * solid.aabb().half_extents().z;
            // Wageningen blades reach farther than their hub in z.
            let ends = kit::group(&solid, "hub/ends");
            let z = || ends.clone().flat_map(|t| solid.corners(t)).map(|p| p.z);
            let of_hub = z().fold(f64::MIN, f64::max) - z().fold(f64::MAX, f64::min);
            assert!(of_hub <= length + 1e-9);
            volumes[k] = kit::volume(&solid);
            let blades = spec.n_blades() as f64;
            expected[k] = hub_volume(hub, of_hub) + blades * (outside + over_square * radius * radius);
            println!("{series:?} r = {radius}: {} against {}", volumes[k], expected[k]);
            assert!((volumes[k] / expected[k] - 1.0).abs() < 5e-4, "{series:?}: {volumes:?} against {expected:?}");
        }
        let [found, formula] = [volumes, expected].map(|v| v[1] - v[0]);
        println!("{series:?}: between both radii {found} against {formula}");
        assert!((found / formula - 1.0).abs() < 0.015, "{series:?}: {found} against {formula}");
    }
}

#[test]
fn bores_have_their_radius() {
    let spec = propeller(PropellerSeries::Dtmb4119, 1000.0);
    let of = |bore: Option<Bore>| {
        let form = SolidForm { fillet: varying(15.0), bore };
        propeller_solid(&spec, &form, resolution(12, 16), 0.03).expect("a solid")
    };
    let without = of(None);
    let z = |mesh: &TriMesh, name: &str| {
        let corners = || kit::group(mesh, name).flat_map(|t| mesh.corners(t)).map(|p| p.z);
        [corners().fold(f64::MAX, f64::min), corners().fold(f64::MIN, f64::max)]
    };
    for [aft, ahead] in [[30.0, 30.0], [25.0, 40.0], [70.0, 2.0]] {
        let mesh = of(Some(Bore::taper(aft, ahead).expect("a bore")));
        let [low, high] = z(&mesh, "hub/bore");
        assert_eq!([low, high], z(&without, "hub/ends"), "the bore goes through");
        for t in kit::group(&mesh, "hub/bore") {
            let corners = mesh.corners(t);
            for p in corners {
                let radius = aft + (ahead - aft) * (p.z - low) / (high - low);
                assert!((p.x.hypot(p.y) - radius).abs() < 1e-9, "{p}");
            }
            let toward_axis = corners.iter().map(|p| p.coords).sum::<Vector3<f64>>();
            assert!(mesh.scaled_normal(t).xy().dot(&toward_axis.xy()) < 0.0);
        }
        let cone = PI / 3.0 * (high - low) * (aft * aft + aft * ahead + ahead * ahead);
        let removed = kit::volume(&without) - kit::volume(&mesh);
        assert!((removed / cone - 1.0).abs() < 2e-3, "{removed} instead of {cone}");
    }
}

/// Facets of the hub: vertices on the cylinder, and all of a facet within the tolerance of it.
#[test]
fn hubs_keep_their_chord_tolerance() {
    for series in SERIES {
        let spec = propeller(series, 1000.0);
        let hub = spec.hub_radius();
        for tolerance in [0.05 * hub, 2e-3 * hub, 1e-4 * hub] {
            let mesh = solid(&spec, &fillets(&spec)[1], resolution(10, 20), tolerance);
            for t in kit::group(&mesh, "hub/cylinder") {
                let corners = mesh.corners(t);
                for k in 0..3 {
                    let [a, b] = [corners[k], corners[(k + 1) % 3]];
                    let middle = nalgebra::center(&a, &b);
                    assert!((a.x.hypot(a.y) - hub).abs() < 1e-9 * hub, "{series:?}");
                    assert!(middle.x.hypot(middle.y) > hub - tolerance, "{series:?}");
                }
                let outward = corners.iter().map(|p| p.coords).sum::<Vector3<f64>>();
                let angle = mesh.scaled_normal(t).angle(&Vector3::new(outward.x, outward.y, 0.0));
                assert!(angle < 2.0 * (tolerance / hub).sqrt(), "{series:?}: {angle}");
            }
        }
    }
}

/// Outside the fillets the blades are those of the other functions, each in its place.
#[test]
fn blades_are_in_their_places() {
    for hand in [Hand::Right, Hand::Left] {
        let spec = handed(hand);
        let (smooth, fillet) = (BladeSurface::new(&spec), varying(20.0));
        let mesh = surface(solid(&spec, &fillet, resolution(60, 90), 0.1));
        let mut random = facemill_test_kit::Random(11);
        for k in 0..300 {
            let radius = spec.hub_radius() + 40.0 + (485.0 - spec.hub_radius() - 40.0) * random.unit();
            let side = if random.unit() < 0.5 { BladeSide::Suction } else { BladeSide::Pressure };
            let p = blade_pose(&spec, k) * smooth.section(radius).point(side, random.unit());
            let off = distance(&mesh, &p);
            assert!(off < 0.1, "{off} at {p}");
        }
    }
}

/// DTMB 4382, with skew, of either hand.
fn handed(hand: Hand) -> PropellerSpec {
    let table = PropellerSeries::Dtmb4382.table().expect("a table");
    let table = facemill_sample_parts::PropellerTable { hand, ..table };
    PropellerSpec::from_table(table, 1000.0).expect("a propeller")
}

/// Triangles of a mesh by the places of their corners, which are numbered by another mesh's.
struct Places(BTreeMap<[i64; 3], Vec<(Point3<f64>, u32)>>);

impl Places {
    const CELL: f64 = 1e-3;

    fn of(mesh: &TriMesh) -> Self {
        let mut cells = BTreeMap::<_, Vec<_>>::new();
        for (k, p) in mesh.vertices().iter().enumerate() {
            cells.entry(Self::cell(p)).or_default().push((*p, k as u32));
        }
        Self(cells)
    }

    fn cell(p: &Point3<f64>) -> [i64; 3] {
        [p.x, p.y, p.z].map(|c| (c / Self::CELL).floor() as i64)
    }

    /// Number of the vertex at a place, within 1e-7 mm.
    fn at(&self, p: &Point3<f64>) -> Option<u32> {
        let [x, y, z] = Self::cell(p);
        let near = (0..27).map(|k| [x + k % 3 - 1, y + k / 3 % 3 - 1, z + k / 9 - 1]);
        let mut vertices = near.filter_map(|cell| self.0.get(&cell)).flatten();
        vertices.find(|(q, _)| (p - q).norm() < 1e-7).map(|(_, k)| *k)
    }
}

/// Asserts that a motion takes one mesh to another, triangle by triangle; `turns` if it turns them
/// over.
fn assert_same(from: &TriMesh, to: &TriMesh, turns: bool, motion: impl Fn(&Point3<f64>) -> Point3<f64>) {
    let places = Places::of(to);
    let image: Vec<u32> =
        from.vertices().iter().map(|p| places.at(&motion(p)).unwrap_or_else(|| panic!("no vertex for {p}"))).collect();
    let first = |[a, b, c]: [u32; 3]| {
        if a < b && a < c {
            [a, b, c]
        } else if b < c {
            [b, c, a]
        } else {
            [c, a, b]
        }
    };
    let moved = from.triangles().iter().map(|t| t.map(|v| image[v as usize]));
    let moved: BTreeSet<_> = moved.map(|[a, b, c]| first(if turns { [a, c, b] } else { [a, b, c] })).collect();
    assert_eq!(moved, to.triangles().iter().map(|t| first(*t)).collect());
}

#[test]
fn a_turn_by_one_blade_maps_a_solid_on_itself() {
    for series in SERIES {
        let spec = propeller(series, 1000.0);
        let mesh = solid(&spec, &fillets(&spec)[1], resolution(10, 20), 4e-3 * spec.hub_radius());
        let turn = Isometry3::rotation(Vector3::z() * TAU / spec.n_blades() as f64);
        assert_same(&mesh, &mesh, false, |p| turn * p);
    }
}

#[test]
fn left_handed_solids_are_mirror_images() {
    let [right, left] = [Hand::Right, Hand::Left].map(|hand| {
        let form = SolidForm { fillet: varying(20.0), bore: Some(Bore::taper(20.0, 40.0).expect("a bore")) };
        propeller_solid(&handed(hand), &form, resolution(10, 20), 0.4).expect("a solid")
    });
    assert!(kit::is_closed(&left) && kit::volume(&left) > 0.0);
    assert_same(&right, &left, true, |p| Point3::new(p.x, -p.y, p.z));
    let [ball, other] = [Hand::Right, Hand::Left]
        .map(|hand| fillet_contact(&handed(hand), &varying(20.0), BladeSide::Suction, 0.4).expect("a ball").centre);
    assert!((Point3::new(ball.x, -ball.y, ball.z) - other).norm() < 1e-9);
}

/// Twice the size is the same solid twice as large, with twice the tolerance.
#[test]
fn sizes_scale() {
    let [small, large] = [500.0, 1000.0].map(|diameter| {
        let spec = propeller(PropellerSeries::Dtmb4119, diameter);
        solid(&spec, &varying(0.02 * diameter), resolution(10, 20), 4e-4 * diameter)
    });
    assert_eq!(small.triangles().len(), large.triangles().len());
    assert!((8.0 * kit::volume(&small) / kit::volume(&large) - 1.0).abs() < 1e-6);
}

#[test]
fn the_same_arguments_give_the_same_bytes() {
    let spec = propeller(WAGENINGEN, 400.0);
    let of = || solid(&spec, &varying(8.0), resolution(16, 24), 0.05);
    let (first, second) = (of(), of());
    let bits = |mesh: &TriMesh| -> Vec<[u64; 3]> {
        mesh.vertices().iter().map(|p| [p.x, p.y, p.z].map(f64::to_bits)).collect()
    };
    assert_eq!(bits(&first), bits(&second));
    assert_eq!(first.triangles(), second.triangles());
}

/// A radius that varies is the one given at each station, is never outside of those beside it, and
/// goes on around the edges without a jump of radius or slope.
#[test]
fn varying_radii_go_through_their_stations() {
    let mut random = facemill_test_kit::Random(3);
    for _ in 0..50 {
        let mut fractions: Vec<f64> = (0..6).map(|k| (f64::from(k) + 0.8 * random.unit()) / 6.0).collect();
        (fractions[0], fractions[5]) = (0.0, 1.0);
        let mut stations: Vec<_> =
            fractions.iter().map(|&x| station(x, 1.0 + 9.0 * random.unit(), 1.0 + 9.0 * random.unit())).collect();
        for edge in [0, 5] {
            stations[edge].pressure = stations[edge].suction;
        }
        let fillet = RootFillet::varying(&stations).expect("radii");
        for pair in stations.windows(2) {
            for (side, a, b) in [
                (BladeSide::Suction, pair[0].suction, pair[1].suction),
                (BladeSide::Pressure, pair[0].pressure, pair[1].pressure),
            ] {
                assert!((fillet.radius(side, pair[0].chord_fraction) - a).abs() < 1e-9);
                for k in 0..=20 {
                    let t = f64::from(k) / 20.0;
                    let x = pair[0].chord_fraction * (1.0 - t) + pair[1].chord_fraction * t;
                    let r = fillet.radius(side, x);
                    assert!(r >= a.min(b) - 1e-9 && r <= a.max(b) + 1e-9, "{r} between {a} and {b}");
                }
            }
        }
        let around = |beta: f64| {
            let side = if beta.rem_euclid(TAU) <= PI { BladeSide::Suction } else { BladeSide::Pressure };
            fillet.radius(side, (0.5 * beta).sin().powi(2))
        };
        let slope = |beta: f64, h: f64| (around(beta + h) - around(beta)) / h;
        // A polygon through the stations would turn by about the slopes of its pieces.
        let steepest = (0..1000).map(|k| slope(TAU * f64::from(k) / 1000.0, 1e-3).abs()).fold(0.0, f64::max);
        for x in &fractions {
            let beta = 2.0 * x.sqrt().asin();
            for beta in [beta, TAU - beta] {
                let [before, after] = [-1e-5, 1e-5].map(|h| slope(beta, h));
                assert!((before - after).abs() < 0.02 * steepest, "{before} and {after} of {steepest}");
            }
        }
    }
}
