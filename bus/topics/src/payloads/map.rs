//! [`WarehouseMap`]: the floor as samples carry it, on `nav/map`. [`lager_floor`] checks floors.

use lager_floor::{FloorError, Grid, Heading, Node, Product, ProductId, SideLength};

use lager_sample::{Tag, payload};

payload! {
    /// One place where a product is picked.
    pub struct MapProduct: 8 bytes {
        /// The product's number.
        pub id: i32,
        /// Column of its square, from 0.
        pub x: u8,
        /// Row of its square, from 0 at the bottom.
        pub y: u8,
        /// The side of the square at which it stands.
        pub side: Tag<Heading>,
        /// Always 0.
        #[serde(skip)]
        pub reserved: u8,
    }
}

impl MapProduct {
    /// The product; `None` if it has a negative number or no side.
    pub fn get(&self) -> Option<Product> {
        Some(Product {
            id: ProductId::new(self.id)?,
            square: Node::new(self.x, self.y),
            side: self.side.get()?,
        })
    }
}

impl From<&Product> for MapProduct {
    fn from(product: &Product) -> Self {
        Self {
            id: product.id.get(),
            x: product.square.x,
            y: product.square.y,
            side: product.side.into(),
            ..Self::default()
        }
    }
}

payload! {
    /// The warehouse as the external computer describes it (M1-M3).
    pub struct WarehouseMap: 2056 bytes {
        /// Squares from left to right.
        pub width: u8,
        /// Squares from bottom to top.
        pub height: u8,
        /// Node of the delivery corner.
        pub delivery_x: u8,
        /// Node of the delivery corner.
        pub delivery_y: u8,
        /// Side of a square in cm; 0 = not known yet.
        pub side_length_cm: u16,
        /// How many of `products` are used.
        pub product_count: u16,
        /// The pick stations.
        #[serde(with = "lager_sample::list")]
        pub products: [MapProduct; 256],
    }
}

impl WarehouseMap {
    /// The map of a floor, with as many of the products as it has room for.
    pub fn new(side: SideLength, grid: Grid, products: &[Product]) -> Self {
        let mut map = Self {
            width: grid.size().x,
            height: grid.size().y,
            delivery_x: grid.delivery().x,
            delivery_y: grid.delivery().y,
            side_length_cm: side.cm(),
            ..Self::default()
        };
        for (place, product) in map.products.iter_mut().zip(products) {
            *place = product.into();
            map.product_count += 1;
        }
        map
    }

    /// The floor that this map describes.
    ///
    /// # Errors
    /// No floor can be like this.
    pub fn grid(&self) -> Result<Grid, FloorError> {
        let node = Node::new;
        Grid::new(
            node(self.width, self.height),
            node(self.delivery_x, self.delivery_y),
        )
    }

    /// The products in use.
    pub fn products(&self) -> &[MapProduct] {
        &self.products[..usize::from(self.product_count).min(self.products.len())]
    }
}
