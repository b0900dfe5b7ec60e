//! The page's files, which are part of the program: a browser fetches nothing from elsewhere. The
//! panel sends the modules of a page as one script (`bundle`). The button STOP has the robot's name
//! before that script runs.

use std::collections::BTreeMap;
use std::hash::{DefaultHasher, Hash as _, Hasher as _};
use std::sync::{LazyLock, Mutex, PoisonError};

use lager_floor::SideLength;
use lager_orders::Sentence;
use miniz_oxide::deflate::compress_to_vec_zlib;

use crate::bundle::{Bundle, bundle, later};

/// Name and content of each, in the order of their names; `build.rs` lists them.
const FILES: &[(&str, &str)] = include!(concat!(env!("OUT_DIR"), "/files.rs"));

const HTML: &str = "text/html; charset=utf-8";
const SCRIPT: &str = "text/javascript; charset=utf-8";
const STYLE: &str = "text/css; charset=utf-8";

/// The headers of each answer. With them a browser runs only the page's own files, and lets it talk
/// only to its own socket.
pub(crate) const HEADERS: &[(&str, &str)] = &[
    (
        "content-security-policy",
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src data:; connect-src 'self'; \
         base-uri 'none'; form-action 'self'; frame-ancestors 'none'",
    ),
    ("x-content-type-options", "nosniff"),
    // With `no-referrer` a form would not say which page it stands on.
    ("referrer-policy", "same-origin"),
    ("cross-origin-opener-policy", "same-origin"),
    ("cross-origin-resource-policy", "same-origin"),
    ("cache-control", "no-cache"),
];

/// The scripts that the pages run, with all their modules.
static BUNDLES: LazyLock<Vec<(&str, Bundle)>> = LazyLock::new(|| {
    let [main, screen] = ["main.js", "screen.js"].map(|entry| bundle(entry, written));
    let views = LATER.map(|entry| (entry, later(entry, written, &main, "main.js")));
    let pages = [("main.js", main), ("screen.js", screen)];
    pages.into_iter().chain(views).collect()
});
/// What a page fetches when somebody opens it: a script of its own. That of the signals has a library
/// of plots.
const LATER: [&str; 6] = [
    "signals/signals.js",
    "setup/editor.js",
    "commission/commission.js",
    "line/line.js",
    "health/health.js",
    "log/recording.js",
];
/// The words of each language. A page fetches those that its reader wants.
const LANGUAGES: [&str; 2] = ["words/en.js", "words/sv.js"];

/// How such a view looks, which it fetches itself.
const LATER_LOOK: &str = "commission/commission.css";

/// How the page looks: the parts of each folder, and then what holds for all of it, the rules for
/// small and for large screens included. Comments, and what only sets lines apart, are left out.
static LOOK: LazyLock<String> = LazyLock::new(|| {
    let (of_all, of_parts): (Vec<_>, Vec<_>) = FILES
        .iter()
        .filter(|(name, _)| name.ends_with(".css") && *name != LATER_LOOK)
        .partition(|(name, _)| !name.contains('/'));
    let sheets = of_parts.iter().chain(&of_all);
    let all: String = sheets.map(|(_, content)| *content).collect();
    let parts = all.split("/*").enumerate();
    let rules = parts.map(|(index, part)| match index {
        0 => part,
        _ => part.split_once("*/").map_or(part, |(_, rules)| rules),
    });
    let rules: String = rules.collect();
    let lines: Vec<_> = rules.lines().map(str::trim).collect();
    // No text of a rule holds one of these.
    const SPACED: [&str; 7] = ["{ ", " {", "} ", "; ", ": ", ", ", " > "];
    let close = |rules: String, spaced: &&str| rules.replace(spaced, spaced.trim());
    let closed = SPACED.iter().fold(lines.join(" "), close);
    closed.replace(";}", "}")
});

/// The words of each language with its sentences: what stands in the table, the page never says
/// otherwise.
static WORDS: LazyLock<[String; 2]> = LazyLock::new(|| {
    LANGUAGES.map(|language| {
        let sentences = Sentence::all().map(|sentence| {
            let is_swedish = language == "words/sv.js";
            let said = if is_swedish {
                sentence.swedish
            } else {
                sentence.english
            };
            // A name needs quotation marks only where it has a hyphen.
            let quotes = if sentence.name.contains('-') {
                "\""
            } else {
                ""
            };
            let name = [quotes, sentence.name, quotes].concat();
            (
                sentence.name,
                format!("{name}: {},", serde_json::json!(said)),
            )
        });
        // Names beside their like pack better.
        let sentences: BTreeMap<_, _> = sentences.collect();
        let sentences = sentences.into_values().collect::<Vec<_>>().concat();
        let words = written(language).unwrap_or_default();
        format!("{words}export const SENTENCES = {{{sentences}}};\n")
    })
});

/// The sentences of a commissioning in both languages, as a script: few pages fetch it.
static COMMISSION: LazyLock<String> = LazyLock::new(|| {
    let table = |text: fn(Sentence) -> &'static str| {
        let line = |sentence: Sentence| {
            let (name, said) = (sentence.name, serde_json::json!(text(sentence)));
            format!("{name}: {said},")
        };
        lager_commission::sentences().map(line).collect::<String>()
    };
    let english = table(|sentence| sentence.english);
    let swedish = table(|sentence| sentence.swedish);
    format!("export const SENTENCES = {{ en: {{{english}}}, sv: {{{swedish}}} }};\n")
});

/// The limits of a floor, as a script: the page has no others.
static LIMITS: LazyLock<String> = LazyLock::new(|| {
    let limits = serde_json::json!({
        "squares": lager_floor::MAX_SQUARES,
        "leastSideCm": SideLength::MIN_CM,
        "mostSideCm": SideLength::MAX_CM,
        "goods": lager_floor::MAX_PRODUCTS,
    });
    format!("export const LIMITS = {limits};\n")
});

/// Which edition of the page this program has, as a hash of all its files. A page that a browser
/// opened before the program was replaced has another one.
pub(crate) static EDITION: LazyLock<String> = LazyLock::new(|| {
    let mut hasher = DefaultHasher::new();
    (FILES, &*WORDS, &*LIMITS, &*COMMISSION).hash(&mut hasher);
    format!("{:016x}", hasher.finish())
});

/// A file as it is written.
fn written(name: &str) -> Option<&'static str> {
    if name == "setup/limits.js" {
        return Some(&LIMITS);
    }
    if name == "commission/sentences.js" {
        return Some(&COMMISSION);
    }
    let found = FILES.iter().find(|(file, _)| *file == name)?;
    Some(found.1)
}

/// Type and content of a file as it is sent, for a page that shows `robot`; empty: none is chosen.
pub(crate) fn file(path: &str, robot: &str) -> Option<(&'static str, String)> {
    let name = match path.strip_prefix('/')? {
        "" => "index.html",
        "screen" => "screen.html",
        name => name,
    };
    if name == "style.css" {
        return Some((STYLE, LOOK.clone()));
    }
    if let Some((_, bundle)) = BUNDLES.iter().find(|(entry, _)| *entry == name) {
        return Some((SCRIPT, bundle.script.clone()));
    }
    if let Some(at) = LANGUAGES.iter().position(|language| *language == name) {
        return Some((SCRIPT, WORDS.get(at)?.clone()));
    }
    let content = written(name)?;
    Some(match name.rsplit_once('.')?.1 {
        "html" => {
            let lines: Vec<_> = content.lines().map(str::trim_start).collect();
            let content = lines.join("\n").replace("{robot}", robot);
            (HTML, content.replace("{edition}", &EDITION))
        }
        "css" => (STYLE, content.to_owned()),
        _ => (SCRIPT, content.to_owned()),
    })
}

/// A file as it is sent to who takes it packed: in zlib's form, which HTTP calls `deflate`.
pub(crate) fn packed(path: &str, content: &str) -> Vec<u8> {
    static PACKED: Mutex<BTreeMap<String, Vec<u8>>> = Mutex::new(BTreeMap::new());
    let pack = || compress_to_vec_zlib(content.as_bytes(), 9);
    // A page has the name of its robot in it.
    if ["/", "/screen"].contains(&path) {
        return pack();
    }
    let mut packed = PACKED.lock().unwrap_or_else(PoisonError::into_inner);
    let packed = packed.entry(path.to_owned()).or_insert_with(pack);
    packed.clone()
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    /// What a browser needs for the first view.
    const FIRST: [&str; 5] = ["/", "/style.css", "/early.js", "/main.js", "/words/sv.js"];

    #[test]
    fn every_file_has_a_type_and_they_are_not_large() {
        for (name, _) in FILES {
            let (_, ending) = name.rsplit_once('.').unwrap();
            assert!(["js", "css", "html"].contains(&ending), "{name}");
        }
        let bytes: usize = FIRST
            .iter()
            .map(|path| file(path, "r1").unwrap().1.len())
            .sum();
        assert!(bytes < 310_000, "{bytes}");
        assert!(LOOK.contains("#setup-bar") && !LOOK.contains("*/"));
    }

    /// How many bytes of these go over the network.
    fn carried(paths: &[&str]) -> usize {
        let packed = paths.iter().map(|path| {
            let (_, content) = file(path, "r1").unwrap();
            let packed = packed(path, &content);
            let unpacked = miniz_oxide::inflate::decompress_to_vec_zlib(&packed);
            assert_eq!(unpacked.unwrap(), content.as_bytes(), "{path}");
            packed.len()
        });
        packed.sum()
    }

    #[test]
    fn what_a_slow_network_carries_is_small_and_unpacks_to_the_same() {
        let first = carried(&FIRST);
        assert!(first < 88_400, "{first}");
        let later = carried(
            &LATER
                .map(|name| format!("/{name}"))
                .each_ref()
                .map(String::as_str),
        );
        assert!(later < 60_000, "{later}");
    }

    #[test]
    fn modules_import_and_export_as_one_script_can_hold_them() {
        let scripts = || FILES.iter().filter(|(name, _)| name.ends_with(".js"));
        for (name, content) in scripts() {
            for line in content.lines().filter(|line| line.starts_with("import")) {
                let is_one = line.starts_with("import { ") && line.ends_with(".js\";");
                assert!(is_one && !line.contains(" as "), "{name}: {line}");
            }
            for line in content.lines().filter(|line| line.starts_with("export")) {
                let rest = line
                    .trim_start_matches("export ")
                    .trim_start_matches("async ");
                let mut kinds = ["const ", "function ", "class "].iter();
                assert!(kinds.any(|kind| rest.starts_with(kind)), "{name}: {line}");
            }
            // The script has no indentation, so no text may go on in a further line.
            let code = content.lines().map(str::trim_start).filter(|line| {
                !["//", "/**", "*"]
                    .iter()
                    .any(|begin| line.starts_with(begin))
            });
            for line in code.filter(|_| !name.starts_with("vendor/")) {
                assert!(line.matches('`').count() % 2 == 0, "{name}: {line}");
            }
        }
        // Each module is in one of the page's scripts, but for the other page's and the first script.
        let content = |name: &str| file(&format!("/{name}"), "").unwrap().1;
        let (main, later) = (content("main.js"), LATER.map(content));
        for (name, _) in scripts() {
            let begins = format!("const {} = ", crate::bundle::constant(name));
            let bundles = later.iter().chain([&main]);
            let times = bundles.filter(|script| script.contains(&begins)).count();
            let others = ["early.js", "screen.js"].contains(name) || LANGUAGES.contains(name);
            assert_eq!(times, usize::from(!others), "{name}");
        }
        assert!(!main.contains("\nimport "));
        assert!(
            later
                .iter()
                .all(|script| script.matches("import {").count() == 1)
        );
    }

    #[test]
    fn the_library_of_plots_is_sent_as_it_was_written_and_only_to_who_wants_it() {
        let library = written("vendor/uplot.js").unwrap();
        let (head, _) = library.split_once("\nexport ").unwrap();
        assert!(head.contains("/*!") && head.contains("MIT License"));
        assert!(file("/signals/signals.js", "").unwrap().1.contains(head));
        assert!(!file("/main.js", "").unwrap().1.contains("uPlot"));
    }

    #[test]
    fn stop_names_its_robot_before_any_script_runs() {
        for page in ["/", "/screen"] {
            let (_, content) = file(page, "r7").unwrap();
            assert!(content.contains("name=\"robot\" value=\"r7\""), "{page}");
            assert!(
                !content.contains('{'),
                "{page}: nothing is left to be filled in"
            );
            assert!(
                content.contains("method=\"post\" action=\"/stop\""),
                "{page}"
            );
        }
    }

    #[test]
    fn the_page_asks_nobody_else() {
        for (name, content) in FILES {
            let outside = content
                .match_indices("://")
                .map(|(at, _)| &content[at.saturating_sub(6)..(at + 20).min(content.len())])
                .filter(|place| !place.contains("www.w3.org"))
                .collect::<Vec<_>>();
            assert!(outside.is_empty(), "{name}: {outside:?}");
        }
    }

    /// The keys of one language's words: what stands before a colon and a quoted word.
    fn keys(table: &str) -> BTreeSet<&str> {
        let mut parts: Vec<&str> = table.split(": \"").collect();
        parts.pop();
        parts
            .iter()
            .filter_map(|part| part.rsplit([' ', '\n', '{', ',']).next())
            .map(|key| key.trim_matches('"'))
            .collect()
    }

    #[test]
    fn each_word_of_the_commissioning_s_page_is_said_by_it() {
        let scripts = FILES
            .iter()
            .filter(|(name, _)| name.starts_with("commission/"));
        let scripts: String = scripts.map(|(_, content)| *content).collect();
        let words = lager_commission::sentences()
            .filter_map(|sentence| sentence.name.strip_prefix("page_"));
        let mut count = 0;
        for word in words {
            count += 1;
            // These stand in the place of a question.
            let is_said = word.starts_with("ask_")
                || [format!("\"{word}\""), format!("\"page_{word}\"")]
                    .iter()
                    .any(|quoted| scripts.contains(quoted));
            assert!(is_said, "nobody says page_{word}");
        }
        assert!(count > 20, "{count}");
    }

    #[test]
    fn both_languages_have_the_same_words() {
        let [english, swedish] = LANGUAGES.map(|language| keys(written(language).unwrap()));
        assert!(english.len() > 100, "{english:?}");
        let missing: Vec<_> = english.symmetric_difference(&swedish).collect();
        assert!(missing.is_empty(), "{missing:?}");
    }

    #[test]
    fn no_word_of_the_page_names_a_command_of_a_terminal() {
        let [english, swedish] = LANGUAGES.map(|language| written(language).unwrap());
        let tables = [english, swedish];
        assert!(!tables.iter().any(|words| words.contains('`')) && !english.contains("lager "));
        for page in ["index.html", "screen.html"] {
            let html = written(page).unwrap();
            assert!(!html.contains('`') && !html.contains("lager "), "{page}");
        }
    }

    /// What stands between each `before` and the next quotation mark.
    fn quoted<'t>(text: &'t str, before: &str) -> Vec<&'t str> {
        let parts = text.split(before).skip(1);
        parts.filter_map(|part| part.split('"').next()).collect()
    }

    #[test]
    fn each_word_that_the_page_says_is_in_the_table_and_each_of_the_table_is_said() {
        let known = keys(written("words/en.js").unwrap());
        let mut said = BTreeSet::new();
        for (_, content) in FILES {
            for before in [
                "say(\"",
                "tell(\"",
                "letGo(\"",
                "data-word=\"",
                "data-label=\"",
                "data-title=\"",
            ] {
                said.extend(quoted(content, before));
            }
        }
        let sentences: BTreeSet<&str> = Sentence::all().map(|sentence| sentence.name).collect();
        let unknown = said.difference(&known);
        let unknown: Vec<_> = unknown.filter(|name| !sentences.contains(*name)).collect();
        assert!(unknown.is_empty(), "said and not in the table: {unknown:?}");
        // Others stand in lists and in names that are put together.
        let everything: String = FILES.iter().map(|(.., content)| *content).collect();
        let put_together = [
            "mode_", "did_", "servo_", "board_", "side_", "look_", "view_", "colour_", "theme_",
            "mark_",
        ];
        let unsaid: Vec<_> = known
            .iter()
            .filter(|key| !said.contains(*key))
            .filter(|key| !put_together.iter().any(|prefix| key.starts_with(prefix)))
            .filter(|key| !everything.contains(&format!("\"{key}\"")))
            .collect();
        assert!(unsaid.is_empty(), "in the table and never said: {unsaid:?}");
    }
}
