//! Ways that are drawn by hand, and laws of every way.

use proptest::prelude::*;

use super::*;

/// A service, its sender, and a stranger.
const SERVICE: Thread = 10;
const SENDER: Thread = 20;
const STRANGER: Thread = 30;

fn name(thread: Thread) -> [u8; 16] {
    let mut name = [0; 16];
    name[..2].copy_from_slice(format!("{thread:02}").as_bytes());
    name
}

fn event(at_ns: u64, core: usize, thread: Thread, what: What) -> Event {
    let in_interrupt = false;
    Event {
        at_ns,
        core,
        thread,
        in_interrupt,
        what,
    }
}

fn switch(at_ns: u64, core: usize, from: Thread, left: Left, next: Thread) -> Event {
    let names = [name(from), name(next)];
    event(at_ns, core, from, What::Switch { left, next, names })
}

fn wakes(at_ns: u64, core: usize, waker: Thread, woken: Thread) -> Event {
    event(at_ns, core, waker, What::Waking(woken))
}

fn line(events: impl IntoIterator<Item = Event>) -> Timeline {
    let mut line = Timeline::default();
    events.into_iter().for_each(|event| line.push(event));
    line
}

/// What the way of the service from 100 to 1000 is made of.
fn way(events: impl IntoIterator<Item = Event>) -> Vec<(u64, u64, Thread, Doing)> {
    let line = line(events);
    let way = Window::new(&line, 0, 2_000).way(SERVICE, 100, 1_000);
    way.iter()
        .map(|piece| (piece.from_ns, piece.to_ns, piece.thread, piece.doing))
        .collect()
}

const TIMER: Source = Source::Vector("local_timer");

#[test]
fn a_sleep_is_a_wait_for_whoever_woke() {
    // The sender runs on core 1 and wakes the service, whose core 0 was asleep.
    let found = way([
        event(50, 0, 0, What::Idle(Some(2))),
        switch(60, 1, 0, Left::Ready, SENDER),
        wakes(300, 1, SENDER, SERVICE),
        event(380, 0, 0, What::Idle(None)),
        switch(400, 0, 0, Left::Ready, SERVICE),
    ]);
    let expected = [
        (100, 300, SENDER, Doing::Ran),
        (300, 380, SERVICE, Doing::Wakes(Some(2))),
        (380, 400, SERVICE, Doing::Wakes(Some(2))),
        (400, 1_000, SERVICE, Doing::Ran),
    ];
    assert_eq!(found, expected);
}

#[test]
fn a_ready_thread_waits_behind_whom_its_core_runs() {
    let found = way([
        switch(60, 0, 0, Left::Ready, SERVICE),
        switch(300, 0, SERVICE, Left::Ready, STRANGER),
        event(400, 0, STRANGER, What::Enter(TIMER)),
        event(450, 0, STRANGER, What::Exit(TIMER)),
        switch(600, 0, STRANGER, Left::Ready, SERVICE),
    ]);
    let expected = [
        (100, 300, SERVICE, Doing::Ran),
        (300, 400, SERVICE, Doing::Behind(STRANGER)),
        (400, 450, SERVICE, Doing::Interrupt(TIMER)),
        (450, 600, SERVICE, Doing::Behind(STRANGER)),
        (600, 1_000, SERVICE, Doing::Ran),
    ];
    assert_eq!(found, expected);
}

#[test]
fn an_interrupt_with_timers_and_what_is_inside_it_takes_the_time_of_the_thread() {
    let expired = |function| What::Expired {
        timer: 1,
        function,
        now_ns: 0,
    };
    let soft = Source::Soft(1);
    let found = way([
        switch(60, 0, 0, Left::Ready, SERVICE),
        event(200, 0, SERVICE, What::Enter(TIMER)),
        event(210, 0, SERVICE, expired(77)),
        event(300, 0, SERVICE, What::Exit(TIMER)),
        event(310, 0, SERVICE, What::Enter(soft)),
        event(320, 0, SERVICE, What::Enter(TIMER)),
        event(330, 0, SERVICE, What::Exit(TIMER)),
        event(400, 0, SERVICE, What::Exit(soft)),
    ]);
    let expected = [
        (100, 200, Doing::Ran),
        (200, 210, Doing::Interrupt(TIMER)),
        (210, 300, Doing::Timer(77)),
        (300, 310, Doing::Ran),
        (310, 320, Doing::Interrupt(soft)),
        (320, 330, Doing::Interrupt(TIMER)),
        (330, 400, Doing::Interrupt(soft)),
        (400, 1_000, Doing::Ran),
    ];
    assert_eq!(
        found,
        expected.map(|(from, to, doing)| (from, to, SERVICE, doing))
    );
}

#[test]
fn a_fault_that_waits_for_a_disk_lasts_until_the_thread_is_woken() {
    let found = way([
        switch(60, 0, 0, Left::Ready, SERVICE),
        event(200, 0, SERVICE, What::Fault),
        switch(230, 0, SERVICE, Left::Disk, 0),
        wakes(700, 0, 0, SERVICE),
        switch(720, 0, 0, Left::Ready, SERVICE),
    ]);
    let expected = [
        (100, 200, Doing::Ran),
        (200, 230, Doing::Fault),
        (230, 700, Doing::Fault),
        (700, 720, Doing::Wakes(None)),
        (720, 1_000, Doing::Ran),
    ];
    assert_eq!(
        found,
        expected.map(|(from, to, doing)| (from, to, SERVICE, doing))
    );
}

#[test]
fn a_stopped_thread_does_not_wait_for_whoever_lets_it_go_on() {
    let found = way([
        switch(60, 0, SERVICE, Left::Stopped, 0),
        wakes(700, 1, STRANGER, SERVICE),
        switch(720, 0, 0, Left::Ready, SERVICE),
    ]);
    assert_eq!(found[0], (100, 700, SERVICE, Doing::Stopped));
    // Also if it was stopped long ago.
    let mut line = line([
        switch(60, 0, SERVICE, Left::Stopped, 0),
        wakes(700, 1, STRANGER, SERVICE),
        switch(720, 0, 0, Left::Ready, SERVICE),
    ]);
    line.forget_before(100);
    let way = Window::new(&line, 100, 2_000).way(SERVICE, 100, 1_000);
    assert_eq!((way[0].doing, way[0].ns()), (Doing::Stopped, 600));
}

#[test]
fn one_that_is_woken_on_its_way_off_the_core_was_not_asleep() {
    let found = way([
        switch(60, 0, 0, Left::Ready, SERVICE),
        switch(70, 1, 0, Left::Ready, SENDER),
        wakes(300, 1, SENDER, SERVICE),
        switch(310, 0, SERVICE, Left::Asleep, STRANGER),
        switch(800, 0, STRANGER, Left::Ready, SERVICE),
    ]);
    let expected = [
        (310, 800, SERVICE, Doing::Behind(STRANGER)),
        (800, 1_000, SERVICE, Doing::Ran),
    ];
    assert_eq!(found[found.len() - 2..], expected);
}

#[test]
fn before_a_late_interrupt_nothing_ran() {
    let due = |due_ns| event(20, 0, SERVICE, What::Set { timer: 1, due_ns });
    let comes = |at| {
        [
            event(at, 0, SERVICE, What::Enter(TIMER)),
            event(
                at + 1,
                0,
                SERVICE,
                What::Expired {
                    timer: 1,
                    function: 5,
                    now_ns: at,
                },
            ),
            event(at + 9, 0, SERVICE, What::Exit(TIMER)),
        ]
    };
    let whole = |late_by: u64| {
        let start = switch(10, 0, 0, Left::Ready, SERVICE);
        let at = 100_000;
        let line = line([start, due(at - late_by)].into_iter().chain(comes(at)));
        let way = Window::new(&line, 0, 300_000).way(SERVICE, 20, 200_000);
        let still = way.iter().filter(|piece| piece.doing == Doing::Still);
        still.map(Piece::ns).sum::<u64>()
    };
    assert_eq!(whole(60_000), 60_000);
    assert_eq!(whole(LATE_NS), 0, "a short pause of the kernel");
}

#[test]
fn who_runs_at_a_time_has_a_core_then() {
    let line = line([
        switch(60, 1, 0, Left::Ready, SENDER),
        wakes(100, 1, SENDER, SERVICE),
        switch(120, 0, 0, Left::Ready, SERVICE),
        switch(150, 0, SERVICE, Left::Ready, STRANGER),
        switch(300, 0, STRANGER, Left::Asleep, SERVICE),
        switch(400, 0, SERVICE, Left::Asleep, 0),
    ]);
    let mut window = Window::new(&line, 0, 1_000);
    assert_eq!(window.running(&[SENDER, SERVICE], 350), [SENDER, SERVICE]);
    assert_eq!(window.running(&[SENDER, SERVICE], 200), [SENDER]);
}

fn any_what() -> impl Strategy<Value = What> {
    let thread = prop::sample::select(vec![0, SERVICE, SENDER, STRANGER]);
    let left = prop::sample::select(vec![Left::Ready, Left::Asleep, Left::Disk, Left::Stopped]);
    let source = prop::sample::select(vec![TIMER, Source::Soft(1), Source::Line(3)]);
    prop_oneof![
        (left, thread.clone()).prop_map(|(left, next)| What::Switch {
            left,
            next,
            names: [[0; 16]; 2],
        }),
        thread.prop_map(What::Waking),
        source.clone().prop_map(What::Enter),
        source.prop_map(What::Exit),
        Just(What::Fault),
        Just(What::Idle(Some(1))),
        Just(What::Idle(None)),
        (0_u64..1_000).prop_map(|now_ns| What::Expired {
            timer: 1,
            function: 2,
            now_ns,
        }),
    ]
}

proptest! {
    /// However the events lie, also where they contradict each other.
    #[test]
    fn the_pieces_of_a_way_cover_its_time_once(
        events in prop::collection::vec(
            (0_u64..1_000, 0_usize..2, prop::sample::select(vec![0, SERVICE, SENDER]), any::<bool>(), any_what()),
            0..60,
        ),
        from in 0_u64..500,
        took in 1_u64..500,
    ) {
        let mut events: Vec<Event> = events
            .into_iter()
            .map(|(at_ns, core, thread, in_interrupt, what)| Event { at_ns, core, thread, in_interrupt, what })
            .collect();
        events.sort_by_key(|event| event.at_ns);
        let line = line(events);
        let way = Window::new(&line, 0, 1_100).way(SERVICE, from, from + took);
        let mut at = from;
        for piece in &way {
            prop_assert_eq!(piece.from_ns, at, "{:?}", &way);
            prop_assert!(piece.to_ns > piece.from_ns);
            at = piece.to_ns;
        }
        prop_assert_eq!(at, from + took);
    }
}
