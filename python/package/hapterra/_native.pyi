"""The compiled part. Use the names of `hapterra`."""

from collections.abc import Sequence
from typing import Any, Literal, final

_Vector = tuple[float, float, float]
_Pair = tuple[float, float]

def main(arguments: Sequence[str], program: Sequence[str]) -> int:
    """Runs the command with these arguments, once a process; `program` starts it again."""

def recording(
    path: str,
) -> tuple[str | None, list[tuple[str, str, bytes, list[str]]], bool]:
    """Returns settings as JSON, columns as name, type, bytes and texts, and if the last row was
    cut."""

@final
class Surface:
    """The parameters of a surface; `help(hapterra.Surface)` has units and bounds."""

    def __new__(
        cls,
        *,
        stiffness: float = 0.5,
        max_force: float = 8.5,
        friction: float = 0.0,
        static_friction: float | None = None,
        viscous_friction: float = 0.0,
        damping: float = 0.0,
        shading: Literal["none", "smooth"] = "none",
        texture: Literal["none", "grain", "grating"] = "none",
        texture_amplitude: float | None = None,
        texture_wavelength: float = 1.0,
        texture_direction: float = 0.0,
        texture_seed: int = 0,
        materials: Sequence[Surface] = ...,
    ) -> Surface: ...
    def params(self) -> dict[str, Any]:
        """Returns the parameters by their names, without those of an absent texture; for
        `materials`, their number."""

@final
class Terrain:
    def __new__(
        cls,
        samples: bytes,
        kind: str,
        shape: Sequence[int],
        *,
        cell_mm: float,
        height_mm_per_unit: float,
        south_first: bool,
        materials: bytes | None = None,
    ) -> Terrain: ...
    def with_tip(self, tip_mm: float) -> Terrain: ...
    @staticmethod
    def open(paths: Sequence[str], words: Sequence[str]) -> Terrain: ...
    def window(
        self, at: _Pair, lonlat: bool, size_mm: _Pair, words: Sequence[str]
    ) -> Terrain: ...
    def mm_at(self, at: _Pair, lonlat: bool) -> _Pair: ...
    def ground_at(self, mm: _Pair, lonlat: bool) -> _Pair: ...
    def stated(self) -> list[tuple[str, str]]: ...
    def rows(self, south: int, count: int) -> bytes: ...
    def height_mm(self, east_mm: float, north_mm: float) -> float | None: ...
    @property
    def shape(self) -> tuple[int, int]: ...
    @property
    def scale(self) -> _Pair: ...
    @property
    def size_mm(self) -> tuple[float, float]: ...

@final
class Contact:
    def __new__(cls, terrain: Terrain, surface: Surface, rate_hz: int) -> Contact: ...
    def step(
        self, east_mm: float, north_mm: float, up_mm: float
    ) -> tuple[_Vector, _Vector, int, float | None]: ...
    def run(
        self, path: bytes, t_s: bytes | None = None
    ) -> tuple[bytearray, list[str], str | None]: ...
    def set_surface(self, surface: Surface) -> None: ...

@final
class VirtualArm:
    def __new__(cls, home_mm: Sequence[float], hand: Sequence[float]) -> VirtualArm: ...
    def run(
        self, contact: Contact, targets: bytes, t_s: bytes | None = None
    ) -> tuple[bytearray, list[str], str | None]: ...
