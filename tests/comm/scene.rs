//! The scene of these tests: a robot in manual mode, whose external computer the test plays.

use std::fs;
use std::io::{BufRead, BufReader, ErrorKind, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::time::{Duration, Instant};

use lager_ports::Subscriber;
use lager_rig::behind_ports;
use lager_tests::{Domain, Running, wait_for};
use lager_topics::{LinkHealth, TruthPose};

/// How long a test waits for a line before it fails.
pub(crate) const WATCHDOG: Duration = Duration::from_secs(120);

/// One end of a connection that carries lines.
pub(crate) struct Peer<S>(pub(crate) BufReader<S>);

impl<S: Read + Write> Peer<S> {
    /// The next line without its end; `None` when the connection has ended.
    pub(crate) fn hears(&mut self) -> Option<String> {
        let mut line = String::new();
        match self.0.read_line(&mut line) {
            Ok(0) => None,
            Ok(_) => Some(line.trim_end().to_owned()),
            Err(error) if error.kind() == ErrorKind::ConnectionReset => None,
            Err(error) => panic!("no line came: {error}"),
        }
    }

    /// The next line that begins with one of `words`; skips lines that need no answer.
    pub(crate) fn waits_for(&mut self, words: &[&str]) -> String {
        loop {
            let line = self.hears().expect("the conversation goes on");
            let first = line.split(' ').next().unwrap_or_default();
            if words.contains(&first) {
                return line;
            }
            assert!(
                ["thought", "set_robot", "set_heading", "lager"].contains(&first),
                "{line:?} instead of {words:?}"
            );
        }
    }

    /// Sends a line; the peer may have gone meanwhile.
    pub(crate) fn says(&mut self, line: &str) {
        let _ = self.0.get_mut().write_all(format!("{line}\n").as_bytes());
    }
}

impl Peer<TcpStream> {
    /// The next line that begins with one of `words`; `None` if the connection ends before. Answers
    /// the sign of life.
    pub(crate) fn hears_answering(&mut self, words: &[&str]) -> Option<String> {
        loop {
            let line = self.hears()?;
            if words.iter().any(|word| line.starts_with(word)) {
                return Some(line);
            }
            if let Some(answer) = answer_to_sign(&line) {
                self.says(&answer);
            }
        }
    }
}

/// A station's answer to a sign of life of r1, if `line` is one: it repeats the robot's clock.
pub(crate) fn answer_to_sign(line: &str) -> Option<String> {
    let clock = line.strip_prefix("lager 1 r1")?;
    Some(format!("lager 1 tester{clock}"))
}

/// A robot that stands in manual mode, and the external computer that the test plays for it.
pub(crate) struct Scene {
    /// `None` if another process plays the external computer.
    listener: Option<TcpListener>,
    truth: Subscriber<TruthPose>,
    pub(crate) up: Running,
    _body: Running,
    pub(crate) domain: Domain,
}

impl Scene {
    pub(crate) fn new() -> Self {
        Self::with(TcpListener::bind("127.0.0.1:0").expect("a port"))
    }

    /// A scene whose robot connects to this listener.
    pub(crate) fn with(listener: TcpListener) -> Self {
        let address = listener.local_addr().expect("an address").to_string();
        Self {
            listener: Some(listener),
            ..Self::at(Domain::among_others(), &address)
        }
    }

    /// A scene whose external computer is another process, at `address`.
    pub(crate) fn at(domain: Domain, address: &str) -> Self {
        // `up` takes these for real boards, so it starts in manual mode and no script drives.
        let [sensor, steering] =
            ["sensor.tty", "steering.tty"].map(|name| domain.folder().join(name));
        let config = domain.folder().join("lager.toml");
        let text = behind_ports(&sensor, &steering).expect("a description");
        fs::write(&config, text).expect("a configuration file");
        let body = domain.start(&["simulator"]);
        let up = domain.start(&["up", "--station", address]);
        let bus = domain.observe("r1", 1.0);
        let mut health = bus.subscriber::<LinkHealth>().expect("a topic");
        wait_for("both boards to be connected, and the robot stopped", || {
            let health = health.latest().expect("readable")?;
            (health.boards_are_ready() && health.stopped != 0).then_some(())
        });
        wait_for("the stop to be released", || {
            domain.run(&["resume"]).status.success().then_some(())
        });
        Self {
            truth: bus.subscriber().expect("a topic"),
            listener: None,
            up,
            _body: body,
            domain,
        }
    }

    /// The listener to which the robot connects, for a station in this process.
    pub(crate) fn listener(&self) -> TcpListener {
        let listener = self.listener.as_ref().expect("it is played here");
        listener.try_clone().expect("a socket")
    }

    /// The robot's next connection.
    pub(crate) fn robot(&self) -> Peer<TcpStream> {
        let (stream, _) = self.listener().accept().expect("it connects");
        stream.set_read_timeout(Some(WATCHDOG)).expect("a socket");
        stream.set_nodelay(true).expect("a socket");
        Peer(BufReader::new(stream))
    }

    /// The place of the middle of the axle, in mm.
    pub(crate) fn place(&mut self) -> (f64, f64) {
        wait_for("the truth", || {
            let truth = self.truth.latest().expect("readable")?;
            Some((truth.x_mm, truth.y_mm))
        })
    }

    /// The newest duties of the motors in the simulated world.
    pub(crate) fn duties(&mut self) -> Option<(u8, u8)> {
        let truth = self.truth.latest().expect("readable")?;
        Some((truth.left_duty, truth.right_duty))
    }

    /// Asserts that the robot does not move for this time.
    pub(crate) fn assert_it_stays(&mut self, time: Duration) {
        let start = Instant::now();
        while start.elapsed() < time {
            while let Some(truth) = self.truth.receive().expect("readable") {
                let duties = (truth.left_duty, truth.right_duty);
                assert_eq!(duties, (0, 0), "after {:?}", start.elapsed());
            }
            std::thread::sleep(Duration::from_millis(2));
        }
    }

    pub(crate) fn wait_until_it_stands(&mut self) {
        wait_for("the robot to stand", || {
            self.duties().filter(|duties| *duties == (0, 0))
        });
    }

    /// Drives the robot forward until its wheels turn. If the machine is held up for as long as a
    /// lease, the command ends, so this gives the command each time that the robot asks.
    pub(crate) fn drive(&mut self, is_extended: bool) -> Peer<TcpStream> {
        'connected: loop {
            let mut robot = self.robot();
            loop {
                let Some(line) = robot.hears() else {
                    continue 'connected;
                };
                match answer_to_sign(&line).filter(|_| is_extended) {
                    Some(answer) => robot.says(&answer),
                    None if line == "styrcomm" => robot.says("styrcomm 2"),
                    None => {}
                }
                if self
                    .duties()
                    .is_some_and(|(left, right)| left > 0 && right > 0)
                {
                    return robot;
                }
                if !is_extended && line == "styrcomm" {
                    // The robot sends nothing more before the next command.
                    while !self.moves_within(Duration::from_millis(500)) {
                        robot.says("styrcomm 2");
                    }
                    return robot;
                }
            }
        }
    }

    fn moves_within(&mut self, patience: Duration) -> bool {
        let start = Instant::now();
        while start.elapsed() < patience {
            if self
                .duties()
                .is_some_and(|(left, right)| left > 0 && right > 0)
            {
                return true;
            }
            std::thread::sleep(Duration::from_millis(2));
        }
        false
    }
}
