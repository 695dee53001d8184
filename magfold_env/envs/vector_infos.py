"""What vector environments tell of their episodes, as Gymnasium's do: arrays, and who has them."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from magfold_env.envs.chains.goals import GoalBoard
from magfold_env.envs.chains.protocol import FAILED, FOLDED, Fleet
from magfold_env.envs.chains.row_view import STATUSES

Ints = NDArray[np.int64]
Infos = dict[str, Any]


def news(fleet: Fleet, goals: GoalBoard, rows: Ints) -> Infos:
    """Return what is told of episodes at every moment."""
    count, n = fleet.board.angles.shape
    letters = np.empty((count, n - 1), dtype=np.uint32)
    fleet.board.write_words(letters)
    words = letters.view(f"<U{n - 1}")[:, 0].astype(object)
    infos: Infos = {"target": goals.names.copy(), "word": words, "step": fleet.fed.copy()}
    if len(rows) < count:
        absent = ~_mask(rows, count)
        infos["target"][absent] = infos["word"][absent] = None
        infos["step"][absent] = 0
    return infos | {f"_{key}": _mask(rows, count) for key in infos}


def last_news(fleet: Fleet, goals: GoalBoard, rows: Ints) -> Infos:
    """Return what is told of episodes that have just ended."""
    if not len(rows):
        return {}
    count = len(fleet.status)
    status = fleet.status[rows]
    potential, near = goals.judge(rows, fleet.board.angles)
    success = near & (status == FOLDED)
    score = np.where(success, 1.0, np.where(status == FAILED, 0.0, potential))
    told: dict[str, Any] = {
        "status": np.array([str(STATUSES[int(each)]) for each in status], dtype=object),
        "message": np.array([fleet.message(row) for row in rows.tolist()], dtype=object),
        "energy": fleet.energies(rows),
        "score": score,
        "baseline": goals.baseline[rows],
        "baseline_flagged": goals.flagged[rows],
        "is_success": success,
    }
    infos: Infos = {}
    for key, values in told.items():
        infos[key] = np.zeros(count, dtype=values.dtype)
        if values.dtype == object:
            infos[key][:] = None
        infos[key][rows] = values
        infos[f"_{key}"] = _mask(rows, count)
    return infos


def _mask(rows: Ints, count: int) -> NDArray[np.bool_]:
    mask = np.zeros(count, dtype=np.bool_)
    mask[rows] = True
    return mask
