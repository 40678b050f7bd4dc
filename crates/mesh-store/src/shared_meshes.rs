//! Files, surfaces and trees by what they are made of.

use std::convert::Infallible;
use std::fmt::Debug;
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError, Weak};

use facemill_interference::MeshTree;
use facemill_surface_model::{Imported, Surface, SurfaceSettings, TriMesh};

/// Most triangles of surfaces, and of meshes with trees, that are held while nothing else has them:
/// those of a propeller with its casting in one clamping, at two allowances. More: clampings in
/// turn are read faster, and take more memory.
const MOST_TRIANGLES: usize = 1_500_000;

/// Meshes that are kept as long as they are shared. Clones have the same ones.
///
/// `made_from` in its methods has to tell apart all that a value depends on, by how it is written
/// for debugging. A maker must not call these methods for the same value.
#[derive(Clone, Default)]
pub struct SharedMeshes {
    all: Arc<Mutex<AllKept>>,
}

#[derive(Default)]
struct AllKept {
    /// Number of [`MeshSharing`]s.
    sharing: usize,
    files: Kept<Imported>,
    surfaces: Kept<Surface>,
    obstacles: Kept<TreeMesh>,
}

/// Values by what they are made of, the last used ones last.
struct Kept<T> {
    made: Vec<Made<T>>,
}

struct Made<T> {
    made_from: String,
    /// The value, as long as something has it or it is held.
    known: Weak<T>,
    held: Option<Arc<T>>,
}

impl<T> Default for Kept<T> {
    fn default() -> Self {
        Self { made: Vec::new() }
    }
}

/// Mesh with its tree, which is made when it is first needed.
pub struct TreeMesh {
    /// The mesh.
    pub mesh: TriMesh,
    tree: OnceLock<MeshTree>,
}

impl TreeMesh {
    /// Takes a mesh.
    pub fn new(mesh: TriMesh) -> Self {
        Self { mesh, tree: OnceLock::new() }
    }

    /// Returns the hierarchy of the mesh. Take it before parallel work: threads that need it first
    /// make one each.
    pub fn tree(&self) -> &MeshTree {
        if let Some(made) = self.tree.get() {
            return made;
        }
        // Made by several threads, of which none may wait for another one meanwhile.
        let made = MeshTree::new(&self.mesh);
        self.tree.get_or_init(|| made)
    }
}

/// As long as there is one, meshes are kept.
#[must_use]
pub struct MeshSharing {
    of: SharedMeshes,
}

impl Drop for MeshSharing {
    fn drop(&mut self) {
        let mut all = self.of.all();
        all.sharing -= 1;
        if all.sharing == 0 {
            *all = AllKept::default();
        }
    }
}

impl SharedMeshes {
    /// Keeps what is made from now on, as long as the result is there.
    pub fn share(&self) -> MeshSharing {
        self.all().sharing += 1;
        MeshSharing { of: self.clone() }
    }

    fn all(&self) -> MutexGuard<'_, AllKept> {
        self.all.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns a mesh file as it was read before, or reads it; all of `made_from` determines it.
    ///
    /// # Errors
    /// Those of `read`.
    pub fn file<E>(
        &self,
        made_from: &impl Debug,
        read: impl FnOnce() -> Result<Imported, E>,
    ) -> Result<Arc<Imported>, E> {
        let triangles = |file: &Imported| file.mesh.triangles().len();
        self.found(made_from, |all| &mut all.files, triangles, read)
    }

    /// Returns the surface of a mesh, which all of `made_from` determines.
    pub fn surface(&self, made_from: &impl Debug, mesh: impl FnOnce() -> TriMesh) -> Arc<Surface> {
        let triangles = |surface: &Surface| surface.mesh().triangles().len();
        let make = || Ok::<_, Infallible>(Surface::new(mesh(), SurfaceSettings::default()));
        let Ok(found) = self.found(made_from, |all| &mut all.surfaces, triangles, make);
        found
    }

    /// Returns a mesh with its tree, which all of `made_from` determines.
    pub fn obstacle(&self, made_from: &impl Debug, mesh: impl FnOnce() -> TriMesh) -> Arc<TreeMesh> {
        let triangles = |obstacle: &TreeMesh| obstacle.mesh.triangles().len();
        let make = || Ok::<_, Infallible>(TreeMesh::new(mesh()));
        let Ok(found) = self.found(made_from, |all| &mut all.obstacles, triangles, make);
        found
    }

    /// Returns the known value, or makes it, without a lock.
    fn found<T, E>(
        &self,
        made_from: &impl Debug,
        of: impl Fn(&mut AllKept) -> &mut Kept<T>,
        triangles: impl Fn(&T) -> usize,
        make: impl FnOnce() -> Result<T, E>,
    ) -> Result<Arc<T>, E> {
        let made_from = format!("{made_from:?}");
        let known = of(&mut self.all()).take(&made_from);
        let value = known.map_or_else(|| make().map(Arc::new), Ok)?;
        let mut all = self.all();
        if all.sharing > 0 {
            of(&mut all).put(made_from, &value, triangles, MOST_TRIANGLES);
        }
        Ok(value)
    }
}

impl<T> Kept<T> {
    /// Takes out the value that is made from this.
    fn take(&mut self, made_from: &str) -> Option<Arc<T>> {
        let at = self.made.iter().position(|made| made.made_from == made_from)?;
        self.made.remove(at).known.upgrade()
    }

    /// Adds a value as the last used one. Of those before, no longer holds what is beyond so many
    /// triangles.
    fn put(&mut self, made_from: String, value: &Arc<T>, triangles: impl Fn(&T) -> usize, most: usize) {
        self.made.push(Made { made_from, known: Arc::downgrade(value), held: Some(value.clone()) });
        let mut sum = 0;
        for made in self.made.iter_mut().rev() {
            sum += made.held.as_deref().map_or(0, &triangles);
            if sum > most {
                made.held = None;
            }
        }
        self.made.retain(|made| made.known.strong_count() > 0);
    }
}

#[cfg(test)]
#[path = "../tests/unit/shared_meshes.rs"]
mod tests;
