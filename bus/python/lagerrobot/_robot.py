"""A robot's bus, joined as an observer, or its gateway elsewhere: this package has no way to write to
either.

Commands are given by the program `lager`; `_orders.py` says why.
"""

from __future__ import annotations

import importlib.metadata
import os
import re
from typing import Any, Literal, Optional, Union

import iceoryx2 as iox2

from . import _described, _orders, _place, _remote
from ._errors import NoBus, NotOperator, OtherLayout, OtherVersion, Unread
from ._layout import TopicEntry
from ._open import Open
from ._reader import Reader
from .layouts import TOPICS, Stamp

# All processes on one bus need this one.
ICEORYX2 = "0.10.0"

# The limits that `bus/ports` gives every topic.
_MAX_HELD = 4
_OBSERVERS = 64
_GONE = 16

_SCHEMA_KEY = "lager.schema"
# The description of a topic, in pieces.
_FIELDS_KEY = "lager.fields."
_PIECES = 7
_NAME = re.compile(r"[a-z0-9-]{1,24}")
# What the transport says of a service that another build has made.
_OTHER = ("Incompatible", "DoesNotSupportRequested")


class Robot(Open):
    """The robot called `name`, on this user's bus or on the one that lives in the folder `bus`.

    `robot.topic("sensor/line")` reads a topic; one that is in no table is read as it describes itself,
    while somebody has it open. Use it as a context manager, or `close` it; it stays
    in the thread that made it.

    With `role="operator"` it may also give commands, by the program `lager`.

    With `remote="tcp/HOST:PORT"`, or `"tls/..."` and the files of `lager keys`, it is a robot on
    another computer, heard over its `lager gateway --zenoh`. Then it can only be looked at. Needs the
    package eclipse-zenoh: `pip install './bus/python[remote]'`.
    """

    def __init__(
        self,
        name: str = "r1",
        *,
        bus: Optional[str] = None,
        role: Literal["observer", "operator"] = "observer",
        lager: str = "lager",
        remote: Optional[str] = None,
        authority: Optional[str] = None,
        certificate: Optional[str] = None,
        key: Optional[str] = None,
    ) -> None:
        super().__init__()
        if not _NAME.fullmatch(name) or name.startswith("iceoryx2"):
            raise NoBus(f"`{name}` is no robot's name: 1 to 24 of a-z, 0-9 and -")
        if role not in ("observer", "operator"):
            raise NotOperator(f"`{role}` is no role of a program: observer or operator")
        self.name = name
        self.role = role
        self._lager = lager
        self._link: Optional[_remote.Link] = None
        self._node: Optional[Any] = None
        if remote is not None:
            if bus is not None or role == "operator":
                raise NotOperator("a robot on another computer can only be looked at, by its gateway")
            self._link = _remote.Link(name, remote, _proof(authority, certificate, key))
            return
        _check_version()
        self._place = _place.find(bus)
        self._port_name = f"observer/{os.getpid()}"
        builder = iox2.NodeBuilder.new().config(self._config())
        builder = builder.name(iox2.NodeName.new(f"lager/{name}/{self._port_name}"))
        builder = builder.signal_handling_mode(iox2.SignalHandlingMode.Disabled)
        try:
            self._node = builder.create(iox2.ServiceType.Ipc)
        except Exception as error:
            raise NoBus(f"the bus at {self._place.folder} cannot be joined: {error}") from error

    def tell(self, *words: Union[str, int]) -> str:
        """Gives a command as `lager` does, such as `tell("fetch", 2)` or `tell("stop")`, and
        returns what it says when the robot has taken it. Raises `Refused` with the reason if it
        has not."""
        if self.role != "operator":
            raise NotOperator(
                'this program only looks; Robot(..., role="operator") may give commands'
            )
        said = [str(each) for each in words]
        return _orders.give(self._lager, self.name, self._place.folder, said)

    def close(self) -> None:
        """Leaves the bus; every sample is given back."""
        super().close()
        self._node = None
        if self._link is not None:
            self._link.close()

    def _read(self, entry: TopicEntry) -> Reader[Any]:
        if self._link is not None:
            return self._link.read(self._link.entry(entry) if entry.name in TOPICS else entry)
        if self._node is None:
            raise Unread("this robot is closed")
        service = self._service(self._node, entry)
        port = self._subscriber(service, entry)
        # Services have places of their own beyond these, which looking must never take.
        if service.dynamic_config.number_of_subscribers > _OBSERVERS:
            port.delete()
            raise Unread(f"`{entry.name}` has {_OBSERVERS} readers already; end one of them")
        return Reader(port, entry, self._check_there)

    def _service(self, node: Any, entry: TopicEntry) -> Any:
        qos = entry.qos
        builder = node.service_builder(iox2.ServiceName.new(f"lager/{self.name}/{entry.name}"))
        builder = builder.publish_subscribe(entry.payload).user_header(Stamp)
        layout = iox2.AttributeVerifier.new().require(
            iox2.AttributeKey.new(_SCHEMA_KEY), iox2.AttributeValue.new(_layout(entry))
        )
        try:
            if qos is None:
                return builder.open_with_attributes(layout)
            builder = builder.max_publishers(qos.max_publishers)
            builder = builder.max_subscribers(qos.max_subscribers).max_nodes(qos.max_nodes)
            builder = builder.subscriber_max_buffer_size(qos.buffer).history_size(qos.history)
            builder = builder.subscriber_max_borrowed_samples(_MAX_HELD)
            return builder.enable_safe_overflow(True).open_or_create_with_attributes(layout)
        except Exception as error:
            if any(word in str(error) for word in _OTHER):
                raise self._other_layout(node, entry, str(error)) from error
            raise Unread(f"`{entry.name}` cannot be opened: {error}") from error

    def _subscriber(self, service: Any, entry: TopicEntry) -> Any:
        builder = service.subscriber_builder().name(iox2.PortName.new(self._port_name))
        try:
            queue = service.static_config.subscriber_max_buffer_size
            return builder.buffer_size(queue).create()
        except Exception as error:
            raise Unread(f"`{entry.name}` cannot be read: {error}") from error

    def _described(self, name: str) -> TopicEntry:
        if self._link is not None:
            return self._link.described(name)
        if self._node is None:
            raise Unread("this robot is closed")
        try:
            found = iox2.Service.details(
                iox2.ServiceName.new(f"lager/{self.name}/{name}"),
                self._node.config,
                iox2.MessagingPattern.PublishSubscribe,
                iox2.ServiceType.Ipc,
            )
        except Exception as error:
            raise Unread(f"`{name}` cannot be looked at: {error}") from error
        if found is None:
            raise Unread(
                f"there is no topic `{name}` in the table, and nobody has one open; the topics are "
                f"{' '.join(TOPICS)}"
            )
        said = [_said(found, _SCHEMA_KEY)]
        said += [_said(found, f"{_FIELDS_KEY}{piece}") for piece in range(_PIECES)]
        if not said[0].endswith(f".{Stamp._hash_:016x}") or not said[1]:
            raise OtherLayout(
                f"`{name}` does not say how its samples are laid out, or has the stamps of another "
                "version"
            )
        try:
            payload = _described.layout("".join(said[1:]))
        except _described.NotReadable as error:
            raise OtherLayout(f"the description of `{name}` is not readable: {error}") from error
        payload._hash_ = int(said[0].split(".")[0], 16)
        return TopicEntry(name, payload)

    def _other_layout(self, node: Any, entry: TopicEntry, detail: str) -> OtherLayout:
        full = f"lager/{self.name}/{entry.name}"
        there = "none"
        for service in iox2.Service.list(node.config, iox2.ServiceType.Ipc):
            if service.name().to_string() == full:
                there = _said(service, _SCHEMA_KEY) or there
        ours = _layout(entry)
        return OtherLayout(
            f"`{entry.name}` has the layout {there} on the bus of `{self.name}` and {ours} in this "
            f"package, lagerrobot {importlib.metadata.version('lagerrobot')} ({detail}); install "
            "the package of the version that runs: pip install ./bus/python"
        )

    def _config(self) -> Any:
        config = iox2.config.default()
        config.global_cfg.prefix = iox2.FileName.new(self._place.prefix)
        config.global_cfg.root_path = iox2.Path.new(self._place.root)
        config.global_cfg.creation_timeout = iox2.Duration.from_millis(500)
        config.global_cfg.service.cleanup_dead_nodes_on_open = False
        config.defaults.publish_subscribe.subscriber_expired_connection_buffer = _GONE
        return config

    def _check_there(self) -> None:
        if _place.generation_in(self._place.folder) != self._place.generation:
            raise NoBus("the bus was damaged and has been cleared; open the robot again")


def _proof(
    authority: Optional[str], certificate: Optional[str], key: Optional[str]
) -> Optional[_remote.Proof]:
    if authority is None or certificate is None or key is None:
        if authority or certificate or key:
            raise NoBus("authority=, certificate= and key= belong together; give all three, or none")
        return None
    return _remote.Proof(authority, certificate, key)


def _said(service: Any, key: str) -> str:
    """What a service says of itself; empty if nothing."""
    values = service.attributes().key_values(iox2.AttributeKey.new(key))
    return str(values[0].to_string()) if values else ""


def _layout(entry: TopicEntry) -> str:
    return f"{entry.payload._hash_:016x}.{Stamp._hash_:016x}"


def _check_version() -> None:
    found = importlib.metadata.version("iceoryx2")
    if found != ICEORYX2:
        raise OtherVersion(
            f"the bus is iceoryx2 {ICEORYX2} and the wheel installed here is {found}; "
            f"pip install iceoryx2=={ICEORYX2}"
        )
