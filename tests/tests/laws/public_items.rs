//! Public items: each is used by the code of a crate, or an example shows what it is for.
//!
//! Names are compared, not items: one that shares its name with another may pass unseen.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use facemill_tests::shared::workspace;

use crate::rooms::{rooms, sources};

const KINDS: [&str; 7] = ["fn", "struct", "enum", "trait", "type", "const", "static"];

fn is_word(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

/// Kind and name that a line declares, and whether users of the crate may see it.
fn declared(line: &str) -> Option<(&str, &str, bool)> {
    let line = line.trim_start();
    let (is_public, rest) = match line.strip_prefix("pub ") {
        Some(rest) => (true, rest),
        None if line.starts_with("pub(") => (false, line.split_once(") ")?.1),
        None => (false, line),
    };
    let rest = rest.strip_prefix("const ").filter(|rest| rest.starts_with("fn ")).unwrap_or(rest);
    let (kind, rest) = rest.split_once(' ')?;
    let name = rest.split(|c| !is_word(c)).next()?;
    (KINDS.contains(&kind) && !name.is_empty()).then_some((kind, name, is_public))
}

/// Code without the statements that export items of other files.
fn without_exports(code: &str) -> String {
    let mut kept = String::new();
    let mut lines = code.lines();
    while let Some(line) = lines.next() {
        if line.trim_start().starts_with("pub use ") {
            if !line.contains(';') {
                lines.by_ref().take_while(|line| !line.contains(';')).for_each(drop);
            }
        } else {
            kept.push_str(line.split(" // ").next().unwrap_or_default());
            kept.push('\n');
        }
    }
    kept
}

/// Words of code that may name an item: not fields that are read, and nothing in front of a single
/// colon.
fn words(code: &str) -> Vec<&str> {
    let mut words = Vec::new();
    let mut at = 0;
    while let Some(start) = code[at..].find(is_word).map(|k| at + k) {
        let end = code[start..].find(|c| !is_word(c)).map_or(code.len(), |k| start + k);
        let (before, behind) = (&code[..start], &code[end..]);
        let is_field = before.ends_with('.') && !before.ends_with("..") && !behind.starts_with(['(', ':']);
        let has_colon = behind.starts_with(':') && !behind.starts_with("::");
        if !is_field && !has_colon {
            words.push(&code[start..end]);
        }
        at = end;
    }
    words
}

/// Code of a page or of comments, between its fences.
fn examples_in(text: &str) -> String {
    text.split("```").skip(1).step_by(2).collect::<Vec<_>>().join("\n")
}

fn files(folder: &Path, ending: &str, all: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        if path.is_dir() {
            files(&path, ending, all);
        } else if path.to_string_lossy().ends_with(ending) {
            all.push(path);
        }
    }
}

fn text(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// Words of all that shows a user what an item is for: examples of comments and pages, and the
/// examples that run.
fn shown() -> BTreeSet<String> {
    let mut shown = BTreeSet::new();
    let mut add = |code: &str| shown.extend(code.split(|c| !is_word(c)).map(str::to_owned));
    add(&examples_in(&text(&workspace().join("README.md"))));
    for (name, _) in rooms() {
        let folder = workspace().join("crates").join(name);
        add(&examples_in(&text(&folder.join("README.md"))));
        let (mut own, mut tutorial) = (Vec::new(), Vec::new());
        files(&folder.join("src"), ".rs", &mut own);
        files(&folder.join("examples"), ".rs", &mut tutorial);
        tutorial.iter().for_each(|path| add(&text(path)));
        for path in own {
            let code = text(&path);
            let comments = code.lines().map(str::trim_start).filter(|l| l.starts_with("///") || l.starts_with("//!"));
            add(&examples_in(&comments.collect::<Vec<_>>().join("\n")));
        }
    }
    shown
}

/// Public items of these crates' files (crate and module, code without comments) that no code uses.
fn unused(code: &[(String, String)]) -> Vec<(String, String)> {
    let code: Vec<(&str, String)> = code.iter().map(|(file, code)| (file.as_str(), without_exports(code))).collect();
    let mut uses: BTreeMap<&str, i64> = BTreeMap::new();
    for (_, code) in &code {
        words(code).into_iter().for_each(|word| *uses.entry(word).or_default() += 1);
        // A declaration is no use, nor the head of its methods; the name of a constant has a colon
        // behind it and was not counted.
        let counted = code.lines().filter_map(declared).filter(|(kind, ..)| !matches!(*kind, "const" | "static"));
        counted.for_each(|(_, name, _)| *uses.entry(name).or_default() -= 1);
        let own = code.lines().filter(|line| !line.contains(" for ")).filter_map(|line| line.strip_prefix("impl "));
        let own = own.filter_map(|line| line.split(|c| !is_word(c)).next());
        own.for_each(|name| *uses.entry(name).or_default() -= 1);
    }
    let mut unused = Vec::new();
    for (file, code) in &code {
        for (_, name, _) in code.lines().filter_map(declared).filter(|(.., is_public)| *is_public) {
            if uses.get(name).is_none_or(|n| *n <= 0) {
                unused.push(((*file).to_owned(), name.to_owned()));
            }
        }
    }
    unused
}

#[test]
fn every_public_item_is_used_or_shown() {
    let of_crate = |name: String| sources(&name).into_iter().map(move |(file, code)| (format!("{name}: {file}"), code));
    let code: Vec<(String, String)> =
        rooms().into_iter().map(|(name, _)| name).filter(|name| name != "test-kit").flat_map(of_crate).collect();
    let n_public = code.iter().flat_map(|(_, code)| code.lines()).filter_map(declared).filter(|d| d.2).count();
    assert!(n_public > 1000, "{n_public}");
    let shown = shown();
    let neither: Vec<_> = unused(&code).into_iter().filter(|(_, name)| !shown.contains(name)).collect();
    assert!(neither.is_empty(), "neither used nor shown by an example: {neither:#?}");
}

#[test]
fn an_item_that_its_own_file_and_exports_alone_name_is_unused() {
    let file = |name: &str, code: &str| (name.to_owned(), code.to_owned());
    let a = "pub struct Height {\n    pub mm: f64,\n}\nimpl Height {\n    pub fn mm(&self) -> f64 {\n        self.mm\n    }\n    \
             pub const fn of(mm: f64) -> Self {\n        Self { mm: mm }\n    }\n}\npub const MOST: f64 = 1.0;\n";
    let b = "pub use a::{\n    Height, MOST,\n};\n";
    let named = |code: &[(String, String)]| unused(code).into_iter().map(|(_, name)| name).collect::<Vec<_>>();
    let code = [file("a", a), file("lib", b)];
    assert_eq!(named(&code), ["Height", "of", "MOST"], "`mm` is hidden by an argument of the same name");
    let user = "fn use_all() -> f64 {\n    crate::Height::of(MOST).mm()\n}\n";
    assert!(named(&[file("a", a), file("lib", b), file("user", user)]).is_empty());
}
