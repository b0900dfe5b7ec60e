//! A robot played by its samples, with a peer played by its lines.

use core::time::Duration;

use lager_battery::Pack;
use lager_comm::{Conversation, Effect, LinkLost};
use lager_lines::conversation::RobotLine;
use lager_lines::extension::{Hello, Report, Spelled};
use lager_lines::gag::Query;
use lager_lines::splitter::LineError;
use lager_lines::{Name, to_line};
use lager_operator::Act;
use lager_orders::{Action, Mode, Moment, Reason};
use lager_topics::{
    Ask, Event, Health, Input, InputKind, NavigatorStatus, Order, OrderQueue, Origin, Phase,
    SteeringReport, WarehouseMap, WorldAsk,
};

/// The conversation and what it has done, as a reader sees it.
pub(crate) struct Robot {
    pub(crate) conversation: Conversation,
    pub(crate) now: Moment,
    pub(crate) health: Health,
    /// When logic's last status was published.
    pub(crate) status_ns: u64,
    pub(crate) map: Option<Box<WarehouseMap>>,
    pub(crate) ordered: Option<Order>,
    /// The last steering order that was given or renewed: its id and code.
    pub(crate) steered: Option<(u32, u8)>,
    /// When it was given, in ns.
    pub(crate) given_ns: u64,
    /// Why it has said its last thought, where it has said that.
    pub(crate) because: Option<Reason>,
    /// What was pressed last.
    pub(crate) pressed: Option<Input>,
    /// What was asked last, with the number of the answer.
    pub(crate) asked: Option<(u32, Ask)>,
    pub(crate) asked_world: Option<(u32, WorldAsk)>,
    /// The clock of its last sign, which a station repeats, and how many there were.
    pub(crate) signed_ms: Option<u64>,
    pub(crate) signs: usize,
    /// The reports that show how things are, since the last look.
    pub(crate) shown: Vec<String>,
    /// What the steering board reports again and again while it is driven from here; `None` is a
    /// board that has fallen silent.
    pub(crate) board: Option<SteeringReport>,
}

impl Robot {
    /// A robot whose bridge has told this mode. In manual mode it has been told some warehouse.
    pub(crate) fn new(mode: Mode) -> Self {
        let kept = (mode == Mode::Manual).then(WarehouseMap::default);
        Self::with_map(mode, kept)
    }

    pub(crate) fn with_map(mode: Mode, kept: Option<WarehouseMap>) -> Self {
        Self::that(mode, kept, LinkLost::GoOn)
    }

    pub(crate) fn that(mode: Mode, kept: Option<WarehouseMap>, link_lost: LinkLost) -> Self {
        let name = Name::new("r1").expect("a name");
        let mut robot = Self {
            conversation: Conversation::new(name, kept, link_lost).on(Pack {
                cells: 3,
                low_decivolts: 100,
            }),
            now: Moment {
                robot: Duration::from_secs(1),
                ns: 1_000_000_000,
            },
            health: Health::default(),
            status_ns: 0,
            map: None,
            ordered: None,
            steered: None,
            given_ns: 0,
            pressed: None,
            because: None,
            asked: None,
            asked_world: None,
            signed_ms: None,
            signs: 0,
            shown: Vec::new(),
            board: Some(SteeringReport {
                age_ms: 0,
                ..SteeringReport::default()
            }),
        };
        robot.conversation.turn(robot.now);
        robot.mode(mode);
        robot
    }

    /// One that is connected to a peer that knows the document's language alone.
    pub(crate) fn connected(mode: Mode) -> Self {
        let mut robot = Self::new(mode);
        let said = robot.connect();
        assert_eq!(said[0], "lager 1 r1");
        robot
    }

    /// Connects. What it asks is not answered at once.
    pub(crate) fn connect(&mut self) -> Vec<String> {
        self.conversation.connected(self.now);
        let mut said = self.pass(1);
        said.extend(self.pass(1));
        said
    }

    pub(crate) fn disconnect(&mut self) -> Vec<String> {
        self.conversation.disconnected(self.now);
        self.done()
    }

    /// The station answers the last sign, as one of ours does.
    pub(crate) fn is_answered(&mut self) -> Vec<String> {
        let echo = format!("lager 1 station {}", self.signed_ms.expect("a sign"));
        self.hears(&[&echo])
    }

    /// What has been done since the last look: lines as they are but for signs, other effects in
    /// brackets.
    pub(crate) fn done(&mut self) -> Vec<String> {
        let mut done = Vec::new();
        for effect in self.conversation.effects() {
            done.push(match effect {
                Effect::Say(RobotLine::Hello(Hello {
                    clock_ms: Some(clock_ms),
                    ..
                })) => {
                    self.signed_ms = Some(clock_ms);
                    self.signs += 1;
                    continue;
                }
                // Tests read what the page makes of a code.
                Effect::Say(RobotLine::Report(Report::Refused { number, reason })) => {
                    format!("refused {number} {reason}")
                }
                Effect::Say(RobotLine::Report(Report::Because(reason))) => {
                    self.because = Some(reason);
                    continue;
                }
                Effect::Say(line) => to_line(&line).expect("it fits").trim_end().to_owned(),
                Effect::HangUp(_) => "[hangs up]".into(),
                Effect::Map(map) => {
                    let said = format!("[map {}x{}]", map.width, map.height);
                    self.map = Some(map);
                    said
                }
                Effect::Do(Act::Order(order)) => {
                    self.ordered = Some(order);
                    format!("[orders {}]", order.product)
                }
                Effect::Do(Act::Press(input)) => {
                    self.pressed = Some(input);
                    match input.kind.get() {
                        Some(InputKind::PickupDone) => "[picked]".into(),
                        _ => format!("[presses {}]", input.kind),
                    }
                }
                Effect::Show(report) => {
                    let line = to_line(&report).expect("it fits");
                    self.shown.push(line.trim_end().to_owned());
                    continue;
                }
                Effect::Do(Act::Ask { id, ask }) => {
                    self.asked = Some((id, ask));
                    format!("[asks {}]", ask.kind)
                }
                Effect::Do(Act::AskWorld { id, ask }) => {
                    self.asked_world = Some((id, ask));
                    format!("[asks the world {}]", ask.kind)
                }
                Effect::Steer(order) => {
                    assert_eq!(order.origin.get(), Some(Origin::Operator));
                    let renewed = self.steered == Some((order.id, order.code));
                    self.steered = Some((order.id, order.code));
                    self.given_ns = order.given_ns;
                    match renewed {
                        true => format!("[renews {}]", order.code),
                        false => format!("[steers {}]", order.code),
                    }
                }
                Effect::Commission { given_ns, said } => {
                    self.given_ns = given_ns;
                    format!("[{}]", Spelled(&Action::Commission(said)))
                }
                Effect::Stop => "[stops]".into(),
            });
        }
        done
    }

    /// Milliseconds pass, one turn of the loop each 10 ms.
    pub(crate) fn pass(&mut self, milliseconds: u64) -> Vec<String> {
        let mut left = milliseconds;
        while left > 0 {
            let step = left.min(10);
            left -= step;
            self.leap(step);
        }
        self.done()
    }

    /// Milliseconds pass in one turn, as where the process was held up.
    pub(crate) fn leap(&mut self, milliseconds: u64) {
        self.leap_us(milliseconds * 1_000);
    }

    pub(crate) fn leap_us(&mut self, microseconds: u64) {
        self.now.ns += microseconds * 1_000;
        self.now.robot += Duration::from_micros(microseconds);
        self.conversation.turn(self.now);
        if let (Some(_), Some(report), 0) = (self.steered, self.board, self.health.stopped) {
            self.conversation.report(self.now, &report);
        }
        self.conversation.tell(self.now);
    }

    /// Time passes for a robot whose peer answers each question at once; it has `said` this before.
    /// `answers` does so, and gives back what the robot has said then. What was asked, and when in
    /// ns, is given back.
    pub(crate) fn answered_at_once(
        &mut self,
        mut said: Vec<String>,
        milliseconds: u64,
        mut answers: impl FnMut(&mut Self, &str) -> Vec<String>,
    ) -> Vec<(String, u64)> {
        let questions = Query::ALL.map(Query::as_str);
        let mut asked = Vec::new();
        let end = self.now.ns + milliseconds * 1_000_000;
        loop {
            while let Some(line) = said.pop() {
                if questions.contains(&line.as_str()) {
                    asked.push((line.clone(), self.now.ns));
                    assert!(asked.len() < 1_000_000, "it asks without end");
                    said.extend(answers(self, &line));
                }
            }
            if self.now.ns >= end {
                return asked;
            }
            // As its shell: when it wants to be looked after, and every 10 ms.
            let due = self.conversation.due_ns().unwrap_or(u64::MAX);
            let wait = due.saturating_sub(self.now.ns).clamp(1_000, 10_000_000);
            self.leap_us(wait.div_ceil(1_000));
            said = self.done();
        }
    }

    /// The peer says lines, which arrive together.
    pub(crate) fn hears(&mut self, lines: &[&str]) -> Vec<String> {
        let lines: Vec<_> = lines.iter().map(|line| Ok((*line).to_owned())).collect();
        self.conversation.heard(self.now, &lines);
        self.done()
    }

    pub(crate) fn hears_noise(&mut self, error: LineError) -> Vec<String> {
        self.conversation.heard(self.now, &[Err(error)]);
        self.done()
    }

    pub(crate) fn mode(&mut self, mode: Mode) -> Vec<String> {
        self.health.mode = mode.into();
        self.told()
    }

    /// The bridge tells its health.
    pub(crate) fn told(&mut self) -> Vec<String> {
        self.conversation.health(self.now, &self.health);
        self.done()
    }

    pub(crate) fn reports(&mut self, report: &SteeringReport) -> Vec<String> {
        self.conversation.report(self.now, report);
        self.board = self.board.map(|_| SteeringReport {
            age_ms: 0,
            ..*report
        });
        self.done()
    }

    /// Logic tells what it does: its phase, and the product under way.
    pub(crate) fn does(&mut self, phase: Phase, under_way: Option<Order>) -> Vec<String> {
        let order = under_way.unwrap_or_default();
        let queue = OrderQueue {
            order_id: order.id,
            product: order.product,
            under_way: under_way.is_some().into(),
            ..OrderQueue::default()
        };
        let status = NavigatorStatus {
            order_id: order.id,
            product: order.product,
            phase: phase.into(),
            ..NavigatorStatus::default()
        };
        self.conversation.queue(self.now, &queue);
        self.status(&status);
        let mut done = self.done();
        done.retain(|line| !line.starts_with("set_heading"));
        done
    }

    /// Logic tells its status, published at this moment.
    pub(crate) fn status(&mut self, status: &NavigatorStatus) {
        self.status_ns = self.now.ns;
        self.conversation.status(self.now, status, self.status_ns);
    }

    /// Logic tells its queue.
    pub(crate) fn queue(&mut self, queue: &OrderQueue) -> Vec<String> {
        self.conversation.queue(self.now, queue);
        self.done()
    }

    /// Something happens, and logic's last status follows from it.
    pub(crate) fn event(&mut self, event: &Event) -> Vec<String> {
        self.conversation.event(self.now, event, self.status_ns);
        self.done()
    }

    /// Something happens now, and no status has followed from it yet.
    pub(crate) fn event_before_its_status(&mut self, event: &Event) -> Vec<String> {
        self.conversation.event(self.now, event, self.now.ns);
        self.done()
    }
}
