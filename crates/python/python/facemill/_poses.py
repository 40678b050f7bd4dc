"""Tests of tool poses."""

from __future__ import annotations

import enum
import os
from typing import TYPE_CHECKING, Any, Mapping

from facemill import _facemill
from facemill._jobs import Content, Job, _GivenJob
from facemill._machine import _rows

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import ArrayLike, NDArray


class Verdict(enum.IntEnum):
    """Verdict on a pose."""

    FREE = 0
    #: The cutter is deeper in a body than permitted.
    GOUGE = 1
    #: Another body of tool or machine hits something, or the cutter the machine.
    COLLISION = 2
    #: No axis values within the limits give the pose.
    UNREACHABLE = 3
    #: The tool axis is outside the cone that the job permits.
    OUTSIDE_CONE = 4
    #: Another reason; :meth:`PoseTest.reasons` has it.
    OTHER = 5


class PoseTest:
    """Exact test of tool poses against part, fixtures, stock and machine of a job's setup.

    :param job: as for :func:`facemill.plan`.
    :param setup: index of the setup, from 0.
    :param operation: name of the operation whose tolerances and allowances count; default: the
        first one of the setup.
    :raises Error: if the job is wrong, or its machine has two heads.
    """

    def __init__(
        self,
        job: Job,
        setup: int = 0,
        operation: str | None = None,
        *,
        folder: str | os.PathLike[str] | None = None,
        files: Mapping[str, Content] | None = None,
        settings: Mapping[str, Any] | None = None,
    ) -> None:
        self._test = _facemill.PoseTest(_GivenJob(job, folder, files, settings), setup, operation)

    def verdicts(self, positions: ArrayLike, axes: ArrayLike) -> NDArray[np.int8]:
        """Returns the :class:`Verdict` on each pose: 0 where it is free.

        A pose is free if one configuration of the machine takes it without a collision. It is
        tested as it is, without the lift by which a plan seats a posture on facets.

        :param positions: tips of the tool, mm, workpiece frame: N × 3, or 3.
        :param axes: tool axes, vectors of any length: N × 3, or 3.
        """
        return self._test.codes(_rows(positions)[0], _rows(axes)[0])

    def reasons(self, positions: ArrayLike, axes: ArrayLike) -> list[str | None]:
        """Returns in words why each pose is not free; ``None`` where it is."""
        return self._test.reasons(_rows(positions)[0], _rows(axes)[0])
