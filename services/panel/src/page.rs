//! The page's files, in the program itself: nothing is built for it and nothing fetched from
//! elsewhere.

/// Name, type and content of each.
const FILES: &[(&str, &str, &str)] = &[
    ("/", HTML, include_str!("../page/index.html")),
    (
        "/style.css",
        "text/css; charset=utf-8",
        include_str!("../page/style.css"),
    ),
    ("/arm.js", SCRIPT, include_str!("../page/arm.js")),
    ("/ask.js", SCRIPT, include_str!("../page/ask.js")),
    ("/bar.js", SCRIPT, include_str!("../page/bar.js")),
    ("/drive.js", SCRIPT, include_str!("../page/drive.js")),
    ("/line.js", SCRIPT, include_str!("../page/line.js")),
    ("/link.js", SCRIPT, include_str!("../page/link.js")),
    ("/log.js", SCRIPT, include_str!("../page/log.js")),
    ("/main.js", SCRIPT, include_str!("../page/main.js")),
    ("/map.js", SCRIPT, include_str!("../page/map.js")),
    ("/mcap.js", SCRIPT, include_str!("../page/mcap.js")),
    ("/missions.js", SCRIPT, include_str!("../page/missions.js")),
    ("/reasons.js", SCRIPT, include_str!("../page/reasons.js")),
    ("/screen", HTML, include_str!("../page/screen.html")),
    ("/screen.js", SCRIPT, include_str!("../page/screen.js")),
    (
        "/sentences.js",
        SCRIPT,
        include_str!("../page/sentences.js"),
    ),
    ("/setup.js", SCRIPT, include_str!("../page/setup.js")),
    ("/stop.js", SCRIPT, include_str!("../page/stop.js")),
    ("/strips.js", SCRIPT, include_str!("../page/strips.js")),
    ("/words.js", SCRIPT, include_str!("../page/words.js")),
];

const HTML: &str = "text/html; charset=utf-8";
const SCRIPT: &str = "text/javascript; charset=utf-8";

/// What goes along with each answer: the page runs its own files and talks to its own socket.
pub(crate) const HEADERS: &[(&str, &str)] = &[
    (
        "content-security-policy",
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src data:; connect-src 'self'; \
         base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    ),
    ("x-content-type-options", "nosniff"),
    ("referrer-policy", "no-referrer"),
    ("cross-origin-opener-policy", "same-origin"),
    ("cross-origin-resource-policy", "same-origin"),
    ("cache-control", "no-cache"),
];

/// Type and content of a file.
pub(crate) fn file(path: &str) -> Option<(&'static str, &'static str)> {
    let found = FILES.iter().find(|(name, ..)| *name == path)?;
    Some((found.1, found.2))
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn every_file_of_the_page_is_there_and_none_is_large() {
        let folder = std::fs::read_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/page")).unwrap();
        let there: BTreeSet<String> = folder
            .map(|entry| format!("/{}", entry.unwrap().file_name().to_string_lossy()))
            .map(|name| match name.as_str() {
                "/index.html" => "/".into(),
                "/screen.html" => "/screen".into(),
                _ => name,
            })
            .collect();
        let known: BTreeSet<String> = FILES.iter().map(|(name, ..)| (*name).to_owned()).collect();
        assert_eq!(there, known);
        let bytes: usize = FILES.iter().map(|(.., content)| content.len()).sum();
        assert!(bytes < 200_000, "{bytes}");
    }

    #[test]
    fn the_page_asks_nobody_else() {
        for (name, _, content) in FILES {
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
    fn both_languages_have_the_same_words() {
        for name in ["/words.js", "/sentences.js"] {
            same_words(name);
        }
    }

    fn same_words(file: &str) {
        let (_, words) = super::file(file).unwrap();
        let (english, rest) = words.split_once("  sv: {").unwrap();
        let (_, english) = english.split_once("  en: {").unwrap();
        let (swedish, _) = rest.split_once("\n};").unwrap();
        let (english, swedish) = (keys(english), keys(swedish));
        assert!(english.len() > 100, "{english:?}");
        let missing: Vec<_> = english.symmetric_difference(&swedish).collect();
        assert!(missing.is_empty(), "{file}: {missing:?}");
    }

    /// What stands between each `before` and the next quotation mark.
    fn quoted<'t>(text: &'t str, before: &str) -> Vec<&'t str> {
        let parts = text.split(before).skip(1);
        parts.filter_map(|part| part.split('"').next()).collect()
    }

    #[test]
    fn each_word_that_the_page_says_is_in_the_table_and_each_of_the_table_is_said() {
        let (_, words) = super::file("/words.js").unwrap();
        let (english, _) = words.split_once("  sv: {").unwrap();
        let known = keys(english.split_once("  en: {").unwrap().1);
        let mut said = BTreeSet::new();
        for (_, _, content) in FILES {
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
        let unknown: Vec<_> = said.difference(&known).collect();
        assert!(unknown.is_empty(), "said and not in the table: {unknown:?}");
        // Others stand in lists and in names that are put together.
        let everything: String = FILES.iter().map(|(.., content)| *content).collect();
        let put_together = ["mode_", "event_", "servo_", "board_", "side_"];
        let unsaid: Vec<_> = known
            .iter()
            .filter(|key| !said.contains(*key))
            .filter(|key| !put_together.iter().any(|prefix| key.starts_with(prefix)))
            .filter(|key| !everything.contains(&format!("\"{key}\"")))
            .collect();
        assert!(unsaid.is_empty(), "in the table and never said: {unsaid:?}");
    }
}
