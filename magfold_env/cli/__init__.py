"""The command line: `main` runs it, `app` contains it, and each command has a module."""

import sys
from typing import Any, cast


def main() -> None:
    """Run the command `magfold`; Ctrl-C ends it quietly with exit code 130, imports included."""
    cast("Any", sys.stdout).reconfigure(errors="backslashreplace")  # it may not have every sign
    try:
        from magfold_env.cli.app import app  # noqa: PLC0415 - takes a second

        app()
    except KeyboardInterrupt:
        sys.stderr.write("interrupted\n")
        sys.exit(130)
