"""TensorBoard's event files of a run that is taken up again.

Records are only ever added to the end of an event file. So the files as they were when a
checkpoint was written are the first bytes of what they are now, and what was written after it, and
will be written again, can be cut off.
"""

import os
from pathlib import Path

PATTERN = "events.out.tfevents.*"


def event_sizes(folder: Path) -> dict[str, int]:
    """Return the size of each event file in `folder` in bytes, by name."""
    return {path.name: path.stat().st_size for path in sorted(folder.glob(PATTERN))}


def cut_events(folder: Path, sizes: dict[str, int]) -> None:
    """Cut the event files in `folder` to `sizes`; remove those that were not there."""
    for path in folder.glob(PATTERN):
        if path.name not in sizes:
            path.unlink()
        elif path.stat().st_size > sizes[path.name]:
            os.truncate(path, sizes[path.name])
