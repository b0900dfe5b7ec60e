//! [`Place`]: a node with a heading.

use core::fmt;
use core::str::FromStr;

use crate::heading::Heading;
use crate::node::Node;

/// A node and a heading: where a robot stands and looks, or a way that leaves the node.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Place {
    /// The node.
    pub node: Node,
    /// Where the robot looks, or where the way leads.
    pub heading: Heading,
}

impl Place {
    /// The place at this node, along `heading`.
    pub const fn new(node: Node, heading: Heading) -> Self {
        Self { node, heading }
    }
}

impl fmt::Display for Place {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}, looking {}", self.node, self.heading)
    }
}

/// The text names no place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PlaceError;

impl fmt::Display for PlaceError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("this is no place; write X,Y and up, down, left or right, as in 2,1,up")
    }
}

impl core::error::Error for PlaceError {}

impl FromStr for Place {
    type Err = PlaceError;

    /// Reads a place as a person types it, such as `2,1,up`.
    fn from_str(text: &str) -> Result<Self, PlaceError> {
        let mut parts = text.split(',').map(str::trim);
        let mut part = || parts.next().ok_or(PlaceError);
        let x = part()?.parse().map_err(|_| PlaceError)?;
        let y = part()?.parse().map_err(|_| PlaceError)?;
        let heading = Heading::from_word(part()?).ok_or(PlaceError)?;
        match parts.next() {
            None => Ok(Self::new(Node::new(x, y), heading)),
            Some(_) => Err(PlaceError),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_is_read_as_people_type_it() {
        let place = Place::new(Node::new(2, 1), Heading::Up);
        assert_eq!("2, 1,up".parse(), Ok(place));
        assert_eq!(place.to_string(), "(2, 1), looking up");
        for text in ["", "2,1", "2,1,north", "2,256,up", "2,1,up,up", "2 1 up"] {
            assert_eq!(text.parse::<Place>(), Err(PlaceError), "{text}");
        }
    }
}
