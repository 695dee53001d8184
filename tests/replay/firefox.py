"""A headless Firefox driven by Marionette, its own protocol, without any further package."""

from __future__ import annotations

import base64
import contextlib
import json
import shutil
import socket
import subprocess
import time
from collections.abc import Generator
from pathlib import Path
from typing import Any

NAMES = ("firefox-esr", "firefox")
_PATIENCE = 600.0  # [s] waited out only where nothing comes; shared machines are slow
# Nothing is fetched but what a test asks for, and what scripts complain of is written out.
_PREFERENCES = {
    "marionette.port": 0,
    "browser.shell.checkDefaultBrowser": False,
    "browser.startup.homepage_override.mstone": "ignore",
    "datareporting.policy.dataSubmissionEnabled": False,
    "browser.dom.window.dump.enabled": True,
    "devtools.console.stdout.content": True,
    "network.captive-portal-service.enabled": False,
    "network.connectivity-service.enabled": False,
}


def found() -> str | None:
    """Return the path of a Firefox, if this machine has one."""
    paths = (shutil.which(name) for name in NAMES)
    return next((path for path in paths if path), None)


class Page:
    """One tab."""

    def __init__(self, port: int, said: Path) -> None:
        self._socket = socket.create_connection(("127.0.0.1", port), timeout=_PATIENCE)
        self._buffer = b""
        self._number = 0
        self._said, self._read_to, self._address = said, 0, "about:blank"
        self._read()  # its greeting
        self.call("WebDriver:NewSession", capabilities={})
        self.call("WebDriver:SetTimeouts", script=int(1e3 * _PATIENCE))

    def call(self, name: str, **parameters: Any) -> Any:
        """Send a command and return its result."""
        self._number += 1
        body = json.dumps([0, self._number, name, parameters]).encode()
        self._socket.sendall(b"%d:%b" % (len(body), body))
        _, number, error, result = self._read()
        assert number == self._number
        assert error is None, (name, error)
        return result

    def open(self, path: Path) -> None:
        """Load a file and wait until it stands."""
        self._read_to, self._address = self._said.stat().st_size, path.as_uri()
        self.call("WebDriver:Navigate", url=path.as_uri())

    def value(self, expression: str) -> Any:
        """Return what an expression is in the page, which sees what windows have by name."""
        script = f"return ({expression});"
        return self.call("WebDriver:ExecuteScript", script=script, args=[])["value"]

    def until(self, expression: str) -> None:
        """Wait until an expression is true."""
        end = time.monotonic() + _PATIENCE
        while not self.value(expression):
            assert time.monotonic() < end, f"never: {expression}"
            time.sleep(0.02)

    def key(self, key: str, *kinds: str) -> None:
        """Press a key, or only ``keyDown`` or ``keyUp``."""
        actions = [{"type": kind, "value": key} for kind in kinds or ("keyDown", "keyUp")]
        keyboard = {"type": "key", "id": "keyboard", "actions": actions}
        self.call("WebDriver:PerformActions", actions=[keyboard])

    def complaints(self) -> list[str]:
        """Return what the page threw, or was forbidden, since it was opened."""
        text = self._said.read_bytes()[self._read_to :].decode(errors="replace")
        return [line for line in text.splitlines() if self._address in line]

    def resize(self, width: int, height: int) -> None:
        """Set the window's size [px]."""
        self.call("WebDriver:SetWindowRect", width=width, height=height)

    def screenshot(self) -> bytes:
        """Return a picture of the window as PNG."""
        return base64.b64decode(self.call("WebDriver:TakeScreenshot", full=False)["value"])

    def close(self) -> None:
        """Say no more."""
        self._socket.close()

    def _read(self) -> Any:
        while b":" not in self._buffer:
            self._receive()
        size, _, self._buffer = self._buffer.partition(b":")
        while len(self._buffer) < int(size):
            self._receive()
        body, self._buffer = self._buffer[: int(size)], self._buffer[int(size) :]
        return json.loads(body)

    def _receive(self) -> None:
        part = self._socket.recv(1 << 20)
        assert part, "Firefox has ended"
        self._buffer += part


@contextlib.contextmanager
def page(profile: Path) -> Generator[Page]:
    """Start a Firefox with an empty profile and offer a tab."""
    path = found()
    assert path is not None
    lines = (f'user_pref("{key}", {json.dumps(value)});' for key, value in _PREFERENCES.items())
    profile.joinpath("user.js").write_text("\n".join(lines), encoding="utf-8")
    said, port = profile / "said.txt", profile / "MarionetteActivePort"
    command = [path, "--headless", "--marionette", "--no-remote", "--profile", str(profile)]
    with said.open("wb") as output:
        process = subprocess.Popen(command, stdout=output, stderr=subprocess.STDOUT)
    try:
        end = time.monotonic() + _PATIENCE
        while not port.is_file() or not port.read_text().strip():
            assert process.poll() is None, said.read_text(errors="replace")
            assert time.monotonic() < end, "Firefox does not answer"
            time.sleep(0.05)
        offered = Page(int(port.read_text()), said)
        try:
            yield offered
        finally:
            offered.close()
    finally:
        process.terminate()
        process.wait()
