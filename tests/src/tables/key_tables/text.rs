//! Texts of a table's cells.

use serde_json::Value;

use super::KeyTables;

/// Splits the sentence "Default: …" off a description.
pub(super) fn split_default(description: &str) -> (String, Option<String>) {
    const START: &str = "Default: ";
    let Some(at) = description.find(START).filter(|&at| at == 0 || description[..at].ends_with(". ")) else {
        return (description.to_owned(), None);
    };
    let rest = &description[at + START.len()..];
    let (default, behind) = rest.split_once(". ").unwrap_or((rest, ""));
    let meaning = format!("{}{behind}", &description[..at]).trim().to_owned();
    (meaning, Some(default.trim_end_matches('.').to_owned()))
}

/// Value of a default as a cell shows it.
pub(super) fn default_text(value: &Value) -> String {
    match value {
        Value::Null => "none".to_owned(),
        Value::Bool(b) => format!("`{b}`"),
        Value::String(text) => format!("`{text}`"),
        Value::Number(n) => number(n.as_f64().unwrap_or(f64::NAN)),
        Value::Array(items) => format!("[{}]", items.iter().map(default_text).collect::<Vec<_>>().join(", ")),
        Value::Object(keys) if keys.is_empty() => "none".to_owned(),
        Value::Object(_) => "see its keys".to_owned(),
    }
}

/// Number with a comma between thousands from 10,000 on, and powers of ten where it is very large
/// or small.
pub(super) fn number(value: f64) -> String {
    let size = value.abs();
    if size >= 1e6 && size.log10().fract() == 0.0 || size > 0.0 && size < 1e-4 {
        return format!("{value:e}").replace('-', "−").replace("e−", "e-");
    }
    let text = format!("{size}");
    let (whole, fraction) = text.split_once('.').map_or((text.as_str(), String::new()), |(w, f)| (w, format!(".{f}")));
    let digits = whole.len();
    let grouped: String = whole
        .char_indices()
        .flat_map(|(k, c)| [(digits > 4 && k > 0 && (digits - k) % 3 == 0).then_some(','), Some(c)])
        .flatten()
        .collect();
    format!("{}{grouped}{fraction}", if value < 0.0 { "−" } else { "" })
}

impl KeyTables {
    /// Description as the text of a cell, with links in place of paths such as
    /// `docs/rapids.md#order-of-passes`.
    ///
    /// # Errors
    /// If it holds a link of the code's documentation, code in lines of its own, or the path of a
    /// page or heading that does not exist.
    pub fn cell(&self, description: &str) -> Result<String, String> {
        if ["[`", "](", "```"].iter().any(|mark| description.contains(mark)) {
            return Err(format!("a description holds a link or lines of code: {description}"));
        }
        let line = description.split_whitespace().collect::<Vec<_>>().join(" ").replace('|', "\\|");
        let mut pieces = line.split("docs/");
        let mut text = pieces.next().unwrap_or_default().to_owned();
        for piece in pieces {
            let (link, rest) = self.link(piece)?;
            text += &link;
            text += rest;
        }
        Ok(text)
    }

    /// Link to the page and heading that a text starts with, and the text behind them.
    fn link<'t>(&self, text: &'t str) -> Result<(String, &'t str), String> {
        let end = text.find(|c: char| !(c.is_alphanumeric() || "-_.#".contains(c))).unwrap_or(text.len());
        let path = text[..end].trim_end_matches('.');
        let rest = &text[path.len()..];
        let (page, anchor) = path.split_once('#').unwrap_or((path, ""));
        let name = page.strip_suffix(".md").unwrap_or(page);
        let headings = self.docs.get(name).ok_or_else(|| format!("there is no docs/{page}"))?;
        if !anchor.is_empty() && !headings.has(anchor) {
            return Err(format!("docs/{page} has no heading with the anchor {anchor}"));
        }
        Ok(match (name, anchor) {
            ("formats", _) => (format!("[{}](#{anchor})", anchor.replace('-', " ")), rest),
            (_, "") => (format!("[{}]({page})", name.replace('-', " ")), rest),
            _ => (format!("[{}]({page}#{anchor})", name.replace('-', " ")), rest),
        })
    }
}
