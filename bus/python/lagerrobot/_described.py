"""The layout of a topic that is in no table, from what its creator says of it on the bus.

    Weather{wind:u32,sky:Sky<Clear,Cloudy,7=Fog>,gusts:[Gust{mm_s:u16,sky:Sky};4]}

`bus/topics/src/description.rs` writes and reads the same. The text comes from another process and may
be anything.
"""

from __future__ import annotations

import ctypes
import enum
import keyword
import re
from typing import Any, Dict, List, NamedTuple, Optional, Tuple, Type, cast

from ._layout import Layout

_NUMBERS: Dict[str, Any] = {
    "u8": ctypes.c_uint8,
    "u16": ctypes.c_uint16,
    "u32": ctypes.c_uint32,
    "u64": ctypes.c_uint64,
    "i8": ctypes.c_int8,
    "i16": ctypes.c_int16,
    "i32": ctypes.c_int32,
    "i64": ctypes.c_int64,
    "f32": ctypes.c_float,
    "f64": ctypes.c_double,
}
_DEEPEST = 16
_WORD = re.compile(r"\w+")


class NotReadable(ValueError):
    """A text that describes no payload."""


class _Kind(NamedTuple):
    """A type as ctypes and as numpy have it, and the enum that its bytes mean."""

    ctype: Any
    format: Any
    variants: Optional[Type[enum.IntEnum]] = None


def layout(text: str) -> Type[Layout]:
    """The class of the payloads that `text` describes."""
    parser = _Parser(text)
    kind = parser.kind(0)
    if parser.at < len(text) or not issubclass(kind.ctype, Layout):
        raise NotReadable(f"a struct and the end should be at byte {parser.at}")
    return cast("Type[Layout]", kind.ctype)


class _Parser:
    def __init__(self, text: str) -> None:
        self.text = text
        self.at = 0
        self.known: Dict[str, _Kind] = {}

    def kind(self, depth: int) -> _Kind:
        if depth > _DEEPEST:
            raise NotReadable("types are nested too deep")
        if self.takes("["):
            element = self.kind(depth + 1)
            self.must(";")
            length = self.number()
            self.must("]")
            try:
                of = element.ctype * length
            except (ValueError, OverflowError) as error:
                raise NotReadable(f"a list of {length}") from error
            return _Kind(of, (element.format, (length,)), element.variants)
        name = self.word()
        if name in _NUMBERS:
            return _Kind(_NUMBERS[name], f"<{name[0]}{int(name[1:]) // 8}")
        if self.takes("{"):
            kind = self.record(name, depth)
        elif self.takes("<"):
            kind = self.tag(name)
        elif name in self.known:
            return self.known[name]
        else:
            raise NotReadable(f"what `{name}` has should be at byte {self.at}")
        self.known[name] = kind
        return kind

    def record(self, name: str, depth: int) -> _Kind:
        fields: List[Tuple[str, _Kind]] = []
        while True:
            field = _free(self.word())
            self.must(":")
            fields.append((field, self.kind(depth + 1)))
            if self.takes("}"):
                break
            self.must(",")
        sizes = [ctypes.sizeof(kind.ctype) for _, kind in fields]
        dtype = {
            "names": [field for field, _ in fields],
            "formats": [kind.format for _, kind in fields],
            "offsets": [sum(sizes[:place]) for place in range(len(sizes))],
            "itemsize": sum(sizes),
        }
        members = {
            "_type_name_": f"lager::{name}",
            "_hash_": 0,
            "_fields_": [(field, kind.ctype) for field, kind in fields],
            "_enums_": {field: kind.variants for field, kind in fields if kind.variants},
            "_dtype_": dtype,
        }
        try:
            made = type(name, (Layout,), members)
        except (TypeError, ValueError) as error:
            raise NotReadable(f"`{name}` is no struct: {error}") from error
        # Payloads have no gaps.
        if ctypes.sizeof(cast(Any, made)) != sum(sizes):
            raise NotReadable(f"`{name}` would have gaps")
        return _Kind(made, dtype)

    def tag(self, name: str) -> _Kind:
        variants: List[Tuple[str, int]] = []
        code = 0
        while not self.takes(">"):
            word = self.word()
            if self.takes("="):
                if not word.isdecimal():
                    raise NotReadable(f"`{word}` is no code")
                code, word = int(word), self.word()
            if code > 255:
                raise NotReadable(f"the code of `{word}` is above 255")
            variants.append((_free(word), code))
            code += 1
            if not self.takes(","):
                self.must(">")
                break
        # Type checkers know only enums whose names stand in the source.
        make: Any = enum.IntEnum
        try:
            return _Kind(ctypes.c_uint8, "<u1", make(name, variants))
        except (TypeError, ValueError) as error:
            raise NotReadable(f"`{name}` is no enum: {error}") from error

    def word(self) -> str:
        found = _WORD.match(self.text, self.at)
        if found is None:
            raise NotReadable(f"a name should be at byte {self.at}")
        self.at = found.end()
        return found.group()

    def number(self) -> int:
        word = self.word()
        if not word.isdecimal() or int(word) == 0:
            raise NotReadable(f"`{word}` is no length")
        return int(word)

    def takes(self, mark: str) -> bool:
        is_there = self.text.startswith(mark, self.at)
        self.at += len(mark) if is_there else 0
        return is_there

    def must(self, mark: str) -> None:
        if not self.takes(mark):
            raise NotReadable(f"`{mark}` should be at byte {self.at}")


def _free(name: str) -> str:
    """A name that Python has no other use for, as `layouts` has them."""
    return f"{name}_" if keyword.iskeyword(name) else name
