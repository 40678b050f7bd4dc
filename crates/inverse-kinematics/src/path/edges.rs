use crate::axes::axis_values::AxisValues;
use crate::inverse::nearest_turn;
use crate::path::choice::{Change, SegmentKind};
use crate::path::follow::Base;
use crate::path::station::{Node, Poses, Station};

/// Continuations of the solutions of one station to those of the next.
pub(crate) struct Edges<'a> {
    of: Poses<'a>,
    from: &'a Station,
    to: &'a Station,
    kind: SegmentKind,
    weights: &'a AxisValues,
    /// For each solution of `from`: the solution of `to` that continues it, and the way of each
    /// rotary axis.
    continued: Vec<(usize, usize, AxisValues)>,
}

/// One way from a node to the next.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Edge {
    /// `None` where the solution continues.
    pub(crate) change: Option<Change>,
    /// Way of each axis.
    pub(crate) way: AxisValues,
}

impl<'a> Edges<'a> {
    pub(crate) fn new(
        of: Poses<'a>,
        (from, to): (&'a Station, &'a Station),
        kind: SegmentKind,
        weights: &'a AxisValues,
    ) -> Self {
        let mut edges = Self { of, from, to, kind, weights, continued: Vec::new() };
        let (start, end) = (&of.poses[from.last], &of.poses[to.first]);
        match (from.free, to.free) {
            (None, None) => {
                for (a, base) in from.bases.iter().enumerate() {
                    let followed = of.machine.followed((start, base), (end, &to.bases), of.tool_length);
                    for (b, values) in followed {
                        edges.add(a, b, &base.values, &values);
                    }
                }
            }
            (None, Some(_)) => {
                for (a, base) in from.bases.iter().enumerate() {
                    let arrived = of.machine.arrival((start, base), (end, &to.bases[0]), of.tool_length);
                    if let Some(values) = arrived
                        && let Some(b) = edges.index_of(&to.bases, &values)
                    {
                        edges.add(a, b, &base.values, &values);
                    }
                }
            }
            (Some(_), None) => {
                for (b, base) in to.bases.iter().enumerate() {
                    let left = of.machine.arrival((end, base), (start, &from.bases[0]), of.tool_length);
                    if let Some(values) = left {
                        // From any value of the free axis: it turns before it leaves.
                        (0..from.bases.len()).for_each(|a| edges.add(a, b, &values, &base.values));
                    }
                }
            }
            (Some(_), Some(_)) => {}
        }
        edges
    }

    fn index_of(&self, bases: &[Base], values: &AxisValues) -> Option<usize> {
        bases.iter().position(|b| self.of.machine.same_rotaries(&b.values, values))
    }

    fn add(&mut self, a: usize, b: usize, from: &AxisValues, to: &AxisValues) {
        let way = AxisValues::from_fn(from.len(), |k| to[k] - from[k]);
        self.continued.push((a, b, way));
    }

    /// Returns the rotary values at which the axes leave a free stretch for node `to`, if the
    /// motion continues to it.
    pub(crate) fn leaving(&self, to: &Node) -> Option<AxisValues> {
        let (_, _, way) = self.continued.iter().find(|(_, b, _)| self.from.free.is_some() && *b == to.base)?;
        Some(AxisValues::from_fn(way.len(), |k| to.values[k] - way[k]))
    }

    pub(crate) fn edge(&self, from: &Node, to: &Node) -> Edge {
        let machine = self.of.machine;
        let n = from.values.len();
        let goes_on = self.continued.iter().find(|(a, b, _)| *a == from.base && *b == to.base);
        let mut way = AxisValues::from_fn(n, |k| self.of.way(k, from.values[k], to.values[k]));
        // The free axis of either end turns there; on a link, to its wanted value.
        let loose = |k| self.from.free == Some(k) || (self.kind == SegmentKind::Link && self.to.free == Some(k));
        let Some((_, _, meant)) = goes_on else {
            let turns_free = self.kind == SegmentKind::Link && self.to.free.is_some();
            let change = if turns_free { self.rewound(&way, None, &loose) } else { Some(Change::Flip) };
            return Edge { change, way };
        };
        for k in (0..n).filter(|&k| machine.axes()[k].endless && !loose(k)) {
            way[k] = meant[k];
        }
        let leaves_beyond = self.kind == SegmentKind::Cut
            && self.from.free.is_some_and(|k| {
                let (axis, value) = (&machine.axes()[k], to.values[k] - meant[k]);
                value < axis.min || value > axis.max
            });
        let change = self.rewound(&way, Some(meant), &loose);
        Edge { change: if leaves_beyond { change.or(Some(Change::Flip)) } else { change }, way }
    }

    /// Returns the axis that makes the most full turns in addition to the ideal motion.
    fn rewound(&self, way: &AxisValues, meant: Option<&AxisValues>, loose: &dyn Fn(usize) -> bool) -> Option<Change> {
        let machine = self.of.machine;
        let turns = |k: usize| {
            let meant = meant.map_or_else(|| nearest_turn(way[k], 0.0), |m| m[k]);
            ((way[k] - meant) / std::f64::consts::TAU).round() as i32
        };
        let rotary = (0..way.len()).filter(|&k| machine.is_rotary(k) && !machine.axes()[k].endless && !loose(k));
        let most = rotary.map(|k| (k, turns(k))).max_by_key(|(k, turns)| (turns.abs(), std::cmp::Reverse(*k)))?;
        (most.1 != 0).then_some(Change::Rewind { axis: most.0, turns: most.1 })
    }

    /// Returns the weighted time of the slowest axis, s. Where a free stretch ends or begins only
    /// the rotary axes count.
    pub(crate) fn time(&self, way: &AxisValues) -> f64 {
        let only_rotary = self.from.free.is_some() || self.to.free.is_some();
        let axes = self.of.machine.axes();
        let machine = self.of.machine;
        let counted = (0..axes.len()).filter(|&k| machine.is_rotary(k) || !only_rotary && machine.moves_tool(k));
        counted.map(|k| self.weights[k] * way[k].abs() / axes[k].max_velocity).fold(0.0, f64::max)
    }
}
