//! The names of goods: finds the number for a name.
//!
//! ```text
//!   who describes the warehouse     where its names are found
//!   the robot's own station         in the file that it keeps, with what a panel has changed since
//!   nobody, it has no station       in the warehouse's file
//!   somebody else's station         nowhere here, since its numbers may mean other goods
//! ```

use anyhow::{Result, bail};
use lager_floor::ProductId;
use lager_lines::Called;
use lager_plant::Warehouse;
use lager_station::{find, load, told};

use crate::config::Config;

/// The number of the product with this name or number, for the robot that runs with `config`.
///
/// # Errors
/// No product has that name, or nobody here knows names.
pub fn number(config: &Config, called: &Called) -> Result<ProductId> {
    match called {
        Called::Number(number) => Ok(*number),
        Called::Name(_) => Ok(find(&described(config)?, called)?),
    }
}

/// The warehouse with the names of its goods, as the robot that runs with `config` knows it.
///
/// # Errors
/// Nobody here knows it.
pub fn described(config: &Config) -> Result<Warehouse> {
    let kept = &config.station.warehouse;
    if let Some(kept) = kept.as_ref().filter(|kept| kept.is_file()) {
        return Ok(load(kept)?);
    }
    if config.station.wanted && kept.is_none() {
        bail!(
            "only the external computer knows the names of goods, and it is not the robot's own; give the number, which `lager map` shows"
        );
    }
    let warehouse = config.warehouse()?;
    told(&warehouse)?;
    Ok(warehouse)
}

/// The configured warehouse, if there is one.
///
/// # Errors
/// No station can tell robots of it.
pub fn configured(config: &Config) -> Result<Option<Warehouse>> {
    let warehouse = config.known_warehouse()?;
    warehouse.as_ref().map(told).transpose()?;
    Ok(warehouse)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_warehouse_file_of_the_readme_is_one_for_station_and_simulated_world() {
        let readme = include_str!("../../station/README.md");
        let (_, rest) = readme
            .split_once("```toml\n# hall.toml")
            .expect("the example");
        let (example, _) = rest.split_once("```").expect("its end");
        let text = format!("# hall.toml{example}");
        let warehouse: Warehouse = toml::from_str(&text).expect("a warehouse");
        warehouse.validate().expect("it can be built");
        told(&warehouse).expect("it can be told");
    }
}
