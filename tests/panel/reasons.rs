//! Tests that the page gives each reason in the reader's language: from codes and values it makes
//! the same sentences as all programs with the table.

use lager_orders::{Code, Language, Reason, Sentence};
use lager_topics::{Failure, FailureKind, Refusal};
use serde_json::{Value, json};

use crate::browser::Page;
use crate::played::Stage;

/// The page's sentences for these reasons.
fn told(page: &mut Page, reasons: &[&str]) -> Value {
    let expression = format!(
        "import('/main.js').then((page) => {}.map(page.$words_sentences.reason))",
        json!(reasons)
    );
    let params = json!({ "expression": expression, "awaitPromise": true, "returnByValue": true });
    let said = page.call("Runtime.evaluate", &params);
    assert!(said["exceptionDetails"].is_null(), "{said}");
    said["result"]["value"].clone()
}

#[test]
fn every_reason_is_told_as_the_table_has_it_in_both_languages() {
    // Each reason with example values.
    let mut reasons: Vec<Reason> = Sentence::all()
        .map(|sentence| Reason::of(sentence.name, |key| Some(format!("{key} of it"))))
        .collect();
    let stopped = Reason::from(Refusal::StopLatched);
    let nested = Reason::new(Code::NotPossible, &[&"forward", &stopped.as_str()]);
    reasons.push(nested);
    reasons.push(Failure::new(FailureKind::GoodsDelivered, (1, 2), 3, 4).into());
    reasons.push(Reason::read("words that are no code"));
    let lines: Vec<&str> = reasons.iter().map(Reason::as_str).collect();
    let stage = Stage::new(None);
    let mut page = stage.page(&stage.url);
    for language in [Language::English, Language::Swedish] {
        let said = told(&mut page, &lines);
        let said: Vec<_> = said.as_array().expect("a list").iter().collect();
        assert_eq!(said.len(), reasons.len());
        for (said, reason) in said.iter().zip(&reasons) {
            assert_eq!(**said, reason.sentence(language), "{}", reason.as_str());
        }
        page.change_language();
    }
    drop(page);
    stage.end();
}
