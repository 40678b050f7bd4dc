//! Laws of lofted blades between hub and shroud.

use std::collections::BTreeSet;

use crate::kit;
use facemill_sample_parts::{BladeLoft, BladeSections, Endwalls, HubSector, HubSet, LoftEnd, LoftError, LoftedBlade};
use facemill_test_kit::Random;
use nalgebra::{Point2, Point3, Unit, Vector3};

/// A blade out along +x from an axis along z, flow along +z, with walls that cut it.
struct Annulus {
    blade: BladeSections,
    /// Place along the axis and radius of hub and shroud, growing along the axis.
    walls: [Vec<Point2<f64>>; 2],
    n_blades: u32,
}

/// Radius of a meridional polyline at a place along the axis: by its definition, linear between
/// points that grow along the axis.
fn radius_at(wall: &[Point2<f64>], z: f64) -> f64 {
    let k = wall.iter().position(|p| p.x >= z).unwrap_or(wall.len() - 1).max(1);
    let [a, b] = [wall[k - 1], wall[k]];
    a.y + (b.y - a.y) * (z - a.x) / (b.x - a.x)
}

/// Height of a point above the side of the polyline at its place along the axis.
fn above(wall: &[Point2<f64>], p: &Point3<f64>) -> f64 {
    p.x.hypot(p.y) - radius_at(wall, p.z)
}

fn random_annulus(random: &mut Random, is_cut_off: bool) -> Annulus {
    let n_blades = 9 + random.below(20) as u32;
    let hub = random.between(60.0, 140.0);
    let height = random.between(30.0, 90.0);
    let pitch = std::f64::consts::TAU * hub / f64::from(n_blades);
    let chord = pitch * random.between(0.9, 1.8);
    let stagger = random.between(-0.8, 0.8);
    let slope = [random.between(-0.1, 0.3), random.between(-0.2, 0.1)];
    let bend = random.between(0.0, 0.1);
    let n_sections = 3 + random.below(4);
    let half = 12 + random.below(20);
    let section = |k: usize| -> Vec<Point3<f64>> {
        // From below the hub to above the shroud.
        let share = -0.4 + 1.7 * k as f64 / (n_sections - 1) as f64;
        let twist = stagger + 0.4 * share;
        let place = |x: f64, side: f64| {
            let tail = if is_cut_off { x.sqrt() * (1.0 - 0.7 * x) } else { (x * (1.0 - x)).sqrt() };
            let y = 0.3 * x * (1.0 - x) + side * 0.07 * tail;
            let (along, across) = (chord * (x - 0.5), chord * y);
            let z = along * twist.cos() - across * twist.sin();
            let y = along * twist.sin() + across * twist.cos();
            Point3::new(hub + share * height, y, z)
        };
        let x = |k: usize| 0.5 + 0.5 * (std::f64::consts::PI * k as f64 / half as f64).cos();
        let back = if is_cut_off { half + 1 } else { half };
        let upper = (0..=half).map(|k| place(x(k), 1.0));
        let lower = (1..back).map(|k| place(x(half - k), -1.0));
        upper.chain(lower).collect()
    };
    let sections: Vec<_> = (0..n_sections).map(section).collect();
    let wall = |radius: f64, slope: f64| -> Vec<Point2<f64>> {
        let z = |k: i32| 0.45 * f64::from(k) * chord;
        (-4..=4).map(|k| Point2::new(z(k), radius + slope * z(k) + bend * f64::from(k.abs() % 2))).collect()
    };
    let walls = [wall(hub, slope[0]), wall(hub + height, slope[1])];
    Annulus { blade: BladeSections { sections, is_cut_off, ..BladeSections::default() }, walls, n_blades }
}

impl Annulus {
    fn endwalls(&self, random: &mut Random, thickness: Option<f64>) -> Endwalls {
        // Any angle of the polylines about the axis is the same wall.
        let mut curve = |wall: &[Point2<f64>]| -> Vec<Point3<f64>> {
            let turn = random.between(0.0, 6.0);
            wall.iter().map(|p| Point3::new(p.y * turn.cos(), p.y * turn.sin(), p.x)).collect()
        };
        let [hub, shroud] = [curve(&self.walls[0]), curve(&self.walls[1])];
        let sector = thickness.map(|thickness| alone(self.n_blades, thickness));
        Endwalls { axis: Vector3::z_axis(), hub, shroud, hub_sector: sector }
    }

    fn loft(&self) -> BladeLoft {
        BladeLoft::new(&self.blade, |p| p.z).unwrap()
    }
}

/// The sector of a blade that is no part of a set.
fn alone(n_blades: u32, thickness: f64) -> HubSector {
    HubSector { n_blades, thickness, set: None }
}

fn group_vertices(blade: &LoftedBlade, names: &[&str]) -> BTreeSet<u32> {
    let of = |name: &&str| kit::group(&blade.mesh, name).flat_map(|t| blade.mesh.triangles()[t]).collect::<Vec<_>>();
    names.iter().flat_map(of).collect()
}

const SIDES: [&str; 4] = ["suction", "pressure", "leading-edge", "trailing-edge"];

fn names(blade: &LoftedBlade) -> Vec<&str> {
    blade.mesh.groups().iter().map(|g| &*g.name).collect()
}

#[test]
fn blades_end_on_their_walls_and_keep_their_points_between() {
    let mut random = Random(2_301);
    for round in 0..16 {
        let given = random_annulus(&mut random, round % 2 == 1);
        let walls = given.endwalls(&mut random, None);
        let tolerance = 0.02;
        let blade = given.loft().mesh_between(&walls, tolerance).unwrap();
        let what = format!("round {round}");
        assert!(kit::is_closed(&blade.mesh) && kit::volume(&blade.mesh) > 0.0, "{what}");
        assert_eq!(blade.ends, [LoftEnd::Wall; 2], "{what}");
        assert_eq!(names(&blade), [&SIDES[..], &["tip", "root"]].concat(), "{what}");
        let sides = group_vertices(&blade, &SIDES);
        let vertices = blade.mesh.vertices();
        for (end, wall) in [("root", &given.walls[0]), ("tip", &given.walls[1])] {
            let cap = group_vertices(&blade, &[end]);
            let border: Vec<_> = cap.intersection(&sides).collect();
            assert!(border.len() > 20);
            for &v in &cap {
                let off = above(wall, &vertices[v as usize]);
                assert!(off.abs() < 1e-8, "{what}: {end} is {off} mm off its wall");
            }
            // Facets of the end, too.
            for t in kit::group(&blade.mesh, end) {
                let [a, b, c] = blade.mesh.corners(t);
                for p in [nalgebra::center(&a, &b), nalgebra::center(&b, &c), nalgebra::center(&c, &a)] {
                    assert!(above(wall, &p).abs() < 1.2 * tolerance, "{what}: {end}: {}", above(wall, &p));
                }
            }
        }
        for p in sides.iter().map(|&v| &vertices[v as usize]) {
            assert!(above(&given.walls[0], p) > -1e-8 && above(&given.walls[1], p) < 1e-8, "{what}: {p}");
        }
        // Points between the walls are vertices, and all others are gone.
        let mut n_kept = 0;
        for p in given.blade.sections.iter().flatten() {
            let heights = [above(&given.walls[0], p), -above(&given.walls[1], p)];
            let nearest = vertices.iter().map(|v| (v - p).norm()).fold(f64::INFINITY, f64::min);
            if heights[0].min(heights[1]) > 0.01 {
                assert!(nearest < 1e-9, "{what}: {nearest} mm off a point");
                n_kept += 1;
            } else if heights[0].min(heights[1]) < -0.01 {
                assert!(nearest > 1e-3, "{what}");
            }
        }
        assert!(n_kept >= given.blade.sections[0].len(), "{what}");
        assert_eq!(
            blade.mesh,
            given.loft().mesh_between(&walls, tolerance).unwrap().mesh,
            "{what}: the same each time"
        );
    }
}

#[test]
fn a_cut_blade_is_the_same_surface_as_the_whole_one() {
    let mut random = Random(2_302);
    for round in 0..4 {
        let given = random_annulus(&mut random, round % 2 == 1);
        let cut = given.loft().mesh_between(&given.endwalls(&mut random, None), 0.02).unwrap();
        let whole = given.loft().mesh(0.005).unwrap();
        let runs = kit::TriangleRuns::of(&whole.mesh);
        let sides = group_vertices(&cut, &SIDES);
        let points = sides.iter().step_by(19).map(|&v| &cut.mesh.vertices()[v as usize]);
        let worst = points.map(|p| runs.distance(p)).fold(0.0, f64::max);
        assert!(worst < 0.006, "round {round}: {worst}");
        // And facets of the cut one are within its tolerance, seen from points of the finer one.
        let runs = kit::TriangleRuns::of(&cut.mesh);
        let is_between = |p: &&Point3<f64>| above(&given.walls[0], p) > 0.1 && above(&given.walls[1], p) < -0.1;
        let far =
            whole.mesh.vertices().iter().step_by(23).filter(is_between).map(|p| runs.distance(p)).fold(0.0, f64::max);
        assert!(far < 0.025, "round {round}: {far}");
    }
}

#[test]
fn cut_blades_and_their_hubs_do_not_cut_themselves() {
    let mut random = Random(2_303);
    for (round, thickness) in [None, Some(2.0), Some(5.0)].into_iter().enumerate() {
        let given = random_annulus(&mut random, round == 1);
        let blade = given.loft().mesh_between(&given.endwalls(&mut random, thickness), 0.2).unwrap();
        let group = |t: usize| blade.mesh.groups().iter().find(|g| g.triangles.contains(&t)).map(|g| &*g.name);
        let found: Vec<_> = kit::self_intersections(&blade.mesh)
            .into_iter()
            .map(|(s, t)| (group(s), group(t), blade.mesh.corners(s), blade.mesh.corners(t)))
            .collect();
        assert!(found.is_empty(), "round {round}: {found:.3?}");
    }
}

/// Area of a sector of the hub: of cones between the polyline's points.
fn sector_area(wall: &[Point2<f64>], n_blades: u32) -> f64 {
    let whole = wall.windows(2).map(|w| std::f64::consts::PI * (w[0].y + w[1].y) * (w[1] - w[0]).norm()).sum::<f64>();
    whole / f64::from(n_blades)
}

fn area(blade: &LoftedBlade, group: &str) -> f64 {
    kit::group(&blade.mesh, group).map(|t| 0.5 * blade.mesh.scaled_normal(t).norm()).sum()
}

#[test]
fn a_hub_is_its_sector_without_the_root() {
    let mut random = Random(2_304);
    for round in 0..6 {
        let given = random_annulus(&mut random, round % 2 == 1);
        let tolerance = 0.01;
        let [alone, on_hub] =
            [None, Some(3.0)].map(|t| given.loft().mesh_between(&given.endwalls(&mut random, t), tolerance).unwrap());
        let what = format!("round {round}");
        assert!(kit::is_closed(&on_hub.mesh), "{what}");
        assert_eq!(names(&on_hub), [&SIDES[..], &["tip", "hub", "hub-ends"]].concat(), "{what}");
        let expected = sector_area(&given.walls[0], given.n_blades) - area(&alone, "root");
        let off = area(&on_hub, "hub") / expected - 1.0;
        assert!(off.abs() < 2e-3, "{what}: {off}");
        for &v in &group_vertices(&on_hub, &["hub"]) {
            let p = &on_hub.mesh.vertices()[v as usize];
            assert!(above(&given.walls[0], p).abs() < 1e-8, "{what}: {p}");
        }
        // The hub faces the flow; what the sector adds is a shell of about its thickness.
        let outward = |t: usize| {
            let [a, b, c] = on_hub.mesh.corners(t);
            let middle = (a.coords + b.coords + c.coords) / 3.0;
            on_hub.mesh.scaled_normal(t).dot(&Vector3::new(middle.x, middle.y, 0.0))
        };
        assert!(kit::group(&on_hub.mesh, "hub").all(|t| outward(t) > 0.0), "{what}");
        let shell = kit::volume(&on_hub.mesh) - kit::volume(&alone.mesh);
        let ratio = shell / (3.0 * sector_area(&given.walls[0], given.n_blades));
        assert!((0.9..1.05).contains(&ratio), "{what}: {ratio}");
        assert_eq!(on_hub.normals.len(), on_hub.mesh.vertices().len());
        // Neighbours meet: turned by a pitch, one side lies on the other.
        let turned =
            nalgebra::Rotation3::from_axis_angle(&Vector3::z_axis(), std::f64::consts::TAU / f64::from(given.n_blades));
        let neighbour = kit::TriangleRuns::of(&on_hub.mesh);
        let ends = group_vertices(&on_hub, &["hub-ends"]);
        let hub = group_vertices(&on_hub, &["hub"]);
        let touching = ends
            .intersection(&hub)
            .filter(|&&v| neighbour.distance(&(turned * on_hub.mesh.vertices()[v as usize])) < 0.02);
        assert!(touching.count() > 4, "{what}");
    }
}

/// Half as long, behind the middle of a blade, and turned by a share of the pitch.
fn splitter_of(given: &Annulus, share: f64) -> BladeSections {
    let turn = share * std::f64::consts::TAU / f64::from(given.n_blades);
    let turned = nalgebra::Rotation3::from_axis_angle(&Vector3::z_axis(), turn);
    let shorter = |section: &Vec<Point3<f64>>| -> Vec<Point3<f64>> {
        let last = section.iter().max_by(|a, b| a.z.total_cmp(&b.z)).unwrap();
        section
            .iter()
            .map(|p| turned * Point3::new(p.x, last.y + 0.5 * (p.y - last.y), last.z + 0.5 * (p.z - last.z)))
            .collect()
    };
    BladeSections { sections: given.blade.sections.iter().map(shorter).collect(), ..given.blade.clone() }
}

/// Sectors of the blades of a set are solids that cover the hub once, together with their roots.
#[test]
fn sectors_of_a_set_cover_the_hub_between_its_blades_once() {
    let mut random = Random(2_308);
    for round in 0..8 {
        let mut given = random_annulus(&mut random, round % 2 == 1);
        given.n_blades = given.n_blades.div_ceil(3);
        let lofts = [given.loft(), BladeLoft::new(&splitter_of(&given, random.between(0.4, 0.6)), |p| p.z).unwrap()];
        let mut walls = given.endwalls(&mut random, None);
        let roots = lofts.each_ref().map(|loft| loft.mesh_between(&walls, 0.05).unwrap());
        let lines = lofts.each_ref().map(|loft| loft.line_on_hub(&walls).unwrap());
        let blades = [0, 1].map(|k| {
            walls.hub_sector =
                Some(HubSector { set: Some(HubSet { lines: lines.to_vec(), own: k }), ..alone(given.n_blades, 3.0) });
            lofts[k].mesh_between(&walls, 0.05).unwrap_or_else(|why| panic!("round {round}, blade {k}: {why}"))
        });
        let area = |blade: &LoftedBlade, name: &str| -> f64 {
            kit::group(&blade.mesh, name).map(|t| 0.5 * blade.mesh.scaled_normal(t).norm()).sum()
        };
        for blade in &blades {
            assert!(kit::is_closed(&blade.mesh) && kit::volume(&blade.mesh) > 0.0, "round {round}");
        }
        let covered: f64 = blades.iter().map(|b| area(b, "hub")).chain(roots.iter().map(|b| area(b, "root"))).sum();
        // A side of the polyline sweeps a cone.
        let cone = |side: &[Point2<f64>]| (side[1] - side[0]).norm() * (side[0].y + side[1].y);
        let whole = std::f64::consts::PI * given.walls[0].windows(2).map(cone).sum::<f64>() / f64::from(given.n_blades);
        assert!((covered / whole - 1.0).abs() < 2e-3, "round {round}: {covered} of {whole} mm2");
        // Each blade has a part of it as wide as its room.
        let shares = blades.each_ref().map(|b| area(b, "hub") / whole);
        assert!(shares.iter().all(|share| *share > 0.2), "round {round}: {shares:?}");
        // A blade at the place of another has no room.
        let twice = HubSet { lines: vec![lines[0].clone(); 2], own: 0 };
        walls.hub_sector = Some(HubSector { set: Some(twice), ..alone(given.n_blades, 3.0) });
        let why = lofts[0].mesh_between(&walls, 0.05).expect_err("two blades at one place");
        assert!(why.to_string().contains("at the same place"), "{why}");
    }
}

#[test]
fn sections_on_a_wall_or_before_it_stay_the_ends() {
    let mut random = Random(2_305);
    let given = random_annulus(&mut random, false);
    let whole = given.loft().mesh(0.02).unwrap();
    let mut walls = given.endwalls(&mut random, None);
    let sections = &given.blade.sections;
    // Cones and cylinders far below the root, and one that touches it at its lowest radius.
    let radii = |k: usize| sections[k].iter().map(|p| p.x.hypot(p.y));
    let [low, high] = [radii(0).fold(f64::INFINITY, f64::min), radii(0).fold(0.0, f64::max)];
    let cylinder = |radius: f64| [-200.0, 200.0].map(|z| Point3::new(0.0, radius, z)).to_vec();
    walls.shroud.clear();
    walls.hub = cylinder(low - 2.5);
    let blade = given.loft().mesh_between(&walls, 0.02).unwrap();
    assert_eq!(blade.mesh, whole.mesh);
    let LoftEnd::SectionBeforeWall { gap_mm } = blade.ends[0] else { panic!("{:?}", blade.ends) };
    assert!((gap_mm - (high - low + 2.5)).abs() < 1e-9 && blade.ends[1] == LoftEnd::Section);
    // No sector of a hub that it does not stand on: the error has the distance and the remedy.
    walls.hub_sector = Some(alone(9, 2.0));
    let why = given.loft().mesh_between(&walls, 0.02).expect_err("no sector");
    assert_eq!(why, LoftError::HubNotReached { gap_mm });
    let text = why.to_string();
    assert!(text.contains(&format!("{gap_mm:.3} mm before the hub")) && text.contains("add a section"), "{text}");
    walls.hub_sector = None;
    // On a wall that is nowhere farther than the tolerance, the section stays as it is.
    let middle = 0.5 * (low + high);
    walls.hub = cylinder(middle);
    let tolerance = 0.5 * (high - low) + 0.01;
    let blade = given.loft().mesh_between(&walls, tolerance).unwrap();
    assert_eq!(blade.ends[0], LoftEnd::SectionOnWall);
    let vertices = blade.mesh.vertices();
    for p in &sections[0] {
        assert!(vertices.iter().any(|v| (v - p).norm() < 1e-9));
    }
}

#[test]
fn natural_coordinates_run_from_root_to_tip_and_from_edge_to_edge() {
    let mut random = Random(2_306);
    for round in 0..4 {
        let given = random_annulus(&mut random, round % 2 == 1);
        let blade = given.loft().mesh_between(&given.endwalls(&mut random, None), 0.05).unwrap();
        let [root, tip] = ["root", "tip"].map(|end| group_vertices(&blade, &[end]));
        let n = blade.coordinates.len();
        assert!(n <= blade.mesh.vertices().len());
        for (v, [span, around]) in blade.coordinates.iter().enumerate() {
            let v = v as u32;
            assert!((0.0..=1.0).contains(span) && (-1.0..=1.0).contains(around));
            assert!((*span == 0.0) == root.contains(&v) && (*span == 1.0) == tip.contains(&v));
        }
        for (group, sign) in [("suction", 1.0), ("pressure", -1.0)] {
            // Off the edges, which have both signs.
            let edges = group_vertices(&blade, &["leading-edge", "trailing-edge"]);
            for v in group_vertices(&blade, &[group]).difference(&edges) {
                let around = blade.coordinates[*v as usize][1];
                assert!(around * sign > 0.0 && around.abs() < 1.0, "{group}: {around}");
            }
        }
        // Between the edges the share grows with the way downstream, and with the way outward.
        let place = |v: &u32| (blade.coordinates[*v as usize], blade.mesh.vertices()[*v as usize]);
        let suction: Vec<_> = group_vertices(&blade, &["suction"]).iter().map(place).collect();
        let by = |k: usize, of: fn(&Point3<f64>) -> f64| {
            let mean = |range: std::ops::Range<f64>| {
                let within: Vec<f64> =
                    suction.iter().filter(|(c, _)| range.contains(&c[k])).map(|(_, p)| of(p)).collect();
                within.iter().sum::<f64>() / within.len() as f64
            };
            mean(0.7..1.1) - mean(-0.1..0.3)
        };
        assert!(by(1, |p| p.z) > 0.0 && by(0, |p| p.x.hypot(p.y)) > 0.0);
    }
}

#[test]
fn walls_that_fit_no_blade_are_refused() {
    let mut random = Random(2_307);
    let given = random_annulus(&mut random, false);
    let good = given.endwalls(&mut random, Some(2.0));
    given.loft().mesh_between(&good, 0.1).unwrap();
    let refused = |change: &dyn Fn(&mut Endwalls)| {
        let mut walls = good.clone();
        change(&mut walls);
        given.loft().mesh_between(&walls, 0.1).expect_err("refused")
    };
    let line = |from: Point3<f64>, to: Point3<f64>| vec![from, to];
    assert!(matches!(refused(&|w| w.hub.truncate(1)), LoftError::WrongWall { wall: "hub", .. }));
    assert!(matches!(refused(&|w| w.shroud[2].x = f64::NAN), LoftError::WrongWall { wall: "shroud", .. }));
    assert!(matches!(refused(&|w| w.hub = vec![]), LoftError::WrongWall { wall: "hub", .. }));
    assert!(matches!(refused(&|w| w.hub = w.shroud.clone()), LoftError::HubNotReached { .. }));
    assert!(matches!(
        refused(&|w| w.axis = Unit::new_normalize(Vector3::new(1.0, 0.0, 0.0))),
        LoftError::WrongWall { .. }
            | LoftError::WallsCross { .. }
            | LoftError::BeforeWall { .. }
            | LoftError::HubNotReached { .. }
    ));
    // A steep cone that meets one edge alone.
    let behind = 0.6 * given.blade.sections.iter().flatten().map(|p| p.z).fold(0.0, f64::max);
    let hub = given.walls[0][0].y;
    let cone = |z: f64| Point3::new(hub + 10.0 * (z - behind), 0.0, z);
    let steep = |w: &mut Endwalls| w.hub = line(cone(behind - 0.1 * (hub - 1.0)), cone(behind + 40.0));
    let why = refused(&steep);
    assert!(matches!(why, LoftError::BeforeWall { wall: "hub", .. } | LoftError::WallsCross { .. }), "{why}");
    let dense = |w: &mut Endwalls| w.shroud = (0..6000).map(|k| Point3::new(300.0, 0.0, f64::from(k))).collect();
    assert!(matches!(refused(&dense), LoftError::WrongWall { wall: "shroud", .. }));
    let single = |w: &mut Endwalls| w.hub_sector = Some(alone(1, 2.0));
    let through_axis = |w: &mut Endwalls| w.hub_sector = Some(alone(9, 500.0));
    let nose = |w: &mut Endwalls| w.hub.insert(0, Point3::new(0.0, 0.0, w.hub[0].z - 200.0));
    for why in [refused(&single), refused(&through_axis), refused(&nose)] {
        assert!(matches!(why, LoftError::NoSector { .. }), "{why}");
    }
    let many = |w: &mut Endwalls| w.hub_sector = Some(alone(900, 2.0));
    assert!(matches!(refused(&many), LoftError::NoSector { .. }));
    let short = |w: &mut Endwalls| w.hub.truncate(5);
    assert!(matches!(refused(&short), LoftError::NoSector { .. }));
}

/// A hub's curve with a corner at the blade's edge, as exports have it, gives a sector.
#[test]
fn a_corner_of_the_hub_at_an_edge_of_the_blade_is_no_fault() {
    let mut random = Random(2_311);
    for round in 0..6 {
        let given = random_annulus(&mut random, round % 2 == 1);
        let walls = given.endwalls(&mut random, Some(2.0));
        let blade = given.loft().mesh_between(&walls, 0.1).unwrap();
        let on_hub = group_vertices(&blade, &SIDES);
        let on_hub = on_hub.iter().map(|&v| blade.mesh.vertices()[v as usize]);
        let z: Vec<f64> = on_hub.filter(|p| above(&given.walls[0], p).abs() < 1e-8).map(|p| p.z).collect();
        let ends = [z.iter().copied().fold(f64::INFINITY, f64::min), z.iter().copied().fold(-f64::INFINITY, f64::max)];
        for end in ends {
            for off in [-1e-9, 0.0, 1e-9] {
                let mut with_corner = walls.clone();
                let at = end + off;
                let corner = Point3::new(radius_at(&given.walls[0], at), 0.0, at);
                let k = with_corner.hub.iter().position(|p| p.z > at).unwrap();
                with_corner.hub.insert(k, corner);
                let same =
                    given.loft().mesh_between(&with_corner, 0.1).unwrap_or_else(|e| panic!("round {round}: {e}"));
                assert!(kit::is_closed(&same.mesh), "round {round}");
            }
        }
    }
}

/// Hub and shroud of an impeller are arcs in the meridional plane: the mean of a blade's points is
/// beyond the shroud, and the blade is still on the inner side of both.
#[test]
fn an_impellers_blade_is_between_its_walls() {
    let around = |bend: f64, phi: f64| Point2::new(bend * phi.sin(), 100.0 - bend * phi.cos());
    let [hub, shroud] = [64.5, 55.5];
    let section = |k: i32| -> Vec<Point3<f64>> {
        let bend = hub + 1.0 - f64::from(k) * (hub - shroud + 2.0) / 3.0;
        (0..80)
            .map(|j| {
                let (sin, cos) = (f64::from(j) * std::f64::consts::TAU / 80.0).sin_cos();
                let place = around(bend, 0.8 - 0.65 * cos);
                let angle = 0.05 * sin;
                Point3::new(place.y * angle.cos(), place.y * angle.sin(), place.x)
            })
            .collect()
    };
    let given = BladeSections { sections: (0..4).map(section).collect(), ..BladeSections::default() };
    let wall = |bend: f64| {
        (0..=60).map(|k| around(bend, 0.03 * f64::from(k) - 0.1)).map(|p| Point3::new(p.y, 0.0, p.x)).collect()
    };
    let walls = Endwalls { axis: Vector3::z_axis(), hub: wall(hub), shroud: wall(shroud), hub_sector: None };
    let blade = BladeLoft::new(&given, |p| p.z).unwrap().mesh_between(&walls, 0.02).unwrap();
    assert!(kit::is_closed(&blade.mesh) && blade.ends == [LoftEnd::Wall; 2], "{:?}", blade.ends);
    for &v in &group_vertices(&blade, &SIDES) {
        let p = blade.mesh.vertices()[v as usize];
        let bend = p.z.hypot(100.0 - p.x.hypot(p.y));
        // Polylines in place of the arcs are off them by 0.01 mm.
        assert!((shroud - 0.02..hub + 0.02).contains(&bend), "{bend}");
    }
}

#[test]
fn samples_take_as_many_vertices_at_a_larger_scale() {
    for name in ["rotor37/BladeGen.inf", "hannover_rotor1/1_Rotor1_Blade.inf"] {
        let Some((file, given)) = kit::shared_blade(name) else { continue };
        let n_vertices = |scale: f64| {
            let scaled = |points: &[Point3<f64>]| points.iter().map(|p| p * scale).collect::<Vec<_>>();
            let sections = given.sections.iter().map(|section| scaled(section)).collect();
            let loft = BladeLoft::new(&BladeSections { sections, ..given.clone() }, |p| file.downstream(p)).unwrap();
            let axis = Unit::new_normalize(file.axis.direction());
            let walls = Endwalls { axis, hub: scaled(&file.hub), shroud: scaled(&file.shroud), hub_sector: None };
            loft.mesh_between(&walls, 0.02).unwrap().mesh.vertices().len()
        };
        // Chords grow with the scale, and the divisions with their root in both directions.
        let [one, eight] = [1.0, 8.0].map(n_vertices);
        assert!(eight < 12 * one, "{name}: {one}, {eight}");
    }
}

#[test]
fn samples_end_on_hub_and_shroud() {
    for (name, ends, n_blades) in [
        ("rotor37/BladeGen.inf", [LoftEnd::SectionOnWall; 2], 36),
        ("hannover_rotor1/1_Rotor1_Blade.inf", [LoftEnd::Wall; 2], 23),
    ] {
        let Some((file, given)) = kit::shared_blade(name) else { continue };
        let loft = BladeLoft::new(&given, |p| file.downstream(p)).unwrap();
        let meridional =
            |curve: &[Point3<f64>]| -> Vec<_> { curve.iter().map(|p| Point2::new(p.z, p.x.hypot(p.y))).collect() };
        let [hub, shroud] = [&file.hub, &file.shroud].map(|curve| meridional(curve));
        for sector in [None, Some(alone(n_blades, 2.0))] {
            let axis = Unit::new_normalize(file.axis.direction());
            let walls =
                Endwalls { axis, hub: file.hub.clone(), shroud: file.shroud.clone(), hub_sector: sector.clone() };
            let blade = loft.mesh_between(&walls, if sector.is_some() { 0.05 } else { 0.01 }).unwrap();
            assert!(kit::is_closed(&blade.mesh) && blade.ends == ends, "{name}: {:?}", blade.ends);
            let sides = group_vertices(&blade, &SIDES);
            let mut range = [[f64::INFINITY, f64::NEG_INFINITY]; 2];
            for p in sides.iter().map(|&v| &blade.mesh.vertices()[v as usize]) {
                for (range, height) in range.iter_mut().zip([above(&hub, p), -above(&shroud, p)]) {
                    *range = [range[0].min(height), range[1].max(height)];
                }
            }
            let mut off = 0.0_f64;
            let is_between = |p: &&Point3<f64>| above(&hub, p) > 0.06 && above(&shroud, p) < -0.06;
            for p in given.sections.iter().flatten().filter(is_between).step_by(if sector.is_some() { 31 } else { 3 }) {
                off = off.max(blade.mesh.vertices().iter().map(|v| (v - p).norm()).fold(f64::INFINITY, f64::min));
            }
            println!(
                "{name}: {} triangles, lowest {:.4} mm above the hub, {:.4} mm below the shroud, {off:.1e} mm off points",
                blade.mesh.triangles().len(),
                range[0][0],
                range[1][0]
            );
            assert!(off < 1e-6 && range.iter().all(|[low, _]| *low > -0.051), "{name}");
        }
    }
}
