"""Touch a height field: a haptic proxy over an array, millimetres in, newtons out.

>>> import numpy as np, hapterra
>>> hills = hapterra.Terrain(np.zeros((200, 200)), cell_mm=0.5)
>>> contact = hapterra.Contact(hills, hapterra.Surface(friction=0.4))
>>> contact.step([50, 50, 5]).state
<State.FREE: 0>
>>> contact.step([50, 50, -1]).force_n
(0.0, 0.0, 0.5)

Lengths are device millimetres: x east, y north, z up, origin at the south-west sample at
height zero. The haptic interface point (HIP) is where the hand is; the proxy stays on the surface,
and a spring between them makes the force. Forces equal those of ``hapterra replay`` on the same
heights, bit for bit.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ._command import CommandError
    from ._connect import Device, Mark, Sample, connect
    from ._contact import STEP, Contact, State, Step, StepError, to_dataframe
    from ._native import Surface
    from ._params import Params
    from ._recording import Recording, read_recording
    from ._session import DeviceError, NotDisarmedError
    from ._stability import stability
    from ._terrain import Terrain
    from ._virtual_arm import ARM_STEP, VirtualArm

#: Where each name is. The command starts without numpy.
_MODULES = {
    "ARM_STEP": "_virtual_arm",
    "STEP": "_contact",
    "CommandError": "_command",
    "Contact": "_contact",
    "Device": "_connect",
    "DeviceError": "_session",
    "Mark": "_connect",
    "NotDisarmedError": "_session",
    "Params": "_params",
    "Recording": "_recording",
    "Sample": "_connect",
    "State": "_contact",
    "Step": "_contact",
    "StepError": "_contact",
    "Surface": "_native",
    "Terrain": "_terrain",
    "VirtualArm": "_virtual_arm",
    "connect": "_connect",
    "read_recording": "_recording",
    "stability": "_stability",
    "to_dataframe": "_contact",
}

__all__ = [
    "ARM_STEP",
    "STEP",
    "CommandError",
    "Contact",
    "Device",
    "DeviceError",
    "Mark",
    "NotDisarmedError",
    "Params",
    "Recording",
    "Sample",
    "State",
    "Step",
    "StepError",
    "Surface",
    "Terrain",
    "VirtualArm",
    "connect",
    "read_recording",
    "stability",
    "to_dataframe",
]


def __getattr__(name: str) -> Any:
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    globals()[name] = getattr(import_module(f".{_MODULES[name]}", __name__), name)
    return globals()[name]


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
