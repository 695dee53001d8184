"""Compute the shipped target suites: ``python -m magfold_bench.lists.suites``.

This takes an hour. Results are stored as they are found, so that an interrupted run can continue.
"""

from pathlib import Path
from typing import Annotated, Any, get_args

import numpy as np
import typer
import yaml
from rich.progress import Progress

from magfold_env.checkpoint import Checkpoint
from magfold_env.cli import options
from magfold_env.designer import SPEEDS, Design, default_scene, design, suites
from magfold_env.ensembles.releases import ensemble, release
from magfold_env.files import configs_dir, physics_digest
from magfold_env.minimiser import Mode
from magfold_env.parallel import Workers, finished
from magfold_env.scene import io
from magfold_env.shapes import folded_words

LENGTHS = (6, 8, 10, 12, 16)
WORDS = 50
"""Largest number of words in a suite, which are drawn uniformly from all fully folded words."""

RELEASES = 20
ENOUGH = 18
"""With this many successes or more, a sequence found by energy needs no search with releases."""

_COMMENT = """{count} of the {of} fully folded words of {n} components{how}. Each with witnesses: a
sequence whose only ground state it is (gap in J), one of which it is the only stable word, and for
each mode of release a sequence and a feed speed (m/s) with which the suite's scene folds into it;
of the releases counted none was used in a search.
Made by: python -m magfold_bench.lists.suites"""

BUDGET = 600
"""Largest number of releases in a search with releases: two generations of cross-entropy."""

Witnesses = dict[suites.Kind, suites.Witness]


def main(
    lengths: Annotated[list[int] | None, typer.Argument()] = None,
    workers: int = 2,
    state: Path = Path("runs/suites"),
) -> None:
    """Design chains for every target of the suites, and write the suites to the configs folder."""
    with Progress() as progress:
        for n in lengths or LENGTHS:
            words = suite_words(n)
            key = {"kind": f"suite n{n}", "physics": physics_digest()}
            with Checkpoint(state / f"n{n}", key) as kept:
                found: dict[str, Witnesses] = {
                    word: {kind: suites.Witness(**each) for kind, each in witnesses.items()}
                    for word, witnesses in kept.load()
                }
                bar = progress.add_task(f"n{n}", total=len(words), completed=len(found))
                missing = [word for word in words if word not in found]
                for place, witnesses in finished(witnesses_for, missing, Workers(workers)):
                    found[missing[place]] = witnesses
                    plain = {kind: each.model_dump(mode="json") for kind, each in witnesses.items()}
                    kept.add([missing[place], plain])
                    progress.advance(bar)
            suite = suites.Suite(
                scene_name=default_scene(n), words={word: found[word] for word in words}
            )
            path = configs_dir() / "suites" / f"n{n}.yaml"
            save_suite(suite, path, _comment(n))
            progress.console.print(str(path))


def suite_words(n: int) -> list[str]:
    """Return the sorted words of the suite for n components."""
    words = folded_words(n)
    if len(words) <= WORDS:
        return words
    rng = np.random.default_rng(0)
    return sorted(rng.choice(words, WORDS, replace=False).tolist())


def witnesses_for(word: str) -> Witnesses:
    """Search for the witnesses of a word, which are the sequences that a suite lists for it."""
    held = design(word, objective="unique", runs=0, workers=1)
    ground = held
    if not (held.evidence and held.evidence.ground):
        ground = design(word, objective="gap", runs=0, workers=1)
    gap = ground.evidence.gap if ground.evidence else None
    found: Witnesses = {"ground": _witness(ground, gap=gap), "unique": _witness(held)}
    modes: tuple[Mode, ...] = get_args(Mode)
    for mode in modes:
        released = _released(held, mode) if held.reached else None
        if released is None or (released.successes or 0) < ENOUGH:
            released = _designed(word, mode)
        found[mode] = released
    return found


def _released(held: Design, mode: Mode) -> suites.Witness:
    """Release a sequence that was found by energy, and count its successes."""
    assert held.scene is not None
    speed = None if mode == "free" else SPEEDS[0]
    made = ensemble(release(held.scene, mode, speed), RELEASES, held.releases_seed, workers=1)
    hits = made.probability(held.target, "folded").successes
    return suites.Witness(sequence=held.sequence, speed=speed, successes=hits, releases=RELEASES)


def _designed(word: str, mode: Mode) -> suites.Witness:
    found = design(word, mode=mode, budget=BUDGET, runs=RELEASES, workers=1)
    if found.scene is None or found.probability is None:
        return suites.Witness(certificate=found.certificate)
    speed = found.speed if isinstance(found.speed, float) else None
    hits = found.probability.successes
    return suites.Witness(sequence=found.sequence, speed=speed, successes=hits, releases=RELEASES)


def _witness(found: Design, gap: float | None = None) -> suites.Witness:
    """Return a design's sequence, or the reason why there is none."""
    if not found.reached:
        return suites.Witness(certificate=found.certificate)
    return suites.Witness(sequence=found.sequence, gap=gap)


def _comment(n: int) -> str:
    words = folded_words(n)
    count = min(len(words), WORDS)
    how = "" if count == len(words) else ", drawn evenly (NumPy's default generator, seed 0)"
    return _COMMENT.format(count=count, of=len(words), n=n, how=how)


def save_suite(suite: suites.Suite, path: str | Path, comment: str) -> None:
    """Write a suite as YAML, below a comment."""
    data: dict[str, Any] = {"scene_name": suite.scene_name, "words": {}}
    for word, witnesses in suite.words.items():
        data["words"][word] = {kind: _plain(witness) for kind, witness in witnesses.items()}
    io.write_commented(path, yaml.safe_dump(data, sort_keys=False, width=200), comment)


def _plain(witness: suites.Witness) -> dict[str, Any]:
    found = witness.model_dump(exclude_defaults=True)
    if witness.sequence is not None:
        found["sequence"] = " ".join(witness.sequence)
    return found


if __name__ == "__main__":
    options.application_of(main)()
