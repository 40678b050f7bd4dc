//! The scripts of the page are those that its sources make: `npm run build` in `page` writes the
//! hashes of all of them into `dist/files.txt`.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};

fn page() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("page")
}

fn bytes(name: &str) -> Vec<u8> {
    let path = page().join(name);
    std::fs::read(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

fn hash(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Names and hashes of the list.
fn listed() -> BTreeMap<String, String> {
    let text = String::from_utf8(bytes("dist/files.txt")).expect("text");
    text.lines()
        .filter_map(|line| line.split_once("  "))
        .map(|(hash, name)| (name.to_owned(), hash.to_owned()))
        .collect()
}

/// Names of the files in a folder of the page.
fn names(folder: &str) -> Vec<String> {
    let entries = std::fs::read_dir(page().join(folder)).expect("a folder");
    let name = |e: std::io::Result<std::fs::DirEntry>| e.expect("an entry").file_name().to_string_lossy().into_owned();
    let mut names: Vec<String> = entries.map(|e| format!("{folder}/{}", name(e))).collect();
    names.sort();
    names
}

#[test]
fn scripts_and_their_sources_belong_together() {
    let listed = listed();
    for (name, expected) in &listed {
        assert_eq!(&hash(&bytes(name)), expected, "{name} is not as it was built: run npm ci && npm run build in page");
    }
    for name in names("src").iter().chain(&names("dist")).filter(|n| !n.ends_with("files.txt")) {
        assert!(listed.contains_key(name), "{name} is not in dist/files.txt: run npm ci && npm run build in page");
    }
    for name in ["package.json", "package-lock.json", "build.mjs"] {
        assert!(listed.contains_key(name), "{name}");
    }
}

#[test]
fn the_policy_names_the_hash_of_each_script_and_a_script_cannot_end_its_element() {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    for name in ["report.js", "sheet.js"] {
        let script = bytes(&format!("dist/{name}"));
        let digest = Sha256::digest(&script);
        let bit = |k: usize| digest.get(k / 8).is_some_and(|byte| byte >> (7 - k % 8) & 1 == 1);
        let digit = |k: usize| DIGITS[(6 * k..6 * k + 6).fold(0, |all, b| 2 * all + usize::from(bit(b)))] as char;
        let expected: String = (0..43).map(digit).chain(['=']).collect();
        assert_eq!(String::from_utf8(bytes(&format!("dist/{name}.sha256"))).expect("text").trim(), expected);
        let text = String::from_utf8(script).expect("text").to_lowercase();
        assert!(!text.contains("</script") && !text.contains("<!--"), "{name}");
    }
}

#[test]
fn the_scripts_are_small_and_three_is_there_with_its_licence() {
    assert!(bytes("dist/report.js").len() <= 720_000);
    assert!(bytes("dist/sheet.js").len() <= 40_000);
    let licence = String::from_utf8(bytes("dist/three.LICENSE.txt")).expect("text");
    assert!(licence.contains("MIT License") && licence.contains("three.js authors"));
}
