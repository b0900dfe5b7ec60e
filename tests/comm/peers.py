"""Plays a transcript against `lager station` or `lager comm`.

Written from the document's grammar alone (G1-G10): it shares no code with the programs it talks to,
and uses only Python's own library. Every line that it hears must be one of that grammar.

    peers.py TRANSCRIPT --robot HOST:PORT --gag SOCKET     plays a robot and a GaG at a station
    peers.py TRANSCRIPT --robert                           plays a Robert for a robot

A Robert prints its address, and begins when it reads a line. A transcript has a step on each line:

    # a remark
    robot connects            robert: the next robot has connected
    robot > karta             the peer sends this line
    robot > 32 times karta    it sends the line so often, without waiting for answers
    robot >> karta            the same, with CR before LF
    robot ~ kar               it sends these bytes without the end of the line
    robot < karta 2 2 0 0     it hears this next; `*` at the end stands for any text
    robot < 2 times karta 1*  it hears that so often
    robot hears nothing       for half a second
    robot passes over karta   from now on, it skips such lines while it waits for others
    robot is closed           by the other side
    robot leaves              it closes its connection
    pause 0.3                 nobody sends anything for this time, in s

Telemetry and lines that are no question of the document may come at any time, so a peer that waits
for another line skips them.
"""

import re
import socket
import sys
import time

WATCHDOG = 120
QUIET = 0.5

INT = r"\d+"
COORD = rf"{INT} {INT}"
DIRECTION = "(left|up|right|down)"
TELEMETRY = rf"thought .*|set_robot {COORD}|set_heading {DIRECTION}"
QUERY = "sidelength|karta|prodlist?|fetchprod|armcomm|styrcomm"
COMMAND = r"armcomm 1111\d{4}|styrcomm 0000\d{4}"
PRODUCTS = rf"prodlist? {INT}( {INT} {COORD} {DIRECTION})*"
ANSWER = rf"sidelength {INT}|karta {COORD} {COORD}|{PRODUCTS}|fetchprod {INT}|{COMMAND}|pickup_done"
# The lines that each peer may hear. A robot's first line is outside the document and is ignored.
HEARS = {
    "robot": ANSWER,
    "gag": f"{QUERY}|{TELEMETRY}",
    "robert": rf"{QUERY}|{TELEMETRY}|lager \d+ .*",
}
PASSED_OVER = ("thought ", "set_robot ", "set_heading ", "lager ")


class Peer:
    """One end of a connection that carries lines."""

    def __init__(self, name, connect):
        self.name, self.connect = name, connect
        self.stream, self.unread = None, b""
        self.passed_over = PASSED_OVER

    def connects(self):
        self.leaves()
        self.stream, self.unread = self.connect(), b""

    def leaves(self):
        if self.stream:
            self.stream.close()
        self.stream = None

    def says(self, text):
        self.stream.sendall(text.encode())

    def hears(self, patience):
        """The next line; None when the connection has ended."""
        until = time.monotonic() + patience
        while b"\n" not in self.unread:
            self.stream.settimeout(max(until - time.monotonic(), 0.001))
            try:
                more = self.stream.recv(4096)
            except ConnectionError:
                return None
            if not more:
                return None
            self.unread += more
        line, self.unread = self.unread.split(b"\n", 1)
        line = line.decode()
        print(f"  {self.name:>6} < {line}", flush=True)
        allowed = re.fullmatch(HEARS[self.name], line)
        assert allowed, f"{line!r} is no line of the document"
        products = re.fullmatch(PRODUCTS, line)
        if products:
            words = line.split(" ")
            assert len(words) == 2 + 4 * int(words[1]), f"{line!r} has another number of products"
        return line

    def hears_next(self, wanted):
        while True:
            line = self.hears(WATCHDOG)
            assert line is not None, f"closed instead of {wanted!r}"
            if line == wanted or wanted.endswith("*") and line.startswith(wanted[:-1]):
                return
            assert line.startswith(self.passed_over), f"{line!r} instead of {wanted!r}"

    def hears_nothing(self):
        until = time.monotonic() + QUIET
        while time.monotonic() < until:
            try:
                line = self.hears(until - time.monotonic())
            except TimeoutError:
                return
            assert line and line.startswith(self.passed_over), f"{line!r} instead of nothing"

    def is_closed(self):
        while (line := self.hears(WATCHDOG)) is not None:
            assert line.startswith(self.passed_over), f"{line!r} instead of an end"


def tcp(address):
    host, port = address.rsplit(":", 1)
    return lambda: socket.create_connection((host, int(port)), WATCHDOG)


def unix(path):
    def connect():
        stream = socket.socket(socket.AF_UNIX)
        stream.settimeout(WATCHDOG)
        stream.connect(path)
        return stream

    return connect


def robert():
    listener = socket.create_server(("127.0.0.1", 0))
    listener.settimeout(WATCHDOG)
    print(f"listens at 127.0.0.1:{listener.getsockname()[1]}", flush=True)
    return lambda: listener.accept()[0]


def play(peers, step):
    if step.startswith("pause "):
        return time.sleep(float(step.split(" ")[1]))
    name, what = re.split(" +", step, maxsplit=1)
    peer = peers[name]
    kind, _, text = what.partition(" ")
    often = re.fullmatch(r"(\d+) times (.*)", text)
    times, text = (int(often[1]), often[2]) if often else (1, text)
    match kind:
        case ">":
            peer.says((text + "\n") * times)
        case "passes":
            peer.passed_over += (text.removeprefix("over "),)
        case ">>":
            peer.says(text + "\r\n")
        case "~":
            peer.says(text)
        case "<":
            for _ in range(times):
                peer.hears_next(text)
        case _:
            getattr(peer, what.replace(" ", "_"))()


def main(transcript, *flags):
    if flags == ("--robert",):
        peers = {"robert": Peer("robert", robert())}
        sys.stdin.readline()
    else:
        flags = dict(zip(flags[::2], flags[1::2]))
        peers = {
            "robot": Peer("robot", tcp(flags["--robot"])),
            "gag": Peer("gag", unix(flags["--gag"])),
        }
    for number, line in enumerate(open(transcript, encoding="utf-8"), 1):
        # Blanks at the end would be part of the line that is sent.
        step = line.rstrip("\n")
        if step.strip() and not step.startswith("#"):
            print(f"{number:4} {step}", flush=True)
            play(peers, step)
    print("the transcript is played", flush=True)


main(*sys.argv[1:])
