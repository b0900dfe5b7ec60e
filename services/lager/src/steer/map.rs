//! `lager map`: the warehouse and its blocked ways, as logic knows them.

use std::fmt::Write;

use anyhow::{Result, bail};
use lager_floor::Heading;
use lager_plant::Warehouse;
use lager_sample::Tag;
use lager_topics::{
    BlockSource, BlockedWays, GoneGoods, GoneWhy, GoodState, NavBlocks, NavMap, TruthPose,
    WarehouseMap,
};

use super::{Operator, first};
use crate::goods;

impl Operator {
    /// `lager map`: the floor, its goods, and the ways on which something stands.
    ///
    /// # Errors
    /// When nobody publishes the map.
    pub fn map(&self) -> Result<String> {
        let map = first(
            &mut self.bus.subscriber::<NavMap>()?,
            &self.bus,
            &self.patience,
        )?;
        let ways = first(
            &mut self.bus.subscriber::<NavBlocks>()?,
            &self.bus,
            &self.patience,
        )?;
        // Products without a known name have their number.
        let names = goods::described(&self.running).ok();
        Ok(described(&map, &ways, self.queue()?.gone(), names.as_ref()))
    }

    /// Refuses it in a simulated world, which knows where goods are and where nobody puts them
    /// back.
    pub(super) fn must_be_there(&self, product: Option<i32>) -> Result<()> {
        if self.running.body.service().is_none() {
            return Ok(());
        }
        let mut truth = self.bus.subscriber::<TruthPose>()?;
        let world = first(&mut truth, &self.bus, &self.patience)?;
        let mut goods = world.goods().iter();
        let away = goods.find(|good| {
            let is_meant = product.is_none_or(|product| product == good.id);
            is_meant && good.state != GoodState::Shelf
        });
        match away {
            None => Ok(()),
            Some(good) => bail!(
                "goods {} are not in their place in the simulated world, where nobody puts it back; \
                 all goods are there when `lager up` is started again",
                good.id
            ),
        }
    }
}

/// The warehouse in lines: the floor, each of its goods, each blocked way.
fn described(
    map: &WarehouseMap,
    ways: &BlockedWays,
    gone: &[GoneGoods],
    names: Option<&Warehouse>,
) -> String {
    let name = |id| {
        let products = names.map_or(&[][..], |names| &names.products);
        let product = products.iter().find(|product| product.id == id);
        product.and_then(|product| product.name.as_deref())
    };
    let WarehouseMap {
        width,
        height,
        delivery_x,
        delivery_y,
        side_length_cm,
        ..
    } = map;
    let mut text = format!(
        "{width} x {height} squares of {side_length_cm} cm; delivery at ({delivery_x}, {delivery_y})"
    );
    // Writing to a String cannot fail.
    for product in map.products() {
        let side = side(product.side);
        let (id, x, y) = (product.id, product.x, product.y);
        let name = name(id).map_or(String::new(), |name| format!(" ({name})"));
        let gone = gone.iter().find(|gone| gone.product == id);
        let gone = match gone.map(|gone| gone.why.get()) {
            None => "",
            Some(Some(GoneWhy::Delivered)) => "; it was delivered",
            Some(Some(GoneWhy::PickedUp)) => "; the robot has picked it up",
            Some(_) => "; it is not there",
        };
        let _ = write!(
            text,
            "\ngoods {id}{name}: at the {side} of square ({x}, {y}){gone}"
        );
    }
    for way in ways.ways() {
        let leads = leads(way.heading);
        let who = match way.source.get() {
            Some(BlockSource::Person) => "a person says so",
            _ => "the robot has seen it",
        };
        let (x, y) = (way.x, way.y);
        let _ = write!(text, "\nblocked: from ({x}, {y}) {leads}; {who}");
    }
    if ways.ways().is_empty() {
        text.push_str("\nno way is blocked");
    }
    text
}

fn side(side: Tag<Heading>) -> &'static str {
    match side.get() {
        Some(Heading::Left) => "left",
        Some(Heading::Up) => "upper side",
        Some(Heading::Right) => "right",
        Some(Heading::Down) => "lower side",
        None => "unknown side",
    }
}

fn leads(heading: Tag<Heading>) -> &'static str {
    match heading.get() {
        Some(Heading::Left) => "to the left",
        Some(Heading::Up) => "upwards",
        Some(Heading::Right) => "to the right",
        Some(Heading::Down) => "downwards",
        None => "somewhere",
    }
}

#[cfg(test)]
mod tests {
    use lager_topics::{BlockedWay, MapProduct};

    use super::*;

    #[test]
    fn goods_and_blocked_ways_stand_in_lines_of_their_own() {
        let mut map = WarehouseMap {
            width: 2,
            height: 1,
            side_length_cm: 50,
            product_count: 1,
            ..WarehouseMap::default()
        };
        map.products[0] = MapProduct {
            id: 7,
            x: 1,
            side: Heading::Up.into(),
            ..MapProduct::default()
        };
        let floor = "2 x 1 squares of 50 cm; delivery at (0, 0)\n\
                     goods 7: at the upper side of square (1, 0)\n";
        let mut ways = BlockedWays::default();
        let told = described(&map, &ways, &[], None);
        assert_eq!(told, format!("{floor}no way is blocked"));
        let gone = GoneGoods {
            product: 7,
            why: GoneWhy::Delivered.into(),
            ..GoneGoods::default()
        };
        let told = described(&map, &ways, &[gone], None);
        assert!(told.contains("square (1, 0); it was delivered\n"), "{told}");
        let names = "size = [2, 1]\nside_length_cm = 50\n[[product]]\nid = 7\nname = \"screws\"\n\
                     square = [1, 0]\nside = \"up\"";
        let names: Warehouse = toml::from_str(names).expect("a warehouse");
        let told = described(&map, &ways, &[], Some(&names));
        assert!(told.contains("\ngoods 7 (screws): at"), "{told}");
        ways.count = 1;
        ways.ways[0] = BlockedWay {
            x: 2,
            heading: Heading::Left.into(),
            source: BlockSource::Person.into(),
            ..BlockedWay::default()
        };
        let told = described(&map, &ways, &[], None);
        assert_eq!(
            told,
            format!("{floor}blocked: from (2, 0) to the left; a person says so")
        );
    }
}
