"""Pictures of chains: PNG and GIF files, charts, and sheets of ranked shapes.

Pillow draws a frame in milliseconds, without a display, and identically on every machine. Only
assembly sheets and the charts of ensembles, sweeps and limit loads use matplotlib. This package
needs the `render` extra; the replay page, `magfold_env.replay`, does not.
"""

from magfold_env.files import pip_install

try:
    import PIL as _PIL  # noqa: F401  # pyright: ignore[reportUnusedImport]
except ImportError as error:
    raise ImportError(
        f"pictures need Pillow: install the extra, {pip_install('render')}"
    ) from error

from magfold_env.render.assembly import save_sheet
from magfold_env.render.charts import draw_ensemble, draw_sweep
from magfold_env.render.frames import save_gif, save_png
from magfold_env.render.holding import draw_holding
from magfold_env.render.states import draw_states

__all__ = [
    "draw_ensemble",
    "draw_holding",
    "draw_states",
    "draw_sweep",
    "save_gif",
    "save_png",
    "save_sheet",
]
