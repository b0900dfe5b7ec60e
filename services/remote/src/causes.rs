//! [`causes`]: hears from Zenoh why a connection failed. Its errors say only that it failed.

use std::fmt::{self, Write as _};
use std::sync::{Mutex, MutexGuard, PoisonError};

use tracing::field::{Field, Visit};
use tracing::{Event, Level, Subscriber};
use tracing_subscriber::Layer;
use tracing_subscriber::layer::{Context, Filter};
use tracing_subscriber::registry::LookupSpan;

/// How many of its last warnings are kept.
const KEPT: usize = 32;

static HEARD: Mutex<Vec<String>> = Mutex::new(Vec::new());

fn heard() -> MutexGuard<'static, Vec<String>> {
    HEARD.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A layer of `tracing` that keeps Zenoh's last warnings, for the errors of this crate.
pub fn causes<S: Subscriber + for<'a> LookupSpan<'a>>() -> impl Layer<S> {
    Causes.with_filter(OfZenoh)
}

/// Forgets what was heard.
pub(crate) fn forget() {
    heard().clear();
}

/// Why the connection failed, in words that say what to do; `None` if no warning tells it.
pub(crate) fn told() -> Option<&'static str> {
    let heard = heard();
    heard.iter().rev().find_map(|warning| in_words(warning))
}

fn in_words(warning: &str) -> Option<&'static str> {
    const WORDS: [(&str, &str); 10] = [
        (
            "CertificateRequired",
            "the robot asks for a certificate, and this listener has shown none that counts",
        ),
        (
            "NotValidForName",
            "the certificate of the robot does not name this address; make it with `lager keys robot \
             --address`",
        ),
        (
            "not valid for name",
            "the certificate of the robot does not name this address; make it with `lager keys robot \
             --address`",
        ),
        (
            "CertificateExpired",
            "the robot says that the certificate of this listener has expired",
        ),
        ("Expired", "the certificate of the robot has expired"),
        ("expired", "the certificate of the robot has expired"),
        (
            "UnknownIssuer",
            "the certificate of the robot is not of the authority that this listener trusts",
        ),
        (
            "BadSignature",
            "the certificate of the robot is not of the authority that this listener trusts",
        ),
        ("Connection refused", "nothing listens there"),
        (
            "invalid dns name",
            "over TLS Zenoh calls no IPv6 address in digits; write a name of it that `lager keys robot \
             --address` has put into the certificate",
        ),
    ];
    // What the other end says in its alert is about this end's certificate.
    if warning.contains("received fatal alert") {
        let alerts = [
            ("CertificateExpired", WORDS[3].1),
            ("CertificateRequired", WORDS[0].1),
        ];
        let told = alerts.iter().find(|(word, _)| warning.contains(word));
        return Some(told.map_or(
            "the robot does not trust the certificate of this listener",
            |(_, words)| words,
        ));
    }
    let known = WORDS.iter().find(|(word, _)| warning.contains(word));
    known.map(|(_, words)| *words)
}

struct OfZenoh;

impl<S> Filter<S> for OfZenoh {
    fn enabled(&self, meta: &tracing::Metadata<'_>, _: &Context<'_, S>) -> bool {
        *meta.level() <= Level::WARN && meta.target().starts_with("zenoh")
    }
}

struct Causes;

impl<S: Subscriber> Layer<S> for Causes {
    fn on_event(&self, event: &Event<'_>, _: Context<'_, S>) {
        let mut text = Text::default();
        event.record(&mut text);
        let mut heard = heard();
        if heard.len() == KEPT {
            heard.remove(0);
        }
        heard.push(text.0);
    }
}

/// All fields of an event as one text.
#[derive(Default)]
struct Text(String);

impl Visit for Text {
    fn record_debug(&mut self, _field: &Field, value: &dyn fmt::Debug) {
        // Writing to a String cannot fail.
        let _ = write!(self.0, "{value:?} ");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_cause_has_words_of_its_own() {
        let all = [
            "received fatal alert: UnknownCA",
            "received fatal alert: CertificateExpired",
            "received fatal alert: CertificateRequired",
            "invalid peer certificate: UnknownIssuer",
            "invalid peer certificate: Expired",
            "invalid peer certificate: NotValidForName",
            "Connection refused (os error 111)",
        ];
        let told: Vec<_> = all.iter().map(|it| in_words(it).expect(it)).collect();
        for (place, words) in told.iter().enumerate() {
            assert!(!told[..place].contains(words), "{words}");
        }
        assert_eq!(in_words("something else"), None);
    }
}
