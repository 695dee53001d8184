"""Photograph the laboratory for its page: `python -m tests.browser.picture docs/laboratory.png`."""

import sys
import tempfile
from pathlib import Path

from magfold_env.browser import build
from tests.replay import chromium


def photograph(path: Path) -> None:
    """Write a picture of the laboratory as it opens, at the end of its fold."""
    with tempfile.TemporaryDirectory() as profile, chromium.page(Path(profile)) as page:
        page.resize(1200, 800)
        page.open(build.page())
        page.until("window.laboratory !== undefined && byId('states').ariaBusy === 'false'")
        page.value("laboratory.player.pause()")
        page.value("laboratory.player.seek(laboratory.player.motion.end)")
        path.write_bytes(page.screenshot())


if __name__ == "__main__":
    photograph(Path(sys.argv[1]))
