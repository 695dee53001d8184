"""Fuzz a kind of file for as long as wanted, guided by coverage. Needs `pip install atheris`.

``python -m tests.fuzz.guided scene -max_total_time=600``, with the options of libFuzzer. Inputs
that reach new code are kept in ``runs/fuzz/scene``, one that is no clear error beside it.
"""

from __future__ import annotations

import importlib
import sys
from collections.abc import Iterator
from pathlib import Path
from types import FunctionType
from typing import Any

# What reads files. Kernels are not among it: numba does not compile what is instrumented.
READING = [
    "agents.evaluation.policies",
    "agents.settings",
    "agents.training.models",
    "magfold_env.checkpoint",
    "magfold_env.designer.result",
    "magfold_env.designer.suites",
    "magfold_env.ensembles.releases",
    "magfold_env.ensembles.sweeps",
    "magfold_env.files",
    "magfold_env.scene.base",
    "magfold_env.scene.errors",
    "magfold_env.scene.io",
    "magfold_env.scene.magnets",
    "magfold_env.scene.obstacles",
    "magfold_env.scene.parts",
    "magfold_env.scene.scene",
    "magfold_env.scoring.action_file",
    "magfold_env.scoring.network",
    "magfold_env.scoring.policy_file",
    "magfold_env.scoring.results",
    "magfold_env.scoring.score",
    "magfold_env.shapes",
    "json.decoder",
    "json.scanner",
    "yaml.composer",
    "yaml.constructor",
    "yaml.parser",
    "yaml.reader",
    "yaml.resolver",
    "yaml.scanner",
    "zipfile",
]


def main() -> None:
    """Write whole files as a beginning, and fuzz."""
    atheris = importlib.import_module("atheris")
    readers = importlib.import_module("tests.fuzz.readers")
    for module in map(importlib.import_module, READING):
        for function in functions_of(module):
            atheris.instrument_func(function)
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


def functions_of(holder: Any, module: str = "") -> Iterator[FunctionType]:
    """Yield the functions and methods that a module defines."""
    module = module or holder.__name__
    for value in list(vars(holder).values()):
        inner = getattr(value, "__func__", value)
        if getattr(inner, "__module__", None) != module:
            continue
        if isinstance(inner, FunctionType):
            yield inner
        elif isinstance(inner, type):
            yield from functions_of(inner, module)


if __name__ == "__main__":
    main()
