//! [`HostLink`]: the Pi's receiving end. It finds out the board, its version, and what was lost.
//!
//! ```text
//!          version-1 SYN, CRC fits                     -> SendAck(up)
//!          three original SYNs alike but for the id
//!           (or six that differ in unused bytes),
//!           no stray byte between them,
//!  down      300 ms without version 1                  -> SendAck(up)        up
//!   (SYN   original data, 8 ids in a row,                                (data, ids
//!   every    300 ms without version 1                  -> Up             counted)
//!  100 ms)
//!          <- Silent: nothing for 1 s, version-1 data of the other board,
//!             or two version-1 packets in a row of one taken for original
//!
//!  up:   SYN before any data since the ACK             -> SendAck: the ACK was lost
//!        SYN after data, the second (original: third)  -> SendAck(up)
//!
//!  A version-1 board that comes up again has rebooted if its SYN says that it has not been up
//!  since its start, even after a silence; an original one if it asked while it was up.
//! ```
//!
//! Each time a board comes up a new epoch starts: counters begin at 0, and nothing from before
//! counts as lost. This end never sends; it asks the transmitter to send.

use core::time::Duration;

use super::evidence::{Evidence, Syn};
use crate::decoder::{Decoder, DecoderCounters};
use crate::handshake::{Callsign, Handshake, ResetCause, SynAck, Version};
use crate::packet::{END, PACKET_LENGTH, Packet, PacketId};
use crate::payload::Payload;

/// How often the Pi asks a board that is not up.
const SYN_PERIOD: Duration = Duration::from_millis(100);
/// How long a board that is up may be silent.
const SILENCE: Duration = Duration::from_secs(1);
/// A board has come up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Up {
    /// The board.
    pub callsign: Callsign,
    /// The version of the rules that it uses.
    pub version: Version,
    /// The new epoch's number; the first is 1.
    pub epoch: u32,
    /// Why the board last started; `Unknown` from an original board.
    pub reset: ResetCause,
    /// Whether the board has rebooted since it was last up on this link.
    pub rebooted: bool,
    /// Whether the board says that no link has been up since the board started.
    pub fresh: bool,
    /// The build number of the board's image; 0 if it has none, and of a board that was found
    /// running.
    pub build: u16,
}

/// An event of the receiving end: something to send, or news.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HostEvent {
    /// Send a SYN.
    SendSyn,
    /// Send an ACK of the link's version. Without `up` it repeats an ACK that was lost.
    SendAck {
        /// The board that has come up with this ACK.
        up: Option<Up>,
    },
    /// An original board was found running. No answer is needed.
    Up(Up),
    /// A data packet.
    Packet(Packet),
    /// The board is no longer up: it has sent nothing for a second, or something that only the
    /// other board or a board of the other version can send.
    Silent,
}

/// The state of a link since its epoch began. The counters wrap.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LinkCounters {
    /// How many times a board has come up; 0 before the first time.
    pub epoch: u32,
    /// How many of these were reboots.
    pub reboots: u32,
    /// Data packets received.
    pub packets: u32,
    /// Data packets that never came; there may be more, because ids are modulo 16.
    pub lost: u32,
    /// Packets with a wrong check value.
    pub bad_crc: u32,
    /// Packets whose content broke a rule.
    pub bad_content: u32,
    /// Bytes that belong to no packet.
    pub skipped_bytes: u32,
}

#[derive(Clone, Copy, Debug)]
struct Peer {
    callsign: Callsign,
    version: Version,
    /// Whether data has come since the last ACK.
    data_seen: bool,
    /// The last data packet's id; `None` starts the count at the next packet.
    last_id: Option<PacketId>,
    last_heard: Duration,
}

/// The Pi's receiving end of the line to one board.
#[derive(Clone, Debug)]
pub struct HostLink {
    one: Decoder,
    original: Decoder,
    peer: Option<Peer>,
    /// The board that was up last.
    known: Option<(Callsign, Version)>,
    evidence: Evidence,
    syn_due: Duration,
    counters: LinkCounters,
    /// The rules by which damage is counted: those of the epoch; before the first epoch, version 1.
    judged_by: Version,
    /// The counters of that version's decoder when the epoch began.
    before: DecoderCounters,
}

impl Default for HostLink {
    fn default() -> Self {
        Self::new()
    }
}

impl HostLink {
    /// A link that does not know its board yet.
    pub fn new() -> Self {
        Self {
            one: Decoder::new(Version::One),
            original: Decoder::new(Version::Original),
            peer: None,
            known: None,
            evidence: Evidence::default(),
            syn_due: Duration::ZERO,
            counters: LinkCounters::default(),
            judged_by: Version::One,
            before: DecoderCounters::default(),
        }
    }

    /// A link whose epochs continue after `epoch`, for a service that takes over from an ended one:
    /// new packets must not look like a continuation of the old ones.
    pub fn after_epoch(epoch: u32) -> Self {
        let mut link = Self::new();
        link.counters.epoch = epoch;
        link
    }

    /// Takes a byte from the board, read at `now`.
    #[inline]
    pub fn push(&mut self, byte: u8, now: Duration) -> Option<HostEvent> {
        if let Some(Peer {
            version: Version::One,
            ..
        }) = self.peer
        {
            let packet = self.one.push(byte)?;
            return self.take_one(packet, byte, now);
        }
        // Until version 1 is certain, this listens by both rules.
        self.evidence.listen(now);
        let one = self.one.push(byte);
        let original = self.original.push(byte);
        if let Some(packet) = one
            && let Some(event) = self.take_one(packet, byte, now)
        {
            return Some(event);
        }
        self.take_original(original?, now)
    }

    /// An event that is due at `now` without a byte: a SYN, or the board has fallen silent. Call it
    /// until it returns `None`.
    pub fn poll(&mut self, now: Duration) -> Option<HostEvent> {
        self.evidence.listen(now);
        if self.next_due() > now {
            return None;
        }
        if self.peer.is_some() {
            return Some(self.go_down(now));
        }
        self.syn_due = now + SYN_PERIOD;
        Some(HostEvent::SendSyn)
    }

    /// When `poll` has its next event if no byte comes.
    pub fn next_due(&self) -> Duration {
        match &self.peer {
            Some(peer) => peer.last_heard + SILENCE,
            None => self.syn_due,
        }
    }

    /// The link's state in its present epoch, even after the board has fallen silent.
    pub fn health(&self) -> LinkCounters {
        let decoder = match self.judged_by {
            Version::One => self.one.counters(),
            Version::Original => self.original.counters(),
        };
        let before = &self.before;
        LinkCounters {
            bad_crc: decoder.bad_crc.wrapping_sub(before.bad_crc),
            bad_content: decoder.bad_content.wrapping_sub(before.bad_content),
            skipped_bytes: decoder.skipped_bytes.wrapping_sub(before.skipped_bytes),
            ..self.counters
        }
    }

    /// Which board is at the other end, while it is up.
    pub fn callsign(&self) -> Option<Callsign> {
        self.peer.map(|peer| peer.callsign)
    }

    /// The version of the rules that the board uses, while it is up.
    pub fn version(&self) -> Option<Version> {
        self.peer.map(|peer| peer.version)
    }

    /// Whether a board is up.
    pub const fn is_up(&self) -> bool {
        self.peer.is_some()
    }

    fn take_one(&mut self, packet: Packet, end: u8, now: Duration) -> Option<HostEvent> {
        // An original packet's end byte is the right check value once in 256 times. Such a packet
        // says nothing about the version.
        let in_a_row = end != END && self.evidence.heard_one(packet.id, now);
        match packet.payload {
            Payload::Handshake(handshake) => {
                let bytes = packet.encode(Version::One);
                self.take_handshake(handshake, bytes, now)
            }
            // It was taken for an original board and is not one. Asked again, it says so.
            _ if in_a_row && self.version() == Some(Version::Original) => Some(self.go_down(now)),
            _ => self.take_data(packet, Version::One, now),
        }
    }

    fn take_original(&mut self, packet: Packet, now: Duration) -> Option<HostEvent> {
        match packet.payload {
            Payload::Handshake(handshake) => {
                self.evidence.break_data();
                let mut bytes = *self.original.last_handshake();
                bytes[0] = 0;
                self.take_handshake(handshake, bytes, now)
            }
            _ if self.peer.is_some() => self.take_data(packet, Version::Original, now),
            _ => {
                self.evidence.break_syns();
                let callsign = self.evidence.believes_data(&packet, now)?;
                let version = Version::Original;
                let up = self.come_up((callsign, version, ResetCause::Unknown), false, now);
                if let Some(peer) = &mut self.peer {
                    peer.data_seen = true;
                    peer.last_id = Some(packet.id);
                }
                Some(HostEvent::Up(up))
            }
        }
    }

    fn take_data(&mut self, packet: Packet, version: Version, now: Duration) -> Option<HostEvent> {
        let peer = self.peer.as_mut().filter(|peer| peer.version == version)?;
        if packet.payload.kind().comes_only_from() == Some(other_board(peer.callsign)) {
            // By the original's rules this is noise. By version 1 the SYN was probably wrong,
            // because four or more wrong bits can pass the check. Asked again, it says so.
            return (version == Version::One).then(|| self.go_down(now));
        }
        if let Some(last) = peer.last_id {
            let missing = u32::from(packet.id.missing_since(last));
            self.counters.lost = self.counters.lost.wrapping_add(missing);
        }
        peer.last_id = Some(packet.id);
        peer.last_heard = now;
        peer.data_seen = true;
        self.evidence.break_syns();
        self.counters.packets = self.counters.packets.wrapping_add(1);
        Some(HostEvent::Packet(packet))
    }

    fn take_handshake(
        &mut self,
        handshake: Handshake,
        bytes: [u8; PACKET_LENGTH],
        now: Duration,
    ) -> Option<HostEvent> {
        let is_board = matches!(handshake.sign, Callsign::Sensor | Callsign::Steering);
        if handshake.kind != SynAck::Syn || !is_board {
            self.evidence.break_syns();
            return None;
        }
        let (callsign, version) = (handshake.sign, handshake.version);
        let mut after_data = false;
        if let Some(peer) = &mut self.peer
            && peer.version == version
            && peer.callsign == callsign
        {
            peer.last_heard = now;
            if !peer.data_seen {
                return Some(HostEvent::SendAck { up: None });
            }
            after_data = true;
        }
        let syn = Syn {
            version,
            callsign,
            bytes,
            skipped: self.original.counters().skipped_bytes,
        };
        self.evidence.believes_syn(syn, after_data, now).then(|| {
            let rebooted = match version {
                Version::One => !handshake.was_up && self.known == Some((callsign, version)),
                Version::Original => after_data,
            };
            let board = (callsign, version, handshake.reset);
            let mut up = self.come_up(board, rebooted, now);
            up.fresh = version == Version::One && !handshake.was_up;
            up.build = handshake.build;
            HostEvent::SendAck { up: Some(up) }
        })
    }

    fn go_down(&mut self, now: Duration) -> HostEvent {
        self.peer = None;
        self.evidence = Evidence::default();
        self.evidence.listen(now);
        self.original.reset();
        self.syn_due = now;
        HostEvent::Silent
    }

    fn come_up(
        &mut self,
        (callsign, version, reset): (Callsign, Version, ResetCause),
        rebooted: bool,
        now: Duration,
    ) -> Up {
        let last_id = match version {
            Version::One => Some(PacketId::BEFORE_FIRST),
            Version::Original => None,
        };
        if version == Version::One {
            self.original.reset();
        }
        self.peer = Some(Peer {
            callsign,
            version,
            data_seen: false,
            last_id,
            last_heard: now,
        });
        self.known = Some((callsign, version));
        self.evidence.break_syns();
        self.evidence.break_data();
        self.judged_by = version;
        self.before = match version {
            Version::One => *self.one.counters(),
            Version::Original => *self.original.counters(),
        };
        self.counters = LinkCounters {
            epoch: self.counters.epoch.wrapping_add(1),
            reboots: self.counters.reboots.wrapping_add(u32::from(rebooted)),
            ..LinkCounters::default()
        };
        Up {
            callsign,
            version,
            epoch: self.counters.epoch,
            reset,
            rebooted,
            fresh: false,
            build: 0,
        }
    }
}

fn other_board(callsign: Callsign) -> Callsign {
    match callsign {
        Callsign::Sensor => Callsign::Steering,
        _ => Callsign::Sensor,
    }
}
