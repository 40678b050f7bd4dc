//! Rest of the stock that another program left, and whether it is of this stock.

use std::path::Path;

use facemill_surface_model::TriMesh;
use facemill_z_map::DexelMap;
use nalgebra::{Isometry3, Point3, Vector3};

use crate::failure::Failure;
use crate::files;
use crate::load::job::{Job, Setup};
use crate::stock::map::StockMeshes;
use crate::validate::setup_chain::{follows, work_from_work};

/// Reads the rest that a program left of the stock of a job's setup (`verify --rest-out`), or of
/// another setup of the job with the same stock ([`follows`]), in the workpiece frame of the setup.
///
/// # Errors
/// If the file cannot be read, is not a stock file, is damaged, or holds the rest of other stock:
/// the message says what differs.
pub fn read_rest(job: &Job, setup: usize, path: &Path) -> Result<DexelMap, Failure> {
    rest_of_bytes(job, setup, path, &files::read(path)?)
}

/// Reads the same from a file that the job names.
///
/// # Errors
/// As [`read_rest`].
pub fn read_named_rest(job: &Job, setup: usize, name: &str) -> Result<DexelMap, Failure> {
    let path = job.beside(name);
    rest_of_bytes(job, setup, &path, &job.files.bytes(&path)?)
}

fn rest_of_bytes(job: &Job, setup: usize, path: &Path, bytes: &[u8]) -> Result<DexelMap, Failure> {
    let rest = DexelMap::from_bytes(bytes).map_err(|e| Failure::input(path, e))?;
    let Some(began_as) = Origin::from_bytes(rest.origin()) else {
        let message = "does not identify its stock before cutting: write it again with facemill verify --rest-out";
        return Err(Failure::input(path, message));
    };
    let own = Origin::of_setup(job, setup)?;
    if own == began_as {
        return Ok(rest);
    }
    let setups = &job.file.setups;
    for k in (0..setups.len()).filter(|&k| k != setup && follows(&setups[k], &setups[setup]).is_ok()) {
        if Origin::of_setup(job, k)? == began_as {
            let motion = work_from_work(&setups[k], &setups[setup]);
            // It is now a rest of this setup's stock, in its frame.
            return Ok(motion.map_or(rest.clone(), |motion| rest.moved(&motion).with_origin(own.to_bytes())));
        }
    }
    let (name, differs) = (&setups[setup].name, began_as.differs_from(&own));
    let message = format!(
        "is not a rest of the stock of setup \"{name}\": {differs}. Give the rest of a program that cut this stock, \
         or cut the setup's own stock (--stock-cell-mm in place of --rest)"
    );
    Err(Failure::input(path, message))
}

/// Identity of stock before anything is cut, workpiece frame. Equal ones are of the same stock.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Origin {
    /// Digest of its mesh.
    digest: [u8; DIGEST],
    /// Allowance around the mesh, mm.
    allowance: f64,
    /// The box around the mesh, mm, rounded.
    corners: [[f64; 3]; 2],
}

/// Bytes of a digest.
const DIGEST: usize = 32;

/// Bytes of digest, allowance and corners.
const BYTES: usize = DIGEST + 7 * 8;

/// Rounding unit of coordinates, mm. Smaller: different rounding of transforms on another computer
/// changes the identity. Larger: parts that differ by that are equal.
const QUANTUM: f64 = 1e-3;

/// Offset of the rounding steps, mm: away from coordinates with few decimals, which many meshes
/// have.
const SHIFT: f64 = 0.271_828e-3;

impl Origin {
    /// Returns the identity of a mesh with an allowance.
    pub fn of(mesh: &TriMesh, allowance: f64) -> Self {
        let mut hasher = blake3::Hasher::new();
        for coordinate in mesh.vertices().iter().flat_map(|p| p.iter()) {
            hasher.update(&steps(*coordinate).to_le_bytes());
        }
        for corner in mesh.triangles().iter().flatten() {
            hasher.update(&corner.to_le_bytes());
        }
        let around = mesh.aabb();
        let rounded = |c: &f64| steps(*c) as f64 * QUANTUM;
        let corners = [around.min, around.max].map(|p| [0, 1, 2].map(|k| rounded(&p[k])));
        Self { digest: *hasher.finalize().as_bytes(), allowance, corners }
    }

    /// Returns the identity of the same mesh with the part at this pose in its frame: a block that
    /// a turn maps onto itself is another one for the part.
    #[must_use]
    pub(crate) fn in_frame(self, frame: &Isometry3<f64>) -> Self {
        if *frame == Isometry3::identity() {
            return self;
        }
        let mut hasher = blake3::Hasher::new();
        hasher.update(&self.digest);
        // Points a metre off show its turn.
        let places =
            [Vector3::zeros(), Vector3::x(), Vector3::y(), Vector3::z()].map(|v| frame * Point3::from(v * 1e3));
        for coordinate in places.iter().flat_map(|p| p.iter()) {
            hasher.update(&steps(*coordinate).to_le_bytes());
        }
        Self { digest: *hasher.finalize().as_bytes(), ..self }
    }

    fn of_setup(job: &Job, setup: usize) -> Result<Self, Failure> {
        Ok(StockMeshes::of(&Setup::read(job, setup)?).origin())
    }

    /// Returns the bytes for a stock file.
    pub fn to_bytes(self) -> Vec<u8> {
        let numbers = [self.allowance].into_iter().chain(self.corners.into_iter().flatten());
        self.digest.into_iter().chain(numbers.flat_map(f64::to_le_bytes)).collect()
    }

    /// Returns `None` if these bytes are not an identity.
    fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let (digest, numbers) = bytes.split_first_chunk::<DIGEST>().filter(|_| bytes.len() == BYTES)?;
        let (numbers, _) = numbers.as_chunks::<8>();
        let &[allowance, x0, y0, z0, x1, y1, z1] = numbers else { return None };
        let number = f64::from_le_bytes;
        let corners = [[x0, y0, z0], [x1, y1, z1]].map(|corner| corner.map(number));
        Some(Self { digest: *digest, allowance: number(allowance), corners })
    }

    /// Describes the difference from a setup's own stock.
    fn differs_from(&self, own: &Self) -> String {
        let text = |[low, high]: [[f64; 3]; 2]| {
            let at = |[x, y, z]: [f64; 3]| format!("({x:.3}, {y:.3}, {z:.3})");
            format!("{} to {}", at(low), at(high))
        };
        if self.corners != own.corners {
            return format!(
                "its mesh went from {}, the setup's goes from {} mm",
                text(self.corners),
                text(own.corners)
            );
        }
        if self.allowance != own.allowance {
            let (its, own) = (self.allowance, own.allowance);
            return format!("it had an allowance of {its} mm around its mesh, the setup's has {own} mm");
        }
        format!("its mesh was another one, though both go from {} mm", text(own.corners))
    }
}

/// Returns a coordinate in whole steps.
fn steps(coordinate: f64) -> i64 {
    ((coordinate + SHIFT) / QUANTUM).round() as i64
}

#[cfg(test)]
#[path = "../../tests/unit/stock/rest.rs"]
mod tests;
