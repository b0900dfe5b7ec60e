//! STOP without a script. A form of the page posts here, even if nothing else of the page has
//! loaded yet.
//!
//! ```text
//!   POST /stop   [name=Anna&]robot=r1[&robot=r2 ...]   Anna stops these robots; if none is named, all
//! ```
//!
//! The panel answers when each robot has confirmed the stop, or when [`CONFIRM`] is over. A browser
//! gets a page that says what each robot did, with the form again. The page's script gets lines
//! (`<robot> <word> [<ms>]`). Everybody who may look may stop.

use std::fmt::Write;
use std::time::{Duration, Instant};

use lager_lines::Name;
use lager_orders::{Language, Sentence};
use lager_station::{Awaited, Doing, Handle, Reply};

use crate::access::{person, said};

/// How long a robot has to confirm a stop.
const CONFIRM: Duration = Duration::from_secs(1);
/// How often the panel looks whether it has.
const LOOK: Duration = Duration::from_millis(5);
/// Who stops by the form if the person has chosen no name.
const FORM: &str = "panel";
/// The longest body, in bytes: the names of as many robots as a station knows.
pub(crate) const LONGEST_BODY: usize = 4 * 1024;

/// The outcome of a stop.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Became {
    /// The steering board reports both motors off, so many ms after the robot has read it.
    Stands(u32),
    /// The robot speaks only the document's language, which confirms nothing.
    Sent,
    /// The robot has it, or has not: it does not say.
    Unconfirmed,
    /// The robot is not connected, or takes no stop now; nothing was sent.
    Unheard,
    /// There is no such robot.
    Unknown,
}

impl Became {
    /// As a word of the line that the page's script reads.
    fn word(&self) -> String {
        match self {
            Self::Stands(ms) => format!("stands {ms}"),
            Self::Sent => "sent".into(),
            Self::Unconfirmed => "unconfirmed".into(),
            Self::Unheard => "unheard".into(),
            Self::Unknown => "unknown".into(),
        }
    }
}

/// What became of a robot's stop, in English and in Swedish; the page's script has the same words.
fn sentences(robot: &str, word: &str) -> [String; 2] {
    let (word, ms) = word.split_once(' ').unwrap_or((word, ""));
    let sentence = Sentence::of(&format!("became_{word}"));
    [Language::English, Language::Swedish].map(|language| {
        let mut said = String::new();
        let mut value =
            |key: &str, to: &mut dyn Write| to.write_str(if key == "ms" { ms } else { robot });
        let put = sentence.map(|sentence| sentence.put(language, &mut said, &mut value));
        debug_assert_eq!(put, Some(Ok(())), "the table has no {word}");
        said
    })
}

/// The names in a form's body, in their order. Names need no escapes, so what has one is none of a
/// robot's, and is kept as it is to be answered.
pub(crate) fn names(body: &str) -> Vec<String> {
    let names = body
        .split('&')
        .filter_map(|field| field.strip_prefix("robot="));
    let names = names.filter(|name| !name.is_empty());
    names.map(str::to_owned).collect()
}

/// Who presses: the name that the person has chosen.
pub(crate) fn by(body: &str) -> String {
    let name = said(body, "name").and_then(person);
    name.unwrap_or_else(|| FORM.to_owned())
}

/// Stops these robots, or all if none is named, in this person's name, and waits for what becomes of
/// it.
pub(crate) async fn stop(handle: &Handle, by: &str, names: Vec<String>) -> Vec<(String, Became)> {
    let names = match names.is_empty() {
        true => handle
            .robots()
            .into_iter()
            .map(|view| view.name.to_string())
            .collect(),
        false => names,
    };
    // All are told before any is waited for.
    let told: Vec<_> = names.iter().map(|name| tell(handle, by, name)).collect();
    let began = Instant::now();
    let mut became = Vec::new();
    for (name, told) in names.into_iter().zip(told) {
        let what = match told {
            Ok(None) => Became::Sent,
            Ok(Some(awaited)) => confirmed(awaited, began).await,
            Err(what) => what,
        };
        became.push((name, what));
    }
    became
}

fn tell(handle: &Handle, by: &str, name: &str) -> Result<Option<Awaited>, Became> {
    let name = Name::new(name).map_err(|_| Became::Unknown)?;
    let doing = handle.look(|station| station.robot(&name).map(lager_station::Robot::doing));
    match doing {
        None => Err(Became::Unknown),
        // It would be lost on its way, or wait for a robot that is elsewhere by then.
        Some(Doing::Away) => Err(Became::Unheard),
        Some(_) => {
            let told = handle.stop(&name).map_err(|_| Became::Unheard);
            handle.note(&name, by, "stop");
            told
        }
    }
}

async fn confirmed(awaited: Awaited, began: Instant) -> Became {
    loop {
        let reply = awaited.wait(Duration::ZERO);
        match reply {
            Some(Reply::Stopped { after_ms }) => return Became::Stands(after_ms),
            Some(Reply::Done) => return Became::Sent,
            Some(Reply::Refused(_) | Reply::Lost) => return Became::Unconfirmed,
            None if began.elapsed() >= CONFIRM => return Became::Unconfirmed,
            None => tokio::time::sleep(LOOK).await,
        }
    }
}

/// The answer to the page's script.
pub(crate) fn lines(became: &[(String, Became)]) -> String {
    became
        .iter()
        .fold(String::new(), |mut lines, (name, what)| {
            let _ = writeln!(lines, "{name} {}", what.word());
            lines
        })
}

/// The answer as a page.
pub(crate) fn page(became: &[(String, Became)]) -> String {
    let mut said = String::new();
    let nobody = became.is_empty().then(|| sentences("", "none"));
    let all = became.iter();
    let all = all.map(|(name, what)| sentences(&safe(name), &what.word()));
    for [english, swedish] in all.chain(nobody) {
        let _ = writeln!(
            said,
            "<p>{english}<br><span lang=\"sv\">{swedish}</span></p>"
        );
    }
    let one = match became {
        [(name, _)] => safe(name),
        _ => String::new(),
    };
    let back = match one.is_empty() {
        true => "/".to_owned(),
        false => format!("/?{one}"),
    };
    format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>STOP</title>\n<link rel=\"icon\" href=\"data:,\">\n\
         <link rel=\"stylesheet\" href=\"/style.css\">\n</head>\n<body class=\"stop-answer\">\n\
         <form method=\"post\" action=\"/stop\"><button id=\"stop\" name=\"robot\" value=\"{one}\">\
         STOP <small>{one}</small></button></form>\n<div role=\"alert\">\n{said}</div>\n\
         <p><a href=\"{back}\">Back to the panel · Tillbaka till panelen</a></p>\n</body>\n</html>\n"
    )
}

/// A name with nothing in it that a page would take for its own.
fn safe(name: &str) -> String {
    let is_plain = |letter: &char| letter.is_ascii_alphanumeric() || matches!(letter, '-' | '_');
    name.chars().filter(is_plain).take(32).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_form_names_robots_or_all() {
        assert_eq!(names("robot=r1"), ["r1"]);
        assert_eq!(names("robot=r1&robot=r2&x=y"), ["r1", "r2"]);
        for all in ["", "robot=", "robots=r1", "robot"] {
            assert_eq!(names(all), [""; 0], "{all}");
        }
    }

    #[test]
    fn what_became_of_it_is_said_and_nothing_of_the_request_is_the_pages() {
        let became = [
            ("r1".to_owned(), Became::Stands(10)),
            ("<b>".to_owned(), Became::Unknown),
        ];
        assert_eq!(lines(&became), "r1 stands 10\n<b> unknown\n");
        let said = page(&became);
        assert!(
            said.contains("<p>r1: both wheels stand after 10 ms<br>"),
            "{said}"
        );
        assert!(said.contains("NOT SENT: b is not here"), "{said}");
        assert!(!said.contains("<b>"), "{said}");
        assert!(page(&[]).contains("NOT SENT: no robot has connected"));
        assert!(page(&became[..1]).contains("value=\"r1\""));
    }
}
