//! Doors for other people's code: what a crate from a registry has, and what a library leaves out.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use facemill_tests::shared::workspace;

use crate::rooms::rooms;

/// Longest page of a crate, lines: one screen with an example.
const ONE_SCREEN: usize = 65;

fn text(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

fn crate_folders() -> impl Iterator<Item = PathBuf> {
    // Nothing but tests uses that crate.
    let for_users = rooms().into_iter().filter(|(name, _)| name != "test-kit");
    for_users.map(|(name, _)| workspace().join("crates").join(name))
}

#[test]
fn every_crate_has_a_page_of_one_screen_keywords_and_categories() {
    for folder in crate_folders() {
        let (manifest, page) = (text(&folder.join("Cargo.toml")), text(&folder.join("README.md")));
        for key in ["description", "keywords", "categories", "readme"] {
            assert!(manifest.lines().any(|line| line.starts_with(key)), "{}: no {key}", folder.display());
        }
        let lines = page.lines().count();
        assert!((5..=ONE_SCREEN).contains(&lines), "{}: README.md has {lines} lines", folder.display());
    }
}

/// Code of the first example of a crate's page.
fn example_of(page: &str) -> Option<&str> {
    let (_, rest) = page.split_once("```rust")?;
    let (_, code) = rest.split_once('\n')?;
    Some(code.split_once("```")?.0)
}

/// Text of comments of documentation, without the lines of examples that pages do not show.
fn documentation(code: &str) -> String {
    let comments = code.lines().filter_map(|line| {
        let line = line.trim_start();
        line.strip_prefix("//!").or_else(|| line.strip_prefix("///"))
    });
    let shown = comments.map(str::trim).filter(|line| !line.starts_with("# "));
    shown.collect::<Vec<_>>().join("\n")
}

/// A page's example is one of the documentation, or the page itself is documentation of the facade:
/// the tests of documentation compile both. Lines may be wrapped otherwise.
#[test]
fn examples_of_pages_are_compiled() {
    let joined = |code: &str| code.chars().filter(|c| !c.is_whitespace() && *c != ',').collect::<String>();
    let facade = text(&workspace().join("crates/facemill/src/lib.rs"));
    let mut n = 0;
    // The page of batches reads files of the repository.
    for (name, _) in rooms().into_iter().filter(|(name, _)| name != "batch") {
        let page = text(&workspace().join("crates").join(&name).join("README.md"));
        let Some(example) = example_of(&page) else { continue };
        let is_page = facade.contains(&format!("include_str!(\"../../{name}/README.md\")"));
        let library = documentation(&text(&workspace().join("crates").join(&name).join("src/lib.rs")));
        let is_documentation = joined(&library).contains(&joined(example));
        assert!(is_page || is_documentation, "crates/{name}/README.md: no test compiles its example");
        n += 1;
    }
    assert!(n > 15, "{n} examples");
}

/// Crates that only the command line needs are optional, and no library below asks for them.
#[test]
fn a_library_user_builds_no_command_line() {
    let only_cli = ["clap", "clap_complete", "ctrlc", "indicatif"];
    for folder in crate_folders() {
        let manifest = text(&folder.join("Cargo.toml"));
        let (_, dependencies) = manifest.split_once("\n[dependencies]\n").unwrap_or_default();
        let own = dependencies.lines().take_while(|line| !line.starts_with('['));
        let names = |line: &str| only_cli.contains(&line.split([' ', '.', '=']).next().unwrap_or_default());
        for line in own.filter(|line| names(line)) {
            assert!(folder.ends_with("facemill") && line.contains("optional = true"), "{}: {line}", folder.display());
        }
    }
}

/// The same of everything that is built for the facade without its default features, whoever asks
/// for it.
#[test]
fn the_facade_without_features_builds_no_command_line() {
    let arguments = ["tree", "--offline", "--locked", "-p", "facemill", "-e", "normal", "--prefix", "none"];
    let built = |features: &[&str]| {
        let cargo = Command::new(env!("CARGO")).current_dir(workspace()).args(arguments).args(features).output();
        let output = cargo.expect("cargo runs the tests");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        text.lines().filter_map(|line| Some(line.split_once(' ')?.0.to_owned())).collect::<BTreeSet<_>>()
    };
    let (library, whole) = (built(&["--no-default-features"]), built(&[]));
    for name in ["clap", "clap_builder", "clap_complete", "ctrlc", "indicatif", "console"] {
        assert!(whole.contains(name) && !library.contains(name), "{name}");
    }
    assert!(library.contains("facemill-planner") && library.contains("nalgebra"), "{library:?}");
}

/// Examples of the tutorial: each exists, asserts something, and is run for every change.
#[test]
fn every_tutorial_example_asserts_and_is_run_for_every_change() {
    let run = text(&workspace().join(".ci/run"));
    for name in ["cl_from_mesh", "check_a_posture", "ik_along_a_path", "verify_nc", "feed_for_a_program", "plan_a_job"]
    {
        let example = text(&workspace().join(format!("crates/facemill/examples/{name}.rs")));
        assert!(example.contains("assert"), "{name} asserts nothing");
        assert!(run.split_whitespace().any(|word| word.trim_end_matches(';') == name), "{name} is not run");
    }
}

/// The workspace's `rust-version` is at least that of every crate that is built here.
#[test]
fn no_dependency_needs_a_newer_rust_than_ours() {
    let cargo = |arguments: &[&str]| {
        let output = Command::new(env!("CARGO")).current_dir(workspace()).args(arguments).output();
        let output = output.expect("cargo runs the tests");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8_lossy(&output.stdout).into_owned()
    };
    let version = cargo(&["-vV"]);
    let host = version.lines().find_map(|line| line.strip_prefix("host: ")).expect("a host");
    // Those for other systems need not be here.
    let arguments = ["metadata", "--offline", "--locked", "--format-version", "1", "--filter-platform", host];
    let metadata: serde_json::Value = serde_json::from_str(&cargo(&arguments)).expect("JSON");
    let parts = |version: &str| version.split('.').map(|n| n.parse().expect("a number")).collect::<Vec<u32>>();
    let needs: Vec<_> = metadata["packages"]
        .as_array()
        .expect("packages")
        .iter()
        .filter_map(|package| Some((parts(package["rust_version"].as_str()?), package["name"].as_str()?)))
        .collect();
    let (ours, _) = needs.iter().find(|(_, name)| *name == "facemill").expect("the facade's version");
    for (needed, name) in &needs {
        assert!(needed <= ours, "{name} needs Rust {needed:?}, and the workspace says {ours:?}");
    }
    assert!(needs.len() > 100, "{} packages say which Rust they need", needs.len());
}
