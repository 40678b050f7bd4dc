//! Example jobs for another machine or control: mounted where the machine reaches the part, and
//! tried before they are written.

use std::path::Path;

use facemill_cl_data::{CcPoint, ClPoint};
use facemill_cutter_location::{Hints, PoseTest, SearchCurve, search};
use facemill_inverse_kinematics::{BranchPreference, Machine, preset, preset_names};
use facemill_nc_program::Dialect;
use facemill_sample_jobs::round_to;
use facemill_tool_model::cl_from_cc;
use nalgebra::{Isometry3, Translation3};
use rayon::prelude::*;
use serde_json::{Value, json};

use crate::describe::describe_setup;
use facemill_job::examples::new_job::{NewJob, new_job};
use facemill_job::failure::Failure;
use facemill_job::frames::places;
use facemill_job::load::job::{Job, Setup};
use facemill_job::load::obstacle_meshes::ObstacleRole;
use facemill_job::setup::cell::{search_settings, workcell, z_map};
use facemill_job::setup::path::lay_operation;

/// Returns the files of an example for a machine by its name and a control; defaults are the
/// example's own.
///
/// On another machine, mounts the part where the machine reaches all of some hundred points spread
/// over its passes, nearly all of them in a feasible posture.
///
/// # Errors
/// If the numbers describe no part, the machine is unknown, the part cannot be cut on it, or the
/// control cannot be programmed as the job requires.
pub fn new_job_for(
    example: &NewJob,
    machine: Option<&str>,
    dialect: Option<Dialect>,
) -> Result<Vec<(String, Vec<u8>)>, String> {
    let mut written = new_job(example)?;
    if machine.is_none() && dialect.is_none() {
        return Ok(written);
    }
    let folder = tempfile::tempdir().map_err(|e| format!("no temporary folder to try the job in: {e}"))?;
    let mut job: Value = serde_json::from_slice(content(&mut written, "job.json")?).map_err(|e| e.to_string())?;
    if let Some(dialect) = dialect {
        job["post"]["dialect"] = json!(dialect);
    }
    if let Some(name) = machine {
        *content(&mut written, "machine.json")? = machine_for(example, name)?.as_bytes().to_vec();
    }
    let own_machine = matches!(example, NewJob::DualPropeller { .. }) || machine.is_none();
    if !own_machine {
        for operation in job["operations"].as_array_mut().into_iter().flatten() {
            operation["search"]["preferred_branch"] = json!("nearest_home");
        }
    }
    let fault = |e: Failure| without_folder(e, machine, dialect);
    let write = |job: &Value, written: &mut Vec<(String, Vec<u8>)>| {
        *content(written, "job.json")? = facemill_file_format::to_json(job).into_bytes();
        // A trial is read and rewritten: its files are not inputs to preserve.
        written
            .iter()
            .try_for_each(|(name, bytes)| std::fs::write(folder.path().join(name), bytes))
            .map_err(|e| e.to_string())
    };
    with_feed_mode(&mut job, |job| {
        write(job, &mut written)?;
        Job::read(folder.path()).map(drop).map_err(fault)
    })?;
    if !own_machine {
        let mounting = json!(mounting(folder.path()).map_err(fault)?);
        for setup in job["setups"].as_array_mut().into_iter().flatten() {
            setup["table_from_work"]["translation_mm"] = mounting.clone();
        }
        write(&job, &mut written)?;
        try_postures(folder.path()).map_err(fault)?;
    }
    let read = Job::read(folder.path()).map_err(fault)?;
    (0..read.file.setups.len()).try_for_each(|setup| describe_setup(&read, setup).map(drop)).map_err(fault)?;
    Ok(written)
}

/// Sets the first feed mode that the control has.
fn with_feed_mode(job: &mut Value, mut try_job: impl FnMut(&Value) -> Result<(), String>) -> Result<(), String> {
    let mut first = None;
    for mode in FEED_MODES {
        job["post"]["feed_mode"] = json!(mode);
        match try_job(job) {
            Ok(()) => return Ok(()),
            Err(why) => first = first.or(Some(why)),
        }
    }
    Err(first.unwrap_or_default())
}

/// Feed modes, by preference: not every control has each of them.
const FEED_MODES: [&str; 3] = ["g94", "g93", "rtcp"];

fn content<'f>(files: &'f mut [(String, Vec<u8>)], name: &str) -> Result<&'f mut Vec<u8>, String> {
    let found = files.iter_mut().find(|(other, _)| other == name).map(|(_, bytes)| bytes);
    found.ok_or_else(|| format!("the example has no {name}"))
}

/// Returns the machine file of this name, if the example can run on a machine with so many heads.
fn machine_for(example: &NewJob, name: &str) -> Result<&'static str, String> {
    let text = preset(name).ok_or_else(|| format!("no machine \"{name}\"; there are {}", preset_names().join(", ")))?;
    let heads = Machine::heads_from_json(text.as_bytes()).map_err(|e| e.to_string())?.len();
    match (matches!(example, NewJob::DualPropeller { .. }), heads) {
        (false, 2) => Err(format!("{name} has two heads; `facemill new propeller-dual` writes the example for them")),
        (true, 1) => {
            Err(format!("{name} has one head; the example cuts with two at once: take `facemill new propeller`"))
        }
        _ => Ok(text),
    }
}

/// Returns the text of a failure without the temporary folder's name.
fn without_folder(failure: Failure, machine: Option<&str>, dialect: Option<Dialect>) -> String {
    let what = match failure {
        Failure::Input { message, .. } => message,
        other => other.to_string(),
    };
    let on = machine.map(|name| format!("on {name}"));
    let with = dialect.map(|dialect| format!("for {}", dialect.name()));
    format!("{}: {what}", [on, with].into_iter().flatten().collect::<Vec<_>>().join(" "))
}

/// Largest number of points at which a mounting is tried, in each operation and place of its
/// pattern.
const SAMPLES: usize = 60;

/// Least distance that the tool must be able to retract from a point along its axis, mm.
const BACK: f64 = 30.0;

/// Point with its search curve.
struct Sample {
    cc: CcPoint,
    curve: SearchCurve,
}

/// Returns points spread over the passes of all operations, in all places.
fn samples(job: &Job, setup: &Setup<'_>) -> Result<Vec<Sample>, Failure> {
    let mut all = Vec::new();
    for (index, operation) in job.operations_of(setup.file) {
        let tasks = lay_operation(job, setup, index, operation)?.tasks;
        let points: Vec<(&CcPoint, SearchCurve)> =
            tasks.iter().flat_map(|task| task.pass.points.iter().map(|cc| (cc, task.curve))).collect();
        let some: Vec<_> = points.iter().step_by(points.len().div_ceil(SAMPLES).max(1)).collect();
        for place in places(operation.pattern.as_ref()) {
            all.extend(some.iter().map(|(cc, curve)| Sample { cc: cc.transformed(&place), curve: *curve }));
        }
    }
    Ok(all)
}

/// Returns the first position of the workpiece frame on the table, mm, at which the machine reaches
/// all samples: the example's own, then higher or lower ones, then those with the part's middle
/// over the table's.
fn mounting(folder: &Path) -> Result<[f64; 3], Failure> {
    let job = Job::read(folder)?;
    let setup = Setup::read(&job, 0)?;
    let samples = samples(&job, &setup)?;
    let part = setup.obstacles.iter().filter(|o| o.role == ObstacleRole::Part);
    let around = part.fold(facemill_cl_data::Aabb::EMPTY, |all, o| all.union(&o.mesh.aabb()));
    let [x, y, z] = setup.file.table_from_work.translation_mm;
    let heights = [20.0, 50.0, 100.0, 150.0, 200.0, 300.0, 400.0, 600.0, 800.0, 1000.0];
    let heights = std::iter::once(z).chain(heights.map(|height| height - around.min.z));
    let middle = around.center();
    let mut best: Option<(usize, String)> = None;
    for height in heights {
        for [x, y] in [[x, y], [-middle.x, -middle.y]] {
            let mount = [x, y, height].map(|v| round_to(v, 1));
            let turned = Isometry3::from_parts(Translation3::from(mount), setup.table_from_work.rotation);
            let lost: Vec<String> = samples.iter().filter_map(|sample| not_reached(&job, &turned, sample)).collect();
            let Some(first) = lost.first() else { return Ok(mount) };
            if best.as_ref().is_none_or(|(least, _)| lost.len() < *least) {
                best = Some((lost.len(), first.clone()));
            }
        }
    }
    let (lost, why) = best.unwrap_or_default();
    Err(job.wrong(format!(
        "the part cannot be cut there: wherever it was put on the table, at least {lost} of {} points of its passes are out of reach, \
         such as one where {why}; take a smaller part or another machine",
        samples.len()
    )))
}

/// Returns why no posture of the curve takes the tool to a sample and back from it.
fn not_reached(job: &Job, table_from_work: &Isometry3<f64>, sample: &Sample) -> Option<String> {
    let mut why = None;
    for u in [0.0, 0.5, 1.0] {
        let cl = cl_from_cc(job.tool.cutter(), &sample.cc, sample.curve.at(u)).transformed(table_from_work);
        let back = ClPoint { tip: cl.tip + cl.axis.into_inner() * BACK, axis: cl.axis };
        let reach = |cl: &ClPoint| {
            job.machine.nearest_inverse(cl, job.tool.gauge_length(), None, BranchPreference::Nearest).map(|_| ())
        };
        match reach(&cl).and_then(|()| reach(&back)) {
            Ok(()) => return None,
            Err(e) => why = why.or(Some(e.to_string())),
        }
    }
    why
}

/// Largest fraction of the samples that may lack a feasible posture: the plan leaves them out, and
/// reports it.
const WITHOUT_POSTURE: f64 = 0.05;

/// Checks that the samples have feasible postures, with all bodies of the machine.
fn try_postures(folder: &Path) -> Result<(), Failure> {
    let job = Job::read(folder)?;
    let setup = Setup::read(&job, 0)?;
    let map = z_map(&setup)?;
    let Some((_, operation)) = job.operations_of(setup.file).next() else { return Ok(()) };
    let cell = workcell(&job, &setup, operation, &map);
    let (test, settings) = (PoseTest::new(&cell), search_settings(operation));
    let samples = samples(&job, &setup)?;
    let blocked = |sample: &Sample| {
        search(&test, &sample.cc, &sample.curve, &settings, 0.0, None, &mut Hints::default())
            .err()
            .map(|e| test.describe(&e))
    };
    let blocked: Vec<String> = samples.par_iter().filter_map(blocked).collect();
    if blocked.len() as f64 <= WITHOUT_POSTURE * samples.len() as f64 {
        return Ok(());
    }
    let (lost, all) = (blocked.len(), samples.len());
    Err(job.wrong(format!(
        "the part cannot be cut there: {lost} of {all} points tried on its passes have no posture, such as one where {}; take a smaller \
         or larger part, or another machine",
        blocked[0]
    )))
}

#[cfg(test)]
#[path = "../tests/unit/new_machine.rs"]
mod tests;
