//! Axis positions along the moves of a tool.

mod turns;
mod ways;

use std::collections::BTreeMap;

use facemill_cl_data::{ClPoint, Monitor};
use facemill_inverse_kinematics::motion::MotionTolerance;
use facemill_inverse_kinematics::path::{Change, PathChoice, PathError, PathSettings, SegmentKind, choose_along};
use facemill_inverse_kinematics::{AxisValues, BlockLaw, BranchPreference, Machine};

use crate::fault::PostFault;
use crate::positions::turns::{lifted, other_solution, turned, with_tip};
use crate::positions::ways::{BetweenFault, MotionRules, before, between, held_by};
use crate::report::{PostNote, Remarks};
use crate::scene::{ARC_SHARE, MOTION_SHARE, PostOptions, PostScene};
use crate::steps::PathMove;

/// A position of the axes that is written as a block.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Position {
    /// Index of the move that it is on.
    pub(crate) of: usize,
    /// Axis values.
    pub(crate) axes: AxisValues,
    /// Kind of the move to it.
    pub(crate) kind: PositionKind,
    /// Pose of the file there, table frame; `None` while rotary axes turn anew.
    pub(crate) meant: Option<ClPoint>,
    /// Whether the file names it.
    pub(crate) is_point: bool,
}

/// Kind of the move to a position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum PositionKind {
    /// At rapid rate.
    Rapid,
    /// At the largest feed: a rapid of the file whose axes would not go together at rapid rate.
    FastCut,
    /// At a feed of the tip, mm/min.
    Cut(f64),
}

/// Returns the positions of all moves of a tool in order, with remarks, at most
/// [`PostOptions::max_positions`].
///
/// # Errors
/// With the line: a pose that the machine does not reach, or whose way needs a retract that is not
/// permitted. Cancellation.
pub(crate) fn positions(
    scene: &PostScene<'_>,
    (tool_length, radius): (f64, f64),
    options: &PostOptions,
    moves: &[PathMove],
    remarks: &mut Remarks,
    monitor: &dyn Monitor,
) -> Result<Vec<Position>, PostFault> {
    let ways = MotionRules {
        machine: scene.machine,
        tool_length,
        cutting: scene.cutting_law(),
        rapid: scene.rapid_law(),
        has_bent_rapids: scene.has_bent_rapids(),
        in_cuts: MotionTolerance::of_cutter(MOTION_SHARE * options.tolerance, radius),
        on_chords: MotionTolerance::of_cutter((MOTION_SHARE - ARC_SHARE) * options.tolerance, radius),
        in_rapids: options.rapid_tolerance.map(|t| MotionTolerance::of_cutter(MOTION_SHARE * t, radius)),
        retract: options.retract,
    };
    let poses: Vec<ClPoint> = moves.iter().map(|m| m.cl.transformed(&scene.table_from_work)).collect();
    let kinds: Vec<SegmentKind> = moves.iter().skip(1).map(kind_of).collect();
    let start = start(scene.machine, poses.first(), tool_length, options.branch);
    monitor.checkpoint()?;
    let is_free = options.branch == BranchPreference::Nearest;
    let choice = chosen(scene.machine, (&poses, &kinds), (&start, is_free), tool_length);
    let choice = choice.map_err(|error| path_fault(&error, moves))?;
    let mut follower = MoveFollower {
        max_positions: options.max_positions,
        ways,
        moves,
        poses: &poses,
        choice: &choice,
        remarks,
        out: Vec::new(),
    };
    follower.follow(monitor)?;
    Ok(follower.out)
}

/// Position at the first pose: the solution nearest to home, of the branch that is wanted; home
/// where there is none.
fn start(machine: &Machine, first: Option<&ClPoint>, tool_length: f64, branch: BranchPreference) -> AxisValues {
    let nearest = first.and_then(|first| machine.nearest_inverse(first, tool_length, None, branch).ok());
    nearest.unwrap_or_else(|| machine.home())
}

/// Returns branch and winding of every pose, from this solution of the first one on. A free start
/// is another solution if the axes then turn anew less often.
fn chosen(
    machine: &Machine,
    (poses, kinds): (&[ClPoint], &[SegmentKind]),
    (start, is_free): (&AxisValues, bool),
    tool_length: f64,
) -> Result<PathChoice, PathError> {
    let along = |begins_at_start: bool| {
        let settings = PathSettings { begins_at_start, ..PathSettings::new(machine) };
        choose_along(machine, poses, kinds, Some(start), tool_length, &settings)
    };
    let turns = |choice: &PathChoice| (choice.breaks.len(), choice.link_turns.len());
    let from_start = along(true)?;
    if !is_free || turns(&from_start) == (0, 0) {
        return Ok(from_start);
    }
    let from_any = along(false)?;
    Ok(if turns(&from_any) < turns(&from_start) { from_any } else { from_start })
}

fn kind_of(m: &PathMove) -> SegmentKind {
    if m.feed.is_some() { SegmentKind::Cut } else { SegmentKind::Link }
}

fn path_fault(error: &PathError, moves: &[PathMove]) -> PostFault {
    let line = |index: usize| moves.get(index).map_or(1, |m| m.line);
    match error {
        PathError::Unreachable { index, reason } => {
            PostFault::at(line(*index), format!("the machine does not reach it: {reason}"))
        }
        PathError::TooManyWindings { index, .. } => PostFault::at(line(*index), error.to_string()),
        other => PostFault::Whole(other.to_string()),
    }
}

struct MoveFollower<'a> {
    max_positions: usize,
    ways: MotionRules<'a>,
    moves: &'a [PathMove],
    poses: &'a [ClPoint],
    choice: &'a PathChoice,
    remarks: &'a mut Remarks,
    out: Vec<Position>,
}

impl MoveFollower<'_> {
    fn follow(&mut self, monitor: &dyn Monitor) -> Result<(), PostFault> {
        let in_place = |t: &&facemill_inverse_kinematics::path::FreeTurn| t.first == t.last;
        let turns: BTreeMap<usize, (usize, f64)> =
            self.choice.free_turns.iter().filter(in_place).map(|t| (t.first, (t.axis, t.to))).collect();
        let changes: BTreeMap<usize, Change> =
            self.choice.breaks.iter().chain(&self.choice.link_turns).map(|c| (c.segment, c.change)).collect();
        for k in 0..self.moves.len() {
            monitor.checkpoint()?;
            monitor.advance(1);
            let to = self.choice.values[k];
            match (k.checked_sub(1), k.checked_sub(1).and_then(|segment| changes.get(&segment))) {
                // The first move is a rapid, by the template and directly.
                (None, _) => self.push(k, to, PositionKind::Rapid),
                (Some(_), None) => self.go(k, &to)?,
                (Some(_), Some(change)) => self.change(k, &to, *change)?,
            }
            if let Some(&(axis, value)) = turns.get(&k) {
                self.turn_in_place(k, axis, value)?;
            }
            if self.out.len() > self.max_positions {
                let why = format!(
                    "more than {} positions keep the tolerance up to here: permit a larger one, \
                                   or split the file",
                    self.max_positions
                );
                return Err(PostFault::at(self.moves[k].line, why));
            }
        }
        Ok(())
    }

    fn at(&self) -> AxisValues {
        self.out.last().map_or_else(|| self.choice.values[0], |p| p.axes)
    }

    /// Appends the end of a move.
    fn push(&mut self, of: usize, axes: AxisValues, kind: PositionKind) {
        let is_point = self.moves[of].is_point;
        self.out.push(Position { of, axes, kind, meant: Some(self.poses[of]), is_point });
    }

    /// Appends a position on a move.
    fn push_between(&mut self, of: usize, (axes, meant): (AxisValues, Option<ClPoint>), kind: PositionKind) {
        self.out.push(Position { of, axes, kind, meant, is_point: false });
    }

    /// Goes to the end of a move, which continues the position before.
    fn go(&mut self, k: usize, to: &AxisValues) -> Result<(), PostFault> {
        let from = self.at();
        let Some((law, tolerance, kind)) = self.way_of(k, &from, to) else {
            self.push(k, *to, PositionKind::Rapid);
            return Ok(());
        };
        let poses = [&self.poses[k - 1], &self.poses[k]];
        let found = between(&self.ways, (law, &tolerance), [&from, to], poses);
        let found = found.map_err(|why| self.between_fault(k, &why))?;
        for (axes, meant) in found {
            self.push_between(k, (axes, Some(meant)), kind);
        }
        self.push(k, *to, kind);
        Ok(())
    }

    /// Law, tolerance and kind of a move; `None` of a rapid that is one block.
    fn way_of(
        &self,
        k: usize,
        from: &AxisValues,
        to: &AxisValues,
    ) -> Option<(BlockLaw, MotionTolerance, PositionKind)> {
        let ways = &self.ways;
        if let Some(feed) = self.moves[k].feed {
            let tolerance = if self.moves[k].is_chord { ways.on_chords } else { ways.in_cuts };
            return Some((ways.cutting.into(), tolerance, PositionKind::Cut(feed)));
        }
        let tolerance = ways.in_rapids?;
        Some(if ways.has_bent_rapids && !held_by(ways, (ways.rapid, &tolerance), from, to) {
            (ways.cutting.into(), tolerance, PositionKind::FastCut)
        } else {
            (ways.rapid, tolerance, PositionKind::Rapid)
        })
    }

    /// Kind of moves at rapid rate in which all axes have to go together.
    fn together(&self) -> PositionKind {
        if self.ways.has_bent_rapids { PositionKind::FastCut } else { PositionKind::Rapid }
    }

    /// Tolerance of the tip while rotary axes turn anew, mm.
    fn turn_tolerance(&self, k: usize) -> f64 {
        let of_rapids = self.ways.in_rapids.filter(|_| self.moves[k].feed.is_none());
        of_rapids.unwrap_or(self.ways.in_cuts).tip
    }

    fn between_fault(&self, k: usize, why: &BetweenFault) -> PostFault {
        PostFault::at(self.moves[k].line, why.to_string())
    }

    /// Goes to the end of a move before which rotary axes turn anew: with the tool lifted, or in a
    /// rapid away from cuts with the tip on its line, which is unproven.
    fn change(&mut self, k: usize, to: &AxisValues, change: Change) -> Result<(), PostFault> {
        let line = self.moves[k].line;
        let name = self.change_name(change);
        if let Some(retract) = self.ways.retract {
            return self.turn_lifted(k, to, &name, retract);
        }
        let what = if self.moves[k].feed.is_some() {
            "within the cut"
        } else if self.touches_cut(k) {
            "in a rapid from or to a cut"
        } else {
            return self.turn_on_line(k, to, &name);
        };
        let why = format!(
            "{name} {what}: the tool has to be lifted there; permit it with a retract (--retract-mm), or change the path"
        );
        Err(PostFault::at(line, why))
    }

    /// Whether a cut ends where a rapid begins, or begins where it ends.
    fn touches_cut(&self, k: usize) -> bool {
        let is_cut = |m: &PathMove| m.feed.is_some();
        self.moves[..k].last().is_some_and(is_cut) || self.moves.get(k + 1).is_some_and(is_cut)
    }

    /// Goes to the end of a rapid in which rotary axes turn anew, with the tip on its line.
    fn turn_on_line(&mut self, k: usize, to: &AxisValues, name: &str) -> Result<(), PostFault> {
        let line = self.moves[k].line;
        let from = self.at();
        let text = format!(
            "RAPID in which {name} without a lift, with the tip on its line: lift the tool (--retract-mm), or run the \
             program against the part (--part, --job)"
        );
        self.remarks.unproven.push(PostNote::at(line, text));
        let way = turned(&self.ways, [&from, to], self.turn_tolerance(k)).map_err(|why| PostFault::at(line, why))?;
        for axes in way {
            self.push_between(k, (axes, None), self.together());
        }
        self.push(k, *to, self.together());
        Ok(())
    }

    /// Goes to the end of a move before which the tool is lifted, rotary axes turn anew, and the
    /// tool comes back to the same point: at the feed of the cut that it is on, or that ends there.
    /// A rapid whose axes cannot follow the turn of the tool is passed lifted.
    fn turn_lifted(&mut self, k: usize, to: &AxisValues, name: &str, retract: f64) -> Result<(), PostFault> {
        let line = self.moves[k].line;
        let from = self.at();
        let at_line = |why| PostFault::at(line, why);
        let pose = self.poses[k - 1];
        let up = lifted(&self.ways, &from, retract).map_err(at_line)?;
        let again = match self.moves[k].feed {
            Some(_) => Some(other_solution(&self.ways, &pose, to).map_err(at_line)?),
            None => before(&self.ways, [&pose, &self.poses[k]], to),
        };
        let within = if self.moves[k].feed.is_some() { "within the cut" } else { "in a rapid" };
        let text = format!("the tool is lifted by {retract} mm along its axis, because {name} {within}");
        self.remarks.notes.push(PostNote::at(line, text));
        self.push_between(k, (up, None), self.together());
        let Some(again) = again else { return self.pass_lifted(k, &up, to, retract) };
        let up_again = lifted(&self.ways, &again, retract).map_err(at_line)?;
        self.turn_to(k, &up, &up_again)?;
        let down = self.moves[k].feed.or(self.moves[k - 1].feed).map_or_else(|| self.together(), PositionKind::Cut);
        self.push_between(k, (again, Some(pose)), down);
        self.go(k, to)
    }

    /// Turns the rotary axes of the lifted tool to those of the end of a rapid, goes above it, and
    /// down along the tool axis: at the feed of the cut that begins there.
    fn pass_lifted(&mut self, k: usize, up: &AxisValues, to: &AxisValues, retract: f64) -> Result<(), PostFault> {
        let at_line = |why| PostFault::at(self.moves[k].line, why);
        let tip = self.ways.machine.cl_point(up, self.ways.tool_length).tip;
        let turned = with_tip(&self.ways, to, &tip).map_err(at_line)?;
        let above = lifted(&self.ways, to, retract).map_err(at_line)?;
        self.turn_to(k, up, &turned)?;
        self.push_between(k, (above, None), self.together());
        let next = self.moves.get(k + 1).and_then(|m| m.feed);
        self.push(k, *to, next.map_or_else(|| self.together(), PositionKind::Cut));
        Ok(())
    }

    /// Turns the rotary axes of the lifted tool with the tip held.
    fn turn_to(&mut self, k: usize, up: &AxisValues, turned_up: &AxisValues) -> Result<(), PostFault> {
        let way = turned(&self.ways, [up, turned_up], self.ways.in_cuts.tip);
        let way = way.map_err(|why| PostFault::at(self.moves[k].line, why))?;
        for axes in way.into_iter().chain([*turned_up]) {
            self.push_between(k, (axes, None), self.together());
        }
        Ok(())
    }

    fn change_name(&self, change: Change) -> String {
        match change {
            Change::Rewind { axis, turns } => {
                let letter = self.ways.machine.axes()[axis].letter;
                format!("axis {letter} turns back by {} full turn(s)", turns.abs())
            }
            _ => "the rotary axes change to their other solution".to_owned(),
        }
    }

    /// Turns an axis about which the tool points, with the tip at rest.
    fn turn_in_place(&mut self, k: usize, axis: usize, value: f64) -> Result<(), PostFault> {
        let line = self.moves[k].line;
        let from = self.at();
        let mut to = from;
        to[axis] = value;
        let tip = self.poses[k].tip;
        let to = self.ways.machine.with_tip_at(&to, &tip, self.ways.tool_length);
        let to = to.filter(|q| self.ways.machine.first_beyond_limit(q).is_none());
        let to =
            to.ok_or_else(|| PostFault::at(line, "the axes cannot hold the tip while the tool turns about itself"))?;
        let kind = self.moves[k].feed.map_or_else(|| self.together(), PositionKind::Cut);
        let way = turned(&self.ways, [&from, &to], self.turn_tolerance(k)).map_err(|why| PostFault::at(line, why))?;
        for axes in way.into_iter().chain([to]) {
            self.push_between(k, (axes, Some(self.poses[k])), kind);
        }
        Ok(())
    }
}
