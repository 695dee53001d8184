"""Training and evaluation of policies with Stable-Baselines3."""

import os
import sys
from importlib.util import find_spec
from typing import Any

_IS_COMMAND = sys.argv[:1] == ["-m"]  # Python is about to run one of the commands


def _report(kind: type[BaseException], *error: Any) -> None:
    """Print an uncaught exception; for Ctrl-C, even during imports, print only "interrupted"."""
    if issubclass(kind, KeyboardInterrupt):
        sys.stderr.write("interrupted\n")
        sys.exit(130)
    sys.__excepthook__(kind, *error)


if _IS_COMMAND:
    sys.excepthook = _report

# For torch's OpenMP, before torch is loaded: its threads must not keep cores busy while they wait.
os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")

# `magfold_env.files.pip_install` cannot write this text: its own dependencies may be missing.
if not all(map(find_spec, ("sb3_contrib", "stable_baselines3", "tensorboard", "torch"))):
    _message = "agents need Stable-Baselines3: install the extra, pip install -e '.[agents]'"
    if _IS_COMMAND:
        sys.stderr.write(f"error: {_message}\n")
        sys.exit(2)
    raise ImportError(_message)
