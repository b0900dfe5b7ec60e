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
//! A robot may repeat its first line at any time, and a station answers it each time, so each side
//! knows that the other is there. A robot repeats it every 50 ms, and stops when nothing at all has
//! come from the station for 150 ms while it carries something out that the station gave.
//!
//! # Nothing moves late
//!
//! Behind the line that it repeats the robot puts its clock in ms: `lager 1 r1 81250`. The station's
//! answer repeats that number: `lager 1 station 81250`. Lines arrive in the order in which they were
//! said, so the station said whatever comes behind that answer after the robot's clock showed this
//! number, and it cannot be older. That holds however long a link, a socket or a process held it up.
//! A station puts into a `do` besides for how long it was given already, as by a page. What moves
//! the robot or lets it move, the answers of the document among it, is refused when the two together
//! exceed 200 ms, and everything else but a stop when they exceed 2 s.
//!
//! # Who proves it
//!
//! A station that knows a secret of the robot by that name does not believe the first line. It asks
//! for a proof, and proves itself in turn ([`secret`](crate::secret)); a robot that has a secret
//! says nothing more, and carries out nothing, before it has heard that:
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
//! Where a station takes a robot that has announced itself no longer, or refuses another who has
//! announced himself by its name, it says why: `thought <text>`. It may then end the connection.
//!
//! # Between both
//!
//! The document's questions and answers go on between the lines below. These are asynchronous in
//! both directions: neither side waits for a line before it sends its own. The first word tells the
//! kind of a line.
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
//! <action> ::= order <order> <prodid>  fetch a product after those that wait
//!            | cancel <order>          fetch it no more; refused once its goods are held
//!            | first <order>           fetch it before those that wait
//!            | up <order>              fetch it before the one that is now before it
//!            | clear                   fetch none of those that wait
//!            | mode <mode>             who drives
//!            | resume <stop>           end this stop, as `stop=` of the state tells it; refused
//!                                      where another one was set meanwhile
//!            | reset                   the robot stands on the delivery corner, looking inwards
//!            | place <edge>            it stands on that node and looks that way; a simulated one
//!                                      is put there
//!            | pick manual|auto        who picks the goods up from now on: a person, or the robot
//!            | picked [force]          the goods are in the gripper; force: felt or not
//!            | drive <styrcomm> <ms>   the wheels, for 1 to 1000 ms from receipt
//!            | arm <armcomm>           one step of the arm
//!            | gains <int> <int>       of the error and of its change, each 0 to 255
//!            | calibrate               the line sensors, on the tape under the robot
//!            | obstacle put <edge>     in a simulated world
//!            | obstacle take <edge>
//! <order>  ::= <int>                   0 to 4294967295, chosen by the station; 0 is refused
//! <mode>   ::= manual | autonomous
//! <edge>   ::= <coord> <direction>     from a node to the next one that way
//! ```
//!
//! `drive` is renewed by a further `do` before its time is over, with or without another command;
//! code 8 and 9 are turns that run once and need no renewal. A robot counts the time by its own
//! clock from when it has read the line, and stands when it is over. A setpoint is done when the
//! steering board has it, a turn or a step of the arm when it has ended, a calibration likewise,
//! and everything else when the robot shows the effect.
//!
//! **A stop has a lane of its own.** Whoever sends puts it before all lines that wait to be sent;
//! whoever receives reads on to the end of what has arrived and carries out every stop in it before
//! anything else. It is never queued, and commands to wheels and arm that wait are dropped (C5);
//! the products to fetch still wait. A `resume`, `drive` or `arm` that arrives together with a stop
//! is refused, whichever of the two was sent first. A line whose first word is `stop` is a stop
//! even if what follows cannot be read; then it has no number and is not confirmed. Only `resume`
//! ends it.
//!
//! # Robot to station
//!
//! ```text
//! stopped <number> <int>               the steering board reports both motors off under the stop,
//!                                      that many ms after its receipt
//! done <number>
//! refused <number> <text>              why it was not done
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
//! thinks {<key>=<value>}               the `thought` that follows, in values; see `Thinks`
//! thought <text>                       as in the document
//!
//! <event> ::= in_position | getting_item | item_delivered | next_node | refused
//!           | pickup_refused | failed | way_blocked | stopped | resumed | mode | restarted
//!           | link_lost | link_back
//! ```
//!
//! Bucket 0 of `latency` holds times up to 256 ns, and bucket i from 1 to 88 times up to
//! `(5 + (i - 1) % 4) << (6 + (i - 1) / 4)` ns, above those of the bucket before it: each doubling
//! is divided into four equal parts. Bucket 89 holds what took longer than 2^30 ns. A bucket
//! counts the frames since the robot made such a line before, at most 999999.
//!
//! Here a list may be empty, and `route`, `blocked`, `queue`, `obstacles`, `gone` and `sensors` are
//! sent when they have changed. A line that cannot be read changes nothing; if it has a number the
//! robot answers `refused`.
//!
//! ```
//! use lager_lines::conversation::{RobotLine, StationLine};
//! use lager_lines::extension::{Action, Order, Report};
//! use lager_lines::to_line;
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

mod fields;
mod hello;
mod listed;
mod mode;
mod order;
mod proof;
mod report;
mod state;
mod thinks;

pub use fields::{Degrees, Loads, Servos};
pub use hello::Hello;
pub use listed::{Block, Edge, Listed, Queued};
pub use mode::{Mode, Pick};
pub use order::{Action, ActionError, LeaseMs, Order, Put};
pub use proof::Proof;
pub use report::{Event, EventKind, Latency, Report, TruePose};
pub use state::State;
pub use thinks::Thinks;
