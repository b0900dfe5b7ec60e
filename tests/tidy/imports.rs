//! Finds the files of a crate that import each other in a circle. It reads their source, and knows
//! just enough of Rust to find `use` declarations and paths.
//!
//! A path is followed through `use` declarations that only re-export a name, to the file that
//! defines it. Code written by a macro and code reached by a method call are not seen.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// The path of a module in its crate; the root's is empty.
pub(crate) type Module = Vec<String>;

/// The modules of one crate that have files of their own, and their imports of each other.
pub(crate) struct Crate {
    files: BTreeMap<Module, PathBuf>,
    paths: BTreeMap<Module, Vec<Named>>,
}

/// A path that a file names.
struct Named {
    /// The modules inside the file that contain the path.
    within: Vec<String>,
    segments: Vec<String>,
    /// The path is in a `use` at the top of the file.
    is_passed_on: bool,
}

impl Crate {
    /// Reads all files below `source`, a crate's `src`.
    pub(crate) fn read(source: &Path, files: impl IntoIterator<Item = PathBuf>) -> Self {
        let files: BTreeMap<Module, PathBuf> = files
            .into_iter()
            .map(|file| (module(file.strip_prefix(source).expect("below src")), file))
            .collect();
        let paths = files
            .iter()
            .map(|(module, file)| {
                let text = std::fs::read_to_string(file).expect("a readable file");
                (module.clone(), named(&tokens(&text)))
            })
            .collect();
        Self { files, paths }
    }

    /// The circles of modules that import each other, by the names of the modules of one folder.
    ///
    /// A module includes everything below it. Imports between a module and its own parts do not
    /// count, and an import of a part counts as one of the module.
    pub(crate) fn circles(&self) -> Vec<String> {
        let mut side_by_side: BTreeMap<&[String], BTreeMap<&str, BTreeSet<&str>>> = BTreeMap::new();
        let imports = self.imports();
        for (from, to) in &imports {
            let shared = from.iter().zip(to).take_while(|(a, b)| a == b).count();
            if let (Some(one), Some(other)) = (from.get(shared), to.get(shared)) {
                let level = side_by_side.entry(&from[..shared]).or_default();
                level.entry(one).or_default().insert(other);
            }
        }
        let mut circles = Vec::new();
        for (level, uses) in side_by_side {
            let mut seen = BTreeSet::new();
            for name in uses.keys() {
                let circle: Vec<&str> = uses
                    .keys()
                    .filter(|other| leads(&uses, name, other) && leads(&uses, other, name))
                    .copied()
                    .collect();
                if !circle.is_empty() && seen.insert(circle.clone()) {
                    let prefix: String = level.iter().map(|part| format!("{part}::")).collect();
                    circles.push(format!("{prefix}{{{}}}", circle.join(", ")));
                }
            }
        }
        circles
    }

    /// Every pair of modules of which the first names an item of the second.
    fn imports(&self) -> BTreeSet<(Module, Module)> {
        let mut passed_on: BTreeMap<(Module, String), (Module, Vec<String>)> = BTreeMap::new();
        for (module, named) in self.all() {
            if named.is_passed_on
                && let Some((to, rest)) = self.resolve(module, named)
                && let Some(name) = named.segments.last()
                && to != *module
                && !rest.is_empty()
            {
                passed_on.insert((module.clone(), name.clone()), (to, rest));
            }
        }
        let mut imports = BTreeSet::new();
        for (module, named) in self.all() {
            let Some((mut to, mut rest)) = self.resolve(module, named) else {
                continue;
            };
            // More steps than any real path has.
            for _ in 0..8 {
                let Some(name) = rest.first() else {
                    break;
                };
                let Some((next, behind)) = passed_on.get(&(to.clone(), name.clone())) else {
                    break;
                };
                to = next.clone();
                rest = [behind, &rest[1..]].concat();
            }
            if to != *module {
                imports.insert((module.clone(), to));
            }
        }
        imports
    }

    fn all(&self) -> impl Iterator<Item = (&Module, &Named)> {
        let each = |(module, paths)| std::iter::repeat(module).zip(paths);
        self.paths.iter().flat_map(each)
    }

    /// The module to which a path leads, and the rest of the path; `None` if that is another crate.
    fn resolve(&self, module: &Module, named: &Named) -> Option<(Module, Vec<String>)> {
        let mut at: Module = [module.clone(), named.within.clone()].concat();
        let mut rest = named.segments.as_slice();
        match rest.first()?.as_str() {
            "crate" => {
                at.clear();
                rest = &rest[1..];
            }
            "super" | "self" => {
                while let [first, behind @ ..] = rest
                    && ["super", "self"].contains(&first.as_str())
                {
                    if first == "super" {
                        at.pop();
                    }
                    rest = behind;
                }
            }
            child
                if self
                    .files
                    .contains_key(&[&at[..], &[child.to_owned()]].concat()) => {}
            _ => return None,
        }
        while let [first, behind @ ..] = rest {
            let below = [&at[..], std::slice::from_ref(first)].concat();
            if !self.files.contains_key(&below) {
                break;
            }
            (at, rest) = (below, behind);
        }
        // A module inside a file belongs to the file.
        while !self.files.contains_key(&at) {
            at.pop();
        }
        Some((at, rest.to_vec()))
    }
}

/// Whether `from` uses `to`, directly or through others.
fn leads(uses: &BTreeMap<&str, BTreeSet<&str>>, from: &str, to: &str) -> bool {
    let mut seen = BTreeSet::new();
    let mut open: Vec<&str> = uses.get(from).into_iter().flatten().copied().collect();
    while let Some(next) = open.pop() {
        if next == to {
            return true;
        }
        if seen.insert(next) {
            open.extend(uses.get(next).into_iter().flatten());
        }
    }
    false
}

/// The module of a file below `src`.
fn module(file: &Path) -> Module {
    let mut parts: Module = file
        .with_extension("")
        .components()
        .map(|part| part.as_os_str().to_string_lossy().into_owned())
        .collect();
    let last = parts.last().map(String::as_str);
    if last == Some("mod") || (parts.len() == 1 && matches!(last, Some("lib" | "main"))) {
        parts.pop();
    }
    parts
}

/// The words and signs of a source, without comments, strings and characters.
fn tokens(text: &str) -> Vec<String> {
    let mut tokens = Vec::new();
    let mut rest = text;
    while let Some(first) = rest.chars().next() {
        let is_word = |c: char| c.is_alphanumeric() || c == '_';
        let length = if rest.starts_with("//") {
            rest.find('\n').unwrap_or(rest.len())
        } else if rest.starts_with("/*") {
            rest.find("*/").map_or(rest.len(), |end| end + 2)
        } else if let Some(length) = string(rest) {
            length
        } else if is_word(first) {
            let length = rest.find(|c| !is_word(c)).unwrap_or(rest.len());
            tokens.push(rest[..length].to_owned());
            length
        } else if rest.starts_with("::") {
            tokens.push("::".to_owned());
            2
        } else {
            if !first.is_whitespace() {
                tokens.push(first.to_string());
            }
            first.len_utf8()
        };
        rest = &rest[length..];
    }
    tokens
}

/// The length of the string or character literal with which `text` begins.
fn string(text: &str) -> Option<usize> {
    let body = text.strip_prefix('b').unwrap_or(text);
    let before = text.len() - body.len();
    if let Some(raw) = body.strip_prefix('r') {
        let hashes = raw.len() - raw.trim_start_matches('#').len();
        if raw[hashes..].starts_with('"') {
            let end = format!("\"{}", "#".repeat(hashes));
            let from = before + 1 + hashes + 1;
            return Some(from + text[from..].find(&end)? + end.len());
        }
    }
    let quote = body.chars().next().filter(|c| ['"', '\''].contains(c))?;
    let mut escaped = false;
    let mut length = 0;
    for (at, c) in body.char_indices().skip(1) {
        length += 1;
        match c {
            // A lifetime is not a character literal.
            _ if quote == '\''
                && length > 1
                && !escaped
                && c != '\''
                && !body.starts_with("'\\") =>
            {
                return None;
            }
            _ if escaped => escaped = false,
            '\\' => escaped = true,
            _ if c == quote => return Some(before + at + 1),
            _ => {}
        }
    }
    None
}

/// The paths in a source.
fn named(tokens: &[String]) -> Vec<Named> {
    let mut found = Vec::new();
    let mut within: Vec<(String, usize)> = Vec::new();
    let mut depth = 0;
    let mut at = 0;
    let token = |at: usize| tokens.get(at).map_or("", String::as_str);
    let is_name = |at: usize| token(at).starts_with(|c: char| c.is_alphabetic() || c == '_');
    while at < tokens.len() {
        let inside = || within.iter().map(|(name, _)| name.clone()).collect();
        match token(at) {
            "mod" if token(at + 2) == "{" => {
                within.push((token(at + 1).to_owned(), depth));
                depth += 1;
                at += 3;
            }
            "{" => {
                depth += 1;
                at += 1;
            }
            "}" => {
                depth -= 1;
                within.retain(|(_, outside)| *outside < depth);
                at += 1;
            }
            // Not `use<>`, which lists what a returned `impl` captures.
            "use" if token(at + 1) != "<" => {
                let mut uses = Vec::new();
                at = tree(tokens, at + 1, &[], &mut uses);
                found.extend(uses.into_iter().map(|segments| Named {
                    within: inside(),
                    segments,
                    is_passed_on: depth == 0,
                }));
            }
            _ if is_name(at) && token(at + 1) == "::" && (at == 0 || token(at - 1) != "::") => {
                let mut segments = vec![token(at).to_owned()];
                at += 1;
                while token(at) == "::" && is_name(at + 1) {
                    segments.push(token(at + 1).to_owned());
                    at += 2;
                }
                found.push(Named {
                    within: inside(),
                    segments,
                    is_passed_on: false,
                });
            }
            _ => at += 1,
        }
    }
    found
}

/// Reads one tree of a `use` from `at` on; returns the position of its end.
fn tree(
    tokens: &[String],
    mut at: usize,
    before: &[String],
    found: &mut Vec<Vec<String>>,
) -> usize {
    let mut path = before.to_vec();
    loop {
        match tokens.get(at).map(String::as_str) {
            Some("::") => at += 1,
            Some("{") => {
                at += 1;
                while tokens.get(at).is_some_and(|token| token != "}") {
                    at = tree(tokens, at, &path, found);
                    at += usize::from(tokens.get(at).is_some_and(|token| token == ","));
                }
                return at + 1;
            }
            Some("as") => at += 2,
            Some("," | "}" | ";") | None => {
                // `self` in braces means the module before them.
                if path.len() > 1 && path.last().is_some_and(|last| last == "self") {
                    path.pop();
                }
                found.push(path);
                return at;
            }
            Some(name) => {
                path.push(name.to_owned());
                at += 1;
            }
        }
    }
}

#[test]
fn paths_are_found_wherever_they_stand_and_nowhere_else() {
    let source = r##"
        //! crate::not::this
        use crate::a::{self, b::C as D, e::*};
        use super::f;
        const S: &str = r#"crate::nor::this "quoted" "#;
        fn g<'a>(h: &'a crate::i::J) { 'x'; let _ = "crate::nor::\"that"; b'\''; k::l(); }
        mod tests { use super::*; fn m() { { super::n::o() } } }
        fn o() -> impl Copy + use<> { [1; 2] }
        use crate::p;
    "##;
    let found: Vec<(String, String)> = named(&tokens(source))
        .into_iter()
        .map(|named| (named.within.join("::"), named.segments.join("::")))
        .collect();
    let expected = [
        ("", "crate::a"),
        ("", "crate::a::b::C"),
        ("", "crate::a::e::*"),
        ("", "super::f"),
        ("", "crate::i::J"),
        ("", "k::l"),
        ("tests", "super::*"),
        ("tests", "super::n::o"),
        ("", "crate::p"),
    ];
    let expected = expected.map(|(within, path)| (within.to_owned(), path.to_owned()));
    assert_eq!(found, expected);
}

#[test]
fn a_circle_is_found_through_what_is_passed_on_and_through_parts() {
    let check = |files: &[(&str, &str)]| {
        let file = |path: &str| module(Path::new(path));
        let each = |(path, _): &(&str, &str)| (file(path), PathBuf::from(path));
        let paths = |(path, text): &(&str, &str)| (file(path), named(&tokens(text)));
        let one = Crate {
            files: files.iter().map(each).collect(),
            paths: files.iter().map(paths).collect(),
        };
        one.circles()
    };
    // A module with its part, and a root that re-exports items of both: no circle.
    let honest = [
        ("lib.rs", "mod a; mod b; pub use b::B;"),
        ("a/mod.rs", "mod c; use c::C; use crate::B;"),
        ("a/c.rs", "use super::A;"),
        ("b.rs", "pub struct B;"),
    ];
    assert_eq!(check(&honest), [""; 0]);
    let mut circle = honest;
    circle[3] = ("b.rs", "fn f(c: crate::a::C) {}");
    assert_eq!(check(&circle), ["{a, b}"]);
    let three = [
        ("lib.rs", ""),
        ("a.rs", "use crate::b::Y;"),
        ("b.rs", "use crate::c::Z;"),
        ("c.rs", "use crate::a::X;"),
        ("d.rs", "use crate::a::X;"),
    ];
    assert_eq!(check(&three), ["{a, b, c}"]);
    let below = [
        ("main.rs", ""),
        ("m.rs", ""),
        ("m/x.rs", "use super::y::Y;"),
        ("m/y.rs", "use crate::m::x::X;"),
    ];
    assert_eq!(check(&below), ["m::{x, y}"]);
}
