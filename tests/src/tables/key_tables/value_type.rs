//! Kind of a value in a schema, and its words.

use serde_json::Value;

use super::text::number;

/// Units by the endings of keys, the longer endings first.
const UNITS: [(&str, &str); 20] = [
    ("_deg_per_mm", "deg/mm"),
    ("_cm3_min", "cm³/min"),
    ("_mm3_min", "mm³/min"),
    ("_deg_min", "deg/min"),
    ("_mm_min", "mm/min"),
    ("_deg_s2", "deg/s²"),
    ("_deg_s3", "deg/s³"),
    ("_mm_s2", "mm/s²"),
    ("_mm_s3", "mm/s³"),
    ("_deg_s", "deg/s"),
    ("_mm_s", "mm/s"),
    ("_mm2", "mm²"),
    ("_mm3", "mm³"),
    ("_cm3", "cm³"),
    ("_deg", "deg"),
    ("_rpm", "1/min"),
    ("_mm", "mm"),
    ("_us", "µs"),
    ("_min", "min"),
    ("_s", "s"),
];

/// Value of a key: lists and nulls taken off, and the type that it refers to.
pub(super) struct Target<'s> {
    /// Name of the type in `$defs`, if it refers to one.
    pub(super) name: Option<&'s str>,
    /// Its schema, if it does not.
    pub(super) inline: &'s Value,
    /// How many lists it is in.
    pub(super) lists: usize,
}

impl<'s> Target<'s> {
    /// Follows a property of a schema to what its lists hold.
    pub(super) fn of(property: &'s Value) -> Self {
        let some = |v: &&Value| v["type"] != "null";
        let property = property["anyOf"].as_array().and_then(|any| any.iter().find(some)).unwrap_or(property);
        if let Some(path) = property["$ref"].as_str() {
            return Self { name: path.rsplit('/').next(), inline: property, lists: 0 };
        }
        if is(property, "array") && !property["items"].is_null() {
            let items = Self::of(&property["items"]);
            if items.name.is_some() || !items.inline["properties"].is_null() {
                return Self { lists: items.lists + 1, ..items };
            }
        }
        Self { name: None, inline: property, lists: 0 }
    }
}

/// Whether a schema has this type, alone or beside null.
pub(super) fn is(schema: &Value, kind: &str) -> bool {
    schema["type"] == kind || schema["type"].as_array().is_some_and(|all| all.iter().any(|t| t == kind))
}

/// Texts that an enumeration of texts allows, each with its description; `None` for other types.
pub(super) fn texts(schema: &Value) -> Option<Vec<(&str, &str)>> {
    if let Some(all) = schema["enum"].as_array() {
        return all.iter().map(|v| v.as_str().map(|v| (v, ""))).collect();
    }
    let mut found = Vec::new();
    for variant in schema["oneOf"].as_array()? {
        let description = variant["description"].as_str().unwrap_or_default();
        match (variant["const"].as_str(), variant["enum"].as_array()) {
            (Some(value), _) => found.push((value, description)),
            (None, Some(all)) => found.extend(all.iter().filter_map(Value::as_str).map(|v| (v, ""))),
            (None, None) => return None,
        }
    }
    Some(found)
}

/// Words for the type of a key without a type of its own in the schema: number with unit and range,
/// text, list.
pub(super) fn words(key: &str, schema: &Value) -> String {
    if let Some(texts) = texts(schema) {
        let named: Vec<String> = texts.iter().map(|(text, _)| format!("`{text}`")).collect();
        return if named.len() == 1 { "text".to_owned() } else { named.join(", ") };
    }
    let unit = UNITS.iter().find(|(ending, _)| key.ends_with(ending)).map(|(_, unit)| *unit);
    let with_unit = |what: &str| unit.map_or(what.to_owned(), |unit| format!("{what}, {unit}"));
    if is(schema, "number") {
        return comma(unit.unwrap_or("number"), &range(schema));
    }
    if is(schema, "integer") {
        return comma("integer", &range(schema));
    }
    if is(schema, "boolean") {
        return "`true`, `false`".to_owned();
    }
    if is(schema, "string") {
        return if schema["minLength"] == 1 { "text, not empty" } else { "text" }.to_owned();
    }
    if is(schema, "array") {
        return list(key, schema, unit);
    }
    if schema["additionalProperties"].is_object() {
        return with_unit("values by name");
    }
    "object".to_owned()
}

/// Words for a list of values that are no objects.
fn list(key: &str, schema: &Value, unit: Option<&str>) -> String {
    let items = &schema["items"];
    let fixed = schema["maxItems"].as_u64().filter(|n| schema["minItems"].as_u64() == Some(*n));
    let least = schema["minItems"].as_u64().filter(|_| fixed.is_none());
    let least = least.map(|n| format!("at least {n}")).unwrap_or_default();
    let of_numbers = is(items, "number") || is(items, "integer");
    let of_texts = is(items, "string") && texts(items).is_none();
    let size = fixed.map_or_else(|| "list of".to_owned(), |n| n.to_string());
    match fixed {
        Some(3) if of_numbers => comma(&comma("[x, y, z]", unit.unwrap_or_default()), &range(items)),
        Some(_) if of_numbers => comma(&comma(&format!("{size} numbers"), unit.unwrap_or_default()), &range(items)),
        None if is(items, "integer") => comma("list of integers", &least),
        _ if of_texts => comma(&format!("{size} texts"), &least),
        Some(_) => format!("{size} times {}", words(key, items)),
        None => comma(&format!("list of {}", words(key, items)), &least),
    }
}

/// Words for the range of a number; empty without one, and for what the size of an integer alone
/// says.
fn range(schema: &Value) -> String {
    let limit = |key: &str| schema[key].as_f64();
    let unsigned = schema["format"].as_str().is_some_and(|f| f.starts_with("uint"));
    let least = limit("minimum").filter(|least| !(unsigned && *least == 0.0 && schema["maximum"].is_null()));
    let above = limit("exclusiveMinimum").map(|n| format!("> {}", number(n)));
    let most = limit("maximum");
    if unsigned && limit("minimum") == Some(0.0) && [Some(255.0), Some(65_535.0)].contains(&most) {
        return String::new();
    }
    match (least, above, most) {
        (Some(least), _, Some(most)) => format!("{} to {}", number(least), number(most)),
        (Some(least), _, None) => format!("≥ {}", number(least)),
        (None, Some(above), Some(most)) => format!("{above}, ≤ {}", number(most)),
        (None, Some(above), None) => above,
        (None, None, Some(most)) => format!("≤ {}", number(most)),
        (None, None, None) => String::new(),
    }
}

/// Two texts with a comma between them, if neither is empty.
pub(super) fn comma(first: &str, second: &str) -> String {
    let both: Vec<&str> = [first, second].into_iter().filter(|t| !t.is_empty()).collect();
    both.join(", ")
}
