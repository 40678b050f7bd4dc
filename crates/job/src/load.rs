//! Jobs read with all files that they name, checked.

pub mod ad_hoc_setup;
pub mod clearance_surface;
pub(crate) mod enclosure;
pub mod job;
pub mod job_files;
pub mod job_source;
pub mod machine_load;
#[cfg(test)]
#[path = "../tests/unit/load/machine_load_laws.rs"]
mod machine_load_laws;
pub mod made_from;
pub mod mesh_files;
pub mod mesh_winding;
pub mod obstacle_meshes;
pub mod open_meshes;
pub mod part_size;
pub mod post_load;
pub(crate) mod stock_solid;

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::{Arc, Mutex, OnceLock};

use facemill_cc_path::strategies::Region;
use facemill_cl_data::CuttingLaw;
use facemill_file_format::{from_json, to_json};
use facemill_inverse_kinematics::Machine;
use facemill_level_region::{Level, LevelPlane};
use facemill_mesh_store::SharedMeshes;
use facemill_nc_program::dialect::LAST_PROGRAM_NUMBER;
use facemill_nc_program::{AxisLetter, AxisWords, FeedMode, WorkOffset};
use facemill_surface_model::{Group, Surface, SurfaceSettings, TriMesh};
use facemill_tool_model::ToolAssembly;

use crate::failure::Failure;
use crate::files;
use crate::format::job_file::{JobFile, OperationFile, RoleFile, SetupFile, StockFile};
use crate::format::job_settings::JobSetting;
use crate::format::made_from::InputFile;
use crate::frames::{direction, pose};
use crate::load::clearance_surface::clearance_surface;
use crate::load::enclosure::check_enclosure;
use crate::load::job::{
    ExtendedRegion, Job, NamedTools, SecondHead, Setup, SetupLevel, WrittenPrograms, machine_to_plan_for, standing,
};
use crate::load::job_files::JobFiles;
use crate::load::job_source::{JOB_NAME, blamed, job_of_text, job_path, read_job_file};
use crate::load::machine_load::read_machine_of;
use crate::load::made_from::{ReadInput, all_inputs_of};
use crate::load::mesh_files::{FileKey, MeshFiles};
use crate::load::obstacle_meshes::datums::check_datums;
use crate::load::obstacle_meshes::{
    ObstacleRole, Selection, joined_obstacles, matches_pattern, only, select_also, selected_groups, shared_obstacle,
    table_bodies,
};
use crate::load::part_size::unit_inside;
use crate::load::post_load::read_post;
use crate::load::stock_solid::stock_mesh;
use crate::planning_stock::PlanningStock;
use crate::validate::feeds::check_chip_thickness;
use crate::validate::layers::check_flute;
use crate::validate::levels::check_flat_bottom;
use crate::validate::limits::check_cutter_width;
use crate::validate::tools::{JobByTool, setups_by_tool, tool_of, tool_of_setup};
use crate::validate::{check_feeds, check_gouge_tolerances, check_heads, check_rounding, validate};

/// Returns the values of the axes at the reference position, in the unit of words.
///
/// # Errors
/// If an axis has no NC address.
pub fn home_words(machine: &Machine) -> Result<AxisWords, Failure> {
    let mut words = AxisWords::new();
    for (k, axis) in machine.axes().iter().enumerate() {
        let value = axis.in_word_unit(machine.home()[k]);
        words.set(crate::load::letter(axis.letter.as_str())?, value).map_err(|e| Failure::Internal(e.to_string()))?;
    }
    Ok(words)
}

/// Returns the work offset of this name, such as `G54`; `None` for another name.
pub fn work_offset(register: &str) -> Option<WorkOffset> {
    (1..=WorkOffset::MAX).filter_map(WorkOffset::new).find(|w| w.to_string() == register)
}

/// Returns the names of the groups of the drive surface, and the files with a drive surface with
/// their numbers of triangles.
pub(crate) fn around_drive(file: &SetupFile, files: &MeshFiles<'_>) -> (Vec<String>, Vec<(FileKey, usize)>) {
    let mut names = Vec::new();
    let mut seen: Vec<(FileKey, usize)> = Vec::new();
    for entry in file.meshes.iter().filter(|m| m.role == RoleFile::Drive) {
        let key = FileKey::from(entry);
        let Some(imported) = files.read.get(&key) else { continue };
        if !seen.iter().any(|(known, _)| *known == key) {
            seen.push((key, imported.mesh.triangles().len()));
        }
        let drives = |g: &&Group| {
            entry.groups.as_ref().is_none_or(|patterns| patterns.iter().any(|p| matches_pattern(p, &g.name)))
        };
        names.extend(imported.mesh.groups().iter().filter(drives).map(|g| g.name.clone()));
    }
    names.sort_unstable();
    names.dedup();
    (names, seen)
}

/// Returns the mesh files that a job names.
pub(crate) fn mesh_names(file: &JobFile) -> impl Iterator<Item = &str> {
    file.setups.iter().flat_map(|setup| {
        let stock = if let StockFile::Mesh(mesh) = &setup.stock { Some(mesh.file.as_str()) } else { None };
        setup.meshes.iter().map(|mesh| mesh.file.as_str()).chain(stock)
    })
}

/// Least distance of the two tools from each other at planned postures, mm: the motion between them
/// is run and proven.
pub const HEADS_APART: f64 = 1.0;

impl Job {
    /// Reads a job file, or `job.json` of a folder, with its tool, machine and template.
    ///
    /// # Errors
    /// If a file cannot be read or is wrong; the message names file, field and line.
    pub fn read(path: &Path) -> Result<Self, Failure> {
        Self::read_with(path, &[])
    }

    /// Reads a job as [`Job::read`] does, with these values in place of the file's.
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

    /// Reads a job as [`Job::read_with`] does, with every file that it names in memory: no file is
    /// read from disk from now on, and a change there does not change its plan. Also returns the
    /// files with their checksums.
    ///
    /// # Errors
    /// As [`Job::read_with`], and if any of these files cannot be read, also one that this plan
    /// would not need.
    pub fn read_whole(path: &Path, settings: &[JobSetting]) -> Result<(Self, Vec<InputFile>), Failure> {
        let path = &job_path(path);
        let text = files::read_text(path)?;
        let file = job_of_text(path, &text, settings)?;
        files::enter_job(path);
        let folder = path.parent().unwrap_or(Path::new(""));
        let mut held = JobFiles::in_folder(folder);
        if let Some(own) = path.file_name() {
            held = held.with(&own.to_string_lossy(), text);
        }
        let inputs = all_inputs_of(path, &file, |name| {
            let path = folder.join(name);
            let bytes = held.bytes(&path)?.into_owned();
            let input = ReadInput::of(&path, &bytes);
            held = std::mem::take(&mut held).with(name, bytes);
            Ok(input)
        })?;
        let job = Self::of_files(path, file, held.only_held()).map_err(|e| blamed(settings, path, e))?;
        Ok((Self { settings: settings.to_vec(), ..job }, inputs))
    }

    /// Returns a job with the tool, machine and template that its checked file names, relative to
    /// `path`, which errors name, too.
    ///
    /// # Errors
    /// As [`Job::read`].
    pub fn of(path: &Path, file: JobFile) -> Result<Self, Failure> {
        Self::of_files(path, file, JobFiles::in_folder(path.parent().unwrap_or(Path::new(""))))
    }

    /// Returns a job of values, with the files that it names. It is checked as one that is read:
    /// its values, tool and machine are written as the text of their files, and that text is read.
    ///
    /// # Errors
    /// As [`Job::read`]; messages call the job `job.json` in the folder of its files.
    pub fn of_values(file: &JobFile, files: JobFiles) -> Result<Self, Failure> {
        let path = files.path(JOB_NAME);
        let text = to_json(file);
        let file: JobFile = from_json(text.as_bytes()).map_err(|e| Failure::input(&path, e))?;
        validate(&file).map_err(|e| Failure::input(&path, e))?;
        Self::of_files(&path, file, files.with(JOB_NAME, text))
    }

    /// Returns a job as [`Job::of`] does, with these files.
    pub(crate) fn of_files(path: &Path, file: JobFile, files: JobFiles) -> Result<Self, Failure> {
        let beside = |name: &str| path.parent().unwrap_or(Path::new("")).join(name);
        mesh_names(&file).for_each(|name| files.note_input(&beside(name)));
        // Faults are named by the place in the file.
        let as_written = file;
        let JobByTool { file, written } = setups_by_tool(as_written.clone());
        let read_tool = |name: &str| -> Result<ToolAssembly, Failure> {
            let tool_path = beside(name);
            let text = files.text(&tool_path)?;
            ToolAssembly::from_json(&text)
                .map_err(|e| Failure::input(&tool_path, format!("{e}{}", library_hint(&text))))
        };
        let by_name: BTreeMap<String, ToolAssembly> = (file.tools.iter())
            .map(|(name, tool_file)| Ok((name.clone(), read_tool(tool_file)?)))
            .collect::<Result<_, Failure>>()?;
        let first = || file.setups.first().and_then(|setup| by_name.get(tool_of_setup(&file, setup)?));
        let tool = match &file.tool {
            Some(name) => read_tool(name)?,
            None => first().cloned().ok_or_else(|| Failure::input(path, "tool: no operation has one"))?,
        };
        check_registers(&by_name).map_err(|e| Failure::input(path, e))?;
        let machine_path = beside(&file.machine);
        let mut heads = read_machine_of(&files, &machine_path)?.heads;
        check_heads(&as_written, heads.len()).map_err(|e| Failure::input(path, e))?;
        let mut second = None;
        if let (2, Some(name)) = (heads.len(), &file.second_tool) {
            second = Some(SecondHead { tool: read_tool(name)?, machine: heads.swap_remove(1) });
        }
        let machine = heads.swap_remove(0);
        check_feeds(&as_written, &machine.feed_range()).map_err(|e| Failure::input(path, e))?;
        // Each tool with its file and its operations.
        type ToolUse<'t> = (&'t ToolAssembly, &'t str, Box<dyn Fn(&OperationFile) -> bool + 't>);
        let of_head = |head: u32| move |o: &OperationFile| o.head == head;
        let alone = file.tool.iter().map(|name| -> ToolUse<'_> { (&tool, name, Box::new(of_head(1))) });
        let of_second = second.iter().zip(&file.second_tool);
        let of_second = of_second.map(|(second, name)| -> ToolUse<'_> { (&second.tool, name, Box::new(of_head(2))) });
        let named = by_name.iter().zip(file.tools.values()).map(|((name, tool), tool_file)| -> ToolUse<'_> {
            (tool, tool_file, Box::new(|o| tool_of(&as_written, o) == Some(name)))
        });
        for (tool, tool_file, is_of) in alone.chain(of_second).chain(named) {
            check_gouge_tolerances(&as_written, &is_of, tool.cutter().radius()).map_err(|e| Failure::input(path, e))?;
            check_flute(&as_written, &is_of, tool).map_err(|e| Failure::input(path, e))?;
            check_flat_bottom(&as_written, &is_of, tool).map_err(|e| Failure::input(path, e))?;
            check_chip_thickness(&as_written, &is_of, tool.n_inserts(), &machine.feed_range())
                .map_err(|e| Failure::input(path, e))?;
            check_cutter_width(&machine, tool).map_err(|e| Failure::input(&beside(tool_file), e))?;
        }
        let post = read_post(path, &file, &files)?;
        if let (Some(_), Some(name)) = (&second, &file.post.dialect_file) {
            let message =
                format!("post.dialect_file: {name}: two heads are programmed by the dialect's own file alone");
            return Err(Failure::input(path, message));
        }
        if second.is_some() && post.subprograms().is_some() {
            return Err(Failure::input(path, "post.subprograms: programs of two heads have none; leave it out"));
        }
        // Programs that change tools come behind those of one.
        let changing = (1..written.len()).filter(|&k| written[k - 1] == written[k]).map(|k| written[k]);
        let n_programs = file.setups.len() + changing.collect::<BTreeSet<usize>>().len();
        if post.program_number() as usize + n_programs - 1 > LAST_PROGRAM_NUMBER as usize {
            let message = format!("post.program_number: {} leaves no numbers for all setups", post.program_number());
            return Err(Failure::input(path, message));
        }
        let tools = NamedTools::new(by_name, written, tool.clone());
        check_rounding(&as_written, &post.rounding_bound()).map_err(|e| Failure::input(path, e))?;
        // Where nothing is written, the control need not move as the machine file says.
        let post = if file.operations.is_empty() {
            post
        } else {
            if post.feed_mode() == FeedMode::Rtcp && machine.motion_law().cutting == CuttingLaw::AxesLinear {
                let message = "post.feed_mode: rtcp needs a machine whose motion.cutting is tip_and_rotaries_linear or \
                               tip_linear_vector_turned, because that is what the control then does; its is axes_linear";
                return Err(Failure::input(path, message));
            }
            let home = home_words(&machine)?;
            post.on_machine(machine.motion_law(), home).map_err(|e| Failure::input(path, format!("post.{e}")))?
        };
        let mut job = Self {
            path: path.to_owned(),
            file,
            tool,
            tools,
            planned_machine: machine.clone(),
            machine,
            post,
            second,
            settings: Vec::new(),
            files,
            programs: WrittenPrograms::default(),
            meshes: SharedMeshes::default(),
        };
        // Views of a head have one of their own.
        if job.second.is_none() {
            job.planned_machine = machine_to_plan_for(&job);
        }
        Ok(job)
    }
}

impl<'a> Setup<'a> {
    /// Reads the meshes of a setup.
    ///
    /// # Errors
    /// If a file cannot be read or is wrong, or groups do not exist.
    pub fn read(job: &'a Job, index: usize) -> Result<Self, Failure> {
        let file = &job.file.setups[index];
        let work_from_part = pose(&file.work_from_part);
        let mut read_files = MeshFiles::of(job);
        let mut drive: Vec<(FileKey, Vec<bool>)> = Vec::new();
        let mut datums: Vec<(String, FileKey, Vec<bool>)> = Vec::new();
        let mut selections: Vec<Selection> = Vec::new();
        for (k, entry) in file.meshes.iter().enumerate() {
            let at = format!("{}.meshes[{k}]", job.setup_key(index));
            let file = FileKey::from(entry);
            let mesh = &read_files.get(&file)?.mesh;
            let selected = selected_groups(job, &at, entry, mesh)?;
            if entry.role == RoleFile::Drive {
                drive.push((file.clone(), selected.clone()));
            }
            if entry.role == RoleFile::Datum {
                datums.push((at, file.clone(), selected.clone()));
            }
            let role = match entry.role {
                RoleFile::Drive | RoleFile::Part | RoleFile::Datum => ObstacleRole::Part,
                RoleFile::Check => ObstacleRole::Check,
                RoleFile::Fixture => ObstacleRole::Fixture,
            };
            select_also(&mut selections, Selection { role, allowance: entry.allowance_mm, file, groups: selected });
        }
        if drive.is_empty() {
            return Err(job.wrong(format!("{}.meshes: no drive surface", job.setup_key(index))));
        }
        for (at, file, groups) in &datums {
            let is_both = |k: &usize| groups[*k] && drive.iter().any(|(of, driven)| of == file && driven[*k]);
            if let Some(both) = (0..groups.len()).find(is_both) {
                let group = &read_files.read[file].mesh.groups()[both].name;
                return Err(job.wrong(format!(
                    "{at}.groups: \"{group}\" is a drive surface, too; a datum is finished before the clamping and not \
                     cut in it, so leave it out of one of them"
                )));
            }
        }
        let selected = |(file, groups): &(FileKey, Vec<bool>)| only(&read_files.read[file].mesh, groups);
        let joined = |meshes: &mut dyn Iterator<Item = TriMesh>| {
            let placed = meshes.map(|mesh| mesh.transformed(&work_from_part));
            placed.reduce(|all, mesh| all.joined(&mesh)).unwrap_or_default()
        };
        let (drive_groups, drive_files) = around_drive(file, &read_files);
        let whole = |(file, _): &(FileKey, usize)| read_files.read[file].mesh.clone();
        let whole = || joined(&mut drive_files.iter().map(whole));
        let around_drive = job.meshes.surface(&(&drive_files, &work_from_part), whole);
        let selected = || joined(&mut drive.iter().map(selected));
        let drive = job.meshes.surface(&(&drive, &work_from_part), selected);
        let mut obstacles = joined_obstacles(job, &selections, &read_files, &work_from_part);
        let mut stock_solid = None;
        let stock_thickness = match &file.stock {
            StockFile::Offset(offset) => offset.allowance_mm,
            solid => {
                if let StockFile::Mesh(m) = solid {
                    read_files.get(&FileKey::from(m))?;
                }
                let mesh = || match solid {
                    StockFile::Mesh(m) => read_files.read[&FileKey::from(m)].mesh.transformed(&work_from_part),
                    other => stock_mesh(other),
                };
                let made_from = (to_json(solid), &work_from_part);
                stock_solid = Some(job.meshes.surface(&made_from, mesh));
                let shape = job.meshes.obstacle(&made_from, mesh);
                obstacles.push(shared_obstacle(ObstacleRole::Stock, 0.0, "stock".to_owned(), shape));
                0.0
            }
        };
        let reports = read_files.reports();
        check_enclosure(&job.setup_key(index), file, stock_thickness, &obstacles).map_err(|e| {
            let clearance = clearance_surface(&file.clearance);
            let unit = reports.first().map(|r| r.unit);
            let advice = unit.and_then(|unit| unit_inside(job, unit, &obstacles, &work_from_part, &clearance));
            job.wrong(advice.map_or_else(|| e.clone(), |advice| format!("{advice} As it is: {e}")))
        })?;
        check_datums(job, index, stock_solid.as_deref())?;
        let table_from_work = pose(&file.table_from_work);
        obstacles.extend(table_bodies(&job.machine, &table_from_work));
        let setup = Self {
            index,
            file,
            level: None,
            drive,
            around_drive,
            drive_groups,
            left_regions: Mutex::default(),
            extended_regions: Mutex::default(),
            swept_before: OnceLock::new(),
            drive_files,
            obstacles,
            stock_thickness,
            stock_solid,
            planning_stock: PlanningStock::Own { why: None },
            own_stock: None,
            drive_allowance: file.meshes.iter().find(|m| m.role == RoleFile::Drive).map_or(0.0, |m| m.allowance_mm),
            table_from_work,
            work_offset: work_offset(&file.work_offset.register).ok_or_else(|| {
                job.wrong(format!(
                    "{}.work_offset.register: must be G54 to G59 or G54.1 P1 to P300, is \"{}\"",
                    job.setup_key(index),
                    file.work_offset.register
                ))
            })?,
            reports,
        };
        Ok(setup.on_level(job))
    }

    /// Returns the setup with a level in place of its drive surface, if its operation is one.
    fn on_level(mut self, job: &Job) -> Self {
        let mut operations = job.operations_of(self.file).map(|(_, operation)| operation);
        let found =
            operations.find_map(|operation| Some((operation, operation.levels?))).zip(self.stock_solid.as_ref());
        let Some(((operation, levels), stock)) = found else { return self };
        let tolerances = &operation.tolerances;
        let margin = tolerances.path_chord_mm + tolerances.linearisation_mm;
        let plane = LevelPlane::new(direction(&levels.axis), levels.to_mm);
        let around = self.obstacles.iter().filter(|o| o.role != ObstacleRole::Stock).map(|o| standing(o, margin));
        let level = Level::new(plane, job.tool_of(operation).cutter(), around.collect(), stock.mesh());
        let width = AROUND_LEVEL * tolerances.max_step_over_mm;
        let surface = Surface::new(level.pass_mesh(width), SurfaceSettings::default());
        let passes = Arc::new(ExtendedRegion { region: Region::default(), width, surface });
        let drive = level.reach().swept_mesh();
        let depth = levels.from_mm.map_or(levels.depth_mm, |from| from - levels.to_mm);
        self.drive_groups = drive.groups().iter().map(|group| group.name.clone()).collect();
        self.drive = Arc::new(Surface::new(drive, SurfaceSettings::default()));
        let part = std::mem::replace(&mut self.around_drive, self.drive.clone());
        let part_files = std::mem::take(&mut self.drive_files);
        self.drive_allowance = 0.0;
        self.level = Some(SetupLevel { level, passes, margin, depth, is_later: levels.is_later, part, part_files });
        self
    }
}

/// Returns the advice to import the tools of a library, for a text that is one and is read as a
/// tool file; otherwise nothing.
fn library_hint(text: &[u8]) -> &'static str {
    match from_json::<serde_json::Value>(text) {
        Ok(file) if file.get("data").is_some_and(serde_json::Value::is_array) => {
            "; a tool library: write its tools with `facemill tool import` first"
        }
        _ => "",
    }
}

/// Distance to which the plane of a level goes on around the stock, in step-overs: passes reach one
/// beyond the material, and what is measured on a lattice a little more.
const AROUND_LEVEL: f64 = 3.0;

/// Refuses tools that a control would take for one another.
fn check_registers(tools: &BTreeMap<String, ToolAssembly>) -> Result<(), String> {
    let all: Vec<(&String, &ToolAssembly)> = tools.iter().collect();
    for (k, (name, tool)) in all.iter().enumerate() {
        for (other, before) in &all[..k] {
            let same = if tool.number() == before.number() {
                ("number", tool.number())
            } else if tool.length_register() == before.length_register() {
                ("length_register", tool.length_register())
            } else {
                continue;
            };
            return Err(format!(
                "tools: \"{other}\" and \"{name}\" both have the {} {}: the control would take one for the other; give each \
                 its own in its tool file",
                same.0, same.1
            ));
        }
    }
    Ok(())
}

/// Returns the letter of an axis in NC text.
pub fn letter(text: &str) -> Result<AxisLetter, Failure> {
    let mut chars = text.chars();
    let first = chars.next().unwrap_or(' ');
    let number = chars.next().and_then(|d| d.to_digit(10)).unwrap_or(0);
    AxisLetter::new(first, u8::try_from(number).unwrap_or(0))
        .ok_or_else(|| Failure::Internal(format!("axis {text} has no NC address")))
}
