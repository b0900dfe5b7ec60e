"""Commands: what a person says to the robot, said by the program `lager`.

A Python program cannot ring the robot's services, and the arbiter takes only orders that are
renewed. So nothing is written to the bus from here: `lager` gives the command, with all its checks,
and its answer is handed on.
"""

from __future__ import annotations

import subprocess
from typing import List

from ._errors import Refused

COMMANDS = (
    "stop",
    "resume",
    "mode",
    "fetch",
    "queue",
    "pick",
    "picked",
    "reset",
    "press",
    "place",
    "obstacle",
    "drive",
    "arm",
    "gains",
    "calibrate",
)


def give(lager: str, robot: str, folder: str, words: List[str]) -> str:
    """Runs `lager` and returns what it says."""
    if not words or words[0] not in COMMANDS:
        said = " ".join(words)
        raise Refused(f"`{said}` is no command to a robot; those are {' '.join(COMMANDS)}")
    command = [lager, "--name", robot, "--bus", folder, *words]
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=False)
    except FileNotFoundError as error:
        raise Refused(
            f"there is no program `{lager}`, which gives commands: `cargo install --path "
            "services/lager`, in the project's folder, installs it, and Robot(..., lager=PATH) "
            "names one that lies elsewhere"
        ) from error
    except OSError as error:
        raise Refused(
            f"`{lager}` cannot be started ({error.strerror}); Robot(..., lager=PATH) names another"
        ) from error
    if done.returncode != 0:
        raise Refused(done.stderr.strip() or f"`{' '.join(command)}` ended with {done.returncode}")
    return done.stdout.strip()
