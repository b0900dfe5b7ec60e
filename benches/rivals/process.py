"""A process of a measurement, and the network in which all of them run."""

import ctypes
import json
import os
import select
import signal
import subprocess
import sys
import tempfile

# How long to wait for a line: all of 32 processes of one middleware have to find each other.
PATIENCE_S = 30.0


class Failed(Exception):
    """A measurement that could not be made, and why."""


class Process:
    """A started program that speaks in lines."""

    def __init__(self, command: list[str], core: int | None, environment: dict[str, str]) -> None:
        self.name = os.path.basename(command[0])
        self.errors = tempfile.TemporaryFile()
        allowed = sorted(os.sched_getaffinity(0))
        # With one core, all share it.
        cores = {allowed[0]} if core == 0 else set(allowed[1:]) or set(allowed)

        def bind() -> None:
            # Dies with the script.
            ctypes.CDLL(None).prctl(1, signal.SIGKILL)
            if core is not None:
                os.sched_setaffinity(0, cores)

        self.process = subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE if core is not None else subprocess.DEVNULL,
            stderr=self.errors,
            env=os.environ | environment,
            preexec_fn=bind,
        )
        self.rest = b""

    def next_line(self) -> str:
        file = self.process.stdout.fileno()
        while b"\n" not in self.rest:
            ready, _, _ = select.select([file], [], [], PATIENCE_S)
            got = os.read(file, 65536) if ready else b""
            if not got:
                raise Failed(self.why("nothing came" if not ready else "it has ended"))
            self.rest += got
        line, self.rest = self.rest.split(b"\n", 1)
        return line.decode(errors="replace")

    def line(self, expected: str) -> None:
        # A middleware may print lines of its own.
        while (line := self.next_line()) != expected:
            if line.startswith("{"):
                raise Failed(self.why(f"{line} came instead of {expected}"))

    def json(self) -> dict:
        while not (line := self.next_line()).startswith("{"):
            pass
        return json.loads(line)

    def tell(self) -> None:
        try:
            self.process.stdin.write(b"\n")
            self.process.stdin.flush()
        except BrokenPipeError:
            raise Failed(self.why("it has ended")) from None

    def why(self, what: str) -> str:
        self.errors.seek(0)
        lines = self.errors.read().decode(errors="replace").strip().splitlines()
        # The last line of the bus, iceoryx2 and Zenoh refers to the one before.
        return f"{what}: {' | '.join(lines[-2:])[:400]}" if lines else what

    def end(self) -> None:
        if self.process.stdin and not self.process.stdin.closed:
            try:
                self.process.stdin.close()
            except BrokenPipeError:
                pass
        if self.process.stdout is None:
            self.process.terminate()
        try:
            self.process.wait(timeout=2)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        self.errors.close()


BUFFERS = ("/proc/sys/net/core/rmem_max", "/proc/sys/net/core/wmem_max")
BUFFER_BYTES = 16 << 20


def own_network(command: list[str]) -> int:
    """Goes on with `command` in a network of its own; its exit code."""
    before = {}
    try:
        for path in BUFFERS:
            with open(path, encoding="utf-8") as file:
                before[path] = int(file.read())
            if os.geteuid() == 0 and before[path] < BUFFER_BYTES:
                with open(path, "w", encoding="utf-8") as file:
                    file.write(str(BUFFER_BYTES))
        mapped = [] if os.geteuid() == 0 else ["--user", "--map-root-user"]
        return subprocess.run(
            ["unshare", *mapped, "--net", sys.executable, *command], check=False
        ).returncode
    finally:
        for path, bytes_ in before.items() if os.geteuid() == 0 else ():
            with open(path, "w", encoding="utf-8") as file:
                file.write(str(bytes_))


def ready_network() -> None:
    """Readies the loopback, with a way for multicast."""
    for words in ("link set lo up multicast on", "route add 224.0.0.0/4 dev lo"):
        subprocess.run(["ip", *words.split()], check=True)


def loopback_bytes() -> int:
    with open("/proc/self/net/dev", encoding="utf-8") as file:
        for line in file:
            name, _, rest = line.partition(":")
            if name.strip() == "lo":
                return int(rest.split()[8])
    return 0
