"""Time the laboratory in a headless Chromium: ``python -m magfold_bench.laboratory [FILE]``.

Run this in a checkout on an idle machine. Without a FILE, the page is built first. The command
prints, each with its limit, the page's size, the time until the page is ready, the time of a fold
of six components by the page's own clock, and the time from a click on a face to the next frame.
"""

import gzip
import random
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from magfold_env.browser import build
from tests.replay import chromium

REPEATS = 41
# Record the time, counted from the navigation, at which the page has created its laboratory.
WATCH = """
let made;
Object.defineProperty(window, "laboratory", {
  get: () => made,
  set: (value) => { made = value; window.readyAt = performance.now(); },
});
"""
FOLD = """(() => {
  const sequence = laboratory.scene.sequence.map(randomFaces);
  const scene = { ...laboratory.scene, mount: "MOUNT", sequence };
  delete scene.start_angles;
  delete scene.start_offsets;
  const from = performance.now();
  const chain = laboratory.engine.chain(scene, { frameRate: FRAME_RATE });
  chain.run();
  const took = performance.now() - from;
  chain.free();
  return took;
})()"""
# Time a click from the moment of the input, before the page can handle it.
LISTEN = """addEventListener("click", ({ timeStamp }) => {
  requestAnimationFrame(() => { window.took = performance.now() - timeStamp; });
}, true)"""
FACE = """(() => {
  window.took = undefined;
  const faces = [...document.querySelectorAll("#poles [data-face]")];
  const box = faces[Math.floor(faces.length * Math.random())].getBoundingClientRect();
  return [box.x + box.width / 2, box.y + box.height / 2];
})()"""


def opened(page: chromium.Page, file: Path) -> float:
    """Open a page and return the time until it was ready [ms]."""
    page.call("Page.navigate", url="about:blank")
    page.open(file)
    page.until("window.readyAt !== undefined")
    return page.value("readyAt")


def clicked(page: chromium.Page) -> float:
    """Change a pole by a click, and return the time to the next frame [ms]."""
    x, y = page.value(FACE)
    for kind in ("mousePressed", "mouseReleased"):
        # Click at a random moment, whatever the page is doing.
        time.sleep(0.1 + 0.1 * random.random())
        page.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", clickCount=1)
    page.until("window.took !== undefined")
    return page.value("took")


def show(what: str, values: Any, allowed: str) -> None:
    """Print the median and the 95th percentile of times [ms]."""
    median, most = np.percentile(values, [50, 95])
    print(f"{what}: {median:.1f} ms, 95 % within {most:.1f} ms ({allowed})", flush=True)  # noqa: T201


def main() -> None:
    """Measure and print everything."""
    file = Path(sys.argv[1]) if sys.argv[1:] else build.page()
    size = len(gzip.compress(file.read_bytes()))
    print(f"the page, gzipped: {size / 1e6:.2f} MB (1.5)")  # noqa: T201
    with tempfile.TemporaryDirectory() as profile, chromium.page(Path(profile)) as page:
        page.resize(1400, 900)
        page.call("Page.addScriptToEvaluateOnNewDocument", source=WATCH)
        show("opened and ready", [opened(page, file) for _ in range(11)], "500")
        for mount, allowed in (("free", "10"), ("tube", "20")):
            fold = FOLD.replace("MOUNT", mount)
            show(f"fold, {mount}", [page.value(fold) for _ in range(REPEATS)], allowed)
        page.value(LISTEN)
        show("click to its frame", [clicked(page) for _ in range(REPEATS)], "100")


if __name__ == "__main__":
    main()
