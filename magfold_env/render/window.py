"""A window that shows pictures and reads keys.

pygame is imported only when a window opens. With ``SDL_VIDEODRIVER=dummy``, it needs no display.
"""

import os
from typing import TYPE_CHECKING, Any

from PIL import Image

from magfold_env.files import pip_install
from magfold_env.render.canvas import Size

if TYPE_CHECKING:
    import pygame

SMALLEST: Size = (400, 300)


class Window:
    """A resizable window with an initial ``size`` [px], which opens to show the first picture."""

    def __init__(self, size: Size, title: str) -> None:
        self._size, self._title = size, title
        self._surface: pygame.Surface | None = None

    @property
    def size(self) -> Size:
        """Current width and height [px]."""
        if self._surface is None:
            return self._size
        width, height = _pygame().display.get_window_size()
        return max(width, SMALLEST[0]), max(height, SMALLEST[1])

    def show(self, image: Image.Image) -> None:
        """Show a picture at the top left corner, and process the window's events."""
        pygame = _pygame()
        if self._surface is None:
            pygame.display.init()
            pygame.display.set_caption(self._title)
            self._surface = pygame.display.set_mode(self._size, pygame.RESIZABLE)
        # After a resize, `self._surface` still has the old size.
        screen = pygame.display.get_surface()
        if screen is not None:
            picture = pygame.image.frombytes(image.tobytes(), image.size, "RGB")
            screen.blit(picture, (0, 0))
            pygame.display.flip()
        pygame.event.pump()

    def is_interrupted(self) -> bool:
        """Return whether the event queue contains a key press or a request to quit."""
        if self._surface is None:
            return False
        pygame = _pygame()
        return bool(pygame.event.peek((pygame.KEYDOWN, pygame.QUIT)))

    def close(self) -> None:
        """Close the window; the next picture opens it again."""
        if self._surface is not None:
            self._surface = None
            _pygame().display.quit()

    def __getstate__(self) -> dict[str, Any]:
        """Return the state without the open window; a copy opens its own window."""
        return {**vars(self), "_surface": None}


def _pygame() -> Any:
    os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")
    try:
        import pygame  # noqa: PLC0415
    except ImportError as error:
        raise ImportError(
            f"windows need pygame-ce: install the extra, {pip_install('render')}"
        ) from error
    return pygame
