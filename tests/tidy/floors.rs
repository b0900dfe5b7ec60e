//! The floor table: which crate may use which others, and which crates may open iceoryx2.

/// Each crate with the crates of the workspace that it may use. A crate that is not listed is
/// refused, so a new crate has to get its floor here first.
///
/// Services meet on the bus and never import each other; only `lager`, `supervisor`, `benches` and
/// `tests` use several of them.
pub(crate) const MAY_USE: &[(&str, &[&str])] = &[
    ("lager-sample", &[]),
    // For `sample`: so that a sample may contain its types. The boards compile it without.
    ("lager-wire", &["lager-sample"]),
    // The floor, which everybody shares. For `sample`: so that a sample may contain its types.
    ("lager-floor", &["lager-sample"]),
    // An operator's commands and their codes come from the wire.
    (
        "lager-orders",
        &["lager-floor", "lager-sample", "lager-wire"],
    ),
    (
        "lager-lines",
        &["lager-floor", "lager-orders", "lager-wire"],
    ),
    // It does not know the content of requests.
    ("lager-door", &[]),
    ("lager-battery", &[]),
    ("lager-machine", &[]),
    ("lager-ax12", &[]),
    ("lager-exde", &[]),
    ("lager-pins", &[]),
    (
        "lager-plant",
        &["lager-ax12", "lager-floor", "lager-orders"],
    ),
    ("lager-pty", &[]),
    ("lager-control", &["lager-ax12", "lager-exde", "lager-wire"]),
    ("lager-loader", &["lager-wire"]),
    (
        "lager-topics",
        &["lager-floor", "lager-orders", "lager-sample", "lager-wire"],
    ),
    ("lager-home", &["lager-sample"]),
    ("lager-wake", &["lager-home", "lager-sample"]),
    // It knows frames and threads, and no topic.
    ("lager-tracer", &["lager-home"]),
    ("lager-ports", &["lager-home", "lager-sample", "lager-wake"]),
    // To stop the robot needs no bus.
    (
        "lager-stop",
        &["lager-home", "lager-sample", "lager-topics"],
    ),
    // A message is a stamp and a payload, as the table describes them.
    (
        "lager-journal",
        &["lager-floor", "lager-sample", "lager-topics"],
    ),
    (
        "lager-bridge",
        &[
            "lager-home",
            "lager-orders",
            "lager-ports",
            "lager-sample",
            "lager-stop",
            "lager-topics",
            "lager-wake",
            "lager-wire",
        ],
    ),
    // The navigator uses the wire's line states and command codes, which topics contain.
    (
        "lager-logic",
        &[
            "lager-floor",
            "lager-home",
            "lager-orders",
            "lager-ports",
            "lager-sample",
            "lager-topics",
            "lager-wake",
            "lager-wire",
        ],
    ),
    (
        "lager-monitor",
        &[
            "lager-battery",
            "lager-home",
            "lager-orders",
            "lager-ports",
            "lager-remote",
            "lager-sample",
            "lager-stop",
            "lager-topics",
            "lager-wake",
        ],
    ),
    // Both ends of what leaves the robot. It counts by stamps as the bus does, and opens none.
    (
        "lager-remote",
        &[
            "lager-home",
            "lager-ports",
            "lager-sample",
            "lager-topics",
            "lager-wake",
        ],
    ),
    (
        "lager-gateway",
        &[
            "lager-door",
            "lager-home",
            "lager-journal",
            "lager-orders",
            "lager-ports",
            "lager-remote",
            "lager-sample",
            "lager-stop",
            "lager-topics",
            "lager-wake",
        ],
    ),
    (
        "lager-recorder",
        &[
            "lager-home",
            "lager-journal",
            "lager-ports",
            "lager-sample",
            "lager-topics",
            "lager-wake",
        ],
    ),
    // What a ranger reads is of the boards' curve.
    (
        "lager-commission",
        &[
            "lager-control",
            "lager-operator",
            "lager-orders",
            "lager-topics",
            "lager-wire",
        ],
    ),
    // The common code of comm, the command line and `up` for requests to the robot.
    (
        "lager-operator",
        &["lager-floor", "lager-orders", "lager-topics", "lager-wire"],
    ),
    // The robot's side of the text lines, between the network and the bus.
    (
        "lager-comm",
        &[
            "lager-battery",
            "lager-floor",
            "lager-home",
            "lager-lines",
            "lager-operator",
            "lager-orders",
            "lager-ports",
            "lager-sample",
            "lager-stop",
            "lager-topics",
            "lager-wake",
            "lager-wire",
        ],
    ),
    // The external computer has no bus. It shares the warehouse's file with the simulated world.
    (
        "lager-station",
        &[
            "lager-floor",
            "lager-lines",
            "lager-orders",
            "lager-plant",
            "lager-wire",
        ],
    ),
    // It shows the station in a browser, so it has no bus either.
    (
        "lager-panel",
        &[
            "lager-commission",
            "lager-plant",
            "lager-door",
            "lager-floor",
            "lager-lines",
            "lager-orders",
            "lager-station",
            "lager-topics",
        ],
    ),
    (
        "lager-simulator",
        &[
            "lager-floor",
            "lager-ax12",
            "lager-control",
            "lager-exde",
            "lager-home",
            "lager-plant",
            "lager-ports",
            "lager-pty",
            "lager-topics",
            "lager-wake",
            "lager-wire",
        ],
    ),
    // It saves a robot's orders, with logic's order numbers, in files like those of a station.
    (
        "lager-supervisor",
        &[
            "lager-lines",
            "lager-logic",
            "lager-operator",
            "lager-orders",
            "lager-ports",
            "lager-sample",
            "lager-station",
            "lager-topics",
            "lager-home",
            "lager-stop",
            "lager-wake",
        ],
    ),
    // The helpers of tests and benches.
    (
        "lager-rig",
        &[
            "lager-floor",
            "lager-home",
            "lager-machine",
            "lager-orders",
            "lager-ports",
            "lager-topics",
            "lager-wake",
            "lager-wire",
        ],
    ),
    (
        "lager-benches",
        &[
            "lager-floor",
            "lager-bridge",
            "lager-gateway",
            "lager-home",
            "lager-lines",
            "lager-logic",
            "lager-machine",
            "lager-operator",
            "lager-orders",
            "lager-ports",
            "lager-remote",
            "lager-rig",
            "lager-sample",
            "lager-stop",
            "lager-topics",
            "lager-tracer",
            "lager-wake",
            "lager-wire",
        ],
    ),
    (
        "lager",
        &[
            "lager-floor",
            "lager-bridge",
            "lager-battery",
            "lager-comm",
            "lager-commission",
            "lager-gateway",
            "lager-home",
            "lager-lines",
            "lager-loader",
            "lager-logic",
            "lager-machine",
            "lager-monitor",
            "lager-operator",
            "lager-orders",
            "lager-panel",
            "lager-plant",
            "lager-ports",
            "lager-recorder",
            "lager-remote",
            "lager-sample",
            "lager-simulator",
            "lager-supervisor",
            "lager-station",
            "lager-stop",
            "lager-topics",
            "lager-tracer",
            "lager-wake",
            "lager-wire",
        ],
    ),
    ("lager-tests", &["*"]),
];

/// The crates that may use iceoryx2's ports and services: the one that opens the robot's bus, and
/// the one that compares it with bare iceoryx2.
pub(crate) const OPEN_ICEORYX2: &[&str] = &["lager-ports", "lager-benches"];

/// The crate of the marker trait that each payload needs; it opens nothing.
pub(crate) const MARKER: &str = "iceoryx2-bb-elementary-traits";
