"""Energies of a chain's magnets, a field from outside included."""

from __future__ import annotations

from magfold_env.engine.magnets import chain, pairs
from magfold_env.engine.magnets.outer_field import field_energy
from magfold_env.engine.state import Array, Model, Work


def magnet_energy(first: int, model: Model, work: Work) -> float:
    """Energy of components ``first`` on at the pose in ``work`` [J]."""
    if not model.magnetic:
        return 0.0
    total = pairs.energy(first, model.magnets, model.charge, work.pose, work.nodes)
    return float(total) + _outer(first, model, work)


def potential_energy(first: int, model: Model, q: Array, work: Work) -> float:
    """Energy whose exact gradient the simulated magnet forces are [J].

    Within the magnets' accuracy it is `magnet_energy`, which sums where the dynamics looks up.
    """
    if not model.magnetic:
        return 0.0
    total = chain.chain_energy(first, model, q, work.pose, work.nodes)
    return float(total) + _outer(first, model, work)


def _outer(first: int, model: Model, work: Work) -> float:
    if not model.field.present:
        return 0.0
    return float(field_energy(first, model, work.pose, work.nodes))
