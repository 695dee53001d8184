"""The replay page: one HTML file that plays a recorded fold in any browser.

It needs neither a network nor any extra: `page.html` is filled with `page.css`, the scripts and the
fold as JSON.
"""

from magfold_env.replay.data import Recording, page_data
from magfold_env.replay.page import page, write_html

__all__ = ["Recording", "page", "page_data", "write_html"]
