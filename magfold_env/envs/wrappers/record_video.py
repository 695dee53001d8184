"""Videos of whole episodes, including the motion between decisions."""

from typing import Any, TypeVar

from gymnasium import wrappers

ObsType = TypeVar("ObsType")
ActType = TypeVar("ActType")


class RecordVideo(wrappers.RecordVideo[ObsType, ActType]):
    """Gymnasium's `RecordVideo` with all frames of ``render_mode="rgb_array_list"``.

    Gymnasium's own class keeps only the last frame of each step, the moment of a decision.
    Arguments are Gymnasium's; ``video_length`` counts frames, but the last step is recorded
    completely.
    """

    def _capture_frame(self) -> None:
        frames: Any = self.env.render()
        self.recorded_frames += frames if isinstance(frames, list) else [frames]
