"""Many simulated chains side by side; see `magfold_env.envs.chains.protocol.Fleet`."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from magfold_env.engine.compile.jit import kernel
from magfold_env.engine.outcomes import REACHED
from magfold_env.envs.chains.arrays import Board
from magfold_env.envs.chains.draws import DrawnChains
from magfold_env.envs.chains.progress import Progress
from magfold_env.envs.chains.protocol import FAILED, Floats, Ints
from magfold_env.envs.chains.row_view import STATUSES, RowView, letters_of
from magfold_env.envs.spaces.actions import SIGNS
from magfold_env.scene import Scene
from magfold_env.simulation.endings import ending, work_cap
from magfold_env.simulation.pack import TURNED

_TURNED = np.array(TURNED)


class DynamicFleet:
    """Chains in their tubes.

    Parameters
    ----------
    template : Scene
        What `magfold_env.envs.chains.dynamic_episode.dynamic_template` returns.
    count : int
        How many.
    threads : int
        How many threads feed them.
    """

    def __init__(self, template: Scene, count: int, threads: int) -> None:
        n = template.n
        self._drawn = DrawnChains(template, count, threads)
        self._chains = self._drawn.chains
        self._duration = template.duration
        self._order = np.array(Progress.begin(n, template.feed.direction).order)
        self._messages = [""] * count
        self.board = Board.empty(count, n)
        self.status: Ints = np.zeros(count, dtype=np.int64)
        self.fed: Ints = np.zeros(count, dtype=np.int64)

    def begin(self, rows: Ints, rngs: Sequence[np.random.Generator]) -> None:
        """Put chains into their tubes; all that is random is drawn here, row k from ``rngs[k]``."""
        self._drawn.draw(rows, rngs)
        self.board.clear(rows)
        self.status[rows] = 0
        self.fed[rows] = 0
        self._look(rows)

    def feed(self, rows: Ints, patterns: Ints, speeds: Floats, scaled: Floats) -> None:
        """Feed the next component of each chain; after its last one a chain settles."""
        board, drawn, chains = self.board, self._drawn, self._chains
        _choose(
            rows, patterns, speeds, scaled, self._order, drawn.flip, SIGNS, _TURNED,
            drawn.strengths, drawn.factors, self.fed, board.signs, board.speeds,
            chains.waiting, chains.speeds,
        )  # fmt: skip
        chains.feed(rows, self._duration)
        self._take_in(rows)

    def run(self, rows: Ints, patterns: Ints, speeds: Floats, scaled: Floats) -> None:
        """Feed whole chains, `patterns` (rows, n), each at one speed, and let them settle."""
        signs = SIGNS[patterns]
        self.board.signs[rows] = signs
        self.board.speeds[rows] = scaled[:, None]
        self.fed[rows] = patterns.shape[1]
        self._drawn.magnetise(rows, signs, speeds)
        self._chains.feed(rows, self._duration, all_of_it=True)
        self._take_in(rows)

    def energies(self, rows: Ints) -> Floats:
        """Return the magnetic energies [J]; no number where a simulation failed."""
        status = self.status[rows]
        # Those that have ended are known: they were found on all threads.
        self._chains.find_energies(rows[status == 0])
        return np.where(status == FAILED, np.nan, self._chains.energies[rows])

    def message(self, row: int) -> str:
        """Return how a fold ended, in words."""
        return self._messages[row]

    def view(self, row: int) -> "DynamicView":
        """Return what there is to see of one chain."""
        return DynamicView(self, row)

    def held(self, row: int) -> NDArray[np.bool_]:
        """Return which components of a chain friction holds, (n,), component 1 first."""
        held = self._chains.stuck[row] == 1
        return held[::-1] if self._drawn.flip else held

    def scene(self, row: int) -> Scene:
        """Return the drawn scene of a chain, with the magnets and speeds of components fed."""
        scene, speeds = self._drawn.scene(row), self._chains.speeds[row]
        fed = self._order[: self.fed[row]].tolist()
        sequence, chosen = list(scene.sequence), scene.speeds
        for index in fed:
            sequence[index] = letters_of(self.board.signs[row, index])
            chosen[index] = speeds[scene.n - 1 - index if self._drawn.flip else index]
        return scene.replace(sequence=sequence, feed={"speed": chosen})

    def close(self) -> None:
        """End the threads, if there are any."""
        self._chains.team.close()

    def _take_in(self, rows: Ints) -> None:
        """Look at chains that were fed, and note which have ended."""
        self._look(rows)
        chains = self._chains
        ended = rows[chains.outcomes[rows] != REACHED]
        if not len(ended):
            return
        facts = (
            chains.outcomes[ended],
            chains.times[ended],
            chains.steps[ended],
            np.diff(self.board.angles[ended], axis=1),
        )
        told = zip(ended.tolist(), *(fact.tolist() for fact in facts), strict=True)
        for row, outcome, time, steps, joints in told:
            status, message = ending(outcome, time, joints, work_cap(chains.model, steps))
            self.status[row], self._messages[row] = STATUSES.index(status), message

    def _look(self, rows: Ints) -> None:
        board = self.board
        self._chains.look(
            rows, self._drawn.flip, board.angles, board.rates, board.base, board.base_velocity
        )
        _release(rows, self._order, self._chains.released, board.released)


class DynamicView(RowView):
    """One chain of a `DynamicFleet`."""

    fleet: DynamicFleet

    @property
    def held(self) -> NDArray[np.bool_]:
        """Which components friction holds, shape (n,)."""
        return self.fleet.held(self.row)

    @property
    def scene_so_far(self) -> Scene:
        """The drawn scene, with the magnets and speeds of the components fed so far."""
        return self.fleet.scene(self.row)


@kernel
def _choose(  # noqa: PLR0913, PLR0917
    rows: Ints,
    patterns: Ints,
    speeds: Floats,
    scaled: Floats,
    order: Ints,
    flip: bool,
    signs_of: Floats,
    turned: Ints,
    strengths: Floats,
    factors: Floats,
    fed: Ints,
    signs: Floats,
    scaled_speeds: Floats,
    charges: Floats,
    feed_speeds: Floats,
) -> None:
    """Note the magnets and the speed of the next component, for the chain and for the board."""
    n = order.size
    for j in range(rows.size):
        k = rows[j]
        i = order[fed[k]]
        inside = n - 1 - i if flip else i
        for face in range(4):
            signs[k, i, face] = signs_of[patterns[j], face]
        for face in range(4):
            other = turned[face] if flip else face
            charges[k, inside, face] = signs[k, i, other] * strengths[k, i, other]
        scaled_speeds[k, i] = scaled[j]
        feed_speeds[k, inside] = speeds[j] * factors[k, i]
        fed[k] += 1


@kernel
def _release(rows: Ints, order: Ints, counts: Ints, released: NDArray[np.bool_]) -> None:
    """Note which components are out, the first ones in the order of feed."""
    for k in rows:
        for j in range(counts[k]):
            released[k, order[j]] = True
