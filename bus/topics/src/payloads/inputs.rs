//! [`NavigatorInputs`]: the navigator's inputs and answers, on `nav/inputs`. A navigator of the
//! same build gives the same answers to the same inputs, so a recording of them can be verified.
//!
//! A navigator's life on the topic, number after number:
//!
//! ```text
//!   text Began .. text Map .. entries .. entries .. text Map .. entries ..
//! ```
//!
//! An entry is one input with its time. It also has the order in force after the input, and a check
//! value of the navigator's outputs and state after it. So a verifier needs no recording of the
//! outputs. Reports, orders and people's inputs stand beside the entries, as the samples that came.
//! A map and the navigator's start do not fit into an entry: they are texts in pieces, one piece in
//! each sample that has no entries.

use lager_sample::{Tag, coded, payload};

use super::action::Input;
use super::mission::Order;
use super::steering::SteeringReport;

coded! {
    /// The kind of a navigator's input. In brackets: the fields of [`NavigatorInput`] that it
    /// fills.
    pub enum NavigatorInputKind {
        /// Nothing: the place in the list is not used.
        None = 0,
        /// Only time has passed.
        Tick = 1,
        /// A line frame (`value`: the line's state as on the wire).
        Line = 2,
        /// A distance (`value`: cm).
        Distance = 3,
        /// The next one of [`NavigatorInputs::reports`].
        Steering = 4,
        /// The map in the last text.
        Map = 5,
        /// The next one of [`NavigatorInputs::orders`].
        Order = 6,
        /// The next one of [`NavigatorInputs::operator`].
        Operator = 7,
        /// How far people have driven the robot (`number`: as in [`Health`](crate::Health)).
        DrivenByHand = 8,
        /// Who may drive (`value`: a [`Mode`](crate::Mode); `flag`: a stop is latched).
        Mode = 9,
        /// No input: the shell published the order in force again, to renew its lease.
        Renewed = 10,
        /// No input: the shell published the status again, because it was due.
        Repeated = 11,
    }
}

coded! {
    /// The meaning of a text in [`NavigatorInputs`], which is JSON.
    pub enum TextKind {
        /// There is no text.
        None = 0,
        /// A navigator has started: its constants, and the state that it took over.
        Began = 1,
        /// A map.
        Map = 2,
    }
}

payload! {
    /// One input of the navigator, and its result.
    pub struct NavigatorInput: 32 bytes {
        /// Robot time, in ns.
        pub time_ns: u64,
        /// See [`NavigatorInputKind`].
        pub number: u64,
        /// A check value of the navigator's whole answer: events, order, status, thought, and also
        /// route, blocked ways and queue if they changed.
        pub proof: u32,
        /// Number of the steering order in force after this input.
        pub command_id: u32,
        /// The kind of this input.
        pub kind: Tag<NavigatorInputKind>,
        /// See [`NavigatorInputKind`].
        pub value: u8,
        /// See [`NavigatorInputKind`].
        pub flag: u8,
        /// Command code of the order in force after this input; 0 = there is none.
        pub code: u8,
        /// Whether that order lets the operator move the arm.
        pub arm_granted: u8,
        /// Always 0.
        #[serde(skip)]
        pub reserved: [u8; 3],
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
    /// A piece of the navigator's inputs: entries, or a part of a text.
    pub struct NavigatorInputs: 1880 bytes {
        /// Number of the first entry, counted from the navigator's start.
        pub first: u64,
        /// The state of its `steering/command` publisher before the first entry.
        pub commands: Sent,
        /// The state of its `nav/status` publisher before the first entry.
        pub statuses: Sent,
        /// The state of its `mission/event` publisher before the first entry.
        pub events: Sent,
        /// How many bytes of the text follow in the next samples.
        pub text_left: u32,
        /// How many bytes of `text` are used.
        pub text_used: u16,
        /// The meaning of the text.
        pub text_kind: Tag<TextKind>,
        /// How many of `entries` are used.
        pub entries_used: u8,
        /// How many of `reports` are used.
        pub reports_used: u8,
        /// How many of `orders` are used.
        pub orders_used: u8,
        /// How many of `operator` are used.
        pub operator_used: u8,
        /// Always 0.
        #[serde(skip)]
        pub reserved: [u8; 5],
        /// The inputs, in the order in which the navigator took them.
        #[serde(with = "lager_sample::list")]
        pub entries: [NavigatorInput; 24],
        /// The samples of `steering/state` among them.
        #[serde(with = "lager_sample::list")]
        pub reports: [SteeringReport; 8],
        /// The samples of `mission/order` among them.
        #[serde(with = "lager_sample::list")]
        pub orders: [Order; 4],
        /// The samples of `operator/input` among them.
        #[serde(with = "lager_sample::list")]
        pub operator: [Input; 4],
        /// The piece of text, in UTF-8.
        #[serde(with = "lager_sample::list")]
        pub text: [[u8; 32]; 16],
    }
}

/// The sample that an entry refers to but does not contain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Beside<'a> {
    /// The entry refers to no sample.
    Nothing,
    /// A sample of `steering/state`.
    Report(&'a SteeringReport),
    /// A sample of `mission/order`.
    Order(&'a Order),
    /// A sample of `operator/input`.
    Operator(&'a Input),
}

impl NavigatorInputs {
    /// Adds an entry. The piece must not be full.
    pub fn add(&mut self, entry: NavigatorInput, beside: Beside<'_>) {
        match beside {
            Beside::Nothing => {}
            Beside::Report(report) => push(&mut self.reports, &mut self.reports_used, *report),
            Beside::Order(order) => push(&mut self.orders, &mut self.orders_used, *order),
            Beside::Operator(input) => push(&mut self.operator, &mut self.operator_used, *input),
        }
        push(&mut self.entries, &mut self.entries_used, entry);
    }

    /// Whether there may be no room for another entry.
    pub fn is_full(&self) -> bool {
        usize::from(self.entries_used) >= self.entries.len()
            || usize::from(self.reports_used) >= self.reports.len()
            || usize::from(self.orders_used) >= self.orders.len()
            || usize::from(self.operator_used) >= self.operator.len()
    }

    /// The entries in use, each with the sample that it refers to.
    pub fn entries(&self) -> impl Iterator<Item = (&NavigatorInput, Beside<'_>)> {
        let mut reports = used(&self.reports, self.reports_used).iter();
        let mut orders = used(&self.orders, self.orders_used).iter();
        let mut operator = used(&self.operator, self.operator_used).iter();
        used(&self.entries, self.entries_used)
            .iter()
            .map(move |entry| {
                let beside = match entry.kind.get() {
                    Some(NavigatorInputKind::Steering) => reports.next().map(Beside::Report),
                    Some(NavigatorInputKind::Order) => orders.next().map(Beside::Order),
                    Some(NavigatorInputKind::Operator) => operator.next().map(Beside::Operator),
                    _ => None,
                };
                (entry, beside.unwrap_or(Beside::Nothing))
            })
    }

    /// The piece of text in use.
    pub fn text(&self) -> &[u8] {
        let text = self.text.as_flattened();
        &text[..usize::from(self.text_used).min(text.len())]
    }
}

fn push<T>(list: &mut [T], count: &mut u8, item: T) {
    list[usize::from(*count)] = item;
    *count += 1;
}

fn used<T>(list: &[T], count: u8) -> &[T] {
    &list[..usize::from(count).min(list.len())]
}
