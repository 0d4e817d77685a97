"""The maximum stiffness of a surface, by trials on the virtual arm."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, Union

from ._command import lab, options, run
from ._dataframe import pandas_for

if TYPE_CHECKING:
    import pandas

_Numbers = Union[float, Iterable[float]]


def stability(
    *,
    rate: _Numbers | None = None,
    stiffness: _Numbers | None = None,
    damping: _Numbers | None = None,
    passivity: str | Iterable[str] | None = None,
    delay_us: int | None = None,
    arm_friction: _Numbers | None = None,
    **more: Any,
) -> pandas.DataFrame:
    """Tests on a virtual arm, by ``hapterra-lab stability``, which stiffness of a surface is
    unstable; docs/explanation/stability.md describes the trials. The program ``hapterra-lab`` is not
    part of this package: in a clone, ``cargo install --locked --path bench --bin hapterra-lab``.

    Parameters
    ----------
    rate : ticks a second, whole thousands from 1000 to 10000; 1000, 2000, 4000 and 10000.
    stiffness : N/mm, 0.001 to 100; 13 from 0.1 to 20.
    damping : N·s/m, 0 to 20; 0.
    passivity : "off", "on", or both; both.
    delay_us : µs from reading the encoders to the amplifiers, 0 to 10000; 200.
    arm_friction : friction of the joints as parts of the model's, 0 to 10; 0.1 and 1.
    **more : options of the command, as ``surface="sand"``, whose texture is tried.

    All combinations are tried: one number, or several, of each.

    Returns
    -------
    pandas.DataFrame
        A row a trial. ``tick_hz``, ``damping_ns_per_m``, ``controller`` (passivity, True or False),
        ``grasp``, ``stiffness_n_per_mm``, ``delay_us``, ``arm_friction`` and the texture are what was tried;
        ``press`` is the verdict on a pressed surface, ``swing_mm`` and ``swings_hz`` its limit cycle,
        ``fault`` what tripped; ``given_mj_at_...`` is the energy, mJ, that a tap at a speed gained, and
        ``ramp_...`` and ``clutch_...`` are the same while the force ramps up. ``attrs["summary"]``
        is the text that the command prints.

    Raises
    ------
    ImportError
        Without pandas.
    CommandError
        For numbers out of bounds, with the command's text, or without ``hapterra-lab``.
    """
    pandas = pandas_for("hapterra.stability")
    asked = options(
        rate=rate,
        stiffness=stiffness,
        damping=damping,
        passivity=passivity,
        delay=None if delay_us is None else f"{delay_us}us",
        arm_friction=arm_friction,
        **more,
    )
    with tempfile.TemporaryDirectory(prefix="hapterra-") as folder:
        trials = os.path.join(folder, "trials.csv")
        summary = run("stability", *asked, f"--out={trials}", program=lab())
        # "none" is the name of a texture.
        frame = pandas.read_csv(trials, keep_default_na=False, na_values=[""])
    frame.attrs["summary"] = summary
    return frame
