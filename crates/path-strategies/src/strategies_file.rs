//! File of strategies to compare.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::Value;

/// File of strategies to compare, `"format": "facemill-strategies/1"`.
///
/// ```json
/// {
///   "format": "facemill-strategies/1",
///   "strategies": [
///     { "name": "levels", "settings": { "operations[0].path.strategy.edge_fill": false } }
///   ]
/// }
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StrategiesFile {
    /// Always `"facemill-strategies/1"`.
    pub format: StrategiesFormat,
    /// The strategies, in the order of the comparison.
    #[schemars(length(min = 1))]
    pub strategies: Vec<ListedStrategy>,
}

/// Format of a file of strategies.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[non_exhaustive]
pub enum StrategiesFormat {
    /// The first version.
    #[default]
    #[serde(rename = "facemill-strategies/1")]
    V1,
}

/// A strategy as values that replace those of the job.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ListedStrategy {
    /// Name in the comparison.
    pub name: String,
    /// Values by key, as `plan --set` takes them; `null` removes a key. Empty: the job as it is.
    #[serde(default)]
    pub settings: BTreeMap<String, Value>,
}
