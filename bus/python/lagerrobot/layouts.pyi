# The types of the topics' layouts. Made by `lager topic schema --python bus/python/lagerrobot`.

import enum
from typing import Any, Literal, Sequence, overload

from ._layout import Layout, TopicEntry
from ._reader import Reader

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
    sequence: int
    source_time_ns: int
    cause_publish_time_ns: int
    cause_receive_time_ns: int
    publish_time_ns: int
    epoch: int
    writer: int
    cause_topic: int

class LineFrame(Layout):
    link_epoch: int
    bits: int
    state: int
    packet_id: int

class DistanceFrame(Layout):
    link_epoch: int
    distance_cm: int
    packet_id: int
    reserved: Sequence[int]

class SteeringOrder(Layout):
    given_ns: int
    id: int
    origin: int
    code: int
    arm_granted: int
    reserved: int

class SteeringReport(Layout):
    link_epoch: int
    finished_id: int
    current_id: int
    finished_origin: int
    current_origin: int
    finish: int
    code: int
    left_duty: int
    right_duty: int
    flags: int
    line_error: int
    servo_errors: int
    battery_decivolts: int
    age_ms: int
    servo_position: Sequence[int]
    servo_load: Sequence[int]

class BoardHealth(Layout):
    epoch: int
    packets: int
    lost: int
    lost_total: int
    bad_crc: int
    skipped_bytes: int
    reboots: int
    baud: int
    up: int
    version: int
    reset_cause: int
    port: int
    build: int
    board_bad_packets: int
    board_lost: int
    board_refused: int
    board_exde_errors: int
    board_servo_timeouts: int
    board_load_percent: int
    board_longest_loop_100us: int
    reserved: Sequence[int]

class CalibratedSensor(Layout):
    reading: int
    lowest: int
    highest: int
    tells_apart: int

class Health(Layout):
    sensor: BoardHealth
    steering: BoardHealth
    bus_lost: int
    driven_by_hand: int
    stopped_at_ns: int
    stop_word: int
    current_id: int
    finished_id: int
    orders_refused: int
    leases_expired: int
    refused_id: int
    next_lease_ms: int
    gain_p: int
    gain_d: int
    mode: int
    stopped: int
    current_origin: int
    finished_origin: int
    current_code: int
    wire_seq: int
    finish: int
    refused_origin: int
    refusal: int
    blocked: int
    arm_profile: int
    calibration: int
    calibrated_sensors: int
    calibrations_ended: int
    calibrated: Sequence[CalibratedSensor]
    stop_cause: int
    stop_origin: int
    mode_chosen: int
    steering_profile: int
    sensor_profile: int
    reserved: Sequence[int]
    description: int

class Failure(Layout):
    kind: int
    remedy: int
    x: int
    y: int
    expected: int
    seen: int

class NavigatorStatus(Layout):
    frames_lost: int
    frames: int
    driven_by_hand: int
    order_id: int
    product: int
    command_id: int
    delivered: int
    travelled_mm: int
    exit_mm: int
    failure: Failure
    x: int
    y: int
    turned_deg: int
    distance_age_ms: int
    phase: int
    step: int
    heading: int
    target: int
    goal: int
    mark: int
    code: int
    tries: int
    misses: int
    waiting: int
    distance_cm: int
    mode: int
    stopped: int
    hold: int
    forced: int
    doubt: int
    doubt_x: Sequence[int]
    doubt_y: Sequence[int]
    arm_attempt: int
    arm_moves: int
    remedy: int
    pick: int
    at_start: int
    reserved: int

class MapProduct(Layout):
    id: int
    x: int
    y: int
    side: int
    reserved: int

class WarehouseMap(Layout):
    width: int
    height: int
    delivery_x: int
    delivery_y: int
    side_length_cm: int
    product_count: int
    products: Sequence[MapProduct]

class RouteNode(Layout):
    x: int
    y: int

class Route(Layout):
    length: int
    reserved: int
    nodes: Sequence[RouteNode]

class BlockedWay(Layout):
    since_ns: int
    x: int
    y: int
    heading: int
    source: int
    reserved: Sequence[int]

class BlockedWays(Layout):
    width: int
    height: int
    tries: int
    count: int
    reserved: Sequence[int]
    ways: Sequence[BlockedWay]

class Sent(Layout):
    epoch: int
    next: int

class NavigatorInput(Layout):
    time_ns: int
    number: int
    proof: int
    command_id: int
    kind: int
    value: int
    flag: int
    code: int
    arm_granted: int
    reserved: Sequence[int]

class Order(Layout):
    id: int
    product: int

class Input(Layout):
    kind: int
    x: int
    y: int
    heading: int
    order_id: int
    id: int

class NavigatorInputs(Layout):
    first: int
    commands: Sent
    statuses: Sent
    events: Sent
    text_left: int
    text_used: int
    text_kind: int
    entries_used: int
    reports_used: int
    orders_used: int
    operator_used: int
    reserved: Sequence[int]
    entries: Sequence[NavigatorInput]
    reports: Sequence[SteeringReport]
    orders: Sequence[Order]
    operator: Sequence[Input]
    text: Sequence[Sequence[int]]

class WaitingOrder(Layout):
    id: int
    product: int
    put_off: int
    reserved: Sequence[int]

class GoneGoods(Layout):
    product: int
    since_s: int
    why: int
    reserved: Sequence[int]

class OrderQueue(Layout):
    order_id: int
    product: int
    under_way: int
    count: int
    gone_count: int
    reserved: int
    orders: Sequence[WaitingOrder]
    gone: Sequence[GoneGoods]

class Event(Layout):
    kind: int
    x: int
    y: int
    heading: int
    order_id: int
    product: int
    failure: Failure

class Thought(Layout):
    kind: int
    from_: int
    x: int
    y: int
    heading: int
    joint: int
    sides: int
    reserved: int
    product: int
    expected: int
    seen: int
    failure: Failure

class Durations(Layout):
    count: int
    sum_ns: int
    max_ns: int
    buckets: Sequence[int]

class PathLatency(Layout):
    read_publish: Durations
    publish_receive: Durations
    decide: Durations
    total: Durations

class CommandLatency(Layout):
    order_receive: Durations
    receive_write: Durations
    total: Durations

class TruthGood(Layout):
    id: int
    x_mm: float
    y_mm: float
    z_mm: float
    state: int
    reserved: Sequence[int]

class TruthObstacle(Layout):
    x: int
    y: int
    heading: int
    by_chance: int

class Truth(Layout):
    time_ns: int
    x_mm: float
    y_mm: float
    heading_rad: float
    left_mm_per_s: float
    right_mm_per_s: float
    carrying: int
    good_count: int
    left_duty: int
    right_duty: int
    servo_position: Sequence[int]
    battery_charge: float
    collisions: int
    goods: Sequence[TruthGood]
    obstacles: Sequence[TruthObstacle]
    obstacle_count: int
    reset_closed: int
    mode_closed: int
    lines_low: int
    lines_high: int
    reserved: Sequence[int]

TOPICS: dict[str, TopicEntry]

class ByName:
    @overload
    def topic(self, name: Literal["sensor/line"]) -> Reader[LineFrame]: ...
    @overload
    def topic(self, name: Literal["sensor/distance"]) -> Reader[DistanceFrame]: ...
    @overload
    def topic(self, name: Literal["steering/command"]) -> Reader[SteeringOrder]: ...
    @overload
    def topic(self, name: Literal["steering/state"]) -> Reader[SteeringReport]: ...
    @overload
    def topic(self, name: Literal["link/health"]) -> Reader[Health]: ...
    @overload
    def topic(self, name: Literal["nav/status"]) -> Reader[NavigatorStatus]: ...
    @overload
    def topic(self, name: Literal["nav/map"]) -> Reader[WarehouseMap]: ...
    @overload
    def topic(self, name: Literal["nav/route"]) -> Reader[Route]: ...
    @overload
    def topic(self, name: Literal["nav/blocks"]) -> Reader[BlockedWays]: ...
    @overload
    def topic(self, name: Literal["nav/inputs"]) -> Reader[NavigatorInputs]: ...
    @overload
    def topic(self, name: Literal["mission/order"]) -> Reader[Order]: ...
    @overload
    def topic(self, name: Literal["mission/queue"]) -> Reader[OrderQueue]: ...
    @overload
    def topic(self, name: Literal["mission/event"]) -> Reader[Event]: ...
    @overload
    def topic(self, name: Literal["operator/input"]) -> Reader[Input]: ...
    @overload
    def topic(self, name: Literal["log/thought"]) -> Reader[Thought]: ...
    @overload
    def topic(self, name: Literal["latency/path"]) -> Reader[PathLatency]: ...
    @overload
    def topic(self, name: Literal["latency/command"]) -> Reader[CommandLatency]: ...
    @overload
    def topic(self, name: Literal["truth/pose"]) -> Reader[Truth]: ...
    @overload
    def topic(self, name: str) -> Reader[Any]: ...
    def _open(self, name: str) -> Reader[Any]: ...
