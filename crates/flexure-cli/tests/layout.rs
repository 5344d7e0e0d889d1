//! The layout that CONTRIBUTING.md describes: which crate knows which, and no file that needs itself by way of many others.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// Files in the largest circle of imports that is allowed.
const LARGEST_CIRCLE: usize = 3;

/// The modules of a file, from the crate's root on.
type Module = Vec<String>;

fn workspace() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn read(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// The crates of the workspace that have users: name and folder.
fn crates() -> BTreeMap<String, PathBuf> {
    let folders = fs::read_dir(workspace().join("crates")).unwrap();
    let folders = folders.map(|e| e.unwrap().path()).chain([workspace().join("python")]);
    folders
        .map(|folder| (folder.file_name().unwrap().to_str().unwrap().to_owned(), folder))
        .collect()
}

#[test]
fn crates_depend_on_those_below_them_alone() {
    let below = BTreeMap::from([
        ("flexure", vec![]),
        ("flexure-io", vec!["flexure"]),
        ("flexure-report", vec!["flexure"]),
        ("flexure-export", vec!["flexure", "flexure-io"]),
        (
            "flexure-workbench",
            vec!["flexure", "flexure-io", "flexure-report", "flexure-export"],
        ),
    ]);
    let all = [
        "flexure",
        "flexure-io",
        "flexure-report",
        "flexure-export",
        "flexure-workbench",
    ];
    for (name, folder) in crates() {
        let manifest = read(&folder.join("Cargo.toml"));
        let (_, dependencies) = manifest.split_once("[dependencies]").unwrap();
        let own = dependencies.split("\n[").next().unwrap().lines();
        let named = own.filter_map(|l| l.split(['.', ' ', '=']).next());
        for used in named.filter(|n| n.starts_with("flexure")) {
            let allowed = below.get(name.as_str()).map_or(&all[..], |b| b);
            assert!(allowed.contains(&used), "{name} depends on {used}");
        }
    }
}

#[test]
fn no_circle_of_imports_has_more_than_three_files() {
    for (name, folder) in crates() {
        let source = Source::read(&folder.join("src"));
        let imports = imports(&source);
        assert!(imports.len() > 5, "{name}: {imports:?}");
        for circle in circles(&imports) {
            assert!(
                circle.len() <= LARGEST_CIRCLE,
                "{name}: these files need each other: {circle:#?}"
            );
        }
    }
}

#[test]
fn circles_are_found_through_groups_inline_paths_and_names_that_are_passed_on() {
    let files = [
        ("", "mod a; mod b;"),
        ("a", "mod x; mod y;\npub use x::Thing;\npub use y::other as renamed;"),
        (
            "a::x",
            "use {std::fmt, crate::b::{c::{C, D}, self}};\n// use super::y::Unused;",
        ),
        (
            "a::y",
            "pub fn f() { crate::a::Thing::new() }\n#[cfg(test)]\nmod tests {\n    use crate::b::c;\n}",
        ),
        ("b", "mod c;"),
        ("b::c", "fn f() { super::super::a::renamed() }"),
    ];
    let modules = |name: &str| name.split("::").filter(|n| !n.is_empty()).map(str::to_owned).collect();
    let files = files.map(|(name, text)| (modules(name), without_tests(text)));
    let source = Source {
        files: files.into_iter().collect(),
    };
    let found = circles(&imports(&source));
    assert_eq!(found, [["a::x", "a::y", "b::c"].map(str::to_owned)]);
}

/// The texts of a crate's files by module, without tests and comments.
struct Source {
    files: BTreeMap<Module, String>,
}

impl Source {
    fn read(src: &Path) -> Source {
        let mut files = BTreeMap::new();
        let mut folders = vec![(src.to_owned(), Module::new())];
        while let Some((folder, module)) = folders.pop() {
            for entry in fs::read_dir(folder).unwrap() {
                let path = entry.unwrap().path();
                let name = path.file_stem().unwrap().to_str().unwrap().to_owned();
                let inner = [module.clone(), vec![name.clone()]].concat();
                if name.ends_with("tests") {
                } else if path.is_dir() {
                    folders.push((path, inner));
                } else if path.extension().is_some_and(|e| e == "rs") {
                    let is_own = ["mod", "lib", "main"].contains(&name.as_str());
                    let module = if is_own { module.clone() } else { inner };
                    files.insert(module, without_tests(&read(&path)));
                }
            }
        }
        Source { files }
    }

    /// What a path from a file names: the modules and names from the crate's root on. Nothing for other crates and own names.
    fn target(&self, file: &Module, path: &[String]) -> Option<Module> {
        let supers = path.iter().take_while(|p| *p == "super").count();
        match path.first()?.as_str() {
            "crate" => Some(path[1..].to_vec()),
            "self" => Some([file, &path[1..]].concat()),
            "super" => Some([&file[..file.len().checked_sub(supers)?], &path[supers..]].concat()),
            child => {
                let is_child = self.files.contains_key(&[file, &[child.to_owned()][..]].concat());
                is_child.then(|| [file, path].concat())
            }
        }
    }
}

/// A file's text without comments and modules for tests.
fn without_tests(text: &str) -> String {
    let mut lines = text.lines().map(|l| l.split("//").next().unwrap());
    let mut kept = String::new();
    while let Some(line) = lines.next() {
        if line.trim() == "#[cfg(test)]" {
            let opening = lines.find(|l| !l.trim().starts_with("#[")).unwrap_or_default();
            if opening.trim_end().ends_with('{') {
                let closing = format!("{}}}", " ".repeat(opening.len() - opening.trim_start().len()));
                lines.find(|l| l.trim_end() == closing);
            }
            continue;
        }
        kept.push_str(line);
        kept.push('\n');
    }
    kept
}

/// A path that a file names, and the name it has there.
struct Named {
    path: Vec<String>,
    name: String,
}

/// The paths of a tree of `use`, such as `a::{b, c::{d, self}}`.
fn expanded(tree: &str) -> Vec<Named> {
    let tree = tree.trim();
    if let Some((before, group)) = tree.split_once('{') {
        let group = group.trim_end().strip_suffix('}').unwrap();
        let mut depth = 0;
        let parts = group.split(|c| {
            depth += i32::from(c == '{') - i32::from(c == '}');
            c == ',' && depth == 0
        });
        let front: Vec<String> = before
            .split("::")
            .filter(|p| !p.trim().is_empty())
            .map(trimmed)
            .collect();
        let inner = parts.filter(|p| !p.trim().is_empty()).flat_map(expanded);
        return inner
            .map(|inner| Named {
                path: [front.clone(), inner.path].concat(),
                ..inner
            })
            .collect();
    }
    let (path, name) = tree.split_once(" as ").unwrap_or((tree, tree));
    let name = trimmed(name.rsplit("::").next().unwrap());
    vec![Named {
        path: path.split("::").map(trimmed).collect(),
        name,
    }]
}

fn trimmed(part: &str) -> String {
    part.trim().to_owned()
}

/// The paths that a text names: those of `use`, and others that begin with `crate` or `super`.
fn named(text: &str) -> Vec<Named> {
    let mut all = Vec::new();
    let mut others = String::new();
    let mut lines = text.lines();
    while let Some(line) = lines.next() {
        let (visibility, tree) = line.trim_start().split_once("use ").unwrap_or(("none", ""));
        if !(visibility.is_empty() || visibility.starts_with("pub")) {
            others.push_str(line);
            others.push('\n');
            continue;
        }
        let mut tree = tree.to_owned();
        while !tree.contains(';') {
            tree.push_str(lines.next().unwrap());
        }
        all.extend(expanded(tree.split(';').next().unwrap()));
    }
    for word in others.split(|c: char| !(c.is_alphanumeric() || c == '_' || c == ':')) {
        if word.starts_with("crate::") || word.starts_with("super::") {
            all.extend(expanded(word.trim_end_matches(':')));
        }
    }
    all
}

/// The files that each file imports, except those that it lies within and those within it.
fn imports(source: &Source) -> BTreeMap<&Module, BTreeSet<&Module>> {
    let mut passed_on: BTreeMap<(&Module, String), Module> = BTreeMap::new();
    let mut uses = Vec::new();
    for (file, text) in &source.files {
        for Named { path, name } in named(text) {
            if let Some(target) = source.target(file, &path) {
                passed_on.insert((file, name), target.clone());
                uses.push((file, target));
            }
        }
    }
    let mut imports: BTreeMap<&Module, BTreeSet<&Module>> = BTreeMap::new();
    for (file, target) in uses {
        let imported = defining(source, &passed_on, target, 0);
        if !imported.starts_with(file) && !file.starts_with(imported) {
            imports.entry(file).or_default().insert(imported);
        }
    }
    imports
}

/// The file that defines what a path names: a `use` may have passed it on.
fn defining<'a>(
    source: &'a Source,
    passed_on: &BTreeMap<(&Module, String), Module>,
    path: Module,
    steps: usize,
) -> &'a Module {
    let lengths = (0..=path.len()).rev();
    let mut files = lengths.filter_map(|n| source.files.get_key_value(&path[..n]));
    let (file, _) = files.next().expect("the crate's root has a file");
    let rest = &path[file.len()..];
    let next = rest.first().and_then(|name| passed_on.get(&(file, name.clone())));
    match next.filter(|next| **next != path && steps < 8) {
        Some(next) => defining(source, passed_on, [next, &rest[1..]].concat(), steps + 1),
        None => file,
    }
}

/// The largest sets of files in which each file needs all others, by name.
fn circles(imports: &BTreeMap<&Module, BTreeSet<&Module>>) -> Vec<Vec<String>> {
    let reached: BTreeMap<&Module, BTreeSet<&Module>> = imports
        .keys()
        .map(|file| {
            let mut reached = BTreeSet::new();
            let mut open = vec![*file];
            while let Some(from) = open.pop() {
                let new = imports.get(from).into_iter().flatten();
                open.extend(new.filter(|to| reached.insert(**to)));
            }
            (*file, reached)
        })
        .collect();
    let mut circles = BTreeSet::new();
    for (file, reaches) in &reached {
        let circle = reaches
            .iter()
            .filter(|other| reached.get(*other).is_some_and(|back| back.contains(file)));
        let circle: Vec<String> = circle.map(|module| module.join("::")).collect();
        if circle.len() > 1 {
            circles.insert(circle);
        }
    }
    circles.into_iter().collect()
}
