"""Named cases, and campaigns that check many cases in parallel and can be interrupted."""

import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import count, islice
from pathlib import Path

import numpy as np
from pydantic import TypeAdapter

from magfold_bench.stress.kinds import KINDS, Source
from magfold_bench.stress.laws import check
from magfold_bench.stress.verdict import Tally, Verdict
from magfold_env.checkpoint import Checkpoint
from magfold_env.files import physics_digest, sources_digest
from magfold_env.parallel import Workers, finished
from magfold_env.scene import Scene, errors, save_scene

BLOCK = 20
"""Number of cases that a worker checks and stores together."""
WAVE = 32
"""Number of blocks per worker that are handed out between two checks of the time."""

Progress = Callable[[Tally], object]


@dataclass(frozen=True)
class Case:
    """A scene's seed, its kind, and its number among the scenes of this kind."""

    seed: int
    kind: str
    number: int

    @property
    def name(self) -> str:
        """Name of the case and of its file."""
        return f"{self.kind}-{self.seed}-{self.number}"

    def scene(self) -> Scene:
        """Draw the scene, which is the same every time and on all machines."""
        letters = map(ord, self.kind)
        return KINDS[self.kind].make(Source(self.seed, self.number, *letters))

    def verdict(self) -> Verdict:
        """Check the scene; an exception counts as a broken law."""
        try:
            return check(self.scene())
        except Exception as error:
            found = Verdict(status="raised", message=f"{type(error).__name__}: {error}")
            found.require("no exception", False, found.message)
            return found

    def save(self, broken: Iterable[str], folder: Path) -> Path:
        """Write the scene, with the broken laws as comments, and return its file."""
        path = folder / f"{self.name}.yaml"
        lines = [f"case {self.name} of magfold stress breaks", *broken]
        again = f"magfold stress --rerun {path.name}"
        save_scene(self.scene(), path, "\n".join([*lines, f"again: {again}"]))
        return path


def run(
    cases: int,
    seed: int,
    only: Sequence[str] = (),
    *,
    workers: int = 1,
    minutes: float | None = None,
    out: Path | None = None,
    progress: Progress | None = None,
) -> Tally:
    """Try cases of the kinds in ``only``, or of all kinds with a positive share, and count results.

    No more cases begin after ``minutes``. The folder ``out`` contains the state, from which an
    interrupted campaign continues, and the scenes of failing cases. ``progress`` is called with the
    tally so far.
    """
    _check(cases, seed, only, workers, minutes)
    chosen = list(only) or [name for name, kind in KINDS.items() if kind.share]
    every = list(islice(ordered(seed, chosen), cases))
    blocks = [every[k : k + BLOCK] for k in range(0, cases, BLOCK)]
    tally, done = Tally(), set[int]()
    until = None if minutes is None else time.monotonic() + 60.0 * minutes
    processes = Workers(workers, "processes")
    size = WAVE * workers if workers > 1 else 1
    with Checkpoint(None if out is None else out / "state", _key(seed, chosen)) as kept:
        kind = TypeAdapter(tuple[int, int, Tally])
        stored: list[tuple[int, int, Tally]] = kept.load(kind.validate_python)
        for number, count, part in stored:
            # The last block of a shorter campaign was smaller.
            if number not in done and number < len(blocks) and count == len(blocks[number]):
                done.add(number)
                tally.merge(part)
        left = iter([number for number in range(len(blocks)) if number not in done])
        while wave := list(islice(left, size)):
            if until is not None and time.monotonic() > until:
                break
            for place, part in finished(try_block, [blocks[number] for number in wave], processes):
                tally.merge(part)
                if out is not None:
                    _save_failures(part, out / "failures")
                number = wave[place]
                kept.add([number, len(blocks[number]), vars(part)], number)
                if progress is not None:
                    progress(tally)
    return tally


def try_block(block: Sequence[Case]) -> Tally:
    """Check the cases of a block and return their tally."""
    tally = Tally()
    for case in block:
        begun = time.process_time()
        verdict = case.verdict()
        tally.add(case.name, case.kind, verdict, time.process_time() - begun)
    return tally


def ordered(seed: int, kinds: Sequence[str]) -> Iterator[Case]:
    """Yield an endless sequence of cases of the given kinds, in proportion to their shares.

    A case's scene depends only on its kind and its number, not on the other cases.
    """
    shares = [max(KINDS[name].share, 1) for name in kinds]
    mix = np.random.default_rng(0).permutation(np.repeat(np.arange(len(kinds)), shares))
    numbers = Counter[str]()
    for k in count():
        name = kinds[int(mix[k % len(mix)])]
        yield Case(seed, name, numbers[name])
        numbers[name] += 1


def _key(seed: int, kinds: Sequence[str]) -> dict[str, object]:
    return {
        "kind": "stress",
        "physics": physics_digest(),
        "checks": sources_digest("stress/*.py", "laws/*.py", folder=Path(__file__).parents[1]),
        "seed": seed,
        "kinds": list(kinds),
    }


def _save_failures(tally: Tally, folder: Path) -> None:
    if tally.failures:
        folder.mkdir(parents=True, exist_ok=True)
    for failure in tally.failures:
        seed, number = map(int, failure["case"].split("-")[1:])
        case = Case(seed, failure["kind"], number)
        with suppress(errors.SceneError):  # a refused scene has no file
            case.save([words for _, words in failure["broken"]], folder)


def _check(cases: int, seed: int, only: Sequence[str], workers: int, minutes: float | None) -> None:
    problems = errors.unless_whole("cases", cases, 1) + errors.unless_whole("seed", seed, 0)
    problems += errors.unless_whole("workers", workers, 1)
    if minutes is not None:
        problems += errors.unless_positive("minutes", minutes)
    for name in only:
        problems += errors.unless_one_of("only", name, KINDS)
    errors.refuse(problems)
