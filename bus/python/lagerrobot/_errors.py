"""What can go wrong; each message says what to do."""


class BusError(Exception):
    """Every error of this package."""


class NoBus(BusError):
    """There is no bus where this user's would be, or it cannot be used."""


class OtherLayout(BusError):
    """A topic on the bus has another layout than this package."""


class OtherVersion(BusError):
    """The installed iceoryx2 is not the one of the bus."""


class Released(BusError):
    """A view was used after its sample had been given back."""


class NoRecording(BusError):
    """A file is no recording, or cannot be read."""


class NotOperator(BusError):
    """A command was given through a robot that was opened to look at."""


class Refused(BusError):
    """The robot, or `lager`, has refused a command; the message is its own sentence."""


class Unread(BusError):
    """A topic could not be opened or read."""
