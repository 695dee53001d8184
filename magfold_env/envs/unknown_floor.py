"""``MagFold/UnknownFloor-v0``: feed a given chain back and forth over an unknown floor."""

from typing import Any

from magfold_env.envs.baselines.constant_speed import ConstantSpeedStore
from magfold_env.envs.camera_track import INTERVAL, STEEPEST, FeedEpisodes, FeedTrackEnv
from magfold_env.envs.vector_env import ChainVectorEnv

HORIZON = 250
"""Number of steps allowed in an episode: 5 s."""


class FloorEpisodes(FeedEpisodes):
    """Episodes with one target fold."""

    horizon = HORIZON
    store = ConstantSpeedStore
    protocol = (INTERVAL, HORIZON, STEEPEST)


class UnknownFloorEnv(FeedTrackEnv):
    """Feed a chain back and forth so that it folds into a target on a floor of unknown friction.

    `reset` selects a task: a sequence, a feed direction and a target. It draws and hides the
    friction of the floor (log-uniform from 0.05 to 1), the strength of all magnets (±30 %) and of
    each (±15 %), the actual speed of the drive for a requested one (±60 %), and the offsets of the
    hinges in the tube. Each step sets the feed speed for the next 20 ms. Magnets act only outside
    the tube. The tube is 1.3 diagonals wide, so most folded chains can be drawn in, and may be held
    again. Two casings do not fit side by side, so a fold has to open. A wrong fold can be released
    again until the last component is out.

    **End**: when all components are out and at rest; when the drive has slipped for 0.1 s (status
    ``jammed``); after 5 s, 250 steps (``unsettled``); or when the simulation breaks down. Each of
    these terminates the episode, because the time is part of the task.

    **Action**: ``Box(−1, 1, (1,))``: x requests the speed ``0.6 x |x|`` m/s; negative speeds pull
    back, and the feed stands still below 0.025 m/s. The drive changes its speed by at most 0.2 m/s
    a step. `magfold_env.envs.spaces.actions.SpeedTable` lists the other forms.

    **Observation**: a flat ``Box(−1, 1)`` of ``12 n + 2`` entries, component 1 first. Frames are
    not stacked.

    ========= ========= ======================================================== =============
    group     entries   meaning and unit                                         range
    ========= ========= ======================================================== =============
    target    3 (n − 1) letter of each joint of the target, one-hot over L, S, R 0, 1
    magnets   4 n       front-left, back-left, back-right, front-right:          −1, 0, 1
                        1 N, −1 S, nominal
    direction 1         of the feed: 1 forward, −1 backward                      −1, 1
    seen      n         1 if the camera sees a component: it is not held and its 0, 1
                        centre is outside the tube. 20 ms old, as are the next
                        two groups, which are 0 for unseen components
    heading   2 n       sine and cosine of the heading, noise of 1°              [−1, 1]
    position  2 n       centre, mouth of the tube at 0, x / chain length, noise  (−1, 1) *
                        of 0.3 mm along x and y
    advance   1         position of the feed, x / chain length; 1 with all       [0, 1]
                        components out
    speed     1         commanded in the last step, x / (0.6 m/s)                [−1, 1]
    force     1         of the drive, mean over the last step, noise of 10 mN,   (−1, 1) *
                        x / (0.1 N); negative pulls
    time      1         x / (5 s)                                                [0, 1]
    ========= ========= ======================================================== =============

    Entries marked * are squashed by ``x / (1 + |x|)``. Noise is normal, with these standard
    deviations. Observations contain no velocities and none of the hidden draws.

    **Reward**: the score at the end: 1 in the target, half the similarity to it otherwise, and 0 if
    the time is over or the simulation broke down. ``reward="sparse"``: 1 in the target, else 0.
    ``reward="relative"``: the score less b, the score of the best constant speed
    (`magfold_env.envs.baselines.constant_speed`). Each step costs its share of 0.02 a second.
    Shaping: `magfold_env.envs.tasks.reward`.

    **Info**: ``target``, ``word``, ``time`` [s], ``force`` [N], as measured; at the end also
    ``status``, ``message``, ``energy`` [J], ``score``, ``baseline``, ``baseline_flagged`` (true
    unless the reward uses b) and ``is_success``.

    Arguments are those of `magfold_env.envs.camera_track.CameraTrackEnv`.
    """

    make_episodes = FloorEpisodes
    default_scene = "unknown-floor"
    default_tasks = "two-folds-6"


UnknownFloorVectorEnv = ChainVectorEnv[Any].of(UnknownFloorEnv)
