//! Who gets in: real sockets, a real station, and people with other addresses, names and tokens.

mod bounds;
mod history;
mod scene;
mod stop;
mod wheel;

use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};

use lager_lines::Name;
use lager_orders::{Code, Reason};
use lager_panel::World;
use scene::{Page, Running, server, status};
use tungstenite::Message;

/// What a page is told first: its name and rank, and the release of the station's program.
pub(crate) fn you(who: &str) -> String {
    format!("you {who} {}", env!("CARGO_PKG_VERSION"))
}

#[test]
fn the_page_comes_with_what_keeps_others_out() {
    let panel = Running::new();
    let answer = panel.ask_as_driver("/");
    assert_eq!(status(&answer), 200);
    for header in [
        "content-security-policy: default-src 'none'; script-src 'self'",
        "x-content-type-options: nosniff",
        "text/html",
    ] {
        assert!(answer.contains(header), "{header}: {answer}");
    }
    assert_eq!(status(&panel.ask_as_driver("/screen")), 200);
    assert_eq!(status(&panel.ask_as_driver("/nothing")), 404);
}

/// What stands in an answer's head under this name.
fn head<'a>(answer: &'a str, name: &str) -> &'a str {
    let mut lines = answer.lines();
    let found = lines.find_map(|line| line.strip_prefix(name)?.strip_prefix(": "));
    found.unwrap()
}

#[test]
fn an_address_with_a_token_leads_to_the_same_page_without_it() {
    let panel = Running::new();
    let (host, token) = (panel.host(), &panel.tokens.driver);
    for (asked, leads) in [
        (format!("/?token={token}"), "/"),
        (format!("/screen?token={token}"), "/screen"),
        (format!("/screen?r2&token={token}"), "/screen?r2"),
        (format!("/screen?token={token}&r2"), "/screen?r2"),
        // Never to somebody else's page.
        (format!("//evil.example/?token={token}"), "/evil.example/"),
    ] {
        let answer = panel.ask(&asked, &[("Host", &host)]);
        assert_eq!(status(&answer), 303, "{asked}");
        assert_eq!(head(&answer, "location"), leads, "{asked}");
        assert!(head(&answer, "set-cookie").contains(token), "{asked}");
    }
}

#[test]
fn what_a_browser_has_is_sent_once_and_a_page_of_another_version_is_sent_away() {
    let panel = Running::new();
    let (host, cookie) = (panel.host(), panel.cookie());
    for path in ["/", "/main.js", "/style.css"] {
        let answer = panel.ask_as_driver(path);
        let tag = head(&answer, "etag");
        assert_eq!(head(&answer, "cache-control"), "no-cache");
        let has = |tag: &str| {
            let headers = [
                ("Host", &*host),
                ("Cookie", &cookie),
                ("If-None-Match", tag),
            ];
            status(&panel.ask(path, &headers))
        };
        assert_eq!((has(tag), has("\"older\"")), (304, 200), "{path}");
    }
    let answer = panel.ask_as_driver("/");
    let (_, edition) = answer.split_once("data-edition=\"").unwrap();
    let (edition, _) = edition.split_once('"').unwrap();
    let origin = format!("http://{host}");
    let page = |edition| panel.page_of(&format!("Bo&edition={edition}"), &origin, &cookie);
    assert_eq!(
        page(edition).unwrap().line("you").unwrap(),
        you("Bo driver")
    );
    let Ok(Message::Close(Some(frame))) = page("older").unwrap().0.read() else {
        panic!("the panel talks with a page of another version");
    };
    assert_eq!(frame.reason.as_str(), "other_language");
}

#[test]
fn another_name_for_this_machine_is_refused() {
    let panel = Running::new();
    let port = panel.address.port();
    for host in [format!("evil.example:{port}"), "127.0.0.1:1".into()] {
        let answer = panel.ask("/", &[("Host", &host)]);
        assert_eq!(status(&answer), 421, "{host}");
        for part in [
            "content-security-policy: ",
            "not to this name",
            "detta namn",
        ] {
            assert!(answer.contains(part), "{part}: {answer}");
        }
    }
}

#[test]
fn the_page_of_somebody_else_opens_no_socket() {
    let panel = Running::new();
    for origin in ["http://evil.example", "null", "http://127.0.0.1:1"] {
        let opened = panel.page(origin, &panel.cookie());
        assert_eq!(opened.err(), Some(403), "{origin}");
    }
    let line = panel.own_page().line("you ").unwrap();
    assert!(line.contains(" driver "), "{line}");
}

#[test]
fn on_this_machine_too_a_token_is_needed_and_a_viewers_only_looks_and_stops() {
    let panel = Running::new();
    let (host, tokens) = (panel.host(), panel.tokens.clone());
    let answer = panel.ask("/", &[("Host", &host)]);
    assert_eq!(status(&answer), 403);
    for part in ["printed when", "skrev ut"] {
        assert!(answer.contains(part), "{part}: {answer}");
    }
    assert_eq!(status(&panel.ask("/?token=0", &[("Host", &host)])), 403);
    let answer = panel.ask(&format!("/?token={}", tokens.viewer), &[("Host", &host)]);
    assert_eq!(status(&answer), 303, "the address does not keep it");
    let cookie = head(&answer, "set-cookie");
    assert!(
        cookie.contains("HttpOnly") && cookie.contains("SameSite=Strict"),
        "{cookie}"
    );
    let cookie = cookie.split(';').next().unwrap();
    let with = |cookie: &str| status(&panel.ask("/", &[("Host", &host), ("Cookie", cookie)]));
    assert_eq!(with(cookie), 200);
    // That of a panel at another port of this machine, beside it or alone.
    let (_, token) = cookie.split_once('=').unwrap();
    let other = format!("lager-token-1={token}");
    assert_eq!(with(&other), 403);
    assert_eq!(with(&format!("lager-token-1=0; {cookie}")), 200);

    let origin = format!("http://{}", panel.address);
    assert_eq!(panel.page(&origin, "").err(), Some(403));
    let mut viewer = panel.page(&origin, cookie).unwrap();
    assert!(viewer.line("you ").unwrap().contains(" viewer "));
    for (number, line) in [
        "do r1 1 0 resume 7",
        "take r1 2",
        "do r1 3 0 drive 2",
        "renew r1 4",
    ]
    .into_iter()
    .enumerate()
    {
        viewer.say(line);
        let answer = viewer.line("answer ").unwrap();
        let wanted = format!("answer {} refused this page may look and stop", number + 1);
        assert!(answer.starts_with(&wanted), "{answer}");
    }
    // The stop is no question of rank; this robot is just not there.
    viewer.say("stop r1 5");
    let answer = viewer.line("answer ").unwrap();
    assert!(
        answer.starts_with("answer 5 refused there is no robot r1"),
        "{answer}"
    );
}

#[test]
fn only_a_robot_of_this_station_is_put_into_another_world_and_first_it_is_stopped() {
    let renewed = Arc::new(AtomicU32::new(0));
    let counts = Arc::clone(&renewed);
    let world = World::new(Name::new("r1").unwrap(), move || {
        match counts.fetch_add(1, Ordering::SeqCst) {
            0 => Ok(()),
            _ => Err(Reason::new(Code::FloorUnfit, &[&"it has no room"])),
        }
    });
    let panel = Running::with(server(None, None), Some(world));
    let (robot, _other) = (panel.robot("r1"), panel.robot("r2"));
    let mut anna = panel.own_page();
    let mut bert = panel.own_page();
    for name in ["r1", "r2"] {
        anna.line(&format!("about {name} connected=1 speaks=1"))
            .unwrap();
    }
    let ask = |page: &mut Page, line: &str| {
        page.say(line);
        page.line("answer ").unwrap()
    };
    let answer = ask(&mut anna, "renew r2 1");
    assert!(
        answer.starts_with("answer 1 refused r2 was not"),
        "{answer}"
    );
    // While somebody drives it, only they may do that.
    assert_eq!(ask(&mut bert, "take r1 2"), "answer 2 done");
    let answer = ask(&mut anna, "renew r1 3");
    assert!(answer.contains("drives the robot; ask first"), "{answer}");
    assert_eq!(renewed.load(Ordering::SeqCst), 0);
    assert_eq!(ask(&mut bert, "renew r1 4"), "answer 4 done");
    assert_eq!(renewed.load(Ordering::SeqCst), 1);
    let is_stopped = || {
        robot
            .0
            .lock()
            .unwrap()
            .iter()
            .any(|line| line.starts_with("stop "))
    };
    let end = Instant::now() + scene::WATCHDOG;
    while !is_stopped() {
        assert!(Instant::now() < end, "it was not stopped");
        std::thread::sleep(Duration::from_millis(10));
    }
    let answer = ask(&mut bert, "renew r1 5");
    assert!(answer.contains("it has no room"), "{answer}");
}
