//! Explains why a configuration cannot be read: the line, the fault in plain words, and the meaning
//! of the key in the words of `lager config`.

use lager_lines::meant;

use super::documented::meaning;

/// Words of the TOML reader, and plain words for them.
const PLAIN: [(&str, &str); 12] = [
    ("expected f64", "expected a number"),
    ("expected f32", "expected a number"),
    ("expected u8", "expected a whole number from 0 to 255"),
    ("expected u16", "expected a whole number, 0 or more"),
    ("expected u32", "expected a whole number, 0 or more"),
    ("expected u64", "expected a whole number, 0 or more"),
    ("expected usize", "expected a whole number, 0 or more"),
    ("expected i64", "expected a whole number"),
    ("expected a boolean", "expected true or false"),
    ("expected a string", "expected a text in quotes"),
    ("expected path string", "expected a path in quotes"),
    ("invalid type: ", "it is the "),
];

/// What is wrong with `text`, in one sentence.
pub fn why(text: &str, error: &toml::de::Error) -> String {
    let start = error.span().map_or(0, |span| span.start.min(text.len()));
    let number = text[..start].lines().count().max(1);
    let number = match text[..start].ends_with('\n') {
        true => number + 1,
        false => number,
    };
    let line = text.lines().nth(number - 1).unwrap_or_default().trim();
    let message = PLAIN
        .iter()
        .fold(error.message().to_owned(), |message, (theirs, ours)| {
            message.replace(theirs, ours)
        });
    let mut said = format!("line {number}, {line}: {message}");
    if let Some(meant) = meant(&message) {
        said = format!("line {number}, {line}: did you mean `{meant}`? {message}");
    }
    let key = line.split('=').next().unwrap_or_default().trim();
    let before = text.lines().take(number);
    let section = before.filter_map(section).last().unwrap_or_default();
    if let Some(meaning) = meaning(section, key) {
        said = format!("{said}. {key}: {}", meaning.trim_end_matches('.'));
    }
    said
}

/// The name of the section that a line begins.
fn section(line: &str) -> Option<&str> {
    line.trim().strip_prefix('[')?.split(']').next()
}

#[cfg(test)]
mod tests {
    use super::super::Config;
    use super::*;

    fn said(text: &str) -> String {
        let error = toml::from_str::<Config>(text).expect_err("it is not valid");
        why(text, &error)
    }

    #[test]
    fn a_wrong_value_is_told_with_its_line_and_what_its_key_means() {
        for (text, words) in [
            (
                "speed = \"fast\"",
                &[
                    "line 1, speed = \"fast\"",
                    "expected a number",
                    "speed of the robot's clock",
                ][..],
            ),
            (
                "name = \"r1\"\n\n[serial]\nbaud = \"fast\"\n",
                &["line 4, baud", "a whole number", "500000, or 9600"],
            ),
            (
                "[serial]\nraw_line = 1",
                &["line 2", "true or false", "eleven sensors"],
            ),
            ("warehouse = 3", &["a text in quotes", "built-in warehouse"]),
            (
                "body = \"simm\"",
                &["did you mean `sim`?", "the simulated robot"],
            ),
            ("[station]\npanel = \"here\"", &["line 2", "as in 7410"]),
            ("[station]\npanel = 70000", &["line 2", "as in 7410"]),
            ("[logic]\npick = \"manuel\"", &["did you mean `manual`?"]),
        ] {
            let said = said(text);
            assert!(
                words.iter().all(|word| said.contains(word)),
                "{text}: {said}"
            );
            for jargon in ["f64", "u32", "boolean", "invalid type"] {
                assert!(!said.contains(jargon), "{text}: {said}");
            }
        }
    }

    #[test]
    fn a_mistyped_key_is_told_with_the_one_that_was_meant() {
        for (text, meant) in [
            ("sped = 2", "`speed`"),
            ("[serial]\nbuad = 9600", "`baud`"),
            ("[staton]\npanel = 1", "`station`"),
            ("[station]\npanle = 7410", "`panel`"),
        ] {
            let said = said(text);
            assert!(said.contains(&format!("did you mean {meant}?")), "{said}");
        }
    }

    #[test]
    fn a_port_alone_is_an_address() {
        let text =
            "[station]\npanel = 7411\nlisten = \"7421\"\n[gateway]\nmetrics = \"localhost:1\"";
        let config: Config = toml::from_str(text).expect("valid");
        let at = |text: &str| Some(text.parse().expect("an address"));
        assert_eq!(config.station.panel, at("127.0.0.1:7411"));
        assert_eq!(config.station.listen, at("127.0.0.1:7421"));
        assert_eq!(config.gateway.metrics, at("127.0.0.1:1"));
    }

    #[test]
    fn what_is_no_toml_is_told_with_its_line() {
        let said = said("name = \"r1\"\nspeed 2\n");
        assert!(said.starts_with("line 2, speed 2"), "{said}");
    }
}
