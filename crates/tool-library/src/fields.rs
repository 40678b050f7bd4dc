//! Values of a tool by key, in mm, with every fault collected.

use crate::fault::ToolFault;
use crate::json_value::JsonValue;

/// Unit of the lengths of a tool or holder.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum LengthUnit {
    Millimetre,
    Inch,
}

impl LengthUnit {
    /// Reads the name of a unit, also in the single quotes of an expression.
    fn of(name: &str) -> Option<Self> {
        match name.trim().trim_matches('\'').trim().to_ascii_lowercase().as_str() {
            "millimeters" | "millimeter" | "mm" => Some(Self::Millimetre),
            "inches" | "inch" | "in" => Some(Self::Inch),
            _ => None,
        }
    }

    /// Returns the mm of one of it.
    fn mm(self) -> f64 {
        match self {
            Self::Millimetre => 1.0,
            Self::Inch => 25.4,
        }
    }

    pub(crate) fn symbol(self) -> &'static str {
        match self {
            Self::Millimetre => "mm",
            Self::Inch => "in",
        }
    }

    /// Returns a number of this unit in mm. A billionth of a millimetre is far below anything
    /// measured and above the noise of the product, which would fill files with digits.
    pub(crate) fn to_mm(self, value: f64) -> f64 {
        rounded(value * self.mm())
    }
}

/// Rounds to 1e-9.
pub(crate) fn rounded(value: f64) -> f64 {
    (value * 1e9).round() / 1e9
}

/// Longest length of a tool, mm, as of tool files.
pub(crate) const MOST_MM: f64 = 1e4;

/// Smallest diameter of a section, mm, as of tool files.
pub(crate) const LEAST_DIAMETER_MM: f64 = 0.01;

/// Reader of the values of one tool or of a part of it. Keys are reported with the path to them.
pub(crate) struct Fields<'a> {
    value: Option<&'a JsonValue>,
    path: String,
}

impl<'a> Fields<'a> {
    /// The tool itself.
    pub(crate) fn of(value: &'a JsonValue) -> Self {
        Self { value: Some(value), path: String::new() }
    }

    /// Part of it under a key, with no values where the key is missing.
    pub(crate) fn part(&self, key: &str, faults: &mut Vec<ToolFault>) -> Fields<'a> {
        let path = self.path_of(key);
        let value = self.given(key);
        if let Some(other) = value.filter(|value| !matches!(value, JsonValue::Object(_))) {
            faults.push(ToolFault::new(&path, format!("is {}; it must be an object", other.kind())));
            return Fields { value: None, path };
        }
        Fields { value, path }
    }

    /// Parts in the list under a key.
    pub(crate) fn parts(&self, key: &str, faults: &mut Vec<ToolFault>) -> Vec<Fields<'a>> {
        let path = self.path_of(key);
        match self.given(key) {
            None => Vec::new(),
            Some(JsonValue::List(all)) => {
                let part = |(k, value)| Fields { value: Some(value), path: format!("{path}[{k}]") };
                all.iter().enumerate().map(part).collect()
            }
            Some(other) => {
                faults.push(ToolFault::new(path, format!("is {}; it must be a list", other.kind())));
                Vec::new()
            }
        }
    }

    pub(crate) fn is_missing(&self) -> bool {
        self.value.is_none()
    }

    pub(crate) fn path(&self) -> &str {
        &self.path
    }

    pub(crate) fn path_of(&self, key: &str) -> String {
        if self.path.is_empty() { key.to_owned() } else { format!("{}.{key}", self.path) }
    }

    /// Value of a key; an empty one counts as missing.
    fn given(&self, key: &str) -> Option<&'a JsonValue> {
        self.value?.get(key).filter(|value| !matches!(value, JsonValue::Null))
    }

    /// Number of a key.
    pub(crate) fn number(&self, key: &str, faults: &mut Vec<ToolFault>) -> Option<f64> {
        match self.given(key)? {
            JsonValue::Number(value) => Some(*value),
            other => {
                faults.push(ToolFault::new(self.path_of(key), format!("is {}; it must be a number", shown(other))));
                None
            }
        }
    }

    /// Number of a key that is at least 0.
    pub(crate) fn amount(&self, key: &str, faults: &mut Vec<ToolFault>) -> Option<f64> {
        let value = self.number(key, faults)?;
        if (0.0..=1e9).contains(&value) {
            return Some(value);
        }
        faults.push(ToolFault::new(self.path_of(key), format!("is {value}; it must be a number from 0 to 1e9")));
        None
    }

    /// Whole number of a key within limits.
    pub(crate) fn count(&self, key: &str, most: u32, faults: &mut Vec<ToolFault>) -> Option<u32> {
        let value = self.number(key, faults)?;
        if value.fract() == 0.0 && (1.0..=f64::from(most)).contains(&value) {
            return Some(value as u32);
        }
        let fault = format!("is {value}; it must be a whole number from 1 to {most}");
        faults.push(ToolFault::new(self.path_of(key), fault));
        None
    }

    /// Length of a key, mm, at least `least` mm.
    pub(crate) fn length(
        &self,
        key: &str,
        unit: LengthUnit,
        least_mm: f64,
        faults: &mut Vec<ToolFault>,
    ) -> Option<f64> {
        let value = self.number(key, faults)?;
        let mm = unit.to_mm(value);
        if (least_mm..=MOST_MM).contains(&mm) {
            return Some(mm);
        }
        let range = if least_mm > 0.0 { format!("from {least_mm}") } else { "from 0".to_owned() };
        let fault = format!("is {value} {}; it must be a length {range} to {MOST_MM} mm", unit.symbol());
        faults.push(ToolFault::new(self.path_of(key), fault));
        None
    }

    /// Length of a key that must be there.
    pub(crate) fn needed_length(
        &self,
        key: &str,
        unit: LengthUnit,
        least_mm: f64,
        meaning: &str,
        faults: &mut Vec<ToolFault>,
    ) -> Option<f64> {
        if self.given(key).is_none() {
            faults.push(ToolFault::new(self.path_of(key), format!("is missing; enter the {meaning} in Fusion")));
            return None;
        }
        self.length(key, unit, least_mm, faults)
    }

    /// Text of a key, without blanks at its ends and without control characters.
    pub(crate) fn text(&self, key: &str) -> Option<String> {
        let JsonValue::Text(text) = self.given(key)? else { return None };
        let clean: String = text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
        let clean = clean.split_whitespace().collect::<Vec<_>>().join(" ");
        (!clean.is_empty()).then_some(clean)
    }

    /// Truth of a key.
    pub(crate) fn truth(&self, key: &str, faults: &mut Vec<ToolFault>) -> Option<bool> {
        match self.given(key)? {
            JsonValue::Bool(value) => Some(*value),
            other => {
                faults
                    .push(ToolFault::new(self.path_of(key), format!("is {}; it must be true or false", shown(other))));
                None
            }
        }
    }

    /// Unit of a tool or holder: under `unit`, or, in older files, in its expressions.
    pub(crate) fn unit(&self, faults: &mut Vec<ToolFault>) -> Option<LengthUnit> {
        let own = self.given("unit");
        let (value, path) = match own {
            Some(value) => (Some(value), self.path_of("unit")),
            None => {
                let expression = self.given("expressions").and_then(|all| all.get("tool_unit"));
                (expression, self.path_of("expressions.tool_unit"))
            }
        };
        let value = value?;
        let unit = match value {
            JsonValue::Text(name) => LengthUnit::of(name),
            _ => None,
        };
        if unit.is_none() {
            faults.push(ToolFault::new(path, format!("is {}; it must be \"millimeters\" or \"inches\"", shown(value))));
        }
        unit
    }

    /// Compares a length with the expression that Fusion computes it from, where that is a number
    /// with a unit and nothing else.
    ///
    /// Fusion puts the expression's value in the place of the number when it reads the file, so a
    /// file in which they differ describes two tools.
    pub(crate) fn compare_expression(&self, expression: &str, key: &str, mm: f64, faults: &mut Vec<ToolFault>) {
        let Some(JsonValue::Text(text)) = self.given("expressions").and_then(|all| all.get(expression)) else { return };
        let text = text.trim();
        let in_unit = [("mm", LengthUnit::Millimetre), ("in", LengthUnit::Inch)];
        let literal = in_unit
            .into_iter()
            .find_map(|(suffix, unit)| Some(unit.to_mm(text.strip_suffix(suffix)?.trim().parse::<f64>().ok()?)));
        // Fusion writes numbers of expressions with six decimals or more.
        if let Some(other) = literal.filter(|other| other.is_finite() && (other - mm).abs() > 1e-3 + 1e-4 * mm) {
            let fault = format!(
                "is {mm} mm, but {} is {other} mm, which Fusion takes instead; save the tool in Fusion again",
                self.path_of(&format!("expressions.{expression}"))
            );
            faults.push(ToolFault::new(key, fault));
        }
    }
}

/// Returns a wrong value for a message: short texts themselves, of others the kind.
fn shown(value: &JsonValue) -> String {
    match value {
        JsonValue::Text(text) if text.chars().count() <= 40 => format!("the text {text:?}"),
        JsonValue::Bool(value) => value.to_string(),
        JsonValue::Number(value) => value.to_string(),
        other => other.kind().to_owned(),
    }
}
