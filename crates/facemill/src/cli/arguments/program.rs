//! Arguments of commands that run a program in a job's setup.

use std::collections::BTreeSet;
use std::fs::File;
use std::io::Read;
use std::ops::Range;
use std::path::{Path, PathBuf};

use clap::Args;
use facemill::called_program::CalledProgram;
use facemill::cl_file::is_cl_file;
use facemill::nc_program::{Dialect, ReadProgram};
use facemill::{Failure, Job, files, no_program};

use crate::cli::arguments::ad_hoc_setup::StandArguments;
use crate::cli::arguments::dialect::dialect;
use crate::cli::arguments::plan_folder::{PlanProgram, programs_of_plan};

#[derive(Args)]
pub(crate) struct ProgramArguments {
    /// NC program, from any source
    pub(crate) program: PathBuf,
    /// Job file, or a folder with job.json: source of machine, tool, mounting, work offset, part,
    /// fixtures and stock
    #[arg(long, value_name = "FILE")]
    job: Option<PathBuf>,
    /// Setup of the program: its name, or its number in the list of `facemill check`; may be
    /// omitted if the job has only one. For a setup with several tools: its name for the program
    /// with all of them, a name such as "up 1 mill" for that of one
    #[arg(long, value_name = "SETUP")]
    setup: Option<String>,
    /// Program that runs before this one, as the name or number of its setup and the file; for a
    /// setup with several tools also its name and the program with all of them. Regions of
    /// `operations_before` need all of them
    #[arg(long, value_name = "SETUP=FILE")]
    after: Vec<String>,
    /// Control of the program: fanuc, haas, mazak, linuxcnc, siemens_840d, heidenhain; default: the
    /// job's
    #[arg(long, value_name = "NAME", value_parser = dialect)]
    pub(crate) dialect: Option<Dialect>,
}

/// Job, setup, control and text that the arguments name.
pub(crate) struct ProgramOfJob {
    pub(crate) job: Job,
    /// Index of the setup; of a program that changes tools the first one's.
    pub(crate) setup: usize,
    /// Indices of the setups of all of its tools; one if it has one tool.
    pub(crate) setups: Range<usize>,
    pub(crate) dialect: Dialect,
    /// Text of the program.
    pub(crate) text: Vec<u8>,
}

impl ProgramArguments {
    /// Reads the job, then the program.
    pub(crate) fn read(&self) -> Result<ProgramOfJob, Failure> {
        match &self.job {
            Some(job) => self.read_on(Job::read(job)?),
            None => Err(Failure::input(&self.program, "needs --job, which names machine, tool and setup")),
        }
    }

    /// Reads the job or the setup without a job, then the program.
    pub(crate) fn read_with(&self, stand: &StandArguments) -> Result<ProgramOfJob, Failure> {
        match stand.job(self.dialect.unwrap_or_default())? {
            Some(job) => self.read_on(job),
            None => self.read(),
        }
    }

    fn read_on(&self, job: Job) -> Result<ProgramOfJob, Failure> {
        let setups = setups_of(&job, self.setup.as_deref())?;
        let mut job = job;
        let dialect = self.dialect.unwrap_or_else(|| job.post.dialect());
        for after in &self.after {
            self.add_before(&mut job, after, dialect)?;
        }
        let text = read_nc(&self.program)?;
        Ok(ProgramOfJob { job, setup: setups.start, setups, dialect, text })
    }
}

impl ProgramArguments {
    /// Returns whether programs that run before are given.
    pub(crate) fn has_programs_before(&self) -> bool {
        !self.after.is_empty()
    }

    /// Adds a program that runs before, SETUP=FILE, to those of the job: of a setup with several
    /// tools each part as the program of its tool.
    fn add_before(&self, job: &mut Job, value: &str, dialect: Dialect) -> Result<(), Failure> {
        let of_all = value.split_once('=').map(|(of, _)| setups_of(job, Some(of))).transpose()?;
        let Some(setups) = of_all.filter(|setups| setups.len() > 1) else {
            let OtherProgram { setup, path, text, .. } = self.other_program(job, "after", value)?;
            job.programs.add(setup, Some((path, text)), dialect);
            return Ok(());
        };
        let path = PathBuf::from(value.split_once('=').map_or("", |(_, file)| file));
        let OtherProgram { text, .. } = OtherProgram::new(job, (setups.start, path.clone()), read_nc(&path)?, dialect)?;
        let program = job.read_program(&text, dialect).map_err(|e| Failure::input(&path, e))?;
        let parts: Vec<Option<u32>> =
            job.parts_of(&program, setups.start).iter().map(ReadProgram::called_tool).collect();
        // What has no part is taken to cut nothing, so that more material is left.
        setups.clone().for_each(|setup| job.programs.add(setup, None, dialect));
        let mut left = setups;
        for (k, tool) in parts.into_iter().enumerate() {
            // A tool without a number is taken to be the next one.
            let is_own = |setup: &usize| tool.is_none_or(|tool| job.for_setup(*setup).tool.number() == tool);
            let Some(setup) = left.find(is_own) else {
                let called = tool.map_or_else(|| "a tool".to_owned(), |tool| format!("T{tool}"));
                let why =
                    format!("--after {value}: its tool change {} calls {called}, which no setup has there", k + 1);
                return Err(Failure::input(&path, why));
            };
            job.programs.add_section(setup, (path.clone(), text.clone()), dialect, k);
        }
        Ok(())
    }
}

/// Program of a setup, with its calls expanded.
pub(crate) struct OtherProgram {
    pub(crate) setup: usize,
    pub(crate) path: PathBuf,
    /// Text that runs.
    pub(crate) text: Vec<u8>,
    /// Its calls, if it has any.
    pub(crate) called: Option<CalledProgram>,
}

impl OtherProgram {
    /// Expands the calls of a program.
    pub(crate) fn new(
        job: &Job,
        (setup, path): (usize, PathBuf),
        text: Vec<u8>,
        dialect: Dialect,
    ) -> Result<Self, Failure> {
        Ok(match CalledProgram::of(job, &path, &text, dialect)? {
            Some((called, text)) => Self { setup, path, text, called: Some(called) },
            None => Self { setup, path, text, called: None },
        })
    }
}

impl ProgramArguments {
    /// Reads another program of the job from the value of an option, SETUP=FILE.
    pub(crate) fn other_program(&self, job: &Job, option: &str, value: &str) -> Result<OtherProgram, Failure> {
        let Some((of, file)) = value.split_once('=') else {
            return Err(job.wrong(format!("--{option} {value}: give the setup and its program, as SETUP=FILE")));
        };
        let setup = setup_of(job, Some(of))?;
        let path = PathBuf::from(file);
        let text = read_nc(&path)?;
        OtherProgram::new(job, (setup, path), text, self.dialect.unwrap_or_else(|| job.post.dialect()))
    }

    /// Reads all programs of a plan's folder into the job, and returns those of one of its tools.
    ///
    /// # Errors
    /// If an option is of a single program, the folder has no plan of the job, or the job has
    /// several tools, or not this one.
    pub(crate) fn read_plan(&self, tool: Option<&str>) -> Result<(Job, Dialect, Vec<OtherProgram>), Failure> {
        let folder = &self.program;
        let Some(job) = &self.job else {
            return Err(Failure::input(folder, "needs --job, which names machine, tool and setups"));
        };
        if self.setup.is_some() || !self.after.is_empty() {
            return Err(Failure::input(
                folder,
                "is a folder, whose reports name the setups: leave out --setup and --after",
            ));
        }
        let (mut job, written) = programs_of_plan(job, folder)?;
        let dialect = self.dialect.unwrap_or_else(|| job.post.dialect());
        let mut programs = Vec::new();
        for PlanProgram { setup, path, text } in written {
            programs.push(OtherProgram::new(&job, (setup, path), text, dialect)?);
        }
        for setup in 0..job.file.setups.len() {
            let program = programs.iter().find(|program| program.setup == setup);
            job.programs.add(setup, program.map(|p| (p.path.clone(), p.text.clone())), dialect);
        }
        let names: BTreeSet<&str> = programs.iter().filter_map(|program| job.tool_name(program.setup)).collect();
        let listed = names.iter().map(|name| format!("\"{name}\"")).collect::<Vec<_>>().join(", ");
        match tool {
            None if names.len() > 1 => {
                return Err(Failure::input(
                    folder,
                    format!("has programs of several tools; choose one with --tool: {listed}"),
                ));
            }
            Some(tool) if !names.contains(tool) => {
                let has = if listed.is_empty() {
                    "the job has one tool, without a name".to_owned()
                } else {
                    format!("it has {listed}")
                };
                return Err(Failure::input(folder, format!("has no program of a tool \"{tool}\"; {has}")));
            }
            _ => {}
        }
        programs.retain(|program| tool.is_none() || job.tool_name(program.setup) == tool);
        if programs.is_empty() {
            return Err(Failure::input(folder, "has no program: nothing is to be cut"));
        }
        Ok((job, dialect, programs))
    }
}

/// Returns the text of an NC program.
///
/// # Errors
/// If the file cannot be read, or is a CL file or of another format.
pub(crate) fn read_nc(path: &Path) -> Result<Vec<u8>, Failure> {
    let text = files::read(path)?;
    no_other_format(path, &text)?;
    Ok(text)
}

/// Opens an NC program for reading line by line.
///
/// # Errors
/// As [`read_nc`].
pub(crate) fn open_nc(path: &Path) -> Result<File, Failure> {
    let file = files::open(path)?;
    let mut head = Vec::new();
    let read = (&file).take(HEAD).read_to_end(&mut head);
    read.map_err(|source| Failure::Read { file: path.to_owned(), source })?;
    no_other_format(path, &head)?;
    Ok(file)
}

/// Bytes at the start of a program that identify a CL file.
const HEAD: u64 = 1 << 16;

fn no_other_format(path: &Path, head: &[u8]) -> Result<(), Failure> {
    if is_cl_file(head) {
        let what = "is a CL file (APT): it has tool positions rather than axis positions; give the NC program that a post wrote from it";
        return Err(Failure::input(path, what));
    }
    no_program(path, head).map_or(Ok(()), |what| Err(Failure::input(path, what)))
}

impl ProgramOfJob {
    /// Returns it for a command that takes the program of one tool.
    ///
    /// # Errors
    /// If the arguments name a setup with several tools.
    pub(crate) fn of_one_tool(self) -> Result<Self, Failure> {
        if self.setups.len() < 2 {
            return Ok(self);
        }
        let names: Vec<String> = self.job.file.setups[self.setups].iter().map(|s| format!("\"{}\"", s.name)).collect();
        Err(self
            .job
            .wrong(format!("has several tools there; choose the program of one with --setup: {}", names.join(", "))))
    }
}

/// Returns the indices of the setups of a setup of the job file: of its tools, or the one of this
/// name or number.
pub(crate) fn setups_of(job: &Job, requested: Option<&str>) -> Result<Range<usize>, Failure> {
    let clampings = job.clampings();
    let of_all = match requested {
        Some(name) => clampings.into_iter().find(|(n, of)| n == name && of.len() > 1),
        None => Some(clampings).filter(|all| all.len() == 1).and_then(|mut all| all.pop()),
    };
    match of_all {
        Some((_, of)) => Ok(of),
        None => setup_of(job, requested).map(|k| k..k + 1),
    }
}

/// Returns the index of the setup of this name or number.
pub(crate) fn setup_of(job: &Job, requested: Option<&str>) -> Result<usize, Failure> {
    let setups = &job.file.setups;
    let names: Vec<&str> = setups.iter().map(|s| s.name.as_str()).collect();
    let Some(requested) = requested else {
        return match setups.len() {
            1 => Ok(0),
            _ => Err(job.wrong(format!("has several setups; choose one with --setup: {}", names.join(", ")))),
        };
    };
    let number = requested.parse::<usize>().ok().filter(|n| (1..=setups.len()).contains(n));
    let found = names.iter().position(|n| *n == requested).or(number.map(|n| n - 1));
    found.ok_or_else(|| job.wrong(format!("has no setup \"{requested}\"; it has {}", names.join(", "))))
}
