//! Values of a tool by key, in mm, with every fault collected.

use crate::fault::ToolFault;
use crate::json_value::JsonValue;
use crate::remarks::ToolRemarks;

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

/// Differences of lengths, mm, that are rounding in the library.
pub(crate) const ROUNDING: f64 = 0.01;

/// Difference, mm, of a length and its expression that is rounding: Fusion writes six decimals or
/// more. Larger would let different tools pass.
const EXPRESSION_MM: f64 = 1e-3;

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

    /// Unit of a tool or holder: under `unit`, or, in older files, in its expressions. Both must
    /// agree: Fusion computes with the expression.
    pub(crate) fn unit(&self, remarks: &mut ToolRemarks) -> Option<LengthUnit> {
        let expression = self.expression("tool_unit");
        let (value, key) = match (self.given("unit"), expression) {
            (Some(own), _) => (own, "unit"),
            (None, Some(expression)) => (expression, "expressions.tool_unit"),
            (None, None) => return None,
        };
        let named = |value: &JsonValue| match value {
            JsonValue::Text(name) => LengthUnit::of(name),
            _ => None,
        };
        let Some(unit) = named(value) else {
            let fault = format!("is {}; it must be \"millimeters\" or \"inches\"", shown(value));
            remarks.fault(self.path_of(key), fault);
            return None;
        };
        match expression.map(|expression| (expression, named(expression))) {
            Some((expression, None)) => self.note_expression("tool_unit", expression, key, remarks),
            Some((expression, Some(other))) if other != unit => {
                let fault = format!(
                    "is {}, but {} is {}; save the tool in Fusion again",
                    shown(value),
                    self.path_of("expressions.tool_unit"),
                    shown(expression)
                );
                remarks.fault(self.path_of(key), fault);
            }
            _ => (),
        }
        Some(unit)
    }

    fn expression(&self, name: &str) -> Option<&'a JsonValue> {
        self.given("expressions")?.get(name).filter(|value| !matches!(value, JsonValue::Null))
    }

    /// Notes an expression that is not compared.
    fn note_expression(&self, name: &str, expression: &JsonValue, key: &str, remarks: &mut ToolRemarks) {
        let path = self.path_of(&format!("expressions.{name}"));
        remarks
            .note(format!("{path} is {}, which was not computed; {key} was not compared with it", shown(expression)));
    }

    /// Compares the length under a key, mm, with the expression that Fusion computes it from. A
    /// number without a unit is in the tool's; other expressions than numbers are noted.
    ///
    /// Fusion puts the expression's value in the place of the number when it reads the file, so a
    /// file in which they differ describes two tools.
    pub(crate) fn compare_length(
        &self,
        expression: &str,
        (key, mm): (&str, Option<f64>),
        unit: LengthUnit,
        remarks: &mut ToolRemarks,
    ) {
        let units = [("mm", LengthUnit::Millimetre), ("in", LengthUnit::Inch), ("", unit)];
        let number = |text: &str| {
            units.into_iter().find_map(|(suffix, unit)| Some(unit.to_mm(plain_number(text.strip_suffix(suffix)?)?)))
        };
        self.compare(expression, (key, mm), number, (" mm", EXPRESSION_MM), remarks);
    }

    /// Compares the number under a key with its expression, as [`Self::compare_length`] does. The
    /// expression may have this unit behind it.
    pub(crate) fn compare_number(
        &self,
        expression: &str,
        (key, value): (&str, Option<f64>),
        unit: &str,
        remarks: &mut ToolRemarks,
    ) {
        let number = |text: &str| plain_number(text.strip_suffix(unit).unwrap_or(text));
        self.compare(expression, (key, value), number, ("", EXPRESSION_MM), remarks);
    }

    fn compare(
        &self,
        name: &str,
        (key, value): (&str, Option<f64>),
        number: impl Fn(&str) -> Option<f64>,
        (unit, tolerance): (&str, f64),
        remarks: &mut ToolRemarks,
    ) {
        let Some(expression) = self.expression(name) else { return };
        let other = match expression {
            JsonValue::Text(text) => number(text.trim()),
            JsonValue::Number(value) => number(&value.to_string()),
            _ => None,
        };
        let Some(other) = other.filter(|other| other.is_finite()) else {
            self.note_expression(name, expression, key, remarks);
            return;
        };
        let is_same = value.map_or(other == 0.0, |value| (other - value).abs() <= tolerance);
        if is_same || remarks.has_fault_at(key) {
            return;
        }
        let given = value.map_or_else(|| "is missing".to_owned(), |value| format!("is {value}{unit}"));
        let path = self.path_of(&format!("expressions.{name}"));
        remarks.fault(
            key,
            format!("{given}, but {path} is {other}{unit}, which Fusion takes; save the tool in Fusion again"),
        );
    }
}

/// Returns a number without a unit.
fn plain_number(text: &str) -> Option<f64> {
    text.trim().parse().ok()
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
