"""What energy minimisation alone achieves: the number that a reward is measured against.

For a target word, the energy minimiser designs the sequence with the largest gap between the
target's energy and its best competitor's. That design is fed out of the tube at the best of five
speeds, and the baseline b is its mean score over `SCORING_DRAWS` draws of the physics. The speed
is chosen on other draws, so that b is not flattered by its own luck.
"""

from dataclasses import dataclass
from zlib import crc32

import numpy as np

from magfold_env.designer.exhaustive import LONGEST, gap_designs
from magfold_env.envs.spaces.actions import FASTEST, SLOWEST
from magfold_env.envs.tasks.goals import Goal, Match, goal_of
from magfold_env.scene import Scene
from magfold_env.shapes import folded_words
from magfold_env.simulation.simulate import simulate

CANDIDATE_SPEEDS: tuple[float, ...] = tuple(np.geomspace(SLOWEST, FASTEST, 5).tolist())
"""Feed speeds that a design may use, one for the whole chain [m/s]."""

SELECTION_DRAWS = 16
SCORING_DRAWS = 64


@dataclass(frozen=True)
class Baseline:
    """The energy minimiser's result for one target.

    Attributes
    ----------
    target : str
        The word.
    sequence : tuple of str or None
        The design; None where there is none.
    speed : float or None
        Feed speed at which it does best [m/s].
    score : float
        b, its mean score; 0 without a design.
    success : float
        Share of the draws that ended in success; 0 without a design.
    """

    target: str
    sequence: tuple[str, ...] | None
    speed: float | None
    score: float
    success: float

    @property
    def flagged(self) -> bool:
        """Whether b is 0 for want of a design."""
        return self.sequence is None


def unknown_baseline(target: str) -> Baseline:
    """Return the flagged baseline of a target without a design."""
    return Baseline(target, sequence=None, speed=None, score=0.0, success=0.0)


def designs(scene: Scene) -> dict[str, tuple[str, ...] | None]:
    """Return the minimiser's design for every fully folded word, None where there is none.

    All words together take as long as one, some seconds at six components. Longer chains are
    beyond the exhaustive search and have no designs.
    """
    words = folded_words(scene.n)
    if scene.n > LONGEST:
        return dict.fromkeys(words)
    found = gap_designs(scene, words)
    return {word: design.sequence if design else None for word, design in found.items()}


def evaluate_design(
    scene: Scene, target: str, sequence: tuple[str, ...] | None, match: Match = "word"
) -> Baseline:
    """Return the baseline that the design `sequence` sets for `target`.

    Parameters
    ----------
    scene : Scene
        Tube scene with its spreads; its sequence and feed speeds are replaced.
    target : str
        The word.
    sequence : tuple of str or None
        The design; None gives the flagged baseline.
    match : {"word", "outline"}
        What counts as a success.
    """
    if sequence is None:
        return unknown_baseline(target)
    goal = goal_of(target, match)
    designed = scene.replace(sequence=sequence)
    trials = [
        _trial(designed, goal, speed, "selection", SELECTION_DRAWS) for speed in CANDIDATE_SPEEDS
    ]
    # The slowest of equally good speeds: argmax takes the first.
    speed = CANDIDATE_SPEEDS[int(np.argmax([mean for mean, _ in trials]))]
    mean, success = _trial(designed, goal, speed, "scoring", SCORING_DRAWS)
    return Baseline(target, sequence, speed, mean, success)


def _trial(scene: Scene, goal: Goal, speed: float, stream: str, draws: int) -> tuple[float, float]:
    """Return mean score and share of successes over the fixed draws of the stream `stream`."""
    at_speed = scene.replace(feed={"speed": speed})
    folds = [
        simulate(at_speed.draw(draw_generator(stream, index)))
        for index in range(draws if _draws_anything(scene) else 1)
    ]
    scores = [goal.score(fold.status, fold.joint_angles) for fold in folds]
    successes = [goal.is_reached(fold.status, fold.joint_angles) for fold in folds]
    return float(np.mean(scores)), float(np.mean(successes))


def draw_generator(stream: str, index: int) -> np.random.Generator:
    """Return the generator of draw `index` of a named stream; streams never overlap."""
    key = (crc32(stream.encode()), index)
    return np.random.default_rng(np.random.SeedSequence(0, spawn_key=key))


def _draws_anything(scene: Scene) -> bool:
    """Return whether two draws of `scene` differ; where they don't, one run says it all."""
    return scene.draw(draw_generator("probe", 0)) != scene.draw(draw_generator("probe", 1))
