//! Names of types, and the English of comments, by the rules of `CONTRIBUTING.md`.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use crate::rooms::{rooms, sources};

/// Names of types that do not say of what they are a part, a place or a result.
const BARE: [&str; 20] = [
    "Asked", "Ends", "Follower", "Found", "Ground", "Laid", "Line", "Lost", "Measured", "Part", "Piece", "Place",
    "Run", "Stage", "Stand", "Stop", "Told", "Way", "WayKind", "Ways",
];

/// A type of a crate: where it is declared, and whether other files can use it.
struct Declared {
    file: String,
    is_visible: bool,
}

/// Types that a line of code declares; associated types of traits are none.
fn declared(line: &str) -> Option<(&str, bool)> {
    let code = line.trim_start();
    let is_inner = code.len() < line.len();
    let (is_visible, code) = match code.strip_prefix("pub") {
        Some(rest) => (true, rest.strip_prefix(' ').or_else(|| rest.split_once(") ").map(|(_, rest)| rest))?),
        None => (false, code),
    };
    let (kind, rest) = code.split_once(' ')?;
    let is_type = matches!(kind, "struct" | "enum" | "trait" | "union") || kind == "type" && !is_inner;
    let end = rest.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(rest.len());
    (is_type && rest.starts_with(char::is_uppercase)).then_some((&rest[..end], is_visible))
}

/// Types of a crate's own code by their names.
fn types(folder: &str) -> BTreeMap<String, Vec<Declared>> {
    let mut all: BTreeMap<String, Vec<Declared>> = BTreeMap::new();
    for (file, code) in sources(folder) {
        for (name, is_visible) in code.lines().filter_map(declared) {
            all.entry(name.to_owned()).or_default().push(Declared { file: file.clone(), is_visible });
        }
    }
    all
}

#[test]
fn declarations_are_seen_with_their_visibility() {
    assert_eq!(declared("pub struct PassSegment {"), Some(("PassSegment", true)));
    assert_eq!(declared("    pub(crate) enum Kind<'a> {"), Some(("Kind", true)));
    assert_eq!(declared("type Place = [i64; 2];"), Some(("Place", false)));
    assert_eq!(declared("struct Run<F>(F);"), Some(("Run", false)));
    for none in ["    type Output = f64;", "pub fn struct_of()", "pub use kind::Kind;", "let place = Place {};", ""] {
        assert_eq!(declared(none), None, "{none}");
    }
}

#[test]
fn no_type_has_a_name_that_does_not_say_of_what() {
    let mut n_types = 0;
    for (folder, _) in rooms() {
        for (name, declared) in types(&folder) {
            let file = &declared[0].file;
            assert!(!BARE.contains(&&*name), "crates/{folder}/src/{file}.rs: say of what the type `{name}` is");
            n_types += declared.len();
        }
    }
    assert!(n_types > 1000, "{n_types} types");
}

#[test]
fn types_that_share_a_name_in_a_crate_are_private_to_their_files() {
    for (folder, _) in rooms() {
        for (name, declared) in types(&folder) {
            let is_private = declared.iter().all(|d| !d.is_visible);
            let files: Vec<&str> = declared.iter().map(|d| &*d.file).collect();
            assert!(files.len() == 1 || is_private, "crates/{folder}: `{name}` is a type in {}", files.join(" and "));
        }
    }
}

/// Files below a folder whose names end so, by their paths from the workspace's root.
fn files_below(folder: &str, end: &str) -> Vec<(String, String)> {
    fn collect(at: &Path, files: &mut Vec<PathBuf>) {
        for entry in fs::read_dir(at).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.is_dir() { collect(&path, files) } else { files.push(path) }
        }
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut files = Vec::new();
    collect(&root.join(folder), &mut files);
    files.sort();
    let named =
        files.iter().map(|path| (path.strip_prefix(&root).expect("below the root").display().to_string(), path));
    named
        .filter(|(name, _)| name.ends_with(end))
        .map(|(name, path)| (name, fs::read_to_string(path).expect("text")))
        .collect()
}

/// All Rust files of the workspace's own packages.
fn all_files() -> Vec<(String, String)> {
    ["crates", "tests", "benches"].iter().flat_map(|folder| files_below(folder, ".rs")).collect()
}

/// Text of a line that is a comment and nothing else, and whether it is one of documentation.
fn comment(line: &str) -> Option<(&str, bool)> {
    let text = line.trim_start().strip_prefix("//")?;
    let doc = text.strip_prefix('/').or_else(|| text.strip_prefix('!'));
    Some((doc.unwrap_or(text).trim(), doc.is_some()))
}

/// Columns of a comment's line.
const COLUMNS: usize = 100;

/// Tables cannot be wrapped, and examples of code have the width of code.
#[test]
fn comments_wrap_at_100_columns() {
    let mut wide = Vec::new();
    for (file, text) in all_files() {
        let mut is_code = false;
        for (k, line) in text.lines().enumerate() {
            let Some((comment, _)) = comment(line) else {
                is_code = false;
                continue;
            };
            is_code ^= comment.starts_with("```");
            if !is_code && !comment.starts_with('|') && line.chars().count() > COLUMNS {
                wide.push(format!("{file}:{}", k + 1));
            }
        }
    }
    assert_eq!(wide, [""; 0], "wrap these comments");
}

/// A noun or a verb in the third person says the same in fewer words: "Settings of a plan", not
/// "What a plan goes by".
#[test]
fn documentation_begins_with_a_noun_or_a_verb() {
    let begins_so = |line: &str| comment(line).is_some_and(|(text, is_doc)| is_doc && is_vague(text));
    let vague = all_files().into_iter().flat_map(|(file, text)| {
        let lines = text.lines().enumerate().filter(|(_, line)| begins_so(line));
        lines.map(|(k, _)| format!("{file}:{}", k + 1)).collect::<Vec<_>>()
    });
    assert_eq!(vague.collect::<Vec<_>>(), [""; 0], "begin with a noun or a verb");
}

fn is_vague(text: &str) -> bool {
    ["What ", "Whatever "].iter().any(|word| text.starts_with(word))
}

/// Words that make prose read as translated, each with better ones.
const STILTED: [(&str, &str); 5] = [
    ("told", "reported, known, given, or stated"),
    ("asked", "requested, required, or tested"),
    ("held against", "compared with, checked or tested against"),
    ("held back", "limited"),
    ("stands", "is, rests, or occurs"),
];

/// Uses of them that are plain English.
const PLAIN: [&str; 4] = ["stands still", "stands for", "stands alone", "as it stands"];

/// Texts of consecutive lines of comments, each with its first line, from 1.
fn paragraphs(text: &str) -> Vec<(usize, String)> {
    let mut all: Vec<(usize, String)> = Vec::new();
    let mut is_open = false;
    for (k, line) in text.lines().enumerate() {
        match comment(line) {
            Some((comment, _)) if is_open => {
                let (_, paragraph) = all.last_mut().expect("an open one");
                paragraph.push(' ');
                paragraph.push_str(comment);
            }
            Some((comment, _)) => all.push((k + 1, comment.to_owned())),
            None => {}
        }
        is_open = comment(line).is_some();
    }
    all
}

/// The first stilted word or phrase of a text, with better ones.
fn stilted(text: &str) -> Option<&'static (&'static str, &'static str)> {
    let text = PLAIN.iter().fold(text.to_lowercase(), |text, plain| text.replace(plain, ""));
    let is_letter = |c: char| c.is_alphanumeric() || c == '_';
    STILTED.iter().find(|(phrase, _)| {
        text.match_indices(phrase).any(|(at, _)| {
            let (before, behind) = (&text[..at], &text[at + phrase.len()..]);
            !before.ends_with(is_letter) && !behind.starts_with(is_letter)
        })
    })
}

#[test]
fn stilted_words_are_found_across_lines_and_within_no_other_word() {
    let [(line, text)] = &paragraphs("let a = 1;\n    /// A part that is held\n    /// against the stock.\n")[..]
    else {
        panic!("one paragraph");
    };
    assert_eq!((*line, stilted(text).map(|s| s.0)), (2, Some("held against")));
    assert_eq!(stilted("Told by the text.").map(|s| s.0), Some("told"));
    assert_eq!(stilted("The axis stands still; `n_asked` masked standstill."), None);
    assert_eq!(message(r#"let told = f("as \"asked\"", told, "or not");"#).as_deref(), Some("as 'asked' or not"));
    assert_eq!((message("let told = 1;"), message("/// \"told\"")), (None, None));
}

/// Text between quotation marks on a line of code.
fn message(line: &str) -> Option<String> {
    let line = line.replace("\\\"", "'");
    let quoted = line.split('"').skip(1).step_by(2).collect::<Vec<_>>().join(" ");
    (comment(&line).is_none() && !quoted.is_empty()).then_some(quoted)
}

#[test]
fn comments_and_messages_of_crates_use_no_stilted_words() {
    let found: Vec<String> = files_below("crates", ".rs")
        .into_iter()
        .filter(|(file, _)| file.contains("/src/"))
        .flat_map(|(file, text)| {
            let lines = text.lines().enumerate();
            let messages = lines.filter_map(|(k, line)| Some((k + 1, message(line)?)));
            stilted_in(&file, paragraphs(&text).into_iter().chain(messages))
        })
        .collect();
    assert!(found.is_empty(), "{}", found.join("\n"));
}

#[test]
fn pages_use_no_stilted_words() {
    let found: Vec<String> = files_below("docs", ".md")
        .into_iter()
        .flat_map(|(file, text)| {
            let mut line = 1;
            let paragraphs = text.split("\n\n").map(|paragraph| {
                let first = line;
                line += paragraph.matches('\n').count() + 2;
                (first, paragraph.replace('\n', " "))
            });
            stilted_in(&file, paragraphs)
        })
        .collect();
    assert!(found.is_empty(), "{}", found.join("\n"));
}

/// Messages on the texts of a file that have a stilted word, with their lines.
fn stilted_in(file: &str, texts: impl Iterator<Item = (usize, String)>) -> Vec<String> {
    let of = |(line, text): (usize, String)| {
        stilted(&text).map(|(word, better)| format!("{file}:{line}: \"{word}\": say {better}"))
    };
    texts.filter_map(of).collect()
}
