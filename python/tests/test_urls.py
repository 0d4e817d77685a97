"""Terrains at URLs, if the package is built with this feature."""

import threading
import time
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import numpy as np
import pytest
from test_open import written

from hapterra import Contact, StepError, Terrain


def refusal():
    with pytest.raises(OSError) as raised:
        Terrain.open("http://127.0.0.1:9/none.tif")
    return str(raised.value)


pytestmark = pytest.mark.skipif(
    "built without URLs" in refusal(), reason="the package is built without its feature remote"
)


class Server(ThreadingHTTPServer):
    """A server of a file in ranges, or one that answers every request with an error."""

    content = b""
    is_down = False


class Ranges(BaseHTTPRequestHandler):
    def do_HEAD(self):
        self.answer(False)

    def do_GET(self):
        self.answer(True)

    def answer(self, with_body):
        if self.server.is_down:
            return self.send_error(500)
        if self.path != "/hills.tif":
            return self.send_error(404)
        content, size = self.server.content, len(self.server.content)
        asked = self.headers.get("Range", "bytes=0-").split("=")[1].split("-")
        first = int(asked[0]) if asked[0] else size - int(asked[1])
        last = min(int(asked[1]), size - 1) if asked[0] and asked[1] else size - 1
        self.send_response(206)
        self.send_header("Content-Range", f"bytes {first}-{last}/{size}")
        self.send_header("Content-Length", str(last - first + 1))
        self.send_header("ETag", '"1"')
        self.end_headers()
        if with_body:
            self.wfile.write(content[first : last + 1])

    def log_message(self, *about):
        pass


@pytest.fixture
def server(tmp_path):
    heights = np.random.default_rng(3).uniform(0, 100, (2048, 2048)).astype("f4")
    file = written(tmp_path / "hills.tif", heights, tiled=True, blockxsize=256, blockysize=256)
    server = Server(("127.0.0.1", 0), Ranges)
    server.content = file.read_bytes()
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    yield server
    server.shutdown()
    thread.join()
    server.server_close()


def capture_error(ask):
    """Returns the answer after the connection is retried."""
    while True:
        try:
            return ask()
        except OSError:
            time.sleep(0.05)


@pytest.mark.filterwarnings("ignore:.* can(not)? be read")
def test_unavailable_heights_are_errors_not_holes(server, tmp_path):
    url = f"http://127.0.0.1:{server.server_port}/hills.tif"
    here = Terrain.open(tmp_path / "hills.tif", cell_mm=0.5)
    there = Terrain.open(url, cell_mm=0.5, in_memory=0, cache="off")
    # The last two are in tiles that are not read at the start.
    places = [(300.3, 300.3), (140.1, 900.7), (700.2, 80.4)]
    assert there.height_mm(*places[0]) == here.height_mm(*places[0])
    contact = Contact(there)
    server.is_down = True
    with pytest.raises(OSError, match="hint: "):
        there.height_mm(*places[1])
    with pytest.raises(OSError, match="hint: "):
        contact.step((*places[1], 60))
    with pytest.raises(StepError, match="(?s)step 0 of the path: .*hint: "):
        contact.run([(*places[2], 60)] * 5)
    server.is_down = False
    assert capture_error(lambda: there.height_mm(*places[1])) == here.height_mm(*places[1])
    capture_error(lambda: there.height_mm(*places[2]))
    # The same steps as those of a contact without an error.
    path = [(*places[2], 60), (*places[2], 0)]
    assert np.array_equal(contact.run(path), Contact(here).run(path))
