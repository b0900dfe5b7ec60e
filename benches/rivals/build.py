"""The rivals: what each needs, how it is built, and what it says of lost samples."""

import glob
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass, field

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(os.path.dirname(HERE))
TARGET = os.environ.get("CARGO_TARGET_DIR", os.path.join(ROOT, "target"))
MADE = os.path.join(TARGET, "rivals")
VENV = os.path.join(MADE, "venv")
STRICT = ["-std=c++17", "-O2", "-Wall", "-Wextra", "-Werror", "-pthread"]
ECAL = "6.1.1"


class Absent(Exception):
    """A rival that cannot be installed or built, and why."""


@dataclass
class Rival:
    key: str
    name: str
    # The file that joins main.cpp, without its ending.
    source: str
    kind: str = ""
    packages: list[str] = field(default_factory=list)
    wheels: list[str] = field(default_factory=list)
    # Readies what the compiler needs, and gives its words.
    flags: Callable[[], list[str]] = list
    # What it says of lost samples: their `exact` number, that `some` are lost or too small a number,
    # or `never` anything.
    tells: str = "never"
    # The size of its small sample in bytes.
    small: int = 64
    daemon: list[str] | None = None
    # The process's variables; {folder} is the measurement's.
    variables: dict[str, str] = field(default_factory=dict)
    # It goes by datagrams that nobody repeats.
    large_may_be_lost: bool = False
    of: str = ""

    @property
    def program(self) -> str:
        return os.path.join(MADE, self.source)

    def environment(self, folder: str) -> dict[str, str]:
        return {key: value.replace("{folder}", folder) for key, value in self.variables.items()}

    def version(self) -> str:
        if self.wheels:
            return ", ".join(f"{wheel.replace('==', ' ')} (PyPI)" for wheel in self.wheels[:2])
        if self.packages:
            asked = ["dpkg-query", "-W", "-f", "${Package} ${Version} (Debian) ", self.packages[0]]
            return subprocess.run(asked, capture_output=True, text=True, check=False).stdout.strip()
        return self.of


def done(command: list[str], what: str, **more) -> None:
    """Runs a command; its last line is the reason if it fails."""
    try:
        ended = subprocess.run(command, capture_output=True, text=True, check=False, **more)
    except FileNotFoundError:
        raise Absent(f"{what}: there is no {command[0]}") from None
    if ended.returncode != 0:
        lines = [
            line for line in (ended.stderr or ended.stdout).strip().splitlines() if line.strip()
        ]
        errors = [line for line in lines if "error" in line.lower()]
        raise Absent(f"{what}: {(errors or lines or ['failed'])[0].strip()[:160]}")


def installed(packages: list[str]) -> None:
    absent = [
        package
        for package in packages
        if "ok installed"
        not in subprocess.run(
            ["dpkg-query", "-W", "-f", "${Status}", package],
            capture_output=True,
            text=True,
            check=False,
        ).stdout
    ]
    if not absent:
        return
    if os.geteuid() != 0:
        raise Absent(f"apt-get install {' '.join(absent)} needs root")
    print(f"installing {' '.join(absent)}", file=sys.stderr)
    quietly = os.environ | {"DEBIAN_FRONTEND": "noninteractive"}
    done(["apt-get", "install", "-y", "--no-install-recommends", *absent], "apt-get", env=quietly)


def with_wheels(wheels: list[str]) -> None:
    marks = os.path.join(VENV, "installed")
    kept = open(marks, encoding="utf-8").read().split() if os.path.exists(marks) else []
    absent = [wheel for wheel in wheels if wheel not in kept]
    if not absent:
        return
    if not os.path.exists(VENV):
        done([os.environ.get("PYTHON", "python3"), "-m", "venv", VENV], "venv")
    print(f"installing {' '.join(absent)}", file=sys.stderr)
    done([os.path.join(VENV, "bin/pip"), "install", "--quiet", *absent], "pip")
    with open(marks, "w", encoding="utf-8") as file:
        file.write("\n".join(kept + absent))


def site() -> str:
    found = glob.glob(os.path.join(VENV, "lib/python3*/site-packages"))
    return found[0] if found else VENV


def build(rival: Rival) -> None:
    installed(["g++", "iproute2", *rival.packages])
    with_wheels(rival.wheels)
    os.makedirs(MADE, exist_ok=True)
    flags = rival.flags()
    source = os.path.join(HERE, f"{rival.source}.cpp")
    inputs = [source, *(os.path.join(HERE, name) for name in ("main.cpp", "rival.h", "build.py"))]
    inputs += [word for word in flags if word.endswith((".a", ".o"))]
    newest = max(os.path.getmtime(one) for one in inputs)
    if os.path.exists(rival.program) and os.path.getmtime(rival.program) > newest:
        return
    main = os.path.join(HERE, "main.cpp")
    done(["g++", *STRICT, main, source, "-o", rival.program, *flags], rival.source)


def cyclone() -> list[str]:
    idl = os.path.join(HERE, "cyclone.idl")
    done(["idlc", "-l", "c", idl], "idlc", cwd=MADE)
    made = os.path.join(MADE, "cyclone.o")
    if not os.path.exists(made) or os.path.getmtime(made) < os.path.getmtime(idl):
        done(["gcc", "-O2", "-c", os.path.join(MADE, "cyclone.c"), "-o", made], "cyclone.c")
    return [made, "-isystem", MADE, "-lddsc"]


def in_wheels(*libraries: str) -> list[str]:
    folder = os.path.join(VENV, "lib")
    # Their own dependencies lie in other folders, which LD_LIBRARY_PATH names.
    return [f"-L{folder}", *(f"-l{one}" for one in libraries), "-Wl,--allow-shlib-undefined"]


def fastdds() -> list[str]:
    return ["-isystem", os.path.join(VENV, "include"), *in_wheels("fastdds", "fastcdr")]


def ros() -> list[str]:
    # Each package's headers have a folder of their own.
    folders = glob.glob(os.path.join(VENV, "include", "*"))
    headers = [word for folder in folders for word in ("-isystem", folder)]
    kinds = [
        f"{package}__rosidl_{kind}_c"
        for package in ("geometry_msgs", "std_msgs")
        for kind in ("generator", "typesupport")
    ]
    return [*headers, *in_wheels("rcl", "rcutils", "rmw", "rosidl_runtime_c", *kinds)]


def libraries() -> str:
    return ":".join([os.path.join(VENV, "lib"), *glob.glob(os.path.join(site(), "*.libs"))])


def python_library() -> str:
    """The wheels' libraries were linked for a Python process, which has this one."""
    import sysconfig

    folder = sysconfig.get_config_var("LIBDIR")
    name = sysconfig.get_config_var("INSTSONAME") or ""
    return os.path.join(folder, name) if ".so" in name else ""


def ecal() -> list[str]:
    # The wheel has the library and no headers.
    sources = os.environ.get("ECAL_SOURCE", os.path.join(MADE, "ecal"))
    if not os.path.exists(sources):
        url = "https://github.com/eclipse-ecal/ecal"
        done(
            ["git", "clone", "--quiet", "--depth", "1", "--branch", f"v{ECAL}", url, sources],
            "eCAL's headers",
        )
    library = os.path.join(site(), "ecal")
    headers = os.path.join(sources, "ecal/core/include")
    # Its own build fills in this one.
    with open(os.path.join(sources, "ecal/core/src/defs.h.in"), encoding="utf-8") as file:
        defined = file.read()
    for part, number in zip(("MAJOR", "MINOR", "PATCH"), ECAL.split(".")):
        defined = defined.replace(f"@GIT_REVISION_{part}@", number)
    made = os.path.join(MADE, "ecal-made")
    os.makedirs(os.path.join(made, "ecal"), exist_ok=True)
    with open(os.path.join(made, "ecal/defs.h"), "w", encoding="utf-8") as file:
        file.write(re.sub("@.*?@", "", defined))
    return [
        "-isystem",
        made,
        "-isystem",
        headers,
        f"-L{library}",
        "-l:libecal_core.so.6",
        f"-Wl,-rpath,{library}",
    ]


def rust() -> list[str]:
    command = [
        "cargo",
        "build",
        "--release",
        "--locked",
        "-p",
        "lager-benches",
        "--example",
        "rivals",
    ]
    done([*command, "--features", "rivals"], "cargo", cwd=ROOT)
    return [os.path.join(TARGET, "release/examples/librivals.a"), "-ldl", "-lm"]


def of_crate(name: str) -> str:
    with open(os.path.join(ROOT, "Cargo.lock"), encoding="utf-8") as file:
        _, _, rest = file.read().partition(f'name = "{name}"\nversion = "')
    return f"{name} {rest.partition(chr(34))[0]} (crates.io)"


# The loopback only, and places for 33 processes.
CYCLONE = (
    "<CycloneDDS><Domain><General><Interfaces>"
    '<NetworkInterface name="lo" multicast="true"/></Interfaces>'
    "</General><Discovery><MaxAutoParticipantIndex>120</MaxAutoParticipantIndex></Discovery>"
    "<SharedMemory><Enable>{enabled}</Enable><LogLevel>error</LogLevel></SharedMemory>"
    "</Domain></CycloneDDS>"
)
ROUDI = [
    shutil.which("iox-roudi") or "/usr/bin/iox-roudi",
    "--monitoring-mode",
    "off",
    "--log-level",
    "error",
]
ROS = [
    "ros-rcl==10.1.3",
    "ros-rmw-fastrtps-cpp==9.3.3",
    "ros-geometry-msgs==5.5.1",
    "ros-std-msgs==5.5.1",
]
FASTDDS = ["ros-fastdds==3.2.3"]
CYCLONE_PACKAGES = ["cyclonedds-dev", "cyclonedds-tools", "gcc"]
ICEORYX_PACKAGES = ["iceoryx", "libiceoryx-posh-dev", "libiceoryx-hoofs-dev"]

RIVALS = [
    Rival("floor", "a futex and a page (floor)", "floor", tells="exact", of="no middleware"),
    Rival(
        "lager-actor", "lager, an actor", "rust", "actor", flags=rust, tells="exact", of="this tree"
    ),
    Rival(
        "lager-watcher",
        "lager, a watcher",
        "rust",
        "watcher",
        flags=rust,
        tells="exact",
        of="this tree",
    ),
    Rival("iceoryx2", "bare iceoryx2", "rust", "iceoryx2", flags=rust, of=of_crate("iceoryx2")),
    Rival("zenoh", "Zenoh, Unix socket", "rust", "zenoh", flags=rust, of=of_crate("zenoh")),
    Rival(
        "zenoh-shm", "Zenoh, shared memory", "rust", "zenoh-shm", flags=rust, of=of_crate("zenoh")
    ),
    Rival(
        "iceoryx",
        "iceoryx (classic)",
        "iceoryx",
        packages=ICEORYX_PACKAGES,
        flags=lambda: [
            "-isystem",
            glob.glob("/usr/include/iceoryx/*")[0],
            "-liceoryx_posh",
            "-liceoryx_hoofs",
            "-liceoryx_platform",
            "-latomic",
        ],
        tells="some",
        daemon=ROUDI,
    ),
    Rival(
        "cyclone",
        "Cyclone DDS",
        "cyclone",
        packages=CYCLONE_PACKAGES,
        flags=cyclone,
        variables={"CYCLONEDDS_URI": CYCLONE.replace("{enabled}", "false")},
    ),
    Rival(
        "cyclone-iceoryx",
        "Cyclone DDS with iceoryx",
        "cyclone",
        packages=[*CYCLONE_PACKAGES, "iceoryx"],
        flags=cyclone,
        daemon=ROUDI,
        variables={"CYCLONEDDS_URI": CYCLONE.replace("{enabled}", "true")},
    ),
    Rival(
        "fastdds",
        "Fast DDS",
        "fastdds",
        wheels=FASTDDS,
        flags=fastdds,
        tells="exact",
        variables={"LD_LIBRARY_PATH": libraries()},
    ),
    Rival(
        "ros2",
        "ROS 2 kilted (rcl, Fast DDS)",
        "ros",
        wheels=ROS,
        flags=ros,
        tells="some",
        small=56,
        variables={
            "LD_LIBRARY_PATH": libraries(),
            "LD_PRELOAD": python_library(),
            "AMENT_PREFIX_PATH": VENV,
            "RMW_IMPLEMENTATION": "rmw_fastrtps_cpp",
            "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
            "ROS_LOG_DIR": "{folder}",
        },
    ),
    Rival("ecal", "eCAL", "ecal", wheels=[f"eclipse-ecal=={ECAL}"], flags=ecal, tells="some"),
    Rival("zeromq", "ZeroMQ", "zeromq", packages=["libzmq3-dev"], flags=lambda: ["-lzmq"]),
    Rival("nng", "nng", "nng", packages=["libnng-dev"], flags=lambda: ["-lnng"]),
    Rival(
        "lcm",
        "LCM",
        "lcm",
        packages=["liblcm-dev"],
        flags=lambda: ["-llcm"],
        large_may_be_lost=True,
    ),
]
