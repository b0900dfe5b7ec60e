//! What holds for any bytes at all that come over the network, at either end. The ordinary tests and
//! the fuzz target ask for the same.

use lager_remote::{About, Beat, Clocks, Endpoint, Ledger, Note, Time};
use lager_sample::Description;

/// Reads `bytes` as everything that a gateway or a listener reads.
pub(crate) fn hold(bytes: &[u8]) {
    let mut ledger = Ledger::new();
    for piece in bytes.chunks(Note::SIZE) {
        if let Ok(note) = Note::from_bytes(piece) {
            assert_eq!(Note::from_bytes(&note.to_bytes()), Ok(note));
            let before = ledger.account();
            ledger.hear(&note);
            assert!(ledger.account().received >= before.received);
        }
    }
    if let Ok(beat) = serde_json::from_slice::<Beat>(bytes) {
        for topic in beat.topics.keys() {
            let counts = beat.counts(topic).expect("it is one of them");
            ledger.tell(&counts);
            ledger.account().missing();
        }
        let again = serde_json::to_string(&beat).expect("JSON");
        assert_eq!(serde_json::from_str::<Beat>(&again).expect("a beat"), beat);
    }
    if let Ok(about) = serde_json::from_slice::<About>(bytes)
        && let Ok(layout) = Description::parse(&about.layout)
    {
        assert_eq!(
            Description::parse(layout.text()).expect("a layout").size(),
            layout.size()
        );
    }
    if let Ok(time) = serde_json::from_slice::<Time>(bytes) {
        let mut clocks = Clocks::default();
        clocks.exchange(
            time.now_ns,
            time.unix_offset_ns.unsigned_abs(),
            time.now_ns / 2,
        );
        clocks.offset(0).expect("an offset");
    }
    if let Ok(text) = std::str::from_utf8(bytes)
        && let Ok(endpoint) = text.parse::<Endpoint>()
    {
        assert_eq!(endpoint.to_string().parse(), Ok(endpoint.clone()));
        let _ = endpoint.may_listen();
    }
}
