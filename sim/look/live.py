"""A run that goes on, shown in a browser of this machine."""

import threading
import webbrowser
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import numpy as np

from touchatlas.sim.judge.closest_points import ClosestPoints
from touchatlas.sim.look.frames import Frames
from touchatlas.sim.look.replay import page_bytes, run_text
from touchatlas.sim.world.implicit_object import ImplicitObject
from touchatlas.sim.world.mesh_object import MeshObject


def follow(frames: Frames, obj: ImplicitObject | MeshObject, tolerance: float) -> str:
    """Serve a run on loopback until the process ends, and open a browser; returns the address.

    Only the page and what it shows are served, to programs of this machine.
    """
    unit = "mm" if isinstance(obj, ImplicitObject) else ""

    def truth() -> tuple[np.ndarray, np.ndarray]:
        """The truth, which is looked at here, not measured with."""
        return obj.mesh(0.2 * tolerance)

    def text(held: Frames) -> str:
        # A tree that a thread held at the end of the process would be a leak.
        return run_text(obj.name, held, tolerance, unit, ClosestPoints(*truth()), live=True)

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            held = frames.so_far()
            if self.path not in ("/", "/run"):
                self.send_error(404)
                return
            answer = text(held).encode()
            if self.path == "/":
                answer = page_bytes(held, unit, truth(), answer.decode(), "")
            self.send_response(200)
            self.send_header("Content-Type", "text/html; charset=utf-8")
            self.send_header("Content-Length", str(len(answer)))
            self.end_headers()
            self.wfile.write(answer)

        def log_message(self, *_) -> None:
            """Requests are not printed."""

    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    address = f"http://127.0.0.1:{server.server_address[1]}/"
    webbrowser.open(address)
    return address
