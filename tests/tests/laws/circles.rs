//! Circles of imports among the files of a crate.

use std::collections::{BTreeMap, BTreeSet};

use crate::rooms::{rooms, sources};

/// Modules of a crate by their paths, each with its code.
struct Modules(BTreeMap<Vec<String>, String>);

impl Modules {
    fn of(folder: &str) -> Self {
        let path = |file: &str| file.split('/').filter(|p| *p != "mod" && *p != "lib").map(str::to_owned).collect();
        Self(sources(folder).into_iter().map(|(file, code)| (path(&file), code)).collect())
    }

    /// Paths that `use` items and expressions of a module name from `crate::`, `super::` and
    /// `self::`, from the crate's root on; with the names that each is known by, for items that are
    /// exported again.
    fn paths(&self, module: &[String], exported: bool) -> Vec<Vec<String>> {
        let code = &self.0[module];
        let mut found = Vec::new();
        for (at, start) in ["crate::", "super::", "self::"].iter().flat_map(|s| code.match_indices(s)) {
            let before = &code[..at];
            if before.ends_with(|c: char| c.is_alphanumeric() || c == '_' || c == ':') {
                continue;
            }
            let line = before.rsplit(['\n', ';', '}']).next().unwrap_or_default().trim_start();
            let is_export = line.starts_with("pub") && line.contains(" use ");
            if is_export == exported {
                let base = match start {
                    "crate::" => Vec::new(),
                    "self::" => module.to_vec(),
                    _ => module[..module.len().saturating_sub(1)].to_vec(),
                };
                leaves(&code[at + start.len()..], base, &mut found);
            }
        }
        found
    }

    /// The module that a path leads to, through exports; `None` for the module's own items.
    fn target(&self, path: &[String], steps: usize) -> Option<Vec<String>> {
        let depth = (1..=path.len()).rev().find(|&n| self.0.contains_key(&path[..n]))?;
        let (module, name) = (path[..depth].to_vec(), path.get(depth));
        let exported = |p: &Vec<String>| p.last() == name && p[..p.len() - 1] != module;
        match name.and_then(|_| self.paths(&module, true).into_iter().find(exported)).filter(|_| steps > 0) {
            Some(path) => self.target(&path, steps - 1),
            None => Some(module),
        }
    }

    fn imports(&self) -> BTreeMap<&[String], BTreeSet<Vec<String>>> {
        let of = |module: &Vec<String>| -> BTreeSet<Vec<String>> {
            let mut targets: BTreeSet<_> =
                self.paths(module, false).iter().filter_map(|path| self.target(path, 4)).collect();
            targets.remove(module);
            targets
        };
        self.0.keys().map(|module| (module.as_slice(), of(module))).collect()
    }
}

/// Adds the paths of a tree of `use`, or the one path of an expression.
fn leaves(tree: &str, base: Vec<String>, found: &mut Vec<Vec<String>>) -> usize {
    let (mut path, mut at) = (base, 0);
    loop {
        let rest = &tree[at..];
        let name: String = rest.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
        at += name.len();
        match name.as_str() {
            "super" => drop(path.pop()),
            "" | "self" => {}
            _ => path.push(name),
        }
        if tree[at..].starts_with("::") {
            at += 2;
        } else if tree[at..].starts_with('{') {
            at += 1;
            loop {
                at += tree[at..].len() - tree[at..].trim_start_matches([' ', '\n', ',']).len();
                if tree[at..].is_empty() || tree[at..].starts_with('}') {
                    return (at + 1).min(tree.len());
                }
                let end = at + leaves(&tree[at..], path.clone(), found).max(1);
                // Behind ` as name` there is nothing of the path.
                at = end + tree[end..].find([',', '}']).unwrap_or(tree.len() - end);
            }
        } else {
            found.push(path);
            return at;
        }
    }
}

/// The modules that lead to each other with a module, itself among them.
fn circle<'a>(from: &'a [String], imports: &'a BTreeMap<&[String], BTreeSet<Vec<String>>>) -> BTreeSet<&'a [String]> {
    let reach = |from: &'a [String]| {
        let (mut seen, mut open) = (BTreeSet::new(), vec![from]);
        while let Some(module) = open.pop() {
            let next = imports.get(module).into_iter().flatten().map(Vec::as_slice);
            open.extend(next.filter(|n| seen.insert(*n)));
        }
        seen
    };
    let mut own: BTreeSet<_> = reach(from).into_iter().filter(|m| reach(m).contains(from)).collect();
    own.insert(from);
    own
}

#[test]
fn files_import_each_other_in_circles_of_at_most_three() {
    let mut n_imports = 0;
    for (folder, _) in rooms() {
        let modules = Modules::of(&folder);
        let imports = modules.imports();
        n_imports += imports.values().map(BTreeSet::len).sum::<usize>();
        for module in imports.keys().filter(|module| !module.is_empty()) {
            let circle: Vec<String> = circle(module, &imports).into_iter().map(|m| m.join("::")).collect();
            assert!(circle.len() <= 3, "crates/{folder}: these files import each other: {}", circle.join(", "));
        }
    }
    assert!(n_imports > 1000, "{n_imports} imports");
}

#[test]
fn a_circle_is_found_through_trees_of_use_exports_and_parents() {
    let code = [
        ("a", "use crate::b::{Deep, self as other, c::{D, E}};"),
        ("b", "pub use self::c::Deep;\nmod c;"),
        ("b/c", "use super::super::d::{F};\npub struct Deep;"),
        ("d", "fn f() { crate::a::g() }"),
        ("e", "use crate::a::G;"),
    ];
    let path = |file: &str| file.split('/').map(str::to_owned).collect();
    let modules = Modules(code.into_iter().map(|(file, code)| (path(file), code.to_owned())).collect());
    let imports = modules.imports();
    let names = |from: &str| -> Vec<String> {
        circle(&[from.to_owned()], &imports).into_iter().map(|m| m.join("::")).collect()
    };
    assert_eq!(names("a"), ["a", "b::c", "d"]);
    assert_eq!(names("e"), ["e"]);
}
