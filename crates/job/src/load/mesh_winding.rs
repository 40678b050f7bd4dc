//! Check that the mesh files of a setup are wound outward.

use facemill_surface_model::{Surface, Winding};
use facemill_tool_model::ToolAssembly;
use nalgebra::{Point3, Unit, UnitQuaternion, Vector3};

use crate::failure::Failure;
use crate::load::job::{Job, Setup};
use crate::load::mesh_files::FileKey;

/// Fraction of the places in front of a piece from which the tool must lack room, so that the piece
/// is not the wall of a hollow.
const NO_ROOM: f64 = 0.9;

/// Triangles of a piece at which room for the tool is sought, and directions of its axis.
const PLACES: usize = 100;

const DIRECTIONS: usize = 64;

/// Distance of a ray's start from the surface, mm, so that it does not meet its own triangle.
const OFF: f64 = 1e-4;

/// Least space that a tool needs in any posture, mm.
#[derive(Clone, Copy)]
struct ToolRoom {
    /// Along the normal of the cut surface: its diameter, or its length if that is less.
    across: f64,
    /// Along its axis.
    length: f64,
}

impl ToolRoom {
    /// Returns the room of the smallest of a job's tools.
    fn of(job: &Job) -> Self {
        let least = |of: &dyn Fn(&ToolAssembly) -> f64| job.all_tools().map(of).fold(f64::INFINITY, f64::min);
        let length = least(&ToolAssembly::gauge_length);
        Self { across: length.min(2.0 * least(&|tool| tool.cutter().radius())), length }
    }
}

/// Triangles of a mesh file by their winding.
#[derive(Default)]
struct FileWinding {
    n_triangles: usize,
    n_inward: usize,
    /// Pieces that are wound inward: their number, then first triangle within the file and number
    /// of triangles of the largest.
    pieces: usize,
    largest: (usize, usize),
    n_hollow: usize,
    n_undecided: usize,
}

/// Refuses meshes that are wound inside out, and returns a line for each mesh whose winding cannot
/// be determined.
///
/// # Errors
/// If a file of the drive surface, or the stock, encloses the space in front of its triangles, and
/// no tool has room there.
pub fn check_winding(job: &Job, setup: &Setup<'_>, index: usize) -> Result<Vec<String>, Failure> {
    check_stock(job, setup, index)?;
    let on_part = (&setup.around_drive, &setup.drive_files);
    let (surface, files) = setup.level.as_ref().map_or(on_part, |level| (&level.part, &level.part_files));
    let found = windings(surface, files, ToolRoom::of(job));
    for ((key, _), winding) in files.iter().zip(&found) {
        if winding.n_inward > 0 {
            let text = inward(&entries(setup, key, &job.setup_key(index)), key, winding);
            // A part named on the command line has no such entry.
            let remedy = if job.file.operations.is_empty() { ", or where the file comes from" } else { "" };
            return Err(job.wrong(format!("{text}{remedy}")));
        }
    }
    let texts = files.iter().zip(&found).filter_map(|((key, _), winding)| undecided(key, winding));
    Ok(texts.collect())
}

fn check_stock(job: &Job, setup: &Setup<'_>, index: usize) -> Result<(), Failure> {
    let Some(stock) = &setup.stock_solid else { return Ok(()) };
    let components = &stock.topology().components;
    let volume: f64 = components.iter().filter_map(|c| c.volume_mm3).sum();
    if components.iter().all(|c| c.closed) && volume < 0.0 {
        return Err(job.wrong(format!(
            "{}.stock.mesh: the stock is wound inside out (its volume is {volume:.0} mm3); turn it with \
             \"reverse_winding\": true",
            job.setup_key(index)
        )));
    }
    Ok(())
}

/// Returns the entries of a job that name a file, as keys.
fn entries(setup: &Setup<'_>, key: &FileKey, at: &str) -> String {
    let of_file = setup.file.meshes.iter().enumerate().filter(|(_, entry)| FileKey::from(*entry) == *key);
    of_file.map(|(k, _)| format!("{at}.meshes[{k}]")).collect::<Vec<_>>().join(", ")
}

fn windings(surface: &Surface, files: &[(FileKey, usize)], room: ToolRoom) -> Vec<FileWinding> {
    let found = surface.orientation();
    let mut of_piece = vec![Vec::new(); found.pieces.len()];
    found.piece_of.iter().enumerate().for_each(|(t, &k)| of_piece[k as usize].push(t));
    let new = |(_, n): &(FileKey, usize)| FileWinding { n_triangles: *n, ..FileWinding::default() };
    let mut windings: Vec<FileWinding> = files.iter().map(new).collect();
    let first: Vec<usize> = files.iter().scan(0, |next, (_, n)| Some(std::mem::replace(next, *next + n))).collect();
    for (piece, triangles) in found.pieces.iter().zip(&of_piece) {
        // Files are not welded to each other, so each piece belongs to one.
        let file = first.partition_point(|first| *first <= piece.first_triangle) - 1;
        let (of_file, n) = (&mut windings[file], piece.n_triangles);
        match piece.winding {
            Winding::Outward => {}
            // The wall of a cavity is rightly wound so.
            Winding::Undecided if piece.closed => {}
            Winding::Undecided => of_file.n_undecided += n,
            Winding::Inward if piece.closed || !has_room(surface, triangles, room) => {
                of_file.n_inward += n;
                of_file.pieces += 1;
                if n > of_file.largest.1 {
                    of_file.largest = (piece.first_triangle - first[file], n);
                }
            }
            Winding::Inward => of_file.n_hollow += n,
        }
    }
    windings
}

/// Returns whether a tool may have room in front of these triangles: at more than a tenth of the
/// places no surface blocks the space that it needs.
fn has_room(surface: &Surface, triangles: &[usize], room: ToolRoom) -> bool {
    let step = triangles.len().div_ceil(PLACES).max(1);
    let (mut places, mut closed) = (0, 0);
    for &t in triangles.iter().step_by(step) {
        let Some(normal) = surface.facet_normal(t as u32) else { continue };
        let [a, b, c] = surface.mesh().corners(t);
        let place = Point3::from((a.coords + b.coords + c.coords) / 3.0) + normal.into_inner() * OFF;
        let meets = |axis: &Unit<Vector3<f64>>, far: f64| surface.ray(&place, axis, far).is_some();
        places += 1;
        closed += usize::from(meets(&normal, room.across) || axes(&normal).all(|axis| meets(&axis, room.length)));
    }
    (closed as f64) < NO_ROOM * f64::from(places)
}

/// Returns directions spread over the half-space of a normal.
fn axes(normal: &Unit<Vector3<f64>>) -> impl Iterator<Item = Unit<Vector3<f64>>> {
    let golden = std::f64::consts::PI * (3.0 - 5f64.sqrt());
    let to_normal = UnitQuaternion::rotation_between_axis(&Vector3::z_axis(), normal)
        .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI));
    (0..DIRECTIONS).map(move |k| {
        let z = (k as f64 + 0.5) / DIRECTIONS as f64;
        let (s, c) = (golden * k as f64).sin_cos();
        let across = (1.0 - z * z).sqrt();
        to_normal * Unit::new_normalize(Vector3::new(across * c, across * s, z))
    })
}

fn inward(entries: &str, key: &FileKey, found: &FileWinding) -> String {
    let FileWinding { n_triangles, n_inward, pieces, largest, .. } = found;
    let what = format!(
        "{entries}: {}: {n_inward} of {n_triangles} triangles are wound inside out (winding number; {pieces} connected \
         piece{}, the largest of {} triangles from triangle {} on, counted from 0 after import): the mesh encloses the space \
         in front of them, and the tool has no room there",
        key.name,
        if *pieces == 1 { "" } else { "s" },
        largest.1,
        largest.0,
    );
    if n_inward == n_triangles {
        let value = !key.reverse_winding();
        format!("{what}; turn the mesh with \"reverse_winding\": {value} in each of these entries")
    } else {
        format!(
            "{what}, while the others are wound outward or not decided; a mesh of mixed winding cannot be turned as a whole: \
             turn these pieces where the file comes from, or write them to a file of their own, which \
             \"reverse_winding\": true turns"
        )
    }
}

/// Describes the triangles whose side of the material the mesh does not determine.
fn undecided(key: &FileKey, found: &FileWinding) -> Option<String> {
    let (open, hollow) = (found.n_undecided, found.n_hollow);
    let of = |n: usize| format!("{n} of {} triangles", found.n_triangles);
    let text = match (open, hollow) {
        (0, 0) => return None,
        (open, 0) => format!("the mesh does not decide on which side of {} the material is", of(open)),
        (0, hollow) => format!("{} are the wall of a hollow with room for the tool, or wound inside out", of(hollow)),
        (open, hollow) => format!(
            "the mesh does not decide on which side of {} the material is; {} more are the wall of a hollow with room for \
             the tool, or wound inside out",
            of(open),
            of(hollow)
        ),
    };
    Some(format!(
        "mesh {}: {text}: taken as wound, the tool on the side from which corners run counter-clockwise; if that is the wrong \
         side, turn it with \"reverse_winding\": {}",
        key.name,
        !key.reverse_winding()
    ))
}
