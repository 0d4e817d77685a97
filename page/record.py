#!/usr/bin/env python3
"""Records the moving picture of the README: frames of the page in a Chromium, one for every 50 ticks.

    cargo xtask demo --touch -o target/page
    pip install pillow
    python3 page/record.py target/page docs/touch.gif

The page runs as it is, and a scripted mouse moves the hand. Only the clock is replaced: a frame of 50 ms
follows when the one before is drawn, so a slow machine drops none. It needs Linux or macOS.
"""

import base64
import functools
import http.server
import io
import json
import math
import os
import shutil
import subprocess
import sys
import tempfile
import threading

from PIL import Image, ImageColor

BROWSERS = ["chromium-headless-shell", "chromium", "chromium-browser", "google-chrome"]
WINDOW = (1000, 620)
FRAME_MS = 50
FRAMES = 160
# Frames before the first stored one, in which the hand reaches the ground.
LEAD = 20
WIDTH = 640
COLOURS = 200
# Colours of HIP, proxy and force in `style.css`, which only a few pixels have.
ACCENTS = ["#48a8ff", "#ff8a2b", "#ffd84a"]
# Keeps the page's request for a frame until the script draws it.
CLOCK = """
globalThis.requestAnimationFrame = (draw) => { globalThis.nextFrame = draw; return 0; };
globalThis.drawAt = (ms) => { const draw = globalThis.nextFrame; draw(ms); };
"""
READY = """
new Promise((done) => {
  const check = () => (globalThis.nextFrame ? done(true) : setTimeout(check, 50));
  check();
})
"""


class Quiet(http.server.SimpleHTTPRequestHandler):
    extensions_map = {**http.server.SimpleHTTPRequestHandler.extensions_map, ".wasm": "application/wasm"}

    def log_message(self, *_):
        pass


class Browser:
    """A Chromium controlled through two pipes."""

    def __init__(self, profile):
        program = os.environ.get("HAPTERRA_BROWSER") or next(filter(None, map(shutil.which, BROWSERS)), None)
        if program is None:
            sys.exit("there is no Chromium on the PATH; HAPTERRA_BROWSER names one")
        commands, self.to_browser = os.pipe()
        self.from_browser, answers = os.pipe()

        def pipes():
            # The browser reads from 3 and writes to 4; neither source may be overwritten before it is copied.
            high = [os.dup(commands), os.dup(answers)]
            for number, pipe in zip((3, 4), high):
                os.dup2(pipe, number)

        words = [program, "--headless", "--no-sandbox", "--remote-debugging-pipe", f"--user-data-dir={profile}"]
        words += ["--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--hide-scrollbars"]
        self.process = subprocess.Popen(
            words, preexec_fn=pipes, close_fds=False, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        os.close(commands), os.close(answers)
        self.answers = os.fdopen(self.from_browser, "rb", buffering=0)
        self.rest = b""
        self.number = 0
        self.session = None

    def call(self, method, **params):
        self.number += 1
        message = {"id": self.number, "method": method, "params": params}
        if self.session:
            message["sessionId"] = self.session
        os.write(self.to_browser, json.dumps(message).encode() + b"\0")
        while True:
            answer = self.read()
            if answer.get("id") == self.number:
                if "error" in answer:
                    sys.exit(f"{method}: {answer['error']}")
                return answer["result"]

    def read(self):
        while b"\0" not in self.rest:
            more = self.answers.read(1 << 20)
            if not more:
                sys.exit("the browser has ended")
            self.rest += more
        message, self.rest = self.rest.split(b"\0", 1)
        return json.loads(message)

    def value(self, expression):
        result = self.call("Runtime.evaluate", expression=expression, awaitPromise=True, returnByValue=True)
        if "exceptionDetails" in result:
            sys.exit(f"{expression}: {result['exceptionDetails']}")
        return result["result"].get("value")


def open_page(browser, address):
    target = browser.call("Target.createTarget", url="about:blank")["targetId"]
    browser.session = browser.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
    size = dict(width=WINDOW[0], height=WINDOW[1], deviceScaleFactor=1, mobile=False)
    browser.call("Emulation.setDeviceMetricsOverride", **size)
    browser.call("Page.enable")
    browser.call("Page.addScriptToEvaluateOnNewDocument", source=CLOCK)
    browser.call("Page.navigate", url=address)
    browser.value(READY)
    browser.value("drawAt(0)")


def hand_at(share):
    """Returns the mouse's position, from left and top of the window: once around the range."""
    angle = 2 * math.pi * share
    return [0.40 - 0.17 * math.cos(angle), 0.60 - 0.13 * math.sin(angle)]


def frames(browser):
    for frame in range(-LEAD, FRAMES):
        x, y = (share * pixels for share, pixels in zip(hand_at(frame / FRAMES), WINDOW))
        browser.call("Input.dispatchMouseEvent", type="mouseMoved", x=x, y=y)
        browser.value(f"drawAt({(LEAD + frame + 1) * FRAME_MS})")
        if frame < 0:
            continue
        picture = browser.call("Page.captureScreenshot", format="png")["data"]
        yield Image.open(io.BytesIO(base64.b64decode(picture))).convert("RGB")


def palette_of(frame):
    palette = frame.quantize(COLOURS)
    colours = palette.getpalette()[: 3 * COLOURS]
    for accent in ACCENTS:
        colours += ImageColor.getrgb(accent)
    palette.putpalette(colours)
    return palette


def main(folder, out):
    handler = functools.partial(Quiet, directory=folder)
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    height = WINDOW[1] * WIDTH // WINDOW[0]
    with tempfile.TemporaryDirectory() as profile:
        browser = Browser(profile)
        try:
            open_page(browser, f"http://127.0.0.1:{server.server_port}/index.html")
            small = [frame.resize((WIDTH, height), Image.LANCZOS) for frame in frames(browser)]
        finally:
            browser.process.kill()
            browser.process.wait()
    palette = palette_of(small[len(small) // 2])
    plain = [frame.quantize(palette=palette, dither=Image.Dither.NONE) for frame in small]
    plain[0].save(out, save_all=True, append_images=plain[1:], duration=FRAME_MS, loop=0, optimize=True)
    print(f"{out}: {len(plain)} frames, {os.path.getsize(out) // 1000} kB")


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    main(*sys.argv[1:])
