//! What a robot and a station of this project say to each other besides the document's
//! [`conversation`](crate::conversation).
//!
//! # Who speaks it
//!
//! The robot's first line is `lager 1 <name>`, with the highest version that it speaks and its
//! name. It does not wait for an answer but goes on with `sidelength`. A station that speaks the
//! extension answers `lager 1 <name>`, and from then on both use the lower of the two versions. To
//! any other peer the robot never sends another line of the extension, and it ignores what such a
//! peer answers to the first line.
//!
//! A robot may repeat its first line at any time, and a station answers it each time. So each side
//! knows that the other one is there. A robot repeats it every 50 ms. While it carries out
//! something that the station gave, it stops when the station has said nothing at all for 150 ms.
//!
//! # Nothing moves late
//!
//! When the robot repeats its first line, it adds its clock in ms: `lager 1 r1 81250`. The
//! station's answer repeats that number: `lager 1 station 81250`. Lines arrive in the order in
//! which they were sent. So the station sent every line after that answer later than the robot's
//! clock showed this number, and the line cannot be older, however long a link, a socket or a
//! process held it up. In a `do` the station also says how old the order was already, for example
//! because a page was slow. The robot adds both ages. It refuses an order that moves it or lets it
//! move, also an answer of the document, when they exceed 200 ms. It refuses any other order but a
//! stop when they exceed 2 s.
//!
//! # Proof of the name
//!
//! A station that knows a secret of the robot by that name does not believe the first line. It asks
//! for a proof, and proves itself in turn ([`secret`](crate::secret)). A robot that has a secret
//! says nothing more, and carries out nothing, before it has received that proof:
//!
//! ```text
//! > lager 1 r1
//! < prove <nonce>              16 random bytes of the station, as 32 hexadecimal digits
//! > proof <nonce> <code>       of the robot; HMAC-SHA256, as 64 digits
//! < proved <code>
//! < lager 1 station
//!
//! code of the robot   = HMAC(secret, "lager robot\n"   name "\n" nonces "\n")
//! code of the station = HMAC(secret, "lager station\n" name "\n" nonces "\n")
//! nonces              = the station's "\n" the robot's, both as digits
//! ```
//!
//! When a station gives up a robot that has announced itself, or refuses another one with its name,
//! it says why: `thought <text>`. It may then end the connection.
//!
//! # Order of the lines
//!
//! The document's questions and answers go on between the lines below. Neither side waits for a
//! line before it sends its own. The first word says the kind of a line.
//!
//! # Station to robot
//!
//! ```text
//! thought <text>                       why it refuses somebody; nothing is answered
//! stop [<number>]                      stand at once; has a lane of its own, see below
//! do <number> [late <ms>] <action>     answered by `done` or `refused` with that number, once
//!
//! <number> ::= <int>                   0 to 4294967295, one not used before on this connection
//! <ms>     ::= <int>                   for how long it was given when this was said
//! <action>                             one of those of [`Action`](lager_orders::Action)
//! ```
//!
//! A further `do` with `drive` renews the drive before its time is over, with the same command or
//! another one. The codes 8 and 9 are turns that run once and need no renewal. A robot counts the
//! time by its own clock from the moment when it reads the line, and stands when it is over. The
//! answer `done` comes, for a setpoint, when the steering board has it; for a turn, a step of the
//! arm or a calibration, when it has ended; and for everything else, when the robot shows the
//! effect.
//!
//! **A stop has a lane of its own.** The sender puts it before all lines that wait. The receiver
//! reads on to the end of what has arrived, and carries out every stop in it first. A stop never
//! waits in a queue. It drops commands to wheels and arm that wait (C5), but not the products to
//! fetch. If a `resume`, `drive` or `arm` arrives together with a stop, the robot refuses it,
//! whichever was sent first. A line whose first word is `stop` is a stop even if the rest cannot be
//! read; then it has no number and gets no confirmation. Only `resume` ends a stop.
//!
//! # Robot to station
//!
//! ```text
//! stopped <number> <int>               the steering board reports both motors off under the stop,
//!                                      that many ms after its receipt
//! done <number>
//! refused <number> <reason>            why it was not done
//! state {<key>=<value>}                20 times a second; see `State`
//! route <int> {<coord>}                nodes of the way; how many there are, and the first of them
//! blocked <int> {<edge> <int>}         ways that are not taken, likewise, and since when, in s of
//!                                      the robot's clock
//! queue <int> {<order> <prodid>}       what is fetched next, likewise
//! obstacles <int> {<edge>}             what stands on ways of a simulated world, likewise
//! gone <int> {<prodid>}                products whose goods are not in their place, likewise
//! event <event> <coord> <order> <prodid> [<text>]
//!                                      at that node; `-` where there is no order or product
//! past <int> <report>                  an `event` or `thinks` of so many ms ago, when a station
//!                                      has announced itself: it may have missed it
//! latency <int> {<int> <int>}          how long sensor frames took to logic's decision: the longest
//!                                      in microseconds, and for each bucket that is not empty its
//!                                      number from 0 to 89 and how many frames it holds; see below
//! truth <int> <int> <int> <prodid>     of a simulated robot: x and y in mm, heading in degrees,
//!                                      what it holds or `-`
//! sensors {<int> <int> <int> <int>}    while the line sensors are calibrated, of each of the
//!                                      eleven, the leftmost first: what it reads, the least and
//!                                      the most that it has read, 0 to 255 and higher over tape,
//!                                      and 1 once that is both floor and tape
//! health {<key>=<value>}               once a second: machine, services, boards; see `Health`
//! commission {<key>=<value>}           how far a commissioning is; see `Commissioning`, which has
//!                                      `found` and `kept`, too
//! thinks {<key>=<value>}               the `thought` that follows, in values; see `Thinks`
//! because <reason>                     why it says the `thought` that follows
//! thought <text>                       as in the document
//!
//! <reason> ::= <code> {<value>}        a name in the table of sentences, and what stands in the
//!                                      sentence; see `lager_orders::Reason`
//!
//! <event> ::= in_position | getting_item | item_delivered | next_node | refused
//!           | pickup_refused | failed | way_blocked | stopped | resumed | mode | asked
//!           | ended | restarted | link_lost | link_back
//! ```
//!
//! Bucket 0 of `latency` holds times up to 256 ns, and bucket i from 1 to 88 times up to
//! `(5 + (i - 1) % 4) << (6 + (i - 1) / 4)` ns, above those of the bucket before it: each doubling
//! is divided into four equal parts. Bucket 89 holds what took longer than 2^30 ns. A bucket
//! counts the frames since the robot made such a line before, at most 999999.
//!
//! A list may be empty here. The robot sends `route`, `blocked`, `queue`, `obstacles`, `gone`,
//! `sensors`, `commission` and `found` when they have changed. A line that cannot be read changes nothing; if it has a
//! number, the robot answers `refused`.
//!
//! ```
//! use lager_lines::conversation::{RobotLine, StationLine};
//! use lager_lines::extension::{Order, Report};
//! use lager_lines::to_line;
//! use lager_orders::Action;
//!
//! let asked = StationLine::read("do 17 order 4 7").unwrap();
//! let StationLine::Order(Order::Do { number, action, .. }) = asked else { panic!() };
//! assert!(matches!(action, Action::Add { order: 4, .. }));
//! assert_eq!(to_line(&RobotLine::Report(Report::Done { number })).unwrap(), "done 17\n");
//!
//! let error = Order::read("do 18 drive F3 200").unwrap().unwrap_err();
//! assert_eq!(error.number(), Some(18));
//! assert_eq!(
//!     error.to_string(),
//!     "column 13: 243 is no code of the wheels; they have 1 to 9",
//! );
//!
//! assert_eq!(Order::read("stop 0x13"), Some(Ok(Order::Stop { number: None })));
//! assert_eq!(
//!     RobotLine::read("blocked 1 2 0 up 81").unwrap().to_string(),
//!     "blocked 1 2 0 up 81",
//! );
//! ```

mod commission;
mod fields;
mod health;
mod hello;
mod listed;
mod order;
mod proof;
mod report;
mod state;
mod thinks;

pub use commission::{Commissioning, FoundOut, KeptLine};
pub use fields::{Degrees, Loads, Servos};
pub use health::{Finding, Findings, Health, Release, Service, Services};
pub use hello::Hello;
pub use listed::{Block, Listed, Queued};
pub use order::{ActionError, Order, Spelled};
pub use proof::Proof;
pub use report::{Event, Happened, Latency, Report, TruePose};
pub use state::State;
pub use thinks::Thinks;
