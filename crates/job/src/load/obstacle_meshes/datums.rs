//! Datums: finished surfaces by which the part is located in a clamping.

use facemill_surface_model::{Edges, Surface, Topology, TriMesh};
use nalgebra::{Isometry3, Matrix3, Point2, Point3, SymmetricEigen, Unit, Vector3};

use crate::failure::Failure;
use crate::format::job_file::RoleFile;
use crate::frames::pose;
use crate::load::job::Job;
use crate::load::mesh_files::{FileKey, MeshFiles};
use crate::load::obstacle_meshes::{only, selected_groups};
use crate::validate::setup_chain::programs_before;

/// Shape of a datum.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DatumShape {
    /// A plane, with its direction out of the material.
    Plane(Unit<Vector3<f64>>),
    /// A cylinder of a bore or a shaft.
    Cylinder {
        /// Direction of its axis; of both that with the larger last coordinate that is not 0.
        axis: Unit<Vector3<f64>>,
        /// Radius, mm.
        radius: f64,
    },
    /// Any other surface.
    Other,
}

/// Connected piece of a group of a setup's datum surfaces.
#[derive(Clone, Debug, PartialEq)]
pub struct Datum {
    /// Mesh file, as the job has it.
    pub file: String,
    /// Name of the group that it is of.
    pub group: String,
    /// Its shape.
    pub shape: DatumShape,
    /// Centre of its area, on the axis of a cylinder, mm.
    pub place: Point3<f64>,
    /// Largest distance of its corners from the shape, mm; 0 of any other surface.
    pub deviation: f64,
}

/// Largest angle of a facet off a plane, or off a direction along a cylinder, rad.
const STRAY: f64 = 0.01;

/// Largest distance of a cylinder's corners from it, over its radius.
const OUT_OF_ROUND: f64 = 0.01;

/// Largest angle between a facet's normal and the radius at its middle, rad: of a cylinder with 12
/// sides it is 0.09.
const CHORD: f64 = 0.1;

/// Returns the datums of a setup in the frame of the part, by mesh entry and group, then by their
/// first triangle.
///
/// # Errors
/// If a mesh cannot be read, or groups do not exist.
pub fn datums(job: &Job, index: usize) -> Result<Vec<Datum>, Failure> {
    let mut read = MeshFiles::of(job);
    let mut found = Vec::new();
    let meshes = &job.file.setups[index].meshes;
    for (k, entry) in meshes.iter().enumerate().filter(|(_, entry)| entry.role == RoleFile::Datum) {
        let mesh = &read.get(&FileKey::from(entry))?.mesh;
        let selected = selected_groups(job, &format!("{}.meshes[{k}]", job.setup_key(index)), entry, mesh)?;
        for group in (0..selected.len()).filter(|&group| selected[group]) {
            let of_group: Vec<bool> = (0..selected.len()).map(|k| k == group).collect();
            found.extend(pieces(&entry.file, &mesh.groups()[group].name, &only(mesh, &of_group)));
        }
    }
    Ok(found)
}

/// Returns the connected pieces of a group.
fn pieces(file: &str, group: &str, mesh: &TriMesh) -> Vec<Datum> {
    let topology = Topology::of(mesh, &Edges::of(mesh));
    let of_piece = |piece: usize| {
        (0..mesh.triangles().len()).filter(|&t| topology.component_of[t] == piece as u32).collect::<Vec<usize>>()
    };
    (0..topology.components.len()).map(|piece| datum(file, group, mesh, &of_piece(piece))).collect()
}

impl Datum {
    /// Returns it in another frame.
    #[must_use]
    pub fn moved(&self, motion: &Isometry3<f64>) -> Self {
        let shape = match self.shape {
            DatumShape::Plane(normal) => DatumShape::Plane(motion * normal),
            DatumShape::Cylinder { axis, radius } => DatumShape::Cylinder { axis: upward(motion * axis), radius },
            DatumShape::Other => DatumShape::Other,
        };
        Self { shape, place: motion * self.place, ..self.clone() }
    }
}

/// Returns a direction or its reverse.
fn upward(axis: Unit<Vector3<f64>>) -> Unit<Vector3<f64>> {
    let last = axis.iter().rev().find(|c| c.abs() > STRAY);
    if last.is_some_and(|c| *c < 0.0) { -axis } else { axis }
}

fn datum(file: &str, group: &str, mesh: &TriMesh, triangles: &[usize]) -> Datum {
    let corners = |t: &usize| mesh.triangles()[*t].map(|v| mesh.vertices()[v as usize]);
    // Areas as vectors along the normals.
    let facets: Vec<(Vector3<f64>, Point3<f64>)> = triangles
        .iter()
        .map(|t| {
            let [a, b, c] = corners(t);
            (0.5 * (b - a).cross(&(c - a)), Point3::from((a.coords + b.coords + c.coords) / 3.0))
        })
        .filter(|(area, _)| area.norm() > 0.0)
        .collect();
    let all = facets.iter().map(|(area, _)| area.norm()).sum::<f64>().max(f64::MIN_POSITIVE);
    let centre = Point3::from(facets.iter().map(|(area, at)| at.coords * (area.norm() / all)).sum::<Vector3<f64>>());
    let points: Vec<Point3<f64>> = triangles.iter().flat_map(corners).collect();
    let (shape, place, deviation) = plane(&facets, centre, &points)
        .or_else(|| cylinder(&facets, centre, &points))
        .unwrap_or((DatumShape::Other, centre, 0.0));
    Datum { file: file.to_owned(), group: group.to_owned(), shape, place, deviation }
}

type Fitted = (DatumShape, Point3<f64>, f64);

fn plane(facets: &[(Vector3<f64>, Point3<f64>)], centre: Point3<f64>, points: &[Point3<f64>]) -> Option<Fitted> {
    let normal = Unit::try_new(facets.iter().map(|(area, _)| area).sum::<Vector3<f64>>(), 0.0)?;
    let is_flat = facets.iter().all(|(area, _)| area.dot(&normal) >= STRAY.cos() * area.norm());
    let off = points.iter().map(|p| (p - centre).dot(&normal).abs()).fold(0.0, f64::max);
    is_flat.then_some((DatumShape::Plane(normal), centre, off))
}

/// Fits a cylinder: its axis is across all normals, and the circle around it is that of least
/// squares of r².
fn cylinder(facets: &[(Vector3<f64>, Point3<f64>)], centre: Point3<f64>, points: &[Point3<f64>]) -> Option<Fitted> {
    let spread: Matrix3<f64> = facets.iter().map(|(area, _)| area * area.transpose() / area.norm()).sum();
    let eigen = SymmetricEigen::new(spread);
    let least = eigen.eigenvalues.imin();
    let axis = upward(Unit::try_new(eigen.eigenvectors.column(least).into_owned(), 0.0)?);
    if facets.iter().any(|(area, _)| area.dot(&axis).abs() > STRAY.sin() * area.norm()) {
        return None;
    }
    let across = if axis.x.abs() < 0.9 { Vector3::x() } else { Vector3::y() };
    let u = axis.cross(&across).normalize();
    let v = axis.cross(&u);
    let flat: Vec<Point2<f64>> = points.iter().map(|p| p - centre).map(|d| Point2::new(d.dot(&u), d.dot(&v))).collect();
    // x² + y² = 2·a·x + 2·b·y + c.
    let (mut left, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for p in &flat {
        let row = Vector3::new(2.0 * p.x, 2.0 * p.y, 1.0);
        left += row * row.transpose();
        right += row * (p.x * p.x + p.y * p.y);
    }
    let solved = left.try_inverse()? * right;
    let middle = Point2::new(solved.x, solved.y);
    let radius = (solved.z + middle.coords.norm_squared()).max(0.0).sqrt();
    let off = flat.iter().map(|p| ((p - middle).norm() - radius).abs()).fold(0.0, f64::max);
    let place = centre + u * middle.x + v * middle.y;
    // Facets lie across the radius, as chords of a circle do: those of a square hole do not.
    let is_across = |(area, at): &(Vector3<f64>, Point3<f64>)| {
        let from_axis = (at - place) - axis.into_inner() * (at - place).dot(&axis);
        area.dot(&from_axis).abs() >= CHORD.cos() * area.norm() * from_axis.norm()
    };
    (off <= OUT_OF_ROUND * radius && facets.iter().all(is_across)).then_some((
        DatumShape::Cylinder { axis, radius },
        place,
        off,
    ))
}

/// Stock that a datum may have on it, mm: rounding, and that of a mesh made of facets.
const STOCK_ON_DATUM: f64 = 0.1;

/// Refuses stock above the datums of a setup, which are finished before it, if it is the first one
/// that cuts this stock.
///
/// # Errors
/// If the solid stock is more than 0.1 mm above the middle of a facet.
pub(crate) fn check_datums(job: &Job, index: usize, stock: Option<&Surface>) -> Result<(), Failure> {
    let Some(stock) = stock else { return Ok(()) };
    let file = &job.file.setups[index];
    // The programs before may have finished it.
    if !programs_before(&job.file.setups, index).0.is_empty() || !file.programs_before.is_empty() {
        return Ok(());
    }
    let work_from_part = pose(&file.work_from_part);
    let mut read = MeshFiles::of(job);
    for (k, entry) in file.meshes.iter().enumerate().filter(|(_, entry)| entry.role == RoleFile::Datum) {
        let at = format!("{}.meshes[{k}]", job.setup_key(index));
        let mesh = &read.get(&FileKey::from(entry))?.mesh;
        let mesh = only(mesh, &selected_groups(job, &at, entry, mesh)?).transformed(&work_from_part);
        for t in mesh.triangles() {
            let [a, b, c] = t.map(|v| mesh.vertices()[v as usize]);
            let middle = Point3::from((a.coords + b.coords + c.coords) / 3.0);
            let Some(normal) = Unit::try_new((b - a).cross(&(c - a)), 0.0) else { continue };
            if stock.is_inside(&(middle + normal.into_inner() * STOCK_ON_DATUM)) {
                return Err(job.wrong(format!(
                    "{at}: there is stock on the datum at ({:.1}, {:.1}, {:.1}), more than {STOCK_ON_DATUM} mm; a datum is \
                     finished before the clamping, so give the stock as it is then, or make the mesh a part",
                    middle.x, middle.y, middle.z
                )));
            }
        }
    }
    Ok(())
}

#[cfg(test)]
#[path = "../../../tests/unit/load/obstacle_meshes/datums.rs"]
mod tests;
