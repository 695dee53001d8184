"""Sequences that meet what the paper says of energies: all of them, for a geometry.

Every state that is named must be stable, so that the poles of its touching faces are opposite:
what is left of all sequences is few enough to be listed.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from magfold_bench.paper.figure_18 import NEARLY, movement
from magfold_bench.paper.quoted import TABLE_1
from magfold_env.engine.state import Array
from magfold_env.minimiser import Landscape, Mode
from magfold_env.minimiser.energies import internal_energy
from magfold_env.minimiser.lattice import ORDER, from_words
from magfold_env.minimiser.states import touching_faces
from magfold_env.scene import Scene
from magfold_env.shapes import folded_words, mirror, outline

GOAL = "LRLLL"
"""S3A, up to mirroring: of its outline's two words the one in which 3 and 6 touch."""
LINE = "LRLRL"
"""S2B: the fold that is a straight line, up to mirroring."""
GAP = 0.01

_JOINTS, _FACES = 5, 24


@dataclass(frozen=True)
class Candidate:
    """A sequence, its named states, and which of the further statements of energies it meets."""

    number: int
    """Of the paper's sequence it may be."""
    sequence: tuple[str, ...]
    names: dict[str, str]
    """Words of S1A … by name, as far as there are such states."""
    stable: frozenset[str]
    energies: dict[str, bool] = field(default_factory=dict[str, bool])
    """By the names in `statements.ENERGIES`."""


class Candidates:
    """All sequences of a geometry that meet the paper's statements of energies.

    Parameters
    ----------
    scene
        In the paper's own model, any sequence of six.
    """

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        landscape = Landscape(scene)
        self._index = {word: k for k, word in enumerate(landscape.words)}
        self._folded = folded_words(scene.n)
        self._touching = {word: touching_faces(from_words([word])) for word in self._folded}
        self._landscape = landscape

    def __call__(self, number: int) -> list[Candidate]:
        """Return the candidates for one of the paper's sequences, in a fixed order."""
        # S1A has the outline of S3A, which two words cover.
        goals = [w for w in self._folded if outline(w) == outline(GOAL)] if number == 1 else [GOAL]
        return [each for goal in goals for each in self._of(number, goal)]

    def _of(self, number: int, ground: str) -> Iterator[Candidate]:
        """Yield the candidates whose global minimum is one word."""
        signs = self._signs(ground)
        energy = self._landscape.energies(signs.reshape(-1, self._scene.n, 4).astype(np.float64))
        folded = energy[:, [self._index[word] for word in self._folded]]
        stable = np.stack([self._opposite(signs, word) for word in self._folded], axis=1)
        lowest = folded.argmin(axis=1) == self._folded.index(ground)
        signs, energy = signs[lowest], energy[lowest]
        folded, stable = folded[lowest], stable[lowest]
        forward, backward = (self._one_by_one(energy, joints) for joints in _orders())
        rank = np.argsort(folded, axis=1, kind="stable")
        for k in np.flatnonzero(self._likely(number, ground, stable, forward, backward)):
            order: list[int] = rank[k].tolist()
            words = [self._folded[r] for r in order]
            states = [self._folded[r] for r in order if stable[k, r]]
            levels = {self._folded[r]: float(folded[k, r]) for r in order}
            ends: dict[Mode, str] = {"forward": str(forward[k]), "backward": str(backward[k])}
            if found := self._judged(number, signs[k], words, states, levels, ends):
                yield found

    def _signs(self, word: str) -> NDArray[np.int8]:
        """Return all sequences in which a word is stable, the first face N, as signs."""
        partner = {max(pair): min(pair) for pair in self._touching[word]}
        free = [face for face in range(1, _FACES) if face not in partner]
        numbers = np.arange(1 << len(free))
        signs = np.ones((len(numbers), _FACES), dtype=np.int8)
        for bit, face in enumerate(free):
            signs[:, face] = 1 - 2 * ((numbers >> bit) & 1)
        for face in sorted(partner):
            signs[:, face] = -signs[:, partner[face]]
        return signs

    def _opposite(self, signs: NDArray[np.int8], word: str) -> NDArray[np.bool_]:
        one, other = np.array(self._touching[word]).T
        return np.asarray((signs[:, one] * signs[:, other] < 0).all(axis=1))

    def _one_by_one(self, energy: Array, joints: range) -> NDArray[np.str_]:
        """Return where the component-by-component search of each sequence ends."""
        reached: dict[str, NDArray[np.intp]] = {"S" * _JOINTS: np.arange(len(energy))}
        for joint in joints:
            parts: dict[str, list[NDArray[np.intp]]] = {}
            for word, rows in reached.items():
                options = [word[:joint] + letter + word[joint + 1 :] for letter in ORDER]
                options = [option for option in options if option in self._index]
                if not options:
                    continue
                columns = [self._index[option] for option in options]
                best = energy[rows][:, columns].argmin(axis=1)
                for place, option in enumerate(options):
                    parts.setdefault(option, []).append(rows[best == place])
            reached = {word: np.concatenate(rows) for word, rows in parts.items()}
        ends = np.full(len(energy), "", dtype=f"<U{_JOINTS}")
        for word, rows in reached.items():
            ends[rows] = word
        return ends

    def _likely(
        self,
        number: int,
        ground: str,
        stable: NDArray[np.bool_],
        forward: NDArray[np.str_],
        backward: NDArray[np.str_],
    ) -> NDArray[np.bool_]:
        """Return which sequences may do, by what is quick to tell."""
        if number == 1:
            return (forward == ground) & (backward != ground) & (stable.sum(axis=1) >= 3)
        end = LINE if number == 2 else ground
        fits = stable[:, self._folded.index(end)] & (forward == end) & (backward == end)
        return fits & ((stable.sum(axis=1) > 2) if number == 2 else (stable.sum(axis=1) == 1))

    def _judged(
        self,
        number: int,
        signs: NDArray[np.int8],
        words: list[str],
        states: list[str],
        levels: dict[str, float],
        ends: dict[Mode, str],
    ) -> Candidate | None:
        """Return a sequence as a candidate, if it is one.

        ``words`` are all full folds and ``states`` the stable ones, lowest first.
        """
        names = {f"S{number}{letter}": word for letter, word in zip("ABC", states, strict=False)}
        if any(names.get(TABLE_1[number][mode]) != end for mode, end in ends.items()):
            return None
        sequence = _sequence(signs)
        made = Candidate(number, sequence, names, frozenset(states))
        if number == 3:
            return made
        a, b, c = states[:3]
        if number == 2:
            touches = {word: len(self._touching[word]) for word in states}
            apart = sum(x != y for x, y in zip(b, c, strict=True))
            if apart != 2 or max(touches[word] for word in states[1:]) >= touches[a]:
                return None
            inside = internal_energy(self._scene.replace(sequence=sequence))
            made.energies["2 positive"] = min(levels[word] for word in (a, b, c)) + inside > 0.0
            return made
        if words.index(c) != 3:
            return None
        conflict = next(word for word in words[:3] if word not in states)
        names["S1E"] = conflict
        moved = {word: movement(word) for word in states}
        inside = internal_energy(self._scene.replace(sequence=sequence))
        clashes = [
            (one // 4 + 1, other // 4 + 1)
            for one, other in self._touching[conflict]
            if signs[one] * signs[other] > 0
        ]
        made.energies["1 gap"] = levels[b] + inside < (1.0 - GAP) * (levels[a] + inside)
        made.energies["1 five"] = words[4] in states
        made.energies["1 conflict"] = clashes == [(4, 5)]
        made.energies["1 line"] = LINE not in states and mirror(LINE) not in states
        made.energies["1 movement"] = moved[c] <= NEARLY * min(moved.values())
        return made


def _orders() -> tuple[range, range]:
    """Return the order of the joints, forward and backward."""
    return range(_JOINTS), range(_JOINTS - 1, -1, -1)


def _sequence(signs: NDArray[np.int8]) -> tuple[str, ...]:
    letters = "".join("N" if sign > 0 else "S" for sign in signs)
    return tuple(letters[k : k + 4] for k in range(0, len(letters), 4))
