//! Tests of `tests/TRAPS.md`: each row names tests that exist, or says why there is none.

use std::collections::BTreeSet;

use crate::root;

/// What a row says that names no test.
const INSTEAD: [&str; 3] = ["Held by `", "Cannot happen", "Open: "];

#[test]
fn each_trap_names_tests_that_exist_or_says_why_there_is_none() {
    let text = std::fs::read_to_string(root().join("tests/TRAPS.md")).expect("the table of traps");
    let mut ids = BTreeSet::new();
    let mut complaints = Vec::new();
    for row in text.split("\n- **").skip(1) {
        let (id, row) = row.split_once("** ").expect("text behind an id");
        let (row, _next_heading) = row.split_once("\n\n").unwrap_or((row, ""));
        if !ids.insert(id) {
            complaints.push(format!("{id} has two rows"));
        }
        let mut tests = 0;
        for quoted in row.split('`').skip(1).step_by(2) {
            let (file, test) = match quoted.split_once("::") {
                Some((file, test)) => (file, Some(test)),
                None => (quoted, None),
            };
            let source = std::fs::read_to_string(root().join(file)).unwrap_or_default();
            let is_there = match test {
                Some(test) => source.contains(&format!("fn {test}(")),
                None => !source.is_empty(),
            };
            tests += usize::from(test.is_some());
            if !is_there {
                complaints.push(format!("{id}: there is no {quoted}"));
            }
        }
        if tests == 0 && !INSTEAD.iter().any(|words| row.contains(words)) {
            complaints.push(format!("{id} names no test and does not say why"));
        }
    }
    assert!(complaints.is_empty(), "{}", complaints.join("\n"));
    assert_eq!(ids.len(), 89, "rows of the table");
}
