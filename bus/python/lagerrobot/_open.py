"""What has topics to be read: a robot's bus, or a recording."""

from __future__ import annotations

from types import TracebackType
from typing import Any, List, Optional, Type, TypeVar

from ._errors import Unread
from ._layout import TopicEntry
from ._reader import Reader
from .layouts import TOPICS, ByName

S = TypeVar("S", bound="Open")


class Open(ByName):
    """Opens readers by their topics' names, and closes them all at its own end."""

    def __init__(self) -> None:
        self._readers: List[Reader[Any]] = []

    def close(self) -> None:
        """Ends every reader; every sample is given back."""
        for reader in self._readers:
            reader.close()
        self._readers.clear()

    def __enter__(self: S) -> S:
        return self

    def __exit__(
        self,
        kind: Optional[Type[BaseException]],
        error: Optional[BaseException],
        trace: Optional[TracebackType],
    ) -> None:
        self.close()

    def _open(self, name: str) -> Reader[Any]:
        reader = self._read(TOPICS.get(name) or self._described(name))
        self._readers.append(reader)
        return reader

    def _described(self, name: str) -> TopicEntry:
        """A topic that is in no table, as it describes itself."""
        raise Unread(f"there is no topic `{name}`; the topics are {' '.join(TOPICS)}")

    def _read(self, entry: TopicEntry) -> Reader[Any]:
        raise NotImplementedError
