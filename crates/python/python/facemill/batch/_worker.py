"""Work of a Dask worker: inputs from the scheduler to its disk, tasks in children, results as bytes.

Only text and bytes go back: JSON, and files in a tar archive. The client unpickles nothing of them.
"""

from __future__ import annotations

import io
import json
import os
import shutil
import tarfile
import tempfile
import threading
import time
from pathlib import Path
from typing import Any

from facemill._facemill import Error, checksum
from facemill.batch._process import Child, ChildEnded

#: Time between looks at a task that another run works on, s.
_BETWEEN_LOOKS = 0.2

_idle: dict[str, list[Child]] = {}
_lock = threading.Lock()


def hold(content: bytes) -> bytes:
    """Returns an input: its task keeps it at the scheduler, and at each worker that needs it."""
    return content


def work(text: str, inputs: dict[str, bytes]) -> bytes:
    """Runs the tasks of a chunk, and returns their files and failures as a tar archive.

    :param text: chunk as JSON.
    :param inputs: contents of the input files by checksum.
    """
    from distributed import get_worker

    chunk = json.loads(text)
    local = Path(get_worker().local_directory) / "facemill"
    return run_chunk(chunk, inputs, local)


def run_chunk(chunk: dict[str, Any], inputs: dict[str, bytes], local: Path) -> bytes:
    """Runs the tasks of a chunk in a folder of this worker."""
    out = Path(chunk["shared_out"] or local / "results")
    if chunk["shared_out"] is None:
        for name, content in inputs.items():
            _keep(local / "inputs", name, content)
    packed = io.BytesIO()
    with tarfile.open(fileobj=packed, mode="w") as archive:
        for item in chunk["tasks"]:
            failure = _run(item, chunk, local, out)
            key = item["key"]
            if failure is not None:
                _add(archive, f"{key}/failed.json", json.dumps(failure).encode())
            elif chunk["shared_out"] is None:
                folder = out / "tasks" / key
                for file in sorted(folder.iterdir()):
                    _add(archive, f"{key}/{file.name}", file.read_bytes())
                shutil.rmtree(folder)
    return packed.getvalue()


def _add(archive: tarfile.TarFile, name: str, content: bytes) -> None:
    member = tarfile.TarInfo(name)
    member.size = len(content)
    archive.addfile(member, io.BytesIO(content))


def _run(item: dict[str, Any], chunk: dict[str, Any], local: Path, out: Path) -> dict[str, Any] | None:
    """Runs a task; returns its failure, or ``None`` if its result is in the folder."""
    key, task = item["key"], dict(item["task"])
    if chunk["shared_out"] is None:
        tree = _tree(local, item["tree"])
        task["job"] = str(tree / item["job"])
        if item["program"] is not None:
            task["program"] = str(tree / item["program"])
    allow = chunk["allow"] or [str(local)]
    request = {"task": task, "key": key, "out": str(out), "passing": chunk["shared_out"] is None}
    tries = 0
    while True:
        tries += 1
        try:
            answer = _ask(request, allow, chunk["threads"], chunk["max_memory"])
        except ChildEnded as ended:
            failure = _died(ended, chunk["max_memory"])
            if tries <= chunk["retries"]:
                continue
            return {**_failure(key, item["task"], tries), **failure}
        if answer["end"] == "filed":
            return None
        if answer["end"] == "locked":
            tries -= 1
            time.sleep(_BETWEEN_LOOKS)
            continue
        recorded = out / "failed" / f"{key}.json"
        if recorded.exists():
            failure = json.loads(recorded.read_bytes())
            if chunk["shared_out"] is None:
                recorded.unlink()
            return {**failure, "task": item["task"]}
        code, message = answer.get("exit_code", 3), answer.get("message", answer["end"])
        if _is_out_of_memory(message, chunk["max_memory"]):
            failure = _out_of_memory(chunk["max_memory"])
        else:
            failure = {"kind": "input" if code == 2 else "internal", "cause": message, "exit_code": code}
        return {**_failure(key, item["task"], tries), **failure}


def _failure(key: str, task: dict[str, Any], tries: int) -> dict[str, Any]:
    return {
        "format": "facemill-batch-failure/1",
        "key": key,
        "task": task,
        "kind": "internal",
        "cause": "",
        "exit_code": None,
        "signal": None,
        "tries": tries,
        "peak_mib": None,
    }


def _died(ended: ChildEnded, max_memory: int | None) -> dict[str, Any]:
    """Returns the cause for which a child ended."""
    last = (ended.errors.strip().splitlines() or [""])[-1]
    behind = f": {last}" if last else ""
    if _is_out_of_memory(ended.errors, max_memory):
        return _out_of_memory(max_memory)
    if ended.code < 0:
        cause = f"ended by signal {-ended.code}{behind}"
        return {"kind": "machine", "cause": cause, "exit_code": None, "signal": -ended.code}
    cause = f"ended with exit code {ended.code}{behind}"
    return {"kind": "internal", "cause": cause, "exit_code": ended.code, "signal": None}


def _is_out_of_memory(text: str, max_memory: int | None) -> bool:
    """Returns whether an allocation failed: the second and third texts count only under a bound."""
    bounded = ["Resource temporarily unavailable", "Cannot allocate memory", "MemoryError"]
    return "memory allocation of " in text or (max_memory is not None and any(part in text for part in bounded))


def _out_of_memory(max_memory: int | None) -> dict[str, Any]:
    bound = "" if max_memory is None else f" within --max-memory {max_memory} MiB"
    return {"kind": "machine", "cause": f"out of memory{bound}", "exit_code": None, "signal": None}


def _ask(
    request: dict[str, Any], allow: list[str], threads: int | None, max_memory: int | None
) -> dict[str, Any]:
    """Gives a task to an idle child, or to a new one."""
    kind = json.dumps([allow, threads])
    child = None
    # A process that has run a task has less of its bound left.
    if max_memory is None:
        with _lock:
            waiting = _idle.get(kind)
            child = waiting.pop() if waiting else None
    child = child or Child(allow, threads, max_memory)
    try:
        answer = child.ask(request)
    except BaseException:
        child.close()
        raise
    if max_memory is None:
        with _lock:
            _idle.setdefault(kind, []).append(child)
    else:
        child.close()
    return answer


def _keep(folder: Path, name: str, content: bytes) -> None:
    """Keeps an input under its checksum, whole."""
    place = folder / name
    if place.exists():
        return
    if checksum(content) != name:
        raise Error(f"an input of the checksum {name} has another content")
    folder.mkdir(parents=True, exist_ok=True)
    handle, temporary = tempfile.mkstemp(dir=folder)
    with os.fdopen(handle, "wb") as file:
        file.write(content)
    os.replace(temporary, place)


def _tree(local: Path, names: dict[str, str]) -> Path:
    """Returns a folder with input files under their names."""
    place = local / "trees" / checksum(json.dumps(names, sort_keys=True).encode())
    if place.exists():
        return place
    place.parent.mkdir(parents=True, exist_ok=True)
    temporary = Path(tempfile.mkdtemp(dir=place.parent))
    for name, content in names.items():
        file = temporary / name
        if temporary not in Path(os.path.normpath(file)).parents:
            raise Error(f"{name}: is no name of an input")
        file.parent.mkdir(parents=True, exist_ok=True)
        try:
            os.link(local / "inputs" / content, file)
        except OSError:
            shutil.copyfile(local / "inputs" / content, file)
    try:
        os.rename(temporary, place)
    except OSError:
        # Another thread was faster.
        shutil.rmtree(temporary)
    return place
