"""A chain of twelve components whose magnets make the target its only stable word."""

import magfold_env as mf

design = mf.design("LRLRRLLRLRL", objective="unique", mode="backward", runs=0)
assert design.scene is not None, design.certificate
fold = mf.simulate(design.scene, seed=0, frame_rate=60)
print(fold.word, fold.status)
fold.to_html("twelve.html")
