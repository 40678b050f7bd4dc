"""Expansion of batches."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any, Iterable

from facemill._facemill import Error
from facemill.batch._process import Child, ChildEnded

#: Tasks that a batch may have.
MAX_TASKS = 100_000


def allowed(
    batch: Path, allow: Iterable[str | os.PathLike[str]], allow_outside: bool
) -> list[str]:
    """Returns the folders in which jobs of a batch may name files."""
    anywhere = [os.path.abspath(os.sep)] if allow_outside else []
    return [os.path.abspath(folder) for folder in allow] + [str(batch.parent)] + anywhere


def expand(
    batch: str | os.PathLike[str],
    *,
    allow: Iterable[str | os.PathLike[str]] = (),
    allow_outside: bool = False,
    max_tasks: int = MAX_TASKS,
) -> list[dict[str, Any]]:
    """Returns the tasks of a batch as ``facemill batch expand --json`` lists them.

    A process of its own reads the batch, which is confined to its folder.

    :param allow: folders besides its own in which jobs may name files.
    :param allow_outside: permit the batch and its jobs to name files anywhere.
    :param max_tasks: largest number of tasks.
    :raises Error: if the batch cannot be read or is wrong.
    """
    path = Path(os.path.abspath(batch))
    child = Child(allowed(path, allow, allow_outside), None, None)
    request = {"expand": str(path), "max_tasks": max_tasks, "allow_outside": allow_outside}
    try:
        answer = child.ask(request)
    except ChildEnded as ended:
        raise Error(f"{path}: the process that reads it ended: {ended.errors.strip()}") from None
    finally:
        child.close()
    if "tasks" not in answer:
        raise Error(answer["message"])
    return json.loads(answer["tasks"])["tasks"]
