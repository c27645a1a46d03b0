# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""Chromium without a window, driven through a pair of pipes. Software draws, so that every machine can."""

import base64
import io
import json
import os
import select
import subprocess
import time

import numpy as np
from PIL import Image


class Browser:
    """One tab. Every wait ends with TimeoutError."""

    def __init__(self, program, profile, width, height):
        from_us, to_us = os.pipe(), os.pipe()
        wiring = f"exec 3<&{from_us[0]} 4>&{to_us[1]}; exec \"$@\""  # Chromium reads from 3 and writes to 4
        self.process = subprocess.Popen(
            ["bash", "-c", wiring, "bash", program, "--headless=new", "--no-sandbox", "--use-angle=swiftshader",
             "--enable-unsafe-swiftshader", "--remote-debugging-pipe", f"--user-data-dir={profile}", "--no-first-run",
             "--force-device-scale-factor=1", f"--window-size={width},{height}", "about:blank"],
            pass_fds=(from_us[0], to_us[1]), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)  # fmt: skip
        os.close(from_us[0])
        os.close(to_us[1])
        self.out, self.incoming, self.rest, self.number, self.session = from_us[1], to_us[0], b"", 0, None
        self.events = []
        page = next(t for t in self.call("Target.getTargets")["targetInfos"] if t["type"] == "page")
        self.session = self.call("Target.attachToTarget", targetId=page["targetId"], flatten=True)["sessionId"]
        self.call("Emulation.setFocusEmulationEnabled", enabled=True)
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False)

    def close(self):
        self.process.kill()
        self.process.wait()
        os.close(self.out)
        os.close(self.incoming)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def call(self, method, seconds=120, **parameters):
        self.number += 1
        message = {"id": self.number, "method": method, "params": parameters}
        if self.session:
            message["sessionId"] = self.session
        os.write(self.out, json.dumps(message).encode() + b"\0")
        end = time.monotonic() + seconds
        while True:
            while b"\0" not in self.rest:
                ready, _, _ = select.select([self.incoming], [], [], max(0, end - time.monotonic()))
                read = os.read(self.incoming, 1 << 20) if ready else b""
                if not read:
                    raise TimeoutError(f"no answer to {method}")
                self.rest += read
            line, self.rest = self.rest.split(b"\0", 1)
            answer = json.loads(line)
            if "method" in answer:
                self.events.append(answer)
            if answer.get("id") == self.number:
                if "error" in answer:
                    raise RuntimeError(f"{method}: {answer['error']}")
                return answer["result"]

    def evaluate(self, expression):
        return self.call("Runtime.evaluate", expression=expression, returnByValue=True)["result"].get("value")

    def wait_for(self, expression, seconds=120):
        end = time.monotonic() + seconds
        while not self.evaluate(expression):
            if time.monotonic() > end:
                raise TimeoutError(f"never true: {expression}")
            time.sleep(0.05)

    def open(self, address):
        self.call("Page.navigate", url="about:blank")  # an address that differs by its end alone would not load anew
        self.call("Page.navigate", url=address)
        self.wait_for("document.readyState === 'complete' && !!document.body.dataset.state")

    def visit(self, address):
        """Opens any page, and waits until all that it names is loaded."""
        self.call("Page.navigate", url=address)
        self.wait_for("document.readyState === 'complete' && location.href !== 'about:blank'", 300)

    def press(self, key):
        for kind in ("keyDown", "keyUp"):
            self.call("Input.dispatchKeyEvent", type=kind, key=key, **({"text": key} if kind == "keyDown" and len(key) == 1 else {}))

    def drag(self, start, end):
        for kind, (x, y) in (("mousePressed", start), ("mouseMoved", end), ("mouseReleased", end)):
            self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", buttons=0 if kind == "mouseReleased" else 1,
                      clickCount=1)

    def move(self, to):
        self.call("Input.dispatchMouseEvent", type="mouseMoved", x=to[0], y=to[1])

    def tap(self, at):
        self.call("Input.dispatchTouchEvent", type="touchStart", touchPoints=[{"x": at[0], "y": at[1], "id": 0}])
        self.call("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])

    def resize(self, width, height):
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False)

    def frames(self):
        """The frames within the page, each by the number of the world that its script runs in."""
        tree = self.call("Page.getFrameTree")["frameTree"]
        ids = [child["frame"]["id"] for child in tree.get("childFrames", [])]
        self.events = []
        self.call("Runtime.disable")
        self.call("Runtime.enable")  # which names every world
        worlds = [e["params"]["context"] for e in self.events if e["method"] == "Runtime.executionContextCreated"]
        worlds = {w["auxData"]["frameId"]: w["id"] for w in worlds if w["auxData"].get("isDefault")}
        return [worlds[i] for i in ids]

    def evaluate_in(self, frame, expression):
        return self.call("Runtime.evaluate", expression=expression, returnByValue=True, contextId=frame)["result"].get("value")

    def pinch(self, before, after):
        """Two fingers, each from one place to another."""
        self.call("Input.dispatchTouchEvent", type="touchStart", touchPoints=[{"x": x, "y": y, "id": i} for i, (x, y) in enumerate(before)])
        self.call("Input.dispatchTouchEvent", type="touchMove", touchPoints=[{"x": x, "y": y, "id": i} for i, (x, y) in enumerate(after)])
        self.call("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])

    def pixels(self):
        """(height, width, 3), once the page has drawn all that was asked of it."""
        self.wait_for("!document.getElementById('view') || document.getElementById('view').dataset.fine === 'true'")
        png = base64.b64decode(self.call("Page.captureScreenshot", format="png")["data"])
        with Image.open(io.BytesIO(png)) as image:
            return np.asarray(image.convert("RGB")).astype(float)
