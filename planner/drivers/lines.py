"""Lines of text to and from a controller, over TCP or a serial port."""

import select
import socket
import time
from typing import Protocol
from urllib.parse import urlsplit

_SCHEMES = ("tcp", "socket")


class Lines(Protocol):
    """A line-wise connection."""

    def write(self, data: bytes) -> None:
        """Send bytes."""

    def read(self, seconds: float) -> str | None:
        """The next line without its end; None where none came in time."""

    def close(self) -> None:
        """Close the connection."""


class _Held:
    """What came and was not read yet; ``_more`` waits for bytes, and has none where none came."""

    _held = b""

    def _more(self, seconds: float) -> bytes:
        raise NotImplementedError

    def read(self, seconds: float) -> str | None:
        """The next line without its end; None where none came in time."""
        end = time.monotonic() + seconds
        while b"\n" not in self._held:
            more = self._more(max(end - time.monotonic(), 0.0))
            if not more:
                return None
            self._held += more
        line, _, self._held = self._held.partition(b"\n")
        return line.decode("ascii", "replace").strip()


class TcpLines(_Held):
    """Lines over TCP.

    Parameters
    ----------
    host : str
    port : int
    seconds : float
        How long to wait for the connection.
    """

    def __init__(self, host: str, port: int, seconds: float = 5.0) -> None:
        try:
            self._socket = socket.create_connection((host, port), seconds)
        except OSError as error:
            raise ValueError(
                f"tcp://{host}:{port} cannot be connected ({error.strerror or error}); see that "
                "the controller is on and no other program has it"
            ) from None
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def write(self, data: bytes) -> None:
        """Send bytes."""
        self._socket.sendall(data)

    def _more(self, seconds: float) -> bytes:
        if not select.select([self._socket], [], [], seconds)[0]:
            return b""
        more = self._socket.recv(4096)
        if not more:
            raise ConnectionResetError("the controller has closed the connection")
        return more

    def close(self) -> None:
        """Close the connection."""
        self._socket.close()


class SerialLines(_Held):
    """Lines over a serial port, by pyserial (extra ``machines``).

    Parameters
    ----------
    name : str
        /dev/ttyUSB0, COM3, or another that ``serial.serial_for_url`` takes.
    baud : int
    """

    def __init__(self, name: str, baud: int = 115200) -> None:
        try:
            import serial
        except ImportError:
            raise ValueError(
                f"{name} is a serial port, which needs pyserial: pip install 'touchatlas[machines]'"
            ) from None
        try:
            self._port = serial.serial_for_url(name, baudrate=baud, timeout=0.0, write_timeout=5.0)
        except (serial.SerialException, ValueError) as error:
            raise ValueError(f"{name} cannot be opened as a serial port: {error}") from None

    def write(self, data: bytes) -> None:
        """Send bytes."""
        self._port.write(data)

    def _more(self, seconds: float) -> bytes:
        self._port.timeout = seconds
        # The first byte wakes up, and the rest is there; in_waiting is 1 at most over sockets.
        more = self._port.read(1)
        if more:
            self._port.timeout = 0.0
            more += self._port.read(4096)
        return bytes(more)

    def close(self) -> None:
        """Close the port."""
        self._port.close()


def open_lines(where: str, baud: int = 115200) -> Lines:
    """A connection to tcp://HOST:PORT, or to a serial port.

    Raises
    ------
    ValueError
        In one sentence: an address without a port, or one that cannot be opened.
    """
    parts = urlsplit(where)
    if parts.scheme not in _SCHEMES:
        return SerialLines(where, baud)
    try:
        host, port = parts.hostname, parts.port
    except ValueError:
        host = port = None
    if not (host and port):
        raise ValueError(f"{where} has no host and port; write it as tcp://192.168.0.20:23")
    return TcpLines(host, port)
