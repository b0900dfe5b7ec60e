"""What the generated layouts are made of."""

from __future__ import annotations

import ctypes
import enum
from typing import (
    TYPE_CHECKING,
    Any,
    ClassVar,
    Dict,
    NamedTuple,
    Optional,
    Sequence,
    Tuple,
    Type,
    TypeVar,
)

L = TypeVar("L", bound="Layout")
S = TypeVar("S", bound="_Structure")

if TYPE_CHECKING:
    # To type checkers a ctypes structure has every attribute, so a misspelt field would pass.
    class _Structure:
        _fields_: ClassVar[Sequence[Tuple[str, Any]]]

        def __init__(self, *args: Any, **fields: Any) -> None: ...
        def __bytes__(self) -> bytes: ...
        @classmethod
        def from_address(cls: Type[S], address: int) -> S: ...
        @classmethod
        def from_buffer_copy(cls: Type[S], source: Any) -> S: ...

else:
    _Structure = ctypes.Structure


class Layout(_Structure):
    """A payload, or a struct inside one. An instance that a program makes is its own copy."""

    _type_name_: ClassVar[str]
    _hash_: ClassVar[int]
    _enums_: ClassVar[Dict[str, Type[enum.IntEnum]]]
    _dtype_: ClassVar[Any]

    @classmethod
    def type_name(cls) -> str:
        """The type's name on the bus, in every language."""
        return cls._type_name_

    @classmethod
    def dtype(cls) -> Any:
        """The numpy dtype of the same layout; needs numpy."""
        import numpy

        return numpy.dtype(cls._dtype_)

    def copy(self: L) -> L:
        """A copy that is the caller's own."""
        return type(self).from_buffer_copy(self)

    def array(self) -> Any:
        """A copy as a numpy array of one element; needs numpy."""
        import numpy

        return numpy.frombuffer(bytes(self), dtype=self.dtype())

    def __repr__(self) -> str:
        names = [field[0] for field in self._fields_ if field[0] != "reserved"]
        shown = (f"{name}={self._shown(name)}" for name in names)
        return f"{type(self).__name__}({', '.join(shown)})"

    def _shown(self, name: str) -> str:
        value = getattr(self, name)
        if name in self._enums_ and isinstance(value, int):
            known = [variant.name for variant in self._enums_[name] if variant == value]
            return known[0] if known else str(value)
        return repr(list(value)) if isinstance(value, ctypes.Array) else repr(value)


class Qos(NamedTuple):
    """The limits of a topic, as the table has them."""

    buffer: int
    history: int
    max_publishers: int
    max_subscribers: int
    max_nodes: int


class TopicEntry(NamedTuple):
    """One line of the table of topics; without limits a topic that is in no table."""

    name: str
    payload: Type[Layout]
    qos: Optional[Qos] = None
    summary: str = ""
