"""Batches on a Dask cluster: the same folder of results as ``facemill batch run``, byte for byte.

:func:`run` submits the tasks that have no result yet, :func:`expand` lists all of them. Only
:func:`run` needs the package ``distributed``.
"""

from facemill.batch._expand import expand
from facemill.batch._run import Summary, run

__all__ = ["Summary", "expand", "run"]
