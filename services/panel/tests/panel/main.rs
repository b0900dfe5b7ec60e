//! Who gets in: real sockets, a real station, and people with other addresses, names and tokens.

mod bounds;
mod scene;
mod stop;
mod wheel;

use std::net::SocketAddr;

use lager_panel::{Panel, PanelError, Tokens};

use scene::{Running, server, status};

#[test]
fn the_page_comes_with_what_keeps_others_out() {
    let panel = Running::new(None);
    let answer = panel.ask("/", &[("Host", &panel.host())]);
    assert_eq!(status(&answer), 200);
    for header in [
        "content-security-policy: default-src 'none'; script-src 'self'",
        "x-content-type-options: nosniff",
        "text/html",
    ] {
        assert!(answer.contains(header), "{header}: {answer}");
    }
    assert_eq!(
        status(&panel.ask("/screen", &[("Host", &panel.host())])),
        200
    );
    assert_eq!(
        status(&panel.ask("/nothing", &[("Host", &panel.host())])),
        404
    );
}

#[test]
fn another_name_for_this_machine_is_refused() {
    let panel = Running::new(None);
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
    let panel = Running::new(None);
    for origin in ["http://evil.example", "null", "http://127.0.0.1:1"] {
        assert_eq!(panel.page(origin, "").err(), Some(403), "{origin}");
    }
    let line = panel.own_page().line("you ").unwrap();
    assert!(line.ends_with(" driver"), "{line}");
}

#[test]
fn beyond_this_machine_a_token_is_needed_and_a_viewers_only_looks_and_stops() {
    let everywhere = SocketAddr::from(([0, 0, 0, 0], 0));
    let refused = Panel::open(everywhere, None, server(None).handle());
    assert!(matches!(refused, Err(PanelError::NoTokens(_))));

    let tokens = Tokens::random().unwrap();
    let panel = Running::new(Some(tokens.clone()));
    let host = panel.host();
    assert_eq!(status(&panel.ask("/", &[("Host", &host)])), 403);
    assert_eq!(status(&panel.ask("/?token=0", &[("Host", &host)])), 403);
    let answer = panel.ask(&format!("/?token={}", tokens.viewer), &[("Host", &host)]);
    assert_eq!(status(&answer), 303, "the address does not keep it");
    let cookie = answer
        .lines()
        .find_map(|line| line.strip_prefix("set-cookie: "))
        .unwrap();
    assert!(
        cookie.contains("HttpOnly") && cookie.contains("SameSite=Strict"),
        "{cookie}"
    );
    let cookie = cookie.split(';').next().unwrap();
    assert_eq!(
        status(&panel.ask("/", &[("Host", &host), ("Cookie", cookie)])),
        200
    );

    let origin = format!("http://{}", panel.address);
    assert_eq!(panel.page(&origin, "").err(), Some(403));
    let mut viewer = panel.page(&origin, cookie).unwrap();
    assert!(viewer.line("you ").unwrap().ends_with(" viewer"));
    for (number, line) in ["do r1 1 0 resume 7", "take r1 2", "do r1 3 0 drive 2 200"]
        .into_iter()
        .enumerate()
    {
        viewer.say(line);
        let answer = viewer.line("answer ").unwrap();
        let wanted = format!("answer {} refused this page may look and stop", number + 1);
        assert!(answer.starts_with(&wanted), "{answer}");
    }
    // The stop is no question of rank; this robot is just not there.
    viewer.say("stop r1 4");
    let answer = viewer.line("answer ").unwrap();
    assert!(
        answer.starts_with("answer 4 refused there is no robot r1"),
        "{answer}"
    );
}
