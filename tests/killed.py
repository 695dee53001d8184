"""Functions that kill processes after a number of records, and that read their files."""

import json
import signal
import sqlite3
import subprocess
from contextlib import closing
from pathlib import Path
from typing import Any

from magfold_env.checkpoint import FILE
from tests.command_line import python

# However busy the machine is: the process breaks itself off, and writes every record at once.
_PRELUDE = """
import os, resource, signal
from magfold_env import checkpoint

save, numbers = checkpoint.Checkpoint.save, {{}}

def save_and_end(kept):
    written = numbers.setdefault(kept._file, set())
    written.update(kept._pending)
    save(kept)
    if len(written) == {records}:
        {end}

checkpoint.EVERY, checkpoint.Checkpoint.save = -1.0, save_and_end
"""
ENDS = {
    "kill": "os.kill(os.getpid(), signal.SIGKILL)",
    "Ctrl-C": "os.kill(os.getpid(), signal.SIGINT)",
    # No file may grow beyond so many bytes, not even the one that undoes half a transaction.
    "full disk": "resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))",
}
"""Ways in which a process ends."""


def run_until(
    end: str, records: int, code: str, *arguments: str
) -> subprocess.CompletedProcess[str]:
    """Run Python code with arguments; end it by one of `ENDS` after a number of records."""
    prelude = _PRELUDE.format(records=records, end=ENDS[end])
    return python("-c", prelude + code, *arguments, check=False)


def run_until_killed(records: int, code: str, *arguments: str) -> None:
    """Run Python code with arguments; kill it after a number of records."""
    assert run_until("kill", records, code, *arguments).returncode == -signal.SIGKILL


def records_in(folder: Path) -> dict[int, Any]:
    """Return the records in a folder, by number."""
    with closing(sqlite3.connect(folder / FILE)) as database:
        rows = database.execute("SELECT number, record FROM records ORDER BY number")
        return {number: json.loads(text) for number, text in rows}
