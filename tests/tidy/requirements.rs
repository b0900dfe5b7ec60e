//! Tests of `tests/REQUIREMENTS.md`: each id in a comment of the project has a row, each row names
//! tests that exist or a departure, and users of the robot see no id.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use crate::{files, root, rust_files};

/// The letters with which ids begin; a number follows each letter but `K`.
const FAMILIES: &str = "OPSXUDCLMGQTWABFE";

/// This file contains examples that are no ids.
const OWN: &str = "tests/tidy/requirements.rs";

/// A row of the inventory.
struct Row {
    id: String,
    text: String,
}

fn rows() -> Vec<Row> {
    let file = root().join("tests/REQUIREMENTS.md");
    let text = std::fs::read_to_string(file).expect("the inventory");
    let (text, _table) = text
        .split_once("\n## The table of codes")
        .expect("the table of codes");
    let row = |part: &str| {
        let (id, text) = part.split_once("** ").expect("text behind an id");
        let (text, _next_heading) = text.split_once("\n\n").unwrap_or((text, ""));
        Row {
            id: id.to_owned(),
            text: text.to_owned(),
        }
    };
    text.split("\n- **").skip(1).map(row).collect()
}

/// The ids in a text outside of quotation marks. Of a range, both of its ends.
fn ids(text: &str) -> BTreeSet<String> {
    let unquoted: String = text.split(['"', '`']).step_by(2).collect();
    unquoted
        .split(|sign: char| !sign.is_ascii_alphanumeric() && sign != '-')
        .flat_map(|word| match word.strip_prefix("AMB-") {
            Some(number) => vec![("AMB-", number)],
            None => word
                .split('-')
                .map(|part| part.split_at(part.len().min(1)))
                .collect(),
        })
        .filter(|(family, number)| {
            let known = *family == "AMB-" || FAMILIES.contains(family);
            let digits = number.bytes().all(|digit| digit.is_ascii_digit());
            known && digits && (1..=2).contains(&number.len())
        })
        .map(|(family, number)| format!("{family}{number}"))
        .collect()
}

fn comment(line: &str) -> Option<&str> {
    let at = line.find("//")?;
    Some(&line[at..])
}

fn all_rust_files() -> Vec<PathBuf> {
    ["bus", "services", "firmware", "benches", "tests"]
        .into_iter()
        .flat_map(|folder| rust_files(Path::new(folder)))
        .collect()
}

#[test]
fn ids_are_found_in_comments_alone() {
    let found = ids("/// of the arm (G7, AMB-27); U2-U14, `F6`, \"armcomm F9\", E4-A00201EN, 25.");
    let expected = ["AMB-27", "E4", "G7", "U14", "U2"];
    assert!(found.iter().eq(expected), "{found:?}");
    assert_eq!(comment("let x = 1; // S3"), Some("// S3"));
    assert_eq!(comment("let x = S3;"), None);
}

#[test]
fn each_id_that_a_comment_names_is_a_row() {
    let rows = rows();
    let known: BTreeSet<&str> = rows.iter().map(|row| row.id.as_str()).collect();
    assert_eq!(known.len(), rows.len(), "an id has two rows");
    let mut used = 0;
    for file in all_rust_files() {
        let text = std::fs::read_to_string(&file).expect("a readable file");
        for (number, line) in text.lines().enumerate() {
            for id in ids(comment(line).unwrap_or_default()) {
                used += 1;
                assert!(
                    known.contains(id.as_str()) || file.ends_with(OWN),
                    "{}:{}: {id} is no row of tests/REQUIREMENTS.md",
                    file.display(),
                    number + 1
                );
            }
        }
    }
    assert!(used > 200, "only {used} ids were found in comments");
}

#[test]
fn each_row_names_tests_that_exist_or_a_departure() {
    let mut complaints = Vec::new();
    let mut named = 0;
    for Row { id, text } in rows() {
        let tests: Vec<_> = text
            .split('`')
            .skip(1)
            .step_by(2)
            .filter_map(|quoted| quoted.split_once("::"))
            .collect();
        if tests.is_empty() && !text.contains("\n  Departure: ") {
            complaints.push(format!("{id} names no test and no departure"));
        }
        for (file, function) in tests {
            named += 1;
            let source = std::fs::read_to_string(root().join(file)).unwrap_or_default();
            if !source.contains(&format!("fn {function}(")) {
                complaints.push(format!("{id}: there is no {function} in {file}"));
            }
        }
    }
    assert!(complaints.is_empty(), "{}", complaints.join("\n"));
    assert!(named > 200, "only {named} tests are named");
}

/// The files whose text users read: the page, and the documents for users of the robot.
#[test]
fn people_who_use_the_robot_meet_no_id() {
    let mut shown = vec![
        root().join("README.md"),
        root().join("bus/orders/sentences.txt"),
    ];
    for folder in [
        "services/panel/page",
        "services/station",
        "services/recorder",
    ] {
        shown.extend(files(Path::new(folder), &["js", "html", "css", "md"]));
    }
    assert!(shown.len() > 30, "the page is somewhere else: {shown:?}");
    for file in shown {
        let text = std::fs::read_to_string(&file).expect("a readable file");
        let is_comment = |line: &str| {
            let line = line.trim_start();
            ["//", "/*", "*"].iter().any(|mark| line.starts_with(mark))
        };
        let shown = text.lines().filter(|line| !is_comment(line));
        for line in shown {
            let bracketed = line.split('(').skip(1);
            let mut insides = bracketed.map(|rest| rest.split(')').next().unwrap_or_default());
            let names_ids = |inside: &str| {
                let mut parts = inside.split(", ");
                !inside.is_empty() && parts.all(|part| ids(part).contains(part))
            };
            assert!(!insides.any(names_ids), "{}: {line}", file.display());
        }
    }
    // Errors and help texts are in quotation marks.
    for file in all_rust_files() {
        let text = std::fs::read_to_string(&file).expect("a readable file");
        for line in text.lines().filter(|line| comment(line).is_none()) {
            assert!(
                !line.contains("AMB-") || file.ends_with(OWN),
                "{}: {line}",
                file.display()
            );
        }
    }
}
