"""A headless Chromium, controlled over a pipe by the DevTools protocol, without other packages."""

from __future__ import annotations

import base64
import contextlib
import json
import os
import select
import shutil
import subprocess
import sys
import time
from collections.abc import Generator
from pathlib import Path
from typing import Any

import pytest

if os.name != "posix":
    pytest.skip("the browser is driven over POSIX pipes", allow_module_level=True)
import fcntl

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")
_PATIENCE = 600.0  # [s] waited out only where nothing comes; shared machines are slow
_FREE_NUMBER = 10  # file descriptors below may be taken by 3 and 4

# Chromium reads commands from descriptor 3 and writes to 4.
_START = "import os, sys; os.dup2(int(sys.argv[1]), 3); os.dup2(int(sys.argv[2]), 4); \
os.execv(sys.argv[3], sys.argv[3:])"


def found() -> str | None:
    """Return the path of a Chromium, or None if this machine has none."""
    paths = (shutil.which(name) for name in NAMES)
    return next((path for path in paths if path), None)


class Page:
    """A browser tab that stores its events."""

    def __init__(self, commands: int, answers: int) -> None:
        self._commands, self._answers = commands, answers
        self._buffer = b""
        self._number = 0
        self._session: str | None = None
        self._events: list[dict[str, Any]] = []
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        attached = self.call("Target.attachToTarget", targetId=target, flatten=True)
        self._session = attached["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(f"{domain}.enable")

    def call(self, method: str, **parameters: Any) -> dict[str, Any]:
        """Send a command and return its result."""
        self._number += 1
        number = self._number
        message: dict[str, Any] = {"id": number, "method": method, "params": parameters}
        if self._session:
            message["sessionId"] = self._session
        os.write(self._commands, json.dumps(message).encode() + b"\0")
        while True:
            answer = self._read()
            if answer.get("id") == number:
                assert "error" not in answer, (method, answer["error"])
                return answer["result"]
            self._events.append(answer)

    def open(self, path: Path) -> None:
        """Load a file and wait until it is complete."""
        self._events.clear()
        self.call("Page.navigate", url=path.as_uri())
        self.until("document.readyState === 'complete' && document.title !== ''")

    def value(self, expression: str) -> Any:
        """Return the value of an expression in the page."""
        answer = self.call("Runtime.evaluate", expression=expression, returnByValue=True)
        assert "exceptionDetails" not in answer, answer["exceptionDetails"]
        return answer["result"].get("value")

    def until(self, expression: str) -> None:
        """Wait until an expression is true."""
        end = time.monotonic() + _PATIENCE
        while not self.value(expression):
            assert time.monotonic() < end, f"never: {expression}"
            time.sleep(0.02)

    def complaints(self) -> list[str]:
        """Return all errors and warnings of the page since it was opened."""
        self.value("0")  # whatever was said before is read with the answer
        thrown = [e for e in self._events if e["method"] == "Runtime.exceptionThrown"]
        logged = [e["params"]["entry"] for e in self._events if e["method"] == "Log.entryAdded"]
        said = [e["params"] for e in self._events if e["method"] == "Runtime.consoleAPICalled"]
        wrong = [entry for entry in logged if entry["level"] in ("error", "warning")]
        return [json.dumps(entry) for entry in (*thrown, *wrong, *said)]

    def requests(self) -> list[str]:
        """Return the addresses requested since the page was opened, except data in the page."""
        self.value("0")
        asked = [e["params"] for e in self._events if e["method"] == "Network.requestWillBeSent"]
        addresses = [params["request"]["url"] for params in asked]
        return [address for address in addresses if not address.startswith("data:")]

    def key(self, key: str, **parameters: Any) -> None:
        """Press a key."""
        text = {"text": key} if len(key) == 1 else {}
        self.call("Input.dispatchKeyEvent", type="keyDown", key=key, **text, **parameters)
        self.call("Input.dispatchKeyEvent", type="keyUp", key=key, **parameters)

    def resize(self, width: int, height: int, *, dark: bool = False, scale: float = 1) -> None:
        """Set the window's size [px] and the preferred colours."""
        size = {"width": width, "height": height, "deviceScaleFactor": scale}
        self.call("Emulation.setDeviceMetricsOverride", **size, mobile=width < 600)
        preferred = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        self.call("Emulation.setEmulatedMedia", features=[preferred])

    def screenshot(self, whole: bool = False) -> bytes:
        """Return a picture of the window, or of the whole page, as PNG."""
        answer = self.call("Page.captureScreenshot", captureBeyondViewport=whole)
        return base64.b64decode(answer["data"])

    def _read(self) -> dict[str, Any]:
        while b"\0" not in self._buffer:
            ready, _, _ = select.select([self._answers], [], [], _PATIENCE)
            assert ready, "Chromium does not answer"
            part = os.read(self._answers, 1 << 20)
            assert part, "Chromium has ended"
            self._buffer += part
        message, _, self._buffer = self._buffer.partition(b"\0")
        return json.loads(message)


@contextlib.contextmanager
def page(profile: Path) -> Generator[Page]:
    """Start a Chromium with an empty profile and yield a tab."""
    path = found()
    if path is None:
        pytest.skip(f"needs a Chromium or Chrome: none of {', '.join(NAMES)} is on the PATH")
    from_us, to_it = os.pipe()
    from_it, to_us = os.pipe()
    ends = [fcntl.fcntl(end, fcntl.F_DUPFD, _FREE_NUMBER) for end in (from_us, to_us)]
    options = ["--headless", "--no-sandbox", "--disable-gpu", "--remote-debugging-pipe"]
    options += ["--disable-dev-shm-usage", "--no-first-run", f"--user-data-dir={profile}"]
    command = [sys.executable, "-c", _START, *map(str, ends), path, *options]
    process = subprocess.Popen(
        command, pass_fds=ends, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    for end in (from_us, to_us, *ends):
        os.close(end)
    try:
        yield Page(to_it, from_it)
    finally:
        process.terminate()
        process.wait()
        os.close(to_it)
        os.close(from_it)
