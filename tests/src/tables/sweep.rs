//! Verdicts of the mesh tree against those of [`Touchable`] on seeded postures.

use facemill::cl_data::{RoundBox, RoundFrustum, Solid};
use facemill::interference::{Interference, MeshTree, lift_to_free};
use facemill::sample_parts::{
    BladeResolution, PatchSpec, PropellerSeries, PropellerSpec, RotorResolution, blade, blade_pose, hub, patch, rotor37,
};
use facemill::surface_model::TriMesh;
use facemill_test_kit::{Random, soup_mesh};
use nalgebra::{Isometry3, Translation3, Unit, UnitQuaternion, Vector3};

use crate::oracles::touch::Touchable;
use crate::shared::shared;

/// The kinds of bodies that are swept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A cutter with a sharp corner.
    Flat,
    /// A cutter with a round corner.
    Torus,
    /// A ball-nosed cutter.
    Ball,
    /// A holder's section with clearance or without, wider above or below.
    Frustum,
    /// A head.
    Box,
}

impl Kind {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::Flat, Self::Torus, Self::Ball, Self::Frustum, Self::Box];

    /// A body of the kind, sized for a part of `size` mm across.
    fn solid(self, size: f64, random: &mut Random) -> Solid {
        let radius = size * random.between(0.02, 0.2);
        let height = size * random.between(0.05, 0.4);
        let clearance = if random.below(2) == 0 { 0.0 } else { random.between(0.0, 0.02) * size };
        let frustum = |z_low, z_high, radius_low, radius_high, rounding| {
            Solid::Frustum(RoundFrustum { z_low, z_high, radius_low, radius_high, rounding })
        };
        match self {
            Self::Flat => frustum(0.0, height, radius, radius, 0.0),
            Self::Torus => {
                let corner = radius * random.between(0.02, 0.5);
                frustum(corner, corner + height, radius - corner, radius - corner, corner)
            }
            Self::Ball => frustum(radius, radius + height, 0.0, 0.0, radius),
            Self::Frustum => frustum(clearance, clearance + height, radius, size * random.between(0.0, 0.2), clearance),
            Self::Box => {
                let half_extents = Vector3::from([0; 3].map(|_| size * random.between(0.02, 0.2)));
                Solid::Box(RoundBox { half_extents, rounding: clearance })
            }
        }
    }
}

/// Result of a sweep.
#[derive(Clone, Debug, Default)]
pub struct Tally {
    /// Postures.
    pub postures: usize,
    /// Of them, hits.
    pub hits: usize,
    /// Of them, bodies that touch nothing and are inside a closed component.
    pub inside: usize,
    /// Of them, within 1e-6 mm of touching.
    pub grazing: usize,
    /// Verdicts that are not those of brute force, but are those of a body larger or smaller by
    /// 1e-9 mm, the band that the tree says it has.
    pub in_band: usize,
    /// Postures of which brute force cannot tell: a sharp body touches along a line, to less than
    /// any step of it.
    pub undecided: usize,
    /// All other differences.
    pub wrong: Vec<String>,
}

impl Tally {
    fn add(&mut self, other: Self) {
        self.postures += other.postures;
        self.hits += other.hits;
        self.inside += other.inside;
        self.grazing += other.grazing;
        self.in_band += other.in_band;
        self.undecided += other.undecided;
        self.wrong.extend(other.wrong);
    }
}

/// Band of the tree's verdicts, mm.
const BAND: f64 = 1e-9;

/// Compares `n` seeded postures of a kind of body on a mesh, on `threads` threads; the result does
/// not depend on their number.
///
/// # Panics
/// On an empty mesh.
pub fn sweep(mesh: &TriMesh, kind: Kind, n: usize, threads: usize) -> Tally {
    const CHUNK: usize = 250;
    let (tree, brute) = (MeshTree::new(mesh), Touchable::new(mesh));
    let chunks: Vec<usize> = (0..n.div_ceil(CHUNK)).collect();
    let run = |chunk: usize| {
        let mut random = Random(1_000 * chunk as u64 + kind as u64);
        let mut tally = Tally::default();
        (0..CHUNK.min(n - CHUNK * chunk)).for_each(|_| compare(&tree, &brute, kind, &mut random, &mut tally));
        tally
    };
    let mut total = Tally::default();
    let share = |k: usize| chunks.iter().skip(k).step_by(threads.max(1)).map(|&c| run(c)).collect::<Vec<_>>();
    std::thread::scope(|scope| {
        let share = &share;
        let workers: Vec<_> = (0..threads.max(1)).map(|k| scope.spawn(move || share(k))).collect();
        for worker in workers {
            worker.join().expect("a worker has no reason to panic").into_iter().for_each(|t| total.add(t));
        }
    });
    total
}

fn compare(tree: &MeshTree, brute: &Touchable, kind: Kind, random: &mut Random, tally: &mut Tally) {
    // One in eight is so small that it has room inside a blade.
    let part = if random.below(8) == 0 { 0.02 * brute.size() } else { brute.size() };
    let solid = kind.solid(part, random);
    let (pose, is_grazing) = posture(tree, brute, &solid, random);
    let found = !tree.verdict(&solid, &pose, None).is_free();
    tally.postures += 1;
    tally.grazing += usize::from(is_grazing);
    let Some(touches) = brute.touches(&solid, &pose, 0.0) else {
        tally.undecided += 1;
        return;
    };
    let is_inside = !touches && brute.contains(&(pose * solid.interior_point()), &random.direction());
    tally.hits += usize::from(touches || is_inside);
    tally.inside += usize::from(is_inside);
    if found == (touches || is_inside) {
        return;
    }
    if brute.touches(&solid, &pose, BAND) != Some(false) && brute.touches(&solid, &pose, -BAND) != Some(true) {
        tally.in_band += 1;
    } else {
        tally.wrong.push(format!("{solid:?} at {pose:?}: found hit {found}, touches {touches}, inside {is_inside}"));
    }
}

/// A posture over a random point of the surface, and whether it is within 1e-6 mm of touching.
///
/// Half of them are lifted along the surface's normal until they are free (where they are not, or
/// not within the part's size, they stay), and then moved by an offset: none, up to 1e-6 mm, up to
/// a size of real gouges, or anything.
fn posture(tree: &MeshTree, brute: &Touchable, solid: &Solid, random: &mut Random) -> (Isometry3<f64>, bool) {
    let triangles = brute.triangles();
    let [a, b, c] = triangles[random.below(triangles.len())];
    let (u, v) = (random.between(0.0, 1.0), random.between(0.0, 1.0));
    let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
    let point = a + (b - a) * u + (c - a) * v;
    let normal = Unit::try_new((b - a).cross(&(c - a)), 1e-12).unwrap_or_else(|| random.direction());
    let turn = turn(&normal, random);
    let beside = turn * Vector3::from([0; 3].map(|_| random.between(-0.1, 0.1))) * brute.size();
    let place = point + beside * f64::from(u8::from(random.below(2) == 0));
    let pose = Isometry3::from_parts(Translation3::from(place.coords), turn);
    if random.below(4) == 0 {
        let reach = [0.3, 0.03][random.below(2)] * brute.size();
        return (Translation3::from(normal.into_inner() * random.between(-reach, reach)) * pose, false);
    }
    let Some(lift) = lift_to_free(tree, solid, &pose, normal, brute.size(), 1e-9) else { return (pose, false) };
    let offset = match random.below(6) {
        // Brute force cannot tell of a sharp body that just touches.
        0 if solid.rounding() > 0.0 => 0.0,
        0..=2 => random.between(-1e-6, 1e-6),
        3 => random.between(-1e-7, 1e-7),
        4 => random.between(-1e-2, 1e-2),
        _ => random.between(-1e-2, 1e-2) * brute.size(),
    };
    let is_grazing = lift > 0.0 && offset.abs() <= 1e-6;
    (Translation3::from(normal.into_inner() * (lift + offset)) * pose, is_grazing)
}

/// Upright, along a coordinate axis, along the normal, tilted from it by little, or any.
fn turn(normal: &Unit<Vector3<f64>>, random: &mut Random) -> UnitQuaternion<f64> {
    let onto = |axis: &Unit<Vector3<f64>>| {
        UnitQuaternion::rotation_between_axis(&Vector3::z_axis(), axis)
            .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI))
    };
    match random.below(8) {
        0 => UnitQuaternion::identity(),
        1 => {
            let axis = [Vector3::x_axis(), Vector3::y_axis(), -Vector3::x_axis(), -Vector3::z_axis()][random.below(4)];
            onto(&axis)
        }
        2 => onto(normal),
        3..=5 => {
            let tilt = random.between(0.0, 0.3);
            UnitQuaternion::from_axis_angle(&random.direction(), tilt) * onto(normal)
        }
        _ => random.motion(0.0).rotation,
    }
}

/// The parts of the sweep by name: patch, propeller, its hub alone, and rotor blade from their
/// tables (about 200,000 triangles each when `is_full`, some hundreds otherwise), a soup of awkward
/// triangles, and every mesh of the shared data that is there.
///
/// # Panics
/// When a mesh of the shared data cannot be read.
pub fn parts(is_full: bool) -> Vec<(String, TriMesh)> {
    let spec = PatchSpec::new([200.0, 200.0], 15.0, [1.1, 1.0]).expect("numbers are in range");
    let n = if is_full { 316 } else { 14 };
    let mut parts = vec![("patch".to_owned(), patch(&spec, n, n).expect("numbers are in range"))];
    let (radial, chord_tolerance) = if is_full { ((100, 110), 0.05) } else { ((8, 10), 4.0) };
    parts.push(("propeller".to_owned(), propeller(radial, chord_tolerance)));
    // Thick enough for bodies of every kind inside.
    let spec = PropellerSpec::new(PropellerSeries::Dtmb4119, 500.0).expect("numbers are in range");
    parts.push(("hub".to_owned(), hub(&spec, 0.1 * chord_tolerance).expect("numbers are in range")));
    let (span, between) = if is_full { (200, 8) } else { (6, 1) };
    parts.push(("rotor 37".to_owned(), rotor37(RotorResolution::new(span, between).expect("numbers are in range"))));
    // Slivers, points, edges, doubles, level ones, large ones.
    let (vertices, triangles) = soup_mesh(&mut Random(77), if is_full { 3000 } else { 200 }, [60.0, 15.0]);
    parts.push(("soup".to_owned(), TriMesh::new(vertices, triangles).expect("indices are in range")));
    let folder = shared("data/meshes").and_then(|f| std::fs::read_dir(f).ok());
    let mut files: Vec<_> = folder.into_iter().flatten().filter_map(|e| e.ok().map(|e| e.path())).collect();
    files.sort();
    for file in files {
        let name = file.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        let mesh = facemill::read_mesh(&file, None, None).unwrap_or_else(|e| panic!("{name}: {e}")).mesh;
        parts.push((name, mesh));
    }
    parts
}

/// Hub and all blades of DTMB 4119.
fn propeller((n_radial, n_chord): (usize, usize), chord_tolerance: f64) -> TriMesh {
    let spec = PropellerSpec::new(PropellerSeries::Dtmb4119, 500.0).expect("numbers are in range");
    let one = blade(&spec, BladeResolution::new(n_radial, n_chord).expect("numbers are in range"));
    let hub = hub(&spec, chord_tolerance).expect("numbers are in range");
    (0..spec.n_blades()).fold(hub, |all, k| all.joined(&one.transformed(&blade_pose(&spec, k))))
}
