"""Machines."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

from facemill import _facemill

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import ArrayLike, NDArray


def presets() -> list[str]:
    """Returns the names of the machines that come with facemill."""
    return _facemill.preset_names()


class Machine:
    """Five-axis machine with one head.

    Joints are the readings of the scales in the order of NC words (``axis_names``): mm and
    degrees. Poses are the tip of the tool (mm) and its axis, a vector toward the spindle, in the
    frame of the table.

    :param path_or_name: machine file, or the name of a preset (:func:`presets`).
    :raises Error: if there is no such machine, or its file is wrong.
    """

    def __init__(self, path_or_name: str | os.PathLike[str]) -> None:
        self._machine = _facemill.Machine(Path(path_or_name))

    @property
    def name(self) -> str:
        """Name of the machine in reports."""
        return self._machine.name

    @property
    def axis_names(self) -> list[str]:
        """Addresses of the axes, in the order of the joints."""
        return self._machine.axis_names

    @property
    def home(self) -> NDArray[np.float64]:
        """Home position, mm and degrees."""
        import numpy as np

        return np.array(self._machine.home)

    @property
    def limits(self) -> NDArray[np.float64]:
        """Smallest and largest value of each axis, mm and degrees, as an array of two columns."""
        import numpy as np

        return np.array(self._machine.limits)

    def forward(
        self, joints: ArrayLike, tool_length: float = 0.0
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Returns tip positions (mm) and tool axes (unit vectors) of joint values.

        Limits are not tested.

        :param joints: N rows, or one, of a value for each axis, mm and degrees.
        :param tool_length: distance from the gauge line to the tip, mm.
        :returns: two arrays of N × 3; of 3 for one row.
        """
        rows, one = _rows(joints)
        positions, axes = self._machine.forward(rows, tool_length)
        return (positions[0], axes[0]) if one else (positions, axes)

    def inverse(
        self,
        positions: ArrayLike,
        axes: ArrayLike,
        tool_length: float = 0.0,
        near: ArrayLike | None = None,
    ) -> NDArray[np.float64]:
        """Returns joint values, mm and degrees, that bring the tool to poses.

        Of all solutions within the limits each row has the one that is reached first from
        ``near``; a row without any is NaN.

        :param positions: tips, mm: N × 3, or 3.
        :param axes: tool axes, vectors of any length: N × 3, or 3.
        :param tool_length: distance from the gauge line to the tip, mm.
        :param near: joint values to stay near to, mm and degrees; default: home.
        """
        import numpy as np

        position_rows, one = _rows(positions)
        axis_rows, _ = _rows(axes)
        reference = None if near is None else np.ascontiguousarray(near, dtype=np.float64)
        joints = self._machine.inverse(position_rows, axis_rows, tool_length, reference)
        return joints[0] if one else joints

    def __repr__(self) -> str:
        return repr(self._machine)


def _rows(values: ArrayLike) -> tuple[NDArray[np.float64], bool]:
    """Returns an array of two dimensions, and whether it was one row."""
    import numpy as np

    array = np.asarray(values, dtype=np.float64)
    if array.ndim == 1:
        return np.ascontiguousarray(array[np.newaxis, :]), True
    if array.ndim != 2:
        raise _facemill.Error(f"must be an array of one or two dimensions, has {array.ndim}")
    return np.ascontiguousarray(array), False
