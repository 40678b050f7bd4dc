//! Order of the rooms: which crate may import which, and which module within a crate; where files
//! are, and how large crates and folders may be.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

fn text(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// Folders of the crates in the order of the table of rooms, with their layers.
pub(crate) fn rooms() -> Vec<(String, u32)> {
    let table = text(&root().join("docs/architecture.md"));
    let row = |line: &str| {
        let mut cells = line.strip_prefix("| `crates/")?.split('|').map(str::trim);
        let name = cells.next()?.split('`').next()?.to_owned();
        Some((name, cells.next()?.parse().ok()?))
    };
    table.lines().filter_map(row).collect()
}

/// Crates of the workspace that a crate's own code imports, by the names of their folders.
fn imports(folder: &str) -> Vec<String> {
    let manifest = text(&root().join("crates").join(folder).join("Cargo.toml"));
    let dependencies = manifest.split("\n[dependencies]\n").nth(1).unwrap_or_default();
    let own = dependencies.lines().take_while(|line| !line.starts_with('['));
    own.filter_map(|line| Some(line.strip_prefix("facemill-")?.split(['.', ' ']).next()?.to_owned())).collect()
}

#[test]
fn every_crate_is_a_room_of_the_table() {
    let rooms: Vec<String> = rooms().into_iter().map(|(name, _)| name).collect();
    let mut folders: Vec<String> = fs::read_dir(root().join("crates"))
        .expect("crates")
        .map(|entry| entry.expect("a folder").file_name().to_string_lossy().into_owned())
        .collect();
    folders.sort();
    let mut named = rooms.clone();
    named.sort();
    assert_eq!(named, folders);
}

#[test]
fn crates_import_rooms_of_lower_layers_alone() {
    let rooms = rooms();
    let layers: BTreeMap<&str, u32> = rooms.iter().map(|(name, layer)| (name.as_str(), *layer)).collect();
    for (name, layer) in &rooms {
        for import in imports(name) {
            assert!(layers[import.as_str()] < *layer, "crates/{name} imports {import}, which is no room below it");
        }
    }
}

/// Dependencies of the packages of a lock file, by the names of the packages.
fn locked(path: &Path) -> BTreeMap<String, BTreeSet<String>> {
    let quoted = |line: &str| Some(line.split('"').nth(1)?.split(' ').next()?.to_owned());
    let package = |block: &str| {
        let name = quoted(block.lines().find(|line| line.starts_with("name = "))?)?;
        let dependencies = block.split("dependencies = [").nth(1).unwrap_or_default();
        Some((name, dependencies.lines().filter_map(quoted).collect()))
    };
    text(path).split("[[package]]").skip(1).filter_map(package).collect()
}

#[test]
fn the_lock_of_the_python_package_has_the_dependencies_of_every_crate() {
    let locked = locked(&root().join("crates/python/Cargo.lock"));
    let mut compared = 0;
    for (name, _) in rooms() {
        let manifest = text(&root().join("crates").join(&name).join("Cargo.toml"));
        let package = manifest.split("name = \"").nth(1).and_then(|rest| rest.split('"').next()).expect("a name");
        // Crates for tests alone are not in the package.
        let Some(names) = locked.get(package) else { continue };
        compared += 1;
        let dependencies = manifest.split("\n[dependencies]\n").nth(1).unwrap_or_default();
        let own = dependencies.lines().take_while(|line| !line.starts_with('['));
        for line in own.filter(|line| !line.contains("optional = true") && !line.starts_with('#')) {
            let dependency = line.split(['.', ' ']).next().unwrap_or_default();
            assert!(
                dependency.is_empty() || names.contains(dependency),
                "crates/{name}: run cargo metadata in crates/python, whose lock lacks {dependency}"
            );
        }
    }
    assert!(compared > 30 && locked.contains_key("facemill"), "{compared} crates were compared");
}

/// Modules of a crate in the order of the table on its page.
fn modules(folder: &str) -> Vec<String> {
    let page = text(&root().join("crates").join(folder).join("src/lib.rs"));
    let name = |line: &str| {
        let cell = line.strip_prefix("//! | ")?.split(" | ").next()?;
        Some(cell.strip_prefix(['`', '['])?.trim_matches(['`', '[', ']']).trim_start_matches("mod@").to_owned())
    };
    page.lines().filter_map(name).collect()
}

/// Files of a crate's own code: path below `src` without its end, and text up to its tests.
pub(crate) fn sources(folder: &str) -> Vec<(String, String)> {
    fn collect(at: &Path, files: &mut Vec<PathBuf>) {
        for entry in fs::read_dir(at).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.is_dir() { collect(&path, files) } else { files.push(path) }
        }
    }
    let src = root().join("crates").join(folder).join("src");
    let mut files = Vec::new();
    collect(&src, &mut files);
    files.retain(|path| path.extension().is_some_and(|e| e == "rs"));
    files.sort();
    let name = |path: &Path| path.strip_prefix(&src).expect("below src").with_extension("").display().to_string();
    files.iter().map(|path| (name(path), without_tests(&text(path)))).collect()
}

/// Code without comments, and without the modules of its tests, which have files of their own.
fn without_tests(code: &str) -> String {
    let mut kept = String::new();
    let mut lines = code.lines();
    while let Some(line) = lines.next() {
        if line == "#[cfg(test)]" {
            // `#[path = "…"]` and `mod tests;`, or an item that tests alone use.
            lines.by_ref().take_while(|line| line.starts_with("#[")).for_each(drop);
        } else if !line.trim_start().starts_with("//") {
            kept.push_str(line);
            kept.push('\n');
        }
    }
    kept
}

/// First names behind `crate::`, and behind as many `super::` as lead to the crate's root.
fn names_from_root(file: &str, code: &str) -> Vec<String> {
    let depth = file.split('/').filter(|part| *part != "mod").count();
    let up = "super::".repeat(depth);
    let first = |rest: &str| -> String { rest.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect() };
    let behind = |start: &str| -> Vec<String> {
        let own = |at: usize| !code[..at].ends_with(|c: char| c.is_alphanumeric() || c == '_' || c == ':');
        code.match_indices(start).filter(|&(at, _)| own(at)).map(|(at, _)| first(&code[at + start.len()..])).collect()
    };
    let mut names = behind("crate::");
    names.extend(behind(&up));
    names.retain(|name| !matches!(name.as_str(), "super" | ""));
    names
}

/// The rooms that are libraries: the facade has modules of others alone.
fn libraries() -> Vec<String> {
    rooms().into_iter().map(|(name, _)| name).filter(|name| name != "facemill").collect()
}

#[test]
fn pages_of_crates_list_all_of_their_modules() {
    for folder in libraries() {
        let page = without_tests(&text(&root().join("crates").join(&folder).join("src/lib.rs")));
        let module = |line: &str| {
            let line = line.strip_prefix("pub(crate) ").or(line.strip_prefix("pub ")).unwrap_or(line);
            Some(line.strip_prefix("mod ")?.strip_suffix(';')?.to_owned())
        };
        let mut declared: Vec<String> = page.lines().filter_map(module).collect();
        let mut listed = modules(&folder);
        declared.sort();
        listed.sort();
        assert_eq!(declared, listed, "the table on the page of crates/{folder} and its modules");
    }
}

#[test]
fn modules_import_those_above_them_in_their_crates_table_alone() {
    let mut n_imports = 0;
    for folder in libraries() {
        let order = modules(&folder);
        let place = |name: &str| order.iter().position(|module| module == name);
        for (file, code) in sources(&folder) {
            let own = file.split('/').next().expect("a name");
            if own == "lib" {
                continue;
            }
            let at = place(own).unwrap_or_else(|| panic!("crates/{folder}/src/{file}.rs is of no module"));
            for name in names_from_root(&file, &code) {
                let imported = place(&name).unwrap_or_else(|| {
                    panic!("crates/{folder}/src/{file}.rs names crate::{name}: name the module that it is in")
                });
                assert!(
                    imported <= at,
                    "crates/{folder}/src/{file}.rs imports {name}, which is below {own} in the table"
                );
                n_imports += usize::from(imported < at);
            }
        }
    }
    assert!(n_imports > 500, "{n_imports} imports");
}

#[test]
fn no_folder_has_more_than_fifteen_files() {
    for (folder, _) in rooms() {
        let mut counts: BTreeMap<String, usize> = BTreeMap::new();
        for (file, _) in sources(&folder) {
            *counts.entry(file.rsplit_once('/').map_or("", |(at, _)| at).to_owned()).or_default() += 1;
        }
        for (at, n) in counts {
            let page = usize::from(at.is_empty());
            assert!(n - page <= 15, "crates/{folder}/src/{at} has {n} files side by side: make folders of them");
        }
    }
}

/// Most lines of a crate's own code, with its comments. Above this it has two nouns, and is two
/// crates.
const CRATE_LINES: usize = 13_000;

#[test]
fn no_crate_has_more_than_thirteen_thousand_lines() {
    for (folder, _) in rooms() {
        let src = root().join("crates").join(&folder).join("src");
        let lines = |(file, _): (String, String)| text(&src.join(format!("{file}.rs"))).lines().count();
        let n: usize = sources(&folder).into_iter().map(lines).sum();
        assert!(n <= CRATE_LINES, "crates/{folder}/src has {n} lines: make a crate of one of its modules");
    }
}

#[test]
fn tests_of_private_items_are_not_among_the_sources() {
    for (folder, _) in rooms() {
        let src = root().join("crates").join(&folder).join("src");
        for (file, _) in sources(&folder) {
            let code = text(&src.join(format!("{file}.rs")));
            for (k, line) in code.lines().enumerate() {
                assert!(
                    !line.contains("#[test]"),
                    "crates/{folder}/src/{file}.rs:{}: put tests into tests/unit",
                    k + 1
                );
            }
        }
    }
}
