//! The Pi's end of a board's cable, for tests of programs that play the boards. It answers the
//! board and sends what the test tells it.
//!
//! It uses nothing else of this crate and no bus, because the emulator's tests, in a workspace of
//! their own, include this file as a module.

use std::fs::{File, OpenOptions};
use std::io::{Read, Result, Write};
use std::os::unix::fs::OpenOptionsExt;
use std::path::Path;
use std::time::{Duration, Instant};

use lager_wire::link::{HostEvent, HostLink, HostTransmitter};
use lager_wire::{Payload, ResetCause};
use rustix::fs::OFlags;

/// One serial port, opened as the Pi opens it.
#[derive(Debug)]
pub struct Host {
    file: File,
    /// The Pi's end of the link.
    pub link: HostLink,
    transmitter: HostTransmitter,
    start: Instant,
    /// The reason of the board's last start; `None` before its link has come up.
    pub reset: Option<ResetCause>,
}

impl Host {
    /// Opens the port, and waits at most `limit` until it exists.
    ///
    /// # Errors
    /// It cannot be opened.
    pub fn open(path: &Path, limit: Duration) -> Result<Self> {
        let start = Instant::now();
        let file = loop {
            let mut options = OpenOptions::new();
            options.read(true).write(true);
            options.custom_flags((OFlags::NONBLOCK | OFlags::NOCTTY).bits() as i32);
            match options.open(path) {
                Ok(file) => break file,
                Err(error) if start.elapsed() > limit => return Err(error),
                Err(_) => std::thread::sleep(Duration::from_millis(1)),
            }
        };
        Ok(Self {
            file,
            link: HostLink::new(),
            transmitter: HostTransmitter::new(),
            start,
            reset: None,
        })
    }

    /// Reads what came, hands over each packet's data, and sends the handshakes that are due.
    ///
    /// # Errors
    /// The port does not take them.
    pub fn answer(&mut self, mut packet: impl FnMut(Payload)) -> Result<()> {
        let mut bytes = [0; 512];
        // A read fails when there are no bytes, and when nobody is at the other end.
        let count = self.file.read(&mut bytes).unwrap_or(0);
        let now = self.start.elapsed();
        for byte in &bytes[..count] {
            let event = self.link.push(*byte, now);
            if let Some(HostEvent::Packet(heard)) = event {
                packet(heard.payload);
            }
            self.handle(event)?;
        }
        let due = self.link.poll(now);
        self.handle(due)
    }

    /// Sends data, if the link is up.
    ///
    /// # Errors
    /// The port does not take it.
    pub fn send(&mut self, payload: Payload) -> Result<()> {
        match self.transmitter.encode(payload) {
            Some(packet) => self.file.write_all(&packet),
            None => Ok(()),
        }
    }

    fn handle(&mut self, event: Option<HostEvent>) -> Result<()> {
        let bytes = match event {
            Some(HostEvent::SendSyn) => self.transmitter.syn(),
            Some(HostEvent::SendAck { up }) => {
                self.reset = up.map(|up| up.reset).or(self.reset);
                let version = self.link.version().expect("it has just been heard");
                self.transmitter.ack(version)
            }
            _ => return Ok(()),
        };
        self.file.write_all(&bytes)
    }
}
