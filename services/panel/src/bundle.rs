//! Joins the page's modules to one script. Over a slow network one answer then brings all of it,
//! and leaves room for STOP.
//!
//! Each module becomes a function that is called once, in the order in which they import each
//! other:
//!
//! ```text
//!   import { put } from "../words/words.js";    const { put } = $words_words;
//!   export function doing(robot) {              function doing(robot) {
//!                                               return { doing };
//! ```
//!
//! An `import` stands in one line and names the things that it imports. An `export` stands before
//! its `const`, `function` or `class`. The page's modules use no other form, and a test checks
//! that. A module may wait: an `await` outside its functions begins a line. Indentation, empty lines and
//! comments that have lines of their own are left out, but not from what others have written
//! (`vendor/`): their licence stands there.
//!
//! What the page needs later is a script of its own, which shares the modules of the first one:
//!
//! ```text
//!   export { $words_words, … };                 the end of the first script
//!
//!   import { $words_words } from "../main.js";  the head of the later one
//!   …
//!   export const { Signals } = $signals_signals;
//! ```

use std::collections::BTreeSet;
use std::fmt::Write as _;

/// A script with all its modules.
#[derive(Debug, Default)]
pub(crate) struct Bundle {
    pub(crate) script: String,
    /// The names of the modules that are in it.
    modules: BTreeSet<String>,
    /// Those that it takes from the first script.
    shared: BTreeSet<String>,
}

/// The module `entry`, such as `main.js`, with everything that it imports. `source` returns a
/// module's text.
pub(crate) fn bundle<'s>(entry: &str, source: impl Fn(&str) -> Option<&'s str>) -> Bundle {
    let mut bundle = Bundle::default();
    bundle.add(entry, &source, &BTreeSet::new());
    let all = constants(&bundle.modules);
    let _ = writeln!(bundle.script, "export {{ {all} }};");
    bundle
}

/// The module `entry`, which a page fetches later, with what the page does not have from the script
/// `first`, whose name is `from`.
pub(crate) fn later<'s>(
    entry: &str,
    source: impl Fn(&str) -> Option<&'s str>,
    first: &Bundle,
    from: &str,
) -> Bundle {
    let mut bundle = Bundle::default();
    let exports = bundle.add(entry, &source, &first.modules);
    let up = "../".repeat(entry.matches('/').count());
    bundle.script = format!(
        "import {{ {} }} from \"{up}{from}\";\n{}export const {{ {exports} }} = {};\n",
        constants(&bundle.shared),
        bundle.script,
        constant(entry),
    );
    bundle
}

/// The constants of these modules.
fn constants(modules: &BTreeSet<String>) -> String {
    let all: Vec<_> = modules.iter().map(|name| constant(name)).collect();
    all.join(", ")
}

/// The constant that holds what a module exports.
pub(crate) fn constant(name: &str) -> String {
    format!("${}", name.trim_end_matches(".js").replace('/', "_"))
}

impl Bundle {
    /// Adds a module, and before it what it imports; returns the names that it exports. What is in
    /// `first` is shared.
    fn add<'s>(
        &mut self,
        name: &str,
        source: &impl Fn(&str) -> Option<&'s str>,
        first: &BTreeSet<String>,
    ) -> String {
        if first.contains(name) {
            self.shared.insert(name.to_owned());
            return String::new();
        }
        let added = source(name).filter(|_| self.modules.insert(name.to_owned()));
        let Some(text) = added else {
            return String::new();
        };
        let is_ours = !name.starts_with("vendor/");
        let mut body = String::new();
        let mut exports = Vec::new();
        let mut is_comment = false;
        let waits = text.lines().any(|line| line.starts_with("await "));
        for line in text.lines() {
            let begins = line.trim_start();
            if is_comment || (is_ours && begins.starts_with("/**")) {
                is_comment = !line.ends_with("*/");
            } else if let Some((wanted, from)) = import(line) {
                let from = beside(name, from);
                self.add(&from, source, first);
                let _ = writeln!(body, "const {{ {wanted} }} = {};", constant(&from));
            } else if let Some(rest) = line.strip_prefix("export ") {
                exports.extend(exported(rest));
                body.push_str(rest);
                body.push('\n');
            } else if !(is_ours && (begins.is_empty() || begins.starts_with("//"))) {
                body.push_str(if is_ours { begins } else { line });
                body.push('\n');
            }
        }
        let exports = exports.join(", ");
        let constant = constant(name);
        let (before, begins) = if waits {
            ("await ", "async ")
        } else {
            ("", "")
        };
        let _ = write!(
            self.script,
            "const {constant} = {before}({begins}() => {{\n{body}return {{ {exports} }};\n}})();\n"
        );
        exports
    }
}

/// What a line imports, and from which module.
fn import(line: &str) -> Option<(&str, &str)> {
    let (wanted, from) = line.strip_prefix("import { ")?.split_once(" } from \"")?;
    Some((wanted, from.strip_suffix("\";")?))
}

/// The module that `from` means in the module `name`: `../words/words.js` in `map/map.js` is
/// `words/words.js`.
fn beside(name: &str, from: &str) -> String {
    let mut folders: Vec<&str> = name.split('/').collect();
    folders.pop();
    for part in from.split('/') {
        match part {
            "." => {}
            ".." => drop(folders.pop()),
            part => folders.push(part),
        }
    }
    folders.join("/")
}

/// The name that a line exports.
fn exported(rest: &str) -> Option<&str> {
    let rest = rest.strip_prefix("async ").unwrap_or(rest);
    let (_, rest) = ["const ", "function ", "class "].iter().find_map(|word| {
        rest.split_once(word)
            .filter(|(before, _)| before.is_empty())
    })?;
    rest.split(|letter: char| !letter.is_ascii_alphanumeric() && letter != '_')
        .next()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn modules_become_one_script_each_once_and_before_who_needs_it() {
        let source = |name: &str| match name {
            "main.js" => Some(
                "import { b } from \"./in/b.js\";\nimport { c, d } from \"./c.js\";\nawait b(c);\n",
            ),
            "in/b.js" => Some(
                "// What b is.\n\n/** Of one line. */\n  /**\n   * Of more.\n   */\nimport { c } from \"../c.js\";\nexport function b(x) {\n  return x + c;\n}\n",
            ),
            "c.js" => Some("export const c = 1;\nexport class d {}\nconst hidden = 2;\n"),
            _ => None,
        };
        assert_eq!(
            bundle("main.js", source).script,
            "const $c = (() => {\nconst c = 1;\nclass d {}\nconst hidden = 2;\nreturn { c, d };\n})();\n\
             const $in_b = (() => {\nconst { c } = $c;\nfunction b(x) {\nreturn x + c;\n}\nreturn { b };\n})();\n\
             const $main = await (async () => {\nconst { b } = $in_b;\nconst { c, d } = $c;\nawait b(c);\nreturn {  };\n})();\n\
             export { $c, $in_b, $main };\n"
        );
    }

    #[test]
    fn a_later_script_shares_the_modules_of_the_first_and_leaves_what_others_wrote_as_it_is() {
        let source = |name: &str| match name {
            "main.js" => Some("import { a } from \"./a/a.js\";\na();\n"),
            "a/a.js" => Some("export const a = 1;\n"),
            "in/late.js" => Some(
                "import { a } from \"../a/a.js\";\nimport { V } from \"../vendor/v.js\";\nexport const l = V(a);\n",
            ),
            "vendor/v.js" => Some("/** A licence. */\n// A line.\nvar v;\nexport const V = v;\n"),
            _ => None,
        };
        let first = bundle("main.js", source);
        assert_eq!(
            later("in/late.js", source, &first, "main.js").script,
            "import { $a_a } from \"../main.js\";\n\
             const $vendor_v = (() => {\n/** A licence. */\n// A line.\nvar v;\nconst V = v;\nreturn { V };\n})();\n\
             const $in_late = (() => {\nconst { a } = $a_a;\nconst { V } = $vendor_v;\nconst l = V(a);\nreturn { l };\n})();\n\
             export const { l } = $in_late;\n"
        );
    }
}
