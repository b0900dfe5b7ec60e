//! What is written is read as the same, for any values at all.

use lager_floor::{Grid, Heading, Node, Place, Product, ProductId, SideLength};
use lager_lines::conversation::{RobotLine, StationLine};
use lager_lines::extension::{
    Block, Commissioning, Degrees, Event, Finding, Findings, FoundOut, Happened, Health, Hello,
    KeptLine, Latency, Listed, Loads, Order, Queued, Release, Report, Service, Services, Servos,
    State, Thinks, TruePose,
};
use lager_lines::gag::{Answer, ListWord, Query, Request, Telemetry};
use lager_lines::strings::{Good, Goods, map_string, read_map};
use lager_lines::{Name, Products, Text, to_line};
use lager_orders::{Action, AnswerWord, Commission, LeaseMs, Mode, Pick, Put, Reason, Wheels};
use lager_wire::{Binary, Callsign, LineBits, LineReading, OperatorArm, OperatorCommand, Speed};
use proptest::option::of;
use proptest::prelude::*;
use proptest::sample::select;

fn coord() -> impl Strategy<Value = Node> {
    (any::<u8>(), any::<u8>()).prop_map(|(x, y)| Node { x, y })
}

fn direction() -> impl Strategy<Value = Heading> {
    select(&Heading::ALL)
}

fn product_id() -> impl Strategy<Value = ProductId> {
    prop_oneof![0..1000, 0..=i32::MAX].prop_map(|id| ProductId::new(id).expect("not negative"))
}

fn text() -> impl Strategy<Value = Text> {
    "[^\r\n]{0,100}".prop_map(|text| Text::new(text).expect("no line break"))
}

fn name() -> impl Strategy<Value = Name> {
    "[a-z0-9_-]{1,32}".prop_map(|name| Name::new(name).expect("a name"))
}

fn map() -> impl Strategy<Value = Grid> {
    (1..=99_u8, 1..=99_u8, any::<bool>(), any::<bool>()).prop_map(|(x, y, right, top)| {
        let delivery = Node {
            x: if right { x } else { 0 },
            y: if top { y } else { 0 },
        };
        Grid::new(Node { x, y }, delivery).expect("a corner")
    })
}

/// As many as always fit in a line.
fn products() -> impl Strategy<Value = Products> {
    let place = (coord(), direction());
    prop::collection::btree_map(product_id(), place, 0..35).prop_map(|all| {
        let product = |(id, (square, side))| Product { id, square, side };
        Products::new(all.into_iter().map(product).collect()).expect("each once")
    })
}

fn command() -> impl Strategy<Value = OperatorCommand> {
    select(&OperatorCommand::ALL)
}

fn wheels() -> impl Strategy<Value = Wheels> {
    let speed = select(Speed::ALL);
    (command(), speed).prop_filter_map("wheels", |(command, speed)| {
        Wheels::new(command.at(speed).unwrap_or(command))
    })
}

fn arm() -> impl Strategy<Value = OperatorArm> {
    command().prop_filter_map("arm", |command| match command {
        OperatorCommand::Arm(step) => Some(step),
        _ => None,
    })
}

fn request() -> impl Strategy<Value = Request> {
    prop_oneof![
        select(&Query::ALL).prop_map(Request::Query),
        text().prop_map(|text| Request::Telemetry(Telemetry::Thought(text))),
        coord().prop_map(|node| Request::Telemetry(Telemetry::Robot(node))),
        direction().prop_map(|way| Request::Telemetry(Telemetry::Heading(way))),
    ]
}

fn answer() -> impl Strategy<Value = Answer> {
    let word = select(&[ListWord::Prodlis, ListWord::Prodlist]);
    prop_oneof![
        (40..=500_u16).prop_map(|cm| Answer::SideLength(SideLength::new(cm).expect("a side"))),
        map().prop_map(Answer::Map),
        (word, products()).prop_map(|(word, products)| Answer::Products(word, products)),
        product_id().prop_map(Answer::Fetch),
        command().prop_map(Answer::Command),
        Just(Answer::PickupDone),
    ]
}

fn block() -> impl Strategy<Value = Block> {
    (way(), any::<u32>()).prop_map(|(way, since_s)| Block { way, since_s })
}

fn way() -> impl Strategy<Value = Place> {
    (coord(), direction()).prop_map(|(node, heading)| Place::new(node, heading))
}

fn mode() -> impl Strategy<Value = Mode> {
    select(&[Mode::Manual, Mode::Autonomous])
}

fn pick() -> impl Strategy<Value = Pick> {
    select(&[Pick::Manual, Pick::Auto])
}

fn action() -> impl Strategy<Value = Action> {
    let lease = (1..=LeaseMs::MAX).prop_map(|ms| LeaseMs::new(ms).expect("in range"));
    prop_oneof![
        (any::<u32>(), product_id()).prop_map(|(order, product)| Action::Add { order, product }),
        any::<u32>().prop_map(|order| Action::Cancel { order }),
        any::<u32>().prop_map(|order| Action::First { order }),
        any::<u32>().prop_map(|order| Action::Up { order }),
        Just(Action::Clear),
        mode().prop_map(Action::Mode),
        any::<u64>().prop_map(|stop| Action::Resume { stop }),
        Just(Action::Reset),
        way().prop_map(Action::Place),
        any::<bool>().prop_map(|force| Action::Picked { force }),
        pick().prop_map(Action::Pick),
        (wheels(), lease).prop_map(|(wheels, lease)| Action::Drive { wheels, lease }),
        arm().prop_map(Action::Arm),
        any::<(u8, u8)>().prop_map(|(p, d)| Action::Gains { p, d }),
        Just(Action::Calibrate),
        select(&[Callsign::Sensor, Callsign::Steering]).prop_map(Action::Restart),
        Just(Action::Horn),
        of(product_id()).prop_map(|product| Action::Back { product }),
        (select(&[Put::Put, Put::Take]), way())
            .prop_map(|(put, way)| Action::Obstacle { put, way }),
        commission().prop_map(Action::Commission),
    ]
}

fn commission() -> impl Strategy<Value = Commission> {
    let plain = [
        Commission::Begin,
        Commission::Undo,
        Commission::Restart,
        Commission::Here,
        Commission::Stand,
        Commission::Quit,
    ];
    let word = "[a-z0-9.,-]{1,16}".prop_map(|word| AnswerWord::new(&word).expect("a word"));
    prop_oneof![
        select(plain.to_vec()),
        (any::<u32>(), word).prop_map(|(asked, word)| Commission::Answer { asked, word }),
    ]
}

/// A sentence of a commissioning, which stands in one word of a line.
fn said() -> impl Strategy<Value = Reason> {
    "[a-z_]{1,12}( [a-z0-9%=/.]{1,12}){0,3}".prop_map(|said| Reason::read(&said))
}

prop_compose! {
    fn commissioning()(
        asked in of(any::<u32>()), step in of(name()), place in of(any::<u8>()),
        steps in of(any::<u8>()), question in of(name()), about in of(said()), takes in of(name()),
        moves in of(any::<bool>()), shows in of(said()), why in of(said()), ended in of(said()),
    ) -> Commissioning {
        Commissioning {
            asked, step, place, steps, question, about, takes, moves, shows, why, ended,
        }
    }
}

fn order() -> impl Strategy<Value = Order> {
    prop_oneof![
        any::<Option<u32>>().prop_map(|number| Order::Stop { number }),
        any::<(u32, u32)>().prop_flat_map(|(number, late_ms)| {
            action().prop_map(move |action| Order::Do {
                number,
                late_ms,
                action,
            })
        }),
    ]
}

fn degrees() -> impl Strategy<Value = Degrees> {
    any::<i32>().prop_map(Degrees::new)
}

prop_compose! {
    fn place()(
        time_ms in of(any::<u64>()), x_mm in of(any::<i32>()), y_mm in of(any::<i32>()),
        heading_deg in of(degrees()), unsure_mm in of(any::<u32>()), node in of(coord()), looks in of(direction()),
        next in of(coord()), phase in of(name()), hold in of(name()), mode in of(mode()), pick in of(pick()),
    ) -> State {
        State {
            time_ms, x_mm, y_mm, heading_deg, unsure_mm, node, looks, next, phase, hold, mode, pick,
            ..State::default()
        }
    }
}

prop_compose! {
    fn work()(
        place in place(), stopped in of(any::<bool>()), order in of(any::<u32>()),
        product in of(product_id()), delivered in of(any::<u32>()),
        sensor_up in of(any::<bool>()), steering_up in of(any::<bool>()),
        sensor_lost in of(any::<u32>()), steering_lost in of(any::<u32>()),
        bus_lost in of(any::<u64>()), gain_p in of(any::<u8>()), gain_d in of(any::<u8>()),
    ) -> State {
        State {
            gain_p, gain_d, stopped, order, product, delivered, sensor_up, steering_up, sensor_lost, steering_lost,
            bus_lost,
            ..place
        }
    }
}

prop_compose! {
    fn trouble()(
        work in work(), stop_cause in of(name()), stop_by in of(name()),
        stop_age_ms in of(any::<u64>()), stood_ms in of(any::<u64>()), failure in of(name()),
        failure_expected in of(any::<i32>()), failure_seen in of(any::<i32>()),
        remedy in of(name()),
    ) -> State {
        State {
            stop_cause, stop_by, stop_age_ms, stood_ms, failure, failure_expected, failure_seen, remedy,
            ..work
        }
    }
}

prop_compose! {
    fn thinks()(
        kind in of(name()), node in of(coord()), looks in of(direction()), joint in of(name()),
        sides in of(any::<u8>()), product in of(product_id()), expected in of(any::<i32>()),
        seen in of(any::<i32>()), failure in of(name()), remedy in of(name()),
    ) -> Thinks {
        Thinks {
            kind, node, looks, joint, sides, product, expected, seen, failure, remedy,
            ..Thinks::default()
        }
    }
}

prop_compose! {
    fn service()(
        name in name(), is_up in any::<bool>(), since_s in any::<u32>(), restarts in any::<u32>(),
    ) -> Service {
        Service { name, is_up, since_s, restarts }
    }
}

prop_compose! {
    fn health()(
        release in of(any::<[u16; 3]>()), load_percent in of(any::<u32>()),
        cores in of(any::<u16>()), trip_ms in of(any::<u32>()),
        sensor_version in of(any::<u8>()), steering_damaged in of(any::<u32>()),
        services in of(prop::collection::vec(service(), 0..10)),
        found in of(prop::collection::vec((name(), any::<u32>()), 0..7)),
    ) -> Health {
        let finding = |(code, seen)| Finding { code, seen };
        Health {
            release: release.map(Release), load_percent, cores, trip_ms, sensor_version,
            steering_damaged, services: services.map(Services::new),
            found: found.map(|all| Findings::new(all.into_iter().map(finding))),
            ..Health::default()
        }
    }
}

prop_compose! {
    fn state()(
        work in trouble(), bits in of(any::<u16>()), line_error in of(any::<i8>()),
        distance_cm in of(any::<u8>()), left_duty in of(any::<u8>()),
        right_duty in of(any::<u8>()), code in of(any::<u8>()),
        servos in of(any::<[Option<u16>; 8]>()), battery_dv in of(any::<u8>()),
        battery_percent in of(any::<u8>()), battery_left_s in of(any::<u16>()),
        loads in of(any::<[i16; 8]>()), servo_errors in of(any::<u8>()),
    ) -> State {
        State {
            line_bits: bits.map(LineBits::new), line_error, distance_cm, left_duty, right_duty,
            code: code.map(Binary), servos: servos.map(Servos::new), battery_dv,
            battery_percent, battery_left_s,
            loads: loads.map(Loads::new), servo_errors: servo_errors.map(Binary),
            ..work
        }
    }
}

fn event() -> impl Strategy<Value = Report> {
    (
        select(Happened::all().collect::<Vec<_>>()),
        coord(),
        any::<Option<u32>>(),
        of(product_id()),
        text(),
    )
        .prop_map(|(kind, node, order, product, text)| {
            Report::Event(Event {
                kind,
                node,
                order,
                product,
                text,
            })
        })
}

/// Of what has happened before a line has room for what an event says, with the time before it.
fn past() -> impl Strategy<Value = Report> {
    let thinks = thinks().prop_map(|thinks| Report::Thinks(Box::new(thinks)));
    let short = event().prop_map(|report| match report {
        Report::Event(event) => Report::Event(Event {
            text: Text::default(),
            ..event
        }),
        other => other,
    });
    let ago_ms = 0..=i64::MAX as u64;
    (ago_ms, prop_oneof![thinks, short]).prop_map(|(ago_ms, report)| Report::Past {
        ago_ms,
        report: Box::new(report),
    })
}

fn report() -> impl Strategy<Value = Report> {
    let queued =
        (any::<u32>(), product_id()).prop_map(|(order, product)| Queued { order, product });
    let many = 0..200_usize;
    prop_oneof![
        any::<(u32, u32)>().prop_map(|(number, after_ms)| Report::Stopped { number, after_ms }),
        any::<u32>().prop_map(|number| Report::Done { number }),
        (any::<u32>(), text()).prop_map(|(number, reason)| Report::Refused {
            number,
            reason: Reason::read(reason.as_str()),
        }),
        state().prop_map(|state| Report::State(Box::new(state))),
        thinks().prop_map(|thinks| Report::Thinks(Box::new(thinks))),
        health().prop_map(|health| Report::Health(Box::new(health))),
        prop::collection::vec(coord(), many.clone())
            .prop_map(|all| Report::Route(Listed::<Node>::new(&all))),
        prop::collection::vec(block(), many.clone())
            .prop_map(|all| Report::Blocked(Listed::<Block>::new(&all))),
        prop::collection::vec(queued, many.clone())
            .prop_map(|all| Report::Queue(Listed::<Queued>::new(&all))),
        prop::collection::vec(way(), 0..200_usize)
            .prop_map(|all| Report::Obstacles(Listed::<Place>::new(&all))),
        event(),
        past(),
        prop::collection::vec(product_id(), many)
            .prop_map(|all| Report::Gone(Listed::<ProductId>::new(&all))),
        (
            any::<u32>(),
            prop::collection::vec(0..=Latency::MOST, Latency::BUCKETS)
        )
            .prop_map(|(max_us, counts)| {
                let buckets = counts.try_into().expect("as many as there are buckets");
                Report::Latency(Box::new(Latency { max_us, buckets }))
            }),
        commissioning().prop_map(|how| Report::Commission(Box::new(how))),
        prop::collection::vec((name(), said()), 0..40)
            .prop_map(|found| Report::Found(FoundOut::new(&found))),
        (any::<(u32, u32)>(), text()).prop_map(|((number, of), text)| Report::Kept(KeptLine {
            number,
            of,
            text
        })),
        any::<[(u8, u8, u8, bool); 11]>().prop_map(|read| {
            let mut sensors = [LineReading::default(); 11];
            for (sensor, (reading, lowest, highest, tells_apart)) in (0..).zip(read) {
                sensors[usize::from(sensor)] = LineReading {
                    sensor,
                    reading,
                    lowest,
                    highest,
                    tells_apart,
                };
            }
            Report::Sensors(sensors)
        }),
        (any::<i32>(), any::<i32>(), degrees(), of(product_id())).prop_map(
            |(x_mm, y_mm, heading, carrying)| {
                Report::Truth(TruePose {
                    x_mm,
                    y_mm,
                    heading,
                    carrying,
                })
            }
        ),
    ]
}

fn hello() -> impl Strategy<Value = Hello> {
    (1..=255_u8, name(), any::<Option<u64>>()).prop_map(|(version, name, clock_ms)| Hello {
        version,
        name,
        clock_ms,
    })
}

fn good() -> impl Strategy<Value = Good> {
    // Labels that are numbers as often as names.
    let label = prop_oneof![
        product_id().prop_map(|id| id.to_string()),
        "[a-zåäö0-9]([^,;\r\n]{0,8}[a-zåäö.])?",
    ];
    (label, coord(), direction())
        .prop_map(|(label, square, side)| Good::new(label, square, side).expect("a label"))
}

/// The line of a value without its end.
fn body(value: &impl std::fmt::Display) -> String {
    let line = to_line(value).expect("it fits in a line");
    line.strip_suffix('\n').expect("a line's end").to_owned()
}

proptest! {
    #[test]
    fn requests(request in request()) {
        let line = body(&request);
        prop_assert_eq!(Request::read(&line), Ok(request.clone()));
        prop_assert_eq!(RobotLine::read(&line), Ok(RobotLine::Request(request)));
    }

    #[test]
    fn answers(answer in answer()) {
        let line = body(&answer);
        prop_assert_eq!(Answer::read(&line), Ok(answer.clone()));
        prop_assert_eq!(StationLine::read(&line), Ok(StationLine::Answer(answer)));
    }

    #[test]
    fn orders(order in order()) {
        let line = body(&order);
        prop_assert_eq!(StationLine::read(&line), Ok(StationLine::Order(order)));
    }

    #[test]
    fn reports(report in report()) {
        let line = body(&report);
        prop_assert_eq!(RobotLine::read(&line), Ok(RobotLine::Report(report)));
    }

    #[test]
    fn hellos(hello in hello()) {
        let line = body(&hello);
        prop_assert_eq!(RobotLine::read(&line), Ok(RobotLine::Hello(hello.clone())));
        prop_assert_eq!(StationLine::read(&line), Ok(StationLine::Hello(hello)));
    }

    #[test]
    fn map_strings(map in map()) {
        prop_assert_eq!(read_map(&map_string(map)), Ok(map));
    }

    #[test]
    fn goods_strings(goods in prop::collection::vec(good(), 0..30)) {
        let goods = Goods(goods);
        prop_assert_eq!(Goods::read(&goods.to_string()), Ok(goods));
    }

    #[test]
    fn products_through_the_goods_string(products in products()) {
        let goods = Goods::read(&Goods::from(&products).to_string()).expect("goods");
        prop_assert_eq!(goods.products(), Ok(products));
    }

    #[test]
    fn any_text_is_read_or_refused_where_it_stands(line in "\\PC{0,80}") {
        for refused in [
            Request::read(&line).map(drop).err(),
            RobotLine::read(&line).map(drop).err(),
        ].into_iter().flatten() {
            prop_assert!((1..=line.chars().count() + 1).contains(&refused.column));
        }
    }
}
