"""Prints every layout as ctypes and as numpy find it, and where this package looks for a bus."""

import ctypes
import json
import sys

import numpy

from lagerrobot import _place, _robot, layouts


def by_ctypes(cls):
    fields = {rusts(name): offset_and_size(getattr(cls, name)) for name, _ in cls._fields_}
    return {"size": ctypes.sizeof(cls), "align": ctypes.alignment(cls), "fields": fields}


def rusts(name):
    """`from_` is `from` in Rust."""
    return name.rstrip("_")


def offset_and_size(field):
    return [field.offset, field.size]


def by_numpy(cls):
    dtype = cls.dtype()
    fields = {
        rusts(name): [offset, inner.itemsize] for name, (inner, offset) in dtype.fields.items()
    }
    assert numpy.zeros(1, dtype).nbytes == dtype.itemsize
    return {"size": dtype.itemsize, "fields": fields}


place = _place.find(sys.argv[1])
classes = [cls for cls in vars(layouts).values() if isinstance(cls, type(layouts.Stamp))]
classes = [cls for cls in classes if cls is not layouts.Layout]
print(
    json.dumps(
        {
            "prefix": place.prefix,
            "root": place.root,
            "iceoryx2": _robot.ICEORYX2,
            "observers": _robot._OBSERVERS,
            "ctypes": {cls._type_name_: by_ctypes(cls) for cls in classes},
            "numpy": {cls._type_name_: by_numpy(cls) for cls in classes},
            "hashes": {cls._type_name_: f"{cls._hash_:016x}" for cls in classes},
        }
    )
)
