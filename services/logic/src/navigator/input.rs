//! What the navigator is told.

use lager_topics::{BlockSource, Heading, Mode, Order, Pick, SteeringReport, WarehouseMap};
use lager_wire::LineState;

use crate::node::Node;

/// One thing that the navigator is told.
#[derive(Clone, Copy, Debug)]
pub enum Input<'a> {
    /// A line frame has come.
    Line(LineState),
    /// A distance frame has come: cm to what is in front, 255 = nothing seen.
    Distance(u8),
    /// The steering board has reported.
    Steering(&'a SteeringReport),
    /// The warehouse is known, or known anew.
    Map(&'a WarehouseMap),
    /// A product is to be fetched.
    Order(&'a Order),
    /// The order with this number, which waits or whose goods are not held yet, is not to be
    /// carried out.
    Cancel(u32),
    /// The waiting order with this number is to change places with the one before it.
    MoveUp(u32),
    /// No waiting order is to be carried out.
    ClearQueue,
    /// The goods of this product are not in their place.
    GoodsGone(i32),
    /// They are there again; `None` = all goods.
    GoodsBack(Option<i32>),
    /// The operator has the goods in the gripper; 0 = whatever order it is.
    PickupDone {
        /// The order the operator worked for.
        order_id: u32,
        /// Whether the operator is believed although the claw does not feel the goods.
        forced: bool,
    },
    /// Who picks the goods up from now on.
    Pick(Pick),
    /// What the wheels have turned in manual mode, as the bridge sums it: duty × µs of both motors.
    DrivenByHand(u64),
    /// The robot has been put on the delivery node, looking into the warehouse (AMB-50).
    Reset,
    /// The robot has been put on a node.
    Placed {
        /// The node.
        node: Node,
        /// Where it looks.
        heading: Heading,
    },
    /// A way between two nodes is blocked, or open again.
    Way {
        /// A node at one end of it.
        node: Node,
        /// Where it leads from there.
        heading: Heading,
        /// Whether it is open.
        open: bool,
        /// Who says so.
        source: BlockSource,
    },
    /// Whether the robot is to stand at the next node, since the external computer is out of reach.
    Link {
        /// It is.
        lost: bool,
    },
    /// Who may drive, and whether a stop is latched, as the bridge has it.
    Mode {
        /// Who may drive.
        mode: Mode,
        /// A stop is latched.
        stopped: bool,
    },
    /// Nothing but time has passed.
    Tick,
}
