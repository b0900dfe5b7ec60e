//! The figures as Prometheus text, version 0.0.4.
//!
//! Every figure has its `HELP` and `TYPE`, even if its value is not known yet; an unknown value has
//! no line. Units are base units and stand in the names. A moment is a Unix time. Prometheus makes
//! an age of it (`time() - ...`) that also grows while the robot is silent.

use std::fmt::{Display, Write};

use lager_orders::Mode;
use lager_sample::Coded;
use lager_stop::Stop;
use lager_topics::{BoardHealth, Durations, Hold, Phase, StopCause};

use crate::figures::Figures;

/// The media type of the text.
pub(crate) const MEDIA_TYPE: &str = "text/plain; version=0.0.4; charset=utf-8";

/// All figures. `stop` comes from the stop word; `None` if it cannot be read, as of a robot elsewhere.
/// Then the bridge's last word counts.
pub(crate) fn text(figures: &Figures, stop: Option<Option<Stop>>) -> String {
    let mut text = Text {
        out: String::with_capacity(32 << 10),
        robot: figures.robot.clone(),
        unix_offset_ns: figures.unix_offset_ns,
    };
    let mut build = text.gauge("lager_build_info", "1, with the version of the gateway.");
    build.add(&[("version", env!("CARGO_PKG_VERSION"))], 1);
    topics(&mut text, figures);
    latency(&mut text, figures);
    robot(&mut text, figures, stop);
    mission(&mut text, figures);
    links(&mut text, figures);
    processes(&mut text, figures);
    text.out
}

fn topics(text: &mut Text, figures: &Figures) {
    let topics = || figures.topics.iter();
    let mut received = text.counter(
        "lager_topic_samples_total",
        "Samples of the topic that have reached the gateway.",
    );
    for (name, topic) in topics() {
        received.add(&[("topic", name)], topic.received);
    }
    let mut lost = text.counter(
        "lager_topic_lost_samples_total",
        "Samples of the topic that were overwritten before the gateway looked, by their numbers.",
    );
    for (name, topic) in topics() {
        lost.add(&[("topic", name)], topic.lost);
    }
    let mut published = text.gauge(
        "lager_topic_last_publish_timestamp_seconds",
        "When the last sample of the topic was published, as Unix time.",
    );
    for (name, topic) in topics().filter(|(_, topic)| topic.published_ns > 0) {
        published.moment(&[("topic", name)], topic.published_ns);
    }
    let mut writers = text.gauge("lager_topic_writers", "Publishers of the topic.");
    for (name, topic) in topics() {
        writers.add(&[("topic", name)], topic.writers);
    }
    let mut readers = text.gauge(
        "lager_topic_readers",
        "Subscribers of the topic, the gateway included.",
    );
    for (name, topic) in topics() {
        readers.add(&[("topic", name)], topic.readers);
    }
}

fn latency(text: &mut Text, figures: &Figures) {
    let path = figures.path.as_deref();
    let path = path.map(|path| {
        [
            ("read_publish", &path.read_publish),
            ("publish_receive", &path.publish_receive),
            ("decide", &path.decide),
            ("total", &path.total),
        ]
    });
    text.stages(
        [
            "lager_path_seconds",
            "lager_path_p999_seconds",
            "lager_path_max_seconds",
        ],
        "From a sensor frame's bytes to logic's decision, by stage: read_publish, \
         publish_receive, decide, and total, which is all of it.",
        path.as_ref().map_or(&[], |stages| stages.as_slice()),
    );
    let command = figures.command.as_deref();
    let command = command.map(|command| {
        [
            ("order_receive", &command.order_receive),
            ("receive_write", &command.receive_write),
            ("total", &command.total),
        ]
    });
    text.stages(
        [
            "lager_command_seconds",
            "lager_command_p999_seconds",
            "lager_command_max_seconds",
        ],
        "Logic's orders on their way to the steering board, by stage: order_receive, \
         receive_write, and total, which begins with the sensor frame's bytes.",
        command.as_ref().map_or(&[], |stages| stages.as_slice()),
    );
}

fn robot(text: &mut Text, figures: &Figures, stop: Option<Option<Stop>>) {
    let health = figures.health.as_ref();
    let mut mode = text.gauge("lager_mode", "Who may drive: 1 at the mode that holds.");
    mode.states::<Mode>("mode", health.map(|health| health.mode.get()));
    let mut latch = text.gauge(
        "lager_stop_latched",
        "Whether the robot is stopped: 1 at the cause of the stop that is latched.",
    );
    let told = health.map(|health| match health.stopped {
        0 => StopCause::None,
        _ => health.stop_cause.get().unwrap_or(StopCause::None),
    });
    let cause = stop.map_or(told, |stop| Some(stop.map_or(StopCause::None, Stop::cause)));
    if let Some(cause) = cause {
        for (known, name) in StopCause::VARIANTS {
            if *known != StopCause::None {
                latch.add(&[("cause", &snake(name))], u8::from(*known == cause));
            }
        }
    }
    let mut set = text.gauge(
        "lager_stop_timestamp_seconds",
        "When the stop that is latched was set, as Unix time; nothing while none is.",
    );
    if let Some(Some(stop)) = stop {
        set.moment(&[], stop.at_ns());
    }
    let report = figures.report.as_ref();
    let mut battery = text.gauge("lager_battery_volts", "Voltage of the robot's battery.");
    if let Some(report) = report.filter(|report| report.battery_decivolts > 0) {
        battery.add(&[], f64::from(report.battery_decivolts) / 10.0);
    }
    let mut duty = text.gauge(
        "lager_motor_duty_ratio",
        "Duty of the motor, from 0 to 1, as the steering board reports it.",
    );
    if let Some(report) = report {
        for (motor, value) in [("left", report.left_duty), ("right", report.right_duty)] {
            duty.add(&[("motor", motor)], f64::from(value) / 255.0);
        }
    }
    let mut refused = text.counter(
        "lager_steering_orders_refused_total",
        "Orders that the arbiter has refused.",
    );
    refused.known(&[], health.map(|health| health.orders_refused));
    let mut expired = text.counter(
        "lager_steering_leases_expired_total",
        "Orders that ended because nobody renewed them.",
    );
    expired.known(&[], health.map(|health| health.leases_expired));
    let mut missed = text.counter(
        "lager_service_lost_samples_total",
        "Samples that bridge and logic themselves have missed.",
    );
    missed.known(&[("role", "bridge")], health.map(|health| health.bus_lost));
    let lost = figures.status.as_ref().map(|status| status.frames_lost);
    missed.known(&[("role", "logic")], lost);
}

fn mission(text: &mut Text, figures: &Figures) {
    let status = figures.status.as_ref();
    let mut phase = text.gauge(
        "lager_navigator_phase",
        "What the navigator does: 1 at the phase that holds.",
    );
    phase.states::<Phase>("phase", status.map(|status| status.phase.get()));
    let mut hold = text.gauge(
        "lager_navigator_hold",
        "Why the navigator stands although its phase would turn the wheels: 1 at the reason.",
    );
    hold.states::<Hold>("hold", status.map(|status| status.hold.get()));
    let mut waiting = text.gauge(
        "lager_mission_orders_waiting",
        "Orders that wait for their turn.",
    );
    waiting.known(&[], status.map(|status| status.waiting));
    let mut delivered = text.counter(
        "lager_mission_delivered_total",
        "Products that were delivered.",
    );
    delivered.known(&[], status.map(|status| status.delivered));
}

fn links(text: &mut Text, figures: &Figures) {
    let boards: Vec<(&str, BoardHealth)> = figures.health.as_ref().map_or(Vec::new(), |health| {
        vec![("sensor", health.sensor), ("steering", health.steering)]
    });
    let mut up = text.gauge(
        "lager_link_up",
        "Whether the handshake with the board is done and packets come.",
    );
    for (board, health) in &boards {
        up.add(&[("board", board)], health.up);
    }
    let mut heard = text.gauge(
        "lager_link_last_packet_timestamp_seconds",
        "When the board was heard last, as Unix time.",
    );
    for (board, at) in ["sensor", "steering"].into_iter().zip(figures.heard_ns) {
        if let Some(at) = at {
            heard.moment(&[("board", board)], at);
        }
    }
    type Of = fn(&BoardHealth) -> u32;
    let counters: [(&str, &str, Of); 5] = [
        (
            "lager_link_packets_total",
            "Good packets of the board; from 0 again with each handshake.",
            |board| board.packets,
        ),
        (
            "lager_link_lost_packets_total",
            "Packets of the board that are missing by their ids, at least.",
            |board| board.lost_total,
        ),
        (
            "lager_link_crc_errors_total",
            "Packets of the board that were refused by their CRC.",
            |board| board.bad_crc,
        ),
        (
            "lager_link_skipped_bytes_total",
            "Bytes passed over while a packet was looked for.",
            |board| board.skipped_bytes,
        ),
        (
            "lager_board_reboots_total",
            "How often the board has restarted.",
            |board| board.reboots,
        ),
    ];
    for (name, help, of) in counters {
        let mut counter = text.counter(name, help);
        for (board, health) in &boards {
            counter.add(&[("board", board)], of(health));
        }
    }
    let mut fits = text.gauge(
        "lager_board_image_fits",
        "Whether the board's image, of this build, is the one of this program; if not, `lager board \
         update` helps. An original board has build 0 and is none of ours, so it fits.",
    );
    let known = |(_, health): &&(_, BoardHealth)| health.version != BoardHealth::UNKNOWN;
    for (board, health) in boards.iter().filter(known) {
        let build = health.build.to_string();
        let is_fit = u8::from(health.misfit().is_none());
        fits.add(&[("board", board), ("build", &build)], is_fit);
    }
    let mut load = text.gauge(
        "lager_board_load_ratio",
        "Processor load of the board, from 0 to 1.",
    );
    for (board, health) in &boards {
        load.add(
            &[("board", board)],
            f64::from(health.board_load_percent) / 100.0,
        );
    }
}

fn processes(text: &mut Text, figures: &Figures) {
    let mut cpu = text.counter(
        "lager_process_cpu_seconds_total",
        "Time of a core that the process has taken.",
    );
    for process in &figures.processes {
        let pid = process.pid.to_string();
        let labels = [("role", process.role.as_str()), ("pid", &pid)];
        cpu.add(&labels, process.cpu_seconds);
    }
    let mut memory = text.gauge(
        "lager_process_resident_bytes",
        "Memory that the process has in use.",
    );
    for process in &figures.processes {
        let pid = process.pid.to_string();
        let labels = [("role", process.role.as_str()), ("pid", &pid)];
        memory.add(&labels, process.resident_bytes);
    }
}

/// The text so far.
struct Text {
    out: String,
    robot: String,
    unix_offset_ns: i64,
}

impl Text {
    fn gauge(&mut self, name: &'static str, help: &str) -> Family<'_> {
        self.family(name, "gauge", help)
    }

    fn counter(&mut self, name: &'static str, help: &str) -> Family<'_> {
        self.family(name, "counter", help)
    }

    /// The stages of a way: their histograms, which Prometheus reads by the minute, and the far end
    /// of all that was counted since the service started, from its finer buckets.
    fn stages(
        &mut self,
        [histogram, p999, max]: [&'static str; 3],
        help: &str,
        stages: &[(&str, &Durations)],
    ) {
        let mut family = self.family(histogram, "histogram", help);
        for (stage, durations) in stages {
            family.histogram(stage, durations);
        }
        let seconds = |ns: u64| ns as f64 / 1e9;
        let mut tail = self.gauge(
            p999,
            "What 99.9 % of them did not exceed since the service started; nothing while fewer than \
             ten lie beyond it.",
        );
        for (stage, durations) in stages {
            tail.known(&[("stage", stage)], durations.tail_ns(0.999).map(seconds));
        }
        let mut longest = self.gauge(max, "The longest of them since the service started.");
        for (stage, durations) in stages.iter().filter(|(_, durations)| durations.count > 0) {
            longest.add(&[("stage", stage)], seconds(durations.max_ns));
        }
    }

    fn family(&mut self, name: &'static str, kind: &str, help: &str) -> Family<'_> {
        let _ = writeln!(self.out, "# HELP {name} {help}\n# TYPE {name} {kind}");
        Family { text: self, name }
    }
}

/// One figure, to which values are added.
struct Family<'a> {
    text: &'a mut Text,
    name: &'static str,
}

impl Family<'_> {
    fn add(&mut self, labels: &[(&str, &str)], value: impl Display) {
        self.line("", labels, value);
    }

    fn known(&mut self, labels: &[(&str, &str)], value: Option<impl Display>) {
        if let Some(value) = value {
            self.add(labels, value);
        }
    }

    /// A time of CLOCK_MONOTONIC, in ns.
    fn moment(&mut self, labels: &[(&str, &str)], monotonic_ns: u64) {
        let unix = monotonic_ns.saturating_add_signed(self.text.unix_offset_ns);
        let (seconds, ns) = (unix / 1_000_000_000, unix % 1_000_000_000);
        self.add(labels, format_args!("{seconds}.{ns:09}"));
    }

    /// A line for each variant: 1 for the present one. An unknown state has no lines, and neither
    /// has a byte that means no variant.
    fn states<E: Coded>(&mut self, label: &str, state: Option<Option<E>>) {
        let Some(state) = state else {
            return;
        };
        for (variant, name) in E::VARIANTS {
            self.add(&[(label, &snake(name))], u8::from(state == Some(*variant)));
        }
    }

    /// Four buckets of the topic are one bucket here, for each doubling.
    fn histogram(&mut self, stage: &str, durations: &Durations) {
        let mut count = 0;
        for (bucket, more) in durations.buckets.iter().enumerate() {
            count += more;
            let end = Durations::upper_ns(bucket).filter(|end| end.is_power_of_two());
            if let Some(end) = end {
                let end = (end as f64 / 1e9).to_string();
                self.line("_bucket", &[("stage", stage), ("le", &end)], count);
            }
        }
        self.line("_bucket", &[("stage", stage), ("le", "+Inf")], count);
        self.line("_sum", &[("stage", stage)], durations.sum_ns as f64 / 1e9);
        self.line("_count", &[("stage", stage)], count);
    }

    fn line(&mut self, suffix: &str, labels: &[(&str, &str)], value: impl Display) {
        let Text { out, robot, .. } = self.text;
        let _ = write!(out, "{}{suffix}{{robot=\"{}\"", self.name, escaped(robot));
        for (name, text) in labels {
            let _ = write!(out, ",{name}=\"{}\"", escaped(text));
        }
        let _ = writeln!(out, "}} {value}");
    }
}

/// As a label's value is written.
fn escaped(text: &str) -> String {
    let text = text.replace('\\', "\\\\").replace('"', "\\\"");
    text.replace('\n', "\\n")
}

/// Turns `WaitingForMap` into `waiting_for_map`.
fn snake(name: &str) -> String {
    let mut snake = String::new();
    for letter in name.chars() {
        if letter.is_ascii_uppercase() && !snake.is_empty() {
            snake.push('_');
        }
        snake.push(letter.to_ascii_lowercase());
    }
    snake
}

#[cfg(test)]
mod tests;
