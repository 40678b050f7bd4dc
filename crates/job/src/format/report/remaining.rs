//! Figures of the material that a program leaves, for reports.

use facemill_virtual_machine::{Finding, FindingKind, Measure};
use schemars::JsonSchema;
use serde::Serialize;

use crate::format::job_file::FinishFile;

/// Material that a program leaves on the surface that its operations are to cut, measured on its
/// written text.
///
/// Heights are along the surface's normal, from the surface to be left (the mesh with the allowance
/// of the drive surface) to the least height that the cutter reaches in any cut of the program.
/// They include all material that the program leaves: cusps, lifts, chords of the mesh, and strips
/// that no pass cuts.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct RemainingReport {
    /// Largest error of a height, mm.
    pub accuracy_mm: f64,
    /// Figures of all of the drive surface.
    pub drive: RemainingOnDrive,
    /// Figures for each operation of the setup.
    pub operations: Vec<RemainingOnRegion>,
}

/// Material left on all of the drive surface, by this program and all before it whose cuts are
/// known, also where no operation is to cut. Shares are by area, from about 10,000 places in the
/// first place of a pattern.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct RemainingOnDrive {
    /// Area of the drive surface.
    pub area_mm2: f64,
    /// Fraction of it outside every region of the program's operations.
    pub outside_fraction: f64,
    /// Smallest limit of the program's operations, mm.
    pub limit_mm: f64,
    /// Fraction of it above that limit.
    pub above_fraction: f64,
    /// Fraction of it that no cut reaches: the stock is unchanged there.
    pub never_cut_fraction: f64,
}

/// Material left on the region of one operation, in all places of its pattern. Shares and quantiles
/// are by area, from samples spread evenly over the region; along an edge or root of width 0, where
/// the region is a line, by length.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct RemainingOnRegion {
    /// Operation.
    pub operation: String,
    /// Area of the region.
    pub area_mm2: f64,
    /// Length of the region, if it is a line without area.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub length_mm: Option<f64>,
    /// Number of places measured all over it; with 0 nothing is known, and the region counts as
    /// exceeded. Places on its border and around the highest ones count only for the largest
    /// height.
    pub samples: usize,
    /// Approximate distance between them: narrower features may be missed. The search for the
    /// largest height has a quarter of this distance.
    pub spacing_mm: f64,
    /// Height that half of the area has at most.
    pub p50_mm: f64,
    /// Height that 90 % of the area has at most.
    pub p90_mm: f64,
    /// Height that 99 % of the area has at most.
    pub p99_mm: f64,
    /// The largest height left; absent if the region is too small for a sample.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub largest: Option<RemainingPlace>,
    /// Largest height of a finished region, mm: `cusp_mm` with path chord, linearisation and gouge
    /// tolerance.
    pub limit_mm: f64,
    /// Fraction of the area above that limit; on a level `uncertain_mm2` counts to both.
    pub above_fraction: f64,
    /// Fraction of the area that no cut reaches: the stock is unchanged there.
    pub never_cut_fraction: f64,
    /// Number of islands above that limit: parts of the region with no lower place between them,
    /// as finely as the samples lie.
    pub islands: usize,
    /// The largest of them by area, at most 16.
    pub largest_islands: Vec<LeftIslandReport>,
    /// The same by the slope of the surface; bands without area are left out, so a line has none.
    pub slopes: Vec<RemainingOnSlope>,
    /// Areas of the level that the operation cuts, if it cuts one: the region is what the tool
    /// reaches of it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub level: Option<LevelAreas>,
    /// Limits of the operation.
    pub allowed: FinishFile,
    /// Whether more is left than the limits permit; then `plan` exits with 1.
    pub exceeded: bool,
}

/// Part of a region that is left above its limit.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct LeftIslandReport {
    /// Its area, mm²; on a line its length, mm. 0 where only places on the border, or beside the
    /// highest ones, are in it.
    pub area_mm2: f64,
    /// Part of it that no cut reaches.
    pub never_cut_mm2: f64,
    /// Its highest place.
    pub highest: RemainingPlace,
    /// Least coordinates of its places, workpiece frame, mm.
    pub from_mm: [f64; 3],
    /// Largest coordinates of its places.
    pub to_mm: [f64; 3],
}

/// Areas of a level of roughing on which there is more material than `limit_mm`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct LevelAreas {
    /// Height of the level along its axis, workpiece frame, mm.
    pub height_mm: f64,
    /// Area with material before the program.
    pub before_mm2: f64,
    /// Part of it that stays because the part, a check surface or a fixture is in the way of the
    /// upright tool: their section with allowance, and what the corner of the tool leaves beside
    /// it. The tool certainly does not reach it.
    pub part_mm2: f64,
    /// Area with material behind the program of which it is not certain whether the tool reaches
    /// it: a border of less than a fifth of a cell of the lattice, which is a twelfth of the flat
    /// bottom's radius or more, and gaps narrower than a cell.
    pub uncertain_mm2: f64,
    /// Area that the tool could reach with material behind the program: points without a posture,
    /// entry or exit, and strips that no pass cuts.
    pub missed_mm2: f64,
    /// Part of `missed_mm2` where the level above is not cut, either: a level is not cut where it
    /// is thicker than its depth.
    pub uncut_above_mm2: f64,
}

/// Material left where the surface has a slope: the angle of its outward normal to z of the
/// machine's table, from 0° (facing up) to 180°.
///
/// The slope says how a machine reaches a place, and where a strategy fails: levels across z are
/// far apart on flat places, planes beside z on steep ones.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct RemainingOnSlope {
    /// Least angle of the band, included.
    pub from_deg: f64,
    /// Largest angle of the band, excluded; 180 is included.
    pub to_deg: f64,
    /// Area of the region in this band.
    pub area_mm2: f64,
    /// Height that 90 % of it has at most.
    pub p90_mm: f64,
    /// Height that 99 % of it has at most.
    pub p99_mm: f64,
    /// Largest height at any place measured in it.
    pub largest_mm: f64,
    /// Fraction of its area above `limit_mm`.
    pub above_fraction: f64,
    /// Fraction of its area that no cut reaches.
    pub never_cut_fraction: f64,
}

/// A place with material left.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct RemainingPlace {
    /// Height, mm; at a place that is never cut, that of the stock.
    pub height_mm: f64,
    /// The place on the surface, workpiece frame, mm.
    pub at_mm: [f64; 3],
    /// Line of the block that cuts there lowest; absent if none does.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub line: Option<u32>,
    /// Whether a program before has cut there, and no block of this one cuts lower.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub was_cut: bool,
}

impl RemainingOnRegion {
    /// Returns whether the region is unmeasured, because no sample lies in it.
    fn is_unmeasured(&self) -> bool {
        self.samples == 0
    }

    /// Describes the excess over the operation's limits, in words.
    pub fn why_exceeded(&self) -> String {
        let Self { operation, limit_mm, allowed, .. } = self;
        if self.is_unmeasured() && self.level.is_some() {
            return format!(
                "operation \"{operation}\": the upright tool reaches nothing of its level past part, check surfaces, fixtures \
                 and table, and there is material on it; end the levels above, or take a smaller tool"
            );
        }
        if self.is_unmeasured() {
            return format!(
                "operation \"{operation}\": no sample lies in its region, so the remaining material is unknown"
            );
        }
        format!(
            "operation \"{operation}\": {:.2} % of its region is left more than {limit_mm:.3} mm high, {:.2} % is never cut; the job allows \
             {:.2} % and {:.2} %",
            100.0 * self.above_fraction,
            100.0 * self.never_cut_fraction,
            100.0 * allowed.max_above_fraction,
            100.0 * allowed.max_never_cut_fraction
        )
    }

    /// Returns the figures in words, and their faults.
    fn summary(&self, several: bool) -> Vec<String> {
        let of = if several { format!(", operation \"{}\"", self.operation) } else { String::new() };
        if self.is_unmeasured() {
            return vec![format!("  NOT MEASURED      remaining material: no sample lies in the region{of}")];
        }
        let on = if self.length_mm.is_some() { "left on line    " } else { "left on surface " };
        let mut lines = vec![format!(
            "  {on}  half of it {:.3} mm, 90 % {:.3}, 99 % {:.3}, largest {}{of}",
            self.p50_mm,
            self.p90_mm,
            self.p99_mm,
            self.largest.map_or("none".to_owned(), |p| format!("{:.3}{}", p.height_mm, place(&p)))
        )];
        if let Some(level) = &self.level {
            let cm2 = |area: f64| area / 100.0;
            lines.push(format!(
                "    level {:.3} mm   material on {:.2} cm2: {:.2} stay because the part is there, {:.2} are uncertain, {:.2} are missed",
                level.height_mm,
                cm2(level.before_mm2),
                cm2(level.part_mm2),
                cm2(level.uncertain_mm2),
                cm2(level.missed_mm2)
            ));
            if level.uncut_above_mm2 > 0.0 {
                lines.push(format!(
                    "      of the missed    {:.2} cm2 because the level above was not cut there",
                    cm2(level.uncut_above_mm2)
                ));
            }
        }
        let percent = |share: f64| 100.0 * share;
        if self.above_fraction > 0.0 || self.never_cut_fraction > 0.0 {
            let all = self.length_mm.map_or(format!("{:.1} cm2", self.area_mm2 / 100.0), |l| format!("{l:.1} mm"));
            lines.push(format!(
                "    of {all}        {:.2} % above {:.3} mm, {:.2} % never cut",
                percent(self.above_fraction),
                self.limit_mm,
                percent(self.never_cut_fraction)
            ));
        }
        lines.extend(self.largest_islands.iter().take(SUMMARY_ISLANDS).map(|island| {
            let unit = if self.length_mm.is_some() { "mm" } else { "mm2" };
            format!(
                "    island of {:.1} {unit}, up to {:.3} mm{}",
                island.area_mm2,
                island.highest.height_mm,
                place(&island.highest)
            )
        }));
        let more = self.islands.saturating_sub(SUMMARY_ISLANDS);
        if more > 0 {
            lines.push(format!("    islands besides   {more}, the largest of them in the report"));
        }
        if self.exceeded {
            lines.push(format!(
                "    NOT FINISHED     the job allows {:.2} % above and {:.2} % never cut",
                percent(self.allowed.max_above_fraction),
                percent(self.allowed.max_never_cut_fraction)
            ));
        }
        lines
    }
}

/// Most islands in a summary.
const SUMMARY_ISLANDS: usize = 3;

fn place(p: &RemainingPlace) -> String {
    let [x, y, z] = p.at_mm;
    let uncut = if p.was_cut { "cut by a program before" } else { "never cut" };
    let line = p.line.map_or_else(|| uncut.to_owned(), |line| format!("line {line}"));
    format!(" at ({x:.2}, {y:.2}, {z:.2}), {line}")
}

/// Least fraction of the drive surface outside of all regions that is reported.
const REPORTED_OUTSIDE: f64 = 0.001;

impl RemainingReport {
    /// Returns the largest height left on any region.
    pub fn largest(&self) -> Option<&RemainingPlace> {
        let all = self.operations.iter().filter_map(|o| o.largest.as_ref());
        all.reduce(|a, b| if b.height_mm > a.height_mm { b } else { a })
    }

    /// Returns a finding for each operation that leaves more than its limits permit, at its highest
    /// place; without a cut near it, on the last line of the program.
    pub fn findings(&self, last_line: u32) -> Vec<Finding> {
        let finding = |o: &RemainingOnRegion| {
            let line = o.largest.and_then(|p| p.line).unwrap_or(last_line);
            Finding {
                measure: o.largest.map(|p| Measure::HeightMm(p.height_mm)),
                place_work_mm: o.largest.map(|p| p.at_mm),
                ..Finding::of_line(FindingKind::Excess, line, None, "", o.why_exceeded())
            }
        };
        self.operations.iter().filter(|o| o.exceeded).map(finding).collect()
    }

    /// Returns lines of a summary; the same for a plan and for a verification.
    pub fn summary_lines(&self) -> Vec<String> {
        let several = self.operations.len() > 1;
        let mut lines: Vec<String> = self.operations.iter().flat_map(|o| o.summary(several)).collect();
        let drive = &self.drive;
        if drive.outside_fraction >= REPORTED_OUTSIDE {
            lines.push(format!(
                "  outside regions   {:.1} % of the drive surface lies outside of every operation's region",
                100.0 * drive.outside_fraction
            ));
            lines.push(format!(
                "    of all of it      {:.1} % above {:.3} mm after this program, {:.1} % never cut",
                100.0 * drive.above_fraction,
                drive.limit_mm,
                100.0 * drive.never_cut_fraction
            ));
        }
        lines
    }
}
