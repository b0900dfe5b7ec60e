"""What became of the samples of a topic that is heard over a robot's gateway.

`services/remote/src/ledger.rs` in Python, which has the reasons and the law: those that came and those
that are missing are all that were published, wherever they were lost.
"""

from __future__ import annotations

import struct
from typing import Any, Dict, NamedTuple, Optional

from ._streams import Streams
from .layouts import Stamp

# services/remote/src/note.rs draws it.
_NOTE = struct.Struct("<BB6x56s5Q")
_VERSION = 1
_ANSWER = 1


class Counts(NamedTuple):
    """What a gateway has counted of one topic in one run."""

    run: int
    next: int
    left_out: int
    lost: int


class Note(NamedTuple):
    """What stands beside a sample."""

    stamp: bytes
    is_answer: bool
    counts: Counts


def read(attachment: bytes) -> Optional[Note]:
    """The note of these bytes; None if no gateway of this version has sent them."""
    if len(attachment) != _NOTE.size or attachment[0] != _VERSION:
        return None
    _, flags, stamp, run, number, left_out, lost, _ = _NOTE.unpack(attachment)
    return Note(stamp, bool(flags & _ANSWER), Counts(run, number + 1, left_out, lost))


class _Run:
    """One gateway's life, as far as it is heard."""

    def __init__(self, base: Counts) -> None:
        self.base = base
        self.last = base
        self.dropped = 0
        self.awaited = range(0)
        self.is_heard = False

    def take(self, note: Note) -> bool:
        number = note.counts.next - 1
        if number >= self.last.next:
            self.dropped += number - self.last.next
            self.awaited = range(0)
            self.last = self.last._replace(next=number + 1)
        elif number in self.awaited:
            self.dropped -= 1
            self.awaited = range(number + 1, self.awaited.stop)
        elif note.is_answer and not self.is_heard:
            self.dropped += self.last.next - number - 1
        else:
            return False
        self.is_heard = True
        self.count(note.counts)
        return True

    def count(self, counts: Counts) -> None:
        left_out = max(self.last.left_out, counts.left_out)
        self.last = self.last._replace(left_out=left_out, lost=counts.lost)

    @property
    def missing(self) -> int:
        left_out = self.last.left_out - self.base.left_out
        return max(self.last.lost - self.base.lost, 0) + max(left_out, 0) + self.dropped


class Ledger:
    """The account of one reader."""

    def __init__(self) -> None:
        self._run: Optional[_Run] = None
        self._streams: Optional[Streams] = None
        self._before = 0
        self.received = 0

    @property
    def lost(self) -> int:
        """Samples that did not come."""
        told = self._before + (self._run.missing if self._run else 0)
        # While no gateway was there, only the stamps tell.
        return max(told, self._streams.lost if self._streams else 0)

    def hear(self, note: Note) -> bool:
        """Enters a message; whether its sample is a new one."""
        if not self._run_of(note.counts, note.counts.next - 1).take(note):
            return False
        self.received += 1
        stamp = Stamp.from_buffer_copy(note.stamp)
        now_ns = stamp.publish_time_ns
        if self._streams is None:
            self._streams = Streams(now_ns)
        self._streams.note(stamp, now_ns)
        return True

    def tell(self, beat: Dict[str, Any], topic: str) -> None:
        """Enters what the gateway tells once a second."""
        told = beat["topics"].get(topic)
        if told is None:
            return
        counts = Counts(beat["run"], told["next"], told["left_out"], told["lost"])
        run = self._run_of(counts, counts.next)
        if counts.next > run.last.next:
            begin = run.last.next
            run.dropped += counts.next - begin
            joins = run.awaited.stop == begin and len(run.awaited) > 0
            run.awaited = range(run.awaited.start if joins else begin, counts.next)
            run.last = run.last._replace(next=counts.next)
        run.count(counts)

    def note(self, stamp: Stamp) -> None:
        """As a reader of the bus counts; here `hear` has done it."""

    def _run_of(self, counts: Counts, begin: int) -> _Run:
        if self._run is not None and self._run.last.run == counts.run:
            return self._run
        if self._run is None:
            base = counts._replace(next=begin)
        else:
            self._before += self._run.missing
            base = Counts(counts.run, 0, 0, 0)
        self._run = _Run(base)
        return self._run
