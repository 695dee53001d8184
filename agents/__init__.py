"""Training and evaluation of policies with Stable-Baselines3."""

import sys
from importlib.util import find_spec

# `magfold_env.files.pip_install` cannot write this text: its own dependencies may be missing.
if not all(map(find_spec, ("sb3_contrib", "stable_baselines3", "tensorboard", "torch"))):
    _message = "agents need Stable-Baselines3: install the extra, pip install -e '.[agents]'"
    if sys.argv[:1] == ["-m"]:  # Python is about to run one of the commands
        sys.stderr.write(f"error: {_message}\n")
        sys.exit(2)
    raise ImportError(_message)
