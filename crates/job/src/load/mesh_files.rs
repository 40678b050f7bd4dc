//! Mesh files that a job names, and the units and axes assumed for them.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use facemill_surface_model::{ImportSettings, Imported, LengthUnit, MeshFormat, UpAxis, import_mesh};
use nalgebra::Point3;

use crate::failure::Failure;
use crate::format::job_file::{MeshFile, MeshStockFile, UnitFile, UpAxisFile};
use crate::format::report::MeshReport;
use crate::load::job::Job;
use crate::load::job_files::JobFiles;
use crate::validate::FARTHEST;

/// Mesh file with its settings in the job.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct FileKey {
    /// Path as the job has it.
    pub name: String,
    unit: Option<UnitFile>,
    up: Option<UpAxisFile>,
    reverse_winding: bool,
}

impl FileKey {
    /// Returns whether the job reverses its triangles.
    pub fn reverse_winding(&self) -> bool {
        self.reverse_winding
    }
}

impl From<&MeshFile> for FileKey {
    fn from(entry: &MeshFile) -> Self {
        let MeshFile { file, unit, up_axis, reverse_winding, .. } = entry;
        Self { name: file.clone(), unit: *unit, up: *up_axis, reverse_winding: *reverse_winding }
    }
}

impl From<&MeshStockFile> for FileKey {
    fn from(stock: &MeshStockFile) -> Self {
        let MeshStockFile { file, unit, up_axis, reverse_winding } = stock;
        Self { name: file.clone(), unit: *unit, up: *up_axis, reverse_winding: *reverse_winding }
    }
}

/// Mesh files already read, by their settings.
pub struct MeshFiles<'a> {
    job: &'a Job,
    /// Meshes that have been read.
    pub read: BTreeMap<FileKey, Arc<Imported>>,
}

impl<'a> MeshFiles<'a> {
    /// Returns the files of a job, none of them read.
    pub fn of(job: &'a Job) -> Self {
        Self { job, read: BTreeMap::new() }
    }

    /// Returns the mesh of a file, reversed if the job says so.
    pub fn get(&mut self, key: &FileKey) -> Result<&Imported, Failure> {
        if !self.read.contains_key(key) {
            let read = || -> Result<Imported, Failure> {
                let imported = read_mesh_of(&self.job.files, &self.job.beside(&key.name), key.unit, key.up)?;
                Ok(if key.reverse_winding { reversed(imported) } else { imported })
            };
            self.read.insert(key.clone(), self.job.meshes.file(key, read)?);
        }
        Ok(&*self.read[key])
    }

    /// Returns the reports on the files, with the units and axes assumed.
    pub fn reports(&self) -> Vec<MeshReport> {
        let report = |(key, read): (&FileKey, &Arc<Imported>)| {
            let format = MeshFormat::from_extension(Path::new(&key.name).extension()?.to_str()?)?;
            let settings = import_settings(format, key.unit, key.up);
            Some(MeshReport {
                reverse_winding: key.reverse_winding,
                ..MeshReport::new(&key.name, settings, &read.report)
            })
        };
        self.read.iter().filter_map(report).collect()
    }
}

/// Reverses all triangles of a mesh, and updates its report.
fn reversed(Imported { mesh, mut report }: Imported) -> Imported {
    report.components.iter_mut().for_each(|c| c.volume_mm3 = c.volume_mm3.map(|v| -v));
    report.n_inverted = report.components.iter().filter(|c| c.is_inverted()).count();
    Imported { mesh: mesh.reversed(), report }
}

/// Returns the import settings of a mesh file, with the unit and up axis that the job states, or
/// the format's own.
fn import_settings(format: MeshFormat, unit: Option<UnitFile>, up: Option<UpAxisFile>) -> ImportSettings {
    let mut settings = ImportSettings::default_for(format);
    if let Some(unit) = unit {
        settings.unit = match unit {
            UnitFile::Metre => LengthUnit::Metre,
            UnitFile::Centimetre => LengthUnit::Centimetre,
            UnitFile::Millimetre => LengthUnit::Millimetre,
            UnitFile::Inch => LengthUnit::Inch,
        };
    }
    if let Some(up) = up {
        settings.up_axis = match up {
            UpAxisFile::X => UpAxis::X,
            UpAxisFile::Y => UpAxis::Y,
            UpAxisFile::Z => UpAxis::Z,
        };
    }
    settings
}

/// Reads a mesh file with the unit and up axis that the job states, or the format's own.
///
/// # Errors
/// If it cannot be read or is no mesh.
pub fn read_mesh(path: &Path, unit: Option<UnitFile>, up: Option<UpAxisFile>) -> Result<Imported, Failure> {
    read_mesh_of(&JobFiles::in_folder(""), path, unit, up)
}

/// Reads a mesh of a job as [`read_mesh`] does.
pub(crate) fn read_mesh_of(
    files: &JobFiles,
    path: &Path,
    unit: Option<UnitFile>,
    up: Option<UpAxisFile>,
) -> Result<Imported, Failure> {
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or("");
    let format = MeshFormat::from_extension(extension)
        .ok_or_else(|| Failure::input(path, "unknown kind of mesh file; known are .obj, .stl, .gltf, .glb and .3mf"))?;
    let settings = import_settings(format, unit, up);
    let folder = path.parent().unwrap_or(Path::new("")).to_owned();
    let bytes = files.bytes(path)?;
    let imported =
        import_mesh(&path.display().to_string(), &bytes, format, &settings, &|name| files.beside(&folder.join(name)))
            .map_err(|e| Failure::input(path, e.fault))?;
    let far = |p: &Point3<f64>| p.coords.amax() > FARTHEST;
    match imported.mesh.vertices().iter().position(far) {
        None => Ok(imported),
        Some(vertex) => {
            let p = imported.mesh.vertices()[vertex];
            let message = format!(
                "vertex {vertex} is at ({:e}, {:e}, {:e}) mm, more than a kilometre from the origin; is the unit right?",
                p.x, p.y, p.z
            );
            Err(Failure::Input { file: path.to_owned(), message })
        }
    }
}
