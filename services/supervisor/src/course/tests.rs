//! A robot's course in virtual time: what has happened goes in, what is to be done is compared.

use super::*;
use Service::{Attendant, Bridge, Comm, Gateway, Logic, Simulator, Station};

const MS: Duration = Duration::from_millis(1);
const S: Duration = Duration::from_secs(1);

/// A course and its time.
struct Trial {
    course: Course,
    now: Duration,
}

impl Trial {
    /// A simulated robot of which nothing has been started yet.
    fn new(exit_when_done: bool) -> Self {
        let services = Services {
            body: Some(Simulator),
            talkers: vec![Station, Comm],
        };
        Self {
            course: Course::new(services, exit_when_done),
            now: Duration::ZERO,
        }
    }

    /// One that runs for so long.
    fn whole(exit_when_done: bool, since: Duration) -> Self {
        let mut trial = Self::new(exit_when_done);
        trial.course.begin(trial.now);
        trial.take(Event::Swept);
        trial.take(Event::Joined);
        trial.now += since;
        trial
    }

    fn take(&mut self, event: Event) -> Vec<Step> {
        self.course.take(event, self.now)
    }

    /// What is done, without what is said.
    fn done(&mut self, event: Event) -> Vec<Step> {
        let mut steps = self.take(event);
        steps.retain(|step| !matches!(step, Step::Say(_)));
        steps
    }

    /// What is said.
    fn said(&mut self, event: Event) -> String {
        let steps = self.take(event).into_iter();
        let said = steps.filter_map(|step| match step {
            Step::Say(text) | Step::Fail(text) => Some(text),
            _ => None,
        });
        said.collect::<Vec<_>>().join(" | ")
    }
}

fn ended(service: Service, by_itself: bool) -> Ended {
    Ended {
        service,
        how: "exit status: 1".into(),
        by_itself,
        may_try_again: false,
        lost_memory: false,
    }
}

fn silent(service: Service, was_heard: bool) -> Event {
    Event::Silent(Silence {
        service,
        pid: 7,
        was_heard,
    })
}

#[test]
fn a_robot_is_started_in_order_and_what_moves_it_last() {
    let mut trial = Trial::new(false);
    let first = trial.course.begin(trial.now);
    assert_eq!(first, [Step::Attend(Sweep::TheDead)]);
    assert!(!trial.course.is_swept());
    assert_eq!(trial.take(Event::Swept), [Step::Start(Simulator, false)]);
    assert!(trial.course.is_swept() && trial.course.waits_for_clock());
    let all = [Station, Comm, Bridge, Logic].map(|service| Step::Start(service, false));
    assert_eq!(trial.take(Event::Joined), all);
    // It says so five times a second.
    assert_eq!(trial.take(Event::Joined), []);
    assert_eq!(trial.take(Event::Swept), []);
}

#[test]
fn real_boards_have_no_body_and_a_robot_may_talk_to_nobody() {
    let services = Services {
        body: None,
        talkers: vec![Gateway],
    };
    let mut course = Course::new(services, false);
    course.begin(Duration::ZERO);
    assert_eq!(course.take(Event::Swept, MS), []);
    let all = [Gateway, Bridge, Logic].map(|service| Step::Start(service, false));
    assert_eq!(course.take(Event::Joined, MS), all);
}

#[test]
fn a_service_that_dies_is_replaced_once_its_state_is_kept() {
    let mut trial = Trial::whole(false, S);
    let asked = trial.done(Event::Ended(ended(Bridge, false)));
    assert_eq!(asked, [Step::HandOver(Bridge)]);
    assert_eq!(trial.take(Event::Due(Bridge)), [], "nothing is kept yet");
    assert_eq!(trial.take(Event::HandedOver(Logic)), []);
    assert_eq!(trial.take(Event::Due(Bridge)), []);
    trial.take(Event::HandedOver(Bridge));
    assert_eq!(trial.take(Event::Due(Bridge)), [Step::Start(Bridge, true)]);
}

#[test]
fn a_successor_waits_for_an_attendant_that_could_run_and_no_longer() {
    let mut trial = Trial::whole(false, S);
    trial.take(Event::Ended(ended(Logic, false)));
    assert_eq!(trial.course.idle(trial.now, S), HAND_OVER);
    // The machine is busy: real time does not count.
    trial.now += 60 * S;
    trial.course.attended(HAND_OVER - MS);
    assert_eq!(trial.take(Event::Due(Logic)), []);
    assert_eq!(trial.course.idle(trial.now, S), MS);
    trial.course.attended(MS);
    assert_eq!(trial.take(Event::Due(Logic)), [Step::Start(Logic, true)]);
    assert_eq!(trial.course.idle(trial.now, S), S);
}

#[test]
fn without_an_attendant_nothing_is_waited_for() {
    let mut trial = Trial::whole(false, S);
    let lost = trial.done(Event::Ended(ended(Attendant, false)));
    assert_eq!(lost, []);
    trial.take(Event::Ended(ended(Bridge, false)));
    assert_eq!(trial.take(Event::Due(Bridge)), [Step::Start(Bridge, true)]);
    let again = trial.take(Event::Due(Attendant));
    assert_eq!(again, [Step::Attend(Sweep::TheDead)]);
}

#[test]
fn a_service_that_cannot_start_ends_the_first_start_and_no_later_one() {
    let mut trial = Trial::new(false);
    trial.course.begin(trial.now);
    trial.take(Event::Swept);
    let refused = ended(Simulator, true);
    let may_later = Ended {
        may_try_again: true,
        ..refused.clone()
    };
    let killed = ended(Simulator, false);
    for harmless in [may_later, killed] {
        let done = trial.done(Event::Ended(harmless));
        assert_eq!(done, [Step::HandOver(Simulator)]);
    }
    let done = trial.done(Event::Ended(refused.clone()));
    let why = "the simulated robot (simulator) cannot start (exit status: 1)";
    assert_eq!(done, [Step::Fail(why.into())]);
    let done = Trial::whole(false, S).done(Event::Ended(refused));
    assert_eq!(done, [Step::HandOver(Simulator)]);
}

#[test]
fn who_hangs_is_killed_and_who_was_never_heard_has_met_a_damaged_bus() {
    let mut trial = Trial::whole(false, S);
    let done = trial.done(silent(Bridge, true));
    assert_eq!(done, [Step::Kill(Bridge)]);
    let said = trial.said(silent(Comm, false));
    assert!(said.contains("(comm) does not answer"), "{said}");
    let steps = trial.take(silent(Logic, false));
    assert_eq!(steps[0], Step::Kill(Logic));
    assert!(trial.course.rests(), "{steps:?}");
}

#[test]
fn lost_memory_is_damage_and_everything_is_ended_and_started_again() {
    let mut trial = Trial::whole(false, S);
    let lost = Ended {
        lost_memory: true,
        ..ended(Logic, false)
    };
    let steps = trial.take(Event::Ended(lost));
    let said = "the bus is damaged: memory of the logic was gone (exit status: 1); starting everything again (1 of 3)";
    assert_eq!(steps[2], Step::Say(said.into()));
    let why = "memory of the logic was gone (exit status: 1)";
    assert_eq!(steps[3], Step::StopAll(Some(why.into())), "{steps:?}");
    // What the dead say does not matter.
    for late in [Event::Joined, Event::Swept, Event::Due(Bridge)] {
        assert_eq!(trial.take(late), []);
    }
    assert_eq!(trial.course.look(trial.now), [Step::Restore]);
    let begun = trial.take(Event::Restored);
    assert_eq!(begun, [Step::Attend(Sweep::Everything)]);
    assert_eq!(trial.take(Event::Swept), [Step::Start(Simulator, false)]);
    let all = [Station, Comm, Bridge, Logic].map(|service| Step::Start(service, true));
    assert_eq!(trial.take(Event::Joined), all, "they have run before");
}

#[test]
fn damage_before_anything_ran_costs_no_mission() {
    let mut trial = Trial::new(false);
    trial.course.begin(trial.now);
    let steps = trial.done(Event::AttendantSilent);
    assert_eq!(steps, [Step::Kill(Attendant), Step::StopAll(None)]);
    trial.take(Event::Restored);
    trial.take(Event::Swept);
    let all = [Station, Comm, Bridge, Logic].map(|service| Step::Start(service, false));
    assert_eq!(trial.take(Event::Joined), all);
}

#[test]
fn an_attendant_that_has_joined_and_hangs_is_replaced_alone() {
    let mut trial = Trial::whole(false, S);
    let steps = trial.done(Event::AttendantSilent);
    assert_eq!(steps, [Step::Kill(Attendant)]);
    assert!(!trial.course.rests());
}

#[test]
fn an_attendant_that_cannot_join_is_tried_five_times_where_others_may_be_in_its_way() {
    let mut trial = Trial::whole(false, S);
    let busy = Ended {
        may_try_again: true,
        ..ended(Attendant, true)
    };
    trial.take(Event::Ended(ended(Attendant, false)));
    for _ in 1..MOST_REFUSALS {
        trial.take(Event::Due(Attendant));
        trial.take(Event::Ended(busy.clone()));
        assert!(!trial.course.rests());
    }
    trial.take(Event::Due(Attendant));
    let said = trial.said(Event::Ended(busy));
    assert!(said.contains("the attendant cannot join it"), "{said}");
    assert!(trial.course.rests());

    let mut trial = Trial::whole(false, S);
    trial.take(Event::Ended(ended(Attendant, false)));
    trial.take(Event::Due(Attendant));
    trial.take(Event::Ended(ended(Attendant, true)));
    assert!(trial.course.rests(), "one refusal without hope is enough");
}

#[test]
fn a_body_without_a_clock_is_given_up_once_it_could_have_run_for_long_enough() {
    let mut trial = Trial::new(false);
    trial.course.begin(trial.now);
    trial.take(Event::Swept);
    trial.now += 600 * S;
    assert_eq!(trial.take(Event::NoClock(Some(BODY_START))), []);
    let said = trial.said(Event::NoClock(Some(BODY_START + MS)));
    assert!(said.contains("no clock of the body"), "{said}");

    let mut trial = Trial::new(false);
    trial.course.begin(trial.now);
    trial.take(Event::Swept);
    trial.now += BODY_START;
    assert_eq!(trial.take(Event::NoClock(None)), []);
    trial.now += MS;
    trial.take(Event::NoClock(None));
    assert!(trial.course.rests(), "there is not even a process");
}

#[test]
fn pauses_grow_and_a_robot_that_nobody_waits_for_never_gives_up() {
    let mut trial = Trial::whole(false, S);
    let mut pauses = Vec::new();
    let mut said = Vec::new();
    for _ in 0..6 {
        said.push(trial.said(Event::Damaged("it is full".into())));
        pauses.push(trial.course.idle(trial.now, 60 * S));
        assert_eq!(
            trial.course.look(trial.now + pauses[0]).is_empty(),
            pauses.len() > 1
        );
        trial.now += *pauses.last().unwrap();
        assert_eq!(trial.course.look(trial.now), [Step::Restore]);
        // What it needs is not there either: that is damage again, or a new start.
        trial.take(Event::Restored);
        trial.take(Event::Swept);
        trial.take(Event::Joined);
    }
    assert_eq!(pauses, [0, 1, 4, 15, 15, 15].map(|seconds| seconds * S));
    assert!(said[3].contains("every 15 s from now on"), "{said:?}");
    assert_eq!(said[4], "", "it is not said again");
    let restore_fails = trial.done(Event::Damaged("no folder".into()));
    assert_eq!(restore_fails, [Step::StopAll(Some("no folder".into()))]);
    let steps = trial.done(Event::Damaged("still none".into()));
    assert_eq!(steps, [Step::StopAll(Some("still none".into()))]);
}

#[test]
fn a_mission_that_is_waited_for_is_given_up_on_a_bus_that_does_not_hold() {
    let mut trial = Trial::whole(true, S);
    for _ in 0..MOST {
        let steps = trial.done(Event::Damaged("it is full".into()));
        assert_eq!(steps, [Step::StopAll(Some("it is full".into()))]);
    }
    let steps = trial.take(Event::Damaged("it is full".into()));
    assert_eq!(steps[0], Step::Clear);
    let [_, Step::Fail(why)] = &steps[..] else {
        panic!("{steps:?}");
    };
    assert!(why.contains("the bus does not hold: it is full"), "{why}");
}

#[test]
fn a_robot_that_held_begins_to_count_anew() {
    let mut trial = Trial::whole(true, S);
    for _ in 0..3 * MOST {
        let said = trial.said(Event::Damaged("it is full".into()));
        assert!(said.contains("(1 of 3)"), "{said}");
        trial.take(Event::Restored);
        trial.take(Event::Swept);
        trial.take(Event::Joined);
        trial.now += 60 * S;
    }
}

#[test]
fn in_another_world_everything_starts_at_once_and_as_for_the_first_time() {
    let mut trial = Trial::whole(false, 5 * S);
    assert_eq!(trial.take(Event::Renewed), [Step::StopAll(None)]);
    // Two people have asked at once.
    assert_eq!(trial.take(Event::Renewed), [Step::StopAll(None)]);
    assert_eq!(trial.course.look(trial.now), [Step::Restore]);
    let everything = Step::Attend(Sweep::Everything);
    assert_eq!(trial.done(Event::Restored), [everything]);
    assert_eq!(trial.done(Event::Swept), [Step::Start(Simulator, false)]);
    let afresh = [Station, Comm, Bridge, Logic].map(|service| Step::Start(service, false));
    assert_eq!(trial.done(Event::Joined), afresh);
}
