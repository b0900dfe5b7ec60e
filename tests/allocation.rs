//! Tests that bridge and logic allocate nothing per frame once they run. A counting allocator
//! watches both services with all their threads while the robot drives.
//!
//! The robot itself runs in another process, so the counter sees only the two services and this
//! test's sleeping thread.

use std::time::Duration;

use lager_bridge::{BridgeConfig, Ports};
use lager_logic::LogicConfig;
use lager_orders::Mode;
use lager_plant::Warehouse;
use lager_ports::{Bus, Cause};
use lager_rig::allocations::{self, Counting};
use lager_tests::{Domain, wait_for};
use lager_topics::{
    Ask, AskKind, BridgeRequest, LinkHealth, MissionOrder, NavMap, NavStatus, Order, Phase, Role,
    SensorLine, SteeringState, WarehouseMap,
};
use lager_wake::Shutdown;

#[global_allocator]
static COUNTING: Counting = Counting;

#[test]
fn bridge_and_logic_allocate_nothing_per_frame() {
    let domain = Domain::new();
    let folder = domain.folder();
    let ports = [folder.join("sensor.tty"), folder.join("steering.tty")];
    let config = folder.join("robot.toml");
    std::fs::write(
        &config,
        format!(
            "[serial]\nsensor = {:?}\nsteering = {:?}\n",
            ports[0], ports[1]
        ),
    )
    .expect("a configuration file");
    let config = config.to_str().expect("a path in UTF-8");
    let robot = domain.start(&["--config", config, "simulator"]);

    let bus = |role| Bus::open(&domain.bus("r1", 1.0), role).expect("the bus opens");
    let shutdown = Shutdown::new();
    let operator = bus(Role::Operator);
    let map = operator.publisher::<NavMap>().expect("a topic");
    map.send(Cause::OWN, small_map()).expect("sent");
    let orders = operator.publisher::<MissionOrder>().expect("a topic");
    let client = operator.client::<BridgeRequest>().expect("a request");
    let mut health = operator.subscriber::<LinkHealth>().expect("a topic");
    let mut status = operator.subscriber::<NavStatus>().expect("a topic");

    std::thread::scope(|scope| {
        let bridge_config = BridgeConfig {
            ports: Ports::Named(ports.clone()),
            ..BridgeConfig::default()
        };
        let (shutdown, bus) = (&shutdown, &bus);
        scope.spawn(move || {
            lager_bridge::run(&bus(Role::Bridge), &bridge_config, shutdown).expect("the bridge");
        });
        scope.spawn(move || {
            lager_logic::run(&bus(Role::Logic), &LogicConfig::default(), shutdown).expect("logic");
        });
        // Whatever fails below, the services must end, or the scope waits for them for ever.
        let _end = EndAtLast(shutdown);

        wait_for("the boards", || {
            map.tick();
            health
                .latest()
                .expect("readable")
                .filter(|health| health.boards_are_ready())
                .map(|_| ())
        });
        let ask = Ask {
            kind: AskKind::SetMode.into(),
            mode: Mode::Autonomous.into(),
            ..Ask::default()
        };
        client.call(ask, Duration::from_secs(5)).expect("an answer");
        wait_for("logic to take orders", || {
            status
                .latest()
                .expect("readable")
                .filter(|status| status.phase.get() == Some(Phase::WaitingForOrder))
                .map(|_| ())
        });
        orders
            .send(Cause::OWN, Order { id: 1, product: 1 })
            .expect("sent");
        wait_for("the robot to drive", || {
            status
                .latest()
                .expect("readable")
                .filter(|status| status.phase.get() == Some(Phase::Driving))
                .map(|_| ())
        });
        // The first frames may still fill caches in the libraries, so a second passes first.
        std::thread::sleep(Duration::from_secs(1));

        // The count begins when the first samples have been received.
        let mut line = operator.subscriber::<SensorLine>().expect("a topic");
        let mut state = operator.subscriber::<SteeringState>().expect("a topic");
        wait_for("a line frame", || {
            line.latest().expect("readable").map(|_| ())
        });
        wait_for("a report", || state.latest().expect("readable").map(|_| ()));
        let before = allocations::of_all_threads();
        // The robot drives over the next crossing to the station, so the services also make
        // decisions.
        let frames = wait_for("2000 frames", || {
            line.latest().expect("readable");
            state.latest().expect("readable");
            let frames = line.received() + line.lost() + state.received() + state.lost();
            (frames > 2_000).then_some(frames)
        });
        let after = allocations::of_all_threads();
        assert_eq!(after - before, 0, "allocations over {frames} frames");
    });
    // The shutdown rings the services, so this process opens the bells.
    drop((
        robot, map, orders, client, health, status, operator, shutdown,
    ));
    domain.assert_clean();
}

/// Requests the shutdown when it goes out of scope.
struct EndAtLast<'a>(&'a Shutdown);

impl Drop for EndAtLast<'_> {
    fn drop(&mut self) {
        self.0.request();
    }
}

/// The built-in small warehouse as the bus carries it.
fn small_map() -> WarehouseMap {
    let warehouse = Warehouse::builtin("small").expect("built in");
    let (side, grid, products) = warehouse.told().expect("a floor");
    WarehouseMap::new(side, grid, &products)
}
