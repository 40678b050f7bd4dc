//! Format of a batch, `"format": "facemill-batch/1"`.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::Value;

/// Batch of tasks, `"format": "facemill-batch/1"`. Each task is one setup of one job, or of one
/// variant of a job.
///
/// ```json
/// {
///   "format": "facemill-batch/1",
///   "jobs": {
///     "sweep": {
///       "job": "job.json",
///       "axes": [
///         { "name": "cusp", "values": { "each": { "key": "operations[0].tolerances.cusp_mm", "values": [0.05, 0.1] } } }
///       ]
///     }
///   }
/// }
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BatchFile {
    /// Always `"facemill-batch/1"`.
    pub format: BatchFormat,
    /// Jobs of the batch.
    pub jobs: JobsFile,
    /// Work on each setup. Default: `plan`.
    #[serde(default)]
    pub task: TaskKindFile,
}

/// Format of a batch.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[non_exhaustive]
pub enum BatchFormat {
    /// The first version.
    #[default]
    #[serde(rename = "facemill-batch/1")]
    V1,
}

/// Jobs of a batch. Names are relative to the batch file; files outside its folder are refused
/// without `--allow-outside`, after links are resolved.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum JobsFile {
    /// Job files, or folders with `job.json`.
    List(#[schemars(length(min = 1))] Vec<String>),
    /// All job files or folders that match a pattern, in the order of their names: `*` matches any
    /// run of characters within one name, as in `jobs/*/job.json`.
    Pattern(String),
    /// Variants of one job.
    Sweep(SweepFile),
}

/// Variants of one job.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SweepFile {
    /// Job file, or folder with `job.json`.
    pub job: String,
    /// Axes of variation; of two axes that set one key the later one counts.
    #[schemars(length(min = 1))]
    pub axes: Vec<AxisFile>,
    /// Combination of the axes. Default: `grid`.
    #[serde(default)]
    pub combine: CombineFile,
}

/// Combination of axes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum CombineFile {
    /// Every value of each axis with every value of all others; the last axis changes fastest.
    #[default]
    Grid,
    /// The first values of all axes, then the second ones, and so on: all axes have the same number
    /// of values.
    List,
    /// Values drawn independently for each axis and variant.
    Sample(SampleFile),
}

/// Random sample of variants.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SampleFile {
    /// Number of variants.
    #[schemars(range(min = 1))]
    pub variants: usize,
    /// Seed: the same seed gives the same variants on every machine, and more variants begin with
    /// the same ones.
    pub seed: u64,
}

/// Axis of variation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AxisFile {
    /// Name in tables; the names of all axes differ.
    pub name: String,
    /// Its values.
    pub values: AxisValuesFile,
}

/// Values of an axis.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum AxisValuesFile {
    /// Values of one key, each labelled by itself.
    Each(EachFile),
    /// Values that set several keys at once, such as a tool and its feeds.
    Labelled(#[schemars(length(min = 1))] Vec<LabelledFile>),
    /// Numbers of one key from an interval.
    Range(RangeFile),
}

/// Values of one key.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct EachFile {
    /// Key of the job, as `plan --set` takes it: `operations[0].tolerances.cusp_mm`, or a JSON
    /// pointer.
    pub key: String,
    /// Values; `null` removes the key.
    #[schemars(length(min = 1))]
    pub values: Vec<Value>,
}

/// Value that sets several keys.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LabelledFile {
    /// Name in tables; the labels of one axis differ.
    pub label: String,
    /// Values by key, as `plan --set` takes them; `null` removes a key. Empty: the job as it is.
    #[serde(default)]
    pub settings: BTreeMap<String, Value>,
}

/// Numbers from an interval.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RangeFile {
    /// Key of the job, as `plan --set` takes it.
    pub key: String,
    /// Least number.
    pub from: f64,
    /// Largest number, not below `from`.
    pub to: f64,
    /// Count of numbers at equal distances, both ends among them; a sample draws from the whole
    /// interval and needs no count.
    #[schemars(range(min = 1))]
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub count: Option<usize>,
}

/// Work on each setup.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum TaskKindFile {
    /// Plan it.
    Plan(PlanTaskFile),
    /// Run programs on the virtual machine in it, one task each.
    Verify(VerifyTaskFile),
    /// Find the shortest tool assembly for programs, one task each.
    Lengths(LengthsTaskFile),
}

impl Default for TaskKindFile {
    fn default() -> Self {
        Self::Plan(PlanTaskFile::default())
    }
}

/// Options of planning.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct PlanTaskFile {
    /// Run the written program on the virtual machine, and cut the stock.
    pub verify: bool,
    /// Prove the motion of every block between its ends.
    pub certificates: bool,
    /// Write the table of chips.
    pub chips: bool,
    /// Distance of the lines of the stock. Default: as the job says.
    #[schemars(extend("exclusiveMinimum" = 0))]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stock_cell_mm: Option<f64>,
}

impl Default for PlanTaskFile {
    fn default() -> Self {
        Self { verify: true, certificates: false, chips: false, stock_cell_mm: None }
    }
}

/// Options of verification, as `facemill verify` has them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct VerifyTaskFile {
    /// Pattern of the programs, as of jobs: `programs/*.nc`.
    pub programs: String,
    /// Prove the motion of every block between its ends.
    #[serde(default)]
    pub certificates: bool,
    /// Cut the stock on lines so far apart. Default: the stock is not cut.
    #[schemars(extend("exclusiveMinimum" = 0))]
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stock_cell_mm: Option<f64>,
}

/// Options of the search for lengths, as `facemill lengths` has them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LengthsTaskFile {
    /// Pattern of the programs, as of jobs: `programs/*.nc`.
    pub programs: String,
    /// Margin of every forced length above the least free one.
    #[schemars(range(min = 0))]
    #[serde(default = "default_margin_mm")]
    pub margin_mm: f64,
    /// Upper limit of all lengths.
    #[schemars(range(min = 0))]
    #[serde(default = "default_longest_mm")]
    pub longest_mm: f64,
    /// Cut the stock on lines so far apart. Default: the stock is not cut.
    #[schemars(extend("exclusiveMinimum" = 0))]
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stock_cell_mm: Option<f64>,
}

fn default_margin_mm() -> f64 {
    0.5
}

fn default_longest_mm() -> f64 {
    1000.0
}
