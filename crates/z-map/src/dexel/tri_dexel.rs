use facemill_surface_model::TriMesh;
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};

use crate::dexel::bodies::sweep::{Sweep, SweepError};
use crate::dexel::cut::{Contact, Cut};
use crate::dexel::map::{Broken, DexelMap, StockError};
use crate::dexel::mesh_stock::MeshStockError;

/// One stock as three maps, with lines along the workpiece's x, y and z, that are cut together:
/// walls that are steep for one are flat for another.
#[derive(Clone, Debug, PartialEq)]
pub struct TriDexel {
    maps: [DexelMap; 3],
}

impl TriDexel {
    /// Frames of lines (`work_from_map`) whose z is along the workpiece's x, y and z. Their
    /// rotations are exact.
    pub fn frames() -> [Isometry3<f64>; 3] {
        let turn = |w: f64, v: f64| UnitQuaternion::new_unchecked(Quaternion::new(w, v, v, v));
        [turn(0.5, 0.5), turn(-0.5, 0.5), turn(1.0, 0.0)].map(|r| Isometry3::from_parts(Translation3::identity(), r))
    }

    /// The box between two corners, workpiece frame.
    ///
    /// # Errors
    /// As for [`DexelMap::of_box`].
    pub fn of_box(low: [f64; 3], high: [f64; 3], cell: f64) -> Result<Self, StockError> {
        // Axes of the workpiece that are x, y and z of each frame.
        let order = [[1, 2, 0], [2, 0, 1], [0, 1, 2]];
        let [x, y, z] = Self::frames();
        let of = |frame: &Isometry3<f64>, k: usize| {
            DexelMap::of_box(frame, order[k].map(|a| low[a]), order[k].map(|a| high[a]), cell)
        };
        Ok(Self { maps: [of(&x, 0)?, of(&y, 1)?, of(&z, 2)?] })
    }

    /// The solid that a closed mesh bounds.
    ///
    /// # Errors
    /// As for [`DexelMap::of_mesh`].
    pub fn of_mesh(mesh: &TriMesh, cell: f64) -> Result<Self, MeshStockError> {
        let [x, y, z] = Self::frames();
        let of = |frame: &Isometry3<f64>| DexelMap::of_mesh(mesh, frame, cell);
        Ok(Self { maps: [of(&x)?, of(&y)?, of(&z)?] })
    }

    /// The maps with lines along x, y and z.
    pub fn maps(&self) -> &[DexelMap; 3] {
        &self.maps
    }

    /// Mean of the three maps' volumes, mm³.
    pub fn volume(&self) -> f64 {
        self.maps.iter().map(DexelMap::volume).sum::<f64>() / 3.0
    }

    /// [`DexelMap::remove_all`] of all three maps. Volumes are the means; lines are counted in all.
    ///
    /// # Errors
    /// As for one map; nothing is removed then.
    pub fn remove_all(&mut self, sweeps: &[Sweep], tolerance: f64) -> Result<Vec<Cut>, SweepError> {
        let mut cuts = vec![Cut::default(); sweeps.len()];
        // The fault of a sweep does not depend on the map: the first map refuses it before any is
        // cut.
        for map in &mut self.maps {
            for (sum, cut) in cuts.iter_mut().zip(map.remove_all(sweeps, tolerance)?) {
                sum.volume += cut.volume / 3.0;
                sum.lines += cut.lines;
            }
        }
        Ok(cuts)
    }

    /// The deepest of what the three maps meet ([`DexelMap::meets`]).
    ///
    /// # Errors
    /// As for one map.
    pub fn meets(&self, sweep: &Sweep, tolerance: f64) -> Result<Option<Contact>, SweepError> {
        let mut deepest: Option<Contact> = None;
        for map in &self.maps {
            let found = map.meets(sweep, tolerance)?;
            let deeper = |a: Contact, b: Contact| if b.depth > a.depth { b } else { a };
            deepest = deepest.into_iter().chain(found).reduce(deeper);
        }
        Ok(deepest)
    }

    /// [`DexelMap::check_invariants`] of all three.
    ///
    /// # Errors
    /// The first line that is not sound.
    pub fn check_invariants(&self) -> Result<(), Broken> {
        self.maps.iter().try_for_each(DexelMap::check_invariants)
    }
}
