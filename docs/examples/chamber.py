"""A chain that is fed from a tube into a chamber, in which it has little room to fold."""

import magfold_env as mf

scene = mf.load_scene("paper/sequence-3").replace(
    mount="tube",
    feed={"direction": "backward", "speed": 0.2},
    obstacles=mf.chamber((0.0, -0.03), (0.07, 0.06), opening=0.02),
)
fold = mf.simulate(scene, seed=0, frame_rate=60)
print(fold.word, fold.status)
fold.to_html("chamber.html")
