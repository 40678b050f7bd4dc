//! Comparison of the cut stock with the part: figures, and the part's surface in colours.

mod colours;
mod cusps;
mod figures;
mod stock_places;

use std::collections::HashMap;
use std::collections::hash_map::Entry;

use facemill_job::failure::Failure;
use facemill_job::format::program_stamp::ProgramStamp;
use facemill_job::format::report::deviation::{DeviationPlace, DeviationReport};
use facemill_job::load::job::{Job, Setup};
use facemill_job::load::obstacle_meshes::ObstacleRole;
use facemill_job::setup::cell::largest_left;
use facemill_job::stages::Stages;
use facemill_nc_program::ReadProgram;
use facemill_surface_model::{Refined, Surface, SurfaceSettings, TriMesh, write_painted_glb};
use facemill_virtual_machine::VirtualSetup;
use facemill_z_map::{DeviationError, DexelMap};
use nalgebra::Point3;
use rayon::prelude::*;

use crate::deviation::colours::colour;
use crate::deviation::cusps::{CuspScene, cusps};
use crate::deviation::figures::{Condition, Patch, beyond, deviation_figures, drive_triangles};
use crate::deviation::stock_places::StockPlaces;

/// Options of a deviation report.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DeviationRequest {
    /// Largest deviation within tolerance, mm; `None`: the largest height that one of the setup's
    /// operations may leave ([`largest_left`]).
    pub tolerance: Option<f64>,
    /// Also write the part's surface in colours.
    pub painted: bool,
    /// Counts as cut all that the setup's stock lost, in place of what the program takes alone:
    /// after the last of several programs.
    pub since_stock: bool,
}

/// Largest number of triangles of the surface for areas and colours: about 100 MB of GLB.
const MAX_PATCHES: usize = 2_000_000;

/// Stock before and after a program, and the accuracy of its cutting.
pub struct CutStock<'a> {
    /// Program.
    pub program: &'a ReadProgram,
    /// The program, as the painted file names it.
    pub stamp: &'a ProgramStamp,
    /// Setups of the run, one for each head.
    pub heads: &'a [&'a VirtualSetup<'a>],
    /// Stock before and after the program, on the lines of each direction; all with the same
    /// distance between them, `cell` mm.
    pub lines: &'a [[&'a DexelMap; 2]],
    /// Distance of the lines, mm.
    pub cell: f64,
    /// Tolerance of the cut, mm.
    pub tolerance: f64,
    /// Least depth of a gouge that is a finding, mm.
    pub gouge_limit: f64,
}

/// Compares the cut stock with the setup's part; returns the GLB, too, if requested.
///
/// # Errors
/// If the tolerance is no length, the part cannot be measured or painted, or the stages are
/// cancelled.
pub fn deviation_of(
    job: &Job,
    setup: &Setup<'_>,
    stock: &CutStock<'_>,
    request: &DeviationRequest,
    stages: &dyn Stages,
) -> Result<(DeviationReport, Option<Vec<u8>>), Failure> {
    let uncertainty_mm = 2.0 * stock.tolerance;
    let tolerance_mm = request
        .tolerance
        .unwrap_or_else(|| job.operations_of(setup.file).map(|(_, o)| largest_left(job, o)).fold(0.0, f64::max));
    if !(tolerance_mm > 0.0 && tolerance_mm.is_finite()) {
        return Err(job.wrong("the tolerance of the deviation must be a length above 0 mm"));
    }
    let Workpiece { surface: part, allowances, is_part } = workpiece(setup);
    let n_tiles = stock.lines.iter().map(|[_, now]| now.n_tiles()).sum();
    let monitor = stages.start("deviation from the part", n_tiles);
    let found = StockPlaces::of(stock.lines, &part, &*monitor).map_err(|e| match e {
        DeviationError::Cancelled(_) => Failure::Interrupted,
        other => job.wrong(format!("setup \"{}\": {other}", setup.file.name)),
    })?;
    drop(monitor);
    let is_drive = drive_triangles(&part, &setup.drive);
    let fine = refined(&part, &is_part, stock.cell);
    // The setup's own stock may end below the surface; of other stock a program before may have cut
    // too deep.
    let lacks = request.since_stock.then_some(tolerance_mm);
    let patches = patches(&part, &fine, &found, (&allowances, lacks), &is_drive);
    let all_places = || found.all().map(|p| beyond(p, &allowances, lacks));
    let places = || all_places().filter(|p| is_part[p.triangle as usize]);
    let limit = stock.gouge_limit + uncertainty_mm;
    let cavity = found.deepest_cavity();
    let scene = CuspScene {
        part: &part,
        allowances: &allowances,
        found: &found,
        cell: stock.cell,
        uncertainty: uncertainty_mm,
        tolerance: tolerance_mm,
    };
    let accuracy = [tolerance_mm, uncertainty_mm];
    let report = DeviationReport {
        tolerance_mm,
        uncertainty_mm,
        exceeds_gouge_limit: all_places().any(|p| p.is_cut && p.deviation < -limit),
        drive: deviation_figures(
            places().filter(|p| is_drive[p.triangle as usize]),
            patches.iter().copied().filter(|p| p.is_drive),
            accuracy,
        ),
        part: deviation_figures(places(), patches.iter().copied(), accuracy),
        cavity: cavity.map(|c| DeviationPlace { value_mm: c.depth, at_mm: c.position.into() }),
        cusps: cusps(stock.program, stock.heads, &scene),
    };
    let painted = request.painted.then(|| {
        let colours = colours(&fine, &patches, accuracy);
        let name = format!("deviation of {}", stock.stamp.text());
        write_painted_glb(&name, &fine.mesh, &colours).map_err(|e| Failure::Internal(format!("deviation: {e}")))
    });
    Ok((report, painted.transpose()?))
}

/// Surface that the stock is to become.
struct Workpiece {
    surface: Surface,
    /// Allowance on each triangle, mm; 0 on check surfaces, whose allowance is the cutter's
    /// distance.
    allowances: Vec<f64>,
    /// Whether each triangle belongs to a part rather than a check surface.
    is_part: Vec<bool>,
}

/// Joins all part and check surfaces of a setup: a hub with blades is no stock on them. A surface
/// that a job names twice, as the cut side and with the whole part, is included once with the
/// larger allowance: twice, the part would not be closed.
fn workpiece(setup: &Setup<'_>) -> Workpiece {
    let mut mesh = TriMesh::default();
    let mut of_triangle = Vec::new();
    // Parts first: a triangle of both is part.
    for role in [ObstacleRole::Part, ObstacleRole::Check] {
        for obstacle in setup.obstacles.iter().filter(|o| o.role == role) {
            mesh = mesh.joined(&obstacle.mesh);
            let is_part = role == ObstacleRole::Part;
            of_triangle.resize(mesh.triangles().len(), (if is_part { obstacle.allowance } else { 0.0 }, is_part));
        }
    }
    // Equal positions become one vertex, so that the sides are connected.
    let mut places: HashMap<[u64; 3], u32> = HashMap::new();
    let welded: Vec<u32> = mesh
        .vertices()
        .iter()
        .zip(0..)
        .map(|(p, k)| *places.entry([p.x, p.y, p.z].map(f64::to_bits)).or_insert(k))
        .collect();
    let mut known: HashMap<[u32; 3], usize> = HashMap::new();
    let (mut triangles, mut allowances, mut parts) = (Vec::new(), Vec::<f64>::new(), Vec::new());
    for (triangle, (allowance, is_part)) in mesh.triangles().iter().zip(of_triangle) {
        let corners = triangle.map(|v| welded[v as usize]);
        // Starts at the lowest corner: the same triangle with the same winding has the same key.
        let mut key = corners;
        key.rotate_left((0..3).min_by_key(|&c| corners[c]).unwrap_or(0));
        match known.entry(key) {
            Entry::Occupied(at) => allowances[*at.get()] = allowances[*at.get()].max(allowance),
            Entry::Vacant(new) => {
                new.insert(triangles.len());
                triangles.push(corners);
                allowances.push(allowance);
                parts.push(is_part);
            }
        }
    }
    let mesh = TriMesh::new(mesh.vertices().to_vec(), triangles).unwrap_or_default();
    Workpiece { surface: Surface::new(mesh, SurfaceSettings::default()), allowances, is_part: parts }
}

/// Divides the part's triangles into small ones, whose parents are the workpiece's.
fn refined(workpiece: &Surface, is_part: &[bool], edge: f64) -> Refined {
    let mesh = workpiece.mesh();
    let of_part: Vec<u32> = (0..is_part.len() as u32).filter(|&t| is_part[t as usize]).collect();
    // Only its own vertices, so that viewers see its bounds.
    let (mut vertices, mut number) = (Vec::new(), vec![None; mesh.vertices().len()]);
    let mut numbered = |v: u32| {
        *number[v as usize].get_or_insert_with(|| {
            vertices.push(mesh.vertices()[v as usize]);
            vertices.len() as u32 - 1
        })
    };
    let triangles = of_part.iter().map(|&t| mesh.triangles()[t as usize].map(&mut numbered)).collect();
    let part = TriMesh::new(vertices, triangles).unwrap_or_default();
    let mut fine = part.refined(edge, MAX_PATCHES);
    fine.parents.iter_mut().for_each(|parent| *parent = of_part[*parent as usize]);
    fine
}

/// Returns the small triangles, each with the place nearest to its middle.
fn patches(
    part: &Surface,
    fine: &Refined,
    found: &StockPlaces<'_>,
    (allowances, lacks): (&[f64], Option<f64>),
    is_drive: &[bool],
) -> Vec<Patch> {
    let patch = |k: usize| {
        let parent = fine.parents[k];
        let [a, b, c] = fine.mesh.corners(k).map(|p| p.coords);
        let middle = Point3::from((a + b + c) / 3.0);
        let normal = part.facet_normal(parent);
        let place = normal.and_then(|n| found.near(&middle, &n)).map(|p| beyond(p, allowances, lacks));
        Patch { area: 0.5 * fine.mesh.scaled_normal(k).norm(), is_drive: is_drive[parent as usize], place }
    };
    (0..fine.parents.len()).into_par_iter().map(patch).collect()
}

/// Returns the colour of each vertex: the mean of the triangles around it by area.
fn colours(fine: &Refined, patches: &[Patch], accuracy: [f64; 2]) -> Vec<[u8; 3]> {
    let mut sums = vec![[0.0_f64; 4]; fine.mesh.vertices().len()];
    for (triangle, patch) in fine.mesh.triangles().iter().zip(patches) {
        let colour = colour(Condition::of(patch.place.as_ref(), accuracy), accuracy[0]);
        for &v in triangle {
            let sum = &mut sums[v as usize];
            (0..3).for_each(|k| sum[k] += patch.area * f64::from(colour[k]));
            sum[3] += patch.area;
        }
    }
    // A vertex without area around it is invisible.
    sums.iter().map(|s| [0, 1, 2].map(|k| if s[3] > 0.0 { (s[k] / s[3]).round() as u8 } else { 0 })).collect()
}
