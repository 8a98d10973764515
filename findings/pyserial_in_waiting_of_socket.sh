#!/usr/bin/env bash
# Where two meet: programs for serial ports, and controllers on a network, by pyserial's socket://.
#
# Common guess: serial_for_url("socket://host:port") can stand for a serial port in a program that
# reads what has come by port.read(port.in_waiting), as in_waiting is the number of bytes in the
# input buffer.
# Version: pyserial 3.5 (Linux, Python 3.11).
# Behaviour: of a serial port in_waiting is the number of bytes that wait. Of socket:// it is 1 where
# any wait, and 0 else: it is the length of what select returned. So the program gets one byte where
# a line is there, and senders of G-code that poll ten times a second read ten bytes a second.
# Output seen:
#   serial port: 38 wait, read(in_waiting) gave 38
#   socket://: 1 wait, read(in_waiting) gave 1, then 37 more
# The script fails if that changes.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv v
v/bin/pip install --quiet pyserial==3.5
cat > meet.py <<'PY'
import os
import pty
import socket
import time

import serial

LINE = b"<Idle|MPos:0.000,0.000,0.000|FS:0,0>\r\n"


def wait_for_bytes(port):
    end = time.monotonic() + 10.0
    while not port.in_waiting and time.monotonic() < end:
        time.sleep(0.01)
    # All of a line comes at once: give it time all the same.
    time.sleep(0.2)


controller, name = pty.openpty()
with serial.Serial(os.ttyname(name), timeout=1.0) as port:
    os.write(controller, LINE)
    wait_for_bytes(port)
    waiting = port.in_waiting
    print(f"serial port: {waiting} wait, read(in_waiting) gave {len(port.read(waiting))}")

with socket.create_server(("127.0.0.1", 0)) as server:
    url = f"socket://127.0.0.1:{server.getsockname()[1]}"
    with serial.serial_for_url(url, timeout=1.0) as port:
        controller, _ = server.accept()
        controller.sendall(LINE)
        wait_for_bytes(port)
        waiting = port.in_waiting
        got, rest = port.read(waiting), port.read(len(LINE) - waiting)
        print(f"socket://: {waiting} wait, read(in_waiting) gave {len(got)}, then {len(rest)} more")
        controller.close()
PY
v/bin/python meet.py | tee seen
diff seen - <<'SEEN'
serial port: 38 wait, read(in_waiting) gave 38
socket://: 1 wait, read(in_waiting) gave 1, then 37 more
SEEN
