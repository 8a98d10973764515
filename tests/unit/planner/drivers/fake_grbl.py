"""grbl 1.1 on a socket, as its source has it: a machine without time before a body of our own.

What surprises drivers is in it: ``ok`` after an alarm, an old ``[PRB:]`` after alarm 5, alarm 4
when the probe is closed already, G1 that drives through a contact, WCO only now and then, reports
in inches by $13, PRB in machine coordinates, and everything zero after Ctrl-X.
"""

import re
import socket
import threading

import numpy as np

SETTINGS = {
    10: 1,
    13: 0,
    20: 1,
    21: 1,
    22: 1,
    23: 0,
    120: 100,
    121: 100,
    122: 100,
    130: 300,
    131: 300,
    132: 200,
}


class FakeGrbl(threading.Thread):
    """The firmware: ``gap`` is the signed distance (mm) of a tip centre, in machine coordinates,
    from contact; below 0 the probe is closed."""

    def __init__(self, gap, start=(-100.0, -100.0, -10.0), settings=(), offset=(0.0, 0.0, 0.0)):
        super().__init__(daemon=True)
        self.gap, self.at = gap, np.array(start, float)
        self.settings = {**SETTINGS, **dict(settings)}
        self.offset = np.array(offset, float)
        self.probed, self.success = np.zeros(3), False
        self.state, self.reports, self.crashes = "Idle", 0, 0
        self.lines: list[str] = []
        self.stuck, self.mute, self.bounces, self.options = False, False, 0, "V"
        self._server = socket.create_server(("127.0.0.1", 0))
        self.port = self._server.getsockname()[1]
        self.start()

    def run(self):
        connection, _ = self._server.accept()
        self._server.close()
        self._link = connection
        self._send("", "Grbl 1.1h ['$' for help]")
        held = b""
        while data := connection.recv(4096):
            for byte in data:
                one = bytes([byte])
                if one == b"?":
                    self._send(self._status())
                elif one == b"!":
                    self.state = "Hold:0"
                elif one == b"\x18":
                    held, self.probed, self.success = b"", np.zeros(3), False
                    self.state = "Alarm" if self.state != "Idle" else "Idle"
                    self._send("", "Grbl 1.1h ['$' for help]")
                elif one in b"\r\n":
                    self._send(*self._answer(held.decode()))
                    held = b""
                else:
                    held += one
        connection.close()

    def _send(self, *lines):
        self._link.sendall("".join(f"{line}\r\n" for line in lines).encode())

    def _coordinates(self, place):
        scale, digits = (1 / 25.4, 4) if self.settings[13] else (1.0, 3)
        return ",".join(f"{x * scale:.{digits}f}" for x in place)

    def _status(self):
        self.reports += 1
        parts = [self.state, f"MPos:{self._coordinates(self.at)}", "FS:0,0"]
        parts += ["Pn:P"] if self.closed else []
        parts += [f"WCO:{self._coordinates(self.offset)}"] if self.reports % 10 == 1 else []
        return f"<{'|'.join(parts)}>"

    @property
    def closed(self):
        return self.stuck or self.gap(self.at) < 0.0

    def _prb(self):
        return f"[PRB:{self._coordinates(self.probed)}:{int(self.success)}]"

    def _answer(self, line):
        self.lines += [line] if line else []
        if self.mute:
            return []
        if line in ("", "$X"):
            was, self.state = self.state, "Idle" if line else self.state
            return (["[MSG:Caution: Unlocked]"] if line and was == "Alarm" else []) + ["ok"]
        if line.startswith("$"):
            return [*self._listed(line), "ok"]
        return ["error:9"] if self.state != "Idle" else self._move(line)

    def _listed(self, line):
        if line == "$$":
            return [f"${n}={value}" for n, value in self.settings.items()]
        if line == "$G":
            return ["[GC:G0 G55 G17 G20 G91 G94 M5 M9 T0 F0 S0]"]
        if line == "$I":
            return ["[VER:1.1h.20190830:]", f"[OPT:{self.options},15,128]"]
        # The work system is a part of the offset, the tool length the other.
        zero, some = self._coordinates(np.zeros(3)), self._coordinates(self.offset - [0, 0, 1])
        named = [f"[G5{n}:{some if n == 5 else zero}]" for n in range(4, 10)]
        return [*named, f"[G92:{zero}]", f"[TLO:{self._coordinates([1.0])}]", self._prb()]

    def _move(self, line):
        words = re.findall(r"([A-Z])([-0-9.]+)", line)
        modes, values = {float(v) for k, v in words if k == "G"}, dict(words)
        scale = 1.0 if 21.0 in modes else 25.4
        target = [
            float(values[axis]) * scale + off if axis in values else now
            for axis, off, now in zip("XYZ", self.offset, self.at, strict=True)
        ]
        target = np.array(target)
        travel = [self.settings[n] for n in (130, 131, 132)]
        if self.settings[20] and ((target > 0).any() or (target < -np.array(travel)).any()):
            self.state = "Alarm"
            return ["ALARM:2", "[MSG:Reset to continue]"]
        motion = next(g for g in modes if g in (0.0, 1.0, 38.2, 38.3, 38.4, 38.5))
        if motion < 2.0:
            steps = np.linspace(0.0, 1.0, 200)[:, None] * (target - self.at) + self.at
            self.crashes += min(self.gap(place) for place in steps) < -0.5
            self.at = target
            return ["ok"]
        return self._probe(motion, target, float(values["F"]) * scale / 60.0)

    def _probe(self, motion, target, speed):
        if np.array_equal(target, self.at):
            return ["error:33"]
        away = motion > 38.35
        if self.closed != away:
            self.state = "Alarm"
            return ["ALARM:4", "ok"]
        length = np.linalg.norm(target - self.at)
        u, s = (target - self.at) / length, 0.0
        sign = -1.0 if away else 1.0
        while s < length and (self.stuck or sign * self.gap(self.at + s * u) > 1e-7):
            s += 0.01 if self.stuck else sign * self.gap(self.at + s * u)
        if s >= length:
            self.at, self.success = target, False
            if motion in (38.2, 38.4):
                self.state = "Alarm"
                return ["ALARM:5", self._prb(), "ok"]
            self.probed = target
            return [self._prb(), "ok"]
        self.probed, self.success = self.at + s * u, True
        # It slows down past the contact, and never farther than the target.
        s = min(length, s + speed**2 / (2.0 * self.settings[120]))
        self.at = self.at + (s + 1e-6) * u
        return [self._prb(), "ok"]
