"""Random scenes with contact; a seed gives the same scene on every machine and with every engine.

Scenes with even seeds have sequences designed for a folded word; the other sequences are random.
Designs use neither simulations nor energies, so changes to the physics do not change the scenes.
"""

import math
from typing import Any

import numpy as np

from magfold_env.minimiser.lattice import from_words
from magfold_env.minimiser.states import conflicts
from magfold_env.scene import Scene
from magfold_env.shapes import overlaps

SMALLEST, LARGEST = 3, 12  # components
SLOWEST, FASTEST = 0.01, 0.6  # feed speeds [m/s]
FRICTIONLESS = 0.15  # share of scenes without friction
DURATION = 2.0  # [s] after the last release
DRAWS = 100  # sequences drawn per word

Sequence = tuple[str, ...]


def random_scene(seed: int) -> Scene:
    """Return the concrete scene for a seed.

    Feed speeds are drawn log-uniformly, and all other numbers are drawn uniformly.
    """
    rng = np.random.default_rng([seed, 0x5EED])
    n = int(rng.integers(SMALLEST, LARGEST + 1))
    sequence = designed_sequence(rng, n) if is_designed(seed) else random_sequence(rng, n)
    friction = 0.0 if rng.random() < FRICTIONLESS else float(rng.random())
    changes: dict[str, Any] = {"mount": str(rng.choice(["pinned", "free", "tube"]))}
    if changes["mount"] == "tube":
        changes["feed"] = {
            "direction": str(rng.choice(["forward", "backward"])),
            "loading": str(rng.choice(["preloaded", "at_mouth"])),
            "speed": math.exp(rng.uniform(math.log(SLOWEST), math.log(FASTEST))),
        }
    scene = Scene(sequence=sequence, friction=friction, duration=DURATION)
    return scene.replace(**changes).draw(rng)


def is_designed(seed: int) -> bool:
    """Return whether the scene for a seed has a sequence that is designed to fold."""
    return seed % 2 == 0


def random_sequence(rng: np.random.Generator, n: int, letters: str = "NS") -> Sequence:
    """Draw every face independently from ``letters``."""
    return tuple("".join(row) for row in rng.choice(list(letters), (n, 4)))


def random_word(rng: np.random.Generator, n: int) -> str:
    """Draw a word of L and R without overlap, letter by letter."""
    word = ""
    while len(word) < n - 1:
        options = [word + letter for letter in "LR" if not overlaps(word + letter)]
        # After a dead end, start again.
        word = str(rng.choice(options)) if options else ""
    return word


def designed_sequence(rng: np.random.Generator, n: int) -> Sequence:
    """Draw a sequence that pulls every joint towards one folded word.

    Of several draws, the one with the fewest like poles touching in closed loops is returned.
    """
    word = random_word(rng, n)
    lattice = from_words([word])
    draws = (pulled_sequence(rng, word) for _ in range(DRAWS))
    best, fewest = next(draws), 4 * n
    for sequence in draws:
        count = len(conflicts(lattice, sequence))
        if count < fewest:
            best, fewest = sequence, count
        if fewest == 0:
            break
    return best


def pulled_sequence(rng: np.random.Generator, word: str) -> Sequence:
    """Draw a sequence whose neighbours attract where they are to meet and repel on the other side.

    A left turn brings a component's front-left face to the next component's back-left face; a right
    turn brings the front-right face to the back-right face. So no face has to meet two conditions.
    """
    n = len(word) + 1
    sign = rng.choice([-1, 1], (n, 4))  # front-left, back-left, back-right, front-right
    for k, letter in enumerate(word):
        toward = 1 if letter == "L" else -1
        sign[k + 1, 1] = -toward * sign[k, 0]
        sign[k + 1, 2] = toward * sign[k, 3]
    return tuple("".join("N" if face > 0 else "S" for face in row) for row in sign)
