"""What energy minimisation says of a chain, to be shown beside what happens."""

from dataclasses import dataclass

from magfold_env.envs.chains.progress import Progress
from magfold_env.envs.chains.quasistatic_episode import QuasistaticEpisode, QuasistaticRules
from magfold_env.fold import FoldStatus


@dataclass(frozen=True)
class Forecast:
    """The fold that the minimiser reaches joint by joint, at the scene's nominal strengths.

    Attributes
    ----------
    word : str
        As far as components are fed; straight from there on.
    energy : float
        Magnetic energy of those components [J].
    target_energy : float
        The same if they lay as the target wants them.
    is_stuck : bool
        Whether every letter of a joint overlaps.
    """

    word: str
    energy: float
    target_energy: float
    is_stuck: bool


def forecast(
    rules: QuasistaticRules, sequence: tuple[str, ...], progress: Progress, fed: int, target: str
) -> Forecast:
    """Return what `rules` make of the first `fed` components in the order of feed.

    Parameters
    ----------
    rules : QuasistaticRules
        Those of the scene.
    sequence : tuple of str
        Faces of all components; of those not fed yet they do not count.
    progress : Progress
        The same as numbers, and the order of feed.
    fed : int
        How many components have their magnets.
    target : str
        The wanted fold word.
    """
    episode = QuasistaticEpisode(rules)
    speed = float(rules.scene.speeds.min())
    if rules.built:
        episode.run(sequence, speed)
    else:
        for index in progress.order[:fed]:
            if episode.status is None:
                episode.feed(sequence[index], speed)
    is_stuck = episode.status is FoldStatus.MISFOLDED and episode.message.startswith("stuck")
    wanted = rules.energy_as(target, progress, fed)
    return Forecast(episode.word, rules.energy_as(episode.word, progress, fed), wanted, is_stuck)
