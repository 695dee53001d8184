"""Fuzz a kind of file for as long as wanted, guided by coverage. Needs `pip install atheris`.

``python -m tests.fuzz.guided scene -max_total_time=600``, with the options of libFuzzer. Inputs
that reach new code are kept in ``runs/fuzz/scene``, one that is no clear error beside it.
"""

from __future__ import annotations

import importlib
import sys
from pathlib import Path

# What reads files. Kernels are left out: numba does not compile what is instrumented.
READING = [
    "agents.archive",
    "agents.baselines.store",
    "agents.policies",
    "agents.settings",
    "agents.settings_base",
    "magfold_env.checkpoint",
    "magfold_env.design.result",
    "magfold_env.design.suites",
    "magfold_env.ensembles.result",
    "magfold_env.ensembles.run",
    "magfold_env.errors",
    "magfold_env.files",
    "magfold_env.scene",
    "magfold_env.scene_base",
    "magfold_env.scene_field",
    "magfold_env.scene_io",
    "magfold_env.scene_magnets",
    "magfold_env.scene_parts",
    "magfold_env.shapes",
    "json",
    "yaml",
    "zipfile",
]


def main() -> None:
    """Write whole files as a beginning, and fuzz."""
    atheris = importlib.import_module("atheris")
    with atheris.instrument_imports(include=READING):
        readers = importlib.import_module("tests.fuzz.readers")
    name, *options = sys.argv[1:]
    reader = readers.READERS[name]
    corpus = Path("runs/fuzz") / name
    corpus.mkdir(parents=True, exist_ok=True)
    for number, content in enumerate(reader.whole()):
        (corpus / f"whole-{number}").write_bytes(content)

    def one_input(content: bytes) -> None:
        readers.outcome(reader, reader.signed(content))

    prefix = f"-artifact_prefix={corpus.parent}/{name}-"
    atheris.Setup([sys.argv[0], prefix, *options, str(corpus)], one_input)
    atheris.Fuzz()


if __name__ == "__main__":
    main()
