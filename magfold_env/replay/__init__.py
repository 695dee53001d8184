"""The replay page: one HTML file that plays a recorded fold in any browser.

It needs neither a network nor any extra: `page.html` is filled with `page.css`, the scripts and the
fold as JSON.
"""

from magfold_env.replay.page import write_html

__all__ = ["write_html"]
