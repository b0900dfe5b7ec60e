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
//! that. Comments that have lines of their own are left out.

use std::collections::BTreeSet;
use std::fmt::Write as _;

/// The module `entry`, such as `main.js`, with everything that it imports. `source` returns a
/// module's text.
pub(crate) fn bundle<'s>(entry: &str, source: impl Fn(&str) -> Option<&'s str>) -> String {
    let mut script = String::new();
    add(entry, &source, &mut BTreeSet::new(), &mut script);
    script
}

/// The constant that holds what a module exports.
pub(crate) fn constant(name: &str) -> String {
    format!("${}", name.trim_end_matches(".js").replace('/', "_"))
}

fn add<'s>(
    name: &str,
    source: &impl Fn(&str) -> Option<&'s str>,
    added: &mut BTreeSet<String>,
    script: &mut String,
) {
    let Some(text) = source(name).filter(|_| added.insert(name.to_owned())) else {
        return;
    };
    let mut body = String::new();
    let mut exports = Vec::new();
    let mut is_comment = false;
    for line in text.lines() {
        let begins = line.trim_start();
        if is_comment || begins.starts_with("/**") {
            is_comment = !line.ends_with("*/");
        } else if let Some((wanted, from)) = import(line) {
            let from = beside(name, from);
            add(&from, source, added, script);
            let _ = writeln!(body, "const {{ {wanted} }} = {};", constant(&from));
        } else if let Some(rest) = line.strip_prefix("export ") {
            exports.extend(exported(rest));
            body.push_str(rest);
            body.push('\n');
        } else if !begins.starts_with("//") {
            body.push_str(line);
            body.push('\n');
        }
    }
    let exports = exports.join(", ");
    let constant = constant(name);
    let _ = write!(
        script,
        "const {constant} = (() => {{\n{body}return {{ {exports} }};\n}})();\n"
    );
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
            "main.js" => {
                Some("import { b } from \"./in/b.js\";\nimport { c, d } from \"./c.js\";\nb(c);\n")
            }
            "in/b.js" => Some(
                "// What b is.\n/** Of one line. */\n  /**\n   * Of more.\n   */\nimport { c } from \"../c.js\";\nexport function b(x) {\n  return x + c;\n}\n",
            ),
            "c.js" => Some("export const c = 1;\nexport class d {}\nconst hidden = 2;\n"),
            _ => None,
        };
        assert_eq!(
            bundle("main.js", source),
            "const $c = (() => {\nconst c = 1;\nclass d {}\nconst hidden = 2;\nreturn { c, d };\n})();\n\
             const $in_b = (() => {\nconst { c } = $c;\nfunction b(x) {\n  return x + c;\n}\nreturn { b };\n})();\n\
             const $main = (() => {\nconst { b } = $in_b;\nconst { c, d } = $c;\nb(c);\nreturn {  };\n})();\n"
        );
    }
}
