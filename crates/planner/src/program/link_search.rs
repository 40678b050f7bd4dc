//! Search for faster links of a plan, for any number of heads: one search, one list of links, one
//! decision on the links that are restored.
//!
//! A link of several heads is one motion of all axes. A faster path replaces it only if tool and
//! bodies of every head are proven to keep their distances over this motion.

use facemill_inverse_kinematics::AxisValues;
use facemill_job::failure::Failure;
use facemill_job::format::report::links::{PlannedLinkReport, ShortenedLinks};
use facemill_job::setup::link_times::KEPT_OFF_FIRST_STOCK;
use facemill_job::stages::{SHORTEN, Stages};
use facemill_nc_program::ReadProgram;
use facemill_nc_program::read::Compensation;
use facemill_tool_path::links::choose::{Choice, Chosen};
use facemill_tool_path::links::clock::LinkClock;
use facemill_tool_path::links::link_paths::RetractStrategy;
use facemill_tool_path::links::words::LinkWords;
use facemill_tool_path::links::{LinkScene, fastest};
use facemill_verification::named_results::not_verified;
use facemill_virtual_machine::{
    Finding, LinkDistances, LinkHold, LinkSettings, LinkStage, ProgramLink, VerifySettings, VirtualSetup,
    links_off_first_stock, run_links,
};
use facemill_z_map::DexelMap;

/// Links of a setup, with the results of the search.
pub(crate) struct SearchedLinks {
    /// Clearance of rapids, mm.
    clearance: f64,
    /// Whether times are within acceleration and jerk of every axis.
    is_by_law: bool,
    /// Links between cuts, in program order.
    pub links: Vec<SearchedLink>,
}

/// Link with the result of the search.
pub(crate) struct SearchedLink {
    /// Index of its run of rapids; `None` if its lines are not those of a run: the link then stays.
    pub run: Option<usize>,
    /// Its first and last line during the search.
    pub lines: [u32; 2],
    /// Its time before the search, s.
    pub time_before: f64,
    /// Time of its slowest axis by itself, s.
    pub lower_bound: f64,
    /// Path that replaces it.
    pub faster: Option<FasterPath>,
    /// Reason why it stays.
    pub kept_because: Option<String>,
}

/// Path that replaces a link.
pub(crate) struct FasterPath {
    /// Its kind.
    pub kind: RetractStrategy,
    /// Its time, s.
    pub time: f64,
    /// Positions before its end.
    pub over: Vec<AxisValues>,
}

impl From<Chosen> for FasterPath {
    fn from(chosen: Chosen) -> Self {
        let mut over = chosen.through;
        over.pop();
        Self { kind: chosen.kind, time: chosen.time, over }
    }
}

impl SearchedLinks {
    /// Returns the faster paths, in program order, each with the index of its run.
    pub(crate) fn faster_paths(&self) -> impl Iterator<Item = (usize, &FasterPath)> {
        self.links.iter().filter_map(|link| Some((link.run?, link.faster.as_ref()?)))
    }

    /// Removes the faster paths on whose lines the program has a finding or a line that could not
    /// be certified, and returns them with the indices of their runs. `with_all` also removes all
    /// others if there is one.
    pub(crate) fn take_back(
        &mut self,
        lines_of_run: &dyn Fn(usize) -> Option<[u32; 2]>,
        doubts: (&[Finding], &[u32]),
        with_all: bool,
    ) -> Vec<(usize, FasterPath)> {
        let why = |link: &SearchedLink| {
            let run = link.run.filter(|_| link.faster.is_some())?;
            doubt_on("the faster path", lines_of_run(run)?, doubts)
        };
        let reasons: Vec<Option<String>> = self.links.iter().map(why).collect();
        if reasons.iter().all(Option::is_none) {
            return Vec::new();
        }
        let mut removed = Vec::new();
        for (link, reason) in self.links.iter_mut().zip(reasons).filter(|(_, why)| with_all || why.is_some()) {
            let (Some(run), Some(faster)) = (link.run, link.faster.take()) else { continue };
            let others = || "with faster paths of some links the program repeatedly has findings".to_owned();
            link.kept_because = Some(reason.unwrap_or_else(others));
            removed.push((run, faster));
        }
        removed
    }

    /// Returns the report on the links, with the lines of their runs in the written program.
    pub(crate) fn report(&self, lines_of_run: &dyn Fn(usize) -> Option<[u32; 2]>) -> ShortenedLinks {
        let of_link = |link: &SearchedLink| PlannedLinkReport {
            lines: link.run.and_then(lines_of_run).unwrap_or(link.lines),
            time_before_s: link.time_before,
            time_after_s: link.faster.as_ref().map_or(link.time_before, |faster| faster.time),
            lower_bound_s: link.lower_bound,
            way: link.faster.as_ref().map_or(RetractStrategy::Original, |faster| faster.kind),
            kept_because: link.kept_because.clone(),
        };
        ShortenedLinks::new(self.clearance, self.is_by_law, self.links.iter().map(of_link).collect())
    }
}

/// Returns the first finding on these lines, or else that one of them could not be certified; `of`
/// names what is there.
pub(crate) fn doubt_on(
    of: &str,
    [first, last]: [u32; 2],
    (findings, open_lines): (&[Finding], &[u32]),
) -> Option<String> {
    let finding = findings.iter().find(|f| f.first_line <= last && f.last_line >= first);
    let is_open = open_lines.iter().any(|line| (first..=last).contains(line));
    finding.map(|f| finding_text(of, f)).or_else(|| is_open.then(|| format!("{of} could not be certified")))
}

/// Describes a finding in blocks that the final program lacks.
fn finding_text(of: &str, finding: &Finding) -> String {
    let bodies = [&finding.body, &finding.obstacle].into_iter().flatten().cloned().collect::<Vec<_>>().join(" at ");
    let measure = finding.measure.as_ref().map_or_else(String::new, |m| format!(", {m}"));
    format!("{of} has a finding: {}, {bodies}{measure}", finding.kind)
}

/// Run of rapids in the text.
pub(crate) struct RunLines {
    /// Its first and last line; `None` if the text lacks it.
    pub lines: Option<[u32; 2]>,
    /// Reason why it must stay.
    pub hold: Option<&'static str>,
}

/// Rule by which the lines of a link belong to a run of rapids.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum LineMatch {
    /// The run includes the lines of the link: it may also have lines without motion.
    Within,
    /// Run and link have the same first and last line.
    Exact,
}

/// All runs of rapids that links are sought among.
pub(crate) struct RapidLines {
    /// The runs, in program order.
    pub runs: Vec<RunLines>,
    /// Rule by which a link belongs to one of them.
    pub rule: LineMatch,
}

impl RapidLines {
    /// Returns the index of the run that a link on these lines belongs to.
    fn run_of(&self, link: [u32; 2]) -> Option<usize> {
        let is_run = |[first, last]: [u32; 2]| match self.rule {
            LineMatch::Within => first <= link[0] && link[1] <= last,
            LineMatch::Exact => [first, last] == link,
        };
        self.runs.iter().position(|run| run.lines.is_some_and(is_run))
    }

    /// Checks that another path may replace a link.
    ///
    /// # Errors
    /// The reason why it must stay.
    fn check(&self, hold: Option<&LinkHold>, run: Option<usize>) -> Result<(), String> {
        match hold {
            Some(LinkHold::Doubt { .. }) => return Err("the positions of the axes are unknown".to_owned()),
            Some(LinkHold::Laws) => return Err("its blocks move in different ways".to_owned()),
            Some(LinkHold::WayIn | LinkHold::WayOut) | None => {}
        }
        match run.map(|run| self.runs[run].hold) {
            Some(None) => Ok(()),
            Some(Some(why)) => Err(why.to_owned()),
            None => Err("its blocks are not those from one pass to the next alone".to_owned()),
        }
    }
}

/// Search for the fastest path of every link that is proven free for all heads.
pub(crate) struct LinkSearch<'a> {
    /// Machine as each head sees it.
    pub heads: &'a [LinkScene<'a>],
    /// Clock of rapids.
    pub clock: &'a LinkClock<'a>,
    /// Settings for words of positions.
    pub words: LinkWords<'a>,
    /// Tool length compensation in force on links.
    pub compensation: Compensation,
    /// Program as read from its text.
    pub text: &'a ReadProgram,
    /// Runs of rapids of the text.
    pub rapids: RapidLines,
    /// Clearance of rapids, mm.
    pub clearance: f64,
}

impl LinkSearch<'_> {
    /// Searches for links that are free off the initial stock. `heads` are the setups of the
    /// heads.
    ///
    /// # Errors
    /// If the stages are cancelled.
    pub(crate) fn off_first_stock(
        &self,
        heads: &[&VirtualSetup<'_>],
        stages: &dyn Stages,
    ) -> Result<SearchedLinks, Failure> {
        let keep = LinkDistances { fixtures: self.clearance, first_stock: KEPT_OFF_FIRST_STOCK * self.clearance };
        let look = |link: &ProgramLink, stage: &LinkStage<'_, '_>| self.link(link, stage);
        let monitor = stages.start(SHORTEN, self.text.blocks.len());
        let links = links_off_first_stock(self.text, heads, (&VerifySettings::default(), keep), &look, &*monitor);
        Ok(self.searched(links.map_err(not_verified)?))
    }

    /// Searches for links that are free of the stock at that time, which is the given one with its
    /// tolerance at first. `heads` are the setups of the heads, which all cut it.
    ///
    /// # Errors
    /// If the stages are cancelled.
    pub(crate) fn in_cut_stock(
        &self,
        heads: &[&VirtualSetup<'_>],
        (mut stock, tolerance): (DexelMap, f64),
        stages: &dyn Stages,
    ) -> Result<SearchedLinks, Failure> {
        let (verify, keep) = (VerifySettings::default(), LinkSettings { clearance: self.clearance, tolerance });
        let mut links = Vec::new();
        let mut visit = |link: &ProgramLink, stage: &LinkStage<'_, '_>| links.push(self.link(link, stage));
        let monitor = stages.start(SHORTEN, self.text.blocks.len());
        run_links(self.text, heads, (&verify, &keep), &mut stock, &mut visit, &*monitor).map_err(not_verified)?;
        Ok(self.searched(links))
    }

    fn searched(&self, links: Vec<Option<SearchedLink>>) -> SearchedLinks {
        let links = links.into_iter().flatten().collect();
        SearchedLinks { clearance: self.clearance, is_by_law: self.clock.is_by_law(), links }
    }

    /// Searches for the fastest path of a link; `None` for the way to the part and the way home.
    fn link(&self, link: &ProgramLink, stage: &LinkStage<'_, '_>) -> Option<SearchedLink> {
        if matches!(link.hold, Some(LinkHold::WayIn | LinkHold::WayOut)) {
            return None;
        }
        let line = |block: Option<&usize>| block.map_or(0, |&b| self.text.blocks[b].line);
        let lines = [line(link.blocks.first()), line(link.blocks.last())];
        let run = self.rapids.run_of(lines);
        let found = self.rapids.check(link.hold.as_ref(), run).and_then(|()| self.choice(link, stage));
        let (choice, kept_because) = match found {
            Ok(choice) => (choice, None),
            Err(why) => (self.kept(link), Some(why)),
        };
        let Choice { before: time_before, lower_bound, better } = choice;
        Some(SearchedLink { run, lines, time_before, lower_bound, faster: better.map(FasterPath::from), kept_because })
    }

    fn choice(&self, link: &ProgramLink, stage: &LinkStage<'_, '_>) -> Result<Choice, String> {
        let rounded = |axes: &AxisValues| self.words.rounded(self.compensation, axes).map(|(_, rounded)| rounded);
        fastest(self.heads, self.clock, (link, stage), &rounded)
    }

    /// Returns the times of a link that stays.
    fn kept(&self, link: &ProgramLink) -> Choice {
        let before = self.clock.time(link.law, &link.start, &link.ends).unwrap_or(0.0);
        let lower_bound = link.ends.last().map_or(0.0, |end| self.clock.least_time(&link.start, end));
        Choice { before, lower_bound, better: None }
    }
}

#[cfg(test)]
#[path = "../../tests/unit/program/link_search.rs"]
mod tests;
