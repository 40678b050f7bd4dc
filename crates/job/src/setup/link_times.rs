//! Times of links before they are in a program.

use facemill_inverse_kinematics::AxisValues;
use facemill_tool_path::links::clock::LinkClock;
use facemill_tool_path::links::{LinkTime, fastest};
use facemill_virtual_machine::{LinkDistances, LinkStage, ProgramLink, VerifyError, VerifySettings, with_first_stock};

use crate::format::job_file::LinkStockFile;
use crate::setup::scene::Scene;

/// Fraction of the rapid clearance that is proven to be kept from the initial stock: links begin
/// and end at the whole clearance, and the control may deviate from them slightly.
pub const KEPT_OFF_FIRST_STOCK: f64 = 0.9;

/// Runs `of` with the times of links as a plan makes them in a setup of one head: of the fastest
/// path that is proven free off the initial stock, or, if links stay as they are, of the way given.
/// There are none where links may go through stock that has been cut, and on machines with two
/// heads.
///
/// # Errors
/// When the setup makes no sense to the virtual machine.
pub fn with_link_times<T>(scene: &Scene<'_>, of: impl FnOnce(Option<&LinkTime<'_>>) -> T) -> Result<T, VerifyError> {
    let (job, file) = (scene.job, scene.setup.file);
    if job.machine.head_count() > 1 {
        return Ok(of(None));
    }
    let views = [(&job.machine, scene.tool_length())];
    let (clock, law) = (LinkClock::new(&views), job.rapid_law());
    if !file.links.shorten {
        let as_given =
            |start: &AxisValues, through: &[AxisValues]| clock.time(law, start, through).unwrap_or(f64::INFINITY);
        return Ok(of(Some(&as_given)));
    }
    if file.links.stock != LinkStockFile::AtFirst {
        return Ok(of(None));
    }
    let (heads, words, compensation) = ([scene.link_scene()], scene.link_words(), scene.compensation());
    let rounded = |axes: &AxisValues| words.rounded(compensation, axes).map(|(_, rounded)| rounded);
    let at = scene.virtual_setup(job.post.dialect());
    let clearance = file.rapid_clearance_mm;
    let keep = LinkDistances { fixtures: clearance, first_stock: KEPT_OFF_FIRST_STOCK * clearance };
    with_first_stock(&[&at], (&VerifySettings::default(), keep), |stage: &LinkStage<'_, '_>| {
        let shortened = |start: &AxisValues, through: &[AxisValues]| {
            let link = ProgramLink::outside_programs(*start, through.to_vec(), law);
            let found = fastest(&heads, &clock, (&link, stage), &rounded);
            found.map_or(f64::INFINITY, |choice| choice.better.map_or(choice.before, |better| better.time))
        };
        of(Some(&shortened))
    })
}
