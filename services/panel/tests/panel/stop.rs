//! STOP by a form: for whom it is, and what it says became of it.

use std::io::Write as _;
use std::net::TcpStream;

use crate::scene::{Running, status};

#[test]
fn a_form_of_the_panels_own_page_stops_and_says_what_became_of_it() {
    let panel = Running::new();
    let _robots = [panel.robot("r1"), panel.robot("r2")];
    let mut page = panel.own_page();
    for name in ["r1", "r2"] {
        page.line(&format!("about {name} connected=1 speaks=1"))
            .unwrap();
    }
    let own = format!("http://{}", panel.host());
    let cookie = panel.cookie();
    let origin = [("Origin", own.as_str()), ("Cookie", cookie.as_str())];
    for (body, wanted) in [
        ("robot=r1", "r1 stands 7\n"),
        ("robot=", "r1 stands 7\nr2 stands 7\n"),
        ("robot=r77", "r77 unknown\n"),
        ("robot=R!", "R! unknown\n"),
    ] {
        let answer = panel.stop(body, &origin);
        assert_eq!(status(&answer), 200, "{answer}");
        assert!(answer.ends_with(wanted), "{body}: {answer}");
    }
    // A browser without a script is answered by a page, with STOP on it again.
    let asks = [origin[0], origin[1], ("Accept", "text/html,*/*")];
    let answer = panel.stop("robot=r1", &asks);
    for part in [
        "text/html",
        "content-security-policy: ",
        "r1: both wheels stand after 7 ms",
        "r1: båda hjulen står efter 7 ms",
        "method=\"post\" action=\"/stop\"",
    ] {
        assert!(answer.contains(part), "{part}: {answer}");
    }
    // Who presses is told to everybody else.
    assert!(page.line("from r1 asked panel stop").is_some());
    panel.stop("name=%C3%85sa&robot=r1", &origin);
    assert!(page.line("from r1 asked Åsa stop").is_some());
}

#[test]
fn what_the_robot_does_not_confirm_is_not_said_to_stand() {
    let panel = Running::new();
    let own = format!("http://{}", panel.host());
    let cookie = panel.cookie();
    let origin = [("Origin", own.as_str()), ("Cookie", cookie.as_str())];
    let mut robot = TcpStream::connect(panel.station).unwrap();
    writeln!(robot, "lager 1 r1").unwrap();
    let mut page = panel.own_page();
    page.line("about r1 connected=1 speaks=1").unwrap();
    assert!(
        panel
            .stop("robot=r1", &origin)
            .ends_with("r1 unconfirmed\n")
    );
    drop(robot);
    page.line("about r1 connected=0").unwrap();
    assert!(panel.stop("robot=r1", &origin).ends_with("r1 unheard\n"));
    assert!(panel.stop("", &origin).ends_with("r1 unheard\n"));
}

#[test]
fn the_form_of_somebody_else_stops_nothing_and_a_viewers_does() {
    let panel = Running::new();
    let robot = panel.robot("r1");
    let port = panel.address.port();
    let cookie = format!("lager-token-{port}={}", panel.tokens.viewer);
    let own = format!("http://{}", panel.host());
    let mut page = panel.page(&own, &cookie).unwrap();
    page.line("about r1 connected=1 speaks=1").unwrap();
    let cookie = ("Cookie", cookie.as_str());
    for headers in [
        &[("Origin", own.as_str())][..],
        &[cookie],
        &[cookie, ("Origin", "http://evil.example")],
        &[cookie, ("Origin", "null")],
        &[cookie, ("Origin", "null"), ("Sec-Fetch-Site", "cross-site")],
    ] {
        let answer = panel.stop("robot=r1", headers);
        assert_eq!(status(&answer), 403, "{headers:?}: {answer}");
    }
    let stops = || {
        let told = robot.0.lock().unwrap();
        told.iter().filter(|line| line.starts_with("stop ")).count()
    };
    assert_eq!(stops(), 0);
    for headers in [
        [cookie, ("Origin", own.as_str())],
        [cookie, ("Sec-Fetch-Site", "same-origin")],
    ] {
        let answer = panel.stop("robot=r1", &headers);
        assert!(answer.ends_with("r1 stands 7\n"), "{headers:?}: {answer}");
    }
    assert_eq!(stops(), 2);
    // A page that is asked by another method is none.
    assert_eq!(
        status(&panel.ask("/stop", &[("Host", &panel.host()), cookie])),
        405
    );
}
