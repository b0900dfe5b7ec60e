//! Example: acts on each change of the weather as soon as it is published.

mod weather;

use std::{error::Error, time::Duration};

use lager_ports::{Bus, BusConfig};
use lager_wake::Policy;
use weather::{SAILOR, WEATHER, WeatherNow};

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args_os().nth(1).map(Into::into);
    let bus = Bus::open(
        &BusConfig {
            folder,
            ..BusConfig::of(&WEATHER)
        },
        SAILOR,
    )?;
    let waiter = bus.waiter(Policy::Block)?;
    let mut weather = bus.subscriber::<WeatherNow>()?;
    loop {
        while let Some(sample) = weather.receive()? {
            let ns = sample.cause().receive_time_ns() - sample.stamp().publish_time_ns;
            println!("wind {} mm/s, received after {ns} ns", sample.wind);
        }
        waiter.wait(Duration::from_millis(500));
    }
}
