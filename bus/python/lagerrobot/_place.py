"""Where the bus lives: what `bus/home/src/home.rs` decides, for one who only reads.

Never makes a folder: where the robot's own programs have made none, there is nothing to read.
"""

from __future__ import annotations

import os
import stat
from typing import NamedTuple, Optional

_SYSTEM = "/run/lager"
_GENERATIONS = "0123456789abcdefghijklmnopqrstuvwxyz"


class Place(NamedTuple):
    """A bus's folder, and the generation that a new process joins."""

    folder: str
    generation: int

    @property
    def root(self) -> str:
        """Where the transport keeps its files."""
        return _transport(self.folder, self.generation)

    @property
    def prefix(self) -> str:
        """What the names of the bus's segments begin with."""
        letter = _GENERATIONS[self.generation] if self.generation else ""
        return f"{_stem(self.folder)}{letter}_"


def find(folder: Optional[str]) -> Place:
    """The bus in `folder`, or this user's own."""
    from ._errors import NoBus

    folder = folder if folder is not None else _own_folder()
    if not os.path.isabs(folder):
        raise NoBus(f"the bus's folder `{folder}` must be an absolute path")
    try:
        found = os.lstat(folder)
    except OSError as error:
        raise NoBus(
            f"there is no bus at {folder} ({error.strerror}); `lager up` starts a robot, and "
            "`bus=` names the folder that was given to `lager --bus`"
        ) from error
    if not stat.S_ISDIR(found.st_mode):
        raise NoBus(f"{folder} is not a folder; `bus=` takes the folder of `lager --bus`")
    if found.st_uid != os.geteuid():
        raise NoBus(f"{folder} belongs to UID {found.st_uid}; run this as that user")
    if found.st_mode & 0o077:
        raise NoBus(f"{folder} is open to others; `chmod 700 {folder}` closes it")
    folder = os.path.realpath(folder)
    return Place(folder, generation_in(folder))


def generation_in(folder: str) -> int:
    """The youngest generation there is."""
    for generation in reversed(range(len(_GENERATIONS))):
        if os.path.isdir(_transport(folder, generation)):
            return generation
    return 0


def _own_folder() -> str:
    try:
        found = os.lstat(_SYSTEM)
        if stat.S_ISDIR(found.st_mode) and found.st_uid == os.geteuid():
            return _SYSTEM
    except OSError:
        pass
    return f"/dev/shm/lager-{os.geteuid()}"


def _transport(folder: str, generation: int) -> str:
    name = f"iceoryx2-{_GENERATIONS[generation]}" if generation else "iceoryx2"
    return os.path.join(folder, name)


def _stem(folder: str) -> str:
    number = 0xCBF29CE484222325
    for byte in os.fsencode(folder):
        number = (number ^ byte) * 0x100000001B3 % (1 << 64)
    return f"lager_{number >> 32 ^ number & 0xFFFFFFFF:08x}"
