"""Fixed draws: seeds for ``env.reset`` that one purpose never shares with another.

Results are compared on the same draws, and on draws that no training has seen. Training seeds are
numbers below 2³²; the seeds given here lie above 2⁶⁴.
"""

from zlib import crc32

import numpy as np

EVALUATION_VERSION = 1
"""Version of the draws that results are reported on. It changes when `evaluation_seeds` does, or
what an environment draws for a seed, which a test holds still."""

_RESERVED = 1 << 64


def episode_seeds(stream: str, count: int) -> list[int]:
    """Return the fixed seeds of the named stream.

    The first seeds of a long list are the seeds of a short one.

    Parameters
    ----------
    stream : str
        Purpose, such as ``evaluation`` or ``validation``.
    count : int
        How many.
    """
    seeds: list[int] = []
    for index in range(count):
        key = (crc32(stream.encode()), index)
        word = np.random.SeedSequence(0, spawn_key=key).generate_state(1, np.uint64)[0]
        seeds.append(_RESERVED + int(word))
    return seeds


def evaluation_seeds(count: int, version: int = EVALUATION_VERSION) -> list[int]:
    """Return the seeds of the evaluation draws: use each once with every target or task.

    Raises
    ------
    ValueError
        If there is no such version.
    """
    if version != EVALUATION_VERSION:
        raise ValueError(f"version: {version!r} is not allowed; must be {EVALUATION_VERSION}")
    return episode_seeds("evaluation", count)
