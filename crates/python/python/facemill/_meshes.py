"""Meshes from and to arrays: vertices of N × 3 float64 (mm), triangles of M × 3 uint32."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

from facemill import _facemill

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import ArrayLike, NDArray


def read_mesh(
    path: str | os.PathLike[str], unit: str | None = None, up_axis: str | None = None
) -> tuple[NDArray[np.float64], NDArray[np.uint32]]:
    """Returns vertices (mm) and triangles of a mesh file: .obj, .stl, .gltf, .glb or .3mf.

    The mesh is repaired as that of a job: equal vertices are one, empty triangles are left out.

    :param unit: unit of the file, ``"m"``, ``"cm"``, ``"mm"`` or ``"inch"``; default: the format's.
    :param up_axis: axis of the file that becomes z, ``"x"``, ``"y"`` or ``"z"``; default: the
        format's.
    :raises Error: if it cannot be read or is no mesh.
    """
    return _facemill.read_mesh(Path(path), unit, up_axis)


def mesh_bytes(name: str, vertices: ArrayLike, triangles: ArrayLike) -> bytes:
    """Returns the bytes of a mesh file in the format of its name's ending: .obj, .stl or .glb.

    :param vertices: N × 3, mm. Of STL single precision is kept.
    :param triangles: M × 3 indices of vertices, counter-clockwise as seen from outside.
    :raises Error: if they are no mesh.
    """
    import numpy as np

    corners = np.ascontiguousarray(vertices, dtype=np.float64)
    given = np.asarray(triangles)
    if corners.ndim != 2 or given.ndim != 2:
        raise _facemill.Error("vertices and triangles: must be arrays of two dimensions")
    if given.dtype.kind not in "iu" or (given.size and (given.min() < 0 or given.max() >= 2**32)):
        raise _facemill.Error("triangles: must be indices from 0 to 4294967295")
    return _facemill.mesh_bytes(Path(name), corners, np.ascontiguousarray(given, dtype=np.uint32))


def write_mesh(path: str | os.PathLike[str], vertices: ArrayLike, triangles: ArrayLike) -> None:
    """Writes a mesh file, as :func:`mesh_bytes`."""
    Path(path).write_bytes(mesh_bytes(os.fspath(path), vertices, triangles))
