"""The command line: `main` runs it, `app` contains it, and each command has a module."""

import sys
from typing import Any, cast


def main() -> None:
    """Run the command `magfold`; Ctrl-C ends it with exit code 130, even during imports."""
    cast("Any", sys.stdout).reconfigure(errors="backslashreplace")  # it may lack signs such as ≥
    try:
        from magfold_env.cli.app import app  # noqa: PLC0415 - takes a second

        app()
    except KeyboardInterrupt:
        sys.stderr.write("interrupted\n")
        sys.exit(130)
