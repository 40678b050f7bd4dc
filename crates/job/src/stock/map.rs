//! Stock of a setup as lines of material.

use facemill_cl_data::Aabb;
use facemill_surface_model::TriMesh;
use facemill_virtual_machine::outside_layer;
use facemill_z_map::{DexelMap, GridError, MeshStockError, TriDexel};
use nalgebra::Isometry3;

use crate::failure::Failure;
use crate::format::job_file::StockFile;
use crate::frames::{places, pose};
use crate::load::job::{Job, Setup};
use crate::load::obstacle_meshes::ObstacleRole;
use crate::planning_stock::OwnStock;
use crate::stock::rest::Origin;

/// Region of the stock that has lines.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub enum StockRegion {
    /// All of it.
    #[default]
    Whole,
    /// The rectangle around the region that the setup's operations cut, in all places of their
    /// patterns, enlarged by the cutter's diameter, of two heads the larger one's.
    Operations,
    /// Between two corners, x and y of the workpiece frame, mm.
    Rectangle([[f64; 2]; 2]),
}

/// A setup's stock before any program, as meshes with an allowance around them.
pub struct StockMeshes {
    mesh: TriMesh,
    allowance: f64,
    is_solid: bool,
    /// Pose of the part in the frame that the job states the stock in, if that is the workpiece's.
    frame: Isometry3<f64>,
}

impl StockMeshes {
    /// Returns the stock; stock given as an allowance is part and check surfaces with the allowance
    /// around them.
    pub fn of(setup: &Setup<'_>) -> Self {
        let frame = match setup.file.stock {
            StockFile::Box(_) | StockFile::Cylinder(_) => pose(&setup.file.work_from_part),
            StockFile::Offset(_) | StockFile::Mesh(_) => Isometry3::identity(),
        };
        if let Some(own) = &setup.own_stock {
            return Self { mesh: own.mesh.clone(), allowance: own.allowance, is_solid: own.is_solid, frame };
        }
        let meshes = |roles: &[ObstacleRole]| {
            let of_role = setup.obstacles.iter().filter(|o| roles.contains(&o.role));
            of_role.fold(TriMesh::default(), |all, o| all.joined(&o.mesh))
        };
        if setup.stock_solid.is_some() {
            Self { mesh: meshes(&[ObstacleRole::Stock]), allowance: 0.0, is_solid: true, frame }
        } else {
            let allowance = setup.stock_thickness;
            Self { mesh: meshes(&[ObstacleRole::Part, ObstacleRole::Check]), allowance, is_solid: false, frame }
        }
    }

    /// Returns the same as what a setup keeps of it.
    pub(crate) fn own(self) -> OwnStock {
        OwnStock { mesh: self.mesh, allowance: self.allowance, is_solid: self.is_solid }
    }

    /// Returns the mesh of a solid; `None` of a layer on part and check surfaces.
    pub fn solid(&self) -> Option<&TriMesh> {
        self.is_solid.then_some(&self.mesh)
    }

    /// Returns the identity of the stock, which marks its maps.
    pub fn origin(&self) -> Origin {
        Origin::of(&self.mesh, self.allowance).in_frame(&self.frame)
    }

    /// Returns the box around all of it, workpiece frame.
    pub fn extents(&self) -> Aabb {
        self.mesh.aabb().dilated(self.allowance)
    }

    /// Returns the stock before anything is cut, as lines that show all of it: with a layer of half
    /// the diagonal of a cell around it.
    ///
    /// # Errors
    /// As [`map`](Self::map).
    pub fn outside(&self, job: &Job, setup: &Setup<'_>, cell: f64, region: StockRegion) -> Result<DexelMap, Failure> {
        self.with_layer(outside_layer(cell), &Isometry3::identity(), job, setup, (cell, region))
    }

    /// Returns the stock before anything is cut: lines along z of the workpiece frame, `cell` mm
    /// apart. An open mesh with an allowance becomes a layer on both sides.
    ///
    /// # Errors
    /// If a mesh of the stock is not closed, the lines are too many, or the region has no stock.
    pub fn map(&self, job: &Job, setup: &Setup<'_>, cell: f64, region: StockRegion) -> Result<DexelMap, Failure> {
        let map = self.with_layer(0.0, &Isometry3::identity(), job, setup, (cell, region))?;
        Ok(map.with_origin(self.origin().to_bytes()))
    }

    /// Returns the same on the lines of another map of this stock, such as what programs left of
    /// it.
    ///
    /// # Errors
    /// As [`map`](Self::map).
    pub fn map_on(&self, job: &Job, setup: &Setup<'_>, lines: &DexelMap) -> Result<DexelMap, Failure> {
        self.made(job, setup, lines.grid().cell(), |is_closed| {
            DexelMap::of_mesh_on(&self.mesh, lines.grid(), (self.allowance, is_closed))
        })
    }

    /// Returns the same on lines along x and along y of the workpiece frame, of all of the stock.
    ///
    /// # Errors
    /// As [`map`](Self::map).
    pub fn across(&self, job: &Job, setup: &Setup<'_>, cell: f64) -> Result<[DexelMap; 2], Failure> {
        let [along_x, along_y, _] = TriDexel::frames();
        let along = |frame| self.with_layer(0.0, frame, job, setup, (cell, StockRegion::Whole));
        Ok([along(&along_x)?, along(&along_y)?])
    }

    /// Returns the stock with a layer of this thickness (mm) around it, as lines along z of a
    /// frame.
    fn with_layer(
        &self,
        layer: f64,
        frame: &Isometry3<f64>,
        job: &Job,
        setup: &Setup<'_>,
        (cell, region): (f64, StockRegion),
    ) -> Result<DexelMap, Failure> {
        let (mesh, allowance) = (&self.mesh, self.allowance + layer);
        self.made(job, setup, cell, |is_closed| match rectangle(job, setup, region) {
            Some(region) => DexelMap::of_mesh_within(mesh, frame, cell, (allowance, is_closed), region),
            None if is_closed => DexelMap::of_mesh_with_allowance(mesh, frame, cell, allowance),
            None => DexelMap::of_layer(mesh, frame, cell, allowance),
        })
    }

    /// Returns the lines that `made` returns for a solid, or for a layer on open surfaces, with
    /// their faults in words.
    fn made(
        &self,
        job: &Job,
        setup: &Setup<'_>,
        cell: f64,
        made: impl Fn(bool) -> Result<DexelMap, MeshStockError>,
    ) -> Result<DexelMap, Failure> {
        let found = match made(true) {
            // A layer on open surfaces; of a solid that is not closed the inside is not known.
            Err(MeshStockError::NotClosed { .. }) if self.allowance > 0.0 => made(false),
            found => found,
        };
        let wrong = |why: String| job.wrong(format!("setup \"{}\": stock: {why}", setup.file.name));
        let map = found.map_err(|e| {
            let is_of_cell = matches!(e, MeshStockError::Grid(GridError::TooManyLines { .. }));
            let option = if is_of_cell { OF_CELL } else { "" };
            wrong(format!("{e}{option}"))
        })?;
        if map.volume() > 0.0 {
            return Ok(map);
        }
        Err(wrong(format!("none of its lines, {cell} mm apart, meets material{OF_CELL}")))
    }
}

/// Options that set the distance of the lines.
const OF_CELL: &str = " (--stock-cell-mm, in a plan verification.stock_cell_mm)";

/// Returns the rectangle around a known one and what the operations of further setups cut, each
/// with its own tool, in one workpiece frame; `None` if one of them cuts nothing.
///
/// # Errors
/// If a setup cannot be read.
pub fn rectangle_with(
    job: &Job,
    known: Option<[[f64; 2]; 2]>,
    setups: impl IntoIterator<Item = usize>,
) -> Result<Option<[[f64; 2]; 2]>, Failure> {
    let mut all = known;
    for k in setups {
        let job = job.for_setup(k);
        let Some(own) = rectangle(&job, &Setup::read(&job, k)?, StockRegion::Operations) else { return Ok(None) };
        all = Some(all.map_or(own, |all| around(all, own)));
    }
    Ok(all)
}

/// Returns the rectangle around two.
fn around(a: [[f64; 2]; 2], b: [[f64; 2]; 2]) -> [[f64; 2]; 2] {
    [[0, 1].map(|k| a[0][k].min(b[0][k])), [0, 1].map(|k| a[1][k].max(b[1][k]))]
}

/// Returns the low and high corner of a region; `None` for all of the stock.
pub fn rectangle(job: &Job, setup: &Setup<'_>, region: StockRegion) -> Option<[[f64; 2]; 2]> {
    match region {
        StockRegion::Whole => None,
        StockRegion::Rectangle(corners) => Some(corners),
        StockRegion::Operations => {
            let drive = setup.drive.mesh();
            let of_operation = job.operations_of(setup.file).flat_map(|(_, o)| places(o.pattern.as_ref()));
            let of_place = of_operation.map(|place| drive.transformed(&place).aabb());
            let tools = [&job.tool].into_iter().chain(job.second.iter().map(|second| &second.tool));
            let margin = tools.map(|tool| 2.0 * tool.cutter().radius()).fold(0.0, f64::max);
            let Aabb { min, max } = of_place.reduce(|a, b| a.union(&b))?.dilated(margin);
            Some([[min.x, min.y], [max.x, max.y]])
        }
    }
}
