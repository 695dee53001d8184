"""The paper's sequence 3, released as a whole on the floor, without a tube."""

import magfold_env as mf

scene = mf.load_scene("paper/sequence-3")
fold = mf.simulate(scene, seed=0, frame_rate=480)
print(fold.word, fold.status)
fold.to_html("free.html")
