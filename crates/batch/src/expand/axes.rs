//! Axes of variation and their combinations.

use std::collections::{BTreeMap, BTreeSet};
use std::str::FromStr;

use facemill_cl_data::mixed_bits;
use facemill_job::format::job_settings::JobSetting;
use serde_json::{Value, json};

use crate::format::batch_file::{AxisFile, AxisValuesFile, CombineFile, RangeFile, SampleFile, SweepFile};
use crate::format::report_file::{FIGURE_HEADINGS, TASK_HEADINGS};

/// Value of an axis in a variant.
#[derive(Clone, Debug, PartialEq)]
pub struct AxisValue {
    /// Name of the axis.
    pub axis: String,
    /// Label of the value.
    pub label: String,
    /// Values by key of the job.
    pub settings: BTreeMap<String, Value>,
}

/// Variants of a job, each computed from its index. The default has one, the job as it is.
#[derive(Clone, Debug)]
pub struct Variants {
    axes: Vec<Axis>,
    combine: CombineFile,
    n: usize,
}

#[derive(Clone, Debug)]
enum Axis {
    Listed(Vec<AxisValue>),
    /// Numbers of an interval: `n` of them at equal distances, or drawn by a sample.
    Range {
        name: String,
        range: RangeFile,
        n: usize,
    },
}

impl Default for Variants {
    fn default() -> Self {
        Self { axes: Vec::new(), combine: CombineFile::Grid, n: 1 }
    }
}

impl Variants {
    /// Returns the number of variants.
    pub(crate) fn len(&self) -> usize {
        self.n
    }

    /// Returns the values of a variant in the order of the axes. In a grid the last axis changes
    /// fastest.
    pub(crate) fn variant(&self, index: usize) -> Vec<AxisValue> {
        let mut chosen = Vec::with_capacity(self.axes.len());
        let mut rest = index;
        for (k, axis) in self.axes.iter().enumerate().rev() {
            let random = match self.combine {
                CombineFile::Sample(SampleFile { seed, .. }) => draw(seed, index as u64, k as u64),
                CombineFile::Grid | CombineFile::List => 0,
            };
            let place = match self.combine {
                CombineFile::Grid => rest % n_values(axis),
                CombineFile::List => index,
                CombineFile::Sample(_) => below(random, n_values(axis)),
            };
            rest /= n_values(axis);
            chosen.push(match (axis, self.combine) {
                (Axis::Listed(values), _) => values[place].clone(),
                (Axis::Range { name, range, .. }, CombineFile::Sample(_)) => {
                    // 53 bits are all that a number has.
                    let share = (random >> 11) as f64 / (1u64 << 53) as f64;
                    number(name, &range.key, range.from + (range.to - range.from) * share)
                }
                (Axis::Range { name, range, n }, _) => number(name, &range.key, evenly(range, *n, place)),
            });
        }
        chosen.reverse();
        chosen
    }
}

/// Returns the names of a sweep's axes.
pub(crate) fn axis_names(sweep: &SweepFile) -> Vec<String> {
    sweep.axes.iter().map(|axis| axis.name.clone()).collect()
}

/// Returns the variants of a sweep.
///
/// # Errors
/// If names or labels are not distinct, a key is none, an axis has no value, or the axes do not fit
/// their combination; the message names the field.
pub(crate) fn variants(sweep: &SweepFile) -> Result<Variants, String> {
    let is_sample = matches!(sweep.combine, CombineFile::Sample(_));
    let mut names = BTreeSet::new();
    let mut axes = Vec::new();
    for (k, axis) in sweep.axes.iter().enumerate() {
        let at = |why: String| format!("jobs.sweep.axes[{k}].{why}");
        if axis.name.is_empty() || !names.insert(&axis.name) {
            return Err(at(format!("name: \"{}\" is empty or the name of another axis", axis.name)));
        }
        if TASK_HEADINGS.iter().chain(&FIGURE_HEADINGS).any(|heading| *heading == axis.name) {
            return Err(at(format!("name: \"{}\" is the heading of another column of reports", axis.name)));
        }
        axes.push(axis_of(axis, is_sample).map_err(at)?);
    }
    if axes.is_empty() {
        return Err("jobs.sweep.axes: there are none; give at least one".to_owned());
    }
    let n = match sweep.combine {
        CombineFile::Sample(SampleFile { variants: 0, .. }) => {
            return Err("jobs.sweep.combine.sample.variants: must be at least 1".to_owned());
        }
        CombineFile::Sample(SampleFile { variants, .. }) => variants,
        CombineFile::Grid => axes.iter().map(n_values).fold(1, usize::saturating_mul),
        CombineFile::List => {
            let n = n_values(&axes[0]);
            if let Some(k) = axes.iter().position(|axis| n_values(axis) != n) {
                let other = n_values(&axes[k]);
                let why = format!("values: has {other} values and the first axis {n}; `list` needs equal numbers");
                return Err(format!("jobs.sweep.axes[{k}].{why}"));
            }
            n
        }
    };
    Ok(Variants { axes, combine: sweep.combine, n })
}

fn n_values(axis: &Axis) -> usize {
    match axis {
        Axis::Listed(values) => values.len(),
        Axis::Range { n, .. } => *n,
    }
}

fn axis_of(axis: &AxisFile, is_sample: bool) -> Result<Axis, String> {
    let values = match &axis.values {
        AxisValuesFile::Each(each) => {
            let field = "values.each";
            check_key(&each.key).map_err(|why| format!("{field}.key: {why}"))?;
            let value = |value: &Value| AxisValue {
                axis: axis.name.clone(),
                label: label(value),
                settings: BTreeMap::from([(each.key.clone(), value.clone())]),
            };
            distinct(field, each.values.iter().map(value).collect())?
        }
        AxisValuesFile::Labelled(listed) => {
            for (k, value) in listed.iter().enumerate() {
                let at = |why: String| format!("values.labelled[{k}].settings: {why}");
                value.settings.keys().try_for_each(|key| check_key(key)).map_err(at)?;
            }
            let value = |value: &crate::format::batch_file::LabelledFile| AxisValue {
                axis: axis.name.clone(),
                label: value.label.clone(),
                settings: value.settings.clone(),
            };
            distinct("values.labelled", listed.iter().map(value).collect())?
        }
        AxisValuesFile::Range(range) => {
            check_key(&range.key).map_err(|why| format!("values.range.key: {why}"))?;
            if !(range.from <= range.to && (range.to - range.from).is_finite()) {
                return Err(format!("values.range: must go from a number to one not below it, is {range:?}"));
            }
            let n = match (is_sample, range.count) {
                (true, _) => 1,
                (false, None | Some(0)) => {
                    return Err("values.range.count: is missing or 0; only a sample goes without it".to_owned());
                }
                (false, Some(n)) if n > 1 && range.from == range.to => {
                    return Err(format!("values.range.count: has {n} values, but from and to are one number"));
                }
                (false, Some(n)) => n,
            };
            return Ok(Axis::Range { name: axis.name.clone(), range: range.clone(), n });
        }
    };
    Ok(Axis::Listed(values))
}

/// Returns number `k` of `n` numbers at equal distances, both ends among them.
fn evenly(range: &RangeFile, n: usize, k: usize) -> f64 {
    match (k, n - 1) {
        (0, _) => range.from,
        (k, last) if k == last => range.to,
        (k, last) => range.from + (range.to - range.from) * (k as f64 / last as f64),
    }
}

fn number(axis: &str, key: &str, value: f64) -> AxisValue {
    let settings = BTreeMap::from([(key.to_owned(), json!(value))]);
    AxisValue { axis: axis.to_owned(), label: value.to_string(), settings }
}

/// Returns a value's label: a string as it is, anything else as JSON.
fn label(value: &Value) -> String {
    value.as_str().map_or_else(|| value.to_string(), str::to_owned)
}

fn distinct(field: &str, values: Vec<AxisValue>) -> Result<Vec<AxisValue>, String> {
    let mut labels = BTreeSet::new();
    if let Some(twice) = values.iter().find(|value| !labels.insert(&value.label)) {
        return Err(format!("{field}: the value \"{}\" is there twice", twice.label));
    }
    if values.is_empty() {
        return Err(format!("{field}: there are no values; give at least one"));
    }
    Ok(values)
}

fn check_key(key: &str) -> Result<(), String> {
    if key.contains('=') {
        return Err(format!("\"{key}\" has a =, which no key has"));
    }
    JobSetting::from_str(&format!("{key}=null")).map(drop)
}

/// Returns a random number of a seed for a variant and an axis: every place has a number of its
/// own, whatever is drawn before.
fn draw(seed: u64, variant: u64, axis: u64) -> u64 {
    mixed_bits(mixed_bits(mixed_bits(seed) ^ variant) ^ axis)
}

/// Returns an index below `n` from a random number; biased by less than `n` / 2⁶⁴.
fn below(random: u64, n: usize) -> usize {
    ((u128::from(random) * n as u128) >> 64) as usize
}

#[cfg(test)]
#[path = "../../tests/unit/expand/axes.rs"]
mod tests;
