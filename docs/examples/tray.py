"""An episode of `Tray` with the minimiser's chain, fed at its best constant speed."""

import gymnasium
import numpy as np

import magfold_env  # noqa: F401  # registers the environments

env = gymnasium.make("MagFold/Tray-v0", render_mode="rgb_array_list")
observation, info = env.reset(seed=1)
track = env.unwrapped
plan = track.plan_of([track.tasks.index(track.task)])
ended = False
while not ended:
    (action,) = track.actions.write(plan(track.episodes, np.array([0])))
    observation, reward, ended, _, info = env.step(action)
print(info["status"], info["score"])
track.to_html("tray.html")
