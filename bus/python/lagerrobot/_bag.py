"""Recordings: the samples of an MCAP file, read as those of a robot are."""

from __future__ import annotations

import ctypes
import enum
import json
import keyword
import math
import os
from typing import Any, AsyncIterator, Dict, Generic, Iterator, Optional, Type, TypeVar, Union

from . import _described
from ._errors import NoRecording, OtherLayout, Unread
from ._layout import Layout, TopicEntry
from ._open import Open
from ._reader import Reader, Sample
from .layouts import Stamp

P = TypeVar("P", bound=Layout)

_REPEATED = "lager.repeated"
"""What the metadata of a channel has whose samples were sent before the file began: each topic that
holds begins with its last one, so that the file can be used alone."""


class Bag(Open):
    """The recording in `path`, which `lager bag record` has made.

    `bag.topic("sensor/line")` reads a topic from its first sample to its last, also one that is in no
    table. Use it as a context manager, or `close` it. Needs the package `mcap`: `pip install './bus/python[bag]'`.
    """

    def __init__(self, path: Union[str, "os.PathLike[str]"]) -> None:
        try:
            from mcap.exceptions import McapError
            from mcap.reader import make_reader
        except ImportError as error:
            raise NoRecording("recordings need mcap: pip install './bus/python[bag]'") from error
        super().__init__()
        self.path = os.fspath(path)
        try:
            self._file = open(self.path, "rb")
        except OSError as error:
            raise NoRecording(f"{self.path} cannot be read: {error.strerror}") from error
        try:
            mcap = make_reader(self._file, validate_crcs=True)
            summary = mcap.get_summary()
            notes = {note.name: note.metadata for note in mcap.iter_metadata()}
        except McapError as error:
            self._file.close()
            raise NoRecording(
                f"{self.path} is no whole recording ({error}); `lager bag recover` saves what is "
                "whole"
            ) from error
        start = notes.get("lager.recording")
        if summary is None or summary.statistics is None or start is None:
            self._file.close()
            raise NoRecording(f"{self.path} was not recorded by lager, or has no index")
        self.robot: str = start["robot"]
        """The robot's name."""
        self.unix_offset_ns = int(start["unix_offset_ns"])
        """What is added to a stamp's time to get ns since 1970."""
        self._is_first = start["part"] == "0"
        counts = summary.statistics.channel_message_counts
        self.topics: Dict[str, int] = {}
        """The samples of each topic that is in it; one that is repeated from before it is none."""
        for number, channel in summary.channels.items():
            if "lager.derived" not in channel.metadata:
                own = 0 if _REPEATED in channel.metadata else counts.get(number, 0)
                self.topics[channel.topic] = self.topics.get(channel.topic, 0) + own
        self._schemas = {
            channel.topic: summary.schemas[channel.schema_id].data
            for channel in summary.channels.values()
            if channel.schema_id in summary.schemas
        }
        counted = notes.get("lager.counts", {})
        self._counts = {name: json.loads(text) for name, text in counted.items()}

    def missing(self, name: str) -> int:
        """Samples of the topic that are not in the file, as it says itself: those that were lost
        before the recorder, and those that it had no time for."""
        count = self._counts.get(name, {})
        return int(count.get("lost", 0)) + int(count.get("dropped", 0))

    def close(self) -> None:
        """Closes the file. What was not copied is gone."""
        super().close()
        self._file.close()

    def _described(self, name: str) -> TopicEntry:
        if name not in self.topics:
            raise Unread(
                f"there is no topic `{name}` in {self.path}; it has {' '.join(self.topics)}"
            )
        said = json.loads(self._schemas.get(name, b"{}")).get("$comment", "")
        try:
            return TopicEntry(name, _described.layout(said))
        except _described.NotReadable as error:
            raise OtherLayout(
                f"{self.path} does not say how samples of `{name}` are laid out: {error}"
            ) from error

    def _read(self, entry: TopicEntry) -> Reader[Any]:
        if self._file.closed:
            raise Unread("this recording is closed")
        return FileReader(self.path, entry, self._is_first)


class FileReader(Reader[P], Generic[P]):
    """Samples of one topic of a recording, oldest first, up to its end."""

    def __init__(self, path: str, entry: TopicEntry, is_first: bool) -> None:
        from mcap.reader import make_reader

        # A file of its own, so that several topics can be read at once.
        self._file = open(path, "rb")
        messages = make_reader(self._file, validate_crcs=True).iter_messages(topics=[entry.name])
        super().__init__(_Port(messages, entry), entry, lambda: None)
        self._is_first = is_first

    @property
    def received(self) -> int:
        """Samples read, without one that is repeated from before the file."""
        return self._messages.received

    @property
    def lost(self) -> int:
        """Samples missed up to the last one read, as the recording says: exact, since the recorder
        has counted them. `Bag.missing` has those behind it, too."""
        return self._messages.missing(self._is_first)

    @property
    def _messages(self) -> _Port:
        port = self._port
        if not isinstance(port, _Port):
            raise Unread(f"the reader of `{self.name}` is closed")
        return port

    def latest(self) -> Optional[Sample[P]]:
        """Reads to the end and returns the last sample; None if there is none any more."""
        self._release()
        while (sample := self._take()) is not None:
            self._release()
            self._current = sample
        return self._current

    def __iter__(self) -> Iterator[Sample[P]]:
        while (sample := self.receive()) is not None:
            yield sample

    async def __aiter__(self) -> AsyncIterator[Sample[P]]:
        while (sample := self.receive()) is not None:
            yield sample

    def close(self) -> None:
        """Leaves the recording. What was not copied is gone."""
        super().close()
        self._file.close()

    def _take(self) -> Optional[Sample[P]]:
        raw = self._messages.receive()
        return None if raw is None else Sample(raw, self._entry)


class _Raw:
    """A sample with memory of its own, where one from the bus has shared memory."""

    __slots__ = ("stamp", "payload")

    def __init__(self, stamp: Stamp, payload: Layout) -> None:
        self.stamp = stamp
        self.payload = payload

    @property
    def user_header_ptr(self) -> int:
        return ctypes.addressof(self.stamp)  # type: ignore[arg-type]

    @property
    def payload_ptr(self) -> int:
        return ctypes.addressof(self.payload)  # type: ignore[arg-type]

    def delete(self) -> None:
        """Python frees it with the last view."""


class _Port:
    """The messages of one topic in the place of a port of the bus."""

    def __init__(self, messages: Iterator[Any], entry: TopicEntry) -> None:
        self._messages = messages
        self._entry = entry
        self.received = 0
        self._first = 0
        self._last = 0

    def receive(self) -> Optional[_Raw]:
        found = next(self._messages, None)
        if found is None:
            return None
        envelope = json.loads(found[2].data)
        stamp, payload = Stamp(), self._entry.payload()
        fill(stamp, envelope["stamp"], self._entry.name)
        fill(payload, envelope["payload"], self._entry.name)
        if _REPEATED not in found[1].metadata:
            self._last = envelope["lost"] + envelope["dropped"]
            if self.received == 0:
                self._first = self._last
            self.received += 1
        return _Raw(stamp, payload)

    def missing(self, is_first: bool) -> int:
        """A later file of a recording counts from its first sample."""
        return self._last - (0 if is_first else self._first)

    def delete(self) -> None:
        self._messages = iter(())


def fill(into: Layout, values: Any, topic: str) -> None:
    """Puts a sample's JSON into a payload. Fields that one of both lacks are another build's."""
    fields = [field[0] for field in into._fields_ if not field[0].startswith("reserved")]
    names = {_of_file(name): name for name in fields}
    if not isinstance(values, dict) or set(names) != set(values):
        there = sorted(values) if isinstance(values, dict) else values
        raise OtherLayout(
            f"`{topic}` was recorded by another build: {type(into).__name__} has the fields "
            f"{sorted(names)} in this package and {there} in the file; install the package of "
            "that version"
        )
    for in_file, name in names.items():
        value = values[in_file]
        variants = into._enums_.get(name)
        inner = getattr(into, name)
        if isinstance(inner, Layout):
            fill(inner, value, topic)
        elif isinstance(inner, ctypes.Array):
            _fill_list(inner, value, variants, topic)
        else:
            setattr(into, name, _number(value, variants, topic))


def _number(value: Any, variants: Optional[Type[enum.IntEnum]], topic: str) -> Any:
    """A value that is made of no others: a variant has its name there, and what is no number null."""
    if value is None:
        return math.nan
    if not isinstance(value, str):
        return value
    named = f"{value}_" if keyword.iskeyword(value) else value
    if variants is None or named not in variants.__members__:
        name = "this field" if variants is None else variants.__name__
        raise OtherLayout(
            f"`{topic}` was recorded by another build: {name} has no {value} in this package; install "
            "the package of that version"
        )
    return variants[named]


def _of_file(name: str) -> str:
    """A name that is a word of Python's has a line behind it here."""
    return name[:-1] if name.endswith("_") and keyword.iskeyword(name[:-1]) else name


def _fill_list(
    into: Any, values: Any, variants: Optional[Type[enum.IntEnum]], topic: str
) -> None:
    # What is blank at the end is left out.
    for index, value in enumerate(values):
        if isinstance(into[index], Layout):
            fill(into[index], value, topic)
        elif isinstance(into[index], ctypes.Array):
            _fill_list(into[index], value, variants, topic)
        else:
            into[index] = _number(value, variants, topic)
