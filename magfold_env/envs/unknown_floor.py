"""``MagFold/UnknownFloor-v0``: feed a given chain, back and forth, over a floor unknown."""

from typing import Any

from magfold_env.envs.baselines.constant_speed import ConstantSpeedStore
from magfold_env.envs.feed_track import INTERVAL, STEEPEST, FeedEpisodes, FeedTrackEnv
from magfold_env.envs.tasks.feed_tasks import TaskWorld
from magfold_env.envs.vector_env import ChainVectorEnv

HORIZON = 250
"""Steps after which it is too late: 5 s."""


class FloorEpisodes(FeedEpisodes):
    """Episodes in which one fold is wanted."""

    horizon = HORIZON

    @classmethod
    def baselines(cls, world: TaskWorld) -> ConstantSpeedStore:
        """Return what the best constant speeds make of the tasks of a world."""
        return ConstantSpeedStore(cls, world, (INTERVAL, HORIZON, STEEPEST))


class UnknownFloorEnv(FeedTrackEnv):
    """Feed a chain, back and forth, so that it folds into a target on a floor that is not known.

    `reset` picks a task: a sequence, the direction of its feed, the fold to reach; and draws what
    stays hidden: the floor's friction, evenly on a scale of powers from 0.05 to 1, the strength of
    all magnets ±30 % and of each ±15 %, what the drive makes of the speed asked of it, ±60 %, and
    how the chain lies in its tube. Every step says how fast the feed goes for the next 20 ms.
    Components that it draws in again may be held again: the tube is 1.3 diagonals wide, else hardly
    any folded chain could be drawn in; two casings side by side do not fit, so that a fold has to
    open. Magnets act outside the tube only. What has folded wrong can be let out anew, until the
    last component is out.

    **End**: when the chain is all out and at rest; when the drive has slipped for 0.1 s (status
    ``jammed``); after 5 s, 250 steps (``unsettled``); or when the simulation breaks down. All of
    them terminate the episode: the time is the task's own.

    **Action**: ``Box(−1, 1, (1,))``: x asks for the speed ``0.6 x |x|`` m/s, negative back, and for
    standstill below 0.025 m/s. The drive changes its speed by 0.2 m/s a step at most.
    `magfold_env.envs.spaces.actions.SpeedTable` has the other ways, a table of speeds among them.

    **Observation**: a flat ``Box(−1, 1)`` of ``12 n + 2`` entries, component 1 first. Frames are
    not stacked.

    ========= ========= ======================================================== =============
    group     entries   meaning and unit                                         range
    ========= ========= ======================================================== =============
    target    3 (n − 1) the wanted letter of each joint, one-hot over L, S, R    0, 1
    magnets   4 n       front-left, back-left, back-right, front-right:          −1, 0, 1
                        1 N, −1 S, as the chain was ordered, not as strong as
                        it came
    direction 1         of the feed: 1 forward, −1 backward                      −1, 1
    seen      n         1 where the camera sees a component: it is not held and  0, 1
                        its centre is outside the tube. 20 ms ago, as are the
                        next two, which are 0 for those not seen
    heading   2 n       sine and cosine of the heading, noise of 1°              [−1, 1]
    position  2 n       centre, mouth of the tube at 0, x / chain length, noise  (−1, 1) *
                        of 0.3 mm along x and y
    advance   1         how far the feed has gone, x / chain length; 1 with all  [0, 1]
                        out
    speed     1         asked for in the last step, x / (0.6 m/s)                [−1, 1]
    force     1         of the drive, mean over the last step, noise of 10 mN,   (−1, 1) *
                        x / (0.1 N); negative pulls
    time      1         x / (5 s)                                                [0, 1]
    ========= ========= ======================================================== =============

    Entries marked * are squashed by ``x / (1 + |x|)``. Noise is normal, with these standard
    deviations. Velocities are not shown, and nothing of what is drawn.

    **Reward**: at the end the score: 1 in the target, else half the similarity to it, and 0 if the
    time is over or the simulation broke down; ``reward="sparse"``: 1 in the target, else 0;
    ``reward="relative"``: the score less b, what the best constant speed scores
    (`magfold_env.envs.baselines.constant_speed`). Every second costs 0.02, in equal parts at every
    step. Shaping: `magfold_env.envs.tasks.reward`.

    **Info**: ``target``, ``word``, ``time`` [s], ``force`` [N], as measured; at the end also
    ``status``, ``message``, ``energy`` [J], ``score``, ``baseline``, ``baseline_flagged`` (the
    reward asks for none) and ``is_success``.

    Arguments are those of `magfold_env.envs.camera_track.CameraTrackEnv`.
    """

    make_episodes = FloorEpisodes
    default_scene = "unknown-floor"
    default_tasks = "two-folds-6"


UnknownFloorVectorEnv = ChainVectorEnv[Any].of(UnknownFloorEnv)
