//! Strategies that a job can be planned by, for comparison.

use std::collections::BTreeSet;

use facemill_cc_path::files::{ConstantScallopFile, SeedFile, SeedPlaneFile, StrategyFile};
use facemill_file_format::{FormatError, from_json, from_value};
use facemill_job::failure::Failure;
use facemill_job::format::job_file::{DirectionFile, JobFile, LevelOrderFile, LinkingFile, PathFile, PathFromStrategy};
use facemill_job::format::job_settings::JobSetting;
use facemill_job::load::job::Job;
use serde_json::Value;

use crate::candidates::candidates_of_operations;
use crate::directions::DIRECTIONS;
use crate::flows::{RegionFlows, range_of, spiral_over};
use crate::strategies_file::StrategiesFile;

/// A strategy for all operations of a job.
#[derive(Clone, Debug)]
pub struct NamedStrategy {
    /// Its name.
    pub name: String,
    /// The job with it.
    pub file: JobFile,
}

/// Reads a file of strategies, and puts each into the job.
///
/// # Errors
/// If it is none, has no strategy or a name twice, or a key leads nowhere; the message names the
/// strategy. A job that is wrong with its values is no error here, but has no plan.
pub fn listed_strategies(job: &Job, bytes: &[u8]) -> Result<Vec<NamedStrategy>, String> {
    let file: StrategiesFile = from_json(bytes).map_err(|e: FormatError| e.to_string())?;
    if file.strategies.is_empty() {
        return Err("strategies: there are none; give at least one".to_owned());
    }
    let mut names = BTreeSet::new();
    let mut found = Vec::new();
    for (k, listed) in file.strategies.into_iter().enumerate() {
        let at = |why: String| format!("strategies[{k}] (\"{}\"): {why}", listed.name);
        if !names.insert(listed.name.clone()) {
            return Err(at("its name is there twice".to_owned()));
        }
        let mut value = serde_json::to_value(&job.file).map_err(|e| at(e.to_string()))?;
        for (key, to) in &listed.settings {
            let setting: JobSetting = format!("{key}={to}").parse().map_err(at)?;
            setting.put_in(&mut value).map_err(at)?;
        }
        let file = from_value(value).map_err(|e| at(e.to_string()))?;
        found.push(NamedStrategy { name: listed.name, file });
    }
    Ok(found)
}

/// Returns the strategies that a job can be planned by without more data: its own, levels and edge
/// fill, parallel planes along, across and diagonal to the region and, where that is another
/// direction, as the rotary axes move least, with edge fill and without (`levels`), constant
/// scallop from the region's border, and from its middle along and across, and, where two mesh
/// groups beside the region or ends of its levels bound them, flows whose passes run along and
/// across it, and a spiral over closed levels of one; each in both orders and, with direction
/// `either`, one-way and zigzag. Operations with a path file keep it. Equal ones come once.
///
/// # Errors
/// If the job lays no passes.
pub fn default_strategies(job: &Job) -> Result<Vec<NamedStrategy>, Failure> {
    let candidates = candidates_of_operations(job)?;
    let mut found = vec![NamedStrategy { name: "job".to_owned(), file: job.file.clone() }];
    let mut bases: Vec<(String, Change<'_>)> = vec![
        ("levels".to_owned(), Box::new(|_, s| s.edge_fill = false)),
        ("edge fill".to_owned(), Box::new(|_, s| s.edge_fill = true)),
    ];
    for (of, edge_fill) in [("planes", true), ("levels", false)] {
        for direction in DIRECTIONS {
            let candidates = &candidates;
            let change: Change<'_> = Box::new(move |k, s| {
                let planes = candidates[k].planes.iter().find(|p| p.direction == direction);
                if let Some(planes) = planes.filter(|_| takes_range(s)) {
                    s.strategy = StrategyFile::ParallelPlanes(planes.file.clone());
                    s.edge_fill = edge_fill;
                }
            });
            bases.push((format!("{of} {direction}"), change));
        }
    }
    let from_border: Change<'_> = Box::new(|_, s| s.strategy = constant_scallop(SeedFile::Border, &s.strategy));
    bases.push(("constant scallop".to_owned(), from_border));
    for direction in &DIRECTIONS[..2] {
        let candidates = &candidates;
        let change: Change<'_> = Box::new(move |k, s| {
            if let Some(planes) = candidates[k].planes.iter().find(|p| p.direction == *direction) {
                let plane = SeedPlaneFile { normal: planes.file.normal, origin_mm: planes.middle };
                s.strategy = constant_scallop(SeedFile::Plane(plane), &s.strategy);
            }
        });
        bases.push((format!("constant scallop {direction}"), change));
    }
    type OfFlows = fn(&RegionFlows) -> Option<StrategyFile>;
    let of_flows: [(&str, OfFlows); 3] = [
        ("flow along", |flows| flows.along.clone().map(StrategyFile::Flow)),
        ("flow across", |flows| flows.across.clone().map(StrategyFile::Flow)),
        ("spiral", |flows| flows.closed.clone().map(spiral_over)),
    ];
    for (name, strategy) in of_flows {
        let candidates = &candidates;
        let change: Change<'_> = Box::new(move |k, s| {
            if let Some(strategy) = strategy(&candidates[k].flows).filter(|_| takes_range(s)) {
                s.strategy = strategy;
            }
        });
        bases.push((name.to_owned(), change));
    }
    for (name, change) in &bases {
        add_orders(&mut found, &with(&job.file, change), name);
    }
    Ok(without_repetitions(found))
}

/// Change of the strategy of an operation, by its index in the job.
type Change<'c> = Box<dyn Fn(usize, &mut PathFromStrategy) + 'c>;

/// Moves the range of a strategy that is replaced to its region; returns false, and changes
/// nothing, where the region has one, because a region between two ranges cannot be written.
fn takes_range(s: &mut PathFromStrategy) -> bool {
    let range = range_of(&s.strategy);
    let is_free = s.region.between.is_none() || range.is_none();
    if is_free {
        s.region.between = s.region.between.take().or(range);
    }
    is_free
}

/// Returns a job with the strategies of its operations changed.
fn with(file: &JobFile, change: &dyn Fn(usize, &mut PathFromStrategy)) -> JobFile {
    let mut file = file.clone();
    for (k, operation) in file.operations.iter_mut().enumerate() {
        if let PathFile::Strategy(strategy) = &mut operation.path {
            change(k, strategy);
        }
    }
    file
}

/// Adds a strategy in both orders, one-way and, where it is permitted, zigzag.
fn add_orders(found: &mut Vec<NamedStrategy>, file: &JobFile, name: &str) {
    let is_free = file.operations.iter().all(|o| o.direction == DirectionFile::Either);
    let linkings = [(LinkingFile::OneWay, ""), (LinkingFile::Zigzag, " zigzag")];
    for (linking, linked) in linkings.into_iter().filter(|(linking, _)| is_free || *linking == LinkingFile::OneWay) {
        for (is_reversed, reversed) in [(false, ""), (true, " reversed")] {
            let change = |_: usize, s: &mut PathFromStrategy| {
                s.linking = linking;
                s.order = if is_reversed { other(s.order) } else { s.order };
            };
            found.push(NamedStrategy { name: format!("{name}{linked}{reversed}"), file: with(file, &change) });
        }
    }
}

fn other(order: LevelOrderFile) -> LevelOrderFile {
    match order {
        LevelOrderFile::Increasing => LevelOrderFile::Decreasing,
        LevelOrderFile::Decreasing => LevelOrderFile::Increasing,
    }
}

/// Removes strategies whose job an earlier one has, too.
fn without_repetitions(all: Vec<NamedStrategy>) -> Vec<NamedStrategy> {
    let mut seen: Vec<Value> = Vec::new();
    let is_new = |strategy: &NamedStrategy| {
        let value = serde_json::to_value(&strategy.file).unwrap_or_default();
        let is_new = !seen.contains(&value);
        seen.push(value);
        is_new
    };
    all.into_iter().filter(is_new).collect()
}

/// Returns constant scallop between the levels of the strategy in whose place it comes. It needs no
/// more than the region; flows and spirals need ends, edges and roots a line and a width.
fn constant_scallop(seed: SeedFile, in_place_of: &StrategyFile) -> StrategyFile {
    StrategyFile::ConstantScallop(ConstantScallopFile { seed, second_seed: None, within: range_of(in_place_of) })
}

#[cfg(test)]
#[path = "../tests/unit/strategies.rs"]
mod tests;
