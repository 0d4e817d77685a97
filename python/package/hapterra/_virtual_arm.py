"""A virtual arm in a hand, in a closed loop with a contact."""

from __future__ import annotations

import warnings
from collections.abc import Iterable

import numpy as np
import numpy.typing as npt

from . import _native
from ._contact import Contact, StepError, arguments

#: A row of ``VirtualArm.run``. Vectors are east, north, up; ``state`` is a number of ``State``.
ARM_STEP = np.dtype(
    [
        ("t_s", "=f8"),
        ("hip_mm", "=f8", (3,)),
        ("proxy_mm", "=f8", (3,)),
        ("hand_mm", "=f8", (3,)),
        ("force_n", "=f4", (3,)),
        ("tick", "=u4"),
        ("state", "u1"),
    ],
    align=True,
)


class VirtualArm:
    """A virtual Phantom Premium 1.5 in a hand, for experiments without hardware.

    ::

        target ─[ arm k, b ]─ hand mass ─[ grip k, b ]─ tip ─ links, motors, encoders

    The arm is that of ``hapterra-lab stability``: rigid links, joints with friction, motors with
    the lag of their amplifiers, encoder counts. Each tick reads the encoders, makes a
    step of the contact, and sets the motors to its force and the arm's weight, by the boards'
    own kinematics and without a delay. It has no guard, arming and latency of a board;
    ``connect("native")`` has them.

    Parameters
    ----------
    home_mm : east, north, up, mm
        The point of the terrain at the tip in the arm's home pose. An arm reaches some 100 mm
        to each side of it.
    hand_mass : kg that move with the fingers.
    arm_stiffness, arm_damping : N/m and N·s/m of the muscles, towards the target.
    grip_stiffness, grip_damping : N/m and N·s/m of the fingers on the tip. The defaults are a
        relaxed precision grip within the ranges of published identification studies.
    """

    def __init__(
        self,
        home_mm: Iterable[float],
        *,
        hand_mass: float = 0.15,
        arm_stiffness: float = 300.0,
        arm_damping: float = 8.0,
        grip_stiffness: float = 2000.0,
        grip_damping: float = 10.0,
    ) -> None:
        east, north, up = map(float, home_mm)
        hand = (hand_mass, arm_stiffness, arm_damping, grip_stiffness, grip_damping)
        names = ("hand_mass", "arm_stiffness", "arm_damping", "grip_stiffness", "grip_damping")
        for name, number in zip(names, hand):
            if not 0 < number < 1e5:
                raise ValueError(f"{name} is {number}: use a number above 0")
        self._native = _native.VirtualArm((east, north, up), hand)
        self.home_mm = (east, north, up)

    def run(
        self, contact: Contact, targets_mm: npt.ArrayLike, t: npt.ArrayLike | None = None
    ) -> npt.NDArray[np.void]:
        """Moves the hand along targets over the terrain of a contact, without the interpreter's
        lock. The same arguments return the same bits.

        Parameters
        ----------
        contact : Contact
            Used at its rate. It continues from its state; the arm begins at rest at the first
            target.
        targets_mm : array of shape (N, 3)
            The hand's target, east, north, up, mm. To press, use a target below the surface: a hand
            of 300 N/m presses with 0.3 N a millimetre, less the compliance of surface and grip.
        t : array of shape (N,), seconds, optional
            As in ``Contact.run``.

        Returns
        -------
        array of ``ARM_STEP``
            A row for each tick: the position by the encoders at its beginning (``hip_mm``), the
            hand's position (``hand_mm``), and the result of the contact.

        Raises
        ------
        ValueError
            A target that the arm cannot reach.
        StepError
            At the first step that is not possible, with the steps before it.
        """
        rows, remarks, error = self._native.run(contact._native, *arguments(targets_mm, t))
        for remark in remarks:
            warnings.warn(remark, stacklevel=2)
        steps = np.frombuffer(rows, ARM_STEP)
        if error is not None:
            raise StepError(f"tick {len(steps)}: {error}", steps)
        return steps

    def __repr__(self) -> str:
        return f"<VirtualArm with {self.home_mm} mm of the terrain at its home pose>"
