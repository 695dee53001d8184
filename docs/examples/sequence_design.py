"""An episode of `SequenceDesign`, in which one step chooses the whole chain and its feed speed."""

import gymnasium

import magfold_env  # noqa: F401  # registers the environments

env = gymnasium.make("MagFold/SequenceDesign-v0", render_mode="rgb_array_list")
observation, info = env.reset(seed=0, options={"target": "RRLRL"})
design = env.unwrapped.baseline
action = env.unwrapped.actions.encode(design.sequence, design.speed)
observation, reward, ended, _, info = env.step(action)
print(info["status"], info["score"])
env.unwrapped.to_html("sequence_design.html")
