//! What is tried: who says what and when, and what goes wrong meanwhile.

use lager_wire::OperatorCommand;
use proptest::prelude::*;

/// Somebody who runs, and who may be frozen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Who {
    /// The page of the panel in somebody's browser.
    Page,
    /// The GaG at the station.
    Gag,
    /// The station, with the panel in it.
    Station,
    Comm,
    /// A `lager drive` at the robot.
    Drive,
    Logic,
    Bridge,
}

/// A connection that may be slow, or cut.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Line {
    /// From a page to the panel.
    Page,
    /// Between station and comm.
    Link,
    /// Between bridge and steering board, towards the board and back.
    Serial,
}

/// What goes wrong, from `at` on, in ms.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Fault {
    /// A process stands still for so long.
    Freeze { who: Who, at: u64, lasts: u64 },
    /// Bridge or comm is killed; its successor begins so much later.
    Kill { who: Who, at: u64, back: u64 },
    /// The bridge is frozen, and then found silent and replaced.
    Replace { at: u64, lasts: u64 },
    /// Nothing passes for so long.
    Cut { line: Line, at: u64, lasts: u64 },
    /// Whatever is sent in this time takes so much longer.
    Slow {
        line: Line,
        at: u64,
        lasts: u64,
        by: u64,
    },
}

/// What somebody does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Act {
    /// A person holds a key of a page for so long, and lets go.
    Hold {
        command: OperatorCommand,
        lasts: u64,
    },
    /// A person presses a key of a page for what runs once.
    Press(OperatorCommand),
    /// A person at a page wants the stop that he sees to be over.
    Resume,
    /// The GaG says a command, once.
    Say(OperatorCommand),
    /// Somebody at the robot runs `lager drive` for so long.
    Drive {
        command: OperatorCommand,
        lasts: u64,
    },
    /// Somebody at the robot stops it.
    Stop,
    /// Somebody at the robot ends the stop that he sees.
    ResumeHere,
}

/// Who drives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Way {
    /// People.
    ByHand,
    /// Logic, from the start on.
    ByItself,
    /// Logic, which stands at goods and lets the external computer move the arm.
    Picking,
}

/// One run.
#[derive(Clone, Debug)]
pub(crate) struct Case {
    pub(crate) way: Way,
    /// What is done, and when, in ms.
    pub(crate) acts: Vec<(u64, Act)>,
    pub(crate) faults: Vec<Fault>,
}

/// How long a case lasts, in ms from the moment at which the robot can be driven.
pub(crate) const LENGTH: u64 = 6_000;

/// Turns the wheels until it is told otherwise.
pub(crate) const LEFT: OperatorCommand = OperatorCommand::Left;
/// Turns by 45 degrees, and ends by itself.
pub(crate) const TURN: OperatorCommand = OperatorCommand::LeftDiag;
/// The arm's step that takes long: it closes the claw.
pub(crate) fn squeeze() -> OperatorCommand {
    OperatorCommand::arm("squeeze").expect("a step of the arm")
}

/// What somebody may do by this way of driving.
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

/// What may go wrong around one of the moments at which something is done.
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

/// Everything that may come together.
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
