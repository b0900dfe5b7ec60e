"""The topics' layouts. Made by `lager topic schema --python bus/python/lagerrobot`."""

import ctypes
import enum

from ._layout import Layout, Qos, TopicEntry


class LineState(enum.IntEnum):
    OnLine = 0
    NotOnLine = 1
    LeftOfLine = 2
    RightOfLine = 3
    StationToLeft = 4
    StationToRight = 5
    FourWay = 6
    DropStation = 7


class Origin(enum.IntEnum):
    Logic = 0
    Operator = 1


class Finish(enum.IntEnum):
    None_ = 0
    Done = 1
    Aborted = 2
    Refused = 3
    NoWord = 4
    NoTape = 5


class ResetCause(enum.IntEnum):
    Unknown = 0
    PowerOn = 1
    External = 2
    BrownOut = 3
    Watchdog = 4
    Panic = 5
    Jtag = 6
    Ordered = 7


class Mode(enum.IntEnum):
    Manual = 0
    Autonomous = 1


class Refusal(enum.IntEnum):
    None_ = 0
    Undefined = 1
    LogicOnly = 2
    ArmLocked = 3
    CodeChanged = 4
    NotInCharge = 5
    StopLatched = 6
    ShuttingDown = 7
    NoBoard = 8
    BoardSilent = 9
    OriginalBoard = 10
    Stale = 11
    ArmUnlimited = 12
    FullSpeedOnly = 13
    Undescribed = 14


class ProfileState(enum.IntEnum):
    NoBoard = 0
    Telling = 1
    Accepted = 2
    Refused = 3
    Unanswered = 4


class Calibration(enum.IntEnum):
    Never = 0
    Running = 1
    Done = 2
    Partly = 3
    BrokenOff = 4


class StopCause(enum.IntEnum):
    None_ = 0
    Ordered = 1
    FreshStart = 2
    StateLost = 3
    BoardResets = 4
    WordRemoved = 5
    WordDamaged = 6
    BoardWork = 7


class Role(enum.IntEnum):
    Bridge = 0
    Logic = 1
    Comm = 2
    Station = 3
    Recorder = 4
    Monitor = 5
    Gateway = 6
    Simulator = 7
    Supervisor = 8
    Operator = 9
    Observer = 10
    Guest = 11


class FailureKind(enum.IntEnum):
    None_ = 0
    LineLost = 1
    NodeMissing = 2
    BarMissing = 3
    StationMissing = 4
    NoWay = 5
    BoardRefuses = 6
    DrivenByHand = 7
    OffTheMap = 8
    StateLost = 9
    NoMap = 10
    UnknownProduct = 11
    NeedsReset = 12
    QueueFull = 13
    PutDown = 14
    ClawUnheard = 15
    ClawEmpty = 16
    ClawSlack = 17
    ArmJammed = 18
    GoodsMissing = 19
    MapEmpty = 20
    MapTooLarge = 21
    DeliveryOffCorner = 22
    SideUnknown = 23
    SideWrong = 24
    TooManyProducts = 25
    ProductOutside = 26
    ProductTwice = 27
    Unreachable = 28
    MarkUnseen = 29
    CornerUnseen = 30
    LineUnseen = 31
    AlreadyOrdered = 32
    GoodsDelivered = 33
    GoodsAway = 34
    ServoSilent = 35


class Remedy(enum.IntEnum):
    None_ = 0
    Reset = 1
    Way = 2
    Map = 3
    Later = 4
    Hand = 5
    Light = 6
    Report = 7
    Arm = 8
    Charge = 9
    Resume = 10
    Mode = 11
    Link = 12
    Calibrate = 13
    PutBack = 14
    Describe = 15


class Phase(enum.IntEnum):
    WaitingForMap = 0
    WaitingForOrder = 1
    Driving = 2
    Turning = 3
    Approaching = 4
    Positioning = 5
    Picking = 6
    Leaving = 7
    Exiting = 8
    Dropping = 9
    BackingOff = 10
    TurningRound = 11
    Returning = 12
    Stuck = 13
    Lost = 14
    Looking = 15
    Halted = 16
    TurningBack = 17


class Step(enum.IntEnum):
    Seeking = 0
    ToStation = 1
    ToNode = 2
    AtBar = 3
    NearNode = 4


class Heading(enum.IntEnum):
    Left = 0
    Up = 1
    Right = 2
    Down = 3


class Goal(enum.IntEnum):
    None_ = 0
    Product = 1
    Delivery = 2
    Home = 3


class Hold(enum.IntEnum):
    None_ = 0
    Blind = 1
    Unheard = 2
    Arm = 3
    Battery = 4
    Link = 5
    Undescribed = 6


class Pick(enum.IntEnum):
    Manual = 0
    Auto = 1


class BlockSource(enum.IntEnum):
    Sensor = 0
    Person = 1


class TextKind(enum.IntEnum):
    None_ = 0
    Began = 1
    Map = 2


class NavigatorInputKind(enum.IntEnum):
    None_ = 0
    Tick = 1
    Line = 2
    Distance = 3
    Steering = 4
    Map = 5
    Order = 6
    Operator = 7
    DrivenByHand = 8
    Mode = 9
    Renewed = 10
    Repeated = 11


class InputKind(enum.IntEnum):
    PickupDone = 0
    ResetPressed = 1
    Placed = 2
    PickupForced = 3
    OrderCancelled = 4
    OrderMovedUp = 5
    QueueCleared = 6
    LinkLost = 7
    LinkBack = 8
    SwitchedToManual = 9
    SwitchedToAutonomous = 10
    PickByHand = 11
    PickByItself = 12
    GoodsGone = 13
    GoodsBack = 14
    Horn = 15
    WayBlocked = 16
    WayOpened = 17
    GoodsGoneEarlier = 18
    StartPressed = 19


class GoneWhy(enum.IntEnum):
    Delivered = 0
    PickedUp = 1
    NotFound = 2
    Told = 3
    EarlierRun = 4


class EventKind(enum.IntEnum):
    InPosition = 0
    GettingItem = 1
    ItemDelivered = 2
    NextNode = 3
    Refused = 4
    PickupRefused = 5
    Failed = 6
    WayBlocked = 7


class ThoughtKind(enum.IntEnum):
    None_ = 0
    MapTaken = 1
    MapRefused = 2
    MapKept = 3
    MapChanged = 4
    NoSuchNode = 5
    PutAtStart = 6
    PutDown = 7
    MovesAlone = 8
    WayBlocked = 9
    WayOpen = 10
    OrderWaits = 11
    OrderWaitsForCharge = 12
    OrderRefused = 13
    Fetching = 14
    Picking = 15
    AwaitsPickup = 16
    PickupRefused = 17
    HasGoods = 18
    Delivered = 19
    BoardUnheard = 20
    BoardHeard = 21
    Blind = 22
    SeesAgain = 23
    BatteryLow = 24
    BatteryCharged = 25
    Parked = 26
    JointUnheard = 27
    JointOff = 28
    ArmCarried = 29
    NodePassed = 30
    TurnsLeft = 31
    TurnsRight = 32
    SeeksStation = 33
    LeavesToDeliver = 34
    IsBack = 35
    AtBar = 36
    StationSeen = 37
    StationMissed = 38
    MarkUnexpected = 39
    MarkOnWayOut = 40
    CrossingOnWayOut = 41
    TurnDisturbed = 42
    PlaceCorrected = 43
    Failed = 44
    Halts = 45
    TriesAgain = 46
    OrderPutOff = 47
    OrderCancelled = 48
    OrderMovedUp = 49
    QueueCleared = 50
    StationPassed = 51
    LinkLost = 52
    LinkBack = 53
    ParkedWithoutLink = 54
    CornerMissed = 55
    PicksByHand = 56
    PicksByItself = 57
    OrderKept = 58
    GoodsBack = 59
    AllGoodsBack = 60
    GoodsGone = 61
    Honks = 62
    StartedByReset = 63
    ResetKeepsStop = 64
    ResetUnheard = 65
    ResetWithoutMap = 66
    ResetElsewhere = 67
    SetUpInTerminal = 68
    SetUpAtPage = 69


class Joint(enum.IntEnum):
    Base = 0
    Shoulder = 1
    Elbow = 2
    Wrist = 3


class GoodState(enum.IntEnum):
    Shelf = 0
    Held = 1
    Lying = 2
    Delivered = 3


class Stamp(Layout):
    _type_name_ = "lager::Stamp"
    _hash_ = 0x25797021E1D5DCAC
    _fields_ = [
        ("sequence", ctypes.c_uint64),
        ("source_time_ns", ctypes.c_uint64),
        ("cause_publish_time_ns", ctypes.c_uint64),
        ("cause_receive_time_ns", ctypes.c_uint64),
        ("publish_time_ns", ctypes.c_uint64),
        ("epoch", ctypes.c_uint64),
        ("writer", ctypes.c_uint32),
        ("cause_topic", ctypes.c_uint32),
    ]
    _enums_ = {}
    _dtype_ = {
        "names": ["sequence", "source_time_ns", "cause_publish_time_ns", "cause_receive_time_ns", "publish_time_ns", "epoch", "writer", "cause_topic"],
        "formats": ["<u8", "<u8", "<u8", "<u8", "<u8", "<u8", "<u4", "<u4"],
        "offsets": [0, 8, 16, 24, 32, 40, 48, 52],
        "itemsize": 56,
    }


class LineFrame(Layout):
    _type_name_ = "lager::LineFrame"
    _hash_ = 0x1B6A7D9A172598EA
    _fields_ = [
        ("link_epoch", ctypes.c_uint32),
        ("bits", ctypes.c_uint16),
        ("state", ctypes.c_uint8),
        ("packet_id", ctypes.c_uint8),
    ]
    _enums_ = {"state": LineState}
    _dtype_ = {
        "names": ["link_epoch", "bits", "state", "packet_id"],
        "formats": ["<u4", "<u2", "<u1", "<u1"],
        "offsets": [0, 4, 6, 7],
        "itemsize": 8,
    }


class DistanceFrame(Layout):
    _type_name_ = "lager::DistanceFrame"
    _hash_ = 0x03D04F7BFCA491AB
    _fields_ = [
        ("link_epoch", ctypes.c_uint32),
        ("distance_cm", ctypes.c_uint8),
        ("packet_id", ctypes.c_uint8),
        ("reserved", ctypes.c_uint8 * 2),
    ]
    _enums_ = {}
    _dtype_ = {
        "names": ["link_epoch", "distance_cm", "packet_id", "reserved"],
        "formats": ["<u4", "<u1", "<u1", ("<u1", (2,))],
        "offsets": [0, 4, 5, 6],
        "itemsize": 8,
    }


class SteeringOrder(Layout):
    _type_name_ = "lager::SteeringOrder"
    _hash_ = 0x122D28744FFF6E82
    _fields_ = [
        ("given_ns", ctypes.c_uint64),
        ("id", ctypes.c_uint32),
        ("origin", ctypes.c_uint8),
        ("code", ctypes.c_uint8),
        ("arm_granted", ctypes.c_uint8),
        ("reserved", ctypes.c_uint8),
    ]
    _enums_ = {"origin": Origin}
    _dtype_ = {
        "names": ["given_ns", "id", "origin", "code", "arm_granted", "reserved"],
        "formats": ["<u8", "<u4", "<u1", "<u1", "<u1", "<u1"],
        "offsets": [0, 8, 12, 13, 14, 15],
        "itemsize": 16,
    }


class SteeringReport(Layout):
    _type_name_ = "lager::SteeringReport"
    _hash_ = 0xADA4603A40EBD67D
    _fields_ = [
        ("link_epoch", ctypes.c_uint32),
        ("finished_id", ctypes.c_uint32),
        ("current_id", ctypes.c_uint32),
        ("finished_origin", ctypes.c_uint8),
        ("current_origin", ctypes.c_uint8),
        ("finish", ctypes.c_uint8),
        ("code", ctypes.c_uint8),
        ("left_duty", ctypes.c_uint8),
        ("right_duty", ctypes.c_uint8),
        ("flags", ctypes.c_uint8),
        ("line_error", ctypes.c_int8),
        ("servo_errors", ctypes.c_uint8),
        ("battery_decivolts", ctypes.c_uint8),
        ("age_ms", ctypes.c_uint16),
        ("servo_position", ctypes.c_uint16 * 8),
        ("servo_load", ctypes.c_int16 * 8),
    ]
    _enums_ = {"finished_origin": Origin, "current_origin": Origin, "finish": Finish}
    _dtype_ = {
        "names": ["link_epoch", "finished_id", "current_id", "finished_origin", "current_origin", "finish", "code", "left_duty", "right_duty", "flags", "line_error", "servo_errors", "battery_decivolts", "age_ms", "servo_position", "servo_load"],
        "formats": ["<u4", "<u4", "<u4", "<u1", "<u1", "<u1", "<u1", "<u1", "<u1", "<u1", "<i1", "<u1", "<u1", "<u2", ("<u2", (8,)), ("<i2", (8,))],
        "offsets": [0, 4, 8, 12, 13, 14, 15, 16, 17, 18, 19, 20, 21, 22, 24, 40],
        "itemsize": 56,
    }


class BoardHealth(Layout):
    _type_name_ = "lager::BoardHealth"
    _hash_ = 0xA7A4970AA1065E8A
    _fields_ = [
        ("epoch", ctypes.c_uint32),
        ("packets", ctypes.c_uint32),
        ("lost", ctypes.c_uint32),
        ("lost_total", ctypes.c_uint32),
        ("bad_crc", ctypes.c_uint32),
        ("skipped_bytes", ctypes.c_uint32),
        ("reboots", ctypes.c_uint32),
        ("baud", ctypes.c_uint32),
        ("up", ctypes.c_uint8),
        ("version", ctypes.c_uint8),
        ("reset_cause", ctypes.c_uint8),
        ("port", ctypes.c_uint8),
        ("build", ctypes.c_uint16),
        ("board_bad_packets", ctypes.c_uint8),
        ("board_lost", ctypes.c_uint8),
        ("board_refused", ctypes.c_uint8),
        ("board_exde_errors", ctypes.c_uint8),
        ("board_servo_timeouts", ctypes.c_uint8),
        ("board_load_percent", ctypes.c_uint8),
        ("board_longest_loop_100us", ctypes.c_uint8),
        ("reserved", ctypes.c_uint8 * 3),
    ]
    _enums_ = {"reset_cause": ResetCause}
    _dtype_ = {
        "names": ["epoch", "packets", "lost", "lost_total", "bad_crc", "skipped_bytes", "reboots", "baud", "up", "version", "reset_cause", "port", "build", "board_bad_packets", "board_lost", "board_refused", "board_exde_errors", "board_servo_timeouts", "board_load_percent", "board_longest_loop_100us", "reserved"],
        "formats": ["<u4", "<u4", "<u4", "<u4", "<u4", "<u4", "<u4", "<u4", "<u1", "<u1", "<u1", "<u1", "<u2", "<u1", "<u1", "<u1", "<u1", "<u1", "<u1", "<u1", ("<u1", (3,))],
        "offsets": [0, 4, 8, 12, 16, 20, 24, 28, 32, 33, 34, 35, 36, 38, 39, 40, 41, 42, 43, 44, 45],
        "itemsize": 48,
    }


class CalibratedSensor(Layout):
    _type_name_ = "lager::CalibratedSensor"
    _hash_ = 0x420310DFA219233F
    _fields_ = [
        ("reading", ctypes.c_uint8),
        ("lowest", ctypes.c_uint8),
        ("highest", ctypes.c_uint8),
        ("tells_apart", ctypes.c_uint8),
    ]
    _enums_ = {}
    _dtype_ = {
        "names": ["reading", "lowest", "highest", "tells_apart"],
        "formats": ["<u1", "<u1", "<u1", "<u1"],
        "offsets": [0, 1, 2, 3],
        "itemsize": 4,
    }


class Health(Layout):
    _type_name_ = "lager::Health"
    _hash_ = 0x1DB4CBB74519AF63
    _fields_ = [
        ("sensor", BoardHealth),
        ("steering", BoardHealth),
        ("bus_lost", ctypes.c_uint64),
        ("driven_by_hand", ctypes.c_uint64),
        ("stopped_at_ns", ctypes.c_uint64),
        ("stop_word", ctypes.c_uint64),
        ("current_id", ctypes.c_uint32),
        ("finished_id", ctypes.c_uint32),
        ("orders_refused", ctypes.c_uint32),
        ("leases_expired", ctypes.c_uint32),
        ("refused_id", ctypes.c_uint32),
        ("next_lease_ms", ctypes.c_uint16),
        ("gain_p", ctypes.c_int16),
        ("gain_d", ctypes.c_int16),
        ("mode", ctypes.c_uint8),
        ("stopped", ctypes.c_uint8),
        ("current_origin", ctypes.c_uint8),
        ("finished_origin", ctypes.c_uint8),
        ("current_code", ctypes.c_uint8),
        ("wire_seq", ctypes.c_uint8),
        ("finish", ctypes.c_uint8),
        ("refused_origin", ctypes.c_uint8),
        ("refusal", ctypes.c_uint8),
        ("blocked", ctypes.c_uint8),
        ("arm_profile", ctypes.c_uint8),
        ("calibration", ctypes.c_uint8),
        ("calibrated_sensors", ctypes.c_uint8),
        ("calibrations_ended", ctypes.c_uint8),
        ("calibrated", CalibratedSensor * 11),
        ("stop_cause", ctypes.c_uint8),
        ("stop_origin", ctypes.c_uint8),
        ("mode_chosen", ctypes.c_uint8),
        ("steering_profile", ctypes.c_uint8),
        ("sensor_profile", ctypes.c_uint8),
        ("reserved", ctypes.c_uint8 * 3),
        ("description", ctypes.c_uint32),
    ]
    _enums_ = {"mode": Mode, "current_origin": Origin, "finished_origin": Origin, "finish": Finish, "refused_origin": Origin, "refusal": Refusal, "blocked": Refusal, "arm_profile": ProfileState, "calibration": Calibration, "stop_cause": StopCause, "stop_origin": Role, "steering_profile": ProfileState, "sensor_profile": ProfileState}
    _dtype_ = {
        "names": ["sensor", "steering", "bus_lost", "driven_by_hand", "stopped_at_ns", "stop_word", "current_id", "finished_id", "orders_refused", "leases_expired", "refused_id", "next_lease_ms", "gain_p", "gain_d", "mode", "stopped", "current_origin", "finished_origin", "current_code", "wire_seq", "finish", "refused_origin", "refusal", "blocked", "arm_profile", "calibration", "calibrated_sensors", "calibrations_ended", "calibrated", "stop_cause", "stop_origin", "mode_chosen", "steering_profile", "sensor_profile", "reserved", "description"],
        "formats": [BoardHealth._dtype_, BoardHealth._dtype_, "<u8", "<u8", "<u8", "<u8", "<u4", "<u4", "<u4", "<u4", "<u4", "<u2", "<i2", "<i2", "<u1", "<u1", "<u1", "<u1", "<u1", "<u1", "<u1", "<u1", "<u1", "<u1", "<u1", "<u1", "<u1", "<u1", (CalibratedSensor._dtype_, (11,)), "<u1", "<u1", "<u1", "<u1", "<u1", ("<u1", (3,)), "<u4"],
        "offsets": [0, 48, 96, 104, 112, 120, 128, 132, 136, 140, 144, 148, 150, 152, 154, 155, 156, 157, 158, 159, 160, 161, 162, 163, 164, 165, 166, 167, 168, 212, 213, 214, 215, 216, 217, 220],
        "itemsize": 224,
    }


class Failure(Layout):
    _type_name_ = "lager::Failure"
    _hash_ = 0xEE501BB4A04C1260
    _fields_ = [
        ("kind", ctypes.c_uint8),
        ("remedy", ctypes.c_uint8),
        ("x", ctypes.c_uint8),
        ("y", ctypes.c_uint8),
        ("expected", ctypes.c_int32),
        ("seen", ctypes.c_int32),
    ]
    _enums_ = {"kind": FailureKind, "remedy": Remedy}
    _dtype_ = {
        "names": ["kind", "remedy", "x", "y", "expected", "seen"],
        "formats": ["<u1", "<u1", "<u1", "<u1", "<i4", "<i4"],
        "offsets": [0, 1, 2, 3, 4, 8],
        "itemsize": 12,
    }


class NavigatorStatus(Layout):
    _type_name_ = "lager::NavigatorStatus"
    _hash_ = 0x5C9EF711BA07B334
    _fields_ = [
        ("frames_lost", ctypes.c_uint64),
        ("frames", ctypes.c_uint64),
        ("driven_by_hand", ctypes.c_uint64),
        ("order_id", ctypes.c_uint32),
        ("product", ctypes.c_int32),
        ("command_id", ctypes.c_uint32),
        ("delivered", ctypes.c_uint32),
        ("travelled_mm", ctypes.c_int32),
        ("exit_mm", ctypes.c_int32),
        ("failure", Failure),
        ("x", ctypes.c_int16),
        ("y", ctypes.c_int16),
        ("turned_deg", ctypes.c_int16),
        ("distance_age_ms", ctypes.c_uint16),
        ("phase", ctypes.c_uint8),
        ("step", ctypes.c_uint8),
        ("heading", ctypes.c_uint8),
        ("target", ctypes.c_uint8),
        ("goal", ctypes.c_uint8),
        ("mark", ctypes.c_uint8),
        ("code", ctypes.c_uint8),
        ("tries", ctypes.c_uint8),
        ("misses", ctypes.c_uint8),
        ("waiting", ctypes.c_uint8),
        ("distance_cm", ctypes.c_uint8),
        ("mode", ctypes.c_uint8),
        ("stopped", ctypes.c_uint8),
        ("hold", ctypes.c_uint8),
        ("forced", ctypes.c_uint8),
        ("doubt", ctypes.c_uint8),
        ("doubt_x", ctypes.c_uint8 * 3),
        ("doubt_y", ctypes.c_uint8 * 3),
        ("arm_attempt", ctypes.c_uint8),
        ("arm_moves", ctypes.c_uint8),
        ("remedy", ctypes.c_uint8),
        ("pick", ctypes.c_uint8),
        ("at_start", ctypes.c_uint8),
        ("reserved", ctypes.c_uint8),
    ]
    _enums_ = {"phase": Phase, "step": Step, "heading": Heading, "target": Heading, "goal": Goal, "mode": Mode, "hold": Hold, "remedy": Remedy, "pick": Pick}
    _dtype_ = {
        "names": ["frames_lost", "frames", "driven_by_hand", "order_id", "product", "command_id", "delivered", "travelled_mm", "exit_mm", "failure", "x", "y", "turned_deg", "distance_age_ms", "phase", "step", "heading", "target", "goal", "mark", "code", "tries", "misses", "waiting", "distance_cm", "mode", "stopped", "hold", "forced", "doubt", "doubt_x", "doubt_y", "arm_attempt", "arm_moves", "remedy", "pick", "at_start", "reserved"],
        "formats": ["<u8", "<u8", "<u8", "<u4", "<i4", "<u4", "<u4", "<i4", "<i4", Failure._dtype_, "<i2", "<i2", "<i2", "<u2", "<u1", "<u1", "<u1", "<u1", "<u1", "<u1", "<u1", "<u1", "<u1", "<u1", "<u1", "<u1", "<u1", "<u1", "<u1", "<u1", ("<u1", (3,)), ("<u1", (3,)), "<u1", "<u1", "<u1", "<u1", "<u1", "<u1"],
        "offsets": [0, 8, 16, 24, 28, 32, 36, 40, 44, 48, 60, 62, 64, 66, 68, 69, 70, 71, 72, 73, 74, 75, 76, 77, 78, 79, 80, 81, 82, 83, 84, 87, 90, 91, 92, 93, 94, 95],
        "itemsize": 96,
    }


class MapProduct(Layout):
    _type_name_ = "lager::MapProduct"
    _hash_ = 0x8E50683A44F0B502
    _fields_ = [
        ("id", ctypes.c_int32),
        ("x", ctypes.c_uint8),
        ("y", ctypes.c_uint8),
        ("side", ctypes.c_uint8),
        ("reserved", ctypes.c_uint8),
    ]
    _enums_ = {"side": Heading}
    _dtype_ = {
        "names": ["id", "x", "y", "side", "reserved"],
        "formats": ["<i4", "<u1", "<u1", "<u1", "<u1"],
        "offsets": [0, 4, 5, 6, 7],
        "itemsize": 8,
    }


class WarehouseMap(Layout):
    _type_name_ = "lager::WarehouseMap"
    _hash_ = 0x2678B45F9D728754
    _fields_ = [
        ("width", ctypes.c_uint8),
        ("height", ctypes.c_uint8),
        ("delivery_x", ctypes.c_uint8),
        ("delivery_y", ctypes.c_uint8),
        ("side_length_cm", ctypes.c_uint16),
        ("product_count", ctypes.c_uint16),
        ("products", MapProduct * 256),
    ]
    _enums_ = {}
    _dtype_ = {
        "names": ["width", "height", "delivery_x", "delivery_y", "side_length_cm", "product_count", "products"],
        "formats": ["<u1", "<u1", "<u1", "<u1", "<u2", "<u2", (MapProduct._dtype_, (256,))],
        "offsets": [0, 1, 2, 3, 4, 6, 8],
        "itemsize": 2056,
    }


class RouteNode(Layout):
    _type_name_ = "lager::RouteNode"
    _hash_ = 0xF408032183BCD3DC
    _fields_ = [
        ("x", ctypes.c_uint8),
        ("y", ctypes.c_uint8),
    ]
    _enums_ = {}
    _dtype_ = {
        "names": ["x", "y"],
        "formats": ["<u1", "<u1"],
        "offsets": [0, 1],
        "itemsize": 2,
    }


class Route(Layout):
    _type_name_ = "lager::Route"
    _hash_ = 0xF152DAD0CB7B31CC
    _fields_ = [
        ("length", ctypes.c_uint16),
        ("reserved", ctypes.c_uint16),
        ("nodes", RouteNode * 512),
    ]
    _enums_ = {}
    _dtype_ = {
        "names": ["length", "reserved", "nodes"],
        "formats": ["<u2", "<u2", (RouteNode._dtype_, (512,))],
        "offsets": [0, 2, 4],
        "itemsize": 1028,
    }


class BlockedWay(Layout):
    _type_name_ = "lager::BlockedWay"
    _hash_ = 0x77ED8DC17DE94CA5
    _fields_ = [
        ("since_ns", ctypes.c_uint64),
        ("x", ctypes.c_uint8),
        ("y", ctypes.c_uint8),
        ("heading", ctypes.c_uint8),
        ("source", ctypes.c_uint8),
        ("reserved", ctypes.c_uint8 * 4),
    ]
    _enums_ = {"heading": Heading, "source": BlockSource}
    _dtype_ = {
        "names": ["since_ns", "x", "y", "heading", "source", "reserved"],
        "formats": ["<u8", "<u1", "<u1", "<u1", "<u1", ("<u1", (4,))],
        "offsets": [0, 8, 9, 10, 11, 12],
        "itemsize": 16,
    }


class BlockedWays(Layout):
    _type_name_ = "lager::BlockedWays"
    _hash_ = 0xE63D86F24D73565D
    _fields_ = [
        ("width", ctypes.c_uint8),
        ("height", ctypes.c_uint8),
        ("tries", ctypes.c_uint8),
        ("count", ctypes.c_uint8),
        ("reserved", ctypes.c_uint8 * 4),
        ("ways", BlockedWay * 64),
    ]
    _enums_ = {}
    _dtype_ = {
        "names": ["width", "height", "tries", "count", "reserved", "ways"],
        "formats": ["<u1", "<u1", "<u1", "<u1", ("<u1", (4,)), (BlockedWay._dtype_, (64,))],
        "offsets": [0, 1, 2, 3, 4, 8],
        "itemsize": 1032,
    }


class Sent(Layout):
    _type_name_ = "lager::Sent"
    _hash_ = 0xB8DFE9E40065892D
    _fields_ = [
        ("epoch", ctypes.c_uint64),
        ("next", ctypes.c_uint64),
    ]
    _enums_ = {}
    _dtype_ = {
        "names": ["epoch", "next"],
        "formats": ["<u8", "<u8"],
        "offsets": [0, 8],
        "itemsize": 16,
    }


class NavigatorInput(Layout):
    _type_name_ = "lager::NavigatorInput"
    _hash_ = 0x131E0E170D2EC01C
    _fields_ = [
        ("time_ns", ctypes.c_uint64),
        ("number", ctypes.c_uint64),
        ("proof", ctypes.c_uint32),
        ("command_id", ctypes.c_uint32),
        ("kind", ctypes.c_uint8),
        ("value", ctypes.c_uint8),
        ("flag", ctypes.c_uint8),
        ("code", ctypes.c_uint8),
        ("arm_granted", ctypes.c_uint8),
        ("reserved", ctypes.c_uint8 * 3),
    ]
    _enums_ = {"kind": NavigatorInputKind}
    _dtype_ = {
        "names": ["time_ns", "number", "proof", "command_id", "kind", "value", "flag", "code", "arm_granted", "reserved"],
        "formats": ["<u8", "<u8", "<u4", "<u4", "<u1", "<u1", "<u1", "<u1", "<u1", ("<u1", (3,))],
        "offsets": [0, 8, 16, 20, 24, 25, 26, 27, 28, 29],
        "itemsize": 32,
    }


class Order(Layout):
    _type_name_ = "lager::Order"
    _hash_ = 0xC03E5A56CC1C0602
    _fields_ = [
        ("id", ctypes.c_uint32),
        ("product", ctypes.c_int32),
    ]
    _enums_ = {}
    _dtype_ = {
        "names": ["id", "product"],
        "formats": ["<u4", "<i4"],
        "offsets": [0, 4],
        "itemsize": 8,
    }


class Input(Layout):
    _type_name_ = "lager::Input"
    _hash_ = 0xF9BE022D27A76723
    _fields_ = [
        ("kind", ctypes.c_uint8),
        ("x", ctypes.c_uint8),
        ("y", ctypes.c_uint8),
        ("heading", ctypes.c_uint8),
        ("order_id", ctypes.c_uint32),
        ("id", ctypes.c_uint32),
    ]
    _enums_ = {"kind": InputKind, "heading": Heading}
    _dtype_ = {
        "names": ["kind", "x", "y", "heading", "order_id", "id"],
        "formats": ["<u1", "<u1", "<u1", "<u1", "<u4", "<u4"],
        "offsets": [0, 1, 2, 3, 4, 8],
        "itemsize": 12,
    }


class NavigatorInputs(Layout):
    _type_name_ = "lager::NavigatorInputs"
    _hash_ = 0xB3ED62C631044A15
    _fields_ = [
        ("first", ctypes.c_uint64),
        ("commands", Sent),
        ("statuses", Sent),
        ("events", Sent),
        ("text_left", ctypes.c_uint32),
        ("text_used", ctypes.c_uint16),
        ("text_kind", ctypes.c_uint8),
        ("entries_used", ctypes.c_uint8),
        ("reports_used", ctypes.c_uint8),
        ("orders_used", ctypes.c_uint8),
        ("operator_used", ctypes.c_uint8),
        ("reserved", ctypes.c_uint8 * 5),
        ("entries", NavigatorInput * 24),
        ("reports", SteeringReport * 8),
        ("orders", Order * 4),
        ("operator", Input * 4),
        ("text", ctypes.c_uint8 * 32 * 16),
    ]
    _enums_ = {"text_kind": TextKind}
    _dtype_ = {
        "names": ["first", "commands", "statuses", "events", "text_left", "text_used", "text_kind", "entries_used", "reports_used", "orders_used", "operator_used", "reserved", "entries", "reports", "orders", "operator", "text"],
        "formats": ["<u8", Sent._dtype_, Sent._dtype_, Sent._dtype_, "<u4", "<u2", "<u1", "<u1", "<u1", "<u1", "<u1", ("<u1", (5,)), (NavigatorInput._dtype_, (24,)), (SteeringReport._dtype_, (8,)), (Order._dtype_, (4,)), (Input._dtype_, (4,)), (("<u1", (32,)), (16,))],
        "offsets": [0, 8, 24, 40, 56, 60, 62, 63, 64, 65, 66, 67, 72, 840, 1288, 1320, 1368],
        "itemsize": 1880,
    }


class WaitingOrder(Layout):
    _type_name_ = "lager::WaitingOrder"
    _hash_ = 0x1D646255671AD69F
    _fields_ = [
        ("id", ctypes.c_uint32),
        ("product", ctypes.c_int32),
        ("put_off", ctypes.c_uint8),
        ("reserved", ctypes.c_uint8 * 3),
    ]
    _enums_ = {}
    _dtype_ = {
        "names": ["id", "product", "put_off", "reserved"],
        "formats": ["<u4", "<i4", "<u1", ("<u1", (3,))],
        "offsets": [0, 4, 8, 9],
        "itemsize": 12,
    }


class GoneGoods(Layout):
    _type_name_ = "lager::GoneGoods"
    _hash_ = 0xB9F54BEDE12E906B
    _fields_ = [
        ("product", ctypes.c_int32),
        ("since_s", ctypes.c_uint32),
        ("why", ctypes.c_uint8),
        ("reserved", ctypes.c_uint8 * 3),
    ]
    _enums_ = {"why": GoneWhy}
    _dtype_ = {
        "names": ["product", "since_s", "why", "reserved"],
        "formats": ["<i4", "<u4", "<u1", ("<u1", (3,))],
        "offsets": [0, 4, 8, 9],
        "itemsize": 12,
    }


class OrderQueue(Layout):
    _type_name_ = "lager::OrderQueue"
    _hash_ = 0x5F80D95FD3F6F69E
    _fields_ = [
        ("order_id", ctypes.c_uint32),
        ("product", ctypes.c_int32),
        ("under_way", ctypes.c_uint8),
        ("count", ctypes.c_uint8),
        ("gone_count", ctypes.c_uint8),
        ("reserved", ctypes.c_uint8),
        ("orders", WaitingOrder * 32),
        ("gone", GoneGoods * 96),
    ]
    _enums_ = {}
    _dtype_ = {
        "names": ["order_id", "product", "under_way", "count", "gone_count", "reserved", "orders", "gone"],
        "formats": ["<u4", "<i4", "<u1", "<u1", "<u1", "<u1", (WaitingOrder._dtype_, (32,)), (GoneGoods._dtype_, (96,))],
        "offsets": [0, 4, 8, 9, 10, 11, 12, 396],
        "itemsize": 1548,
    }


class Event(Layout):
    _type_name_ = "lager::Event"
    _hash_ = 0xB6FBF34308F3F26F
    _fields_ = [
        ("kind", ctypes.c_uint8),
        ("x", ctypes.c_uint8),
        ("y", ctypes.c_uint8),
        ("heading", ctypes.c_uint8),
        ("order_id", ctypes.c_uint32),
        ("product", ctypes.c_int32),
        ("failure", Failure),
    ]
    _enums_ = {"kind": EventKind, "heading": Heading}
    _dtype_ = {
        "names": ["kind", "x", "y", "heading", "order_id", "product", "failure"],
        "formats": ["<u1", "<u1", "<u1", "<u1", "<u4", "<i4", Failure._dtype_],
        "offsets": [0, 1, 2, 3, 4, 8, 12],
        "itemsize": 24,
    }


class Thought(Layout):
    _type_name_ = "lager::Thought"
    _hash_ = 0x159AF761563BF94B
    _fields_ = [
        ("kind", ctypes.c_uint8),
        ("from_", ctypes.c_uint8),
        ("x", ctypes.c_uint8),
        ("y", ctypes.c_uint8),
        ("heading", ctypes.c_uint8),
        ("joint", ctypes.c_uint8),
        ("sides", ctypes.c_uint8),
        ("reserved", ctypes.c_uint8),
        ("product", ctypes.c_int32),
        ("expected", ctypes.c_int32),
        ("seen", ctypes.c_int32),
        ("failure", Failure),
    ]
    _enums_ = {"kind": ThoughtKind, "from_": Role, "heading": Heading, "joint": Joint}
    _dtype_ = {
        "names": ["kind", "from_", "x", "y", "heading", "joint", "sides", "reserved", "product", "expected", "seen", "failure"],
        "formats": ["<u1", "<u1", "<u1", "<u1", "<u1", "<u1", "<u1", "<u1", "<i4", "<i4", "<i4", Failure._dtype_],
        "offsets": [0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20],
        "itemsize": 32,
    }


class Durations(Layout):
    _type_name_ = "lager::Durations"
    _hash_ = 0xA31F1883656FD413
    _fields_ = [
        ("count", ctypes.c_uint64),
        ("sum_ns", ctypes.c_uint64),
        ("max_ns", ctypes.c_uint64),
        ("buckets", ctypes.c_uint64 * 90),
    ]
    _enums_ = {}
    _dtype_ = {
        "names": ["count", "sum_ns", "max_ns", "buckets"],
        "formats": ["<u8", "<u8", "<u8", ("<u8", (90,))],
        "offsets": [0, 8, 16, 24],
        "itemsize": 744,
    }


class PathLatency(Layout):
    _type_name_ = "lager::PathLatency"
    _hash_ = 0xDC7A274E65A52B7C
    _fields_ = [
        ("read_publish", Durations),
        ("publish_receive", Durations),
        ("decide", Durations),
        ("total", Durations),
    ]
    _enums_ = {}
    _dtype_ = {
        "names": ["read_publish", "publish_receive", "decide", "total"],
        "formats": [Durations._dtype_, Durations._dtype_, Durations._dtype_, Durations._dtype_],
        "offsets": [0, 744, 1488, 2232],
        "itemsize": 2976,
    }


class CommandLatency(Layout):
    _type_name_ = "lager::CommandLatency"
    _hash_ = 0x302F899C11A340FF
    _fields_ = [
        ("order_receive", Durations),
        ("receive_write", Durations),
        ("total", Durations),
    ]
    _enums_ = {}
    _dtype_ = {
        "names": ["order_receive", "receive_write", "total"],
        "formats": [Durations._dtype_, Durations._dtype_, Durations._dtype_],
        "offsets": [0, 744, 1488],
        "itemsize": 2232,
    }


class TruthGood(Layout):
    _type_name_ = "lager::TruthGood"
    _hash_ = 0x979A92DD7D6495A1
    _fields_ = [
        ("id", ctypes.c_int32),
        ("x_mm", ctypes.c_float),
        ("y_mm", ctypes.c_float),
        ("z_mm", ctypes.c_float),
        ("state", ctypes.c_uint8),
        ("reserved", ctypes.c_uint8 * 3),
    ]
    _enums_ = {"state": GoodState}
    _dtype_ = {
        "names": ["id", "x_mm", "y_mm", "z_mm", "state", "reserved"],
        "formats": ["<i4", "<f4", "<f4", "<f4", "<u1", ("<u1", (3,))],
        "offsets": [0, 4, 8, 12, 16, 17],
        "itemsize": 20,
    }


class TruthObstacle(Layout):
    _type_name_ = "lager::TruthObstacle"
    _hash_ = 0x1F45D15119242573
    _fields_ = [
        ("x", ctypes.c_uint8),
        ("y", ctypes.c_uint8),
        ("heading", ctypes.c_uint8),
        ("by_chance", ctypes.c_uint8),
    ]
    _enums_ = {"heading": Heading}
    _dtype_ = {
        "names": ["x", "y", "heading", "by_chance"],
        "formats": ["<u1", "<u1", "<u1", "<u1"],
        "offsets": [0, 1, 2, 3],
        "itemsize": 4,
    }


class Truth(Layout):
    _type_name_ = "lager::Truth"
    _hash_ = 0x244F364053E556BA
    _fields_ = [
        ("time_ns", ctypes.c_uint64),
        ("x_mm", ctypes.c_double),
        ("y_mm", ctypes.c_double),
        ("heading_rad", ctypes.c_double),
        ("left_mm_per_s", ctypes.c_float),
        ("right_mm_per_s", ctypes.c_float),
        ("carrying", ctypes.c_int32),
        ("good_count", ctypes.c_uint16),
        ("left_duty", ctypes.c_uint8),
        ("right_duty", ctypes.c_uint8),
        ("servo_position", ctypes.c_uint16 * 8),
        ("battery_charge", ctypes.c_float),
        ("collisions", ctypes.c_uint32),
        ("goods", TruthGood * 256),
        ("obstacles", TruthObstacle * 64),
        ("obstacle_count", ctypes.c_uint16),
        ("reset_closed", ctypes.c_uint8),
        ("mode_closed", ctypes.c_uint8),
        ("lines_low", ctypes.c_uint32),
        ("lines_high", ctypes.c_uint32),
        ("reserved", ctypes.c_uint8 * 4),
    ]
    _enums_ = {}
    _dtype_ = {
        "names": ["time_ns", "x_mm", "y_mm", "heading_rad", "left_mm_per_s", "right_mm_per_s", "carrying", "good_count", "left_duty", "right_duty", "servo_position", "battery_charge", "collisions", "goods", "obstacles", "obstacle_count", "reset_closed", "mode_closed", "lines_low", "lines_high", "reserved"],
        "formats": ["<u8", "<f8", "<f8", "<f8", "<f4", "<f4", "<i4", "<u2", "<u1", "<u1", ("<u2", (8,)), "<f4", "<u4", (TruthGood._dtype_, (256,)), (TruthObstacle._dtype_, (64,)), "<u2", "<u1", "<u1", "<u4", "<u4", ("<u1", (4,))],
        "offsets": [0, 8, 16, 24, 32, 36, 40, 44, 46, 47, 48, 64, 68, 72, 5192, 5448, 5450, 5451, 5452, 5456, 5460],
        "itemsize": 5464,
    }


TOPICS = {
    "sensor/line": TopicEntry(
        "sensor/line",
        LineFrame,
        Qos(256, 0, 4, 74, 94),
        "The line under the robot, as the sensor board classifies it.",
    ),
    "sensor/distance": TopicEntry(
        "sensor/distance",
        DistanceFrame,
        Qos(256, 0, 4, 74, 94),
        "The distance to what is in front of the robot.",
    ),
    "steering/command": TopicEntry(
        "steering/command",
        SteeringOrder,
        Qos(16, 0, 18, 74, 108),
        "Orders to the arbiter in the bridge.",
    ),
    "steering/state": TopicEntry(
        "steering/state",
        SteeringReport,
        Qos(64, 0, 4, 74, 94),
        "What the steering board does, with the arm's servos.",
    ),
    "link/health": TopicEntry(
        "link/health",
        Health,
        Qos(16, 1, 4, 74, 94),
        "Both serial links and who may steer.",
    ),
    "nav/status": TopicEntry(
        "nav/status",
        NavigatorStatus,
        Qos(16, 1, 4, 72, 92),
        "Where the robot is and what it is doing.",
    ),
    "nav/map": TopicEntry(
        "nav/map",
        WarehouseMap,
        Qos(8, 1, 10, 74, 100),
        "The warehouse and where its goods stand.",
    ),
    "nav/route": TopicEntry(
        "nav/route",
        Route,
        Qos(8, 1, 4, 72, 92),
        "The nodes the robot means to pass.",
    ),
    "nav/blocks": TopicEntry(
        "nav/blocks",
        BlockedWays,
        Qos(8, 1, 4, 72, 92),
        "The ways on which something stands.",
    ),
    "nav/inputs": TopicEntry(
        "nav/inputs",
        NavigatorInputs,
        Qos(64, 0, 4, 72, 92),
        "What the navigator was told, in pieces, with proofs of what it did: for `bag play --verify`.",
    ),
    "mission/order": TopicEntry(
        "mission/order",
        Order,
        Qos(16, 0, 10, 74, 100),
        "Products to fetch.",
    ),
    "mission/queue": TopicEntry(
        "mission/queue",
        OrderQueue,
        Qos(8, 1, 4, 72, 92),
        "The order under way and those that wait for their turn.",
    ),
    "mission/event": TopicEntry(
        "mission/event",
        Event,
        Qos(64, 0, 4, 74, 94),
        "What happened on a mission.",
    ),
    "operator/input": TopicEntry(
        "operator/input",
        Input,
        Qos(16, 0, 18, 74, 108),
        "Buttons and acknowledgements of a person.",
    ),
    "log/thought": TopicEntry(
        "log/thought",
        Thought,
        Qos(64, 0, 18, 72, 106),
        "What the services think, for people to read.",
    ),
    "latency/path": TopicEntry(
        "latency/path",
        PathLatency,
        Qos(8, 1, 4, 72, 92),
        "How long sensor frames take until logic has decided, stage by stage, once a second.",
    ),
    "latency/command": TopicEntry(
        "latency/command",
        CommandLatency,
        Qos(8, 1, 4, 72, 92),
        "How long logic's orders take from the frame they rest on to the wire, once a second.",
    ),
    "truth/pose": TopicEntry(
        "truth/pose",
        Truth,
        Qos(16, 1, 4, 72, 92),
        "The simulated world as it really is.",
    ),
}


class ByName:
    def topic(self, name):
        return self._open(name)
