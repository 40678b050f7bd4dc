"""Five-axis face milling: plans, verification, kinematics and posture tests on numpy arrays.

Lengths are in mm, angles in degrees, feeds in mm/min, as in job files and in the words of NC
programs; directions are vectors. Every failure is an :class:`Error`, a ``ValueError`` with file,
field and remedy in its message. Long calls run without Python's lock, and Ctrl-C ends them.

``facemill.batch.run`` runs batches on a Dask cluster.
"""

from facemill._facemill import Error, __version__
from facemill._jobs import (
    Report,
    Retimed,
    Verification,
    example_job,
    feedrate,
    plan,
    verify,
)
from facemill._machine import Machine, presets
from facemill._meshes import mesh_bytes, read_mesh, write_mesh
from facemill._poses import PoseTest, Verdict

__all__ = [
    "Error",
    "Machine",
    "PoseTest",
    "Report",
    "Retimed",
    "Verdict",
    "Verification",
    "__version__",
    "example_job",
    "feedrate",
    "mesh_bytes",
    "plan",
    "presets",
    "read_mesh",
    "verify",
    "write_mesh",
]
