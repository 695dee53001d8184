"""Compute the shipped target suites: ``python -m magfold_env.design.make_suites`` (an hour or two).

What was found is kept in a folder as it is found, so that a run that was stopped goes on.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Annotated, cast, get_args

import numpy as np
import typer
from rich.progress import Progress

from magfold_env.checkpoint import Checkpoint
from magfold_env.design.designer import design
from magfold_env.design.result import Objective
from magfold_env.design.suites import Kind, Suite, Witness, save_suite
from magfold_env.design.task import default_scene
from magfold_env.energy.result import Mode
from magfold_env.files import configs_dir, physics_digest
from magfold_env.parallel import Workers, finished
from magfold_env.shapes import folded_words

LENGTHS = (6, 8, 10, 12, 16)
WORDS = 50
"""Of longer chains: drawn evenly, seed 0, of all fully folded ones. Of six components all 26."""

RELEASES = 50

_COMMENT = """{count} of the {of} fully folded words of {n} components{how}. Each with witnesses: a
sequence whose only ground state it is (gap in J), one of which it is the only stable word, and for
each mode of release a sequence and a feed speed (m/s) with which the suite's scene folds into it;
of the releases counted none was used in the search.
Made by: python -m magfold_env.design.make_suites"""

_BY_ENERGY: dict[Kind, Objective] = {"ground": "ground", "unique": "unique"}


def main(
    lengths: Annotated[list[int] | None, typer.Argument()] = None,
    workers: int = 2,
    state: Path = Path("runs/suites"),
) -> None:
    """Design for every target of the suites, and write them to the folder of settings."""
    with Progress() as progress:
        for n in lengths or LENGTHS:
            words = suite_words(n)
            jobs = [(word, kind) for word in words for kind in get_args(Kind)]
            kept = Checkpoint(state / f"n{n}", {"kind": f"suite n{n}", "physics": physics_digest()})
            found: dict[tuple[str, Kind], Witness] = {
                (word, kind): Witness(**witness) for word, kind, witness in kept.load()
            }
            bar = progress.add_task(f"n{n}", total=len(jobs), completed=len(found))
            missing = [job for job in jobs if job not in found]
            for place, witness in finished(witness_for, missing, Workers(workers)):
                found[missing[place]] = witness
                kept.add([*missing[place], witness.model_dump(mode="json")])
                progress.advance(bar)
            kept.save()
            table = {word: {kind: found[word, kind] for kind in get_args(Kind)} for word in words}
            path = configs_dir() / "suites" / f"n{n}.yaml"
            save_suite(Suite(scene_name=default_scene(n), words=table), path, _comment(n))
            progress.console.print(str(path))


def suite_words(n: int) -> list[str]:
    """Return the words of the suite of n components, sorted."""
    words = folded_words(n)
    if len(words) <= WORDS:
        return words
    rng = np.random.default_rng(0)
    return sorted(rng.choice(words, WORDS, replace=False).tolist())


def witness_for(job: tuple[str, Kind]) -> Witness:
    """Search for a witness of one kind for one word."""
    word, kind = job
    search = partial(design, word, workers=1)
    if kind not in get_args(Mode):
        found = search(objective=_BY_ENERGY[kind], runs=0)
        if found.scene is None or not found.reached:
            return Witness(certificate=found.certificate)
        gap = None if kind == "unique" or found.evidence is None else found.evidence.gap
        return Witness(sequence=found.sequence, gap=gap)
    found = search(mode=cast("Mode", kind), runs=RELEASES)
    if found.scene is None or found.probability is None:
        return Witness(certificate=found.certificate)
    speed = found.speed if isinstance(found.speed, float) else None
    hits = found.probability.successes
    return Witness(sequence=found.sequence, speed=speed, successes=hits, releases=RELEASES)


def _comment(n: int) -> str:
    words = folded_words(n)
    count = min(len(words), WORDS)
    how = "" if count == len(words) else ", drawn evenly (NumPy's default generator, seed 0)"
    return _COMMENT.format(count=count, of=len(words), n=n, how=how)


if __name__ == "__main__":
    typer.run(main)
