//! Places of an operation's region where stock is left, and the heights of stock above its drive
//! surface.

use std::path::Path;
use std::sync::{Arc, PoisonError};

use facemill_cc_path::files::{LeftAboveFile, LeftOfFile, ProgramWithToolFile};
use facemill_cc_path::strategies::Region;
use facemill_cc_path::{LeftRegion, RegionSample, RequestedRegion, RequestedStrategy, StockHeight, Strategy};
use facemill_cl_data::{Aabb, CcPoint, Silent};
use facemill_nc_program::ReadProgram;
use facemill_surface_model::Surface;
use facemill_virtual_machine::{VerifySettings, VirtualSetup, swept_by_cuts};
use facemill_z_map::{DexelMap, SurfacePlace, SweptCutter, left_heights};
use nalgebra::{Isometry3, Point3, Vector3};

use crate::failure::Failure;
use crate::format::job_file::{OperationFile, PathFile, SetupFile};
use crate::frames::places;
use crate::load::job::{Job, Setup, SweptProgram};
use crate::setup::cell::corner_on_drive;
use crate::setup::pass_surface::{extended_region, pass_surface};
use crate::setup::programs_before::{
    NOT_NAMED, WrongTool, digests_before, each_program_before, read_part, tool_of_program,
};
use crate::setup::scene::Scene;
use crate::stock::map::StockMeshes;
use crate::stock::rest::read_named_rest;
use crate::validate::setup_chain::programs_before;

/// Largest number of samples of a region, in all places of its pattern: 100,000 take a second of
/// processor time on a program of 100,000 blocks.
const MAX_SAMPLES: f64 = 200_000.0;

/// Smallest distance of samples, mm: stock of less width is cut with what is around it.
const FINEST: f64 = 0.25;

/// Largest distance of samples beside a sample, as a multiple of their spacing: each cell of a
/// square lattice has one anywhere in it, and facets lean by up to 55° from the lattice.
const SAMPLE_REACH: f64 = 2.0;

/// Largest cosine between normal and lines at which stock on lines does not show the height above a
/// facet: within 10° of upright.
const WALL: f64 = 0.174;

/// Samples by which it is checked that a rest has lines over a region.
const COVERED_SAMPLES: f64 = 2_000.0;

/// Largest error of a point of the cutter in the measurement of heights, mm.
const MOTION_TOLERANCE: f64 = 0.002;

/// Height above a layer that counts as rounding, mm: meshes of castings have single precision.
pub(crate) const LAYER_ROUNDING: f64 = 0.01;

/// Largest measured height, mm.
const MAX_HEIGHT: f64 = 1000.0;

/// Returns the region of an operation's strategy or path file that the job limits by what is left;
/// `None` if it does not. `region` has the other conditions. Heights are measured once for each
/// setup that is read; in a pattern, stock is left where it is left in any place.
///
/// # Errors
/// If there is no stock to measure, a file is wrong or of other stock, or a program cannot be run.
pub fn left_region(
    job: &Job,
    setup: &Setup<'_>,
    operation: &OperationFile,
    region: &Region,
) -> Result<Option<Arc<LeftRegion>>, Failure> {
    let Some(file) = &operation.region().left_above else { return Ok(None) };
    let known = || setup.left_regions.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(found) = known().get(&operation.name) {
        return Ok(Some(found.clone()));
    }
    let kind = match operation.path {
        PathFile::File(_) => "file",
        PathFile::Cl(_) => "cl",
        PathFile::Strategy(_) => "strategy",
    };
    let at = format!("operation \"{}\": path.{kind}.region.left_above", operation.name);
    let wrong = |message: String| job.wrong(format!("{at}: {message}"));
    let strategy = match &operation.path {
        PathFile::Strategy(s) => Some(s.strategy.to_strategy().map_err(|e| wrong(e.to_string()))?),
        PathFile::File(_) | PathFile::Cl(_) => None,
    };
    let extended = extended_region(job, setup, operation)?;
    // Of a level only what the tool reaches can be cut.
    let extended = extended.filter(|_| setup.level.is_none());
    let (surface, region) = pass_surface(setup, extended.as_deref(), region.clone());
    let measured = RegionMeasurement {
        job,
        setup,
        surface,
        region: &region,
        strategy: strategy.as_ref(),
        places: places(operation.pattern.as_ref()),
        name: &operation.name,
        first_layer: match &setup.level {
            Some(level) => Some(level.depth).filter(|_| !level.is_later),
            None => operation.layers.map(|layers| layers.from_mm),
        },
        wrong: &wrong,
    };
    let found = Arc::new(measured.left(file)?);
    known().insert(operation.name.clone(), found.clone());
    Ok(Some(found))
}

/// Region on which heights of stock are measured.
struct RegionMeasurement<'m> {
    job: &'m Job,
    setup: &'m Setup<'m>,
    /// Surface that the region is of.
    surface: &'m Surface,
    region: &'m Region,
    strategy: Option<&'m Strategy>,
    /// Places of the pattern.
    places: Vec<Isometry3<f64>>,
    /// Name of the operation.
    name: &'m str,
    /// Thickness of its layer, mm, if it is the first one of several.
    first_layer: Option<f64>,
    /// Makes an error of a message.
    wrong: &'m dyn Fn(String) -> Failure,
}

impl RegionMeasurement<'_> {
    fn left(&self, file: &LeftAboveFile) -> Result<LeftRegion, Failure> {
        if self.surface.mesh().triangles().is_empty() {
            return Ok(LeftRegion::new(&[], file.height_mm, file.overlap_mm));
        }
        let heights = match &file.of {
            LeftOfFile::InitialStock => self.of_initial_stock()?,
            LeftOfFile::Rest(name) => self.of_rest(name)?,
            LeftOfFile::OperationsBefore => self.of_operations_before()?,
            LeftOfFile::Programs(programs) => self.of_programs(programs)?,
        };
        if let Some(layer) = self.first_layer {
            self.check_layer(&heights, layer)?;
        }
        Ok(LeftRegion::new(&heights, file.height_mm, file.overlap_mm))
    }

    /// Refuses stock that is higher above the first of several layers than that is thick; behind
    /// other programs of the stock, by more than the layer of its bound.
    fn check_layer(&self, heights: &[StockHeight], layer: f64) -> Result<(), Failure> {
        let of_bound = self.setup.planning_stock.error();
        let known = heights.iter().filter(|h| h.height.is_finite());
        let Some(highest) = known.max_by(|a, b| a.height.total_cmp(&b.height)) else { return Ok(()) };
        if highest.height <= layer + LAYER_ROUNDING + of_bound {
            return Ok(());
        }
        let p = highest.position;
        let from = layer + self.setup.drive_allowance;
        if self.setup.level.is_some() {
            return Err(self.job.wrong(format!(
                "operation \"{}\": levels.from_mm: at ({:.1}, {:.1}, {:.1}) the stock is {:.2} mm above the first level, more than \
                 the {from:.2} mm that it cuts; begin higher",
                self.name, p.x, p.y, p.z, highest.height
            )));
        }
        Err(self.job.wrong(format!(
            "operation \"{}\": layers.from_mm: at ({:.1}, {:.1}, {:.1}) the stock is {:.2} mm above the drive surface, more than the \
             {from:.2} mm from which the layers begin (with the allowance of its meshes); begin higher",
            self.name,
            p.x,
            p.y,
            p.z,
            highest.height + self.setup.drive_allowance
        )))
    }

    fn requested(&self) -> Result<RequestedRegion<'_>, Failure> {
        let corner_radius = corner_on_drive(self.job, self.setup);
        let strategy = self.strategy.map(|strategy| RequestedStrategy { strategy, corner_radius });
        RequestedRegion::new(self.surface, self.region, strategy).map_err(|e| (self.wrong)(e.to_string()))
    }

    /// Returns samples of the region in one place of the pattern, and their spacing, mm.
    fn samples(&self) -> Result<(Vec<RegionSample>, f64), Failure> {
        let requested = self.requested()?;
        let area_each = (requested.facet_area() * self.places.len() as f64 / MAX_SAMPLES).max(FINEST * FINEST);
        Ok((requested.samples(area_each), area_each.sqrt()))
    }

    fn of_initial_stock(&self) -> Result<Vec<StockHeight>, Failure> {
        // The outermost layers may be above all stock.
        if self.first_layer.is_none() {
            self.check_stock()?;
        }
        let (samples, spacing) = self.samples()?;
        let highest = |sample: &RegionSample| {
            let above = |place| self.surface_place(place, sample, 0.0).stock;
            self.places.iter().map(above).fold(0.0, f64::max)
        };
        Ok(samples.iter().map(|s| stock_height(s, highest(s), SAMPLE_REACH * spacing)).collect())
    }

    /// Refuses stock that has nothing above the drive surface.
    fn check_stock(&self) -> Result<(), Failure> {
        let setup = self.setup;
        if setup.stock_solid.is_some() || setup.stock_thickness > setup.drive_allowance {
            return Ok(());
        }
        let message = format!(
            "the stock of setup \"{}\" is nowhere above the drive surface (an offset of {} mm, with {} mm to be left), so none \
             is left; state the stock, or measure a rest or programs",
            setup.file.name, setup.stock_thickness, setup.drive_allowance
        );
        Err((self.wrong)(message))
    }

    /// Returns a sample in a place of the pattern, on the surface to be left, with the stock above
    /// it; without stated stock, with `reach` mm.
    fn surface_place(&self, place: &Isometry3<f64>, sample: &RegionSample, reach: f64) -> SurfacePlace {
        let normal = place * sample.normal;
        let position = place * sample.position + normal.into_inner() * self.setup.drive_allowance;
        let feed = normal.into_inner().cross(&if normal.x.abs() < 0.9 { Vector3::x() } else { Vector3::y() });
        let above = CcPoint::new(position, normal.into_inner(), feed).map_or(0.0, |cc| self.setup.stock_above(&cc));
        let is_stated = above > 0.0 || self.setup.stock_solid.is_some();
        SurfacePlace { position, normal, stock: if is_stated { above.min(MAX_HEIGHT) } else { reach } }
    }

    /// Returns the heights that the programs of the setups before leave.
    fn of_operations_before(&self) -> Result<Vec<StockHeight>, Failure> {
        let index = self.setup.index;
        let (before, why) = programs_before(&self.job.file.setups, index);
        if before.is_empty() && self.setup.file.programs_before.is_empty() {
            let message = format!("of: operations_before: setup \"{}\" has none: {why}", self.setup.file.name);
            return Err((self.wrong)(message));
        }
        if let Some(k) = before.into_iter().find(|k| self.job.programs.of(*k).is_none()) {
            let message = format!(
                "of: operations_before: the program of setup \"{}\" is not known; plan the whole job, or give it to \
                 verify or view with --after {}=FILE",
                self.job.file.setups[k].name,
                k + 1
            );
            return Err((self.wrong)(message));
        }
        let swept = swept_before(self.job, self.setup)?;
        if swept.is_empty() { self.of_initial_stock() } else { self.heights_under(&swept) }
    }

    fn of_programs(&self, programs: &[ProgramWithToolFile]) -> Result<Vec<StockHeight>, Failure> {
        let swept = |program| self.swept_by_file(program).map(Arc::new);
        let swept = programs.iter().map(swept).collect::<Result<Vec<_>, _>>()?;
        self.heights_under(&swept)
    }

    /// Returns the heights that these cutters leave.
    fn heights_under(&self, sweeps: &[Arc<SweptCutter>]) -> Result<Vec<StockHeight>, Failure> {
        let reach = sweeps.iter().map(|sweep| sweep.radius()).fold(0.0, f64::max);
        let (samples, spacing) = self.samples()?;
        let mut highest = vec![0.0_f64; samples.len()];
        for place in &self.places {
            let on: Vec<SurfacePlace> = samples.iter().map(|s| self.surface_place(place, s, reach)).collect();
            let left = left_heights(sweeps, &on, &Silent).map_err(|_| Failure::Interrupted)?;
            highest.iter_mut().zip(left).for_each(|(most, left)| *most = most.max(left.height));
        }
        let height = |(s, height): (&RegionSample, f64)| stock_height(s, height, SAMPLE_REACH * spacing);
        Ok(samples.iter().zip(highest).map(height).collect())
    }

    /// Returns all that a program of a file sweeps in this setup.
    fn swept_by_file(&self, program: &ProgramWithToolFile) -> Result<SweptCutter, Failure> {
        if self.job.second.is_some() {
            let message = "of.programs: programs of machines with two heads are not measured; cut the stock with them \
                           (verify --rest-out), and give the rest";
            return Err((self.wrong)(message.to_owned()));
        }
        let tool = tool_of_program(self.job, program).map_err(|e| match e {
            WrongTool::NotNamed => (self.wrong)(format!("of.programs: {}: {NOT_NAMED}", program.file)),
            WrongTool::Failed(failure) => failure,
        })?;
        let path = self.job.beside(&program.file);
        let job = Job { tool, ..self.job.clone() };
        let text = self.job.files.bytes(&path)?;
        let dialect = self.job.post.dialect();
        let scene = Scene::new(&job, self.setup, self.setup.index)?;
        let swept = swept_by(&read_part(&job, &path, (&text, dialect, None))?, &scene.virtual_setup(dialect), &path)?;
        if swept.n_motions() == 0 {
            let message =
                format!("has no cutting move of tool \"{}\" on this machine, so it leaves all stock", job.tool.name());
            return Err(Failure::input(&path, message));
        }
        Ok(swept)
    }

    /// Returns the heights where lines of a rest meet the region, and unknown ones on walls along
    /// the lines.
    fn of_rest(&self, name: &str) -> Result<Vec<StockHeight>, Failure> {
        let rest = read_named_rest(self.job, self.setup.index, name)?;
        let requested = self.requested()?;
        let mut heights = Vec::new();
        for place in &self.places {
            let rest = rest.clone().moved(&place.inverse());
            self.check_covered(name, &requested, &rest, place)?;
            heights.extend(self.on_lines(&requested, &rest)?);
        }
        let along = rest.grid().work_from_map().rotation * Vector3::z_axis();
        let cell = rest.grid().cell();
        let is_wall = |s: &RegionSample| self.places.iter().any(|place| (place * s.normal).dot(&along).abs() < WALL);
        let samples = requested.samples(cell * cell);
        heights
            .extend(samples.iter().filter(|s| is_wall(s)).map(|s| stock_height(s, f64::INFINITY, SAMPLE_REACH * cell)));
        Ok(heights)
    }

    fn on_lines(&self, requested: &RequestedRegion<'_>, rest: &DexelMap) -> Result<Vec<StockHeight>, Failure> {
        let surface = self.surface;
        let found = rest.deviation(rest, surface, &Silent).map_err(|e| (self.wrong)(format!("of.rest: {e}")))?;
        let (cell, along) = (rest.grid().cell(), rest.grid().work_from_map().rotation * Vector3::z_axis());
        let heights = found.places().filter(|p| requested.contains(p.triangle, &p.position)).filter_map(|p| {
            let normal = surface.facet_normal(p.triangle)?;
            let rise = normal.dot(&along).abs();
            (rise >= WALL).then(|| StockHeight {
                position: p.position,
                normal,
                height: p.deviation - self.setup.drive_allowance,
                reach: std::f64::consts::SQRT_2 * cell / rise,
                area: cell * cell / rise / self.places.len() as f64,
            })
        });
        Ok(heights.collect())
    }

    /// Refuses a rest that has no lines over some of the region, although there is stock.
    fn check_covered(
        &self,
        name: &str,
        requested: &RequestedRegion<'_>,
        rest: &DexelMap,
        place: &Isometry3<f64>,
    ) -> Result<(), Failure> {
        let stock: Aabb = StockMeshes::of(self.setup).extents();
        let (grid, map_from_work) = (rest.grid(), rest.grid().work_from_map().inverse());
        let samples = requested.samples((requested.facet_area() / COVERED_SAMPLES).max(f64::MIN_POSITIVE));
        let is_unknown = |s: &&RegionSample| {
            let (in_map, in_work): (Point3<f64>, Point3<f64>) = (map_from_work * s.position, place * s.position);
            (0..2).any(|k| {
                let beyond = in_map[k] - grid.origin()[k];
                !(-grid.cell()..=(grid.n_lines()[k] as f64 + 1.0) * grid.cell()).contains(&beyond)
            }) && (0..2).all(|k| (stock.min[k]..=stock.max[k]).contains(&in_work[k]))
        };
        match samples.iter().find(is_unknown) {
            None => Ok(()),
            Some(s) => {
                let p = place * s.position;
                let message = format!(
                    "of.rest: {name} has no lines at ({:.1}, {:.1}, {:.1}), on the region; cut all of the stock (verify \
                     --stock-region whole), or bound the region",
                    p.x, p.y, p.z
                );
                Err((self.wrong)(message))
            }
        }
    }
}

/// Returns everything that the programs before a setup's sweep, as far as they are known
/// ([`Job::programs`]): of setups with the same stock. None on a machine with two heads.
///
/// # Errors
/// If a program is not understood, or cannot be run in its setup.
pub fn swept_before(job: &Job, setup: &Setup<'_>) -> Result<Arc<Vec<Arc<SweptCutter>>>, Failure> {
    if let Some(known) = setup.swept_before.get() {
        return Ok(known.clone());
    }
    let SetupFile { work_from_part, table_from_work, work_offset, .. } = setup.file;
    let frame = blake3::hash(facemill_file_format::to_json(&(work_from_part, table_from_work, work_offset)).as_bytes());
    let of: Vec<_> = digests_before(job, setup)?.into_iter().map(|program| [program, *frame.as_bytes()]).collect();
    let known = || job.programs.swept.lock().unwrap_or_else(PoisonError::into_inner);
    let mut swept: Vec<SweptProgram> =
        known().iter().zip(&of).take_while(|(swept, of)| swept.of == **of).map(|(swept, _)| swept.clone()).collect();
    each_program_before(job, setup, swept.len(), |before| {
        // Nothing is known to be cut by a program with a fault.
        let sweep = match before.fault {
            None => Some(Arc::new(swept_by(&before.text, &before.at, before.path)?)),
            Some(_) => None,
        };
        swept.push(SweptProgram { of: of[swept.len()], sweep });
        Ok(())
    })?;
    known().clone_from(&swept);
    let swept = swept.into_iter().filter_map(|swept| swept.sweep).collect();
    Ok(setup.swept_before.get_or_init(|| Arc::new(swept)).clone())
}

/// Returns all that a program sweeps.
fn swept_by(program: &ReadProgram, at: &VirtualSetup<'_>, path: &Path) -> Result<SweptCutter, Failure> {
    swept_by_cuts(program, at, &VerifySettings::default(), MOTION_TOLERANCE, &Silent)
        .map_err(|e| Failure::input(path, e))
}

fn stock_height(sample: &RegionSample, height: f64, reach: f64) -> StockHeight {
    StockHeight { position: sample.position, normal: sample.normal, height, reach, area: sample.area }
}
