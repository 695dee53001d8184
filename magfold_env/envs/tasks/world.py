"""What all episodes of an environment share."""

from abc import abstractmethod
from typing import Any, ClassVar

from magfold_env.envs.spaces.observation import ObservationLayout
from magfold_env.envs.tasks.goals import Match
from magfold_env.envs.tasks.options import Fidelity
from magfold_env.envs.tasks.reward import RewardRule
from magfold_env.scene import Scene


class World:
    """Scene, targets, actions, observations and rewards, and no chain itself.

    Attributes
    ----------
    scene : Scene
        What episodes are drawn from, randomisation included.
    words : tuple of str
        The words that `reset` draws from, or those of its tasks.
    match : {"word", "outline"}
        What will do for a word.
    fidelity : {"dynamics", "quasistatic"}
        Whether chains are simulated.
    actions : ActionTable or SpeedTable
        How actions are written and read.
    layout : ObservationLayout
        Where each group of entries lies in an observation.
    rule : RewardRule
        How episodes are rewarded.
    """

    option: ClassVar[tuple[str, type]]
    """The option of `reset` that fixes what is drawn, and the type of its value."""

    scene: Scene
    words: tuple[str, ...]
    match: Match
    fidelity: Fidelity
    actions: Any
    layout: ObservationLayout
    rule: RewardRule

    @property
    def in_field(self) -> bool:
        """Whether an external field acts, of which energy minimisation knows nothing."""
        return self.scene.field is not None and self.scene.field.any

    @abstractmethod
    def number_of(self, value: Any) -> int:
        """Return the number of what a value of `option` fixes.

        Raises
        ------
        ValueError
            If there is none.
        """
