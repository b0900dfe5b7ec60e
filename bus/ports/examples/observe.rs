//! Example: looks at the weather now and then and never slows down its publisher.

mod weather;

use std::{error::Error, thread::sleep, time::Duration};

use lager_ports::{Bus, BusConfig};
use lager_sample::Part;
use weather::{WEATHER, WeatherNow};

/// The part of a process that only looks.
const ONLOOKER: Part = Part::new(14, "onlooker").observing();

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args_os().nth(1).map(Into::into);
    let bus = Bus::open(
        &BusConfig {
            folder,
            ..BusConfig::of(&WEATHER)
        },
        ONLOOKER,
    )?;
    let mut weather = bus.subscriber::<WeatherNow>()?;
    loop {
        while let Some(sample) = weather.receive()? {
            println!("number {}: {:?}", sample.stamp().sequence, *sample);
        }
        println!("{} lost", weather.lost());
        sleep(Duration::from_secs(1));
    }
}
