//! Faster links for a program that exists: each replaced by the fastest way that is proven free, against the stock as it is then.

mod choose;
mod clock;
mod report;
mod text;
mod tour;
mod ways;

use std::path::Path;

use facemill_inverse_kinematics::{AxisValues, BlockLaw};
use facemill_nc_program::{Compensation, Dialect, ReadProgram, WordMap, read_program};
use facemill_virtual_machine::{
    Finding, LinkHold, LinkSettings, LinkStage, ProgramLink, Verification, VerifySettings, VirtualSetup, run_links,
};
use nalgebra::Isometry3;

use crate::load::{Job, Setup};
use crate::operation::clearance_surface;
use crate::output::not_verified;
use crate::program::{rtcp_frame, word_map};
use crate::stock_map::stock_map;
use crate::verify_program::virtual_setup;
use crate::{CutRequest, Failure, Stages, VerificationFile, VerifyRequest, verify_program};
use choose::{Choice, Chooser, Chosen};
use clock::LinkClock;
use text::{LinkLines, LinkWords, link_lines, replaced};
use ways::Ends;

pub use report::{LinkReport, RAPIDS_FORMAT, RapidsFile};
pub use tour::{Tour, TourCosts, TourError, shortest_tour};
pub use ways::WayKind;

/// How a program's links are looked at.
#[derive(Clone, Debug)]
pub struct RapidsRequest<'a> {
    /// What errors call the program.
    pub program: &'a Path,
    /// Control that it is for.
    pub dialect: Dialect,
    /// Index of the job's setup.
    pub setup: usize,
    /// As in [`VerifyRequest::gouge_limit`].
    pub gouge_limit: Option<f64>,
    /// Lines of the stock, and what it begins as.
    pub cut: CutRequest,
    /// Distance to keep from stock and fixtures, mm; `None`: the setup's for rapids.
    pub clearance: Option<f64>,
}

/// A program with faster links.
#[derive(Clone, Debug)]
pub struct Rapids {
    /// Its text: that of the program with other lines in the links that changed, byte for byte elsewhere.
    pub text: Vec<u8>,
    /// What was done.
    pub file: RapidsFile,
    /// What the new program does.
    pub verification: VerificationFile,
}

/// Replaces links of a program (all rapids between two runs of cuts) by the fastest way among those of [`WayKind`] that is free
/// of the stock as it is then, of part, fixtures and machine: proven as rapids are in certificates, with the clearance as
/// [`LinkSettings`] says. A link without a faster free way keeps its bytes, as does all else.
///
/// The new program is read again: outside of changed links it has the same motions. It is run with its stock like
/// [`verify_program`] does, and has no finding in a link that was not there before: such links get their old lines back.
///
/// # Errors
/// When a file of the job is wrong, the program is not understood, it is for a control or a machine whose links are not replaced,
/// or the stages are cancelled.
pub fn faster_rapids(
    job: &Job,
    text: &[u8],
    request: &RapidsRequest<'_>,
    stages: &dyn Stages,
) -> Result<Rapids, Failure> {
    if request.dialect == Dialect::Heidenhain {
        let message = "links are not replaced in programs for Heidenhain controls: every line has its number there";
        return Err(Failure::input(request.program, message));
    }
    if job.second.is_some() {
        return Err(job.wrong("links of machines with two heads are not replaced"));
    }
    let program = read_program(text, request.dialect).map_err(|e| Failure::input(request.program, e))?;
    let verified = verified(job, text, request, stages)?;
    let setup = Setup::read(job, request.setup)?;
    let words = word_map(job, &setup, request.setup)?;
    let clearance = request.clearance.unwrap_or(setup.file.rapid_clearance_mm);
    let stage = Stage { job, setup: &setup, words: &words, program: &program, request, clearance };
    let mut links = stage.links(stages)?;
    let outcome = finish(&stage, text, &mut links, &verified, stages)?;
    Ok(outcome)
}

fn verified(
    job: &Job,
    text: &[u8],
    request: &RapidsRequest<'_>,
    stages: &dyn Stages,
) -> Result<VerificationFile, Failure> {
    let verify = VerifyRequest {
        program: request.program,
        dialect: request.dialect,
        setup: request.setup,
        gouge_limit: request.gouge_limit,
        certificates: false,
        cut: Some(request.cut.clone()),
    };
    Ok(verify_program(job, text, &verify, stages)?.file)
}

/// A link with what was found for it.
struct Found {
    /// Lines of its first and last motion.
    lines: [u32; 2],
    /// Its own lines; `None` where they stay.
    own: Option<LinkLines>,
    before: f64,
    lower_bound: f64,
    better: Option<(Chosen, Vec<String>)>,
    kept_because: Option<String>,
}

/// Everything that links are looked at with.
struct Stage<'a> {
    job: &'a Job,
    setup: &'a Setup<'a>,
    words: &'a WordMap,
    program: &'a ReadProgram,
    request: &'a RapidsRequest<'a>,
    clearance: f64,
}

impl Stage<'_> {
    /// Every link between two runs of cuts, with the fastest free way.
    fn links(&self, stages: &dyn Stages) -> Result<Vec<Found>, Failure> {
        let frame = rtcp_frame(self.job, self.words).unwrap_or_else(Isometry3::identity);
        let at = virtual_setup(self.request.dialect, self.job, self.setup, self.words, frame);
        let mut stock = match &self.request.cut.rest {
            Some(rest) => rest.clone(),
            None => stock_map(self.job, self.setup, self.request.cut.cell)?,
        };
        let views = [(&self.job.machine, self.job.tool.gauge_length())];
        let clock = LinkClock::new(&views);
        let keep = LinkSettings { clearance: self.clearance, tolerance: self.request.cut.tolerance };
        let mut found = Vec::new();
        let mut failed = None;
        let mut visit = |link: &ProgramLink, stage: &LinkStage<'_, '_>| {
            if failed.is_some() || matches!(link.hold, Some(LinkHold::WayIn | LinkHold::WayOut)) {
                return;
            }
            match self.link(&at, &clock, link, stage) {
                Ok(link) => found.push(link),
                Err(why) => failed = Some(why),
            }
        };
        let monitor = stages.start("shorten links", self.program.blocks.len());
        let verify = VerifySettings::default();
        run_links(self.program, &at, (&verify, &keep), &mut stock, &mut visit, &*monitor).map_err(not_verified)?;
        match failed {
            Some(why) => Err(Failure::input(self.request.program, why)),
            None => Ok(found),
        }
    }

    fn link(
        &self,
        at: &VirtualSetup<'_>,
        clock: &LinkClock<'_>,
        link: &ProgramLink,
        stage: &LinkStage<'_, '_>,
    ) -> Result<Found, String> {
        let line = |block: Option<&usize>| block.map_or(0, |&b| self.program.blocks[b].line);
        let lines = [line(link.blocks.first()), line(link.blocks.last())];
        let own = held(link).map_or_else(|| link_lines(self.program, self.words, link), Err);
        let own = match own {
            Ok(own) => own,
            Err(why) => {
                let before = clock.time(link.law, &link.start, &link.ends)?;
                let end = link.ends.last().copied().unwrap_or(link.start);
                let lower_bound = clock.time(link.law, &link.start, &[end])?;
                return Ok(Found { lines, own: None, before, lower_bound, better: None, kept_because: Some(why) });
            }
        };
        let writer = self.writer(at);
        let (choice, lines_of) = self.choose(&writer, &own, clock, link, stage)?;
        let Choice { before, lower_bound, better, .. } = choice;
        let better = better.zip(lines_of);
        Ok(Found { lines, own: Some(own), before, lower_bound, better, kept_because: None })
    }

    fn choose(
        &self,
        writer: &LinkWords<'_>,
        own: &LinkLines,
        clock: &LinkClock<'_>,
        link: &ProgramLink,
        stage: &LinkStage<'_, '_>,
    ) -> Result<(Choice, Option<Vec<String>>), String> {
        let machine = &self.job.machine;
        let surface = clearance_surface(&self.setup.file.clearance);
        let travel = machine.length_compensation_travel().unwrap_or_else(|| AxisValues::zeros(link.start.len()));
        let spindle = (0..travel.len()).max_by(|&a, &b| travel[a].abs().total_cmp(&travel[b].abs())).unwrap_or(0);
        let ends = Ends {
            machine,
            tool_length: self.job.tool.gauge_length(),
            table_from_work: self.setup.table_from_work,
            surface: &surface,
            start: link.start,
            end: link.ends.last().copied().unwrap_or(link.start),
            spindle: (spindle, travel[spindle].signum()),
        };
        let compensation: Compensation = own.compensation();
        let rounded = |axes: &AxisValues| writer.rounded(compensation, axes).map(|(_, rounded)| rounded);
        let chooser = Chooser { ends: &ends, clock, law: link.law, rounded: &rounded };
        let choice = chooser.choose(link, stage)?;
        let lines = choice.better.as_ref().and_then(|better| writer.lines(own, &better.through));
        Ok((choice, lines))
    }

    fn writer<'w>(&'w self, at: &VirtualSetup<'_>) -> LinkWords<'w> {
        LinkWords {
            machine: &self.job.machine,
            tool_length: self.job.tool.gauge_length(),
            words: self.words,
            table_from_rtcp_words: at.table_from_rtcp_words,
            decimals: self.job.post.decimals(),
            always_point: self.request.dialect.file().numbers.always_point,
        }
    }
}

/// Why a link is not looked at.
fn held(link: &ProgramLink) -> Option<String> {
    match &link.hold {
        Some(LinkHold::Doubt(what)) => Some(format!("where the axes are is open: {what}")),
        Some(LinkHold::Laws) => Some("its blocks move in different ways".to_owned()),
        _ if matches!(link.law, BlockLaw::Cutting(_)) => {
            Some("the control keeps the tip on a line at rapid rate there (RTCP), which is not replaced".to_owned())
        }
        _ => None,
    }
}

/// How often links with new findings get their old lines back before nothing is changed.
const ROUNDS: usize = 4;

/// Writes, reads and runs the new program until no changed link has a new finding.
fn finish(
    stage: &Stage<'_>,
    text: &[u8],
    links: &mut [Found],
    before: &VerificationFile,
    stages: &dyn Stages,
) -> Result<Rapids, Failure> {
    for _ in 0..ROUNDS {
        let (new, places) = written(text, links);
        same_elsewhere(stage, &new, links, &places)?;
        let after = verified(stage.job, &new, stage.request, stages)?;
        if !take_back(links, &places, &before.verification, &after.verification) {
            if after.verification.findings.len() > before.verification.findings.len() {
                break;
            }
            let file = report(stage, links, &places, [before, &after]);
            return Ok(Rapids { text: new, file, verification: after });
        }
    }
    Err(Failure::Infeasible(format!(
        "{}: other ways for its links have findings that the program does not have; nothing is written",
        stage.request.program.display()
    )))
}

/// The program with the links that have a better way, and each link's first and last line in it.
fn written(text: &[u8], links: &[Found]) -> (Vec<u8>, Vec<[u32; 2]>) {
    let changed: Vec<(&[u32], &[String])> =
        links.iter().filter_map(|l| Some((&l.own.as_ref()?.lines[..], &l.better.as_ref()?.1[..]))).collect();
    let (new, places) = replaced(text, &changed);
    let mut places = places.into_iter();
    let mut moved = 0_i64;
    let of_link = |link: &Found| match (&link.own, &link.better) {
        (Some(own), Some((_, texts))) => {
            moved += texts.len() as i64 - own.lines.len() as i64;
            places.next().unwrap_or_default()
        }
        _ => link.lines.map(|line| u32::try_from(i64::from(line) + moved).unwrap_or(0)),
    };
    let places = links.iter().map(of_link).collect();
    (new, places)
}

/// Reads the new program: outside of changed links its motions are those of the old one, and links end where they did.
fn same_elsewhere(stage: &Stage<'_>, new: &[u8], links: &[Found], places: &[[u32; 2]]) -> Result<(), Failure> {
    let internal = |why: String| Failure::Internal(format!("the program with other links {why}"));
    let read = read_program(new, stage.request.dialect).map_err(|e| internal(format!("is not read: {e}")))?;
    let old_lines: Vec<u32> = links
        .iter()
        .filter(|l| l.better.is_some())
        .flat_map(|l| l.own.iter().flat_map(|own| own.lines.iter().copied()))
        .collect();
    let new_lines: Vec<[u32; 2]> =
        links.iter().zip(places).filter(|(l, _)| l.better.is_some()).map(|(_, place)| *place).collect();
    let is_old = |line: u32| old_lines.binary_search(&line).is_err();
    let is_new = |line: u32| {
        let k = new_lines.partition_point(|[_, last]| *last < line);
        new_lines.get(k).is_none_or(|[first, _]| line < *first)
    };
    let mut old = stage.program.blocks.iter().filter(|b| is_old(b.line));
    let mut kept = read.blocks.iter().filter(|b| is_new(b.line));
    loop {
        match (old.next(), kept.next()) {
            (None, None) => return Ok(()),
            (Some(a), Some(b)) if a.motion == b.motion && a.commands == b.commands && a.text == b.text => {}
            (a, b) => {
                let [a, b] = [a, b].map(|block| block.map_or(0, |block| block.line));
                return Err(internal(format!("does something else in line {b} than before in line {a}")));
            }
        }
    }
}

/// Takes better ways back where the new program has a finding that the old one does not have there; says whether there were any.
fn take_back(links: &mut [Found], places: &[[u32; 2]], before: &Verification, after: &Verification) -> bool {
    let touches = |f: &Finding, [first, last]: [u32; 2]| f.first_line <= last && f.last_line >= first;
    let mut is_any = false;
    for (link, place) in links.iter_mut().zip(places).filter(|(l, _)| l.better.is_some()) {
        let is_same = |a: &Finding, b: &Finding| a.kind == b.kind && a.body == b.body && a.obstacle == b.obstacle;
        let was = |f: &Finding| before.findings.iter().any(|b| touches(b, link.lines) && is_same(b, f));
        let Some(new) = after.findings.iter().find(|f| touches(f, *place) && !was(f)) else { continue };
        link.kept_because = Some(format!("the faster way has a finding: {new}"));
        link.better = None;
        is_any = true;
    }
    is_any
}

fn report(stage: &Stage<'_>, links: &[Found], places: &[[u32; 2]], verified: [&VerificationFile; 2]) -> RapidsFile {
    let views = [(&stage.job.machine, stage.job.tool.gauge_length())];
    let of_link = |(link, place): (&Found, &[u32; 2])| LinkReport {
        lines: link.lines,
        new_lines: *place,
        time_before_s: link.before,
        time_after_s: link.better.as_ref().map_or(link.before, |(way, _)| way.time),
        lower_bound_s: link.lower_bound,
        way: link.better.as_ref().map_or(WayKind::Original, |(way, _)| way.kind),
        kept_because: link.kept_because.clone(),
    };
    let all: Vec<LinkReport> = links.iter().zip(places).map(of_link).collect();
    let sum = |time: fn(&LinkReport) -> f64| all.iter().map(time).sum::<f64>();
    let (after, bound) = (sum(|l| l.time_after_s), sum(|l| l.lower_bound_s));
    RapidsFile {
        format: RAPIDS_FORMAT,
        job: stage.job.file.name.clone(),
        setup: stage.setup.file.name.clone(),
        dialect: stage.request.dialect.name().to_owned(),
        clearance_mm: stage.clearance,
        by_acceleration_and_jerk: LinkClock::new(&views).is_by_law(),
        time_before_s: sum(|l| l.time_before_s),
        time_after_s: after,
        lower_bound_s: bound,
        ratio_to_lower_bound: (bound > 0.0).then(|| after / bound),
        changed: links.iter().filter(|l| l.better.is_some()).count(),
        findings: verified.map(|v| v.verification.findings.len()),
        links: all,
    }
}
