//! [`Evidence`]: shows the Pi that a board is there, from several SYNs or data packets in a row.
//!
//! The check value proves a version-1 SYN. Nothing protects an original packet, so the Pi believes
//! a handshake without a check value only if it cannot be a damaged version-1 handshake. For this
//! it must be repeated, without stray bytes and without a version-1 packet in between, and no
//! version-1 packet may have come for a while. Two version-1 packets in a row show that a board
//! taken for an original one is not an original one. A board that sends what only the other board
//! can send is asked again who it is.
//!
//! It is apart from the link because it only judges received packets: it keeps no state of the
//! peer, counts no losses and sends nothing.

use core::time::Duration;

use super::handshake;
use crate::handshake::{BUILD, Callsign, ResetCause, SynAck, Version};
use crate::packet::{PACKET_LENGTH, Packet, PacketId};

/// How long no version-1 packet may have come before the Pi believes in an original board.
const ORIGINAL_AFTER: Duration = Duration::from_millis(300);
/// How many original SYNs in a row are enough if they are alike except for the id.
const ORIGINAL_SYNS: u8 = 3;
/// How many are enough if only their meaning is alike: an original board does not clear the payload
/// bytes that it does not use, so these may differ from SYN to SYN.
const ORIGINAL_SYNS_UNLIKE: u8 = 6;
/// How many version-1 SYNs in a row mean a reboot if they come after data.
const REBOOT_SYNS: u8 = 2;
/// How many packets with consecutive ids show that an original board is running.
const RUNNING_PACKETS: u8 = 8;
/// An original SYN with at most this many wrong bits may be a damaged version-1 SYN.
const DAMAGE_BITS: u32 = 3;

/// A SYN from a board.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Syn {
    pub(super) version: Version,
    pub(super) callsign: Callsign,
    /// The packet; for an original one, without its id.
    pub(super) bytes: [u8; PACKET_LENGTH],
    /// How many bytes the original's decoder had skipped until then.
    pub(super) skipped: u32,
}

/// SYNs in a row from one board in one version.
#[derive(Clone, Copy, Debug)]
struct SynRun {
    last: Syn,
    count: u8,
    /// How many of the last SYNs were alike in every byte.
    alike: u8,
}

/// Original data packets with consecutive ids from one board.
#[derive(Clone, Copy, Debug)]
struct DataRun {
    callsign: Callsign,
    last_id: PacketId,
    count: u8,
}

/// The packets received from a board, as far as they are evidence.
#[derive(Clone, Debug, Default)]
pub(super) struct Evidence {
    syns: Option<SynRun>,
    data: Option<DataRun>,
    /// When listening began or the last version-1 packet came, whichever is later.
    without_one_since: Option<Duration>,
    /// The id of the last version-1 packet.
    last_one: Option<PacketId>,
}

impl Evidence {
    /// Listening begins at `now`, unless it has already begun.
    pub(super) fn listen(&mut self, now: Duration) {
        self.without_one_since.get_or_insert(now);
    }

    /// Notes a version-1 packet; returns whether its id follows that of the one before. Packets
    /// before it that looked like an original board's came from this board, so they are forgotten:
    /// after a gap in the stream the next damaged packet must not be added to them.
    pub(super) fn heard_one(&mut self, id: PacketId, now: Duration) -> bool {
        self.without_one_since = Some(now);
        self.data = None;
        self.syns = self.syns.filter(|run| run.last.version == Version::One);
        let before = self.last_one.replace(id);
        before.is_some_and(|before| before.next() == id)
    }

    /// Notes a packet that no waiting board sends.
    pub(super) fn break_syns(&mut self) {
        self.syns = None;
    }

    /// Notes a packet that no running board sends.
    pub(super) fn break_data(&mut self) {
        self.data = None;
    }

    /// Whether a board's SYN is enough, with those before it. `after_data`: the board was up and
    /// has sent data, so one stray SYN must not end the link.
    pub(super) fn believes_syn(&mut self, syn: Syn, after_data: bool, now: Duration) -> bool {
        if syn.version == Version::Original && is_damaged_one(&syn.bytes) {
            self.syns = None;
            return false;
        }
        let run = self.extended(syn);
        self.syns = Some(run);
        match syn.version {
            Version::One => run.count >= if after_data { REBOOT_SYNS } else { 1 },
            Version::Original => {
                self.is_without_one(now)
                    && (run.alike >= ORIGINAL_SYNS || run.count >= ORIGINAL_SYNS_UNLIKE)
            }
        }
    }

    fn extended(&self, syn: Syn) -> SynRun {
        let (count, alike) = match &self.syns {
            Some(run) if syn.continues(&run.last) => {
                (run.count, if syn == run.last { run.alike } else { 0 })
            }
            _ => (0, 0),
        };
        SynRun {
            last: syn,
            count: count.saturating_add(1),
            alike: alike.saturating_add(1),
        }
    }

    /// The running original board that `packet` and those before it prove.
    pub(super) fn believes_data(&mut self, packet: &Packet, now: Duration) -> Option<Callsign> {
        let Some(callsign) = packet.payload.kind().comes_only_from() else {
            self.data = None;
            return None;
        };
        let count = match self.data {
            Some(run) if run.callsign == callsign && run.last_id.next() == packet.id => {
                run.count.saturating_add(1)
            }
            _ => 1,
        };
        self.data = Some(DataRun {
            callsign,
            last_id: packet.id,
            count,
        });
        (count >= RUNNING_PACKETS && self.is_without_one(now)).then_some(callsign)
    }

    fn is_without_one(&self, now: Duration) -> bool {
        self.without_one_since
            .is_some_and(|since| now.saturating_sub(since) >= ORIGINAL_AFTER)
    }
}

impl Syn {
    /// Whether this SYN follows `last` directly. Noise on the line of a version-1 board leaves
    /// stray bytes between bytes that look like original SYNs; an original board leaves none.
    fn continues(&self, last: &Self) -> bool {
        self.version == last.version
            && self.callsign == last.callsign
            && (self.version == Version::One || self.skipped == last.skipped)
    }
}

/// Whether an original SYN is really a version-1 SYN with a few wrong bits. Line faults can be
/// steady, and then damaged SYNs are alike. With a damaged header, the same bytes may also be read
/// as a SYN that starts elsewhere in the eleven bytes, so this compares every rotation. The board
/// has this source's build number or none.
fn is_damaged_one(bytes: &[u8; PACKET_LENGTH]) -> bool {
    let signs = [Callsign::Sensor, Callsign::Steering];
    signs.into_iter().any(|sign| {
        let causes = ResetCause::ALL.iter();
        let mut starts = causes
            .flat_map(|reset| [(*reset, false), (*reset, true)])
            .flat_map(|start| [(start, 0), (start, BUILD)]);
        starts.any(|((reset, was_up), build)| {
            let whole = handshake(SynAck::Syn, sign, reset, Version::One, was_up, build);
            (0..PACKET_LENGTH).any(|turn| {
                let turned = whole.iter().cycle().skip(turn);
                let wrong: u32 = turned
                    .zip(bytes)
                    .map(|(expected, found)| (expected ^ found).count_ones())
                    .sum();
                wrong <= DAMAGE_BITS
            })
        })
    })
}
