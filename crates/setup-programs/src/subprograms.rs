//! Programs of clampings as main programs that call subprograms.

use facemill_job::failure::Failure;
use facemill_job::load::job::Job;
use facemill_job::validate::setup_names::file_stem;
use facemill_nc_program::ReadProgram;
use facemill_nc_program::dialect::SubprogramPart;
use facemill_nc_program::read::ReadBlock;
use facemill_nc_subprograms::{SplitProgram, SplitSettings, expand, operation_sections, pass_sections, split};
use facemill_planner::Planned;

use crate::tool_changes::{JoinedProgram, is_same_block};

/// Program of a clamping as a main program that calls subprograms.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CallingProgram {
    /// Name of the setup in the job file.
    pub setup: String,
    /// Name of the flat program, whose blocks these are.
    pub program: String,
    /// Main program, then files of subprograms: names and contents. Or the reason why there are
    /// none.
    pub files: Result<Vec<(String, Vec<u8>)>, String>,
}

/// Returns the program of each planned clamping of a job that asks for subprograms
/// (`post.subprograms`): of the one with all tools where there are several. None where the job does
/// not ask.
///
/// Guarantee: main program and subprograms are read back with the calls expanded, and have the
/// blocks of the flat program in their order, with the same positions, feeds and state of the
/// control, so that what is verified of that holds for them.
///
/// # Errors
/// If numbers do not suffice or are in use, or the text that is read back differs.
pub fn calling_programs<T>(
    job: &Job,
    planned: &[(Planned, T)],
    joined: &[JoinedProgram],
) -> Result<Vec<CallingProgram>, Failure> {
    let Some((asked, rule)) = job.post.subprograms() else { return Ok(Vec::new()) };
    let mut next_number = asked.first_number.unwrap_or(rule.first_number);
    let setups = &job.file.setups;
    let clampings = job.clampings();
    let is_alone = clampings.len() == 1;
    let (mut all, mut n_changing) = (Vec::new(), 0);
    for (name, of) in clampings {
        // Numbers as the flat programs have them.
        let before = if of.len() > 1 { setups.len() + n_changing } else { of.start };
        n_changing += usize::from(of.len() > 1);
        let flat: Result<(String, &[u8]), String> = if of.len() > 1 {
            let found = joined.iter().find(|joined| joined.setup == name);
            let Some(found) = found else { continue };
            found.joined.as_ref().map(|(text, _)| (found.name.clone(), text.as_slice())).map_err(Clone::clone)
        } else {
            let found = planned.iter().map(|(p, _)| p).find(|p| p.report.setup == setups[of.start].name);
            let Some(found) = found else { continue };
            let program = found.program_to_run().map(|(name, text)| (name.to_owned(), text));
            program.ok_or_else(|| "the program has faults".to_owned())
        };
        let (program, text) = match flat {
            Ok(flat) => flat,
            Err(why) => {
                all.push(CallingProgram { setup: name, program: String::new(), files: Err(why) });
                continue;
            }
        };
        let settings = SplitSettings {
            dialect: job.post.dialect(),
            rules: job.post.rules(),
            rule,
            first_number: next_number,
            program_number: job.post.with_number_after(before as u32).program_number(),
            prefix: if asked.per == SubprogramPart::Operation { "OPERATION" } else { "PASS" },
        };
        let made = split_program(job, text, asked.per, &settings)?;
        if !rule.numbers_of_program {
            let of_programs =
                job.post.program_number()..job.post.with_number_after(numbers_in_use(job)).program_number();
            if next_number < of_programs.end && of_programs.start < made.next_number {
                let (from, to, last) = (next_number, made.next_number - 1, of_programs.end - 1);
                return Err(job.wrong(format!(
                    "post.subprograms: subprograms {from} to {to} have numbers of the job's programs, {} to {last}; take another \
                     subprograms.first_number",
                    of_programs.start
                )));
            }
            next_number = made.next_number;
        }
        let suffix = if is_alone { String::new() } else { format!("-{}", file_stem(&name)) };
        let main = (format!("program{suffix}-main.{}", job.post.extension()), made.main.into_bytes());
        let files = std::iter::once(main).chain(made.files.into_iter().map(|(name, text)| (name, text.into_bytes())));
        all.push(CallingProgram { setup: name, program, files: Ok(files.collect()) });
    }
    Ok(all)
}

/// Returns how many programs of the job have numbers: of all setups, of all tools, and for tables.
fn numbers_in_use(job: &Job) -> u32 {
    let clampings = job.clampings();
    let changing = clampings.iter().filter(|(_, of)| of.len() > 1).count();
    (job.file.setups.len() + changing + 2 * clampings.len()) as u32
}

/// Takes passes or operations out of a flat program, and compares what is read back with it.
fn split_program(
    job: &Job,
    text: &[u8],
    per: SubprogramPart,
    settings: &SplitSettings<'_>,
) -> Result<SplitProgram, Failure> {
    let flat = job.read_program(text, settings.dialect).map_err(|e| job.unread(&e))?;
    let sections = match per {
        SubprogramPart::Operation => operation_sections(&flat),
        _ => pass_sections(&flat),
    };
    let wrong = |why: String| job.wrong(format!("post.subprograms: {why}"));
    let made = split(&String::from_utf8_lossy(text), &sections, settings).map_err(|e| wrong(e.to_string()))?;
    let beside = |names: &[String]| {
        let is_one = |file: &&(String, String)| names.iter().any(|name| name.eq_ignore_ascii_case(&file.0));
        made.files.iter().find(is_one).map(|(name, text)| (name.clone(), text.clone().into_bytes()))
    };
    let expanded = expand(made.main.as_bytes(), "main", settings.dialect, &beside).map_err(|e| wrong(e.to_string()))?;
    let n_calls = expanded.as_ref().map_or(0, |expanded| expanded.n_calls);
    if n_calls != sections.len() {
        let n = sections.len();
        return Err(wrong(format!(
            "{n_calls} of {n} calls are read back: the words of the dialect file are not those of {}",
            settings.dialect.name()
        )));
    }
    let expanded = expanded.map(|expanded| expanded.text).unwrap_or_default();
    let called = job.read_program(&expanded, settings.dialect).map_err(|e| job.unread(&e))?;
    match first_difference(&flat, &called) {
        None => Ok(made),
        Some(line) => {
            Err(wrong(format!("with subprograms the program is not read back as without: line {line} of that")))
        }
    }
}

/// Returns the line of the flat program whose block is another one in the program with calls.
fn first_difference(flat: &ReadProgram, called: &ReadProgram) -> Option<u32> {
    let says = |b: &&ReadBlock| b.motion.is_some() || b.commands.iter().any(|c| !is_comment(c));
    let (mut a, mut b) = (flat.blocks.iter().filter(says), called.blocks.iter().filter(says));
    let mut last = 1;
    loop {
        match (a.next(), b.next()) {
            (None, None) => return None,
            (Some(own), Some(other)) if is_same_block(own, other) => last = own.line,
            (Some(own), _) => return Some(own.line),
            (None, Some(_)) => return Some(last),
        }
    }
}

fn is_comment(command: &facemill_nc_program::read::ReadCommand) -> bool {
    matches!(command, facemill_nc_program::read::ReadCommand::Comment(_))
}
