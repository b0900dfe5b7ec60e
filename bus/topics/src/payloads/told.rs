//! What the navigator was told and what it did: `nav/inputs`. Whoever runs a navigator of the same
//! build on the same inputs gets the same outputs, so a recording of them can be proved.
//!
//! A navigator's life on the topic, number after number:
//!
//! ```text
//!   text Began .. text Map .. entries .. entries .. text Map .. entries ..
//! ```
//!
//! An entry is one input with its time. It has the order that was in force after it, and a proof of
//! all that the navigator said and was after it, so outputs need not be there to be compared. What
//! no entry has room for is a text, in pieces: one in each sample that has no entries.

use super::nav::Heading;
use super::steering::SteeringReport;
use crate::schema::payload;
use crate::tag::{Tag, coded};

coded! {
    /// What the navigator was told. The names in brackets are the fields of [`Told`] it fills.
    pub enum ToldKind {
        /// Nothing: the place in the list is not used.
        None = 0,
        /// Nothing but time has passed.
        Tick = 1,
        /// A line frame (`value`: the line's state as on the wire).
        Line = 2,
        /// A distance (`value`: cm).
        Distance = 3,
        /// The next one of [`ToldInputs::reports`].
        Steering = 4,
        /// The map that was the last text.
        Map = 5,
        /// An order (`number`, `product`).
        Order = 6,
        /// An order is taken back (`number`).
        Cancel = 7,
        /// An order is moved up (`number`).
        MoveUp = 8,
        /// All waiting orders are taken back.
        ClearQueue = 9,
        /// The goods are in the gripper (`number`: the order; `flag`: whether or not it feels
        /// them).
        PickupDone = 10,
        /// Who picks the goods up (`value`: a [`Pick`](super::Pick)).
        Pick = 11,
        /// What was driven by hand (`number`: as [`Health`](crate::Health) has it).
        DrivenByHand = 12,
        /// The robot has been put on the delivery node.
        Reset = 13,
        /// The robot has been put on a node (`x`, `y`, `heading`).
        Placed = 14,
        /// A way is blocked or open (`x`, `y`, `heading`; `value`: a
        /// [`BlockSource`](super::BlockSource); `flag`: it is open).
        Way = 15,
        /// The external computer is out of reach, or there again (`flag`: out of reach).
        Link = 16,
        /// Who may drive (`value`: a [`Mode`](crate::Mode); `flag`: a stop is latched).
        Mode = 17,
        /// No input: the order in force was published again, because its lease wants it.
        Renewed = 18,
        /// No input: the status was published again, because it was due.
        Repeated = 19,
        /// Goods are not in their place, or there again (`number`: the product, or
        /// [`Input::ALL_GOODS`](super::Input::ALL_GOODS); `flag`: there again).
        Goods = 20,
    }
}

coded! {
    /// What a text of [`ToldInputs`] says, in JSON.
    pub enum TextKind {
        /// There is no text.
        None = 0,
        /// A navigator has begun: its constants, and what it took up of an earlier one.
        Began = 1,
        /// A map.
        Map = 2,
    }
}

payload! {
    /// One input of the navigator, and what became of it.
    pub struct Told: 40 bytes {
        /// Robot time, in ns.
        pub time_ns: u64,
        /// See [`ToldKind`].
        pub number: u64,
        /// See [`ToldKind`].
        pub product: i32,
        /// Over the navigator's whole answer: events, order, status, thought, and route, blocked
        /// ways and queue where they changed.
        pub proof: u32,
        /// Number of the steering order in force after it.
        pub command_id: u32,
        /// What it is.
        pub kind: Tag<ToldKind>,
        /// See [`ToldKind`].
        pub value: u8,
        /// See [`ToldKind`].
        pub flag: u8,
        /// See [`ToldKind`].
        pub x: u8,
        /// See [`ToldKind`].
        pub y: u8,
        /// See [`ToldKind`].
        pub heading: Tag<Heading>,
        /// Command code of the order in force after it; 0 = there is none.
        pub code: u8,
        /// Whether that order lets the operator move the arm.
        pub arm_granted: u8,
        /// Always 0.
        #[serde(skip)]
        pub reserved: [u8; 4],
    }
}

payload! {
    /// How far a publisher of the navigator has come.
    pub struct Sent: 16 bytes {
        /// The epoch in the stamps of its samples.
        pub epoch: u64,
        /// The number of its next sample.
        pub next: u64,
    }
}

payload! {
    /// A piece of what the navigator was told: entries, or a part of a text.
    pub struct ToldInputs: 1992 bytes {
        /// Number of the first entry, counted from the navigator's begin.
        pub first: u64,
        /// Its `steering/command`, before the first entry.
        pub commands: Sent,
        /// Its `nav/status`, before the first entry.
        pub statuses: Sent,
        /// Its `mission/event`, before the first entry.
        pub events: Sent,
        /// Bytes of the text that follow in the next samples.
        pub text_left: u32,
        /// How many bytes of `text` are used.
        pub text_used: u16,
        /// What the text is.
        pub text_kind: Tag<TextKind>,
        /// How many of `entries` are used.
        pub entries_used: u8,
        /// How many of `reports` are used.
        pub reports_used: u8,
        /// Always 0.
        #[serde(skip)]
        pub reserved: [u8; 7],
        /// The inputs, in the order in which the navigator was told.
        #[serde(with = "crate::list")]
        pub entries: [Told; 24],
        /// The reports of the steering board among them.
        #[serde(with = "crate::list")]
        pub reports: [SteeringReport; 8],
        /// The piece of text, in UTF-8.
        #[serde(with = "crate::list")]
        pub text: [[u8; 32]; 16],
    }
}

impl ToldInputs {
    /// The entries in use.
    pub fn entries(&self) -> &[Told] {
        &self.entries[..usize::from(self.entries_used).min(self.entries.len())]
    }

    /// The reports in use.
    pub fn reports(&self) -> &[SteeringReport] {
        &self.reports[..usize::from(self.reports_used).min(self.reports.len())]
    }

    /// The piece of text in use.
    pub fn text(&self) -> &[u8] {
        let text = self.text.as_flattened();
        &text[..usize::from(self.text_used).min(text.len())]
    }
}
