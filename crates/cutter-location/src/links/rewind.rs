//! Turning back of limited rotary axes: on a link, outside the clearance surface, tested as it is
//! driven.

use facemill_cl_data::ClPoint;
use facemill_inverse_kinematics::{AxisKind, AxisValues, Machine, Motion};

use crate::links::link::{LinkBlocked, Linker, Waypoint};
use crate::pose::workcell::Infeasible;

/// Way of a rotary axis, rad, up to which it turns the short way round; beyond rounding, more than
/// half a turn means turning back.
const HALF_TURN: f64 = std::f64::consts::PI + 1e-6;

/// Heights above the clearance surface, besides the margin, at which an axis may turn back, mm.
/// Each about trebles: the tool is lifted by at most about three times as much as necessary.
const HEIGHTS: [f64; 4] = [0.0, 60.0, 180.0, 600.0];

/// Largest step of a rotary axis where all axes move evenly, rad.
const LARGEST_STEP: f64 = 0.15;

/// Number of steps of a turn between places at which its tip is checked against the clearance
/// surface: they are less than 6° apart.
const PLACES: usize = 64;

/// Returns the limited rotary axes of a machine, which have to turn back at an end of their travel.
pub fn limited_rotaries(machine: &Machine) -> impl Iterator<Item = usize> + '_ {
    machine.axes().iter().enumerate().filter(|(_, a)| a.kind == AxisKind::Rotary && !a.endless).map(|(k, _)| k)
}

/// Returns the limited rotary axis that moves by more than half a turn between two positions, the
/// one that moves farthest: it does not take the nearest turn, because its limits prevent that.
pub fn rewound_axis(machine: &Machine, from: &AxisValues, to: &AxisValues) -> Option<usize> {
    let way = |k: usize| (to.get_or_zero(k) - from.get_or_zero(k)).abs();
    limited_rotaries(machine).filter(|&k| way(k) > HALF_TURN).max_by(|&a, &b| way(a).total_cmp(&way(b)))
}

/// Height of a link over the clearance surface, and whether an axis that turns back there keeps the
/// tip outside.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Height {
    /// Besides the margin, mm.
    pub(crate) above: f64,
    /// Whether the tip stays outside the surface during the turn; else only the rapid clearance is
    /// kept, which is tested either way.
    outside: bool,
}

impl Linker<'_, '_> {
    /// Returns whether a limited axis turns back between two poses.
    pub(crate) fn rewinds(&self, from: &Waypoint, to: &Waypoint) -> bool {
        rewound_axis(self.test.cell.machine, &from.configuration.axes, &to.configuration.axes).is_some()
    }

    /// Returns the heights to try, the common one first.
    pub(crate) fn heights(&self) -> Vec<Height> {
        if limited_rotaries(self.test.cell.machine).next().is_none() {
            return vec![Height { above: 0.0, outside: true }];
        }
        [true, false].into_iter().flat_map(|outside| HEIGHTS.map(|above| Height { above, outside })).collect()
    }

    /// Returns the way from `out` along the clearance surface through `poses`, the last of which is
    /// that of `over`. Where limited axes have to turn back, a pose appears twice, at both
    /// windings: at the far end, the near one, or both, or else the turn takes the whole way.
    ///
    /// Where the way of the tool leads an axis beyond a limit and the nearest turn does not (past
    /// the pole, on its other side), all axes move evenly, and the tool follows.
    pub(crate) fn across(
        &mut self,
        out: &Waypoint,
        over: &Waypoint,
        poses: &[ClPoint],
        height: Height,
    ) -> Result<Vec<Waypoint>, LinkBlocked> {
        let plain = self.way(out, poses.iter().copied());
        if limited_rotaries(self.test.cell.machine).next().is_none() {
            return plain;
        }
        let same_branch = out.configuration.branch == over.configuration.branch;
        let there =
            |way: &[Waypoint], of: &Self| !same_branch || way.last().is_some_and(|last| !of.rewinds(last, over));
        let plain = match plain {
            Ok(way) if there(&way, self) => return Ok(way),
            // The nearest turn needs no turning back; only the way of the tool does.
            plain if same_branch && !self.rewinds(out, over) => match self.together(out, over, height) {
                Ok(way) => return Ok(way),
                Err(_) => plain,
            },
            plain => plain,
        };
        let why = match plain.and_then(|way| self.turned_at_end(way, over, height)) {
            Ok(way) => return Ok(way),
            Err(blocked) => blocked,
        };
        let mut twice = None;
        for start in self.windings(out) {
            let turned = self.turn(&out.configuration.axes, &start.configuration.axes, height);
            let way = turned.and_then(|()| self.way(&start, poses.iter().copied()));
            let Ok(way) = way else { continue };
            let ends_there = there(&way, self);
            let way: Vec<Waypoint> = std::iter::once(start).chain(way).collect();
            if ends_there {
                return Ok(way);
            }
            twice = twice.or_else(|| self.turned_at_end(way, over, height).ok());
        }
        if let Some(way) = twice {
            return Ok(way);
        }
        if same_branch && self.turn(&out.configuration.axes, &over.configuration.axes, height).is_ok() {
            return Ok(vec![*over]);
        }
        Err(why)
    }

    /// Moves all axes evenly from one pose to another, in steps that a control follows.
    fn together(&mut self, out: &Waypoint, over: &Waypoint, height: Height) -> Result<Vec<Waypoint>, LinkBlocked> {
        let cell = self.test.cell;
        let (from, to) = (out.configuration.axes, over.configuration.axes);
        let rotary = |k: &usize| cell.machine.axes()[*k].kind == AxisKind::Rotary;
        let turn = (0..from.len()).filter(rotary).map(|k| (to[k] - from[k]).abs()).fold(0.0, f64::max);
        let n = (turn / LARGEST_STEP).ceil().max(1.0) as usize;
        let mut way = Vec::with_capacity(n);
        let mut at = *out;
        for k in 1..=n {
            let axes = from.lerp(&to, k as f64 / n as f64);
            let cl = cell.machine.cl_point(&axes, cell.tool.gauge_length()).transformed(self.test.work_from_table());
            let configuration = crate::pose::workcell::Configuration { axes, ..over.configuration };
            let next = if k == n { *over } else { Waypoint { cl, configuration } };
            self.turn(&at.configuration.axes, &next.configuration.axes, height)?;
            way.push(next);
            at = next;
        }
        Ok(way)
    }

    /// Returns the way if an axis may turn back at its end to match `over`. Changes of branch are
    /// tested where they are driven.
    fn turned_at_end(
        &mut self,
        way: Vec<Waypoint>,
        over: &Waypoint,
        height: Height,
    ) -> Result<Vec<Waypoint>, LinkBlocked> {
        let last = way.last().filter(|last| last.configuration.branch == over.configuration.branch);
        if let Some(last) = last.filter(|last| self.rewinds(last, over)) {
            self.turn(&last.configuration.axes, &over.configuration.axes, height)?;
        }
        Ok(way)
    }

    /// Returns the same pose at the other windings, the nearest first.
    fn windings(&self, at: &Waypoint) -> Vec<Waypoint> {
        let machine = self.test.cell.machine;
        let axes = at.configuration.axes;
        let mut all = machine.windings(&axes);
        all.retain(|q| rewound_axis(machine, &axes, q).is_some());
        all.sort_by(|a, b| machine.travel_time(&axes, a).total_cmp(&machine.travel_time(&axes, b)));
        let wound =
            |axes| Waypoint { configuration: crate::pose::workcell::Configuration { axes, ..at.configuration }, ..*at };
        all.into_iter().map(wound).collect()
    }

    /// Tests one block in which an axis turns back.
    fn turn(&mut self, from: &AxisValues, to: &AxisValues, height: Height) -> Result<(), LinkBlocked> {
        if height.outside {
            self.stays_outside(from, to)?;
        }
        self.rapid_block(from, to, self.settings.rapid_clearance)
    }

    /// Checks that the tip stays outside the clearance surface in a block.
    fn stays_outside(&self, from: &AxisValues, to: &AxisValues) -> Result<(), LinkBlocked> {
        let cell = self.test.cell;
        let length = cell.tool.gauge_length();
        let pose_at = |q: &AxisValues| cell.machine.cl_point(q, length).transformed(self.test.work_from_table());
        let blocked = |pose| LinkBlocked { pose, why: Infeasible::TooLong };
        let motion =
            Motion::new(cell.machine, self.settings.rapid_law, from, to, length).map_err(|_| blocked(pose_at(from)))?;
        for k in 0..=PLACES {
            let pose = pose_at(&motion.at(k as f64 / PLACES as f64).unwrap_or(*to));
            if self.settings.clearance.height(&pose.tip) < 0.0 {
                return Err(blocked(pose));
            }
        }
        Ok(())
    }
}
