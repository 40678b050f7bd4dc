//! Order of the rooms: which crate may import which.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

fn text(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// Folders of the crates in the order of the table of rooms, with their layers.
fn rooms() -> Vec<(String, u32)> {
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
