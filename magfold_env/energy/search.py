"""The energy minimiser: full search, and the component-by-component search of the paper."""

from __future__ import annotations

from collections.abc import Sequence
from typing import get_args

import numpy as np

from magfold_env.energy.contacts import conflict_free, conflicts, touching
from magfold_env.energy.landscape import TIE, Floats, energy_unit, refuse_field, word_energies
from magfold_env.energy.lattice import ORDER, Ints, Lattice, all_words, from_words
from magfold_env.energy.result import Among, Decision, Minimum, Mode, Option, State
from magfold_env.energy.score import internal_energy
from magfold_env.scene import Scene
from magfold_env.shapes import is_fully_folded, outline

LONGEST = 12
"""Most components of a full search: 118,731 words, 2.7 times more with each component."""


def minimise(scene: Scene, mode: Mode = "free", top: int = 5, among: Among = "all") -> Minimum:
    """Predict a fold by the energy of the magnets alone.

    Parameters
    ----------
    scene
        Its sequence, casing and magnets count; mount, friction and contact do not.
    mode
        `free` compares every word without overlap. `forward` decides one joint at a time from
        joint 1 on, `backward` from the last: the letter of least energy, all components acting,
        joints not yet decided straight, overlaps excluded.
    top
        How many states the full search returns.
    among
        Which words the full search ranks: `all`, only the `folded` ones (no S), or only the
        `stable` ones (folded, and no equal poles touch).

    Raises
    ------
    ValueError
        If an argument is none of these, the scene has an external field, the chain is too long
        for a full search, or a component-by-component search runs into a joint where every letter
        overlaps.
    """
    for key, value, allowed in (("mode", mode, Mode), ("among", among, Among)):
        if value not in get_args(allowed):
            raise ValueError(
                f"{key}: {value!r} is not allowed; must be one of {', '.join(get_args(allowed))}"
            )
    if top < 1:
        raise ValueError(f"top: {top!r} is not allowed; must be at least 1")
    refuse_field(scene)
    if mode == "free":
        return _full_search(scene, top, among)
    return _one_by_one(scene, mode)


def ranked(energies: Floats, tie: float) -> list[Ints]:
    """Return indices by ascending energy, in groups that lie within `tie` of the next [J].

    Within a group the given order stays.
    """
    order = np.argsort(energies, kind="stable")
    steps = np.diff(energies[order]) > tie
    return [np.sort(group) for group in np.split(order, np.flatnonzero(steps) + 1)]


def _full_search(scene: Scene, top: int, among: Among) -> Minimum:
    if scene.n > LONGEST:
        raise ValueError(
            f"mode: 'free' is not allowed for {scene.n} components; the full search takes at most "
            f"{LONGEST}, 'forward' and 'backward' any number"
        )
    lattice = all_words(scene.n)
    if among != "all":
        lattice = lattice[lattice.fully_folded()]
    if among == "stable":
        lattice = lattice[conflict_free(lattice, scene.sequence)]
    energies = word_energies(scene, lattice)
    internal = internal_energy(scene)
    states: list[State] = []
    for group in ranked(energies, TIE * energy_unit(scene)) if len(lattice) else []:
        for row in group[: top - len(states)]:
            tied = tuple(lattice.word(other) for other in group if other != row)
            state = _state(
                scene.sequence, lattice[row : row + 1], float(energies[row]), internal, tied
            )
            states.append(state)
        if len(states) == top:
            break
    return Minimum("free", tuple(states), decisions=(), examined=len(lattice))


def _one_by_one(scene: Scene, mode: Mode) -> Minimum:
    joints = range(scene.n - 1)
    letters = ["S"] * (scene.n - 1)
    decisions: list[Decision] = []
    examined = 0
    for joint in joints if mode == "forward" else reversed(joints):
        words = ["".join([*letters[:joint], x, *letters[joint + 1 :]]) for x in ORDER]
        lattice = from_words(words)
        lattice = lattice[~lattice.overlapping()]
        if not len(lattice):
            raise ValueError(
                f"mode: {mode!r} runs into a dead end: every letter of joint {joint + 1} overlaps "
                f"after {''.join(letters)!r}"
            )
        decision = _decide(scene, joint, lattice)
        letters[joint] = decision.letter
        decisions.append(decision)
        examined += len(lattice)
    final = from_words(["".join(letters)])
    energy = float(word_energies(scene, final)[0])
    state = _state(scene.sequence, final, energy, internal_energy(scene), tied=())
    return Minimum(mode, (state,), tuple(decisions), examined)


def _decide(scene: Scene, joint: int, lattice: Lattice) -> Decision:
    energies = word_energies(scene, lattice)
    letters = [lattice.word(row)[joint] for row in range(len(lattice))]
    best, *others = (int(row) for row in ranked(energies, TIE * energy_unit(scene))[0])
    return Decision(
        joint + 1,
        tuple(Option(x, float(e)) for x, e in zip(letters, energies, strict=True)),
        letters[best],
        "".join(letters[other] for other in others),
    )


def _state(
    sequence: Sequence[str], one: Lattice, energy: float, internal: float, tied: tuple[str, ...]
) -> State:
    word = one.word(0)
    return State(
        word=word,
        energy=energy,
        coulomb_score=energy + internal,
        fully_folded=is_fully_folded(word),
        contacts=touching(one),
        conflicts=conflicts(one, sequence),
        outline=outline(word),
        tied=tied,
    )
