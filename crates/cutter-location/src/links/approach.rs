//! Entries and exits of passes.

use facemill_cl_data::{CcPoint, ClPoint};
use nalgebra::{Unit, Vector3};

use crate::links::link::between;
use crate::pose::pose_test::{PoseTest, hint_at};
use crate::pose::workcell::{Configuration, Hints, Infeasible, RefusedAt};

/// Shape of an entry or exit. Angles in rad, lengths in mm.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum ApproachShape {
    /// Arc in the plane of feed direction and normal, tangent to the pass: the cutter descends onto
    /// the surface.
    TangentialArc {
        /// Radius of the arc.
        radius: f64,
        /// Angle of the arc, up to 90°.
        angle: f64,
    },
    /// Arc as in `TangentialArc`, continued along its tangent by a straight line: rises by the same
    /// height over a shorter way than a flatter arc, and no more steeply than its angle.
    Ramp {
        /// Radius of the arc; 0 for the line alone.
        radius: f64,
        /// Angle of the arc and slope of the line, up to 90°.
        angle: f64,
        /// Height of the end of the line above the pass, along its normal.
        height: f64,
    },
    /// Arc in the tangent plane, tangent to the pass, from the side that is already cut, rising by
    /// a tenth of its sideways way: the cutter rolls into the stock, so its teeth leave it with
    /// thin chips.
    RollIn {
        /// Radius of the arc.
        radius: f64,
        /// Angle of the arc, up to 90°.
        angle: f64,
    },
    /// The shortest of many ways in the plane of feed direction and normal, none longer than the
    /// tangential arc of this radius and angle: smaller arcs, each continued along its tangent by a
    /// straight line, no steeper than the angle, and no higher than the tangential arc.
    Shortest {
        /// Radius of the largest arc.
        radius: f64,
        /// Largest angle of the arcs, up to 90°.
        angle: f64,
    },
}

/// Rise of a roll-in per mm of sideways way: enough to leave the finished surface, too little to
/// lift the cutter out of the chip before the arc ends.
const ROLL_IN_RISE: f64 = 0.1;

/// Which end of a pass an approach belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PassEnd {
    /// Entry: behind the first point.
    Entry,
    /// Exit: beyond the last point.
    Exit,
}

/// Returns the poses of an arc, from the one next to the pass outward, at most `step` mm apart,
/// with the axis as at the pass.
///
/// `uncut_left` gives the side of the feed with the uncut stock. [`approach`] takes the first of
/// several arcs that collides with nothing; a caller with tests of its own takes the poses of one:
///
/// ```
/// use facemill_cl_data::{CcPoint, ClPoint};
/// use facemill_cutter_location::links::approach::{ApproachShape, PassEnd, arc_poses};
/// use nalgebra::{Point3, Vector3};
///
/// let cc = CcPoint::new(Point3::origin(), Vector3::z(), Vector3::x())?;
/// let cl = ClPoint { tip: cc.position, axis: cc.normal };
/// let quarter = ApproachShape::TangentialArc { radius: 20.0, angle: std::f64::consts::FRAC_PI_2 };
/// let poses = arc_poses(quarter, PassEnd::Entry, &cc, &cl, true, 1.0);
/// let outermost = poses[poses.len() - 1].tip;
/// assert!((outermost - Point3::new(-20.0, 0.0, 20.0)).norm() < 1e-9, "behind the pass and above it");
/// # Ok::<(), facemill_cl_data::CcPointError>(())
/// ```
pub fn arc_poses(
    shape: ApproachShape,
    end: PassEnd,
    cc: &CcPoint,
    cl: &ClPoint,
    uncut_left: bool,
    step: f64,
) -> Vec<ClPoint> {
    shape_poses(shape, end, cc, cl, uncut_left, [step; 2])
}

/// Poses of an arc and of the line behind it, with the largest distance between poses of each.
fn shape_poses(
    shape: ApproachShape,
    end: PassEnd,
    cc: &CcPoint,
    cl: &ClPoint,
    uncut_left: bool,
    [step, line_step]: [f64; 2],
) -> Vec<ClPoint> {
    let (ApproachShape::TangentialArc { radius, angle }
    | ApproachShape::Ramp { radius, angle, .. }
    | ApproachShape::RollIn { radius, angle }
    | ApproachShape::Shortest { radius, angle }) = shape;
    let along = outward_feed(end, cc);
    let normal = cc.normal.into_inner();
    let bend = match shape {
        ApproachShape::TangentialArc { .. } | ApproachShape::Ramp { .. } | ApproachShape::Shortest { .. } => normal,
        ApproachShape::RollIn { .. } => {
            let finished = if uncut_left { -cc.left().into_inner() } else { cc.left().into_inner() };
            finished + normal * ROLL_IN_RISE
        }
    };
    // A step that is no length makes as few poses as a large one.
    let has_arc = radius != 0.0 || !matches!(shape, ApproachShape::Ramp { .. });
    let n = if has_arc { (radius * angle * bend.norm() / step).ceil().clamp(1.0, MAX_TESTS) as usize } else { 0 };
    let at = |angle: f64| (along * angle.sin() + bend * (1.0 - angle.cos())) * radius;
    let arc = (1..=n).map(|k| at(angle * k as f64 / n as f64));
    let line = if let ApproachShape::Ramp { height, .. } = shape {
        let rise = (height - radius * (1.0 - angle.cos())).max(0.0);
        along * (rise / angle.tan()) + normal * rise
    } else {
        Vector3::zeros()
    };
    // A slope of 0 has no end at a height.
    let n_line = (line.norm() / line_step).ceil().clamp(0.0, MAX_TESTS) as usize;
    let line = (1..=n_line).map(|k| at(angle) + line * (k as f64 / n_line as f64));
    arc.chain(line).map(|way| cl.translated(way)).collect()
}

/// The line between a pass and its arc: straight, or bent in the plane of feed and normal.
struct LeadLine {
    outward: Unit<Vector3<f64>>,
    normal: Unit<Vector3<f64>>,
    length: f64,
    bend: f64,
}

/// Largest turn of the line between a pass and its arc, rad: the axis does not turn with it.
const MOST_BENT: f64 = 0.1;

impl LeadLine {
    fn of(settings: &ApproachSettings, at: &PassEndPose<'_>) -> Self {
        let outward = Unit::new_unchecked(outward_feed(at.end, at.cc));
        let most = MOST_BENT / settings.straight.max(f64::MIN_POSITIVE);
        let bend = if settings.bend.is_finite() { settings.bend.clamp(-most, most) } else { 0.0 };
        Self { outward, normal: at.cc.normal, length: settings.straight, bend }
    }

    /// Way from its beginning to a place on it.
    fn way(&self, s: f64) -> Vector3<f64> {
        let turn = self.bend * s;
        // sin(x)/x and (1 − cos x)/x², by their series where they cancel.
        let (ahead, down) = if turn.abs() < 1e-4 {
            (1.0 - turn * turn / 6.0, 0.5)
        } else {
            (turn.sin() / turn, (1.0 - turn.cos()) / (turn * turn))
        };
        (self.outward.into_inner() * ahead - self.normal.into_inner() * (down * turn)) * s
    }

    /// Poses from the one next to the pass outward, at most `step` mm apart, the axis as at the
    /// pass; none for a length of 0. There are several, because the surface may rise or fall below
    /// the line.
    fn poses(&self, cl: &ClPoint, step: f64) -> Vec<ClPoint> {
        let n = (self.length / step).ceil().clamp(0.0, MAX_TESTS) as usize;
        (1..=n).map(|k| cl.translated(self.way(self.length * k as f64 / n as f64))).collect()
    }

    /// The CC point of a pass as its end would be at the outer end of the line: feed and normal are
    /// turned.
    fn turned(&self, end: PassEnd, cc: &CcPoint) -> CcPoint {
        let turn = self.bend * self.length;
        if turn == 0.0 {
            return *cc;
        }
        let (sin, cos) = turn.sin_cos();
        let outward = self.outward.into_inner() * cos - self.normal.into_inner() * sin;
        let normal = self.normal.into_inner() * cos + self.outward.into_inner() * sin;
        let feed = if end == PassEnd::Entry { -outward } else { outward };
        CcPoint { feed: Unit::new_normalize(feed), normal: Unit::new_normalize(normal), ..*cc }
    }
}

/// Direction in which the tool goes away from an end of a pass.
fn outward_feed(end: PassEnd, cc: &CcPoint) -> Vector3<f64> {
    match end {
        PassEnd::Entry => -cc.feed.into_inner(),
        PassEnd::Exit => cc.feed.into_inner(),
    }
}

/// Requirements of an approach.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ApproachSettings {
    /// Shape of the arc.
    pub shape: ApproachShape,
    /// Length of the straight line along the feed between the pass and the arc, mm, 0 or more. It
    /// cuts the strip beside the end of the pass, where the border of the surface leans.
    pub straight: f64,
    /// Curvature of this line in the plane of feed and normal, 1/mm, positive where it bends toward
    /// the part: that of the pass at its end lets it follow the surface beyond the border. It turns
    /// by at most 0.1 rad.
    pub bend: f64,
    /// Distance between the poses of the arc, mm; the tool moves straight between them.
    pub step: f64,
    /// Distance between the poses of the lines before and behind an arc, mm.
    pub line_step: f64,
    /// Distance between tested poses on the way, mm. Larger: thinner obstacles may be missed.
    pub test_step: f64,
    /// Distance of the whole tool from stock, part and fixtures where rapids begin and end, mm.
    pub rapid_clearance: f64,
    /// Farthest retract along the tool axis that may be needed to get clear, mm.
    pub max_retract: f64,
    /// A direction without motion: arcs, lifts and retracts are laid into the plane across it. For
    /// heads that cannot move their tool in that direction while their rotary axes stand still.
    pub still_across: Option<Unit<Vector3<f64>>>,
}

impl ApproachSettings {
    /// The same with a share of the straight line.
    fn with_line(&self, share: f64) -> Self {
        Self { straight: self.straight * share, ..*self }
    }

    /// The part of a motion that is allowed.
    fn allowed(&self, motion: Vector3<f64>) -> Vector3<f64> {
        self.still_across.map_or(motion, |across| motion - across.into_inner() * motion.dot(&across))
    }

    /// Returns a pose without its motion from the end of a pass in the direction without motion.
    fn kept_across(&self, at: &PassEndPose<'_>, pose: &ClPoint) -> ClPoint {
        match self.still_across {
            Some(_) => at.cl.translated(self.allowed(pose.tip - at.cl.tip)),
            None => *pose,
        }
    }

    /// Returns the same arc with another radius, and poses in proportion.
    #[must_use]
    pub fn scaled(&self, share: f64) -> Self {
        let shape = match self.shape {
            ApproachShape::TangentialArc { radius, angle } => {
                ApproachShape::TangentialArc { radius: radius * share, angle }
            }
            ApproachShape::Ramp { radius, angle, height } => {
                ApproachShape::Ramp { radius: radius * share, angle, height: height * share }
            }
            ApproachShape::RollIn { radius, angle } => ApproachShape::RollIn { radius: radius * share, angle },
            ApproachShape::Shortest { radius, angle } => ApproachShape::Shortest { radius: radius * share, angle },
        };
        Self { shape, step: self.step * share, line_step: self.line_step * share, ..*self }
    }

    /// Returns the ways of [`ApproachShape::Shortest`] up to a steepest slope, the shortest first.
    fn shorter(&self, steepest: f64) -> Vec<Self> {
        let ApproachShape::Shortest { radius: largest, angle: whole } = self.shape else { return Vec::new() };
        let (slope, top) = (whole.min(steepest), largest * (1.0 - whole.cos()));
        if slope <= LEAST_SLOPE {
            return Vec::new();
        }
        let way = |&(share, of_height): &(f64, f64)| {
            let (radius, height) = (largest * share, top * of_height);
            // The arc ends at the height if it gets there.
            let angle = slope.min((1.0 - height / radius).clamp(-1.0, 1.0).acos());
            let line = (height - radius * (1.0 - angle.cos())).max(0.0) / angle.sin();
            let shape = ApproachShape::Ramp { radius, angle, height };
            (radius * angle + line, Self { shape, step: self.step * share, ..*self })
        };
        let all = SHARES.iter().flat_map(|&share| HEIGHTS.map(|of_height| (share, of_height)));
        let mut ways: Vec<(f64, Self)> = all.map(|shares| way(&shares)).filter(|w| w.0 < largest * whole).collect();
        ways.sort_by(|a, b| a.0.total_cmp(&b.0));
        ways.into_iter().map(|(_, settings)| settings).collect()
    }

    /// Returns the tangential arc that the shortest way is sought instead of; other shapes as they
    /// are.
    fn at_most(&self) -> Self {
        let shape = match self.shape {
            ApproachShape::Shortest { radius, angle } => ApproachShape::TangentialArc { radius, angle },
            shape => shape,
        };
        Self { shape, ..*self }
    }

    /// Returns the ramps that are tried in place of an arc that the tool cannot take: a part of the
    /// arc, up to the steepest slope, and the line from there; none for other shapes.
    fn ramps(&self, steepest: f64) -> impl Iterator<Item = Self> {
        let arc = match self.shape {
            ApproachShape::TangentialArc { radius, angle } => Some((radius, angle)),
            _ => None,
        };
        let (settings, angle) = (*self, arc.map_or(0.0, |(_, angle)| angle.min(steepest)));
        let shapes = arc.filter(|_| angle > LEAST_SLOPE).into_iter().flat_map(move |(radius, whole)| {
            let height = radius * (1.0 - whole.cos());
            let ramp = move |&(share, of_height): &(f64, f64)| {
                // An arc that is nowhere too steep is the whole one.
                let is_other = share < 1.0 || angle < whole;
                let (radius, height) = (radius * share, height * of_height);
                is_other.then_some(ApproachShape::Ramp { radius, angle, height })
            };
            RAMPS.iter().filter_map(ramp)
        });
        shapes.map(move |shape| Self { shape, ..settings })
    }
}

/// The way between a pass and the place where rapids begin or end.
#[derive(Clone, Debug, PartialEq)]
pub struct Approach {
    /// Poses from next to the pass outward; the last is clear of everything by the rapid clearance.
    /// All are on the branch of the pass' end.
    pub outward: Vec<ClPoint>,
    /// Configuration of the machine at the last pose.
    pub outer: Configuration,
    /// Number of the first poses that are on the line along the feed, next to the pass.
    pub on_line: usize,
    /// Outward direction of the line at its far end; without a line, at the pass.
    pub ahead: Unit<Vector3<f64>>,
}

/// One end of a pass.
#[derive(Clone, Copy, Debug)]
pub struct PassEndPose<'a> {
    /// Which end.
    pub end: PassEnd,
    /// CC point.
    pub cc: &'a CcPoint,
    /// Tool pose.
    pub cl: &'a ClPoint,
    /// Configuration of the machine there.
    pub configuration: &'a Configuration,
    /// Whether the uncut stock lies to the left of the feed.
    pub uncut_left: bool,
}

/// Straight line, arc and retract at one end of a pass, tested as they are driven: at poses no
/// farther apart than the test step, on the branch of the pass, the cutter's test body cuts nothing
/// that must stay (the way is lifted along the normal where facets require it, as poses are
/// seated), bodies hit nothing, axis values exist, and the tool goes down into stock no more
/// steeply than it may, an exit too where its line follows the surface down. Where this is not
/// possible, shorter lines are tried, down to none; then smaller arcs of the same angle, down to an
/// eighth of the radius, and, for an arc in the plane of feed and normal, ramps that are as steep
/// as the tool may go down (an exit: as the end of the arc). Ramps are tried first if the arc is
/// too steep. The ways of the shortest shape are tried before all of these. From the end of the arc
/// the tool retracts along its axis in steps until it is clear.
///
/// # Errors
/// The reason why the arc without the straight line cannot be taken, when no other can either.
pub fn approach(
    test: &PoseTest<'_>,
    settings: &ApproachSettings,
    at: &PassEndPose<'_>,
    hints: &mut Hints,
) -> Result<Approach, Infeasible> {
    let steepest = if at.end == PassEnd::Entry {
        slope_for_ramp(test.cell.tool.max_ramp_angle(), at)
    } else {
        std::f64::consts::FRAC_PI_2
    };
    let shorter = settings.shorter(steepest);
    let mut search = WaySearch { test, at, hints, tried: 0 };
    let leads = LEADS.iter().filter(|(share, _)| settings.straight > 0.0 || *share == 0.0);
    for &(share, bent) in leads.filter(|_| !shorter.is_empty()) {
        // All shapes continue the same line.
        let line = ApproachSettings { bend: settings.bend * bent, ..settings.with_line(share) };
        if let Some(approach) = search.first_of(&line, &shorter) {
            return Ok(approach);
        }
    }
    let settings = &settings.at_most();
    // On a surface that rises beyond the pass a straight line gouges, and the arc may not.
    let bends = if settings.bend == 0.0 { &[1.0][..] } else { &[1.0, 0.0] };
    let lines = LINES.iter().filter(|_| settings.straight > 0.0);
    let mut lines = lines.flat_map(|share| {
        bends.iter().map(|bent| ApproachSettings { bend: settings.bend * bent, ..settings.with_line(*share) })
    });
    if let Some(approach) = lines.find_map(|settings| search.first_of(&settings, &[settings])) {
        return Ok(approach);
    }
    let arc = ApproachSettings { straight: 0.0, ..*settings };
    let refused = match search.walked(&arc).and_then(|line| search.way(&arc, &line)) {
        Ok(approach) => return Ok(approach),
        Err((why, _)) => why,
    };
    let ramps: Vec<ApproachSettings> = arc.ramps(steepest).collect();
    let smaller = SMALLER.map(|share| arc.scaled(share));
    // Smaller arcs are as steep: they help where the arc meets something.
    let others = if matches!(refused, Infeasible::Ramp { .. }) {
        [ramps.as_slice(), &smaller].concat()
    } else {
        [smaller.as_slice(), &ramps].concat()
    };
    search.first_of(&arc, &others).ok_or(refused)
}

/// Search among the ways from one end of a pass.
struct WaySearch<'t, 'a> {
    test: &'t PoseTest<'a>,
    at: &'t PassEndPose<'t>,
    hints: &'t mut Hints,
    /// Number of ways tried.
    tried: usize,
}

impl WaySearch<'_, '_> {
    /// Returns the first of several shapes that the tool can take behind the line of `line`.
    ///
    /// A shape was usually refused at the point before for the same obstacle: it is looked at first
    /// where it was then, and walked only if the tool can be there, and the line only before the
    /// first shape that is walked.
    fn first_of(&mut self, line: &ApproachSettings, shapes: &[ApproachSettings]) -> Option<Approach> {
        let mut walked: Option<WalkedLine> = None;
        for shape in shapes {
            let settings = ApproachSettings { straight: line.straight, bend: line.bend, ..*shape };
            let number = self.tried;
            self.tried += 1;
            let (at, before) = (self.at, *hint_at(&mut self.hints.refused, number));
            if self.outward(&settings, *at.configuration).is_refused(at, before) {
                continue;
            }
            let line = match walked.take() {
                Some(line) => line,
                None => self.walked(line).ok()?,
            };
            match self.way(&settings, &line) {
                Ok(approach) => return Some(approach),
                Err((_, place)) => *hint_at(&mut self.hints.refused, number) = place,
            }
            walked = Some(line);
        }
        None
    }

    fn outward<'s>(&'s mut self, settings: &'s ApproachSettings, near: Configuration) -> Outward<'s, 's> {
        Outward { test: self.test, settings, hints: self.hints, near, share: 0.0 }
    }

    /// Walks the line at the end of the pass.
    fn walked(&mut self, settings: &ApproachSettings) -> Result<WalkedLine, Refused> {
        let (at, near) = (self.at, *self.at.configuration);
        self.outward(settings, near).line(at)
    }

    /// Walks from the end of the line over the arc and away.
    fn way(&mut self, settings: &ApproachSettings, line: &WalkedLine) -> Result<Approach, Refused> {
        let at = self.at;
        self.outward(settings, line.near).way(at, line)
    }
}

/// Reason why a way cannot be taken, and the place, where it is one of the arc or the retract.
type Refused = (Infeasible, Option<RefusedAt>);

/// Returns the slope of an outward line over the tangent plane on which the tool descends by a ramp
/// angle relative to its bottom; negative where every outward line descends more steeply.
///
/// For feed f outward, normal n and axis a, a line at slope s descends by the angle r with
/// sin r = (cos s f + sin s n) · a.
fn slope_for_ramp(ramp: f64, at: &PassEndPose<'_>) -> f64 {
    let axis = at.cl.axis;
    let (along, up) = (outward_feed(at.end, at.cc).dot(&axis), at.cc.normal.dot(&axis));
    (ramp.sin() / along.hypot(up)).min(1.0).asin() - along.atan2(up)
}

/// Fractions of the straight line that are tried, as bent as the surface and straight, with the
/// whole arc, before the arc alone.
const LINES: [f64; 3] = [1.0, 0.5, 0.25];

/// Fractions of the largest radius and height among which the shortest way is sought.
const SHARES: [f64; 4] = [0.125, 0.25, 0.5, 1.0];
const HEIGHTS: [f64; 6] = [0.125, 0.25, 0.375, 0.5, 0.75, 1.0];

/// Fractions of the line and of its bend that are tried before the shortest ways: a line as bent as
/// the surface leaves least, and comes nearest to gouging behind the contact.
const LEADS: [(f64, f64); 8] =
    [(1.0, 1.0), (1.0, 0.5), (1.0, 0.0), (0.5, 1.0), (0.5, 0.0), (0.25, 1.0), (0.25, 0.0), (0.0, 0.0)];

/// Fractions of an arc's radius that are tried.
const SMALLER: [f64; 3] = [0.5, 0.25, 0.125];

/// Fractions of the arc's radius and height of the ramps that are tried: low ones first, which are
/// short; then ones that leave the surface more quickly, where it bends toward the cutter.
const RAMPS: [(f64, f64); 6] = [(1.0, 0.5), (1.0, 1.0), (0.25, 0.5), (0.25, 1.0), (0.0, 0.5), (0.0, 1.0)];

/// Least slope of a ramp, rad: on flatter ones the end is too far away.
const LEAST_SLOPE: f64 = 0.005;

/// The line at the end of a pass as the tool can take it.
struct WalkedLine {
    line: LeadLine,
    /// From next to the pass outward, lifted.
    poses: Vec<ClPoint>,
    /// Lift along the normal at the last one, mm.
    lift: f64,
    /// Configuration of the machine at the last one.
    near: Configuration,
}

/// Moves outward from the end of a pass, testing on the way.
struct Outward<'t, 'a> {
    test: &'t PoseTest<'a>,
    settings: &'t ApproachSettings,
    hints: &'t mut Hints,
    /// Configuration of the machine at the last tested pose.
    near: Configuration,
    /// Fraction of the last straight move at which it was refused.
    share: f64,
}

impl Outward<'_, '_> {
    /// Walks the line.
    fn line(mut self, at: &PassEndPose<'_>) -> Result<WalkedLine, Refused> {
        let line = LeadLine::of(self.settings, at);
        let mut poses = line.poses(at.cl, self.settings.line_step);
        let mut lift = 0.0;
        self.walk(at, at.cl, &mut poses, &mut lift).map_err(|(why, _)| (why, None))?;
        Ok(WalkedLine { line, poses, lift, near: self.near })
    }

    /// Moves from a pose over others, each lifted where it must be and replaced by what it becomes.
    fn walk(
        &mut self,
        at: &PassEndPose<'_>,
        from: &ClPoint,
        poses: &mut [ClPoint],
        lift: &mut f64,
    ) -> Result<(), Refused> {
        let normal = self.settings.allowed(at.cc.normal.into_inner());
        let mut from = *from;
        for (k, pose) in poses.iter_mut().enumerate() {
            *pose = self.settings.kept_across(at, pose);
            let lifted = self.go_lifted(&from, pose, normal, lift);
            from = lifted.map_err(|why| (why, Some(RefusedAt::Arc { pose: k, share: self.share })))?;
            *pose = from;
        }
        Ok(())
    }

    /// Returns the poses of the arc behind the line, not lifted.
    fn arc(&self, at: &PassEndPose<'_>, line: &LeadLine) -> Vec<ClPoint> {
        let settings = self.settings;
        let start = line.poses(at.cl, settings.line_step).last().copied().unwrap_or(*at.cl);
        let steps = [settings.step, settings.line_step];
        shape_poses(settings.shape, at.end, &line.turned(at.end, at.cc), &start, at.uncut_left, steps)
    }

    /// Returns whether the tool would plunge into stock at the end of the arc, or cannot be at the
    /// place where the way was refused before, or, if it was not, at the end of the arc; each
    /// whatever its lift there: neither as low as the pass nor lifted as far as a way may be. A way
    /// that is not refused here has yet to be walked.
    fn is_refused(&mut self, at: &PassEndPose<'_>, before: Option<RefusedAt>) -> bool {
        let line = LeadLine::of(self.settings, at);
        let arc = self.arc(at, &line);
        let Some(last) = arc.len().checked_sub(1) else { return false };
        let begin = line.poses(at.cl, self.settings.line_step).last().copied().unwrap_or(*at.cl);
        let (settings, near) = (self.settings, self.near);
        let on_arc = |k: usize| settings.kept_across(at, &arc[k.min(last)]);
        if self.plunges(at, &on_arc(last)) {
            return true;
        }
        match before.unwrap_or(RefusedAt::Arc { pose: last, share: 1.0 }) {
            RefusedAt::Arc { pose, share } => {
                let to = on_arc(pose);
                let from = if pose == 0 { settings.kept_across(at, &begin) } else { on_arc(pose - 1) };
                self.is_blocked(at, &between(&from, &to, share), &near)
            }
            RefusedAt::Retract { step, share } => {
                let top = on_arc(last);
                let out = settings.allowed(top.axis.into_inner());
                let heights: Vec<f64> = self.retract_heights().take(step + 1).collect();
                let Some(&[.., below, above]) = heights.as_slice().last_chunk::<2>() else { return false };
                self.is_blocked(at, &top.translated(out * (below + (above - below) * share)), &near)
                    && heights.iter().rev().skip(1).all(|height| self.goes_on(&top.translated(out * *height)))
            }
        }
    }

    /// Returns whether the tool is in the stock at the end of an arc, and at the largest lift
    /// there, and would descend from the retract too steeply: in stock, it is not clear without
    /// one.
    fn plunges(&mut self, at: &PassEndPose<'_>, top: &ClPoint) -> bool {
        let (test, normal) = (self.test, self.settings.allowed(at.cc.normal.into_inner()));
        let out = top.translated(self.settings.allowed(top.axis.into_inner()));
        at.end == PassEnd::Entry
            && self.settings.rapid_clearance > 0.0
            && descent(&out, top) > test.cell.tool.max_ramp_angle() + RAMP_SLACK
            && [test.cell.max_lift, 0.0].iter().all(|lift| {
                let lifted = top.translated(normal * *lift);
                test.cutter_in_stock(&lifted, self.hints)
            })
    }

    /// Returns whether the tool can be neither at a pose nor lifted above it by the largest lift.
    fn is_blocked(&mut self, at: &PassEndPose<'_>, pose: &ClPoint, near: &Configuration) -> bool {
        let normal = self.settings.allowed(at.cc.normal.into_inner());
        let (test, max_lift) = (self.test, self.test.cell.max_lift);
        [max_lift, 0.0].iter().all(|lift| test.try_pose(&pose.translated(normal * *lift), near, self.hints).is_err())
    }

    /// Returns whether the retract goes on from a pose, and from those above it by up to the
    /// largest lift: nowhere would the tool be clear.
    fn goes_on(&mut self, pose: &ClPoint) -> bool {
        let Ok(configuration) = self.test.configuration_like(pose, &self.near) else { return false };
        let clearance = self.settings.rapid_clearance;
        let (distance, _) = self.test.rapid_distance(&configuration.axes, clearance, self.hints);
        distance + self.test.cell.max_lift < clearance
    }

    /// Heights above the end of the arc at which the retract looks whether the tool is clear, from
    /// 0 up.
    fn retract_heights(&self) -> impl Iterator<Item = f64> + use<> {
        let (step, most) = (self.settings.step.max(self.settings.test_step), self.settings.max_retract);
        let up = move |height: &f64| (*height < most).then(|| (height + step).min(most));
        std::iter::successors(Some(0.0), up).take(MAX_RETRACT_STEPS)
    }

    /// Moves from the end of a line over the arc and away.
    fn way(mut self, at: &PassEndPose<'_>, walked: &WalkedLine) -> Result<Approach, Refused> {
        let (settings, line) = (self.settings, &walked.line);
        let mut arc = self.arc(at, line);
        let mut lift = walked.lift;
        self.walk(at, walked.poses.last().unwrap_or(at.cl), &mut arc, &mut lift)?;
        let on_line = walked.poses.len();
        let mut outward = [walked.poses.as_slice(), &arc].concat();
        let mut from = *outward.last().unwrap_or(at.cl);
        let top = from;
        let mut is_retracted = false;
        let mut heights = self.retract_heights().enumerate().skip(1);
        while let Some(why) = self.rapid_blocked() {
            let Some((step, height)) = heights.next() else { return Err((why, None)) };
            let pose = top.translated(settings.allowed(top.axis.into_inner()) * height);
            self.go(&from, &pose).map_err(|why| (why, Some(RefusedAt::Retract { step, share: self.share })))?;
            (from, is_retracted) = (pose, true);
        }
        if is_retracted {
            outward.push(from);
        }
        self.check_ramp(at, &outward).map_err(|why| (why, None))?;
        let ahead = Unit::new_unchecked(outward_feed(at.end, &line.turned(at.end, at.cc)));
        Ok(Approach { outward, outer: self.near, on_line, ahead })
    }

    /// Moves to a pose of the arc, lifted along the normal as far as the one before, or farther
    /// where the way gouges, by up to the largest lift that seats a pose: the end of a pass is
    /// seated on its facets, and its surroundings need not be lower. Returns the lifted pose.
    fn go_lifted(
        &mut self,
        from: &ClPoint,
        pose: &ClPoint,
        normal: Vector3<f64>,
        lift: &mut f64,
    ) -> Result<ClPoint, Infeasible> {
        let (near, max_lift) = (self.near, self.test.cell.max_lift);
        loop {
            let to = pose.translated(normal * *lift);
            match self.go(from, &to) {
                Err(Infeasible::Gouge { .. }) if *lift < max_lift => {
                    self.near = near;
                    *lift = (*lift + max_lift / LIFTS).min(max_lift);
                }
                result => return result.map(|()| to),
            }
        }
    }

    /// Tests the straight way between two poses, without its start.
    fn go(&mut self, from: &ClPoint, to: &ClPoint) -> Result<(), Infeasible> {
        // A pose that is no number is tested, and not found feasible.
        let steps = ((to.tip - from.tip).norm() / self.settings.test_step).ceil();
        let n = if steps.is_finite() { steps.clamp(1.0, MAX_TESTS) as usize } else { 1 };
        for k in 1..=n {
            self.share = k as f64 / n as f64;
            self.near = self.test.try_pose(&between(from, to, self.share), &self.near, self.hints)?;
        }
        Ok(())
    }

    /// Returns the obstacle nearer than the rapid clearance to the whole tool at its place, stock
    /// included.
    fn rapid_blocked(&mut self) -> Option<Infeasible> {
        let clearance = self.settings.rapid_clearance;
        let (distance, nearest) = self.test.rapid_distance(&self.near.axes, clearance, self.hints);
        nearest.filter(|_| distance < clearance)
    }

    /// Checks that the tool descends, relative to the cutter's bottom, by at most its ramp angle
    /// where it is in the stock; an exit may do so on a line that follows the surface down. Stock
    /// between two poses counts: a retract is one long way, free at both ends.
    fn check_ramp(&mut self, at: &PassEndPose<'_>, outward: &[ClPoint]) -> Result<(), Infeasible> {
        let mut inner = at.cl;
        for outer in outward {
            let (from, to) = if at.end == PassEnd::Entry { (outer, inner) } else { (inner, outer) };
            let angle = descent(from, to);
            let steepest = self.test.cell.tool.max_ramp_angle() + RAMP_SLACK;
            if angle > steepest && self.is_in_stock(from, to) {
                return Err(Infeasible::Ramp { angle });
            }
            inner = outer;
        }
        Ok(())
    }

    /// Returns whether the cutter is in the stock at the end of a way, or on it.
    fn is_in_stock(&mut self, from: &ClPoint, to: &ClPoint) -> bool {
        let (test, step) = (self.test, self.settings.test_step);
        test.cutter_in_stock(to, self.hints) || test.meets_stock_between(from, to, step, self.hints)
    }
}

/// Steps in which an arc is lifted up to the largest lift.
const LIFTS: f64 = 8.0;

/// Largest excess of a chord over the tool's ramp angle, rad: less than inserts notice.
pub const RAMP_SLACK: f64 = 1e-3;

/// Returns the angle at which the tool descends on the straight way from one pose to another,
/// relative to the cutter's bottom at the first, rad, −π/2..=π/2; 0 where the tip stays.
pub fn descent(from: &ClPoint, to: &ClPoint) -> f64 {
    let way = to.tip - from.tip;
    let down = -way.dot(&from.axis);
    down.atan2((way + from.axis.into_inner() * down).norm())
}

/// Steps of a retract, at most.
const MAX_RETRACT_STEPS: usize = 2_000;

/// Largest number of tested poses of one straight move; more means an absurd length in the job.
const MAX_TESTS: f64 = 2e4;
