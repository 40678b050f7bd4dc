//! Finishing of the new program: writing, reading and running until no changed link has a new
//! finding.

use crate::rapids::rapids_file::{LinkReport, RAPIDS_FORMAT, RapidsFile};
use facemill_job::failure::Failure;
use facemill_job::stages::Stages;
use facemill_tool_path::links::clock::LinkClock;
use facemill_tool_path::links::link_paths::RetractStrategy;
use facemill_tool_path::links::words::KeptLines;
use facemill_verification::program::Verified;
use facemill_virtual_machine::{Finding, Verification, merge_findings};

use crate::rapids::numbered::{replaced, without_numbers};
use crate::rapids::{LinkSearch, Rapids, SearchedLink, verified};

/// Largest number of rounds that restore the old lines of links with new findings, before the
/// program is left unchanged.
const ROUNDS: usize = 4;

/// Writes, reads and runs the new program until no changed link has a new finding.
pub(crate) fn finish(
    stage: &LinkSearch<'_>,
    text: &[u8],
    links: &mut [SearchedLink],
    before: &Verified,
    stages: &dyn Stages,
) -> Result<Rapids, Failure> {
    for _ in 0..ROUNDS {
        let (new, places) = written(stage, text, links);
        same_elsewhere(stage, [text, &new], links, &places)?;
        let after = verified(stage.scene.job, &new, stage.request, stages)?;
        let [was, is] = [before, &after].map(|v| &v.file.verification);
        if !take_back(links, &places, was, is) {
            if is.findings.len() > was.findings.len() {
                break;
            }
            let file = report(stage, links, &places, [before, &after]);
            return Ok(Rapids { text: new, file, verification: after.file });
        }
    }
    Err(Failure::Infeasible(format!(
        "{}: other paths for its links have findings that the program does not have; nothing is written",
        stage.request.program.display()
    )))
}

/// Returns the program with the improved links, and each link's first and last line in it.
fn written(stage: &LinkSearch<'_>, text: &[u8], links: &[SearchedLink]) -> (Vec<u8>, Vec<[u32; 2]>) {
    let changed: Vec<(&[u32], &[String])> =
        links.iter().filter_map(|l| Some((&l.own.as_ref()?.lines[..], &l.better.as_ref()?.1[..]))).collect();
    let (new, places) = replaced(text, &changed, stage.form.numbers_lines);
    let mut places = places.into_iter();
    let mut moved = 0_i64;
    let of_link = |link: &SearchedLink| match (&link.own, &link.better) {
        (Some(own), Some((_, texts))) => {
            moved += texts.len() as i64 - own.lines.len() as i64;
            places.next().unwrap_or_default()
        }
        _ => link.lines.map(|line| u32::try_from(i64::from(line) + moved).unwrap_or(0)),
    };
    let places = links.iter().map(of_link).collect();
    (new, places)
}

/// Checks the new program by reading it: outside of changed links its motions are those of the old
/// one, and links have the same end points. If every line has a number, compares both texts without
/// numbers.
fn same_elsewhere(
    stage: &LinkSearch<'_>,
    texts: [&[u8]; 2],
    links: &[SearchedLink],
    places: &[[u32; 2]],
) -> Result<(), Failure> {
    let internal = |why: String| Failure::Internal(format!("the program with other links {why}"));
    let read = |text: &[u8]| {
        let program = if stage.form.numbers_lines {
            stage.scene.job.read_program(&without_numbers(text), stage.request.dialect)
        } else {
            stage.scene.job.read_program(text, stage.request.dialect)
        };
        program.map_err(|e| internal(format!("cannot be read: {e}")))
    };
    let unnumbered = stage.form.numbers_lines.then(|| read(texts[0])).transpose()?;
    let (before, read) = (unnumbered.as_ref().unwrap_or(stage.program), read(texts[1])?);
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
    let mut old = before.blocks.iter().filter(|b| is_old(b.line));
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

/// Restores links at which the new program has a finding that the old one does not have there;
/// returns whether there were any.
fn take_back(links: &mut [SearchedLink], places: &[[u32; 2]], before: &Verification, after: &Verification) -> bool {
    let touches = |f: &Finding, [first, last]: [u32; 2]| f.first_line <= last && f.last_line >= first;
    let mut is_any = false;
    for (link, place) in links.iter_mut().zip(places).filter(|(l, _)| l.better.is_some()) {
        let is_same = |a: &Finding, b: &Finding| a.kind == b.kind && a.body == b.body && a.obstacle == b.obstacle;
        let was = |f: &Finding| before.findings.iter().any(|b| touches(b, link.lines) && is_same(b, f));
        let Some(new) = after.findings.iter().find(|f| touches(f, *place) && !was(f)) else { continue };
        link.kept = Some(KeptLines::because(format!("the faster path has a finding: {}", new.description())));
        link.better = None;
        is_any = true;
    }
    is_any
}

fn report(stage: &LinkSearch<'_>, links: &[SearchedLink], places: &[[u32; 2]], verified: [&Verified; 2]) -> RapidsFile {
    let views = [(&stage.scene.job.machine, stage.scene.job.tool.gauge_length())];
    let of_link = |(link, place): (&SearchedLink, &[u32; 2])| LinkReport {
        lines: link.lines,
        new_lines: *place,
        time_before_s: link.before,
        time_after_s: link.better.as_ref().map_or(link.before, |(way, _)| way.time),
        lower_bound_s: link.lower_bound,
        way: link.better.as_ref().map_or(RetractStrategy::Original, |(way, _)| way.kind),
        kept_line: link.kept.as_ref().and_then(|kept| kept.line),
        kept_because: link.kept.as_ref().map(|kept| kept.why.clone()),
    };
    let all: Vec<LinkReport> = links.iter().zip(places).map(of_link).collect();
    let sum = |time: fn(&LinkReport) -> f64| all.iter().map(time).sum::<f64>();
    let (after, bound) = (sum(|l| l.time_after_s), sum(|l| l.lower_bound_s));
    RapidsFile {
        format: RAPIDS_FORMAT,
        job: stage.scene.job.file.name.clone(),
        setup: stage.scene.setup.file.name.clone(),
        program: verified[0].file.program.clone(),
        called_files: Vec::new(),
        new_program_blake3: verified[1].file.program.blake3.clone(),
        dialect: stage.request.dialect.name().to_owned(),
        clearance_mm: stage.clearance,
        by_acceleration_and_jerk: LinkClock::new(&views).is_by_law(),
        time_before_s: sum(|l| l.time_before_s),
        time_after_s: after,
        lower_bound_s: bound,
        ratio_to_lower_bound: (bound > 0.0).then(|| after / bound),
        changed: links.iter().filter(|l| l.better.is_some()).count(),
        findings: verified.map(|v| merge_findings(v.file.verification.findings.clone(), &v.rapid_lines).len()),
        links: all,
    }
}
