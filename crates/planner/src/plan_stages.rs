//! Stages of a plan, in their order.

use facemill_job::format::job_file::{OperationFile, PathFile};
use facemill_job::load::job::Job;
use facemill_job::stages::{
    ADDED, BETWEEN, CERTIFY, CHIPS, CUT, DETOURS, HELP, LAY, LINKS, LOOK, MATERIAL, PICTURE, PLACES, POSTURES, READ,
    SHORTEN, TIMES, VERIFY, WRITE,
};

use crate::plan_settings::PlanSettings;

/// Returns the stages of one setup's plan on a machine with one head.
pub(crate) fn stages_of(job: &Job, index: usize, settings: PlanSettings, has_stock: bool) -> Vec<&'static str> {
    let cuts = has_stock && settings.verify;
    let mut stages = vec![READ];
    for (k, (_, operation)) in job.operations_of(&job.file.setups[index]).enumerate() {
        stages.extend([LAY, POSTURES, DETOURS]);
        // Passes of a file are cut unchanged.
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

/// Returns the stages of one setup's plan on a machine with two heads.
pub(crate) fn stages_of_heads(job: &Job, index: usize, settings: PlanSettings, has_stock: bool) -> Vec<&'static str> {
    let mut stages = vec![READ];
    let setup = &job.file.setups[index];
    let mut pictured = false;
    let mut single = |stages: &mut Vec<&'static str>, operation: &OperationFile| {
        stages.extend([LAY, POSTURES, DETOURS]);
        stages.extend(matches!(operation.path, PathFile::Strategy(_)).then_some(ADDED));
        stages.extend(operation.pattern.is_some().then_some(PLACES));
        stages.push(BETWEEN);
        stages.extend((!std::mem::replace(&mut pictured, true)).then_some(PICTURE));
        stages.extend([LINKS, CHIPS, HELP]);
    };
    for (_, operation) in job.operations_of(setup) {
        single(&mut stages, operation);
        if job.file.pairs.iter().any(|pair| pair.second == operation.name) {
            stages.extend(["both heads", "left beside both heads", "left for both heads"]);
            stages.extend([ADDED, BETWEEN, "left for both heads"]);
            stages.extend(["left for one head", CHIPS, "left for one head", CHIPS]);
        }
    }
    stages.extend((has_stock && settings.verify && setup.links.shorten).then_some(SHORTEN));
    stages.push(WRITE);
    stages.extend(settings.verify.then_some(["verify head 1", "verify head 2"]).into_iter().flatten());
    stages.extend(settings.certificates.then_some(["certify head 1", "certify head 2"]).into_iter().flatten());
    stages.extend((has_stock && settings.verify && job.file.verification.cut_stock).then_some(CUT));
    stages.extend([TIMES, MATERIAL]);
    stages
}
