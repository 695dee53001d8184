"""What the energy minimiser finds: states, the decisions that led there, and their ranking."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from magfold_env.shapes import Outline

Mode = Literal["free", "forward", "backward"]
Among = Literal["all", "folded", "stable"]


@dataclass(frozen=True)
class State:
    """A word of the lattice with its energy.

    Attributes
    ----------
    word : str
        One letter a joint, component 1 first.
    energy : float
        Of the magnets, each pair of components once: `mf.energy` [J].
    coulomb_score : float
        The paper's: `energy` and the pairs inside each component, a constant of the sequence [J].
    fully_folded : bool
        Whether every joint is L or R.
    contacts : tuple of (int, int)
        Components, 1-based, that touch along a face, neighbours or not.
    conflicts : tuple of (int, int)
        Those of them whose touching faces have equal poles.
    outline : Outline
        The cells covered, up to rotation and translation.
    tied : tuple of str
        Other words of the same energy that the search ranked with this one.
    """

    word: str
    energy: float
    coulomb_score: float
    fully_folded: bool
    contacts: tuple[tuple[int, int], ...]
    conflicts: tuple[tuple[int, int], ...]
    outline: Outline
    tied: tuple[str, ...] = ()

    @property
    def stable(self) -> bool:
        """Whether the word is fully folded and no equal poles touch."""
        return self.fully_folded and not self.conflicts


@dataclass(frozen=True)
class Option:
    """One letter a joint could take, and the energy of the chain with it [J]."""

    letter: str
    energy: float


@dataclass(frozen=True)
class Decision:
    """One joint decided by a component-by-component search.

    Attributes
    ----------
    joint : int
        1-based: joint k lies between components k and k+1.
    options : tuple of Option
        Those without overlap, in the order S, L, R.
    letter : str
        The one of least energy.
    tied : str
        The other letters of the same energy; the order S, L, R decided against them.
    """

    joint: int
    options: tuple[Option, ...]
    letter: str
    tied: str


@dataclass(frozen=True)
class Minimum:
    """The result of `minimise`.

    Attributes
    ----------
    mode : {"free", "forward", "backward"}
        How the chain was searched.
    states : tuple of State
        Lowest energy first. The component-by-component modes end in one state.
    decisions : tuple of Decision
        In the order they were taken; empty for the full search.
    examined : int
        Number of words whose energies were compared; of halves of words for long chains.
    """

    mode: Mode
    states: tuple[State, ...]
    decisions: tuple[Decision, ...]
    examined: int

    @property
    def best(self) -> State:
        """The state of least energy.

        Raises
        ------
        ValueError
            If there is none: no word of this length satisfies the condition that was set.
        """
        if not self.states:
            raise ValueError("the search found no state that satisfies its condition")
        return self.states[0]
