"""The energy minimiser: full search, and the component-by-component search of the paper."""

from __future__ import annotations

from typing import get_args

from magfold_env.minimiser.contacts import conflict_free
from magfold_env.minimiser.ground_state import ground_state
from magfold_env.minimiser.landscape import TIE, energy_unit, refuse_field, word_energies
from magfold_env.minimiser.lattice import ORDER, Lattice, all_words, from_words
from magfold_env.minimiser.ranking import ranked
from magfold_env.minimiser.result import Among, Decision, Minimum, Mode, Option, State
from magfold_env.minimiser.states import state_of
from magfold_env.scene import Scene

LONGEST = 12
"""Most components of a full search: 118,731 words, 2.7 times more with each component.

The states of longer chains are found by `ground_state`.
"""


def minimise(scene: Scene, mode: Mode = "free", top: int = 5, among: Among = "all") -> Minimum:
    """Predict a fold by the energy of the magnets alone.

    Parameters
    ----------
    scene
        Its sequence, casing and magnets count; mount, friction and contact do not.
    mode
        `free` compares every word without overlap; more than `LONGEST` components by branch and
        bound, which proves the same. `forward` decides one joint at a time from
        joint 1 on, `backward` from the last: the letter of least energy, all components acting,
        joints not yet decided straight, overlaps excluded.
    top
        How many states `free` returns.
    among
        Which words `free` ranks: `all`, only the `folded` ones (no S), or only the
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
    if mode == "free" and scene.n > LONGEST:
        found = ground_state(scene, top, among)
        return Minimum("free", found.states, decisions=(), examined=found.nodes)
    if mode == "free":
        return _full_search(scene, top, among)
    return _one_by_one(scene, mode)


def _full_search(scene: Scene, top: int, among: Among) -> Minimum:
    lattice = all_words(scene.n)
    if among != "all":
        lattice = lattice[lattice.fully_folded()]
    if among == "stable":
        lattice = lattice[conflict_free(lattice, scene.sequence)]
    energies = word_energies(scene, lattice)
    states: list[State] = []
    for group in ranked(energies, TIE * energy_unit(scene)) if len(lattice) else []:
        for row in group[: top - len(states)]:
            tied = tuple(lattice.word(other) for other in group if other != row)
            states.append(state_of(scene, lattice.word(row), tied))
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
    return Minimum(mode, (state_of(scene, "".join(letters)),), tuple(decisions), examined)


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
