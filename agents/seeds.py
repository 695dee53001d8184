"""Seed streams: draws for one purpose are never used for another."""

from zlib import crc32

import numpy as np

MAX_TRAINING_SEED = 2**31 - 1
"""Training seeds are small numbers given by hand, up to this one."""

_RESERVED = 1 << 64
"""Added to the seeds of all other streams, which sets them apart from every training seed."""


def episode_seeds(stream: str, count: int) -> list[int]:
    """Return the fixed seeds of the named stream, for ``env.reset(seed=...)``.

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
