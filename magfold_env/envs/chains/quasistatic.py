"""Chains that fold by energy minimisation, joint by joint, without dynamics.

There is no time, so speeds have no effect. There is no friction, and nothing is random. A joint is
decided when the component behind it has left the tube, and does not change afterwards.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from magfold_env.engine.compile.by_pointer import by_pointer, pointer
from magfold_env.engine.compile.jit import kernel
from magfold_env.envs.chains.arrays import (
    FOLDED,
    MISFOLDED,
    STATUSES,
    ChainArrays,
    Floats,
    Ints,
    clear,
    component,
)
from magfold_env.envs.chains.lattice import (
    DEAD_END,
    LETTERS,
    LatticeFeed,
    LatticeRules,
    energy,
    in_line,
    lay,
)
from magfold_env.envs.spaces.actions import SIGNS, letters_of, signs_of
from magfold_env.scene import Scene
from magfold_env.simulation.endings import named


@by_pointer
class _Lattice(NamedTuple):
    """Chains on the lattice, with components in the order in which they leave the tube."""

    out: Ints  # number of components outside the tube, (m,)
    poles: Floats  # charges, (m, n, 4)
    cells: Ints  # centres, (m, n, 2)
    quarters: Ints  # headings in quarter turns, (m, n)
    turns: Ints  # quarter turns of the joints, component 1 first, (m, n − 1)
    speeds: Floats  # requested [m/s], component 1 first, (m, n)


@by_pointer
class _Chains(NamedTuple):
    """Everything that kernels need, in one tuple, because each tuple argument slows down calls."""

    arrays: ChainArrays
    lattice: _Lattice
    rules: LatticeRules


class QuasistaticChains:
    """Chains of one scene, which need no random draws and only one thread."""

    def __init__(self, rules: LatticeFeed, count: int) -> None:
        n = rules.n
        self._rules = rules
        self._lattice = _Lattice(
            out=np.zeros(count, dtype=np.int64),
            poles=np.zeros((count, n, 4)),
            cells=np.zeros((count, n, 2), dtype=np.int64),
            quarters=np.zeros((count, n), dtype=np.int64),
            turns=np.zeros((count, n - 1), dtype=np.int64),
            speeds=np.zeros((count, n)),
        )
        self.arrays = ChainArrays.empty(count, n)
        self.seen = pointer(self.arrays)
        """A pointer to `arrays`, which makes calls of kernels fastest."""
        self._chains = pointer(_Chains(self.arrays, self._lattice, rules.packed))

    def begin(self, rows: Ints, rngs: Sequence[np.random.Generator] = (), kind: int = 0) -> None:
        """Put the given chains into their tubes; `rngs` and `kind` have no effect."""
        _begin(rows, self._rules.forward, self._chains)

    def feed(self, rows: Ints, patterns: Ints, speeds: Floats, scaled: Floats) -> None:
        """Feed the next components of each chain and decide a joint for each of them.

        Arguments are those of `DynamicChains.feed`; speeds have no effect.
        """
        ordered = patterns if self._rules.forward else patterns[:, ::-1]
        _feed(rows, SIGNS.take(ordered, axis=0), speeds, scaled, self._chains)

    def predict(self, row: int, signs: Floats) -> None:
        """Feed components with the outward poles `signs`, (count, 4), in the order of feed."""
        one = np.zeros(1)
        _feed(np.array([row]), np.ascontiguousarray(signs[None]), one, one, self._chains)

    def word(self, row: int) -> str:
        """Return the fold word so far, with the undecided joints straight."""
        return "".join(LETTERS[turn] for turn in self._lattice.turns[row].tolist())

    def energies(self, rows: Ints) -> Floats:
        """Return the magnetic energies of the components outside the tubes [J]."""
        found = np.empty(len(rows))
        _energies(rows, self._chains, found)
        return found

    def message(self, row: int) -> str:
        """Return a message about how a fold ended."""
        turns, out, n = self._lattice.turns[row], int(self._lattice.out[row]), self._rules.n
        if out < n:
            joint = out if self._rules.forward else n - out
            return f"stuck: every letter of joint {joint} overlaps after {self.word(row)!r}"
        straight = [number for number, turn in enumerate(turns.tolist(), 1) if turn == 0]
        return f"at rest with {named(straight)} open" if straight else "folded"

    def held(self, row: int) -> NDArray[np.bool_]:
        """Return False for every component, because there is no friction."""
        return np.zeros(self._rules.n, dtype=np.bool_)

    def motion(self) -> None:
        """Return None, because there is no motion."""
        return

    def scene(self, row: int) -> Scene:
        """Return the scene of a chain, with the magnets and speeds of the fed components."""
        scene, arrays = self._rules.scene, self.arrays
        sequence, speeds = list(scene.sequence), scene.speeds
        for index in arrays.order(row)[: arrays.fed[row]]:
            sequence[index] = letters_of(arrays.signs[row, index])
            speeds[index] = self._lattice.speeds[row, index]
        return scene.replace(sequence=sequence, feed={"speed": speeds})

    def get_state(self) -> tuple[Any, ...]:
        """Return the complete state of the chains."""
        return tuple([each.copy() for each in group] for group in (self.arrays, self._lattice))

    def set_state(self, state: tuple[Any, ...]) -> None:
        """Restore a state that `get_state` returned."""
        for group, values in zip((self.arrays, self._lattice), state, strict=True):
            for array, value in zip(group, values, strict=True):
                array[:] = value

    def close(self) -> None:
        """Do nothing, because there are no threads."""


class QuasistaticFold(NamedTuple):
    """The fold that a chain reaches by energy minimisation."""

    word: str
    """The fold word so far, with the undecided joints straight."""
    status: str | None
    """`folded` or `misfolded`; None until all components are out."""
    message: str
    """A message about the status."""
    energy: float
    """Magnetic energy of the components outside the tube [J]."""

    @property
    def is_stuck(self) -> bool:
        """Whether folding stopped because every letter of a joint causes an overlap."""
        return self.status is not None and self.message.startswith("stuck")


def predict(rules: LatticeFeed, signs: Floats) -> QuasistaticFold:
    """Return the fold after feeding components with the outward poles `signs`, (count, 4)."""
    chains, row = QuasistaticChains(rules, 1), np.array([0])
    chains.begin(row)
    chains.predict(0, signs)
    status = STATUSES[int(chains.arrays.status[0])]
    return QuasistaticFold(
        chains.word(0), status, chains.message(0), float(chains.energies(row)[0])
    )


def fold(scene: Scene) -> QuasistaticFold:
    """Return the quasistatic fold of a tube scene."""
    rules = LatticeFeed(scene)
    signs = np.array([signs_of(faces) for faces in scene.sequence])
    return predict(rules, signs if rules.forward else signs[::-1])


@kernel
def _begin(rows: Ints, forward: bool, chains: _Chains) -> None:
    """Put chains into their tubes."""
    lattice = chains.lattice
    clear(rows, forward, chains.arrays)
    for j in range(rows.size):
        k: int = rows[j]
        lattice.out[k] = 0
        lattice.cells[k] = lattice.quarters[k] = lattice.turns[k] = 0
        lattice.poles[k] = lattice.speeds[k] = 0.0
    _come_out(rows, 0, chains)


@kernel
def _feed(
    rows: Ints,
    signs: Floats,
    speeds: Floats,
    scaled: Floats,
    chains: _Chains,
) -> None:
    """Store poles (rows, components, 4) in the order of feed and release these components."""
    arrays, lattice, rules = chains.arrays, chains.lattice, chains.rules
    n = rules.strengths.shape[0]
    for j in range(rows.size):
        k: int = rows[j]
        for c in range(signs.shape[1]):
            place = arrays.fed[k]
            i = component(arrays.forward[k], place, n)
            for face in range(4):
                arrays.signs[k, i, face] = signs[j, c, face]
                lattice.poles[k, place, face] = signs[j, c, face] * rules.strengths[i, face]
            lattice.speeds[k, i] = speeds[j]
            arrays.speeds[k, i] = scaled[j]
            arrays.fed[k] = place + 1
    _come_out(rows, signs.shape[1], chains)


@kernel
def _come_out(rows: Ints, until: int, chains: _Chains) -> None:
    """Release ``until`` components of each chain, and set the status of complete chains."""
    arrays, lattice, rules = chains.arrays, chains.lattice, chains.rules
    n = rules.strengths.shape[0]
    for j in range(rows.size):
        k: int = rows[j]
        forward = arrays.forward[k]
        poles, cells, quarters = lattice.poles[k], lattice.cells[k], lattice.quarters[k]
        turns = lattice.turns[k]
        for _ in range(until):
            row = lattice.out[k]
            arrays.released[k, component(forward, row, n)] = True
            if row > 0:
                # Components that get their magnets at the mouth have none before it.
                acting = arrays.fed[k] if rules.preloaded else row + 1
                taken = lay(row, acting, rules.turn, rules.tie, rules.table, poles, cells, quarters)
                if taken == DEAD_END:
                    arrays.status[k] = MISFOLDED
                    break
                turns[row - 1 if forward else n - 1 - row] = taken
            lattice.out[k] = row + 1
        if lattice.out[k] == n:
            arrays.status[k] = FOLDED
            for joint in range(n - 1):
                if turns[joint] == 0:
                    arrays.status[k] = MISFOLDED
        in_line(forward, rules.pitch, lattice.out[k], turns, arrays.angles[k], arrays.base[k])


@kernel
def _energies(rows: Ints, chains: _Chains, found: Floats) -> None:
    lattice, rules = chains.lattice, chains.rules
    for j in range(rows.size):
        k: int = rows[j]
        found[j] = energy(
            lattice.out[k], rules.table, lattice.poles[k], lattice.cells[k], lattice.quarters[k]
        )
