//! Report on a program of two heads.

use facemill_cl_data::Posture;
use facemill_inverse_kinematics::Branch;
use facemill_job::format::report::pairs::PairReport;
use facemill_tool_path::moves::{Move, MoveKind};
use nalgebra::Vector3;

use crate::dual::output::DualTexts;
use crate::dual::parts::{ProgramPart, TwoHeadContext};
use crate::dual::program::DualTimes;
use crate::dual::runs::SyncPoint;
use crate::report::lost_time::Driven;
use crate::report::rotary_reversals::{RotaryReversals, rewinds_report, singular_blocks};

impl DualTexts {
    /// Returns the axes of either head that turn back or race at the pole.
    pub(crate) fn rotary_reversals(&self, parts: &[ProgramPart<'_>], context: &TwoHeadContext<'_>) -> RotaryReversals {
        let mut all: Option<RotaryReversals> = None;
        for h in 0..2 {
            let job = context.scenes[h].job;
            let work_from_table = context.scenes[h].setup.table_from_work.inverse();
            let mut from = None;
            let mut driven = Vec::new();
            for (line, place) in &self.places {
                let part = &parts[place.part];
                let section = &part.sections[place.section];
                let (m, goes_on) = (section.moves[place.at], section.goes_on);
                let cl = job.machine.cl_point(&m.axes, job.tool.gauge_length()).transformed(&work_from_table);
                let to = Move { kind: m.kind, cl, axes: m.axes, chip: None };
                let before = from.replace(to);
                if let Some(operation) = part.files[h].filter(|_| m.working[h]) {
                    driven.push(Driven { operation, goes_on, from: before, to, line: *line });
                }
            }
            let branches =
                driven.iter().filter(|m| m.to.kind == MoveKind::Cut).map(|m| job.machine.branch_of(&m.to.axes));
            let branches: Vec<Branch> = branches.collect();
            let changes = branches.windows(2).filter(|w| w[0] != w[1]).count();
            let rewinds = rewinds_report(job, &driven, changes);
            let singular_blocks = singular_blocks(job, &driven);
            match &mut all {
                None => all = Some(RotaryReversals { rewinds, singular_blocks, ..RotaryReversals::default() }),
                Some(all) => all.join(RotaryReversals { rewinds, singular_blocks, ..RotaryReversals::default() }),
            }
        }
        all.unwrap_or_default()
    }

    /// Returns the report on the program's pairs. `saved` is the time by which shorter links
    /// shorten each part.
    pub(crate) fn pair_reports(
        &self,
        parts: &[ProgramPart<'_>],
        saved: &[f64],
        context: &TwoHeadContext<'_>,
    ) -> Vec<PairReport> {
        let parts = parts.iter().zip(&self.times).zip(saved);
        parts.filter_map(|((part, times), saved)| pair_report(part, times, *saved, context)).collect()
    }
}

fn pair_report(
    part: &ProgramPart<'_>,
    times: &DualTimes,
    saved: f64,
    context: &TwoHeadContext<'_>,
) -> Option<PairReport> {
    let outline = part.pair.as_ref()?;
    let axis = &context.scenes[0].job.machine.axes()[context.shared];
    let (paired, cut): (f64, f64) = (times.paired.iter().sum(), times.cut.iter().sum());
    Some(PairReport {
        first: outline.file.first.clone(),
        second: outline.file.second.clone(),
        shared_axis: axis.letter.to_string(),
        runs: outline.runs,
        paired_length_mm: times.paired,
        cutting_length_mm: times.cut,
        paired_fraction: if cut > 0.0 { paired / cut } else { 0.0 },
        time_s: times.time,
        time_before_shortening_s: times.time + saved,
        separate_time_s: outline.separate_time,
        time_ratio: if outline.separate_time > 0.0 { (times.time + saved) / outline.separate_time } else { 0.0 },
        tip_feed_mm_min: times.paired_feeds,
        posture_jumps: [0, 1].map(|h| posture_jumps(part, h)),
        shared_velocity: axis.in_word_unit(times.shared_speed),
        splits: outline.splits.clone(),
    })
}

/// Counts the steps between stops of runs in which a head's tool turns farther relative to the
/// surface than its operation allows.
fn posture_jumps(part: &ProgramPart<'_>, head: usize) -> usize {
    let Some(operation) = part.files[head] else { return 0 };
    let allowed = operation.search.max_turn_deg_per_mm.to_radians();
    let is_jump = |w: &[SyncPoint]| {
        let [a, b] = [w[0].pose.poses[head].posture, w[1].pose.poses[head].posture];
        let way = (w[1].cc[head].position - w[0].cc[head].position).norm();
        // Angle between both axes as seen from the surface.
        let axis =
            |p: Posture| Vector3::new(p.tilt.sin() * p.rotate.cos(), p.tilt.sin() * p.rotate.sin(), p.tilt.cos());
        axis(a).angle(&axis(b)) > allowed * way + SAME_POSTURE
    };
    let runs = part.sections.iter().filter_map(|s| s.run.as_ref());
    runs.map(|run| run.stops.windows(2).filter(|w| is_jump(w)).count()).sum()
}

/// Largest turn that counts as none, rad: rounding of the inverse solution.
const SAME_POSTURE: f64 = 1e-6;
