//! No two files of a crate import each other, directly or through others.
//!
//! The definition of a name counts: a re-export is followed to its source. A module that declares
//! or re-exports its children does not import them; one that uses a child's items does.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use proc_macro2::{Delimiter, TokenStream, TokenTree};

/// A path of names, such as `["crate", "plan", "Plan"]` without its first one.
type Names = Vec<String>;

/// One file of a crate.
#[derive(Default)]
struct File {
    path: PathBuf,
    children: BTreeSet<String>,
    /// The paths in the file that its imported names stand for.
    imports: BTreeMap<String, Names>,
    /// Every path that the file uses, re-exports excepted.
    paths: BTreeSet<Names>,
    /// Paths that the file re-exports.
    exports: BTreeSet<Names>,
}

/// The files of a crate by module.
struct Crate {
    files: BTreeMap<Names, File>,
}

impl Crate {
    fn read(root: &Path) -> Self {
        let mut files = BTreeMap::new();
        let mut open = vec![(Names::new(), root.to_owned())];
        while let Some((module, path)) = open.pop() {
            let text = fs::read_to_string(&path).expect("a declared module has a file");
            let mut found = vec![];
            words(text.parse().expect("is Rust"), &mut found);
            let mut file = read(&without_tests(&found));
            let folder = if module.is_empty() { path.with_file_name("") } else { path.with_extension("") };
            for child in &file.children {
                open.push((join(&module, child), folder.join(child).with_extension("rs")));
            }
            file.path = path;
            files.insert(module, file);
        }
        Self { files }
    }

    /// The path from the crate's root, or none if it leaves the crate.
    fn absolute(&self, module: &[String], path: &[String]) -> Option<Names> {
        let mut base = module.to_vec();
        let mut rest = path;
        match path[0].as_str() {
            "crate" => base.clear(),
            "self" | "super" => {}
            child if self.files[module].children.contains(child) => {
                return Some([base, rest.to_vec()].concat());
            }
            _ => return None,
        }
        while let Some(("crate" | "self" | "super", below)) = rest.split_first().map(|(a, b)| (a.as_str(), b))
        {
            if rest[0] == "super" {
                base.pop();
            }
            rest = below;
        }
        Some([base, rest.to_vec()].concat())
    }

    /// The module that defines what `path` names, seen from `module`.
    fn source(&self, module: &[String], path: &[String]) -> Option<Names> {
        let mut absolute = self.absolute(module, path)?;
        for _ in 0..8 {
            let n = (0..=absolute.len()).rev().find(|n| self.files.contains_key(&absolute[..*n]))?;
            let (found, rest) = absolute.split_at(n);
            let Some(imported) = rest.first().and_then(|name| self.files[found].imports.get(name)) else {
                return Some(found.to_vec());
            };
            // A name from another crate belongs to no file here.
            absolute = [self.absolute(found, imported)?, rest[1..].to_vec()].concat();
        }
        None
    }

    /// The modules that each module imports, with the names it takes.
    fn imports(&self) -> BTreeMap<&Names, BTreeMap<Names, BTreeSet<String>>> {
        let mut imports = BTreeMap::new();
        for (module, file) in &self.files {
            let targets: &mut BTreeMap<_, BTreeSet<_>> = imports.entry(module).or_default();
            for (path, exported) in file
                .paths
                .iter()
                .map(|path| (path, false))
                .chain(file.exports.iter().map(|path| (path, true)))
            {
                let target = self.source(module, path).filter(|target| target != module);
                if let Some(target) = target.filter(|target| !exported || !target.starts_with(module)) {
                    targets.entry(target).or_default().insert(path.join("::"));
                }
            }
        }
        imports
    }

    /// The shortest cycle through each file, once: its files with the names taken from the next.
    fn cycles(&self) -> BTreeSet<Vec<(String, BTreeSet<String>)>> {
        let imports = self.imports();
        let cycles = imports.keys().filter_map(|start| {
            let mut from: BTreeMap<&Names, &Names> = BTreeMap::new();
            let mut front = vec![*start];
            while !front.is_empty() && !from.contains_key(*start) {
                let mut next = vec![];
                for module in front {
                    for target in imports[module].keys() {
                        if !from.contains_key(target) {
                            from.insert(target, module);
                            next.push(target);
                        }
                    }
                }
                front = next;
            }
            let mut cycle = vec![*from.get(*start)?];
            while cycle[0] != *start {
                cycle.insert(0, from[cycle[0]]);
            }
            let least = (0..cycle.len()).min_by_key(|i| cycle[*i]).unwrap_or_default();
            cycle.rotate_left(least);
            let step = |i: usize| {
                let (module, next) = (cycle[i], cycle[(i + 1) % cycle.len()]);
                (self.files[module].path.display().to_string(), imports[module][next].clone())
            };
            Some((0..cycle.len()).map(step).collect())
        });
        cycles.collect()
    }
}

fn join(module: &[String], child: &str) -> Names {
    [module, &[child.to_owned()]].concat()
}

/// Identifiers, `::` and single signs; without comments and literals.
fn words(tokens: TokenStream, words: &mut Vec<String>) {
    for token in tokens {
        match token {
            TokenTree::Group(group) => {
                let [open, close] = match group.delimiter() {
                    Delimiter::Brace => ["{", "}"],
                    Delimiter::Bracket => ["[", "]"],
                    Delimiter::Parenthesis | Delimiter::None => ["(", ")"],
                };
                words.push(open.to_owned());
                self::words(group.stream(), words);
                words.push(close.to_owned());
            }
            TokenTree::Punct(sign) => match words.last_mut() {
                Some(last) if last == ":" && sign.as_char() == ':' => last.push(':'),
                _ => words.push(sign.to_string()),
            },
            TokenTree::Ident(name) => words.push(name.to_string()),
            TokenTree::Literal(_) => {}
        }
    }
}

/// Omits every item behind `#[cfg(test)]`.
fn without_tests(words: &[String]) -> Vec<String> {
    let mut kept = vec![];
    let mut i = 0;
    while i < words.len() {
        if words[i..].iter().take(7).eq(["#", "[", "cfg", "(", "test", ")", "]"]) {
            let mut depth = 0;
            i += 7;
            while i < words.len() {
                depth += i32::from(words[i] == "{") - i32::from(words[i] == "}");
                i += 1;
                if depth == 0 && matches!(words[i - 1].as_str(), "}" | ";") {
                    break;
                }
            }
        } else {
            kept.push(words[i].clone());
            i += 1;
        }
    }
    kept
}

fn read(words: &[String]) -> File {
    let mut file = File::default();
    let at = |i: usize| words.get(i).map_or("", String::as_str);
    let is_name = |word: &str| word.starts_with(|c: char| c.is_alphabetic() || c == '_');
    let mut i = 0;
    while i < words.len() {
        if at(i) == "mod" && at(i + 2) == ";" {
            file.children.insert(at(i + 1).to_owned());
        }
        if at(i) == "use" {
            let public = i > 0 && matches!(at(i - 1), "pub" | ")");
            let end = i + words[i..].iter().position(|word| word == ";").expect("a use ends");
            let mut leaves = vec![];
            tree(&words[i + 1..end], &[], &mut leaves);
            for (path, name) in leaves {
                file.imports.insert(name, path.clone());
                if public { &mut file.exports } else { &mut file.paths }.insert(path);
            }
            i = end;
        } else if is_name(at(i)) && at(i + 1) == "::" && (i == 0 || at(i - 1) != "::") {
            let mut path = vec![at(i).to_owned()];
            while at(i + 1) == "::" && is_name(at(i + 2)) {
                path.push(at(i + 2).to_owned());
                i += 2;
            }
            file.paths.insert(path);
        }
        i += 1;
    }
    file
}

/// The paths of a `use` with their names.
fn tree(words: &[String], before: &[String], leaves: &mut Vec<(Names, String)>) {
    let mut path = before.to_vec();
    let mut i = 0;
    while i < words.len() {
        match words[i].as_str() {
            "{" => {
                let mut depth = 0;
                let mut start = i + 1;
                for j in i..words.len() {
                    depth += i32::from(words[j] == "{") - i32::from(words[j] == "}");
                    if (depth == 1 && words[j] == ",") || depth == 0 {
                        tree(&words[start..j], &path, leaves);
                        start = j + 1;
                    }
                }
                return;
            }
            "::" | "*" => {}
            "as" => {
                leaves.push((path, words[i + 1].clone()));
                return;
            }
            "self" if !path.is_empty() => {}
            name => path.push(name.to_owned()),
        }
        i += 1;
    }
    if let Some(name) = path.last().filter(|_| path.len() > before.len() || !words.is_empty()) {
        leaves.push((path.clone(), name.clone()));
    }
}

#[test]
fn no_two_files_of_a_crate_import_each_other() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let manifest = fs::read_to_string(root.join("Cargo.toml")).expect("the workspace has a manifest");
    let mut lines = manifest.lines();
    let members = lines.find(|line| line.starts_with("members"));
    let members = members.expect("has members").split('"').skip(1).step_by(2);
    let roots =
        members.flat_map(|member| ["lib.rs", "main.rs"].map(|name| root.join(member).join("src").join(name)));
    let (mut found, mut n_files) = (BTreeSet::new(), 0);
    for path in roots.filter(|path| path.exists()) {
        let source = Crate::read(&path);
        n_files += source.files.len();
        found.extend(source.cycles());
    }
    assert!(n_files > 200, "{n_files} files are read");
    assert!(found.is_empty(), "these files import each other: {found:#?}");
}
