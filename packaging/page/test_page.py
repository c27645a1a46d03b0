# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""Drives the page that converts in Chromium, as a person does, and compares every file that it saves with the native tool's.

usage: test_page.py CHROMIUM PAGE.html TOOL MODELS FOLDER HASHES.wasm HASHES.txt [LARGE.glb]

TOOL is the native tool, MODELS a folder with model.glb, model.obj and its .mtl, model.stl and model.ply (golden_hashes --write-model). FOLDER gets
pictures of the page and report.txt. HASHES.wasm is the program of the library's golden hashes, which are compared with HASHES.txt. LARGE.glb is timed at 256 in colour.
"""

import base64
import io
import json
import pathlib
import shutil
import subprocess
import sys
import time

import numpy as np
from PIL import Image

sys.path.insert(0, str(pathlib.Path(__file__).parents[2] / "tests/tool/formats"))
from browser import Browser  # noqa: E402

FORMATS = ("vox", "schem", "glb", "npz", "png")
DESKTOP, PHONE = (1280, 800), (390, 844)
MOST_BYTES = 2_500_000
ended = "['done', 'failed', 'cancelled'].includes(document.body.dataset.state)"


class Page:
    """The page in one tab, and what a person does with it."""

    def __init__(self, browser, page, folder):
        self.browser, self.folder = browser, folder
        self.downloads = folder / "downloads"
        shutil.rmtree(self.downloads, ignore_errors=True)
        self.downloads.mkdir(parents=True)
        browser.call("Page.setDownloadBehavior", behavior="allow", downloadPath=str(self.downloads.resolve()))
        browser.call("Network.enable")
        browser.open(page.resolve().as_uri())
        browser.wait_for("document.body.dataset.state === 'ready'")

    def settle(self, seconds=300):
        self.browser.wait_for(ended, seconds)
        return self.browser.evaluate("document.body.dataset.state")

    def choose(self, *files):
        """Files for the page's input, as its dialogue gives them; the page begins at once."""
        element = self.browser.call("Runtime.evaluate", expression="document.getElementById('files')")["result"]["objectId"]
        self.browser.evaluate("document.body.dataset.state = 'chosen'")
        self.browser.call("DOM.setFileInputFiles", files=[str(f.resolve()) for f in files], objectId=element)
        return self.settle()

    def set(self, **values):
        for name, value in values.items():
            self.browser.evaluate(f"document.getElementById('{name}').value = '{value}'")

    def convert(self):
        self.browser.evaluate("document.body.dataset.state = 'chosen'; document.getElementById('convert').click()")
        return self.settle()

    def message(self):
        return self.browser.evaluate("document.getElementById('message').textContent")

    def save(self, name):
        """The bytes of a file that a button saves."""
        path = self.downloads / name
        path.unlink(missing_ok=True)
        self.browser.evaluate(f"document.body.dataset.state = 'chosen'; document.getElementById('save_{path.suffix[1:]}').click()")
        assert self.settle() == "done", self.message()
        end = time.monotonic() + 30
        while not path.exists():
            assert time.monotonic() < end, f"{name} was not saved"
            time.sleep(0.02)
        size = -1
        while size != path.stat().st_size:  # the browser renames it when it is whole
            size = path.stat().st_size
            time.sleep(0.05)
        return path.read_bytes()

    def wait_for_voxels(self):
        """Until the viewer, which is a page within, has drawn them, and its picture stays."""
        self.browser.wait_for("document.body.dataset.viewer === 'drawn'")
        before, now, end = None, self.pixels(), time.monotonic() + 120
        while before is None or (before != now).any():
            assert time.monotonic() < end, "the picture does not come to rest"
            time.sleep(0.5)
            before, now = now, self.pixels()
        x, y, width, height = self.browser.evaluate("(r => [r.x, r.y, r.width, r.height])(document.getElementById('view').getBoundingClientRect())")
        view = now[max(0, int(y)) : int(y + height), int(x) : int(x + width)]
        drawn = (np.abs(view.astype(int) - view[:, 1:2].astype(int)).max(axis=-1) > 20).mean()  # the background is the same along a row
        assert drawn > 0.1, f"{drawn:.3f} of the view is no background: there are no voxels"

    def pixels(self):
        with Image.open(io.BytesIO(base64.b64decode(self.browser.call("Page.captureScreenshot", format="png")["data"]))) as image:
            return np.asarray(image.convert("RGB"))

    def picture(self, name):
        png = self.browser.call("Page.captureScreenshot", format="png")["data"]
        (self.folder / name).write_bytes(base64.b64decode(png))


def native(tool, model, output, options, folder):
    """What the tool of this machine says and writes of a model, the first file of these."""
    here = folder / "native"
    shutil.rmtree(here, ignore_errors=True)
    (here / "out").mkdir(parents=True)
    for file in model:
        shutil.copy(file, here)
    run = subprocess.run([tool, model[0].name, "-o", f"out/{output}", *options], cwd=here, capture_output=True, text=True)
    return run, (here / "out" / output).read_bytes() if run.returncode == 0 else None


def check_files(page, tool, models, folder, report):
    """Every model and format: equal bytes. The settings differ by model."""
    settings = {
        "glb": ({"resolution": 64, "fill": "", "values": "occupancy,color"}, ["-r", "64", "-t", "occupancy,color"]),
        "obj": ({"resolution": 50, "fill": "nonzero", "values": "occupancy,color"}, ["-r", "50", "--solid", "nonzero", "-t", "occupancy,color"]),
        "stl": ({"resolution": 40, "fill": "exterior", "values": "occupancy"}, ["-r", "40", "--solid", "exterior", "-t", "occupancy"]),
        "ply": ({"resolution": 33, "fill": "", "values": "occupancy,color"}, ["-r", "33", "-t", "occupancy,color"]),
    }
    equal = 0
    for kind, (chosen, options) in settings.items():
        model = (models / f"model.{kind}",) + ((models / "model.mtl",) if kind == "obj" else ())
        page.set(**chosen)
        assert page.choose(*model) == "done", page.message()
        for extension in FORMATS:
            output = f"model.{extension}"
            saved = page.save(output)
            run, expected = native(tool, model, output, options, folder)
            assert expected is not None, run.stderr
            same = saved == expected
            equal += same
            report(f"model.{kind} -> {output}: {len(saved)} bytes, {'equal' if same else f'differ from the {len(expected)} of the tool'}")
    assert equal == len(settings) * len(FORMATS), f"{equal} of {len(settings) * len(FORMATS)} files are equal"


def check_refusals(page, tool, models, folder, report):
    """What cannot be read, and what needs more memory than there is, is said in the tool's words, and the page goes on."""
    broken, no_model = folder / "broken.glb", folder / "notes.txt"
    broken.write_bytes((models / "model.glb").read_bytes()[:400])
    no_model.write_text("no model\n")
    for file in (broken, no_model):
        page.set(resolution=16, fill="", values="occupancy")
        assert page.choose(file) == "failed"
        run, _ = native(tool, (file,), "x.vox", ["-r", "16", "-t", "occupancy"], folder)
        assert page.message() == run.stderr.replace("voxelize: ", "").strip(), (page.message(), run.stderr)
        report(f"{file.name}: {page.message()}")
    page.set(resolution=2000, fill="nonzero", values="occupancy,color")
    assert page.choose(models / "model.glb") == "failed"
    assert "MiB are needed" in page.message(), page.message()
    page.picture("refused.png")
    report("2000 voxels along a side: " + page.message().replace("\n", "; "))
    page.set(resolution=16, fill="")
    assert page.convert() == "done", page.message()


def check_large_text(page, tool, folder, report):
    """An OBJ of more than 50 MB: hills of 1.9 million triangles."""
    side = 970
    across, along = (a.ravel() for a in np.meshgrid(np.arange(side), np.arange(side)))
    first = (along * side + across + 1).reshape(side, side)[:-1, :-1].ravel()
    model = folder / "hills.obj"
    with model.open("w") as file:
        heights = 40 * np.sin(across / 71.0) * np.cos(along / 53.0)
        file.write("".join(f"v {x}.25 {h:.6f} {z}.75\n" for x, h, z in zip(across.tolist(), heights.tolist(), along.tolist())))
        file.write("".join(f"f {n} {n + 1} {n + side}\nf {n + 1} {n + side + 1} {n + side}\n" for n in first.tolist()))
    size = model.stat().st_size
    assert size > 50_000_000, size
    page.set(resolution=256, fill="", values="occupancy")
    assert page.choose(model) == "done", page.message()
    assert "[#" not in page.message() and len(page.message().splitlines()) == 2, page.message()
    report(f"an OBJ of {size} bytes at 256: {float(page.browser.evaluate('document.body.dataset.seconds')):.1f} s")
    _, expected = native(tool, (model,), "hills.npz", ["-r", "256", "-t", "occupancy"], folder)
    assert page.save("hills.npz") == expected
    model.unlink()


def check_cancel(page, models):
    """The button ends the work at once, and the next model is converted."""
    page.set(resolution=700, fill="nonzero")
    page.browser.evaluate("document.body.dataset.state = 'chosen'; document.getElementById('convert').click()")
    page.browser.wait_for("document.body.dataset.state === 'busy'")
    time.sleep(1)
    assert page.browser.evaluate("document.body.dataset.state") == "busy", "it was done before it could be cancelled"
    begin = time.monotonic()
    page.browser.evaluate("document.getElementById('cancel').click()")
    assert page.settle(5) == "cancelled" and time.monotonic() - begin < 2
    page.set(resolution=20, fill="")
    assert page.choose(models / "model.ply") == "done", page.message()


def check_hashes(page, program, recorded, report):
    """The library's golden hashes, computed by the browser."""
    worker = (pathlib.Path(__file__).parent / "wasi.js").read_text(encoding="utf-8") + """
onmessage = ({ data }) => {
  const text = new TextDecoder();
  let out = '', err = '';
  const wasi = new Wasi({ args: ['golden_hashes', '--threads', '1'], print: bytes => { out += text.decode(bytes); }, say: bytes => { err += text.decode(bytes); } });
  const code = wasi.run(new WebAssembly.Module(data));
  postMessage(code === 0 ? out : `${code} ${err}`);
};"""
    body = page.browser
    body.evaluate("document.body.append(Object.assign(document.createElement('input'), { type: 'file', id: 'program', hidden: true }))")
    element = body.call("Runtime.evaluate", expression="document.getElementById('program')")["result"]["objectId"]
    body.call("DOM.setFileInputFiles", files=[str(program.resolve())], objectId=element)
    body.evaluate(f"""(() => {{
      const worker = new Worker(URL.createObjectURL(new Blob([{json.dumps(worker)}], {{ type: 'text/javascript' }})));
      worker.onmessage = ({{ data }}) => {{ document.body.dataset.hashes = data; worker.terminate(); }};
      worker.onerror = e => {{ document.body.dataset.hashes = e.message; }};
      document.getElementById('program').files[0].arrayBuffer().then(bytes => worker.postMessage(bytes));
    }})()""")
    body.wait_for("'hashes' in document.body.dataset", 1800)
    printed = body.evaluate("document.body.dataset.hashes").split("\n")[:-1]
    of_tool = ("file.", "model.", "coverage.tool.", "solid.tool.", "target.tool.", "cells.tool.")
    expected = [line for line in recorded.read_text().splitlines() if line and not line.startswith(("#", *of_tool))]
    equal = len(set(printed) & set(expected))
    report(f"golden hashes of the library: {equal} of {len(expected)} equal")
    assert sorted(printed) == sorted(expected) and equal >= 200, printed[:5]


def check_sizes(page, models):
    """Desktop and telephone: nothing is wider than the window, and the voxels are drawn."""
    for name, (width, height) in (("desktop", DESKTOP), ("phone", PHONE)):
        page.browser.resize(width, height)
        page.set(resolution=64, fill="", values="occupancy,color")
        assert page.choose(models / "model.glb") == "done", page.message()
        if name == "phone":
            page.browser.evaluate("document.getElementById('view').scrollIntoView()")
        page.wait_for_voxels()
        assert page.browser.evaluate("document.documentElement.scrollWidth") <= width
        buttons = page.browser.evaluate("[...document.querySelectorAll('#saves button')].every(b => b.getBoundingClientRect().right <= innerWidth)")
        assert buttons, "a button lies outside"
        page.picture(f"{name}.png")
        if name == "phone":
            page.browser.evaluate("scrollTo(0, 0)")
            time.sleep(0.5)
            page.picture("phone_top.png")
    page.browser.resize(*DESKTOP)


def main():
    chromium, page_file, tool, models, folder, hashes, recorded = sys.argv[1], *map(pathlib.Path, sys.argv[2:8])
    tool = tool.resolve()
    folder.mkdir(parents=True, exist_ok=True)
    lines = []

    def report(line):
        print(line, flush=True)
        lines.append(line)

    size = page_file.stat().st_size
    report(f"the page has {size} bytes")
    assert size <= MOST_BYTES
    text = page_file.read_text(encoding="utf-8")
    assert "http:" not in text and "https:" not in text, "the page holds an address"
    profile = folder / "profile"
    shutil.rmtree(profile, ignore_errors=True)
    with Browser(chromium, profile, *DESKTOP) as browser:
        begin = time.monotonic()
        page = Page(browser, page_file, folder)
        report(f"ready after {time.monotonic() - begin:.1f} s")
        page.picture("empty.png")
        browser.evaluate("document.getElementById('licences').open = true")
        browser.wait_for("['libwebp', 'musl', 'draco', 'LLVM'].every(name => document.getElementById('licence').textContent.includes(name))")
        browser.evaluate("document.getElementById('licences').open = false")
        check_files(page, tool, models, folder, report)
        check_refusals(page, tool, models, folder, report)
        check_cancel(page, models)
        check_large_text(page, tool, folder, report)
        check_sizes(page, models)
        check_hashes(page, hashes, recorded, report)
        for large in map(pathlib.Path, sys.argv[8:]):
            page.set(resolution=256, fill="", values="occupancy,color")
            assert page.choose(large) == "done", page.message()
            report(f"{large.name} at 256 in colour: {float(page.browser.evaluate('document.body.dataset.seconds')):.1f} s")
            page.wait_for_voxels()
            page.picture("large.png")
        asked = [e["params"]["request"]["url"] for e in browser.events if e["method"] == "Network.requestWillBeSent"]
        assert all(url.startswith(("file:", "blob:", "about:", "data:")) for url in asked), asked
    (folder / "report.txt").write_text("\n".join(lines) + "\n")
    shutil.rmtree(profile, ignore_errors=True)


if __name__ == "__main__":
    main()
