//! A page of the kernel's ring of events, as `trace_pipe_raw` gives it out.
//!
//! ```text
//!  u64 time of the first event, ns | u64 length of the data, and flags | data
//!  data:  u32 head = kind (low 5 bits), ns since the event before (27 bits)
//!         kind 1 to 28   an event of 4 * kind bytes
//!         kind 0         u32 length, its own 4 bytes included, and the event
//!         kind 29        padding: to the end, or u32 length of it
//!         kind 30        u32: further ns in units of 2^27
//!         kind 31        u32: the low 59 bits of a time, in units of 2^27
//! ```
//!
//! If the ring was full, the kernel left out events and says so in the first page after them. This
//! file knows no event and reads no file.

/// The ring left out events in front of this page.
const MISSED: u64 = 1 << 31;
/// How many they were stands behind the data.
const MISSED_STORED: u64 = 1 << 30;
/// The length of the data, in bytes.
const LENGTH: u64 = (1 << 27) - 1;

const HEAD: usize = 16;

/// What a page says beside its events.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Page {
    /// The time of its first event, in ns.
    pub first_ns: u64,
    /// Whether the ring left out events before it.
    pub missed: bool,
}

/// A page that is not as described.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("a page of the kernel's events is not understood at byte {at} of {length}")]
pub struct BadPage {
    /// The place.
    pub at: usize,
    /// The length of the page.
    pub length: usize,
}

/// Reads a page: calls `each` with the time and bytes of each event, in their order.
///
/// # Errors
/// The page is not as described; the events before that place have been read.
pub fn read(bytes: &[u8], mut each: impl FnMut(u64, &[u8])) -> Result<Page, BadPage> {
    let bad = |at| BadPage {
        at,
        length: bytes.len(),
    };
    let first_ns = word8(bytes, 0).ok_or_else(|| bad(0))?;
    let commit = word8(bytes, 8).ok_or_else(|| bad(8))?;
    let end = HEAD + (commit & LENGTH) as usize;
    let data = bytes.get(..end).ok_or_else(|| bad(8))?;
    let (mut at, mut now) = (HEAD, first_ns);
    while at < data.len() {
        let head = word4(data, at).ok_or_else(|| bad(at))?;
        let (kind, passed) = (head & 31, u64::from(head >> 5));
        let second = || word4(data, at + 4).ok_or_else(|| bad(at));
        let (from, length) = match kind {
            29 if passed == 0 => break,
            29 => {
                at += 4 + (second()? as usize).max(4);
                continue;
            }
            30 => {
                now = now.saturating_add((u64::from(second()?) << 27) + passed);
                at += 8;
                continue;
            }
            31 => {
                let low = (u64::from(second()?) << 27) + passed;
                now = (now & (31 << 59)) | (low & !(31 << 59));
                at += 8;
                continue;
            }
            0 => (
                at + 8,
                (second()? as usize).checked_sub(4).ok_or_else(|| bad(at))?,
            ),
            words => (at + 4, words as usize * 4),
        };
        now = now.saturating_add(passed);
        let event = data.get(from..from + length).ok_or_else(|| bad(at))?;
        each(now, event);
        at = from + length;
    }
    let missed = commit & (MISSED | MISSED_STORED) != 0;
    Ok(Page { first_ns, missed })
}

fn word4(bytes: &[u8], at: usize) -> Option<u32> {
    let word = bytes.get(at..at + 4)?;
    Some(u32::from_ne_bytes(word.try_into().ok()?))
}

fn word8(bytes: &[u8], at: usize) -> Option<u64> {
    let word = bytes.get(at..at + 8)?;
    Some(u64::from_ne_bytes(word.try_into().ok()?))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn page(first_ns: u64, flags: u64, data: &[u32]) -> Vec<u8> {
        let mut bytes = first_ns.to_ne_bytes().to_vec();
        bytes.extend(((data.len() as u64 * 4) | flags).to_ne_bytes());
        bytes.extend(data.iter().flat_map(|word| word.to_ne_bytes()));
        bytes
    }

    type Events = Vec<(u64, Vec<u8>)>;

    fn events(bytes: &[u8]) -> Result<(Page, Events), BadPage> {
        let mut all = Vec::new();
        let page = read(bytes, |at, event| all.push((at, event.to_vec())))?;
        Ok((page, all))
    }

    #[test]
    fn every_kind_of_entry_is_read() {
        let data = [
            (5 << 5) | 1, // 4 bytes, 5 ns later
            0xaaaa,
            (2 << 5) | 30, // 2^27 + 2 ns
            1,
            (1 << 5) | 29, // padding of 8 bytes in all
            4,
            (3 << 5), // 8 bytes with their length
            12,
            0xbbbb,
            0xcccc,
            (9 << 5) | 31, // a time
            2,
            (1 << 5) | 1,
            0xdddd,
            29, // padding to the end
            77,
        ];
        let (page, all) = events(&page(1_000, 0, &data)).expect("a page");
        assert!(!page.missed && page.first_ns == 1_000);
        let times: Vec<u64> = all.iter().map(|(at, _)| *at).collect();
        let second = 1_005 + (1 << 27) + 2 + 3;
        assert_eq!(times, [1_005, second, (2 << 27) + 9 + 1]);
        assert_eq!(all[0].1, 0xaaaa_u32.to_ne_bytes());
        assert_eq!(all[1].1.len(), 8);
    }

    #[test]
    fn a_full_ring_is_told_in_the_first_page_after_it() {
        for flags in [MISSED, MISSED | MISSED_STORED] {
            let (page, all) = events(&page(1, flags, &[(5 << 5) | 1, 7])).expect("a page");
            assert!(page.missed);
            assert_eq!(all.len(), 1);
        }
    }

    #[test]
    fn a_cut_page_is_refused() {
        let whole = page(1, 0, &[(5 << 5) | 2, 7, 8]);
        for length in 0..whole.len() {
            assert!(events(&whole[..length]).is_err(), "{length}");
        }
        let wrong = page(1, 0, &[0, 3]);
        assert_eq!(events(&wrong).expect_err("too short").at, HEAD);
    }

    proptest! {
        #[test]
        fn no_bytes_make_it_panic_or_go_back(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
            let _ = events(&bytes);
        }

        #[test]
        fn times_never_go_back_without_a_time_of_their_own(
            all in prop::collection::vec((0_u32..1 << 27, any::<u32>()), 0..50),
        ) {
            let data = all.iter().flat_map(|(passed, word)| [(passed << 5) | 1, *word]);
            let data: Vec<u32> = data.collect();
            let (_, read) = events(&page(7, 0, &data)).expect("a page");
            prop_assert_eq!(read.len(), all.len());
            prop_assert!(read.iter().map(|(at, _)| *at).is_sorted());
        }
    }
}
