"""A fold that is drawn back into a tube with a wide bore, and then released again."""

import magfold_env as mf

scene = mf.load_scene("reprogram")
scene = scene.replace(
    sequence=mf.load_scene("paper/sequence-3").sequence,
    feed={
        "direction": "backward",
        "bore": 1.3 * scene.casing.diagonal,
        "schedule": {"advance": [(5.2, 0.15), (1.0, 0.3), (6.0, 0.3)]},
    },
)
fold = mf.simulate(scene, seed=0, frame_rate=60)
print(fold.word, fold.status)
fold.to_html("drawn_back.html")
