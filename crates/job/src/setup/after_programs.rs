//! A setup with an outside bound of what the programs before it leave as its stock.

use std::sync::{Arc, PoisonError};

use facemill_cl_data::Monitor;
use facemill_surface_model::{Surface, SurfaceSettings};
use facemill_virtual_machine::{VerifySettings, is_known_to_cut, outside_layer, remaining_collisions};
use facemill_z_map::DexelMap;

use crate::failure::Failure;
use crate::load::enclosure::check_enclosure;
use crate::load::job::{Job, Setup};
use crate::load::obstacle_meshes::{ObstacleMesh, ObstacleRole, obstacle};
use crate::planning_stock::{CutStock, PlanningStock};
use crate::setup::programs_before::{digests_before, each_program_before, not_run};
use crate::stock::map::{StockMeshes, StockRegion};

/// Lines of the bound along the longer side of the stock where the setup gives no distance, at
/// least.
const LINES: f64 = 200.0;

/// Lines along that side of the map by which the number of lines with stock is estimated.
const COARSE_LINES: f64 = 100.0;

/// Cells along the shortest flute: a cutter is not known to cut with the ends of its flute.
const CELLS_PER_FLUTE: f64 = 6.0;

/// Smallest default distance of lines, mm.
const FINEST: f64 = 0.1;

/// Steps of the default distance to a mm.
const STEPS_PER_MM: f64 = 100.0;

/// Largest number of lines with material of a bound, which is a mesh of some ten triangles for each
/// of them: more would take most of a plan's memory.
const MOST_LINES: f64 = 60_000.0;

/// Error of the cut stock on a line as a share of the distance of lines; the largest one, mm.
const TOLERANCE_OF_CELL: f64 = 0.05;
const MOST_TOLERANCE: f64 = 0.05;

impl Setup<'_> {
    /// Returns the setup with an outside bound of what the known programs before it leave
    /// ([`Job::programs`]) as its stock; unchanged, with the reason, where there are none or no
    /// bound can be had.
    ///
    /// Guarantee: all material that is left lies in the bound, between its lines, too
    /// (docs/dexel.md#a-bound-of-what-is-left).
    ///
    /// # Errors
    /// If a program is not understood, or its setup cannot be read.
    pub fn after_programs(mut self, job: &Job, monitor: &dyn Monitor) -> Result<Self, Failure> {
        let bound = match self.bound(job, monitor)? {
            Ok(bound) => bound,
            Err(why) => {
                self.planning_stock = PlanningStock::Own { why };
                return Ok(self);
            }
        };
        self.own_stock = Some(StockMeshes::of(&self).own());
        self.stock_solid = Some(Arc::new(Surface::new(bound.stock.mesh.clone(), SurfaceSettings::default())));
        self.stock_thickness = 0.0;
        self.obstacles.retain(|o| o.role != ObstacleRole::Stock);
        // In front of the machine's bodies, as stock of the job is.
        let at = self.obstacles.iter().position(|o| o.machine_body.is_some()).unwrap_or(self.obstacles.len());
        self.obstacles.insert(at, bound.stock);
        self.planning_stock = bound.planning_stock;
        Ok(self)
    }

    /// Returns the bound, or the reason why there is none; no reason where nothing was cut before.
    fn bound(&self, job: &Job, monitor: &dyn Monitor) -> Result<Result<StockBound, Option<String>>, Failure> {
        let meshes = StockMeshes::of(self);
        let has_stock = self.stock_solid.is_some() || self.stock_thickness > 0.0;
        let programs = digests_before(job, self)?;
        if !has_stock || programs.is_empty() {
            // Programs of other jobs are read all the same, for their faults.
            each_program_before(job, self, 0, |_| Ok(()))?;
            return Ok(Err(None));
        }
        let cut = match self.cut_stock(job, &meshes, programs, monitor)? {
            Ok(cut) => cut,
            Err(why) => return Ok(Err(Some(why))),
        };
        let (cell, [setups, not_counted]) = (cut.lines.grid().cell(), cut.setups);
        if setups.is_empty() {
            let why = format!(
                "nothing is known that {} cut: the cutter is too small for lines {cell} mm apart, or the program has a fault",
                not_counted.join(", ")
            );
            return Ok(Err(Some(why)));
        }
        // No material is beyond the stock's box; its lines and this box are of one frame.
        let extents = meshes.extents();
        let mesh = match cut.lines.between(extents.min.z, extents.max.z).to_mesh() {
            Ok(mesh) => mesh,
            Err(why) => return Ok(Err(Some(why.to_string()))),
        };
        let stock = obstacle(ObstacleRole::Stock, 0.0, "stock".to_owned(), mesh);
        if let Err(why) = check_enclosure(&job.setup_key(self.index), self.file, 0.0, std::slice::from_ref(&stock)) {
            // Rapids on the clearance surface would go through the layer around its lines.
            return Ok(Err(Some(format!(
                "the bound of what is left does not lie inside the clearance surface ({why})"
            ))));
        }
        let planning_stock = PlanningStock::LeftByPrograms { setups, not_counted, cell, layer: outside_layer(cell) };
        Ok(Ok(StockBound { stock, planning_stock }))
    }

    /// Returns the stock on lines that show all that these programs leave, or why there are none.
    /// Goes on from known lines that the first programs have cut.
    fn cut_stock(
        &self,
        job: &Job,
        meshes: &StockMeshes,
        programs: Vec<[u8; 32]>,
        monitor: &dyn Monitor,
    ) -> Result<Result<CutStock, String>, Failure> {
        let known = || job.programs.cut.lock().unwrap_or_else(PoisonError::into_inner);
        let (origin, requested) = (meshes.origin().to_bytes(), self.file.rest_cell_mm);
        let is_begun =
            |cut: &CutStock| cut.origin == origin && cut.requested == requested && programs.starts_with(&cut.programs);
        let begun = known().as_ref().filter(|cut| is_begun(cut)).cloned();
        let mut cut = match begun {
            Some(begun) => begun,
            None => match self.outside(job, meshes) {
                Ok((lines, tolerance)) => {
                    let (programs, setups) = (Vec::new(), Default::default());
                    CutStock { origin, requested, programs, setups, lines, tolerance }
                }
                Err(why) => return Ok(Err(why)),
            },
        };
        each_program_before(job, self, cut.programs.len(), |before| {
            let is_known = before.fault.is_none()
                && is_known_to_cut(before.at.tool.cutter(), cut.lines.grid().cell(), cut.tolerance);
            cut.setups[usize::from(!is_known)].push(before.setup.to_owned());
            if is_known {
                let settings = VerifySettings::default();
                let heads = [(&before.at, &settings, Vec::new())];
                remaining_collisions(&before.text, heads, &mut cut.lines, cut.tolerance, monitor)
                    .map_err(|e| not_run(before.path, e))?;
            }
            Ok(())
        })?;
        cut.programs = programs;
        *known() = Some(cut.clone());
        Ok(Ok(cut))
    }

    /// Returns the stock before any program, on lines that show all of it, and the error of cuts on
    /// them, mm; or why there are none.
    fn outside(&self, job: &Job, meshes: &StockMeshes) -> Result<(DexelMap, f64), String> {
        let size = meshes.extents().half_extents() * 2.0;
        let map = |cell: f64| meshes.outside(job, self, cell, StockRegion::Whole).map_err(|e| e.to_string());
        let coarse = size.x.max(size.y) / COARSE_LINES;
        let area = covered_area(&map(coarse)?);
        let cell = match self.file.rest_cell_mm {
            Some(cell) if area > MOST_LINES * cell * cell => {
                let least = (area / MOST_LINES).sqrt();
                return Err(format!("rest_cell_mm {cell} makes too large a bound; take {least:.2} mm or more"));
            }
            Some(cell) => cell,
            None => {
                let flutes = job.all_tools().map(|tool| tool.cutter().flute_length() / CELLS_PER_FLUTE);
                let by_flute = flutes.chain(cells_of_layers(job)).fold(f64::INFINITY, f64::min);
                let by_number = (area / MOST_LINES).sqrt();
                let cell = (size.x.max(size.y) / LINES).min(by_flute).max(FINEST).max(by_number);
                // Divided, so that the number has no more digits.
                (cell * STEPS_PER_MM).ceil() / STEPS_PER_MM
            }
        };
        Ok((map(cell)?, (TOLERANCE_OF_CELL * cell).min(MOST_TOLERANCE)))
    }
}

/// Returns the distances of lines, mm, on which tools are known to cut all of their layers, with
/// the layer of the lines above it and the ends of the flute off it.
fn cells_of_layers(job: &Job) -> impl Iterator<Item = f64> + '_ {
    job.file.operations.iter().filter_map(|operation| {
        let depth = operation.depth_of_layer()?;
        let tool = job.tool_of(operation);
        let spare = tool.cutter().flute_length() - depth - operation.tolerances.cusp_mm;
        // d above the stock and d + 2t at the end of the flute, in cells, for a tolerance of a
        // twentieth.
        (spare > 0.0).then(|| spare / (2.0 * outside_layer(1.0) + 2.0 * TOLERANCE_OF_CELL))
    })
}

/// Bound of the stock that programs leave.
struct StockBound {
    stock: ObstacleMesh,
    planning_stock: PlanningStock,
}

/// Returns the area on which lines meet material, mm².
fn covered_area(map: &DexelMap) -> f64 {
    let [nx, ny] = map.grid().n_lines();
    let covered = (0..ny).map(|j| (0..nx).filter(|&i| map.intervals(i, j).next().is_some()).count()).sum::<usize>();
    covered as f64 * map.grid().cell() * map.grid().cell()
}
