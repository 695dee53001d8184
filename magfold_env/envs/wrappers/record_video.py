"""Videos of whole episodes, the motion between decisions with them."""

from typing import Any, TypeVar

from gymnasium import wrappers

ObsType = TypeVar("ObsType")
ActType = TypeVar("ActType")


class RecordVideo(wrappers.RecordVideo[ObsType, ActType]):
    """Gymnasium's `RecordVideo` with all frames of ``render_mode="rgb_array_list"``.

    That keeps the last one of each step, the moment of a decision, as of ``rgb_array``. Arguments
    are Gymnasium's; a ``video_length`` counts frames, and is exceeded by those of a step.
    """

    def _capture_frame(self) -> None:
        frames: Any = self.env.render()
        self.recorded_frames += frames if isinstance(frames, list) else [frames]
