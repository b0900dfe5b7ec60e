//! `thinks`: the `thought` that follows it, in values, for whoever says it in another language.
//!
//! ```text
//! thinks kind=node_passed node=2,1 seen=3
//! thought Crossing (2, 1), 3 to go.
//! ```

use lager_floor::{Heading, Node, ProductId};

use super::fields::fields;
use crate::text::Name;

fields! {
    /// A thought in values. `None` is not part of it.
    pub struct Thinks {
        /// What is thought, by the names of `log/thought`, such as `node_passed`.
        kind: Name = "a name of 1 to 32 of a-z, 0-9, - and _",
        /// The node it is about.
        node: Node = "a node such as 2,1",
        /// The direction it is about.
        looks: Heading = "left, up, right or down",
        /// The joint of the arm it is about, such as `elbow`.
        joint: Name = "a name of 1 to 32 of a-z, 0-9, - and _",
        /// The sides of a mark: bit 0 is left, bit 1 right.
        sides: u8 = "a number from 0 to 255",
        /// The product it is about.
        product: ProductId = "a product's number from 0 to 2147483647",
        /// What was expected, as the kind means it.
        expected: i32 = "a number from -2147483648 to 2147483647",
        /// What was seen, likewise.
        seen: i32 = "a number from -2147483648 to 2147483647",
        /// What is wrong, by the names of `nav/status`, such as `line_lost`.
        failure: Name = "a name of 1 to 32 of a-z, 0-9, - and _",
        /// The node near which that is.
        failure_node: Node = "a node such as 2,1",
        /// What was expected, as the failure means it.
        failure_expected: i32 = "a number from -2147483648 to 2147483647",
        /// What was seen, likewise.
        failure_seen: i32 = "a number from -2147483648 to 2147483647",
        /// What would end it, likewise, such as `reset`.
        remedy: Name = "a name of 1 to 32 of a-z, 0-9, - and _",
    }
}
