"""A robot on another computer, heard over its `lager gateway --zenoh`.

The samples are the bytes of the bus, so readers and classes are the same. Only looking is possible.
"""

from __future__ import annotations

import ctypes
import json
import queue
import time
from typing import Any, Dict, NamedTuple, Optional, Type

from . import _described, _ledger
from ._errors import NoBus, OtherLayout, Unread
from ._layout import Layout, TopicEntry
from ._reader import Reader

# As a listener of `services/remote/src/listener.rs` has it.
_QUEUE = 4_096
# Seconds that a gateway has for an answer.
_PATIENCE = 3.0
# Also told by a router, which no robot can be called.
_ROUTER = "@router"
_EXTRA = "pip install './bus/python[remote]'"


class Proof(NamedTuple):
    """The three files that `lager keys listener` makes."""

    authority: str
    certificate: str
    key: str


class Link:
    """A connection to the gateway of `robot`."""

    def __init__(self, robot: str, endpoint: str, proof: Optional[Proof]) -> None:
        try:
            import zenoh
        except ImportError as error:
            raise NoBus(f"a robot on another computer needs eclipse-zenoh: {_EXTRA}") from error
        if endpoint.startswith("tls/") and proof is None:
            raise NoBus(
                f"{endpoint} needs certificates; give authority=, certificate= and key=, as `lager "
                "keys` makes them"
            )
        self._zenoh = zenoh
        self._robot = robot
        self._endpoint = endpoint
        config = zenoh.Config.from_json5(json.dumps(_config(robot, endpoint, proof)))
        try:
            self._session: Optional[Any] = zenoh.open(config)
        except Exception as error:
            raise NoBus(
                f"no connection to {endpoint}: {error}; `lager gateway --zenoh ENDPOINT` on the robot "
                "says where it listens"
            ) from error
        try:
            self._topics()
        except NoBus:
            self.close()
            raise

    def close(self) -> None:
        """Ends the connection."""
        if self._session is not None:
            self._session.close()
            self._session = None

    def entry(self, entry: TopicEntry) -> TopicEntry:
        """A topic of the table, if it has the same layout on the robot."""
        there = self.described(entry.name)
        if not _same(entry.payload, there.payload):
            raise OtherLayout(
                f"`{entry.name}` has another layout on the robot `{self._robot}` than in this package; "
                "install the package of the version that runs there: pip install ./bus/python"
            )
        return entry

    def described(self, name: str) -> TopicEntry:
        """A topic as the gateway describes it."""
        topics = self._topics()
        about = topics.get(name)
        if about is None:
            raise Unread(
                f"`{name}` is not sent by the gateway of `{self._robot}`; it sends "
                f"{' '.join(sorted(topics))}"
            )
        try:
            return TopicEntry(name, _described.layout(about["layout"]))
        except _described.NotReadable as error:
            raise OtherLayout(f"the description of `{name}` is not readable: {error}") from error

    def read(self, entry: TopicEntry) -> Reader[Any]:
        """Reads a topic."""
        if self._session is None:
            raise Unread("this robot is closed")
        is_state = bool(self._topics()[entry.name]["state"])
        port = _Port(self._zenoh, self._session, f"lager/{self._robot}", entry, is_state)
        return Reader(port, entry, lambda: None, port.ledger, port.now_ns)

    def _topics(self) -> Dict[str, Dict[str, Any]]:
        if self._session is None:
            raise Unread("this robot is closed")
        begin = f"lager/{self._robot}/@layout/"
        found: Dict[str, Dict[str, Any]] = {}
        for reply in self._session.get(f"{begin}**", timeout=_PATIENCE):
            if reply.ok is not None:
                name = str(reply.ok.key_expr)[len(begin) :]
                found[name] = json.loads(reply.ok.payload.to_bytes())
        if not found:
            raise NoBus(
                f"no gateway of the robot `{self._robot}` answers at {self._endpoint}: another robot "
                f"is there, or its certificate is not that of `{self._robot}`"
            )
        return found


class _Raw:
    """A sample in this process's own memory."""

    def __init__(self, stamp: bytes, payload: bytes) -> None:
        self._stamp = ctypes.create_string_buffer(stamp, len(stamp))
        self._payload = ctypes.create_string_buffer(payload, len(payload))
        self.user_header_ptr = ctypes.addressof(self._stamp)
        self.payload_ptr = ctypes.addressof(self._payload)

    def delete(self) -> None:
        """As for a sample of the bus; nothing has to be given back."""


class _Port:
    """The reading end of a topic, as the bus has one."""

    def __init__(
        self, zenoh: Any, session: Any, robot: str, entry: TopicEntry, is_state: bool
    ) -> None:
        self.ledger = _ledger.Ledger()
        self._entry = entry
        # To type checkers a layout is no ctypes structure.
        payload: Any = entry.payload
        self._size = ctypes.sizeof(payload)
        # When the robot's clock was told, by both clocks.
        self._told_ns: Optional[int] = None
        self._heard_ns = 0
        messages: "queue.Queue[Any]" = queue.Queue(_QUEUE)

        def put(message: Any) -> None:
            try:
                messages.put_nowait(message)
            except queue.Full:
                # The ledger counts it as lost by the numbers.
                pass

        def ask() -> None:
            if not is_state:
                return
            session.get(
                f"{robot}/{entry.name}",
                lambda reply: put(reply.ok) if reply.ok is not None else None,
                consolidation=zenoh.ConsolidationMode.NONE,
                timeout=_PATIENCE,
            )

        def token(sample: Any) -> None:
            # Also after the gateway was replaced.
            if sample.kind == zenoh.SampleKind.PUT:
                ask()

        self._messages = messages
        self._subscribers = [
            session.declare_subscriber(f"{robot}/{entry.name}", put),
            session.declare_subscriber(f"{robot}/@counts", lambda beat: put(_Beat(beat))),
            session.liveliness().declare_subscriber(f"{robot}/@alive", token, history=True),
        ]

    def receive(self) -> Optional[_Raw]:
        """The next sample that has not been shown before."""
        while True:
            try:
                message = self._messages.get_nowait()
            except queue.Empty:
                return None
            if isinstance(message, _Beat):
                self._enter(message.payload)
                continue
            attachment = message.attachment
            note = _ledger.read(attachment.to_bytes() if attachment is not None else b"")
            payload = message.payload.to_bytes()
            if note is None or len(payload) != self._size:
                raise ValueError("a message is of another version; open the topic again")
            if self.ledger.hear(note):
                return _Raw(note.stamp, payload)

    def now_ns(self) -> int:
        """The robot's clock, at least; before it is known, later than everything."""
        if self._told_ns is None:
            return (1 << 64) - 1
        return self._told_ns + time.monotonic_ns() - self._heard_ns

    def delete(self) -> None:
        """Ends it."""
        for subscriber in self._subscribers:
            subscriber.undeclare()
        self._subscribers.clear()

    def _enter(self, payload: bytes) -> None:
        try:
            beat = json.loads(payload)
            self.ledger.tell(beat, self._entry.name)
            self._told_ns = int(beat["now_ns"])
        except (ValueError, KeyError, TypeError):
            # Whatever else stands under that key is no beat.
            return
        self._heard_ns = time.monotonic_ns()


class _Beat:
    __slots__ = ("payload",)

    def __init__(self, sample: Any) -> None:
        self.payload: bytes = sample.payload.to_bytes()


def _same(ours: Type[Layout], theirs: Type[Layout]) -> bool:
    """Whether both lay out the same fields in the same way."""
    if len(ours._fields_) != len(theirs._fields_):
        return False
    pairs = zip(ours._fields_, theirs._fields_)
    return all(own[0] == other[0] and _same_type(own[1], other[1]) for own, other in pairs)


def _same_type(ours: Any, theirs: Any) -> bool:
    if issubclass(ours, ctypes.Array) and issubclass(theirs, ctypes.Array):
        of: Any = ours
        other: Any = theirs
        return bool(of._length_ == other._length_) and _same_type(of._type_, other._type_)
    if issubclass(ours, Layout) and issubclass(theirs, Layout):
        return _same(ours, theirs)
    return bool(ours is theirs)


def _config(robot: str, endpoint: str, proof: Optional[Proof]) -> Dict[str, Any]:
    """What `services/remote/src/session.rs` sets for a listener."""
    config: Dict[str, Any] = {
        "mode": "client",
        "connect": {
            "endpoints": [endpoint],
            "timeout_ms": 0,
            "exit_on_failure": True,
            "retry": {"period_init_ms": 100, "period_max_ms": 1_000, "period_increase_factor": 2},
        },
        "listen": {"endpoints": []},
        "scouting": {"multicast": {"enabled": False}, "gossip": {"enabled": False}},
    }
    if proof is None or not endpoint.startswith("tls/"):
        return config
    config["transport"] = {
        "link": {
            "tls": {
                "root_ca_certificate": proof.authority,
                "enable_mtls": True,
                "verify_name_on_connect": True,
                "connect_certificate": proof.certificate,
                "connect_private_key": proof.key,
            }
        }
    }
    keys = ["**"] + [f"lager/*/{key}" for key in ("@layout/**", "@counts", "@alive", "@time")]
    asks = ["declare_subscriber", "query", "declare_liveliness_subscriber", "liveliness_query"]
    tells = ["put", "reply", "liveliness_token", "declare_queryable"]
    rules = [
        {"id": flow, "permission": "allow", "messages": kinds, "flows": [flow], "key_exprs": keys}
        for flow, kinds in (("egress", asks), ("ingress", tells))
    ]
    # Only what a certificate with the robot's name tells is believed.
    config["access_control"] = {
        "enabled": True,
        "default_permission": "deny",
        "rules": rules,
        "subjects": [{"id": "robot", "cert_common_names": [robot, _ROUTER]}],
        "policies": [{"rules": ["egress", "ingress"], "subjects": ["robot"]}],
    }
    return config
