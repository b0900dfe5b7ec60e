"""Exact loss accounting by stamps: `bus/ports/src/streams.rs` in Python, which has the reasons.

A stream is one life of a writer, `(writer, epoch)`, numbered from 0 without gaps. A restarted
writer is a new stream and no loss, and a false stamp counts nothing.
"""

from __future__ import annotations

import time
from typing import Dict, Optional, Tuple

from .layouts import Stamp

_REMEMBERED = 128
_SHORTEST_NS = 20


class _Stream:
    __slots__ = ("next", "gap", "heard_ns")

    def __init__(self, next_number: int, gap: range, heard_ns: int) -> None:
        self.next = next_number
        self.gap = gap
        self.heard_ns = heard_ns

    def jump(self, sequence: int, publish_ns: int, now_ns: int) -> int:
        """Takes up a number that is not the next one; returns the change of the losses."""
        withdrawn = 0
        if sequence < self.next:
            if sequence not in self.gap:
                return 0
            withdrawn = len(self.gap)
            self.next = self.gap.start
            self.gap = range(0)
        missed = sequence - self.next
        self.heard_ns = min(self.heard_ns, now_ns)
        if missed > _sendable(self.heard_ns, now_ns):
            return -withdrawn
        self.gap = range(self.next, sequence)
        self.next = sequence + 1
        self.heard_ns = max(self.heard_ns, min(publish_ns, now_ns))
        return missed - withdrawn


class Streams:
    """The counters of one reader, which was attached at `attached_ns`."""

    def __init__(self, attached_ns: int) -> None:
        self._known: Dict[Tuple[int, int], _Stream] = {}
        self._attached_ns = attached_ns
        self.received = 0
        self.lost = 0

    def note(self, stamp: Stamp, now_ns: Optional[int] = None) -> None:
        """Notes a received sample, at this time of the stamps' clock."""
        self.received += 1
        key = (stamp.writer, stamp.epoch)
        # The one heard last comes last, so that the longest silent one is forgotten first.
        stream = self._known.pop(key, None)
        if stream is None:
            self._meet(key, stamp.sequence, _now(now_ns))
            return
        self._known[key] = stream
        if stamp.sequence == stream.next:
            stream.next += 1
            stream.gap = range(0)
            stream.heard_ns = max(stream.heard_ns, stamp.publish_time_ns)
        else:
            self.lost += stream.jump(stamp.sequence, stamp.publish_time_ns, _now(now_ns))

    def _meet(self, key: Tuple[int, int], sequence: int, now_ns: int) -> None:
        epoch = key[1]
        if sequence > _sendable(epoch, now_ns):
            return
        is_younger = epoch > self._attached_ns
        if is_younger:
            self.lost += sequence
        if len(self._known) == _REMEMBERED:
            del self._known[next(iter(self._known))]
        gap = range(sequence) if is_younger else range(0)
        heard_ns = min(max(epoch, self._attached_ns), now_ns)
        self._known[key] = _Stream(sequence + 1, gap, heard_ns)


def _now(now_ns: Optional[int]) -> int:
    return time.monotonic_ns() if now_ns is None else now_ns


def _sendable(since_ns: int, now_ns: int) -> int:
    return max(now_ns - since_ns, 0) // _SHORTEST_NS
