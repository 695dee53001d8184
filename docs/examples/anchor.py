"""An anchor like a real device, with strong and weak magnets, a payload and an external field."""

import magfold_env as mf

scene = mf.load_scene("anchor")
fold = mf.simulate(scene, seed=0, frame_rate=60)
print(fold.word, fold.status)
fold.to_html("anchor.html")
