"""What the module vcp offers, for editors and type checkers."""

from os import PathLike
from types import TracebackType
from typing import Callable, List, Optional, Sequence, Tuple, Type, TypedDict, Union

import numpy as np
import numpy.typing as npt

Triple = List[float]  # three numbers
Point = Sequence[float]
Plane = Sequence[float]  # a, b, c, d: what has a x + b y + c z >= d is kept
Colour = Sequence[float]  # red, green, blue, opacity, 0 to 1
Line = Tuple[Sequence[Point], Colour, float]  # points, colour, width in pixels
Matrix = Sequence[float]  # 16 numbers, row by row
Caps = Union[bool, str]  # True: of closed parts; "all"
File = Union[str, PathLike[str]]
Path = Union[File, Sequence[Tuple[File, Optional[Matrix]]]]

__version__: str

FIT: int
RESET: int
FRONT: int
RIGHT: int
TOP: int
ISOMETRIC: int
NEXT_SHADING: int
LEFT_BUTTON: int
MIDDLE_BUTTON: int
RIGHT_BUTTON: int
SHIFT: int
CONTROL: int

class Error(RuntimeError): ...

class Camera(TypedDict):
    position: Triple
    target: Triple
    up: Triple
    fov_y: float
    orthographic: bool

class Look(TypedDict):
    shading: str
    error_pixels: float
    shadows: bool
    occlusion_rays: int
    occlusion_radius: float
    light: Triple
    light_in_world: bool
    transparent: bool
    background_top: Triple
    background_bottom: Triple
    sections: List[List[float]]
    section_caps: Caps
    samples: int
    colour_error: float
    plain: bool

class Pick(TypedDict):
    position: Triple
    normal: Triple
    distance: float
    error: float
    level: int
    dataset: int

class Stats(TypedDict):
    settled: bool
    relaxed: bool
    frames: int
    frame_ms: float
    error_pixels: float
    rays: int
    hit_pixels: int
    samples: int
    detail: int
    resident_bytes: int
    pool_bytes: int
    bytes_read: int
    pages_resident: int
    pages_drawn: int
    device_losses: int
    processor_rays: bool
    colour_limits: bool
    colour_pixels: float

class Dataset(TypedDict):
    triangles: int
    levels: int
    bounds_min: Triple
    bounds_max: Triple
    cell: float
    certified_error: float
    datasets: int

class Report(TypedDict):
    triangles: int
    levels: int
    file_bytes: int
    cell: float
    certified_error: float
    seconds: float

class View:
    samples: int
    @property
    def camera(self) -> Camera: ...
    @property
    def look(self) -> Look: ...
    @property
    def stats(self) -> Stats: ...
    @property
    def dataset(self) -> Dataset: ...
    @property
    def device(self) -> str: ...
    def resize(self, width: int, height: int) -> None: ...
    def settle(self, seconds: float = 60.0) -> bool: ...
    def render(self) -> Tuple[npt.NDArray[np.uint8], npt.NDArray[np.float32]]: ...
    def save_png(self, path: str) -> None: ...
    def pick(self, x: float, y: float) -> Optional[Pick]: ...
    def press(self, button: int, x: float, y: float, modifiers: int = 0) -> None: ...
    def move(self, x: float, y: float) -> None: ...
    def release(self, button: int) -> None: ...
    def scroll(self, x: float, y: float, notches: float, modifiers: int = 0) -> None: ...
    def key(self, character: str, pressed: bool = True) -> None: ...
    def act(self, action: int) -> None: ...
    def set_camera(self, *, position: Point = ..., target: Point = ..., up: Point = ..., fov_y: float = ...,
                   orthographic: bool = ...) -> None: ...
    def set_look(self, *, shading: str = ..., error_pixels: float = ..., shadows: bool = ..., occlusion_rays: int = ...,
                 occlusion_radius: float = ..., light: Point = ..., light_in_world: bool = ..., transparent: bool = ...,
                 background_top: Point = ..., background_bottom: Point = ..., sections: Sequence[Plane] = ...,
                 section_caps: Caps = ..., samples: int = ..., colour_error: float = ...,
                 plain: bool = ...) -> None: ...
    def set_light(self, direction: Point, in_world: bool = False) -> None: ...
    def set_sections(self, planes: Sequence[Plane], caps: Caps = False) -> None: ...
    def set_lines(self, lines: Sequence[Line]) -> None: ...
    def set_environment(self, source: str | None, turn_degrees: float = 0, strength: float = 1) -> None: ...
    def set_visible(self, dataset: int, visible: bool) -> None: ...
    def is_visible(self, dataset: int) -> bool: ...
    def set_budgets(self, gpu_bytes: int, ram_bytes: int = 0) -> None: ...
    def close(self) -> None: ...
    def __enter__(self) -> View: ...
    def __exit__(self, kind: Optional[Type[BaseException]] = None, value: Optional[BaseException] = None,
                 traceback: Optional[TracebackType] = None) -> None: ...

def build(inputs: Sequence[File], output: File, cell: float = 0.0, error: float = 0.0, memory_bytes: int = 0,
          threads: int = 0, colour: str = "auto", format: str = "",
          progress: Optional[Callable[[str, float], Optional[bool]]] = None) -> Report: ...
def open(path: Path, width: int = 1280, height: int = 720, gpu_bytes: int = 0, device: str = "",
         z_is_up: bool = False, progress: Optional[Callable[[int, int], Optional[bool]]] = None) -> View: ...
