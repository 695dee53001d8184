"""Many chains that fold by energy alone; see `magfold_env.envs.chains.protocol.Fleet`."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from magfold_env.engine.compile.jit import kernel
from magfold_env.envs.chains.arrays import Board
from magfold_env.envs.chains.lattice import DEAD_END, energy, in_line, lay
from magfold_env.envs.chains.progress import Progress
from magfold_env.envs.chains.protocol import FOLDED, MISFOLDED, Floats, Ints
from magfold_env.envs.chains.quasistatic_episode import QuasistaticRules, ended, stuck
from magfold_env.envs.chains.row_view import RowView, letters_of
from magfold_env.envs.spaces.actions import SIGNS, speed_at
from magfold_env.scene import Scene


class QuasistaticFleet:
    """Chains of one scene; nothing is drawn, and one thread does.

    Parameters
    ----------
    rules : QuasistaticRules
        The scene's.
    count : int
        How many.
    """

    def __init__(self, rules: QuasistaticRules, count: int) -> None:
        n = rules.n
        self._rules = rules
        self._order = np.array(Progress.begin(n, rules.scene.feed.direction).order)
        self._out = np.zeros(count, dtype=np.int64)
        self._poles = np.zeros((count, n, 4))
        self._cells = np.zeros((count, n, 2), dtype=np.int64)
        self._quarters = np.zeros((count, n), dtype=np.int64)
        self._turns = np.zeros((count, n - 1), dtype=np.int64)
        self.board = Board.empty(count, n)
        self.status: Ints = np.zeros(count, dtype=np.int64)
        self.fed: Ints = np.zeros(count, dtype=np.int64)

    def begin(self, rows: Ints, rngs: Sequence[np.random.Generator]) -> None:
        """Put chains into their tubes; nothing is random about them."""
        self.board.clear(rows)
        for array in (self._out, self._cells, self._quarters, self._turns, self.status, self.fed):
            array[rows] = 0
        self._come_out(rows, until=0)

    def feed(self, rows: Ints, patterns: Ints, speeds: Floats, scaled: Floats) -> None:
        """Feed the next component of each chain and decide a joint."""
        self._choose(rows, patterns[:, None], scaled)
        self._come_out(rows, until=1)

    def run(self, rows: Ints, patterns: Ints, speeds: Floats, scaled: Floats) -> None:
        """Feed whole chains, `patterns` (rows, n), and decide their joints one after another."""
        self._choose(rows, patterns[:, self._order], scaled)
        self._come_out(rows, until=self._rules.n)

    def energies(self, rows: Ints) -> Floats:
        """Return the magnetic energies of the components that are out [J]."""
        found = np.empty(len(rows))
        table = self._rules.lattice.table
        _energies(rows, self._out, table, self._poles, self._cells, self._quarters, found)
        return found

    def message(self, row: int) -> str:
        """Return how a fold ended, in words."""
        turns = self._turns[row]
        if self._out[row] == self._rules.n:
            return ended(turns)[1]
        return stuck(self._rules, int(self._out[row]), turns)

    def view(self, row: int) -> "QuasistaticView":
        """Return what there is to see of one chain."""
        return QuasistaticView(self, row)

    def scene(self, row: int) -> Scene:
        """Return the scene of a chain, with the magnets and speeds of components fed."""
        scene, board = self._rules.scene, self.board
        sequence, speeds = list(scene.sequence), scene.speeds
        for index in self._order[: self.fed[row]].tolist():
            sequence[index] = letters_of(board.signs[row, index])
            speeds[index] = speed_at(float(board.speeds[row, index]))
        return scene.replace(sequence=sequence, feed={"speed": speeds})

    def close(self) -> None:
        """Do nothing: there are no threads."""

    def _choose(self, rows: Ints, patterns: Ints, scaled: Floats) -> None:
        """Note settings (rows, components), in the order of feed."""
        board = self.board
        _choose(
            rows, patterns, scaled, self._order, SIGNS, self._rules.strengths, self.fed,
            board.signs, board.speeds, self._poles,
        )  # fmt: skip

    def _come_out(self, rows: Ints, until: int) -> None:
        """Release so many components of each chain and decide their joints."""
        rules, board = self._rules, self.board
        _come_out(
            rows, until, rules.built, rules.forward, rules.pitch, rules.lattice.turn,
            rules.lattice.tie, rules.lattice.table, self._order, self.fed, self._poles, self._cells,
            self._quarters, self._turns, self._out, self.status, board.released, board.angles,
            board.base,
        )  # fmt: skip


class QuasistaticView(RowView):
    """One chain of a `QuasistaticFleet`."""

    fleet: QuasistaticFleet

    @property
    def held(self) -> NDArray[np.bool_]:
        """No component: there is no friction."""
        return np.zeros(len(self.state.angles), dtype=np.bool_)

    @property
    def scene_so_far(self) -> Scene:
        """The scene, with the magnets and speeds of the components fed so far."""
        return self.fleet.scene(self.row)


@kernel
def _choose(  # noqa: PLR0913, PLR0917
    rows: Ints,
    patterns: Ints,
    scaled: Floats,
    order: Ints,
    signs_of: Floats,
    strengths: Floats,
    fed: Ints,
    signs: Floats,
    scaled_speeds: Floats,
    poles: Floats,
) -> None:
    for j in range(rows.size):
        k = rows[j]
        for c in range(patterns.shape[1]):
            i = order[fed[k]]
            for face in range(4):
                signs[k, i, face] = signs_of[patterns[j, c], face]
                poles[k, fed[k], face] = signs[k, i, face] * strengths[i, face]
            scaled_speeds[k, i] = scaled[j]
            fed[k] += 1


@kernel
def _come_out(  # noqa: PLR0913, PLR0917
    rows: Ints,
    until: int,
    built: bool,
    forward: bool,
    pitch: float,
    turn: int,
    tie: float,
    table: Floats,
    order: Ints,
    fed: Ints,
    poles: Floats,
    cells: Ints,
    quarters: Ints,
    turns: Ints,
    out: Ints,
    status: Ints,
    released: NDArray[np.bool_],
    angles: Floats,
    base: Floats,
) -> None:
    """Release ``until`` components of each chain, the numbers of `FOLDED` and so on at its end."""
    n = order.size
    for j in range(rows.size):
        k: int = rows[j]
        for _ in range(until):
            row = out[k]
            released[k, order[row]] = True
            if row > 0:
                # Components that get their magnets at the mouth have none before.
                acting = fed[k] if built else row + 1
                taken = lay(row, acting, turn, tie, table, poles[k], cells[k], quarters[k])
                if taken == DEAD_END:
                    status[k] = MISFOLDED
                    break
                turns[k, row - 1 if forward else n - 1 - row] = taken
            out[k] = row + 1
        if out[k] == n:
            status[k] = FOLDED
            for joint in range(n - 1):
                if turns[k, joint] == 0:
                    status[k] = MISFOLDED
        in_line(forward, pitch, out[k], turns[k], angles[k], base[k])


@kernel
def _energies(
    rows: Ints, out: Ints, table: Floats, poles: Floats, cells: Ints, quarters: Ints, found: Floats
) -> None:
    for j in range(rows.size):
        k: int = rows[j]
        found[j] = energy(out[k], table, poles[k], cells[k], quarters[k])
