//! Anchors of a page: those of its headings, and those that it names itself.

use std::collections::BTreeSet;

/// Anchors of a page.
pub(super) struct Headings(BTreeSet<String>);

impl Headings {
    /// Reads the anchors of a page.
    pub(super) fn of(page: &str) -> Self {
        let named = page.split("<a id=\"").skip(1).filter_map(|rest| rest.split('"').next());
        Self(page.lines().filter_map(anchor_of).chain(named.map(str::to_owned)).collect())
    }

    /// Whether the page has this anchor.
    pub(super) fn has(&self, anchor: &str) -> bool {
        self.0.contains(anchor)
    }
}

/// Anchor of a line that is a heading: its words in lower case with hyphens between them, without
/// punctuation.
pub(super) fn anchor_of(line: &str) -> Option<String> {
    let title = line.trim_start_matches('#').strip_prefix(' ').filter(|_| line.starts_with('#'))?;
    let kept = title.chars().filter(|c| c.is_alphanumeric() || " -_".contains(*c));
    Some(kept.collect::<String>().trim().to_lowercase().replace(' ', "-"))
}
