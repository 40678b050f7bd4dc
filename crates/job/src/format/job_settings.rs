//! Values that replace those of a job file for one run.

use std::fmt;
use std::str::FromStr;

use schemars::JsonSchema;
use serde::Serialize;
use serde_json::{Map, Value};

/// A value that replaces the job file's value of a key.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct JobSetting {
    /// The key as errors name it, such as `operations[0].tolerances.cusp_mm`.
    pub key: String,
    /// The value; `null` removes the key, so that its default applies.
    pub value: Value,
    /// The key, step by step.
    #[serde(skip)]
    #[schemars(skip)]
    steps: Vec<String>,
}

impl FromStr for JobSetting {
    type Err = String;

    /// Reads `KEY=VALUE`: the key as a JSON pointer (`/operations/0/tolerances/cusp_mm`) or as a
    /// path with dots (`operations[0].tolerances.cusp_mm`), the value as JSON, or as a string if it
    /// is not JSON.
    fn from_str(text: &str) -> Result<Self, String> {
        let (key, value) =
            text.split_once('=').ok_or("must be KEY=VALUE, as in operations[0].tolerances.cusp_mm=0.05")?;
        let steps = steps_of(key.trim())?;
        let value = serde_json::from_str(value).unwrap_or_else(|_| Value::String(value.to_owned()));
        Ok(Self { key: dotted(&steps), value, steps })
    }
}

impl fmt::Display for JobSetting {
    /// Writes the option that gave the setting.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "--set {}={}", self.key, self.value)
    }
}

impl JobSetting {
    /// Puts the value into a job, and adds missing objects on the path to it.
    ///
    /// # Errors
    /// If a step of the key leads nowhere: the message names the step.
    pub fn put_in(&self, job: &mut Value) -> Result<(), String> {
        let mut at = job;
        let (last, way) = self.steps.split_last().ok_or("the key is empty")?;
        for (k, step) in way.iter().enumerate() {
            at = child(at, step).map_err(|why| format!("{}: {why}", dotted(&self.steps[..=k])))?;
        }
        let failed = |why| format!("{}: {why}", self.key);
        match (&self.value, at) {
            (Value::Null, Value::Object(map)) => drop(map.remove(last)),
            (value, at) => *child(at, last).map_err(failed)? = value.clone(),
        }
        Ok(())
    }

    /// Returns whether a message is about the value under the key, or about its parent.
    pub fn is_meant_by(&self, message: &str) -> bool {
        let goes_on = |key: &str, with: &[char]| message.strip_prefix(key).is_some_and(|rest| rest.starts_with(with));
        let holds = |n: usize| goes_on(&dotted(&self.steps[..n]), &[':', ',', ' ']);
        goes_on(&self.key, &['.', '[', ':', ',', ' ']) || (1..self.steps.len()).any(holds)
    }
}

/// Returns the value under a step, added if an object lacks it.
fn child<'v>(at: &'v mut Value, step: &str) -> Result<&'v mut Value, String> {
    if at.is_null() {
        *at = Value::Object(Map::new());
    }
    match at {
        Value::Object(map) => Ok(map.entry(step).or_insert(Value::Null)),
        Value::Array(list) => {
            let n = list.len();
            let index =
                step.parse::<usize>().map_err(|_| format!("is a list of {n}; name one by its number from 0"))?;
            list.get_mut(index).ok_or_else(|| format!("does not exist: the list has {n}, counted from 0"))
        }
        _ => Err("is in a value that has no keys".to_owned()),
    }
}

fn steps_of(key: &str) -> Result<Vec<String>, String> {
    let steps: Vec<String> = match key.strip_prefix('/') {
        Some(pointer) => pointer.split('/').map(|step| step.replace("~1", "/").replace("~0", "~")).collect(),
        None => key.replace('[', ".").replace(']', "").split('.').map(str::to_owned).collect(),
    };
    if steps.iter().any(String::is_empty) {
        return Err(format!(
            "\"{key}\" is not a key; give it as operations[0].tolerances.cusp_mm or as a JSON pointer"
        ));
    }
    Ok(steps)
}

fn dotted(steps: &[String]) -> String {
    let mut key = String::new();
    for step in steps {
        match (step.parse::<usize>(), key.is_empty()) {
            (Ok(index), false) => key.push_str(&format!("[{index}]")),
            (_, true) => key.push_str(step),
            (_, false) => key.push_str(&format!(".{step}")),
        }
    }
    key
}

#[cfg(test)]
#[path = "../../tests/unit/format/job_settings.rs"]
mod tests;
