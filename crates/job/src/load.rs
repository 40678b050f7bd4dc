//! From a job file to everything it names, checked.

pub mod job_settings;
pub mod job_source;
pub mod machine_load;
#[cfg(test)]
mod machine_load_laws;
pub mod mesh_files;
pub mod mesh_winding;
pub mod obstacle_meshes;
pub mod open_meshes;
pub mod post_block_words;
pub mod post_load;
pub mod post_probe;
pub mod stand;

use std::path::{Path, PathBuf};

use facemill_cl_data::{Aabb, CcPoint, CuttingLaw, PlacedSolid};
use facemill_inverse_kinematics::{AxisKind, BlockLaw, BodyPose, Carrier, Machine};
use facemill_nc_program::{AxisWords, FeedMode, LAST_PROGRAM_NUMBER, PostSettings, ReadError, RtcpRapids, WorkOffset};
use facemill_surface_model::{Group, Surface, SurfaceSettings, TriMesh};
use facemill_tool_model::ToolAssembly;
use facemill_tool_path::links::LinkScene;
use nalgebra::{Isometry3, Translation3, Unit, UnitQuaternion, Vector3};

use crate::check::enclosure::check_enclosure;
use crate::check::limits::check_cutter_width;
use crate::check::part_size::unit_inside;
use crate::check::validate::{belongs, check_feeds, check_gouge_tolerances, check_heads, check_rounding};
use crate::check::validate_feeds::check_chip_thickness;
use crate::failure::Failure;
use crate::files;
use crate::format::job_file::{JobFile, OperationFile, PoseFile, RoleFile, SetupFile, StockFile};
use crate::format::report::MeshReport;
use crate::load::job_settings::JobSetting;
use crate::load::job_source::{blamed, job_path, read_job_file};
use crate::load::machine_load::read_machine;
use crate::load::mesh_files::{FileKey, MeshFiles};
use crate::load::obstacle_meshes::{
    ObstacleMesh, ObstacleRole, Selection, joined_obstacles, matches_pattern, obstacle, only, select_also,
    selected_groups, table_bodies,
};
use crate::load::post_load::read_post;
use crate::setup::clearance_surface::clearance_surface;
use crate::stock::stock_mesh;

/// A job with its tool, machine and post read.
#[derive(Clone)]
pub struct Job {
    /// The job file.
    pub path: PathBuf,
    /// What it says.
    pub file: JobFile,
    /// Its tool.
    pub tool: ToolAssembly,
    /// Its machine; of one with two heads, as the first head sees it.
    pub machine: Machine,
    /// Its post.
    pub post: PostSettings,
    /// The second head of its machine, where it has one.
    pub second: Option<SecondHead>,
    /// Values that were put in place of those of the file.
    pub settings: Vec<JobSetting>,
}

/// Where the axes stand at the reference position, in the unit of words.
fn home_words(machine: &Machine) -> Result<AxisWords, Failure> {
    let mut words = AxisWords::new();
    for (k, axis) in machine.axes().iter().enumerate() {
        let value = axis.in_word_unit(machine.home()[k]);
        words
            .set(crate::setup::word_map::letter(axis.letter.as_str())?, value)
            .map_err(|e| Failure::Internal(e.to_string()))?;
    }
    Ok(words)
}

/// What the second head of a machine has of its own.
#[derive(Clone)]
pub struct SecondHead {
    /// Its tool.
    pub tool: ToolAssembly,
    /// The machine as it sees it.
    pub machine: Machine,
}

impl Job {
    /// Reads a job file, or `job.json` of a folder, with its tool, machine and template.
    ///
    /// # Errors
    /// When a file cannot be read or is wrong; the message names file, field and line.
    pub fn read(path: &Path) -> Result<Self, Failure> {
        Self::read_with(path, &[])
    }

    /// Reads a job as [`Job::read`] does, with these values in place of those of the file.
    ///
    /// # Errors
    /// As [`Job::read`]; a message about a value that was set names the setting.
    pub fn read_with(path: &Path, settings: &[JobSetting]) -> Result<Self, Failure> {
        let path = &job_path(path);
        let file = read_job_file(path, settings)?;
        files::enter_job(path);
        let job = Self::of(path, file).map_err(|e| blamed(settings, path, e))?;
        Ok(Self { settings: settings.to_vec(), ..job })
    }

    /// A job with the tool, machine and template that its checked file names, relative to `path`, which errors name, too.
    ///
    /// # Errors
    /// As [`Job::read`].
    pub fn of(path: &Path, file: JobFile) -> Result<Self, Failure> {
        let beside = |name: &str| path.parent().unwrap_or(Path::new("")).join(name);
        mesh_names(&file).for_each(|name| files::note_input(&beside(name)));
        let tool_path = beside(&file.tool);
        let tool =
            ToolAssembly::from_json(&files::read_named_text(&tool_path)?).map_err(|e| Failure::input(&tool_path, e))?;
        check_gouge_tolerances(&file, 1, tool.cutter().radius()).map_err(|e| Failure::input(path, e))?;
        let machine_path = beside(&file.machine);
        let mut heads = read_machine(&machine_path)?.heads;
        check_heads(&file, heads.len()).map_err(|e| Failure::input(path, e))?;
        let mut second = None;
        if let (2, Some(name)) = (heads.len(), &file.second_tool) {
            let tool_path = beside(name);
            let tool = ToolAssembly::from_json(&files::read_named_text(&tool_path)?)
                .map_err(|e| Failure::input(&tool_path, e))?;
            check_gouge_tolerances(&file, 2, tool.cutter().radius()).map_err(|e| Failure::input(path, e))?;
            second = Some(SecondHead { tool, machine: heads.swap_remove(1) });
        }
        let machine = heads.swap_remove(0);
        check_feeds(&file, &machine.feed_range()).map_err(|e| Failure::input(path, e))?;
        let tools = std::iter::once(&tool).chain(second.iter().map(|s| &s.tool));
        for (head, tool) in (1..).zip(tools) {
            check_chip_thickness(&file, head, tool.n_inserts(), &machine.feed_range())
                .map_err(|e| Failure::input(path, e))?;
            let name = if head == 1 { Some(&file.tool) } else { file.second_tool.as_ref() };
            check_cutter_width(&machine, tool).map_err(|e| Failure::input(&beside(name.map_or("", |n| n)), e))?;
        }
        let post = read_post(path, &file)?;
        if let (Some(_), Some(name)) = (&second, &file.post.dialect_file) {
            let message =
                format!("post.dialect_file: {name}: two heads are programmed by the dialect's own file alone");
            return Err(Failure::input(path, message));
        }
        if post.program_number() as usize + file.setups.len() - 1 > LAST_PROGRAM_NUMBER as usize {
            let message = format!("post.program_number: {} leaves no numbers for all setups", post.program_number());
            return Err(Failure::input(path, message));
        }
        check_rounding(&file, &post.rounding_bound()).map_err(|e| Failure::input(path, e))?;
        if file.operations.is_empty() {
            // Nothing is written, so that the control need not move as the machine file says.
            return Ok(Self { path: path.to_owned(), file, tool, machine, post, second, settings: Vec::new() });
        }
        if post.feed_mode() == FeedMode::Rtcp && machine.motion_law().cutting == CuttingLaw::AxesLinear {
            let message = "post.feed_mode: rtcp needs a machine whose motion.cutting is tip_and_rotaries_linear or \
                           tip_linear_vector_turned, because that is what the control then does; its is axes_linear";
            return Err(Failure::input(path, message));
        }
        let home = home_words(&machine)?;
        let post =
            post.on_machine(machine.motion_law(), home).map_err(|e| Failure::input(path, format!("post.{e}")))?;
        Ok(Self { path: path.to_owned(), file, tool, machine, post, second, settings: Vec::new() })
    }

    /// What the control does in the rapids of a program, between the first position and the way home: under RTCP with a control
    /// that keeps the tip straight at rapid rate, too, the law of its cuts, else the machine's law of rapids.
    pub fn rapid_law(&self) -> BlockLaw {
        match self.post.rtcp_rapids() {
            Some(RtcpRapids::TipLinear) => self.post.cutting_law().into(),
            Some(RtcpRapids::BySetting) | None => self.machine.motion_law().rapid.into(),
        }
    }

    /// A file named in the job, relative to the job file.
    pub fn beside(&self, name: &str) -> PathBuf {
        self.path.parent().unwrap_or(Path::new("")).join(name)
    }

    /// The job as one of the machine's two heads sees it (0 or 1): its tool, its clearance surfaces, and its view of the machine
    /// with the other one's tool, thicker by `apart` mm, where that is above 0 with what the control may stray added to the
    /// clearances of the head. With one head it is the job itself.
    pub fn seen_by(&self, head: usize, apart: f64) -> Self {
        let mut file = self.file.clone();
        let Some(second) = &self.second else { return self.clone() };
        let first = (&self.tool, &self.machine);
        let second = (&second.tool, &second.machine);
        let ((tool, machine), (other, _)) = if head == 0 { (first, second) } else { (second, first) };
        if head == 1 {
            for setup in &mut file.setups {
                setup.clearance = setup.second_clearance.clone().unwrap_or_else(|| setup.clearance.clone());
            }
        }
        let thicker = |body: PlacedSolid| PlacedSolid { solid: body.solid.dilated(apart), ..body };
        let other_tool: Vec<PlacedSolid> = other.whole().into_iter().map(thicker).collect();
        let straying = if apart > 0.0 { straying(machine, tool.gauge_length()) } else { 0.0 };
        let machine = machine
            .with_more_clearance(|body| if body.carrier() == Some(Carrier::Head) { straying } else { 0.0 })
            .with_tool_in_other_head(&other_tool, other.gauge_length());
        Self { file, tool: tool.clone(), machine, ..self.clone() }
    }

    /// An error about the job file.
    pub fn wrong(&self, message: impl ToString) -> Failure {
        Failure::input(&self.path, message)
    }

    /// Its own program could not be read back: the fault of the job's own template or dialect file, where it has one.
    pub fn unread(&self, why: &ReadError) -> Failure {
        let (post, reader) = (&self.file.post, self.post.dialect().name());
        match post.template.as_ref().or(post.dialect_file.as_ref()) {
            Some(name) => self.wrong(format!(
                "post: what is written with {name} the reader of `{reader}` does not understand, so it cannot be verified: {why}"
            )),
            None => Failure::Internal(format!("own program: {why}")),
        }
    }

    /// The operations of a setup, with their index in the job.
    pub fn operations_of<'a>(&'a self, setup: &'a SetupFile) -> impl Iterator<Item = (usize, &'a OperationFile)> {
        self.file.operations.iter().enumerate().filter(|(_, o)| belongs(o, setup, &self.file))
    }
}

/// A setup with its meshes read, in the workpiece frame.
pub struct Setup<'a> {
    /// What the job says.
    pub file: &'a SetupFile,
    /// What the passes cut, alone: for paths that are projected on it.
    pub drive: Surface,
    /// The whole files that the drive surface is in: normals and curvatures at its border know what lies beyond.
    pub around_drive: Surface,
    /// Groups of `around_drive` that are the drive surface.
    pub drive_groups: Vec<String>,
    /// Files of `around_drive` in their order, with their number of triangles.
    pub drive_files: Vec<(FileKey, usize)>,
    /// Everything that must not be cut or hit.
    pub obstacles: Vec<ObstacleMesh>,
    /// Thickness of the stock on part and check surfaces, mm; 0 where the stock is a solid of its own.
    pub stock_thickness: f64,
    /// The stock, where it is a solid of its own.
    pub stock_solid: Option<Surface>,
    /// Material that is left on the drive surface, mm.
    pub drive_allowance: f64,
    /// Pose of the workpiece frame on the table.
    pub table_from_work: Isometry3<f64>,
    /// Work offset register.
    pub work_offset: WorkOffset,
    /// What was found in the files.
    pub reports: Vec<MeshReport>,
}

impl<'a> Setup<'a> {
    /// Reads the meshes of a setup.
    ///
    /// # Errors
    /// When a file cannot be read or is wrong, or groups do not exist.
    pub fn read(job: &'a Job, index: usize) -> Result<Self, Failure> {
        let file = &job.file.setups[index];
        let work_from_part = pose(&file.work_from_part);
        let mut read_files = MeshFiles::of(job);
        let mut drive: Option<TriMesh> = None;
        let mut selections: Vec<Selection> = Vec::new();
        for (k, entry) in file.meshes.iter().enumerate() {
            let at = format!("setups[{index}].meshes[{k}]");
            let file = FileKey::from(entry);
            let mesh = &read_files.get(&file)?.mesh;
            let selected = selected_groups(job, &at, entry, mesh)?;
            if entry.role == RoleFile::Drive {
                let mesh = only(mesh, &selected).transformed(&work_from_part);
                drive = Some(match drive {
                    Some(before) => before.joined(&mesh),
                    None => mesh,
                });
            }
            let role = match entry.role {
                RoleFile::Drive | RoleFile::Part => ObstacleRole::Part,
                RoleFile::Check => ObstacleRole::Check,
                RoleFile::Fixture => ObstacleRole::Fixture,
            };
            select_also(&mut selections, Selection { role, allowance: entry.allowance_mm, file, groups: selected });
        }
        let drive = drive.ok_or_else(|| job.wrong(format!("setups[{index}].meshes: no drive surface")))?;
        let (around_drive, drive_groups, drive_files) = around_drive(file, &read_files, &work_from_part);
        let mut obstacles = joined_obstacles(&selections, &read_files, &work_from_part);
        let mut stock_solid = None;
        let stock_thickness = match &file.stock {
            StockFile::Offset(offset) => offset.allowance_mm,
            solid => {
                let mesh = match solid {
                    StockFile::Mesh(m) => read_files.get(&FileKey::from(m))?.mesh.transformed(&work_from_part),
                    other => stock_mesh(other),
                };
                stock_solid = Some(Surface::new(mesh.clone(), SurfaceSettings::default()));
                obstacles.push(obstacle(ObstacleRole::Stock, 0.0, "stock".to_owned(), mesh));
                0.0
            }
        };
        let reports = read_files.reports();
        check_enclosure(&format!("setups[{index}]"), file, stock_thickness, &obstacles).map_err(|e| {
            let clearance = clearance_surface(&file.clearance);
            let unit = reports.first().map(|r| r.unit);
            let advice = unit.and_then(|unit| unit_inside(job, unit, &obstacles, &work_from_part, &clearance));
            job.wrong(advice.map_or_else(|| e.clone(), |advice| format!("{advice} As it is: {e}")))
        })?;
        let table_from_work = pose(&file.table_from_work);
        obstacles.extend(table_bodies(&job.machine, &table_from_work));
        Ok(Self {
            file,
            drive: Surface::new(drive, SurfaceSettings::default()),
            around_drive: Surface::new(around_drive, SurfaceSettings::default()),
            drive_groups,
            drive_files,
            obstacles,
            stock_thickness,
            stock_solid,
            drive_allowance: file.meshes.iter().find(|m| m.role == RoleFile::Drive).map_or(0.0, |m| m.allowance_mm),
            table_from_work,
            work_offset: work_offset(&file.work_offset.register).ok_or_else(|| {
                job.wrong(format!(
                    "setups[{index}].work_offset.register: must be G54 to G59 or G54.1 P1 to P300, is \"{}\"",
                    file.work_offset.register
                ))
            })?,
            reports,
        })
    }

    /// How the setup's program is written: numbered on from the job's number, setup by setup.
    pub fn post(&self, job: &Job) -> PostSettings {
        let before = job.file.setups.iter().take_while(|s| s.name != self.file.name).count();
        job.post.with_number_after(before as u32)
    }

    /// Thickness of the stock along the normal at a CC point, mm, before anything is cut; 0 where there is none.
    pub fn stock_above(&self, cc: &CcPoint) -> f64 {
        match &self.stock_solid {
            None => (self.stock_thickness - self.drive_allowance).max(0.0),
            Some(solid) => solid
                .ray_all(&cc.position, &cc.normal, f64::INFINITY)
                .iter()
                .find(|hit| !hit.from_outside)
                .map_or(0.0, |hit| hit.point.distance),
        }
    }

    /// Machine, tool and workpiece for links.
    pub fn link_scene<'j>(&self, job: &'j Job) -> LinkScene<'j> {
        LinkScene {
            machine: &job.machine,
            tool_length: job.tool.gauge_length(),
            table_from_work: self.table_from_work,
            clearance: clearance_surface(&self.file.clearance),
        }
    }

    /// Smallest box around everything that stands on the table.
    pub fn aabb(&self) -> Aabb {
        self.obstacles.iter().fold(Aabb::EMPTY, |b, o| b.union(&o.mesh.aabb()))
    }
}

/// Pose of the file as a transform.
pub fn pose(file: &PoseFile) -> Isometry3<f64> {
    let rotation = UnitQuaternion::from_axis_angle(&direction(&file.rotation_axis), file.rotation_deg.to_radians());
    Isometry3::from_parts(Translation3::from(file.translation_mm), rotation)
}

/// A direction that has been validated as one.
pub fn direction(v: &[f64; 3]) -> Unit<Vector3<f64>> {
    Unit::try_new(Vector3::from(*v), 0.0).unwrap_or_else(Vector3::z_axis)
}

fn work_offset(register: &str) -> Option<WorkOffset> {
    (1..=WorkOffset::MAX).filter_map(WorkOffset::new).find(|w| w.to_string() == register)
}

/// All files with a drive surface, joined, the names of the groups that are it, and the files with their numbers of triangles.
fn around_drive(
    file: &SetupFile,
    files: &MeshFiles<'_>,
    work_from_part: &Isometry3<f64>,
) -> (TriMesh, Vec<String>, Vec<(FileKey, usize)>) {
    let mut around = TriMesh::default();
    let mut names = Vec::new();
    let mut seen: Vec<(FileKey, usize)> = Vec::new();
    for entry in file.meshes.iter().filter(|m| m.role == RoleFile::Drive) {
        let key = FileKey::from(entry);
        let Some(imported) = files.read.get(&key) else { continue };
        if !seen.iter().any(|(known, _)| *known == key) {
            around = around.joined(&imported.mesh.transformed(work_from_part));
            seen.push((key, imported.mesh.triangles().len()));
        }
        let drives = |g: &&Group| {
            entry.groups.as_ref().is_none_or(|patterns| patterns.iter().any(|p| matches_pattern(p, &g.name)))
        };
        names.extend(imported.mesh.groups().iter().filter(drives).map(|g| g.name.clone()));
    }
    names.sort_unstable();
    names.dedup();
    (around, names, seen)
}

/// The mesh files that a job names.
fn mesh_names(file: &JobFile) -> impl Iterator<Item = &str> {
    file.setups.iter().flat_map(|setup| {
        let stock = if let StockFile::Mesh(mesh) = &setup.stock { Some(mesh.file.as_str()) } else { None };
        setup.meshes.iter().map(|mesh| mesh.file.as_str()).chain(stock)
    })
}

/// By how much the bodies of a head may be beside their planned way, mm: a certificate counts the control's
/// tolerance in, so stands at the very clearance could not be proven.
fn straying(machine: &Machine, gauge_length: f64) -> f64 {
    let home = machine.home();
    let tip = machine.cl_point(&home, gauge_length).tip;
    let farthest = |at: BodyPose<'_>| {
        let around = at.body.body.solid.aabb();
        let to_tip = (at.table_from_solid * around.center() - tip).norm() + around.half_extents().norm();
        if at.body.carrier() == Some(Carrier::Head) { to_tip } else { 0.0 }
    };
    let reach = machine.body_poses(&home).map(farthest).fold(0.0, f64::max);
    let rotaries = machine.axes().iter().filter(|a| a.kind == AxisKind::Rotary).count();
    let tolerance = machine.motion_law().control_tolerance;
    tolerance.path + rotaries as f64 * tolerance.orientation * reach
}

/// Distance that the two tools keep from each other at planned stands, mm: what moves between them is run and proven.
pub const HEADS_APART: f64 = 1.0;
