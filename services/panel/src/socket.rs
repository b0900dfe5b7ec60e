//! The conversation with one page. The panel carries out at once what the page says, and tells the
//! page what has changed.
//!
//! Two futures do this beside each other. So a page that reads nothing can still stop a robot. The
//! panel closes the socket of a page that has read nothing for [`SLOW`].

use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use axum::extract::ws::{CloseFrame, Message, Utf8Bytes, WebSocket, close_code};
use futures_util::stream::{SplitSink, SplitStream};
use futures_util::{SinkExt as _, StreamExt as _};
use lager_orders::Code;
use tokio::time::{sleep, timeout};

use crate::OpenPage;
use crate::access::Rank;
use crate::visit::Visit;

/// How often the panel looks for something to tell while the station has nothing new.
const LOOK: Duration = Duration::from_millis(100);
/// A robot says several things at a time; what comes within this time is told in one message, since
/// each costs the browser a turn of its own.
const GATHER: Duration = Duration::from_millis(3);
/// How often the panel asks a page whether it is there.
const PING: Duration = Duration::from_secs(1);
/// How long a page may take to take a message in.
const SLOW: Duration = Duration::from_secs(2);
/// How long a page may say nothing, its answers to pings included.
const SILENT: Duration = Duration::from_secs(5);
/// Messages that a page may send within a second.
const MOST_MESSAGES: u32 = 200;

/// Talks with a page until one of the two ends it.
pub(crate) async fn converse(socket: WebSocket, page: OpenPage, rank: Rank) {
    let visit = Mutex::new(Visit::new(page, rank));
    let (mut sink, stream) = socket.split();
    let why = tokio::select! {
        why = listen(stream, &visit) => why,
        why = tell(&mut sink, &visit) => why,
    };
    // Before the page is told, which may take its time: whoever drove drives no more.
    drop(visit);
    if let Some(why) = why {
        let _ = timeout(SLOW, sink.send(closed(why))).await;
    }
}

/// Tells a page with which the panel does not talk why.
pub(crate) async fn send_away(mut socket: WebSocket, why: Code) {
    let _ = timeout(SLOW, socket.send(closed(why))).await;
}

fn closed(why: Code) -> Message {
    Message::Close(Some(CloseFrame {
        code: close_code::POLICY,
        reason: Utf8Bytes::from_static(why.as_str()),
    }))
}

/// Carries out what the page says; why it is closed, if that is to be told.
async fn listen(mut stream: SplitStream<WebSocket>, visit: &Mutex<Visit>) -> Option<Code> {
    let mut since = Instant::now();
    let mut messages = 0;
    loop {
        let message = match timeout(SILENT, stream.next()).await {
            Ok(Some(Ok(message))) => message,
            Ok(_) => return None,
            Err(_) => return Some(Code::PageSilent),
        };
        if since.elapsed() >= Duration::from_secs(1) {
            since = Instant::now();
            messages = 0;
        }
        messages += 1;
        let mut visit = lock(visit);
        visit.is_there();
        if let Message::Text(line) = &message {
            // A stop counts, however much was said before it.
            let is_much = messages > MOST_MESSAGES;
            if is_much && !line.as_str().starts_with("stop ") {
                return Some(Code::TooMuch);
            }
            if !visit.heard(line.as_str()) {
                return Some(Code::OtherLanguage);
            }
            if is_much {
                return Some(Code::TooMuch);
            }
        } else if matches!(message, Message::Binary(_)) {
            return Some(Code::NotLines);
        }
    }
}

/// Tells the page what has changed.
async fn tell(sink: &mut SplitSink<WebSocket, Message>, visit: &Mutex<Visit>) -> Option<Code> {
    let mut changes = lock(visit).changes();
    let mut pinged = Instant::now();
    loop {
        if timeout(LOOK, changes.changed()).await.is_ok() {
            sleep(GATHER).await;
        }
        let news = lock(visit).news();
        if !news.is_empty() {
            send(sink, Message::text(news)).await?;
        }
        if pinged.elapsed() >= PING {
            pinged = Instant::now();
            send(sink, Message::Ping(Vec::new().into())).await?;
        }
    }
}

/// `None` if the page takes nothing in.
async fn send(sink: &mut SplitSink<WebSocket, Message>, message: Message) -> Option<()> {
    timeout(SLOW, sink.send(message)).await.ok()?.ok()
}

fn lock<'v>(visit: &'v Mutex<Visit>) -> MutexGuard<'v, Visit> {
    visit.lock().unwrap_or_else(PoisonError::into_inner)
}
