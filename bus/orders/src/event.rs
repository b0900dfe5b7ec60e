//! [`EventKind`]: what happens on a mission. In the table, the name of its sentence is `event_` and
//! its word.

/// What happened on a mission (C8).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum EventKind {
    /// The robot stands at the goods.
    InPosition = 0,
    /// The robot is on its way to the goods.
    GettingItem = 1,
    /// The goods lie at the place of delivery.
    ItemDelivered = 2,
    /// On the bus: the robot passed a node. On a line: it goes to a node.
    NextNode = 3,
    /// The order cannot be carried out.
    Refused = 4,
    /// The goods are not felt in the gripper, so the robot does not leave.
    PickupRefused = 5,
    /// The robot cannot go on with its work; on the bus, `failure` says why and what would end it.
    Failed = 6,
    /// The robot has found the way from the node in a direction blocked (L6).
    WayBlocked = 7,
}

#[cfg(feature = "lager-sample")]
lager_sample::coded_as_is!(EventKind {
    InPosition,
    GettingItem,
    ItemDelivered,
    NextNode,
    Refused,
    PickupRefused,
    Failed,
    WayBlocked,
});

impl EventKind {
    /// Every kind.
    pub const ALL: [Self; 8] = [
        Self::InPosition,
        Self::GettingItem,
        Self::ItemDelivered,
        Self::NextNode,
        Self::Refused,
        Self::PickupRefused,
        Self::Failed,
        Self::WayBlocked,
    ];

    /// Its word, in a line and in the name of its sentence.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::InPosition => "in_position",
            Self::GettingItem => "getting_item",
            Self::ItemDelivered => "item_delivered",
            Self::NextNode => "next_node",
            Self::Refused => "refused",
            Self::PickupRefused => "pickup_refused",
            Self::Failed => "failed",
            Self::WayBlocked => "way_blocked",
        }
    }
}
