use std::f64::consts::TAU;

use facemill_cl_data::ClPoint;

use crate::axes::axis_values::AxisValues;
use crate::inverse::nearest_turn;
use crate::machine::Machine;
use crate::path::choice::PathError;
use crate::path::follow::Base;
use crate::solver::inverse_solution::{InverseSolution, Unreachable};

/// A pose, or neighbouring poses in which the same rotary axis is free, with all possible positions
/// of the machine.
#[derive(Clone, Debug)]
pub(crate) struct Station {
    /// First and last pose.
    pub(crate) first: usize,
    pub(crate) last: usize,
    /// The free axis, where there is one.
    pub(crate) free: Option<usize>,
    pub(crate) bases: Vec<Base>,
    pub(crate) nodes: Vec<Node>,
}

/// A solution at a winding.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Node {
    pub(crate) base: usize,
    pub(crate) values: AxisValues,
}

/// Source of the stations.
#[derive(Clone, Copy)]
pub(crate) struct Poses<'a> {
    pub(crate) machine: &'a Machine,
    pub(crate) poses: &'a [ClPoint],
    pub(crate) tool_length: f64,
}

/// Largest number of positions at one pose.
const MOST_NODES: usize = 512;

/// Excess over a limit of a rotary axis that counts as rounding, rad.
const SLACK: f64 = 2e-13;

/// Stations along a path, one after the other.
pub(crate) struct Stations<'a> {
    of: Poses<'a>,
    reference: AxisValues,
    at: usize,
    ahead: Option<Station>,
}

impl<'a> Stations<'a> {
    /// Starts at the first pose; `reference` is the position of an axis that is free all along.
    pub(crate) fn new(of: Poses<'a>, reference: AxisValues) -> Self {
        Self { of, reference, at: 0, ahead: None }
    }

    /// Returns the station behind `previous`; `None` at the end.
    pub(crate) fn next(&mut self, previous: Option<&Station>) -> Result<Option<Station>, PathError> {
        let mut station = match self.ahead.take() {
            Some(station) => station,
            None if self.at < self.of.poses.len() => self.of.station(self.at)?,
            None => return Ok(None),
        };
        self.at = station.last + 1;
        if station.free.is_some() {
            if self.at < self.of.poses.len() {
                self.ahead = Some(self.of.station(self.at)?);
            }
            self.of.settle(&mut station, previous, self.ahead.as_ref(), &self.reference)?;
        }
        Ok(Some(station))
    }
}

impl Poses<'_> {
    fn bases(&self, index: usize) -> Result<Vec<Base>, PathError> {
        let bases = self.machine.bases(&self.poses[index], self.tool_length);
        bases.map_err(|reason| PathError::Unreachable { index, reason })
    }

    /// Returns the station that begins with a pose; with a free axis its values are still to be
    /// settled.
    fn station(&self, first: usize) -> Result<Station, PathError> {
        let bases = self.bases(first)?;
        // With three rotary axes a free axis stays at home: the others compensate, and where they
        // do is not followed.
        let free = bases.iter().find_map(|b| b.free_axis).filter(|_| bases[0].meets);
        let mut station = Station { first, last: first, free, bases, nodes: Vec::new() };
        let Some(axis) = free else {
            self.wind(&mut station)?;
            return Ok(station);
        };
        while station.last + 1 < self.poses.len() {
            let next = self.bases(station.last + 1)?;
            let same =
                |b: &Base| b.free_axis == Some(axis) && self.machine.same_rotaries(&b.values, &station.bases[0].values);
            if !next.iter().any(same) {
                break;
            }
            station.last += 1;
        }
        Ok(station)
    }

    /// Gives the free axis its values: those at which it arrives from the solutions before, and at
    /// which it leaves for the ones behind.
    fn settle(
        &self,
        station: &mut Station,
        previous: Option<&Station>,
        next: Option<&Station>,
        reference: &AxisValues,
    ) -> Result<(), PathError> {
        let pole = station.bases[0];
        let mut all: Vec<AxisValues> = Vec::new();
        let ends = previous.map(|s| (s, s.last, station.first)).into_iter();
        for (other, from, to) in ends.chain(next.map(|s| (s, s.first, station.last))) {
            for base in &other.bases {
                let way = ((&self.poses[from], base), (&self.poses[to], &pole));
                all.extend(self.machine.arrival(way.0, way.1, self.tool_length));
            }
        }
        if all.is_empty() {
            let mut values = pole.values;
            for k in (0..values.len()).filter(|&k| station.free == Some(k)) {
                values[k] = reference.get_or_zero(k);
            }
            all.push(values);
        }
        station.bases.clear();
        for values in all {
            if station.bases.iter().any(|b| self.machine.same_rotaries(&b.values, &values)) {
                continue;
            }
            if let Some(values) = self.at(station.first, &values) {
                let within = self.windings(&values).iter().any(|q| self.within(q).is_ok());
                station.bases.push(Base { values, within, ..pole });
            }
        }
        self.wind(station)
    }

    /// Returns the position at a pose with these rotary values.
    pub(crate) fn at(&self, index: usize, rotary: &AxisValues) -> Option<AxisValues> {
        self.machine.at_rotaries(&self.poses[index], self.tool_length, rotary)
    }

    /// Returns the values with rounding beyond a limit cut off.
    pub(crate) fn within(&self, q: &AxisValues) -> Result<AxisValues, Unreachable> {
        let solution = InverseSolution { values: *q, branch: self.machine.branch_of(q), free_axis: None };
        self.machine.within_limits(solution).map(|s| s.values)
    }

    /// Creates the nodes of the solutions that are within the limits.
    fn wind(&self, station: &mut Station) -> Result<(), PathError> {
        let index = station.first;
        for (base, of) in station.bases.iter().enumerate().filter(|(_, b)| b.within) {
            let wound = self.windings(&of.values).into_iter();
            let inside = wound.filter_map(|q| if station.free.is_none() { Some(q) } else { self.within(&q).ok() });
            station.nodes.extend(inside.map(|values| Node { base, values }));
        }
        if station.nodes.len() > MOST_NODES {
            return Err(PathError::TooManyWindings { index, found: station.nodes.len(), most: MOST_NODES });
        }
        if station.nodes.is_empty() {
            let inverse = self.machine.inverse(&self.poses[index], self.tool_length);
            return Err(PathError::Unreachable { index, reason: inverse.err().unwrap_or(Unreachable::Inaccurate) });
        }
        Ok(())
    }

    /// Returns all windings of the limited rotary axes.
    fn windings(&self, q: &AxisValues) -> Vec<AxisValues> {
        let mut all = vec![*q];
        for (k, axis) in self.machine.axes().iter().enumerate() {
            if !self.machine.is_rotary(k) || axis.endless {
                continue;
            }
            let value = q[k];
            let fewest = ((axis.min - SLACK - value) / TAU).ceil();
            let most = ((axis.max + SLACK - value) / TAU).floor();
            if fewest == 0.0 && most == 0.0 {
                continue;
            }
            let n_turns = (most - fewest + 1.0).clamp(0.0, (MOST_NODES + 1) as f64) as usize;
            let turned = |q: &AxisValues, turn: usize| {
                let mut q = *q;
                let turn = fewest + turn as f64;
                q[k] = if turn == 0.0 { value } else { (value + TAU * turn).clamp(axis.min, axis.max) };
                q
            };
            all = all.iter().flat_map(|q| (0..n_turns).map(|turn| turned(q, turn)).collect::<Vec<_>>()).collect();
        }
        all
    }

    /// Returns the way of an axis from one value to another, for an endless one the short way
    /// round.
    pub(crate) fn way(&self, axis: usize, from: f64, to: f64) -> f64 {
        if self.machine.axes()[axis].endless { nearest_turn(to, from) - from } else { to - from }
    }
}
