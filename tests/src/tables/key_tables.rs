//! Tables of keys of a page, generated from the JSON schemas in `docs/schemas`.
//!
//! A table is between `<!-- table SCHEMA -->`, or `<!-- table SCHEMA Type -->` for a type of its
//! `$defs`, and `<!-- end of table -->`. A type without a table of its own is written out within
//! the key that holds it. Rows keep the order that they have on the page; new keys come last, the
//! required ones first.

mod headings;
mod rows;
mod text;
mod value_type;

use std::collections::BTreeMap;
use std::path::Path;

use serde_json::Value;

use headings::Headings;
use rows::Table;

/// Formats whose files users write: their tables have a column of defaults. All others are output.
const INPUT: [&str; 8] = ["job", "tool", "holders", "machine", "path", "dialect", "batch", "propeller"];

const END: &str = "<!-- end of table -->";

/// Schemas and the tables of a page.
pub struct KeyTables {
    schemas: BTreeMap<String, Value>,
    docs: BTreeMap<String, Headings>,
    /// Anchor of the heading above each table, by schema and type; the type is empty for the root.
    anchors: BTreeMap<(String, String), String>,
}

impl KeyTables {
    /// Reads the schemas and the headings of all pages in a folder of docs, and finds the tables of
    /// a page.
    ///
    /// # Errors
    /// If a file cannot be read, or a schema is no JSON.
    pub fn new(docs: &Path, page: &str) -> Result<Self, String> {
        let mut tables = Self { schemas: BTreeMap::new(), docs: BTreeMap::new(), anchors: BTreeMap::new() };
        for (name, text) in files(&docs.join("schemas"), "json")? {
            let schema = serde_json::from_str(&text).map_err(|e| format!("docs/schemas/{name}.json: {e}"))?;
            tables.schemas.insert(name, schema);
        }
        tables.docs = files(docs, "md")?.into_iter().map(|(name, text)| (name, Headings::of(&text))).collect();
        let mut heading = String::new();
        for line in page.lines() {
            heading = headings::anchor_of(line).unwrap_or(heading);
            if let Some(table) = marker(line) {
                tables.anchors.insert(table, heading.clone());
            }
        }
        Ok(tables)
    }

    /// Returns the page with all its tables generated anew.
    ///
    /// # Errors
    /// If a marker names no type, a table has no end, or a description cannot be in a table.
    pub fn rewritten(&self, page: &str) -> Result<String, String> {
        let mut out = String::with_capacity(page.len());
        let mut lines = page.lines();
        while let Some(line) = lines.next() {
            out += line;
            out.push('\n');
            let Some((schema, name)) = marker(line) else { continue };
            let old: Vec<&str> = lines.by_ref().take_while(|l| *l != END).collect();
            if old.iter().any(|l| !l.starts_with('|')) {
                return Err(format!("the table behind {line} holds other lines than rows, or has no {END}"));
            }
            let table = Table { tables: self, schema: &schema, has_defaults: INPUT.contains(&schema.as_str()) };
            out += &table.text(&name, &old).map_err(|e| format!("{line}: {e}"))?;
            out += END;
            out.push('\n');
        }
        Ok(out)
    }

    /// Returns a type of a schema, or its root without a name.
    fn definition(&self, schema: &str, name: &str) -> Result<&Value, String> {
        let root = self.schemas.get(schema).ok_or_else(|| format!("there is no docs/schemas/{schema}.json"))?;
        if name.is_empty() {
            return Ok(root);
        }
        root["$defs"].get(name).ok_or_else(|| format!("the schema of {schema} has no type {name}"))
    }

    /// Returns the anchor of a type's table: in the same schema, else in another one that has the
    /// same type.
    fn anchor(&self, schema: &str, name: &str) -> Option<&str> {
        let same = self.anchors.get(&(schema.to_owned(), name.to_owned()));
        let of_other = || {
            let definition = self.definition(schema, name).ok()?;
            let mut named = self.anchors.iter().filter(|((_, n), _)| n == name);
            named.find(|((other, _), _)| self.definition(other, name) == Ok(definition)).map(|(_, anchor)| anchor)
        };
        same.or_else(of_other).map(String::as_str)
    }
}

/// Schema and type that a line names as a table's marker.
fn marker(line: &str) -> Option<(String, String)> {
    let names = line.strip_prefix("<!-- table ")?.strip_suffix(" -->")?;
    let (schema, name) = names.split_once(' ').unwrap_or((names, ""));
    Some((schema.to_owned(), name.to_owned()))
}

/// Name without its ending, and text of the files of a folder with an ending.
fn files(folder: &Path, ending: &str) -> Result<Vec<(String, String)>, String> {
    let fault = |e: std::io::Error| format!("{}: {e}", folder.display());
    let mut all = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(fault)? {
        let path = entry.map_err(fault)?.path();
        if path.extension().is_some_and(|e| e == ending) {
            let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
            all.push((name, std::fs::read_to_string(&path).map_err(fault)?));
        }
    }
    Ok(all)
}
