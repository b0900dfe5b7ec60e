"""A simulated robot with its node of ROS 2, each test's own; and programs of ROS 2 beside it."""

import atexit
import glob
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time

LAGER = os.environ["LAGER"]
PROGRAM = os.environ["LAGER_ROS2"]
# What a step may take on a busy machine, in seconds; nobody waits so long for what comes.
PATIENCE = 60.0


def until(what, found, patience=PATIENCE):
    """Waits until `found` returns something, and returns that."""
    end = time.monotonic() + patience
    while True:
        result = found()
        if result:
            return result
        if time.monotonic() > end:
            raise AssertionError(f"waited in vain for {what}")
        time.sleep(0.02)


class Process:
    """A program whose lines are kept."""

    def __init__(self, command, env=None):
        self.child = subprocess.Popen(
            [str(part) for part in command],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            env={**os.environ, **(env or {})},
        )
        self.lines = []
        self.reader = threading.Thread(target=self._read, daemon=True)
        self.reader.start()
        atexit.register(self.kill)

    def _read(self):
        for line in self.child.stdout:
            self.lines.append(line.rstrip("\n"))

    def line(self, words):
        """The first line with these words."""

        def found():
            for line in list(self.lines):
                if words in line:
                    return line
            if self.child.poll() is not None and not self.reader.is_alive():
                raise AssertionError(f"it ended without {words!r}: {self.lines}")
            return None

        return until(f"{words!r} in {self.lines[-3:]}", found)

    def end(self, how=signal.SIGTERM):
        """Ends it in order; returns its exit code."""
        if self.child.poll() is None:
            self.child.send_signal(how)
        code = self.child.wait(PATIENCE)
        self.reader.join(PATIENCE)
        return code

    def kill(self):
        if self.child.poll() is None:
            self.child.kill()
            self.child.wait()


class Robot:
    """A simulated robot in a folder of its own."""

    def __init__(self, name="r1", mission=None, warehouse=None, folder=None):
        self.name = name
        # Short, as sockets live below it.
        self.folder = folder or tempfile.mkdtemp(prefix="lr", dir="/dev/shm")
        self.state = tempfile.mkdtemp(prefix="lager-ros2-")
        more = ["--mission", mission] if mission else []
        more += ["--warehouse", warehouse] if warehouse else []
        self.up = Process([*self.lager, "up", "--headless", *more])
        self.up.line("the steering board is connected")
        self.gateways = []

    @property
    def lager(self):
        flags = ["--name", self.name, "--bus", self.folder, "--state", self.state]
        return [LAGER, *flags]

    def run(self, *words):
        """Runs a subcommand and returns what it prints."""
        ran = subprocess.run([*self.lager, *words], capture_output=True, text=True, timeout=PATIENCE)
        assert ran.returncode == 0, ran.stderr
        return ran.stdout

    def gateway(self, domain, *flags, env=None, before=()):
        """Starts its node, after the words of a command that are `before`, and returns that once others can
        find it."""
        flags = ["--domain", domain, *flags] if domain is not None else flags
        gateway = Process([*before, *self.lager, "gateway", "--ros2", *flags], env)
        gateway.line("is the node")
        self.gateways.append(gateway)
        return gateway

    def end(self):
        for gateway in self.gateways:
            gateway.end()
        self.up.end()
        # The transport leaves a small segment of each bus, whose name begins with a number of its folder.
        prefix = re.search(r'^prefix = "(lager_.+)"$', self.run("config", "--iceoryx2"), re.MULTILINE)
        for segment in glob.glob(f"/dev/shm/{prefix.group(1)}*"):
            os.remove(segment)
        for folder in (self.folder, self.state):
            shutil.rmtree(folder, ignore_errors=True)


def peer(domain, *words):
    """A fresh program of ROS 2 (peer.py), which prints one line of JSON; returns that."""
    ran = subprocess.run(
        [sys.executable, "peer.py", *[str(word) for word in words]],
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        env={**os.environ, "ROS_DOMAIN_ID": str(domain)},
    )
    assert ran.returncode == 0, ran.stderr
    return json.loads(ran.stdout.splitlines()[-1])


def offset_ns(gateway):
    """What the node adds to a stamp of the bus."""
    return int(re.search(r"plus (-?\d+) ns", gateway.line("is the node")).group(1))


def domain():
    """A domain that no other test of this process has, beyond those that people use."""
    domain.last += 1
    return domain.last


domain.last = 60 + os.getpid() % 30
