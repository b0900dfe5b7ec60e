//! A forwarder between a listener and a gateway that can be paused, slowed and cut, as a bad link is.

use std::io::{Read, Write};
use std::net::{Shutdown, SocketAddr, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;

/// Bytes that are forwarded at a time.
const PIECE: usize = 4_096;
/// How often a paused relay looks whether it goes on.
const LOOK: Duration = Duration::from_millis(5);
/// No limit.
const FREE: u64 = u64::MAX;

/// The forwarder; it ends with the test.
pub(crate) struct Relay {
    address: SocketAddr,
    state: Arc<State>,
}

struct State {
    target: String,
    /// Bytes a second from the gateway to the listener; 0 while it is paused.
    rate: AtomicU64,
    is_over: AtomicBool,
}

impl Relay {
    /// Forwards to a gateway at this host and port.
    pub(crate) fn to(target: &str) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
        let address = listener.local_addr().expect("an address");
        let state = Arc::new(State {
            target: target.to_owned(),
            rate: AtomicU64::new(FREE),
            is_over: AtomicBool::new(false),
        });
        let shared = Arc::clone(&state);
        std::thread::spawn(move || {
            for caller in listener.incoming().flatten() {
                if shared.is_over.load(Ordering::Relaxed) {
                    return;
                }
                // While no gateway is there, the caller is refused as by the gateway's machine.
                let Ok(target) = TcpStream::connect(&shared.target) else {
                    continue;
                };
                let clone = |of: &TcpStream| of.try_clone().expect("a socket");
                let (back, there) = ((clone(&target), clone(&caller)), (caller, target));
                for (is_slowed, (from, to)) in [(true, back), (false, there)] {
                    let state = Arc::clone(&shared);
                    std::thread::spawn(move || state.forward(from, to, is_slowed));
                }
            }
        });
        Self { address, state }
    }

    /// Where listeners find it.
    pub(crate) fn endpoint(&self) -> String {
        format!("tcp/{}", self.address)
    }

    pub(crate) fn pause(&self) {
        self.slow(0);
    }

    /// At most so many bytes a second from the gateway to the listener.
    pub(crate) fn slow(&self, rate: u64) {
        self.state.rate.store(rate, Ordering::Relaxed);
    }

    pub(crate) fn free(&self) {
        self.slow(FREE);
    }
}

impl State {
    fn forward(&self, mut from: TcpStream, mut to: TcpStream, is_slowed: bool) {
        let mut piece = [0; PIECE];
        while !self.is_over.load(Ordering::Relaxed) {
            let rate = self.rate.load(Ordering::Relaxed);
            if rate == 0 {
                std::thread::sleep(LOOK);
                continue;
            }
            let read = match from.read(&mut piece) {
                Ok(0) | Err(_) => break,
                Ok(read) => read,
            };
            if to.write_all(&piece[..read]).is_err() {
                break;
            }
            if is_slowed && rate != FREE {
                std::thread::sleep(Duration::from_secs_f64(read as f64 / rate as f64));
            }
        }
        let _ = (from.shutdown(Shutdown::Both), to.shutdown(Shutdown::Both));
    }
}

impl Drop for Relay {
    fn drop(&mut self) {
        self.state.is_over.store(true, Ordering::Relaxed);
        // The thread that accepts looks when somebody calls.
        let _ = TcpStream::connect(self.address);
    }
}
