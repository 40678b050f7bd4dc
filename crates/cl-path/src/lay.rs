//! Cuts to passes.

use facemill_cc_path::feed_along;
use facemill_cl_data::{CcPoint, ClPoint, Posture};
use facemill_surface_model::Surface;
use facemill_tool_model::Cutter;
use nalgebra::{Point3, Unit, Vector3};
use rayon::prelude::*;

use crate::contact::{Contact, ContactKind, contact};
use crate::cuts::{FilePoint, ToolCuts};
use crate::cutter_distance::nearest_to_cutter;
use crate::fault::ClPathFault;
use crate::samples::{between, directions, steps};
use crate::turns::AxisTurns;

/// Settings for passes on a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LaySettings {
    /// Which place of the contact is the CC point.
    pub kind: ContactKind,
    /// Largest distance of the cutter from the surface with its allowance, and largest depth in it,
    /// mm. Larger: motion above the surface, and deeper cuts, become passes.
    pub max_distance: f64,
    /// Material to leave on the surface, mm.
    pub allowance: f64,
    /// Largest distance of points along a cut, mm; points are inserted between those of the file.
    pub max_step: f64,
    /// Largest number of points, with those inserted.
    pub max_points: usize,
}

/// A CC point with the file's pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FileContact {
    /// CC point on the surface without its allowance.
    pub cc: CcPoint,
    /// Tilt and rotate of the file's axis there: they lead to the file's pose from the place of the
    /// tool ([`ContactKind::OfTool`]).
    pub posture: Posture,
    /// The file's pose.
    pub cl: ClPoint,
    /// Line of the file: that of the point that the tool is on the way to.
    pub line: u32,
}

/// Part of a cut on the surface.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ClPass {
    /// At least two, in the file's order.
    pub points: Vec<FileContact>,
}

/// Distance of the file's cutter from the surface with its allowance.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StandOff {
    /// Distance, mm, not below 0.
    pub mm: f64,
    /// Line of the file; 0 if the distance is 0 everywhere.
    pub line: u32,
}

/// Passes of a file on a surface.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ClPasses {
    /// In the file's order.
    pub passes: Vec<ClPass>,
    /// Number of the file's points that are farther from the surface than allowed, or alone:
    /// entries, exits and links.
    pub off_surface: usize,
    /// Line of the first of them.
    pub first_off: Option<u32>,
    /// Length of the tip's way along all cuts, mm.
    pub length: f64,
    /// Length of the tip's way along the passes, mm.
    pub length_in_passes: f64,
    /// Number of points, of the file and inserted, that are in no pass because their feed is along
    /// the normal or turns back.
    pub without_direction: usize,
    /// Line of the first of them.
    pub first_without: Option<u32>,
    /// Number of places where the contact jumps to another place of the cutter, and the pass is
    /// divided.
    pub jumps: usize,
    /// Line of the first of them.
    pub first_jump: Option<u32>,
    /// Turns of the file's axis in passes.
    pub turns: AxisTurns,
    /// Largest distance above the surface of points in passes.
    pub above: StandOff,
    /// Largest depth below the surface of points in passes.
    pub below: StandOff,
}

/// A pose of a cut.
#[derive(Clone, Copy)]
struct Sample {
    point: FilePoint,
    feed: Vector3<f64>,
    /// Whether the file has it.
    is_of_file: bool,
}

/// Poses on the surface that follow each other.
type ContactRun = Vec<(FilePoint, Contact)>;

/// Returns where the cutter touches a surface along the cuts of a file, as passes.
///
/// Parts of cuts that are farther above the surface than allowed, as entries, exits and links at
/// feed, are in no pass; passes end within a hundredth of the step of where the cutter leaves the
/// surface. A cut that turns back by more than 120° is divided there; with
/// [`ContactKind::OfSurface`] also one whose contact jumps, as from one side of the rim to the
/// other: points are inserted as long as they bring both places together.
///
/// # Errors
/// With the line: the cutter is deeper in the surface than allowed; too many points. If no part of
/// a cut is on the surface, with the nearest distance.
pub fn lay_cuts(
    surface: &Surface,
    cutter: &Cutter,
    cuts: &ToolCuts,
    settings: &LaySettings,
) -> Result<ClPasses, ClPathFault> {
    check_number(cuts, settings)?;
    let layer = Layer { surface, cutter, settings };
    let mut out = ClPasses::default();
    let laid: Vec<Result<CutRuns, ClPathFault>> = cuts.cuts.par_iter().map(|cut| layer.runs(cut)).collect();
    for cut in laid {
        let CutRuns { runs, off } = cut?;
        for line in off {
            out.count_off(line);
        }
        for run in runs.into_iter().flat_map(divided) {
            for run in layer.without_jumps(run, &mut out) {
                out.push(&run, (cutter, settings));
            }
        }
    }
    let steps = cuts.cuts.iter().flat_map(|cut| cut.windows(2));
    out.length = steps.map(|w| (w[1].cl.tip - w[0].cl.tip).norm()).sum();
    if out.passes.is_empty() {
        return Err(layer.nothing_touches(cuts));
    }
    Ok(out)
}

/// Counts the points that a cut needs before any is made.
fn check_number(cuts: &ToolCuts, settings: &LaySettings) -> Result<(), ClPathFault> {
    let mut n = 0_usize;
    for pair in cuts.cuts.iter().flat_map(|cut| cut.windows(2)) {
        n = n.saturating_add(steps(&pair[0], &pair[1], settings.max_step));
        if n > settings.max_points {
            let (most, step) = (settings.max_points, settings.max_step);
            let why = format!(
                "the cuts up to here need more than {most} points {step} mm apart: split the file here, or take a larger step"
            );
            return Err(ClPathFault::at(pair[1].line, why));
        }
    }
    Ok(())
}

/// Parts of a cut on the surface.
struct CutRuns {
    runs: Vec<ContactRun>,
    /// Lines of the file's points that are off the surface.
    off: Vec<u32>,
}

struct Layer<'l> {
    surface: &'l Surface,
    cutter: &'l Cutter,
    settings: &'l LaySettings,
}

/// Bisections of where a cut comes to the surface, in a step: 2^7 is 128.
const BISECTIONS: usize = 7;

impl Layer<'_> {
    fn contact(&self, point: &FilePoint, feed: &Vector3<f64>) -> Option<Contact> {
        let LaySettings { kind, max_distance, allowance, .. } = *self.settings;
        contact(self.surface, self.cutter, (&point.cl, feed), (allowance, max_distance), kind)
    }

    fn samples(&self, cut: &[FilePoint]) -> Vec<Sample> {
        let directions = directions(cut);
        let mut samples = Vec::new();
        for (k, point) in cut.iter().enumerate() {
            if let Some(before) = k.checked_sub(1).map(|j| &cut[j]) {
                let n = steps(before, point, self.settings.max_step);
                let inserted = (1..n).map(|i| between(before, point, i as f64 / n as f64));
                samples.extend(inserted.map(|point| Sample { point, feed: directions[k - 1], is_of_file: false }));
            }
            samples.push(Sample { point: *point, feed: directions[k], is_of_file: true });
        }
        samples
    }

    /// Returns the parts of a cut on the surface.
    fn runs(&self, cut: &[FilePoint]) -> Result<CutRuns, ClPathFault> {
        let samples = self.samples(cut);
        let contacts: Vec<Option<Contact>> = samples.par_iter().map(|s| self.contact(&s.point, &s.feed)).collect();
        let mut out = CutRuns { runs: Vec::new(), off: Vec::new() };
        let mut run: ContactRun = Vec::new();
        for (k, (sample, found)) in samples.iter().zip(&contacts).enumerate() {
            let before = k.checked_sub(1).map(|j| (&samples[j], &contacts[j]));
            match found {
                Some(contact) => {
                    self.check_depth(sample, contact)?;
                    if let Some((off, None)) = before {
                        run.extend(self.border(sample, off));
                    }
                    run.push((sample.point, *contact));
                }
                None => {
                    if sample.is_of_file {
                        out.off.push(sample.point.line);
                    }
                    if let Some((on, Some(_))) = before {
                        run.extend(self.border(on, sample));
                        out.runs.push(std::mem::take(&mut run));
                    }
                }
            }
        }
        out.runs.push(run);
        Ok(out)
    }

    fn check_depth(&self, sample: &Sample, contact: &Contact) -> Result<(), ClPathFault> {
        let depth = -contact.stand_off;
        if depth <= self.settings.max_distance {
            return Ok(());
        }
        let most = self.settings.max_distance;
        let why = format!(
            "on the way to this point the file's cutter is {depth:.3} mm deep in the drive surface, more than the {most} mm \
             allowed: check the frame of the file, its unit, the tool and the allowance, or allow more (max_distance_mm)"
        );
        Err(ClPathFault::at(sample.point.line, why))
    }

    /// Returns the last pose on the surface between one on it and one off it, in either order;
    /// `None` if that is the one on it.
    fn border(&self, on: &Sample, off: &Sample) -> Option<(FilePoint, Contact)> {
        let (mut low, mut high) = (0.0, 1.0);
        let mut found = None;
        for _ in 0..BISECTIONS {
            let t = 0.5 * (low + high);
            let point = between(&on.point, &off.point, t);
            match self.contact(&point, &on.feed) {
                Some(contact) => {
                    low = t;
                    found = Some((FilePoint { line: on.point.line, ..point }, contact));
                }
                None => high = t,
            }
        }
        found
    }

    /// Divides a run where the contact jumps on the surface.
    fn without_jumps(&self, run: ContactRun, out: &mut ClPasses) -> Vec<ContactRun> {
        if self.settings.kind == ContactKind::OfTool {
            return vec![run];
        }
        let mut all = Vec::new();
        let mut part: ContactRun = Vec::new();
        for point in run {
            let Some(last) = part.last().copied().filter(|last| self.excess(last, &point) > 0.0) else {
                part.push(point);
                continue;
            };
            let (before, after) = self.nearer(last, point);
            let jumps = self.excess(before.last().unwrap_or(&last), after.first().unwrap_or(&point)) > 0.0;
            part.extend(before);
            if jumps {
                out.jumps += 1;
                out.first_jump = Some(out.first_jump.map_or(point.0.line, |first| first.min(point.0.line)));
                all.push(std::mem::take(&mut part));
            }
            part.extend(after);
            part.push(point);
        }
        all.push(part);
        all
    }

    /// Returns points between two, up to a jump of the contact and behind it: halves the part of
    /// the way that has the greater excess, until there is none.
    fn nearer(&self, first: (FilePoint, Contact), second: (FilePoint, Contact)) -> (ContactRun, ContactRun) {
        let (mut low, mut high) = (first, second);
        let (mut before, mut after): (ContactRun, ContactRun) = (Vec::new(), Vec::new());
        for _ in 0..BISECTIONS {
            if self.excess(&low, &high) <= 0.0 {
                break;
            }
            let point = between(&low.0, &high.0, 0.5);
            let feed = second.0.cl.tip - first.0.cl.tip;
            let Some(contact) = self.contact(&point, &feed) else { break };
            let middle = (point, contact);
            if self.excess(&low, &middle) <= self.excess(&middle, &high) {
                before.push(middle);
                low = middle;
            } else {
                after.push(middle);
                high = middle;
            }
        }
        after.reverse();
        (before, after)
    }

    /// Returns by how much the contacts of two points are farther apart than tip and axis let
    /// them move with the cutter, mm; not above 0 where they follow each other. A flat bottom also
    /// lets its place turn with the feed.
    fn excess(&self, a: &(FilePoint, Contact), b: &(FilePoint, Contact)) -> f64 {
        if a.1.is_flat && b.1.is_flat {
            return 0.0;
        }
        let way = (b.1.position - a.1.position).norm();
        let turn = a.0.cl.axis.angle(&b.0.cl.axis);
        let moved = (b.0.cl.tip - a.0.cl.tip).norm() + 2.0 * self.cutter.radius() * turn;
        way - moved - self.settings.max_step.min(0.5 * self.cutter.radius())
    }

    /// Returns why no cut touches: the nearest of some poses along them.
    fn nothing_touches(&self, cuts: &ToolCuts) -> ClPathFault {
        let moves: Vec<[&FilePoint; 2]> =
            cuts.cuts.iter().flat_map(|cut| cut.windows(2)).map(|w| [&w[0], &w[1]]).collect();
        let parts = (PROBED / moves.len().max(1)).max(1);
        let some = moves
            .iter()
            .step_by(moves.len().div_ceil(PROBED).max(1))
            .flat_map(|[from, to]| (0..parts).map(move |k| between(from, to, (k as f64 + 0.5) / parts as f64)));
        let distance = |point: &FilePoint| {
            let place = nearest_to_cutter(self.surface, self.cutter, &point.cl, f64::INFINITY, |_| true)?;
            let facing = self.surface.facet_normal(place.at.triangle).is_some_and(|n| n.dot(&point.cl.axis) > 0.0);
            Some((place.distance - self.settings.allowance, facing, point.line))
        };
        let nearest = some.filter_map(|p| distance(&p)).min_by(|a, b| a.0.abs().total_cmp(&b.0.abs()));
        let most = self.settings.max_distance;
        match nearest {
            Some((mm, false, line)) if mm <= most => ClPathFault::at(
                line,
                "the tool axis points into the material, against the normal of the drive surface: the file is for the \
                 other side of the part, or the mesh is wound inside out (reverse_winding)",
            ),
            Some((mm, _, line)) => ClPathFault::at(
                line,
                format!(
                    "no cut of the file touches the drive surface: on the way to this point, the nearest of those tried, the cutter is \
                     {mm:.3} mm from it, and {most} mm are allowed (max_distance_mm); check the frame of the file (it is the workpiece \
                     frame), its unit and the tool"
                ),
            ),
            None => ClPathFault::Whole("the drive surface has no facet".to_owned()),
        }
    }
}

/// Poses that are tried for a message.
const PROBED: usize = 200;

/// Distance below which two places are one, mm.
const SAME_PLACE: f64 = 1e-9;

/// Divides a run where the tool turns back, by more than 120°.
fn divided(run: ContactRun) -> Vec<ContactRun> {
    let mut all: Vec<ContactRun> = Vec::new();
    let mut part: ContactRun = Vec::new();
    let mut way = Vector3::zeros();
    for point in run {
        if let Some(last) = part.last().copied() {
            let step = point.0.cl.tip - last.0.cl.tip;
            if way.dot(&step) < -0.5 * way.norm() * step.norm() {
                all.push(std::mem::replace(&mut part, vec![last]));
            }
            if step.norm() > SAME_PLACE {
                way = step;
            }
        }
        part.push(point);
    }
    all.push(part);
    all
}

impl ClPasses {
    fn count_off(&mut self, line: u32) {
        self.off_surface += 1;
        self.first_off = Some(self.first_off.map_or(line, |first| first.min(line)));
    }

    /// Adds a run as a pass: its feed is the direction of the places of contact on the surface, or
    /// of the tips. A run of one place is none.
    fn push(&mut self, run: &ContactRun, (cutter, settings): (&Cutter, &LaySettings)) {
        let kind = settings.kind;
        let place = |(point, contact): &(FilePoint, Contact)| match kind {
            ContactKind::OfTool => point.cl.tip,
            ContactKind::OfSurface => contact.position,
        };
        let mut positions: Vec<Point3<f64>> = Vec::new();
        let mut kept: Vec<(usize, &(FilePoint, Contact))> = Vec::new();
        for point in run {
            let at = place(point);
            let is_new = positions.last().is_none_or(|last| (at - last).norm() > SAME_PLACE);
            if is_new {
                positions.push(at);
            }
            // A tool that turns with its tip at rest has several poses at one place.
            let turns = kind == ContactKind::OfTool && kept.last().is_some_and(|(_, l)| l.0.cl.axis != point.0.cl.axis);
            if is_new || turns {
                kept.push((positions.len() - 1, point));
            }
        }
        let ahead = positions.windows(2).next().map_or_else(Vector3::zeros, |w| w[1] - w[0]);
        let file_contact = |(k, (point, contact)): &(usize, &(FilePoint, Contact))| {
            let cc = CcPoint::new(contact.position, contact.normal.into_inner(), feed_along(&positions, *k)).ok()?;
            let FilePoint { line, cl } = *point;
            if kind == ContactKind::OfTool && contact.is_flat {
                return Some(flat_contact((cutter, settings.allowance), cc, (line, cl), &ahead));
            }
            Some(FileContact { cc, posture: cc.posture_of(&cl.axis), cl, line })
        };
        let points: Vec<Option<FileContact>> = kept.iter().map(file_contact).collect();
        for ((_, (point, _)), _) in kept.iter().zip(&points).filter(|(_, found)| found.is_none()) {
            self.without_direction += 1;
            self.first_without = Some(self.first_without.map_or(point.line, |first| first.min(point.line)));
        }
        let points: Vec<FileContact> = points.into_iter().flatten().collect();
        if points.len() < 2 {
            if let Some((point, _)) = run.first() {
                self.count_off(point.line);
            }
            return;
        }
        for (point, contact) in run {
            self.above.widen(contact.stand_off, point.line);
            self.below.widen(-contact.stand_off, point.line);
        }
        self.length_in_passes += points.windows(2).map(|w| (w[1].cl.tip - w[0].cl.tip).norm()).sum::<f64>();
        self.turns.add_pass(&points.iter().map(|p| (p.cl, p.cc.position, p.line)).collect::<Vec<_>>());
        self.passes.push(ClPass { points });
    }
}

/// Returns the contact of a bottom that lies flat on the surface: the place of its rim that leads
/// at the start of the pass, so that it does not go around the rim where the pass turns.
fn flat_contact(
    (cutter, allowance): (&Cutter, f64),
    cc: CcPoint,
    (line, cl): (u32, ClPoint),
    ahead: &Vector3<f64>,
) -> FileContact {
    let axis = cl.axis.into_inner();
    let across = ahead - axis * ahead.dot(&axis);
    let toward = Unit::try_new(across, 1e-9 * ahead.norm()).unwrap_or(cc.feed);
    let rotate = cc.left().dot(&toward).atan2(cc.feed.dot(&toward));
    let position = cl.tip + toward.into_inner() * cutter.rim_radius() - axis * allowance;
    FileContact { cc: CcPoint { position, ..cc }, posture: Posture { tilt: 0.0, rotate }, cl, line }
}

impl StandOff {
    fn widen(&mut self, mm: f64, line: u32) {
        if mm > self.mm {
            *self = Self { mm, line };
        }
    }
}
