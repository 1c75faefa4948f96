"""Views of .vcp files, and how to build them: docs/embedding.md tells of both."""

from ._vcp import (CONTROL, FIT, FRONT, ISOMETRIC, LEFT_BUTTON, MIDDLE_BUTTON, NEXT_SHADING, RESET, RIGHT, RIGHT_BUTTON,
                   SHIFT, TOP, Error, View, __version__, build, open)

__all__ = [
    "CONTROL", "FIT", "FRONT", "ISOMETRIC", "LEFT_BUTTON", "MIDDLE_BUTTON", "NEXT_SHADING", "RESET", "RIGHT",
    "RIGHT_BUTTON", "SHIFT", "TOP", "Error", "View", "__version__", "build", "open"
]
