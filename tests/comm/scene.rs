//! A robot that is up, in manual mode, with an external computer that the test plays.

use std::fs;
use std::io::{BufRead, BufReader, ErrorKind, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::time::{Duration, Instant};

use lager_ports::Subscriber;
use lager_tests::{Domain, Running, wait_for};
use lager_topics::{LinkHealth, TruthPose};

/// How long a line is waited for before the test has failed.
pub(crate) const WATCHDOG: Duration = Duration::from_secs(120);

/// One end of a conversation in lines.
pub(crate) struct Peer<S>(pub(crate) BufReader<S>);

impl<S: Read + Write> Peer<S> {
    /// The next line without its end; `None` where the conversation is over.
    pub(crate) fn hears(&mut self) -> Option<String> {
        let mut line = String::new();
        match self.0.read_line(&mut line) {
            Ok(0) => None,
            Ok(_) => Some(line.trim_end().to_owned()),
            Err(error) if error.kind() == ErrorKind::ConnectionReset => None,
            Err(error) => panic!("no line came: {error}"),
        }
    }

    /// The next line that begins with one of `words`; what it passes over needs no answer.
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

    /// Says a line; a peer that has gone meanwhile is no failure.
    pub(crate) fn says(&mut self, line: &str) {
        let _ = self.0.get_mut().write_all(format!("{line}\n").as_bytes());
    }
}

impl Peer<TcpStream> {
    /// The next line that begins with one of `words`, if the connection lasts so long. The sign of
    /// life is answered.
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

/// What a station answers to the sign of life of r1, if this is one: it repeats the robot's clock.
pub(crate) fn answer_to_sign(line: &str) -> Option<String> {
    let clock = line.strip_prefix("lager 1 r1")?;
    Some(format!("lager 1 tester{clock}"))
}

/// An external computer that the test plays, for a robot that is up and stands in manual mode.
pub(crate) struct Scene {
    /// `None` where another process plays it.
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

    /// One whose robot connects to this listener.
    pub(crate) fn with(listener: TcpListener) -> Self {
        let address = listener.local_addr().expect("an address").to_string();
        Self {
            listener: Some(listener),
            ..Self::at(Domain::among_others(), &address)
        }
    }

    /// One whose external computer is played by another process at `address`.
    pub(crate) fn at(domain: Domain, address: &str) -> Self {
        // Real boards, as far as `up` knows: it starts in manual mode and no script drives.
        let [sensor, steering] =
            ["sensor.tty", "steering.tty"].map(|name| domain.folder().join(name));
        let config = domain.folder().join("lager.toml");
        let text =
            format!("body = \"serial\"\n[serial]\nsensor = {sensor:?}\nsteering = {steering:?}\n");
        fs::write(&config, text).expect("a configuration file");
        let body = domain.start(&["simulator"]);
        let up = domain.start(&["up", "--station", address]);
        let bus = domain.observe("r1", 1.0);
        let mut health = bus.subscriber::<LinkHealth>().expect("a topic");
        wait_for("both boards to be connected, and the robot stopped", || {
            let health = health.latest().expect("readable")?;
            let connected = health.sensor.up != 0 && health.steering.up != 0;
            (connected && health.stopped != 0).then_some(())
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

    /// Where the robot connects, for a station that listens there itself.
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

    /// Where the middle of the axle is, in mm.
    pub(crate) fn place(&mut self) -> (f64, f64) {
        wait_for("the truth", || {
            let truth = self.truth.latest().expect("readable")?;
            Some((truth.x_mm, truth.y_mm))
        })
    }

    /// The duties at the motors, as the world has them now.
    pub(crate) fn duties(&mut self) -> Option<(u8, u8)> {
        let truth = self.truth.latest().expect("readable")?;
        Some((truth.left_duty, truth.right_duty))
    }

    /// Looks for so long whether it moves, which it must not.
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

    /// Drives the robot forward until its wheels turn. A machine that was held up for as long as a
    /// lease ends the command, so it is given as often as it is asked for.
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
                    // It says nothing more before the next command.
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
