"""ROS's own classes, by the names of their types."""

from importlib import import_module


def named(kind):
    """The class of `sensor_msgs/msg/Range`."""
    package, _, name = kind.split("/")
    return getattr(import_module(f"{package}.msg"), name)
