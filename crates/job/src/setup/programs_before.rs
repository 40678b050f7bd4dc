//! Programs before a setup, each in its own clamping, with the part as the setup has it.

use std::path::Path;

use facemill_cc_path::files::ProgramWithToolFile;
use facemill_nc_program::read::{MotionKind, ReadBlock};
use facemill_nc_program::{Dialect, ReadProgram};
use facemill_tool_model::{ToolAssembly, ToolFile};
use facemill_virtual_machine::{VerifyError, VirtualSetup, first_text_fault};

use crate::failure::Failure;
use crate::load::job::{Job, KnownProgram, NamedTools, Setup};
use crate::setup::scene::Scene;
use crate::validate::setup_chain::{programs_before, work_from_work};

/// Program before a setup.
pub struct ProgramBefore<'p> {
    /// Name of its setup, or file of one of another job.
    pub setup: &'p str,
    /// Its file.
    pub path: &'p Path,
    /// Its text as it is read.
    pub text: ReadProgram,
    /// Its machine with its tool and its mounting; the workpiece frame is that of the setup that
    /// comes behind.
    pub at: VirtualSetup<'p>,
    /// First fault of its text: then nothing that it cuts is known.
    pub fault: Option<(u32, String)>,
}

impl<'p> ProgramBefore<'p> {
    fn new(setup: &'p str, path: &'p Path, text: ReadProgram, at: VirtualSetup<'p>) -> Self {
        let fault = first_text_fault(&text, &at);
        Self { setup, path, text, at, fault }
    }
}

/// Reason why the tool of a program is not known.
pub(crate) enum WrongTool {
    /// The job has several, and none is named.
    NotNamed,
    /// Its file is wrong.
    Failed(Failure),
}

/// Advice for [`WrongTool::NotNamed`].
pub(crate) const NOT_NAMED: &str = "the job has several tools; name the file of its tool";

/// Returns the tool of a program from another job.
///
/// # Errors
/// If it is not known.
pub(crate) fn tool_of_program(job: &Job, program: &ProgramWithToolFile) -> Result<ToolAssembly, WrongTool> {
    let Some(name) = &program.tool else {
        return if job.all_tools().count() > 1 { Err(WrongTool::NotNamed) } else { Ok(job.as_read().tool) };
    };
    let path = job.beside(name);
    let read = || -> Result<ToolAssembly, Failure> {
        let file: ToolFile =
            facemill_file_format::from_json(&job.files.text(&path)?).map_err(|e| Failure::input(&path, e))?;
        ToolAssembly::new(file).map_err(|e| Failure::input(&path, e))
    };
    read().map_err(WrongTool::Failed)
}

/// Calls a function with the programs of other jobs that have cut a setup's stock.
fn each_program_of_other_jobs(
    job: &Job,
    setup: &Setup<'_>,
    skipped: usize,
    visit: &mut impl FnMut(&ProgramBefore<'_>) -> Result<(), Failure>,
) -> Result<(), Failure> {
    let at = job.setup_key(setup.index);
    let (before, _) = programs_before(&job.file.setups, setup.index);
    let first = before.first().copied().unwrap_or(setup.index);
    let own;
    // All setups with one stock have the same ones, in the mounting of the first.
    let clamped = if job.setup_key(first) == job.setup_key(setup.index) || setup.file.programs_before.is_empty() {
        setup
    } else {
        own = Setup::read(job, first)?;
        &own
    };
    let motion = work_from_work(clamped.file, setup.file);
    for (k, program) in setup.file.programs_before.iter().enumerate().skip(skipped) {
        let tool = tool_of_program(job, program).map_err(|e| match e {
            WrongTool::NotNamed => job.wrong(format!("{at}.programs_before[{k}]: {}: {NOT_NAMED}", program.file)),
            WrongTool::Failed(failure) => failure,
        })?;
        let path = job.beside(&program.file);
        let dialect = job.post.dialect();
        let job = Job { tool, ..job.clone() };
        let text = read_part(&job, &path, (&job.files.bytes(&path)?, dialect, None))?;
        let job = Job { tools: NamedTools::default(), ..job };
        let scene = Scene::new(&job, clamped, clamped.index)?;
        let mut scene_at = scene.virtual_setup(dialect);
        if let Some(motion) = &motion {
            scene_at.table_from_work *= motion.inverse();
        }
        let before = ProgramBefore::new(&program.file, &path, text, scene_at);
        let what = match &before.fault {
            Some((line, note)) => format!("line {line}: {note}: a program that has cut before is one without faults"),
            None if !before.text.blocks.iter().any(is_cut) => "has no move at a feed, so it cuts nothing".to_owned(),
            None => {
                visit(&before)?;
                continue;
            }
        };
        return Err(Failure::input(&path, what));
    }
    Ok(())
}

/// Returns whether a block may cut.
fn is_cut(block: &ReadBlock) -> bool {
    block.motion.as_ref().is_some_and(|motion| matches!(motion.kind, MotionKind::Linear | MotionKind::Arc { .. }))
}

/// Calls a function with every known program ([`Job::programs`]) that cuts a setup's stock before
/// it, in their order, those of other jobs first, without the first `skipped` ones; with none of
/// the job's own on a machine with two heads.
///
/// # Errors
/// If a program is not understood, or its setup cannot be read; those of the function.
pub fn each_program_before(
    job: &Job,
    setup: &Setup<'_>,
    skipped: usize,
    mut visit: impl FnMut(&ProgramBefore<'_>) -> Result<(), Failure>,
) -> Result<(), Failure> {
    let setups = &job.file.setups;
    let (before, _) = programs_before(setups, setup.index);
    each_program_of_other_jobs(job, setup, skipped, &mut visit)?;
    let skipped = skipped.saturating_sub(setup.file.programs_before.len());
    for (k, program) in known_before(job, &before).skip(skipped) {
        // With its own tool, also where a view of the job has another one in its place.
        let job = job.as_read().for_setup(k);
        let own;
        // The programs of one clamping differ in tools and allowances alone.
        let clamped = if job.setup_key(k) == job.setup_key(setup.index) {
            setup
        } else {
            own = Setup::read(&job, k)?;
            &own
        };
        let KnownProgram { path, text, dialect, section } = program;
        let scene = Scene::new(&job, clamped, k)?;
        let mut at = scene.virtual_setup(*dialect);
        if let Some(motion) = work_from_work(&setups[k], setup.file) {
            at.table_from_work *= motion.inverse();
        }
        let text = read_part(&job, path, (text, *dialect, section.map(|section| (section, k))))?;
        visit(&ProgramBefore::new(&setups[k].name, path, text, at))?;
    }
    Ok(())
}

/// Returns the error for a program before that could not be run.
pub fn not_run(path: &Path, why: VerifyError) -> Failure {
    match why {
        VerifyError::Cancelled(_) => Failure::Interrupted,
        why => Failure::input(path, why),
    }
}

/// Returns the known programs of these setups, with their indices.
fn known_before<'j>(job: &'j Job, before: &'j [usize]) -> impl Iterator<Item = (usize, &'j KnownProgram)> {
    let of = |k: &usize| job.programs.of(*k).flatten().map(|program| (*k, program));
    before.iter().filter(|_| job.second.is_none()).filter_map(of)
}

/// Returns a digest of each program that [`each_program_before`] visits.
///
/// # Errors
/// If a file cannot be read.
pub(crate) fn digests_before(job: &Job, setup: &Setup<'_>) -> Result<Vec<[u8; 32]>, Failure> {
    let mut all = Vec::new();
    let (before, _) = programs_before(&job.file.setups, setup.index);
    // They run in the mounting of the first setup.
    let first = &job.file.setups[before.first().copied().unwrap_or(setup.index)];
    let mounting = facemill_file_format::to_json(&(&first.work_from_part, &first.table_from_work, &first.work_offset));
    for program in &setup.file.programs_before {
        let text = job.files.bytes(&job.beside(&program.file))?;
        let tool = program.tool.as_ref().map(|tool| job.files.bytes(&job.beside(tool))).transpose()?;
        let tool = tool.map(|tool| blake3::hash(&tool));
        let mut hasher = blake3::Hasher::new();
        hasher.update(tool.as_ref().map_or(&[][..], |tool| tool.as_bytes()));
        hasher.update(mounting.as_bytes()).update(job.post.dialect().name().as_bytes());
        all.push(*hasher.update(&text).finalize().as_bytes());
    }
    for (k, program) in known_before(job, &before) {
        let mut hasher = blake3::Hasher::new();
        hasher.update(
            &[k, program.section.map_or(0, |section| section + 1)].map(|n| n as u64).map(u64::to_le_bytes).concat(),
        );
        hasher.update(program.dialect.name().as_bytes());
        all.push(*hasher.update(&program.text).finalize().as_bytes());
    }
    Ok(all)
}

/// Reads a program of one tool, or the part of one that changes tools behind a change of this
/// number, of this setup.
///
/// # Errors
/// If it is not understood, or is no program of one tool.
pub(crate) fn read_part(
    job: &Job,
    path: &Path,
    (text, dialect, section): (&[u8], Dialect, Option<(usize, usize)>),
) -> Result<ReadProgram, Failure> {
    let read = job.read_program(text, dialect).map_err(|e| Failure::input(path, e))?;
    let mut sections = section.map_or_else(|| read.tool_sections(), |(_, setup)| job.parts_of(&read, setup));
    match section.map(|(k, _)| k) {
        Some(k) if k < sections.len() => Ok(sections.swap_remove(k)),
        Some(k) => Err(Failure::input(path, format!("has no tool change number {}", k + 1))),
        None if sections.len() > 1 => {
            let message = format!("changes tools {} times; give the program of each tool", sections.len());
            Err(Failure::input(path, message))
        }
        None => Ok(read),
    }
}
