//! A case of the search: who says what at which time, and which faults come meanwhile.

use lager_wire::{OperatorCommand, Speed};
use proptest::prelude::*;

/// A process that a fault may freeze.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Who {
    /// The panel's page in a person's browser.
    Page,
    /// The GaG at the station.
    Gag,
    /// The station, with the panel in it.
    Station,
    Comm,
    /// A `lager drive` on the robot's computer.
    Drive,
    Logic,
    Bridge,
}

/// A connection that a fault may cut or slow down.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Line {
    /// From a page to the panel.
    Page,
    /// Between station and comm.
    Link,
    /// Between bridge and steering board, towards the board and back.
    Serial,
}

/// A fault that begins at `at`, in ms.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Fault {
    /// A process is frozen for `lasts` ms.
    Freeze { who: Who, at: u64, lasts: u64 },
    /// Bridge or comm is killed; its successor starts `back` ms later.
    Kill { who: Who, at: u64, back: u64 },
    /// The bridge is frozen; the supervisor finds it silent and replaces it after `lasts` ms.
    Replace { at: u64, lasts: u64 },
    /// Nothing passes for `lasts` ms.
    Cut { line: Line, at: u64, lasts: u64 },
    /// Whatever is sent in this time arrives later by this delay.
    Slow {
        line: Line,
        at: u64,
        lasts: u64,
        by: u64,
    },
}

/// An action of a person or a program.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Act {
    /// A person holds a key of a page for this time, and lets go.
    Hold {
        command: OperatorCommand,
        lasts: u64,
    },
    /// A person presses a key of a page for a one-shot command.
    Press(OperatorCommand),
    /// A person at a page ends the stop that the page shows.
    Resume,
    /// The GaG gives a command once.
    Say(OperatorCommand),
    /// A person at the robot runs `lager drive` for this time.
    Drive {
        command: OperatorCommand,
        lasts: u64,
    },
    /// A person at the robot stops it.
    Stop,
    /// A person at the robot ends the stop in force.
    ResumeHere,
}

/// Who drives the robot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Way {
    /// People.
    ByHand,
    /// Logic, from the start.
    ByItself,
    /// Logic, which stands at goods while the external computer moves the arm.
    Picking,
}

/// One run of the model.
#[derive(Clone, Debug)]
pub(crate) struct Case {
    pub(crate) way: Way,
    /// The actions, each with its time in ms.
    pub(crate) acts: Vec<(u64, Act)>,
    pub(crate) faults: Vec<Fault>,
}

/// The length of a case, in ms from the moment at which the robot can be driven.
pub(crate) const LENGTH: u64 = 6_000;

/// Turns the wheels until another command comes.
pub(crate) const LEFT: OperatorCommand = OperatorCommand::Left(Speed::Full);
/// Turns by 45 degrees, and ends by itself.
pub(crate) const TURN: OperatorCommand = OperatorCommand::LeftDiag;
/// A long step of the arm: it closes the claw.
pub(crate) fn squeeze() -> OperatorCommand {
    OperatorCommand::arm("squeeze").expect("a step of the arm")
}

/// The actions that are possible in this way of driving.
fn acts(way: Way) -> BoxedStrategy<Act> {
    let lasts = || 300..2_500_u64;
    let stops = prop_oneof![Just(Act::Stop), Just(Act::ResumeHere), Just(Act::Resume)];
    let commands = || prop_oneof![Just(LEFT), Just(TURN)];
    match way {
        Way::ByHand => prop_oneof![
            3 => lasts().prop_map(|lasts| Act::Hold { command: LEFT, lasts }),
            2 => Just(Act::Press(TURN)),
            3 => commands().prop_map(Act::Say),
            3 => lasts().prop_map(|lasts| Act::Drive { command: LEFT, lasts }),
            2 => stops,
        ]
        .boxed(),
        Way::ByItself => stops.boxed(),
        Way::Picking => prop_oneof![
            2 => Just(Act::Say(squeeze())),
            1 => stops,
        ]
        .boxed(),
    }
}

/// The faults that may come around the time of one of the actions.
fn faults(acts: &[(u64, Act)]) -> BoxedStrategy<Fault> {
    let moments: Vec<u64> = acts.iter().map(|(at, _)| *at).collect();
    let at = move || {
        let around = (prop::sample::select(moments.clone()), 0..1_600_u64);
        around.prop_map(|(moment, after)| (moment + after).saturating_sub(500))
    };
    let lasts = || prop_oneof![40..300_u64, 300..2_800_u64];
    let who = prop_oneof![
        Just(Who::Page),
        Just(Who::Gag),
        Just(Who::Station),
        Just(Who::Comm),
        Just(Who::Drive),
        Just(Who::Logic),
        Just(Who::Bridge),
    ];
    let killed = prop_oneof![Just(Who::Comm), Just(Who::Bridge)];
    let line = || prop_oneof![Just(Line::Page), Just(Line::Link), Just(Line::Serial)];
    prop_oneof![
        4 => (who, at(), lasts()).prop_map(|(who, at, lasts)| Fault::Freeze { who, at, lasts }),
        3 => (killed, at(), 60..2_000_u64).prop_map(|(who, at, back)| Fault::Kill { who, at, back }),
        2 => (at(), lasts()).prop_map(|(at, lasts)| Fault::Replace { at, lasts }),
        3 => (line(), at(), lasts()).prop_map(|(line, at, lasts)| Fault::Cut { line, at, lasts }),
        2 => (line(), at(), lasts(), 20..600_u64)
            .prop_map(|(line, at, lasts, by)| Fault::Slow { line, at, lasts, by }),
    ]
    .boxed()
}

/// All cases that the search may try.
pub(crate) fn cases() -> impl Strategy<Value = Case> {
    let way = prop_oneof![
        3 => Just(Way::ByHand),
        2 => Just(Way::ByItself),
        1 => Just(Way::Picking),
    ];
    way.prop_flat_map(|way| {
        let acts = prop::collection::vec((200..4_500_u64, acts(way)), 1..5);
        acts.prop_flat_map(move |acts| {
            let faults = prop::collection::vec(faults(&acts), 0..3);
            (Just(acts), faults).prop_map(move |(acts, faults)| Case { way, acts, faults })
        })
    })
}
