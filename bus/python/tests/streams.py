"""The laws of loss accounting, as `bus/ports/src/streams.rs` tests them."""

from lagerrobot import layouts
from lagerrobot._streams import Streams


def lost(*stamps):
    """After (writer, epoch, sequence) each, of a reader that was attached at 100 ns."""
    streams = Streams(100)
    for writer, epoch, sequence in stamps:
        stamp = layouts.Stamp(writer=writer, epoch=epoch, sequence=sequence, publish_time_ns=epoch)
        streams.note(stamp)
    assert streams.received == len(stamps)
    return streams.lost


assert lost((1, 200, 0), (1, 200, 1), (1, 200, 5)) == 3, "a gap is counted"
assert lost((1, 200, 7)) == 7, "a younger stream is missed from its beginning"
assert lost((1, 50, 7), (1, 50, 8)) == 0, "an older stream begins where it is heard"
assert lost((1, 200, 9), (2, 300, 0)) == 9, "a restarted writer is no loss"
assert lost((1, 200, 0), (1, 300, 0)) == 0, "nor is one with the same process id"
assert lost((1, 200, 0), (1, 200, 0), (1, 200, 1)) == 0, "a repeated sample is no loss"
assert lost((1, 200, 0), (1, 200, 9), (1, 200, 1), (1, 200, 2)) == 0, "a false gap is withdrawn"
assert lost((1, 200, 0), (1, 200, 999), (1, 200, 3), (1, 200, 4)) == 2, "the true gap is counted"
assert lost((1, 200, 0), (1, 200, 2**64 - 1), (1, 200, 1)) == 0, "nobody sends that many"
assert lost(*((writer, 200, 0) for writer in range(200)), (0, 200, 5)) == 5, "128 are remembered"
