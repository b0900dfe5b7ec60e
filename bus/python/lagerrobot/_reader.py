"""The reading end of a topic. It polls, as every observer does, and costs the path no wake."""

from __future__ import annotations

import asyncio
import ctypes
import time
from typing import Any, AsyncIterator, Callable, Generic, Iterator, Optional, TypeVar, Union, cast

from ._errors import Released, Unread
from ._layout import Layout, TopicEntry
from ._ledger import Ledger
from ._streams import Streams
from ._view import View
from .layouts import Stamp

P = TypeVar("P", bound=Layout)

# Seconds between two looks for samples.
_POLL = 0.005
# Seconds without a sample after which the bus is asked whether it is still there.
_SILENCE = 1.0
# How far a stamp may be ahead of the clock, in ns, before `latest` takes it for false.
_AHEAD_NS = 1_000_000_000


class Sample(Generic[P]):
    """A sample in shared memory, and the stamp that its writer gave it.

    It is given back when its reader takes the next one, or by `release`. Then every view of it
    raises `Released`.
    """

    __slots__ = ("stamp", "_raw", "_payload", "_type", "_name")

    def __init__(self, raw: Any, entry: TopicEntry) -> None:
        self._raw: Optional[Any] = raw
        self._name = entry.name
        self._type = cast("type[P]", entry.payload)
        self.stamp: Stamp = Stamp.from_address(raw.user_header_ptr).copy()
        self._payload = self._type.from_address(raw.payload_ptr)

    @property
    def data(self) -> P:
        """The payload where it lies; read-only."""
        return cast(P, View(self._payload, self._alive))

    def copy(self) -> P:
        """The payload as the caller's own, to keep."""
        self._alive()
        return self._payload.copy()

    def array(self) -> Any:
        """The payload as a numpy array of one element, copied; needs numpy."""
        self._alive()
        return self._payload.array()

    def release(self) -> None:
        """Gives the sample back to its writer."""
        if self._raw is not None:
            self._raw.delete()
            self._raw = None

    def _alive(self) -> None:
        if self._raw is None:
            raise Released(
                f"this sample of `{self._name}` has been given back, because the next one was "
                "taken; keep its payload with copy()"
            )

    def __repr__(self) -> str:
        shown = "given back" if self._raw is None else repr(self._payload)
        return f"Sample(sequence={self.stamp.sequence}, {shown})"


class Reader(Generic[P]):
    """Samples of one topic, oldest first. Stays in the thread that made it.

    One that falls behind loses the oldest samples; `lost` says exactly how many.
    """

    def __init__(
        self,
        port: Any,
        entry: TopicEntry,
        check: Callable[[], None],
        counts: Union[Streams, Ledger, None] = None,
        clock: Callable[[], int] = time.monotonic_ns,
    ) -> None:
        self._port: Optional[Any] = port
        self._entry = entry
        self._check = check
        self._streams = Streams(time.monotonic_ns()) if counts is None else counts
        self._clock = clock
        self._current: Optional[Sample[P]] = None
        self._newest_ns = 0
        self._heard = time.monotonic()

    @property
    def name(self) -> str:
        """The topic's name."""
        return self._entry.name

    @property
    def received(self) -> int:
        """Samples received."""
        return self._streams.received

    @property
    def lost(self) -> int:
        """Samples missed, exactly, up to the last one received. A restarted writer is no loss."""
        return self._streams.lost

    def receive(self) -> Optional[Sample[P]]:
        """The next sample, oldest first, or None when there is none now. Gives the one before it
        back. Of a state the older values come first, too; `latest` has the last one."""
        self._release()
        self._current = self._take()
        return self._current

    def latest(self) -> Optional[Sample[P]]:
        """Drains the topic and returns what was published last; None if there is nothing newer
        than what this returned before. For topics that carry a state; a new reader gets the last
        one when its writer next looks for readers, a moment after the topic was opened."""
        self._release()
        while (sample := self._take()) is not None:
            now_ns = self._clock()
            published_ns = sample.stamp.publish_time_ns
            if self._newest_ns <= published_ns <= now_ns + _AHEAD_NS:
                self._newest_ns = min(published_ns, now_ns)
                self._release()
                self._current = sample
            else:
                sample.release()
        return self._current

    def __iter__(self) -> Iterator[Sample[P]]:
        while True:
            sample = self.receive()
            if sample is None:
                self._still_there()
                time.sleep(_POLL)
            else:
                yield sample

    async def __aiter__(self) -> AsyncIterator[Sample[P]]:
        while True:
            sample = self.receive()
            if sample is None:
                self._still_there()
                await asyncio.sleep(_POLL)
            else:
                yield sample

    def close(self) -> None:
        """Leaves the topic. What was not copied is gone."""
        self._release()
        if self._port is not None:
            self._port.delete()
            self._port = None

    def _take(self) -> Optional[Sample[P]]:
        if self._port is None:
            raise Unread(f"the reader of `{self.name}` is closed")
        try:
            raw = self._port.receive()
        except Exception as error:
            raise Unread(f"`{self.name}` cannot be read: {error}") from error
        if raw is None:
            return None
        sample: Sample[P] = Sample(raw, self._entry)
        self._streams.note(sample.stamp)
        self._heard = time.monotonic()
        return sample

    def _release(self) -> None:
        if self._current is not None:
            self._current.release()
            self._current = None

    def _still_there(self) -> None:
        if time.monotonic() - self._heard > _SILENCE:
            self._heard = time.monotonic()
            self._check()
