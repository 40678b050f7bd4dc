use crate::axes::axis_values::AxisValues;
use crate::inverse::nearest_turn;
use crate::path::choice::{FreeTurn, PathChange, PathChoice, PathError, PathSettings, SegmentKind, SingularStretch};
use crate::path::edges::Edges;
use crate::path::follow::distance;
use crate::path::station::{Poses, Station};
use crate::solver::inverse_solution::Unreachable;

/// Builds the result during a second pass over the stations.
pub(crate) struct Choosing<'a> {
    of: Poses<'a>,
    segments: &'a [SegmentKind],
    settings: &'a PathSettings,
    node: usize,
    /// Values at the first pose of the station, unrolled.
    at: AxisValues,
    result: PathChoice,
}

/// Distributions of the turn of a free axis over its stretch: the first with all poses within the
/// limits is used.
const SPREADS: [fn(f64) -> f64; 3] = [|t| t, |t| if t > 0.0 { 1.0 } else { 0.0 }, |t| if t < 1.0 { 0.0 } else { 1.0 }];

/// Turn of a free axis that counts as rounding, rad: its values are limits read beside the pole.
const NO_TURN: f64 = 1e-6;

impl<'a> Choosing<'a> {
    pub(crate) fn new(of: Poses<'a>, segments: &'a [SegmentKind], settings: &'a PathSettings) -> Self {
        let result = PathChoice {
            values: Vec::with_capacity(of.poses.len()),
            breaks: Vec::new(),
            link_turns: Vec::new(),
            free_turns: Vec::new(),
            singular: Vec::new(),
            weighted_time: 0.0,
        };
        Self { of, segments, settings, node: 0, at: AxisValues::zeros(0), result }
    }

    pub(crate) fn begin(&mut self, station: &Station, node: usize, start: Option<&AxisValues>) {
        self.node = node;
        self.at = station.nodes[node].values;
        if let Some(start) = start {
            self.at = self.of.unrolled(&self.at, |k| start[k]);
        }
    }

    pub(crate) fn go_on(&mut self, previous: &Station, station: &Station, node: usize) -> Result<(), PathError> {
        let segment = previous.last;
        let kind = self.segments[segment];
        let edges = Edges::new(self.of, (previous, station), kind, &self.settings.weights);
        let (from, to) = (&previous.nodes[self.node], &station.nodes[node]);
        let edge = edges.edge(from, to);
        // On a link it turns there, not in the stretch.
        let leaving = edges.leaving(to).filter(|_| edge.change.is_none() && kind == SegmentKind::Cut);
        let left = self.leave(previous, leaving.as_ref())?;
        let way = match &leaving {
            Some(leaving) => AxisValues::from_fn(left.len(), |k| to.values[k] - leaving[k]),
            None => edge.way,
        };
        self.at = self.of.unrolled(&to.values, |k| left[k] + way[k]);
        self.node = node;
        if let Some(change) = edge.change {
            let list = match kind {
                SegmentKind::Cut => &mut self.result.breaks,
                SegmentKind::Link => &mut self.result.link_turns,
            };
            list.push(PathChange { segment, change });
        }
        Ok(())
    }

    /// Fills in the values of a station; returns those at its end, after a free axis has turned to
    /// its leaving value.
    fn leave(&mut self, station: &Station, leaving: Option<&AxisValues>) -> Result<AxisValues, PathError> {
        let Some(axis) = station.free else {
            self.result.values.push(self.at);
            return Ok(self.at);
        };
        let mut end = self.at;
        if let Some(leaving) = leaving {
            let endless = self.of.machine.axes()[axis].endless;
            end[axis] = if endless { nearest_turn(leaving[axis], self.at[axis]) } else { leaving[axis] };
        }
        if (end[axis] - self.at[axis]).abs() < NO_TURN {
            end[axis] = self.at[axis];
        } else {
            let (from, to) = (self.at[axis], end[axis]);
            self.result.free_turns.push(FreeTurn { first: station.first, last: station.last, axis, from, to });
        }
        let over = [self.at[axis], end[axis]];
        let [evenly, others @ ..] = SPREADS;
        let values = self.spread(station, axis, over, evenly).or_else(|why| {
            let other = others.into_iter().find_map(|how| self.spread(station, axis, over, how).ok());
            other.ok_or(why)
        })?;
        self.result.values.extend(values);
        Ok(end)
    }

    fn spread(
        &self,
        station: &Station,
        axis: usize,
        [from, to]: [f64; 2],
        over: fn(f64) -> f64,
    ) -> Result<Vec<AxisValues>, PathError> {
        let poses = &self.of.poses[station.first..=station.last];
        let length: f64 = poses.windows(2).map(|w| distance(&w[0].tip, &w[1].tip)).sum();
        let mut gone = 0.0;
        let mut values = Vec::with_capacity(poses.len());
        for (k, index) in (station.first..=station.last).enumerate() {
            if k > 0 {
                gone += distance(&poses[k - 1].tip, &poses[k].tip);
            }
            let last = k > 0 && k + 1 == poses.len();
            let t = if last {
                1.0
            } else if length > 0.0 {
                (gone / length).min(1.0)
            } else {
                k as f64 / poses.len() as f64
            };
            let mut rotary = self.at;
            rotary[axis] = if last { to } else { from + (to - from) * over(t) };
            let inaccurate = PathError::Unreachable { index, reason: Unreachable::Inaccurate };
            let q = self.of.at(index, &rotary).ok_or(inaccurate)?;
            values.push(self.of.within(&q).map_err(|reason| PathError::Unreachable { index, reason })?);
        }
        Ok(values)
    }

    pub(crate) fn finish(mut self, last: Option<&Station>, weighted_time: f64) -> Result<PathChoice, PathError> {
        if let Some(last) = last {
            self.leave(last, None)?;
        }
        self.result.weighted_time = weighted_time;
        self.result.singular = self.singular();
        Ok(self.result)
    }

    fn singular(&self) -> Vec<SingularStretch> {
        let mut all: Vec<SingularStretch> = Vec::new();
        for (index, cl) in self.of.poses.iter().enumerate() {
            let Some(angle) = self.of.machine.angle_to_singular(cl) else { break };
            if angle > self.settings.singular_cone {
                continue;
            }
            let before = index.checked_sub(1).map_or(0.0, |k| self.speed(k));
            let speed = before.max(self.speed(index));
            match all.last_mut() {
                Some(stretch) if stretch.last + 1 == index => {
                    stretch.last = index;
                    stretch.smallest_angle = stretch.smallest_angle.min(angle);
                    stretch.largest_speed = stretch.largest_speed.max(speed);
                }
                _ => {
                    all.push(SingularStretch { first: index, last: index, smallest_angle: angle, largest_speed: speed })
                }
            }
        }
        for turn in self.result.free_turns.iter().filter(|t| t.first == t.last) {
            let at = all.iter_mut().filter(|s| (s.first..=s.last).contains(&turn.first));
            at.for_each(|s| s.largest_speed = f64::INFINITY);
        }
        all
    }

    /// Returns the largest turn of a rotary axis per way of the tip, 0 for a link or a break.
    fn speed(&self, segment: usize) -> f64 {
        let is_whole = self.segments.get(segment) == Some(&SegmentKind::Cut)
            && self.result.breaks.binary_search_by_key(&segment, |b| b.segment).is_err();
        if !is_whole {
            return 0.0;
        }
        let (from, to) = (&self.result.values[segment], &self.result.values[segment + 1]);
        let rotary = (0..from.len()).filter(|&k| self.of.machine.is_rotary(k));
        let turn = rotary.map(|k| (to[k] - from[k]).abs()).fold(0.0, f64::max);
        let way = distance(&self.of.poses[segment].tip, &self.of.poses[segment + 1].tip);
        if turn == 0.0 { 0.0 } else { turn / way }
    }
}
