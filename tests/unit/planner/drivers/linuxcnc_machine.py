"""LinuxCNC's own simulated machine, for tests: no display, an ordinary user, a body by a component.

LinuxCNC runs a driver as its display, and ends when that ends. The component ``body`` closes the
probe where the tip is in the body; it looks every 0.2 ms, as well as the system lets it.
"""

import json
import os
import shutil
import subprocess
from pathlib import Path

ROOT = Path(__file__).parents[4]
PYTHON = "/usr/bin/python3"

_HAL = """\
loadrt trivkins
loadrt motmod base_period_nsec=0 servo_period_nsec=1000000 num_joints=3
addf motion-command-handler servo-thread
addf motion-controller servo-thread
loadusr -W ./body.py
net x joint.0.motor-pos-cmd => joint.0.motor-pos-fb body.x
net y joint.1.motor-pos-cmd => joint.1.motor-pos-fb body.y
net z joint.2.motor-pos-cmd => joint.2.motor-pos-fb body.z
net probe body.closed => motion.probe-input
net estop iocontrol.0.user-enable-out iocontrol.0.emc-enable-in
net prepare iocontrol.0.tool-prepare iocontrol.0.tool-prepared
net change iocontrol.0.tool-change iocontrol.0.tool-changed
"""

# sd(p) is the signed distance of the centre of the tip from contact.
_BODY = """\
#!/usr/bin/python3
import math
import time

import hal

BALL, BOX, HALF = (30.0, 40.0, -30.0), (-40.0, 0.0, -40.0), (15.0, 10.0, 10.0)


def sd(p):
    ball = math.dist(p, BALL) - 20.0
    over = [abs(a - b) - h for a, b, h in zip(p, BOX, HALF)]
    outside = math.hypot(*(max(o, 0.0) for o in over))
    box = outside + min(max(over), 0.0) - 1.0
    return min(ball, box)


part = hal.component("body")
for axis in "xyz":
    part.newpin(axis, hal.HAL_FLOAT, hal.HAL_IN)
part.newpin("closed", hal.HAL_BIT, hal.HAL_OUT)
part.newpin("slowest", hal.HAL_FLOAT, hal.HAL_OUT)
part.ready()
last = time.monotonic()
try:
    while True:
        part["closed"] = sd([part[axis] for axis in "xyz"]) < 0.0
        now = time.monotonic()
        part["slowest"] = max(part["slowest"], now - last)
        last = now
        time.sleep(0.0002)
except KeyboardInterrupt:
    pass
"""

_INI = """\
[EMC]
VERSION = 1.1
MACHINE = touch
[DISPLAY]
DISPLAY = ./display.py
[TASK]
TASK = milltask
CYCLE_TIME = 0.001
[RS274NGC]
PARAMETER_FILE = m.var
[EMCMOT]
EMCMOT = motmod
COMM_TIMEOUT = 1.0
SERVO_PERIOD = 1000000
[EMCIO]
EMCIO = io
CYCLE_TIME = 0.100
[HAL]
HALFILE = m.hal
[TRAJ]
COORDINATES = X Y Z
LINEAR_UNITS = mm
ANGULAR_UNITS = degree
DEFAULT_LINEAR_VELOCITY = 100
MAX_LINEAR_VELOCITY = 200
DEFAULT_LINEAR_ACCELERATION = 2000
MAX_LINEAR_ACCELERATION = 2000
[KINS]
KINEMATICS = trivkins
JOINTS = 3
"""
_AXIS = """\
[AXIS_{name}]
MAX_VELOCITY = 200
MAX_ACCELERATION = 2000
MIN_LIMIT = -100
MAX_LIMIT = 100
[JOINT_{number}]
TYPE = LINEAR
HOME = 0.0
MAX_VELOCITY = 200
MAX_ACCELERATION = 2000
MIN_LIMIT = -100
MAX_LIMIT = 100
FERROR = 50
MIN_FERROR = 25
HOME_OFFSET = 0.0
HOME_SEARCH_VEL = 0
HOME_LATCH_VEL = 0
HOME_SEQUENCE = 0
"""

_DISPLAY = """\
#!/usr/bin/python3
import json
import subprocess
import sys
import time
import traceback

sys.path.insert(0, ".")
import linuxcnc
import numpy as np

command, state, errors = linuxcnc.command(), linuxcnc.stat(), linuxcnc.error_channel()
command.state(linuxcnc.STATE_ESTOP_RESET)
command.wait_complete()
command.state(linuxcnc.STATE_ON)
command.wait_complete()
command.mode(linuxcnc.MODE_MANUAL)
command.wait_complete()
command.home(-1)
for _ in range(500):
    state.poll()
    if all(state.homed[:3]):
        break
    time.sleep(0.01)


def slowest():
    said = subprocess.run(["halcmd", "getp", "body.slowest"], capture_output=True, text=True)
    return float(said.stdout)


def run_program(path, seconds):
    command.mode(linuxcnc.MODE_AUTO)
    command.wait_complete()
    command.program_open(path)
    command.auto(linuxcnc.AUTO_RUN, 0)
    end = time.monotonic() + seconds
    time.sleep(0.5)
    while time.monotonic() < end:
        state.poll()
        if said := errors.poll():
            raise RuntimeError(said[1])
        if state.interp_state == linuxcnc.INTERP_IDLE:
            return
        time.sleep(0.05)
    raise TimeoutError("the program did not end")


found = {}
try:
    exec(open("steps.py").read())
except BaseException:
    found["error"] = traceback.format_exc()
with open("found.json", "w") as file:
    json.dump(found, file)
"""


def missing() -> str:
    """Why the machine cannot run here; empty where it can."""
    if shutil.which("linuxcnc") is None:
        return "LinuxCNC is not installed (Debian: linuxcnc-uspace)"
    if subprocess.run(
        [PYTHON, "-c", "import linuxcnc, hal, numpy"], capture_output=True
    ).returncode:
        return "the system's Python has no linuxcnc, hal and numpy"
    return "" if shutil.which("setpriv") or os.getuid() else "LinuxCNC refuses root"


def run_machine(folder: Path, steps: str, files=(), seconds: float = 300.0) -> dict:
    """Start LinuxCNC in a folder, carry out Python steps that fill ``found``, and return that.

    Steps know ``linuxcnc``, ``np``, ``slowest()`` and ``run_program(path, seconds)``, and can
    import touchatlas.
    """
    folder.mkdir(parents=True, exist_ok=True)
    axes = "".join(_AXIS.format(name=name, number=k) for k, name in enumerate("XYZ"))
    texts = {"m.ini": _INI + axes, "m.hal": _HAL, "body.py": _BODY, "display.py": _DISPLAY}
    for name, text in {**texts, "steps.py": steps, **dict(files)}.items():
        (folder / name).write_text(text)
    for name in ("body.py", "display.py"):
        (folder / name).chmod(0o755)
    package = folder / "touchatlas"
    package.mkdir()
    shutil.copy(ROOT / "__init__.py", package)
    for storey in ("patch", "atlas", "planner"):
        shutil.copytree(
            ROOT / storey, package / storey, ignore=shutil.ignore_patterns("__pycache__")
        )
    command = ["linuxcnc", "-r", "m.ini"]
    if os.getuid() == 0:
        for path in (folder, *folder.rglob("*")):
            os.chown(path, 65534, 65534)
        command = ["setpriv", "--reuid=65534", "--regid=65534", "--clear-groups", *command]
    environment = {k: v for k, v in os.environ.items() if k != "DISPLAY"} | {"HOME": str(folder)}
    done = subprocess.run(
        command,
        cwd=folder,
        env=environment,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=seconds,
    )
    if not (folder / "found.json").is_file():
        raise RuntimeError(done.stdout + done.stderr)
    found = json.loads((folder / "found.json").read_text())
    if "error" in found:
        raise RuntimeError(found["error"])
    return found
