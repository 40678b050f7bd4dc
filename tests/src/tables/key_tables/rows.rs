//! Rows of a table.

use serde_json::Value;

use super::KeyTables;
use super::text::{default_text, split_default};
use super::value_type::{Target, comma, texts, words};

/// Table of one schema.
pub(super) struct Table<'s> {
    /// Schemas and other tables.
    pub(super) tables: &'s KeyTables,
    /// Name of the schema.
    pub(super) schema: &'s str,
    /// Whether there is a column of defaults.
    pub(super) has_defaults: bool,
}

/// Key of the page with the other cells of its row.
struct Row {
    key: String,
    value: String,
    default: String,
    meaning: String,
}

/// Types that are being written out, from the outermost on, and the order of keys.
struct TypeContext<'p> {
    prefix: String,
    within: Vec<&'p str>,
    order: &'p [String],
}

impl<'s> Table<'s> {
    /// Rows of a type, or of the whole file without a name, below their head.
    ///
    /// # Errors
    /// If there is no such type, or a description cannot be in a table.
    pub(super) fn text(&self, name: &str, old: &[&str]) -> Result<String, String> {
        let definition = self.tables.definition(self.schema, name)?;
        if let Some(texts) = texts(definition) {
            let mut out = "| value | meaning |\n|---|---|\n".to_owned();
            for (value, description) in texts {
                out += &format!("| `{value}` | {} |\n", self.tables.cell(description)?);
            }
            return Ok(out);
        }
        let order: Vec<String> = old.iter().flat_map(|line| keys_of_row(line)).collect();
        let mut rows = Vec::new();
        self.add_type(
            definition,
            &TypeContext { prefix: String::new(), within: vec![name], order: &order },
            &mut rows,
        )?;
        let mut out = if self.has_defaults {
            "| key | type | default | meaning |\n|---|---|---|---|\n".to_owned()
        } else {
            "| key | type | meaning |\n|---|---|---|\n".to_owned()
        };
        for Row { key, value, default, meaning } in rows {
            let default = if self.has_defaults { format!(" {default} |") } else { String::new() };
            out += &format!("| `{key}` | {value} |{default} {meaning} |\n");
        }
        Ok(out)
    }

    /// Adds the keys of an object, or the variants of a choice.
    fn add_type(&self, definition: &'s Value, place: &TypeContext<'_>, rows: &mut Vec<Row>) -> Result<(), String> {
        if let Some(properties) = definition["properties"].as_object() {
            let none = Vec::new();
            let required = definition["required"].as_array().unwrap_or(&none);
            let position = |key: &str| required.iter().position(|r| r == key).unwrap_or(usize::MAX);
            let mut keys: Vec<&String> = properties.keys().collect();
            keys.sort_by_key(|key| (place.position(key), position(key)));
            for key in keys {
                let is_required = required.iter().any(|r| r == key);
                self.add_key(key, &properties[key], is_required, None, place, rows)?;
            }
        }
        for variant in definition["oneOf"].as_array().unwrap_or(&Vec::new()) {
            let description = variant["description"].as_str();
            if let Some(value) = variant["const"].as_str() {
                let meaning = self.tables.cell(description.unwrap_or_default())?;
                let key = format!("{}\"{value}\"", place.prefix);
                rows.push(Row { key, value: "text".to_owned(), default: String::new(), meaning });
            }
            for (key, property) in variant["properties"].as_object().into_iter().flatten() {
                let choice = Some(description.unwrap_or_default());
                self.add_key(key, property, false, choice, place, rows)?;
            }
        }
        Ok(())
    }

    /// Adds a key with what it holds; `choice` is the description of an alternative.
    fn add_key(
        &self,
        key: &str,
        property: &'s Value,
        is_required: bool,
        choice: Option<&str>,
        place: &TypeContext<'_>,
        rows: &mut Vec<Row>,
    ) -> Result<(), String> {
        let target = Target::of(property);
        let definition = target.name.map_or(Ok(target.inline), |name| self.tables.definition(self.schema, name))?;
        let own = choice.or_else(|| property["description"].as_str()).or_else(|| definition["description"].as_str());
        let (meaning, stated) = split_default(own.unwrap_or_default());
        let mut meaning = self.tables.cell(&meaning)?;
        let anchor = target.name.and_then(|name| self.tables.anchor(self.schema, name));
        if anchor.is_none() {
            let all = texts(definition).filter(|all| all.len() > 1).unwrap_or_default();
            for (value, what) in all.iter().filter(|(_, what)| !what.is_empty()) {
                meaning += &format!(" `{value}`: {}", self.tables.cell(what)?);
            }
        }
        let default = match choice {
            _ if is_required => "required".to_owned(),
            Some(_) => String::new(),
            None => self.tables.cell(&stated.unwrap_or_else(|| default_of(property)))?,
        };
        let full = format!("{}{key}{}", place.prefix, "[]".repeat(target.lists));
        let value = self.words(key, property, &target, definition, anchor);
        rows.push(Row { key: full.clone(), value, default, meaning: meaning.trim().to_owned() });
        let name = target.name.unwrap_or_default();
        let is_open =
            definition["properties"].is_object() || texts(definition).is_none() && definition["oneOf"].is_array();
        if is_open && anchor.is_none() && (name.is_empty() || !place.within.contains(&name)) {
            let within = place.within.iter().copied().chain([name]).collect();
            self.add_type(definition, &TypeContext { prefix: format!("{full}."), within, order: place.order }, rows)?;
        }
        Ok(())
    }

    /// Words for the value of a key.
    fn words(
        &self,
        key: &str,
        property: &Value,
        target: &Target<'_>,
        definition: &Value,
        anchor: Option<&str>,
    ) -> String {
        let is_list = target.lists > 0;
        let is_text = texts(definition).is_some();
        let noun = match (definition["oneOf"].is_array(), is_list) {
            (true, false) => "one of",
            (false, false) => "object",
            (_, true) => "objects",
        };
        let is_object = !is_text && (definition["properties"].is_object() || definition["oneOf"].is_array());
        let one = match anchor {
            Some(anchor) if is_text => format!("text, [one of](#{anchor})"),
            Some(anchor) => format!("[{noun}](#{anchor})"),
            None if is_object => noun.to_owned(),
            None => words(key, definition),
        };
        let count = match (property["minItems"].as_u64(), property["maxItems"].as_u64()) {
            (Some(least), Some(most)) => format!("{least} to {most}"),
            (Some(least), None) => format!("at least {least}"),
            (None, _) => String::new(),
        };
        if is_list { comma(&format!("{}{one}", "list of ".repeat(target.lists)), &count) } else { one }
    }
}

impl TypeContext<'_> {
    /// Place of a key in the order of the page; that of the first key within it, if it has none.
    fn position(&self, key: &str) -> usize {
        let full = format!("{}{key}", self.prefix);
        let is_it =
            |k: &String| k.strip_prefix(&full).is_some_and(|rest| rest.is_empty() || rest.starts_with(['.', '[']));
        self.order.iter().position(is_it).unwrap_or(usize::MAX)
    }
}

/// Default of a key whose description states none in words.
fn default_of(property: &Value) -> String {
    let value = &property["default"];
    if value.is_null() && property["type"] == "boolean" { "`false`".to_owned() } else { default_text(value) }
}

/// Keys in code font in the first cell of a row.
fn keys_of_row(line: &str) -> Vec<String> {
    let cell = line.trim_start_matches('|').split('|').next().unwrap_or_default();
    cell.split('`').skip(1).step_by(2).map(str::to_owned).collect()
}
