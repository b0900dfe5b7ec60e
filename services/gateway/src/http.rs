//! The server of the figures.
//!
//! It answers when the browser asked for an address in digits or for `localhost`, and not for
//! another name. The owner of another site could point the site's name to this machine. Then the
//! browser of a person on this machine would read the figures for that site.

use std::convert::Infallible;
use std::io;
use std::net::{IpAddr, SocketAddr, TcpListener};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use axum::Router;
use axum::extract::{ConnectInfo, State};
use axum::http::{HeaderMap, StatusCode, header};
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use lager_door::{Door, Limits, Visitor};
use lager_stop::StopWord;
use tokio::runtime::Runtime;

use crate::Shared;
use crate::exposition::{self, MEDIA_TYPE};

/// How many may ask at a time: some servers, and people who look.
const LIMITS: Limits = Limits {
    most: 32,
    whose: "the gateway",
};
/// How often the server checks whether it must end.
const LOOK: Duration = Duration::from_millis(50);

/// Serves everybody until `over` is set: requests for figures, if there is a `listener`, and
/// everything else that runs in `runtime`.
pub(crate) fn serve(
    runtime: &Runtime,
    listener: Option<TcpListener>,
    shared: Shared,
    over: &AtomicBool,
) -> io::Result<()> {
    let served = async {
        let Some(listener) = listener else {
            return std::future::pending().await;
        };
        let listener = tokio::net::TcpListener::from_std(listener)?;
        let router = Router::new()
            .route("/metrics", get(metrics))
            .fallback(nothing)
            .with_state(shared)
            .into_make_service_with_connect_info::<Visitor>();
        axum::serve(Door::new(listener, LIMITS), router).await
    };
    runtime.block_on(async {
        let ended = async {
            while !over.load(Ordering::Relaxed) {
                tokio::time::sleep(LOOK).await;
            }
        };
        tokio::select! {
            served = served => served,
            () = ended => Ok(()),
        }
    })
}

async fn metrics(
    State(shared): State<Shared>,
    ConnectInfo(visitor): ConnectInfo<Visitor>,
    headers: HeaderMap,
) -> Response {
    visitor.has_asked();
    if !headers
        .get(header::HOST)
        .and_then(|host| host.to_str().ok())
        .is_some_and(is_number)
    {
        let why = "the gateway answers to its number and to localhost, and not to this name\n";
        return (StatusCode::MISDIRECTED_REQUEST, why).into_response();
    }
    visitor.admit();
    // Read the word now, as the bridge does before each packet, so that a stop is visible at once.
    let word = shared.stop_word.as_ref();
    let stop = word.and_then(|word| StopWord::read(word).ok());
    let stop = stop.map(|told| told.and_then(|told| told.stop()));
    let text = exposition::text(&shared.figures(), stop);
    ([(header::CONTENT_TYPE, MEDIA_TYPE)], text).into_response()
}

async fn nothing() -> Result<Response, Infallible> {
    let why = "there is nothing here; the figures are at /metrics\n";
    Ok((StatusCode::NOT_FOUND, why).into_response())
}

/// Whether a host, with a port or without, is an address as a number, or this machine.
fn is_number(host: &str) -> bool {
    let without_port = match host.rsplit_once(':') {
        Some((name, port)) if port.parse::<u16>().is_ok() => name,
        _ => host,
    };
    let bare = without_port
        .strip_prefix('[')
        .and_then(|name| name.strip_suffix(']'));
    host.parse::<SocketAddr>().is_ok()
        || without_port == "localhost"
        || bare.unwrap_or(without_port).parse::<IpAddr>().is_ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_that_somebody_has_pointed_here_is_refused() {
        for host in [
            "127.0.0.1:7430",
            "localhost:7430",
            "localhost",
            "192.168.1.4",
            "[::1]:7430",
            "[::1]",
        ] {
            assert!(is_number(host), "{host}");
        }
        for host in [
            "evil.example:7430",
            "evil.example",
            "localhost.evil.example",
            "127.0.0.1.evil.example:7430",
            "",
            ":7430",
            "[::1",
        ] {
            assert!(!is_number(host), "{host}");
        }
    }
}
