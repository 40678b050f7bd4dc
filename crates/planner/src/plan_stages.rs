//! The stages of a plan, in their order.

use crate::job_file::PathFile;
use crate::load::Job;
use crate::plan::PlanSettings;

/// Reads meshes.
pub(crate) const READ: &str = "read the meshes";
/// Lays the passes of an operation.
pub(crate) const LAY: &str = "lay the passes";
/// Finds postures at all points of the path.
pub(crate) const POSTURES: &str = "tilt and rotate";
/// Plans passes beside the pole again.
pub(crate) const DETOURS: &str = "other ways past the pole";
/// Tests passes in another place of the pattern.
pub(crate) const PLACES: &str = "other places of the pattern";
/// Plans passes put between those laid.
pub(crate) const ADDED: &str = "passes between";
/// Puts postures between points.
pub(crate) const BETWEEN: &str = "between points";
/// Draws the feasible postures of one point.
pub(crate) const PICTURE: &str = "picture of the postures";
/// Makes entries and links.
pub(crate) const LINKS: &str = "entries and links";
/// Takes cusps and chips along the passes.
pub(crate) const CHIPS: &str = "cusps and chips";
/// Looks for changes with which points that were left out have a posture.
pub(crate) const HELP: &str = "what would help";
/// Looks for faster links.
pub(crate) const SHORTEN: &str = "shorten links";
/// Writes the program, with feeds that the axes reach.
pub(crate) const WRITE: &str = "write the program";
/// Runs the program.
pub(crate) const VERIFY: &str = "verify program";
/// Proves what its blocks do between their ends.
pub(crate) const CERTIFY: &str = "certify program";
/// Cuts the stock.
pub(crate) const CUT: &str = "cut the stock";
/// Looks what meets the stock between its lines.
pub(crate) const LOOK: &str = "look between the lines";
/// Measures what the program leaves on the surface that is asked for.
pub(crate) const MATERIAL: &str = "material left";
/// Times the program by its text.
pub(crate) const TIMES: &str = "times of the program";

/// The stages of one setup's plan on a machine with one head.
pub(crate) fn stages_of(job: &Job, index: usize, settings: PlanSettings, has_stock: bool) -> Vec<&'static str> {
    let cuts = has_stock && settings.verify;
    let mut stages = vec![READ];
    for (k, (_, operation)) in job.operations_of(&job.file.setups[index]).enumerate() {
        stages.extend([LAY, POSTURES, DETOURS]);
        // Passes of a file are cut as they are.
        stages.extend(matches!(operation.path, PathFile::Strategy(_)).then_some(ADDED));
        stages.extend(operation.pattern.is_some().then_some(PLACES));
        stages.push(BETWEEN);
        stages.extend((k == 0).then_some(PICTURE));
        stages.extend([LINKS, CHIPS, HELP]);
    }
    stages.extend((cuts && job.file.setups[index].links.shorten).then_some(SHORTEN));
    stages.push(WRITE);
    stages.extend(settings.verify.then_some(VERIFY));
    stages.extend(settings.certificates.then_some(CERTIFY));
    stages.extend((cuts && job.file.verification.cut_stock).then_some([CUT, LOOK]).into_iter().flatten());
    stages.extend([TIMES, MATERIAL]);
    stages
}

/// The stages of one setup's plan on a machine with two heads.
pub(crate) fn stages_of_heads(job: &Job, index: usize, settings: PlanSettings, has_stock: bool) -> Vec<&'static str> {
    let mut stages = vec![READ];
    let setup = &job.file.setups[index];
    let mut pictured = false;
    let mut single = |stages: &mut Vec<&'static str>, has_pattern: bool| {
        stages.extend([LAY, POSTURES, DETOURS]);
        stages.extend(has_pattern.then_some(PLACES));
        stages.push(BETWEEN);
        stages.extend((!std::mem::replace(&mut pictured, true)).then_some(PICTURE));
        stages.extend([LINKS, CHIPS, HELP]);
    };
    for (_, operation) in job.operations_of(setup) {
        single(&mut stages, operation.pattern.is_some());
        if job.file.pairs.iter().any(|pair| pair.second == operation.name) {
            stages.extend(["both heads", "left beside both heads", "left for both heads"]);
            stages.extend(["left for one head", CHIPS, "left for one head", CHIPS]);
        }
    }
    stages.push(WRITE);
    stages.extend(settings.verify.then_some(["verify head 1", "verify head 2"]).into_iter().flatten());
    stages.extend(settings.certificates.then_some(["certify head 1", "certify head 2"]).into_iter().flatten());
    stages.extend((has_stock && settings.verify && job.file.verification.cut_stock).then_some(CUT));
    stages.extend([TIMES, MATERIAL]);
    stages
}
