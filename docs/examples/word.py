"""Magnets and a feed speed designed for a word of six components, and one release of the chain."""

import magfold_env as mf

WORD = "LRLLL"

design = mf.design(WORD, mode="backward", runs=0)
assert design.scene is not None, design.certificate
fold = mf.simulate(design.scene, seed=0, frame_rate=120)
print(fold.word, fold.status, f"{fold.energy:.4f} J")
fold.to_html(f"{WORD}.html")
