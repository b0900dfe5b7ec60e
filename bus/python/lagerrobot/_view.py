"""A look into shared memory that nobody can write through, and that ends with its sample."""

from __future__ import annotations

import ctypes
from typing import Any, Callable, Iterator


class View:
    """A struct or an array in a sample. Reads as the ctypes value would; cannot be written."""

    __slots__ = ("_alive", "_value")

    def __init__(self, value: Any, alive: Callable[[], None]) -> None:
        object.__setattr__(self, "_value", value)
        object.__setattr__(self, "_alive", alive)

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        self._alive()
        value = getattr(self._value, name)
        if callable(value):
            return self._while_alive(value)
        return self._inner(value)

    def __setattr__(self, name: str, value: Any) -> None:
        raise AttributeError(f"`{name}` lies in shared memory and is read-only; use copy()")

    def __getitem__(self, index: Any) -> Any:
        self._alive()
        value = self._value[index]
        return [self._inner(one) for one in value] if isinstance(value, list) else self._inner(value)

    def __len__(self) -> int:
        self._alive()
        return len(self._value)

    def __iter__(self) -> Iterator[Any]:
        for index in range(len(self)):
            yield self[index]

    def __bytes__(self) -> bytes:
        self._alive()
        return bytes(self._value)

    def __repr__(self) -> str:
        self._alive()
        return repr(self._value)

    def _while_alive(self, method: Callable[..., Any]) -> Callable[..., Any]:
        """A method that is no more when the sample is given back, whoever has kept it."""

        def called(*args: Any) -> Any:
            self._alive()
            return method(*args)

        return called

    def _inner(self, value: Any) -> Any:
        if isinstance(value, (ctypes.Structure, ctypes.Array)):
            return View(value, self._alive)
        return value
