//! Jobs as read, and their setups.

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, OnceLock};

use facemill_cc_path::LeftRegion;
use facemill_cc_path::strategies::Region;
use facemill_cl_data::{Aabb, CcPoint, PlacedSolid};
use facemill_inverse_kinematics::{AxisKind, BlockLaw, BodyPose, Carrier, Machine};
use facemill_level_region::{Level, LevelRoom, Standing};
use facemill_mesh_store::{MeshSharing, SharedMeshes};
use facemill_nc_program::dialect::RtcpRapids;
use facemill_nc_program::read::ReadError;
use facemill_nc_program::{Dialect, PostSettings, ReadProgram, WorkOffset};
use facemill_surface_model::{RayHit, Surface};
use facemill_tool_model::ToolAssembly;
use facemill_virtual_machine::VerifySettings;
use facemill_z_map::SweptCutter;
use nalgebra::Isometry3;

use crate::failure::Failure;
use crate::format::job_file::{JobFile, OperationFile, SetupFile};
use crate::format::job_settings::JobSetting;
use crate::format::report::MeshReport;
use crate::load::job_files::JobFiles;
use crate::load::mesh_files::FileKey;
use crate::load::obstacle_meshes::{ObstacleMesh, ObstacleRole};
use crate::planning_stock::{CutStock, OwnStock, PlanningStock};
use crate::validate::setup_names::belongs;
use crate::validate::tools::{ONLY_TOOL, tool_of, tool_of_setup};

/// Job with its tool, machine and post.
#[derive(Clone)]
pub struct Job {
    /// The job file.
    pub path: PathBuf,
    /// Its content, with one tool in each setup: a setup with several is one for each.
    pub file: JobFile,
    /// Its tool; of a job with several, that of the setup that this view is of
    /// ([`for_setup`](Self::for_setup)).
    pub tool: ToolAssembly,
    /// Its tools by name, if it has several.
    pub tools: NamedTools,
    /// Its machine; of a machine with two heads, the view of the first head.
    pub machine: Machine,
    /// The machine that its postures are planned for: the head keeps more clearance, so that
    /// certificates, which add the control's deviation, can prove them.
    pub planned_machine: Machine,
    /// Its post.
    pub post: PostSettings,
    /// The second head of its machine, if it has one.
    pub second: Option<SecondHead>,
    /// Settings that replaced values of the file.
    pub settings: Vec<JobSetting>,
    /// The files that it names.
    pub files: JobFiles,
    /// Programs of its setups, as far as they are written.
    pub programs: WrittenPrograms,
    /// Meshes that its setups have in common.
    pub meshes: SharedMeshes,
}

/// Programs of a job's setups, as far as they are written: for operations on what those before them
/// leave.
#[derive(Clone, Default)]
pub struct WrittenPrograms {
    /// Programs by the index of the setup; `None` of a setup without one.
    by_setup: BTreeMap<usize, Option<Arc<KnownProgram>>>,
    /// Bound of the stock that some first programs leave, so that each program cuts it once.
    pub(crate) cut: Arc<Mutex<Option<CutStock>>>,
    /// Sweeps of some first programs, so that each is run once for them in a workpiece frame.
    pub(crate) swept: Arc<Mutex<Vec<SweptProgram>>>,
}

/// Everything that a program before a setup sweeps.
#[derive(Clone)]
pub(crate) struct SweptProgram {
    /// Digests of the program, and of the setup's workpiece frame.
    pub(crate) of: [[u8; 32]; 2],
    /// The sweep; `None` of a program with a fault.
    pub(crate) sweep: Option<Arc<SweptCutter>>,
}

/// Program of a setup.
pub(crate) struct KnownProgram {
    /// File, for errors.
    pub(crate) path: PathBuf,
    pub(crate) text: Vec<u8>,
    /// Control that it is for.
    pub(crate) dialect: Dialect,
    /// Number of the tool change, from 0, whose part it is; `None`: all of it.
    pub(crate) section: Option<usize>,
}

impl WrittenPrograms {
    /// Adds the program of a setup, for a control, in the place of one that it has; `None` where
    /// nothing is to be cut in it.
    pub fn add(&mut self, setup: usize, program: Option<(PathBuf, Vec<u8>)>, dialect: Dialect) {
        let program = program.map(|(path, text)| Arc::new(KnownProgram { path, text, dialect, section: None }));
        self.by_setup.insert(setup, program);
    }

    /// Adds the program of a setup as the part of a program that changes tools: that of the tool
    /// change of this number, from 0.
    pub fn add_section(&mut self, setup: usize, (path, text): (PathBuf, Vec<u8>), dialect: Dialect, section: usize) {
        let program = KnownProgram { path, text, dialect, section: Some(section) };
        self.by_setup.insert(setup, Some(Arc::new(program)));
    }

    /// Returns the program of a setup; `None` if it is not known, `Some(None)` if the setup has
    /// none.
    pub(crate) fn of(&self, setup: usize) -> Option<Option<&KnownProgram>> {
        self.by_setup.get(&setup).map(|program| program.as_deref())
    }
}

/// Tools of a job by name, and the setup whose tool a view of the job has.
#[derive(Clone, Default)]
pub struct NamedTools {
    /// Tools by name; none in a job with one tool file.
    by_name: Arc<BTreeMap<String, ToolAssembly>>,
    /// Index of the setup that the view is of, if it is of one.
    seen_from: Option<usize>,
    /// Index of each setup in the job file as it is written, if it is another one.
    written: Arc<Vec<usize>>,
    /// The job's own tool, or its first one.
    as_read: Option<Arc<ToolAssembly>>,
}

impl NamedTools {
    pub(crate) fn new(by_name: BTreeMap<String, ToolAssembly>, written: Vec<usize>, first: ToolAssembly) -> Self {
        let as_read = Some(Arc::new(first));
        Self { by_name: Arc::new(by_name), seen_from: None, written: Arc::new(written), as_read }
    }
}

/// Tool and machine view of the second head of a machine.
#[derive(Clone)]
pub struct SecondHead {
    /// Its tool.
    pub tool: ToolAssembly,
    /// The machine as this head sees it.
    pub machine: Machine,
}

impl Job {
    /// Lets setups that are read from now on share their meshes, as long as the result is there.
    /// Mesh files are then read once.
    pub fn share_meshes(&self) -> MeshSharing {
        self.meshes.share()
    }

    /// Returns the control's law of motion in the rapids of a program, between the first position
    /// and the move home: the law of its cuts under RTCP with a control that keeps the tip straight
    /// at rapid rate, too, else the machine's law of rapids.
    pub fn rapid_law(&self) -> BlockLaw {
        match self.post.rtcp_rapids() {
            Some(RtcpRapids::TipLinear) => self.post.cutting_law().into(),
            Some(RtcpRapids::BySetting) | None => self.machine.motion_law().rapid.into(),
        }
    }

    /// Returns the path of a file named in the job, relative to the job file.
    pub fn beside(&self, name: &str) -> PathBuf {
        self.path.parent().unwrap_or(Path::new("")).join(name)
    }

    /// Returns the job as one of the machine's two heads sees it (0 or 1): its tool, its clearance
    /// surfaces, and its view of the machine with the other head's tool, thicker by `apart` mm. If
    /// `apart` is above 0, adds the control's deviation to the clearances of the head. With one
    /// head, returns the job itself.
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
        let machine =
            with_more_around_head(machine, |_| straying).with_tool_in_other_head(&other_tool, other.gauge_length());
        Self { file, tool: tool.clone(), planned_machine: machine.clone(), machine, ..self.clone() }
    }

    /// Returns the job as one of its setups sees it: with the tool of this setup. A view of the
    /// same setup keeps its tool, also one that was put in its place; with one tool, returns the
    /// job itself.
    pub fn for_setup(&self, index: usize) -> Self {
        let mut view = self.clone();
        if self.tools.by_name.len() > 1 && self.tools.seen_from != Some(index) {
            let name = self.file.setups.get(index).and_then(|setup| tool_of_setup(&self.file, setup));
            if let Some(tool) = name.and_then(|name| self.tools.by_name.get(name)) {
                view.tool = tool.clone();
                view.tools.seen_from = Some(index);
            }
        }
        view
    }

    /// Returns the job with the tool that it was read with: of several, with the first one.
    pub(crate) fn as_read(&self) -> Self {
        let mut view = self.clone();
        if let Some(tool) = &self.tools.as_read {
            view.tool = (**tool).clone();
        }
        view.tools.seen_from = None;
        view
    }

    /// Checks that this view has the tool of a setup.
    pub(crate) fn check_tool_of(&self, index: usize) -> Result<(), Failure> {
        if self.tools.by_name.len() < 2 || self.tools.seen_from == Some(index) {
            return Ok(());
        }
        Err(Failure::Internal(format!("the tool of setup {} was not chosen among the tools of the job", index + 1)))
    }

    /// Returns the setups of the job file as it is written, each with its name there and the
    /// indices of its setups with one tool.
    pub fn clampings(&self) -> Vec<(String, Range<usize>)> {
        let written = |k: usize| self.tools.written.get(k).copied().unwrap_or(k);
        let mut all: Vec<(String, Range<usize>)> = Vec::new();
        for (k, setup) in self.file.setups.iter().enumerate() {
            match all.last_mut() {
                Some((_, of)) if written(of.start) == written(k) => of.end = k + 1,
                _ => all.push((setup.name.clone(), k..k + 1)),
            }
        }
        for (name, of) in all.iter_mut().filter(|(_, of)| of.len() > 1) {
            // Behind the name as it is written are the number and the tool.
            let first = &self.file.setups[of.start];
            let tool = tool_of_setup(&self.file, first).unwrap_or(ONLY_TOOL);
            *name = first.name.strip_suffix(&format!(" 1 {tool}")).unwrap_or(name).to_owned();
        }
        all
    }

    /// Returns the parts of a program of the clamping that a setup belongs to: one for each tool,
    /// or, where a tool comes more than once, one for each tool change.
    pub fn parts_of(&self, program: &ReadProgram, setup: usize) -> Vec<ReadProgram> {
        let of_clamping = self.clampings().into_iter().map(|(_, of)| of).find(|of| of.contains(&setup));
        let of_clamping = of_clamping.unwrap_or(setup..setup + 1);
        let tools: Vec<Option<&str>> =
            self.file.setups[of_clamping].iter().map(|setup| tool_of_setup(&self.file, setup)).collect();
        if (1..tools.len()).any(|k| tools[..k].contains(&tools[k])) {
            program.change_sections()
        } else {
            program.tool_sections()
        }
    }

    /// Returns the key of a setup in the job file as it is written: `setups[0]`.
    pub fn setup_key(&self, index: usize) -> String {
        format!("setups[{}]", self.tools.written.get(index).unwrap_or(&index))
    }

    /// Returns the tool of an operation; on a machine with two heads that of head 1.
    pub(crate) fn tool_of(&self, operation: &OperationFile) -> &ToolAssembly {
        tool_of(&self.file, operation).and_then(|name| self.tools.by_name.get(name)).unwrap_or(&self.tool)
    }

    /// Returns the name in `tools` of a setup's tool; `None` in a job with one tool file.
    pub fn tool_name(&self, setup: usize) -> Option<&str> {
        self.file.setups.get(setup).and_then(|setup| tool_of_setup(&self.file, setup))
    }

    /// Returns all tools of the job: of both heads, or by name.
    pub fn all_tools(&self) -> impl Iterator<Item = &ToolAssembly> {
        let named = self.tools.by_name.values();
        let own = Some(&self.tool).filter(|_| self.tools.by_name.is_empty());
        own.into_iter().chain(named).chain(self.second.iter().map(|second| &second.tool))
    }

    /// Returns an error about the job file.
    pub fn wrong(&self, message: impl ToString) -> Failure {
        Failure::input(&self.path, message)
    }

    /// Returns the error for its own program that could not be read back: the fault of the job's
    /// own template or dialect file, if it has one.
    pub fn unread(&self, why: &ReadError) -> Failure {
        let (post, reader) = (&self.file.post, self.post.dialect().name());
        match post.template.as_ref().or(post.dialect_file.as_ref()) {
            Some(name) => self.wrong(format!(
                "post: the reader of `{reader}` does not understand the program written with {name}, so it cannot be verified: {why}"
            )),
            None => Failure::Internal(format!("own program: {why}")),
        }
    }

    /// Returns the operations of a setup, with their index in the job.
    pub fn operations_of<'a>(&'a self, setup: &'a SetupFile) -> impl Iterator<Item = (usize, &'a OperationFile)> {
        self.file.operations.iter().enumerate().filter(|(_, o)| belongs(o, setup, &self.file))
    }
}

/// Region of a setup's drive surface, continued beyond its border.
pub struct ExtendedRegion {
    /// Groups and cone of the region.
    pub region: Region,
    /// Width of the surface beyond its border, mm.
    pub width: f64,
    /// The region's triangles, with those beyond its border.
    pub surface: Surface,
}

/// Level of roughing that is the drive surface of a setup, as far as its tool reaches it.
pub struct SetupLevel {
    /// The level.
    pub level: Level,
    /// Plane that its passes are laid on, in place of a region beyond a border.
    pub passes: Arc<ExtendedRegion>,
    /// Distance that passes keep from what is on it, besides the allowances, mm.
    pub margin: f64,
    /// Thickness of the material above it that it is to cut, mm.
    pub depth: f64,
    /// Whether there is a level above it, which cuts down to this thickness.
    pub is_later: bool,
    /// The whole files of the drive surface of the job.
    pub part: Arc<Surface>,
    /// Files of `part` in their order, with their number of triangles.
    pub part_files: Vec<(FileKey, usize)>,
}

/// A setup with its meshes read, in the workpiece frame.
pub struct Setup<'a> {
    /// Its index among the setups of the job.
    pub index: usize,
    /// Its content in the job file.
    pub file: &'a SetupFile,
    /// Level in place of the job's drive surface: then `drive` and `around_drive` are what its tool
    /// reaches of it, without triangles where that is nothing.
    pub level: Option<SetupLevel>,
    /// Surface that the passes cut, alone: for paths that are projected on it.
    pub drive: Arc<Surface>,
    /// The whole files of the drive surface, so that normals and curvatures at its border take
    /// account of the surface beyond.
    pub around_drive: Arc<Surface>,
    /// Groups of `around_drive` that form the drive surface.
    pub drive_groups: Vec<String>,
    /// Files of `around_drive` in their order, with their number of triangles.
    pub drive_files: Vec<(FileKey, usize)>,
    /// All surfaces that must not be cut or hit.
    pub obstacles: Vec<ObstacleMesh>,
    /// Thickness of the stock on part and check surfaces, mm; 0 if the stock is a solid of its own.
    pub stock_thickness: f64,
    /// The stock, if it is a solid of its own.
    pub stock_solid: Option<Arc<Surface>>,
    /// The stock that `stock_thickness` and `stock_solid` are of.
    pub planning_stock: PlanningStock,
    /// The setup's own stock, where these are of another one.
    pub(crate) own_stock: Option<OwnStock>,
    /// Material to leave on the drive surface, mm.
    pub drive_allowance: f64,
    /// Pose of the workpiece frame on the table.
    pub table_from_work: Isometry3<f64>,
    /// Work offset register.
    pub work_offset: WorkOffset,
    /// Reports on the mesh files.
    pub reports: Vec<MeshReport>,
    /// Regions of operations by what is left, as far as they are measured
    /// ([`left_region`](crate::setup::left_stock::left_region)), by the operations' names.
    pub left_regions: Mutex<BTreeMap<String, Arc<LeftRegion>>>,
    /// Regions of operations that are continued beyond their border
    /// ([`extended_region`](crate::setup::pass_surface::extended_region)).
    pub extended_regions: Mutex<Vec<Arc<ExtendedRegion>>>,
    /// Everything that the programs before this setup's sweep, once it is needed
    /// ([`swept_before`](crate::setup::left_stock::swept_before)).
    pub swept_before: OnceLock<Arc<Vec<Arc<SweptCutter>>>>,
}

/// Largest distance of a ray's crossings of triangles that have a side or corner in common, mm.
const SAME_CROSSING: f64 = 1e-9;

impl<'a> Setup<'a> {
    /// Returns the settings for the setup's program: numbers continue from the job's number, setup
    /// by setup.
    pub fn post(&self, job: &Job) -> PostSettings {
        let before = job.file.setups.iter().take_while(|s| s.name != self.file.name).count();
        job.post.with_number_after(before as u32)
    }

    /// Returns the thickness of the stock along the normal at a CC point, mm, before the setup's
    /// program: to where the normal leaves it. 0 at a place outside of it. On a level up to the top
    /// of the stock, outside of it, too: a lying cylinder is wider above.
    pub fn stock_above(&self, cc: &CcPoint) -> f64 {
        match &self.stock_solid {
            None => (self.stock_thickness - self.drive_allowance).max(0.0),
            Some(solid) => {
                let mut hits = solid.ray_all(&cc.position, &cc.normal, f64::INFINITY);
                // Through a side or a corner the normal meets all triangles there.
                hits.dedup_by(|b, a| {
                    a.from_outside == b.from_outside && b.point.distance - a.point.distance <= SAME_CROSSING
                });
                if self.level.is_some() {
                    return hits.iter().rfind(|hit| !hit.from_outside).map_or(0.0, |hit| hit.point.distance);
                }
                let sense = |hit: &RayHit| if hit.from_outside { -1 } else { 1 };
                // Solids that the place lies in.
                let by_normal: i32 = hits.iter().map(sense).sum();
                let mut around = solid.winding(&cc.position).map_or(by_normal, |winding| winding.max(by_normal));
                if around <= 0 {
                    return 0.0;
                }
                let left = hits.iter().find(|hit| {
                    around -= sense(hit);
                    around <= 0
                });
                let left = left.or_else(|| hits.iter().rfind(|hit| !hit.from_outside));
                left.map_or(0.0, |hit| hit.point.distance)
            }
        }
    }

    /// Returns the room of the tool on the setup's level, and whether it is outside of all stock
    /// there with its tip at a point; `None` of a setup without a level.
    pub fn level_rooms(&self) -> Option<[LevelRoom<'_>; 2]> {
        let level = self.level.as_ref()?;
        let [stock, standing] = [true, false].map(|is_stock| {
            let of_kind = self.obstacles.iter().filter(|o| (o.role == ObstacleRole::Stock) == is_stock);
            level.level.room(of_kind.map(|o| standing(o, level.margin)).collect())
        });
        Some([standing, stock])
    }

    /// Returns the smallest box around everything on the table.
    pub fn aabb(&self) -> Aabb {
        self.obstacles.iter().fold(Aabb::EMPTY, |b, o| b.union(&o.mesh.aabb()))
    }
}

/// Returns an obstacle as a body on a level, with this much more than its allowance.
pub(crate) fn standing(obstacle: &ObstacleMesh, margin: f64) -> Standing<'_> {
    Standing { mesh: &obstacle.mesh, tree: obstacle.tree(), allowance: obstacle.allowance + margin }
}

/// Returns the machine to plan for, with more clearance around its head, so that a certificate can
/// prove planned poses against the work: it adds the control's deviation and that of the text from
/// the path between two poses, and permits a slack.
pub(crate) fn machine_to_plan_for(job: &Job) -> Machine {
    let longest = job.all_tools().map(ToolAssembly::gauge_length).fold(0.0, f64::max);
    let linearisation = job.file.operations.iter().map(|o| o.tolerances.linearisation_mm).fold(0.0, f64::max);
    let strays = straying(&job.machine, longest) + linearisation;
    let slack = VerifySettings::default().clearance_slack;
    with_more_around_head(&job.machine, |clearance| strays - slack.min(clearance))
}

/// Returns the machine with more clearance around its head: `more` returns the increase (mm) for a
/// clearance; none where it is not positive.
fn with_more_around_head(machine: &Machine, more: impl Fn(f64) -> f64) -> Machine {
    machine.with_more_clearance(|body| match body.carrier() {
        Some(Carrier::Head) => more(body.clearance),
        _ => 0.0,
    })
}

/// Returns the largest deviation of a head's bodies from their planned path, mm. A certificate
/// includes the control's tolerance, so postures at exactly the clearance could not be proven.
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

#[cfg(test)]
#[path = "../../tests/unit/load/job.rs"]
mod tests;
