"""Jobs, the command, and Dask clusters for tests."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any, Callable, Iterator

import numpy as np
import pytest

import facemill

ROOT = Path(__file__).resolve().parents[3]


def wavy(n: int, size: float) -> tuple[np.ndarray, np.ndarray]:
    """Returns a wavy square of n × n vertices about the origin."""
    at = np.linspace(-size / 2, size / 2, n)
    x, y = np.meshgrid(at, at, indexing="ij")
    vertices = np.stack([x, y, 0.3 * np.cos(6 * x / size)], axis=-1).reshape(-1, 3)
    a = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
    lower = np.stack([a, a + n, a + n + 1], axis=-1)
    upper = np.stack([a, a + n + 1, a + 1], axis=-1)
    return vertices, np.concatenate([lower, upper]).astype(np.uint32)


def small_job() -> tuple[dict[str, Any], dict[str, bytes]]:
    """Returns a job that is planned in tenths of a second, and its files."""
    files = facemill.example_job("patch", 60.0)
    job = json.loads(files.pop("job.json"))
    del files["patch.obj"]
    files["part.obj"] = facemill.mesh_bytes("part.obj", *wavy(13, 24.0))
    setup, operation = job["setups"][0], job["operations"][0]
    setup["meshes"][0]["file"] = "part.obj"
    operation["search"]["mode"] = {"fixed": {"lead_deg": 8.0, "lean_deg": 0.0}}
    operation["tolerances"].update(cusp_mm=0.2, max_step_over_mm=4.0, max_step_mm=2.0)
    return job, files


def write_job(folder: Path) -> Path:
    """Writes the small job into a folder; returns its job file."""
    job, files = small_job()
    folder.mkdir(parents=True, exist_ok=True)
    for name, content in files.items():
        (folder / name).write_bytes(content)
    (folder / "job.json").write_text(json.dumps(job))
    return folder / "job.json"


def write_batch(folder: Path, tasks: int, fine: bool = False) -> Path:
    """Writes the small job and a batch of so many variants of it."""
    write_job(folder)
    step = [0.25 + 0.001 * k if fine else 2.0 + 0.01 * k for k in range(tasks)]
    axis = {"name": "step", "values": {"each": {"key": "operations[0].tolerances.max_step_mm", "values": step}}}
    batch = {"format": "facemill-batch/1", "jobs": {"sweep": {"job": "job.json", "axes": [axis]}}}
    (folder / "batch.json").write_text(json.dumps(batch))
    return folder / "batch.json"


def results(out: Path) -> dict[str, bytes]:
    """Returns all files of results, without times."""
    files = (file for file in (out / "tasks").rglob("*") if file.is_file() and file.name != "times.json")
    return {str(file.relative_to(out)): file.read_bytes() for file in files}


@pytest.fixture(scope="session")
def command() -> Path:
    """The program ``facemill`` of this repository."""
    place = Path(os.environ.get("FACEMILL_BINARY", ROOT / "target/debug/facemill"))
    if not place.exists():
        pytest.skip(f"{place} is not built: cargo build -p facemill")
    return place


def run_command(command: Path, *arguments: Any) -> subprocess.CompletedProcess[str]:
    """Runs the program."""
    return subprocess.run([command, *map(str, arguments)], capture_output=True, text=True)


class Cluster:
    """Scheduler and workers of Dask, each a process, on the loopback interface."""

    def __init__(self, folder: Path, environment: dict[str, str] | None = None) -> None:
        self.folder = folder
        self._environment = environment or {}
        self._started = 0
        self.workers: list[subprocess.Popen[bytes]] = []
        self.scheduler: subprocess.Popen[bytes]
        self.address = ""
        self.start_scheduler()

    def start_scheduler(self) -> None:
        """Starts a scheduler on a free port."""
        self.scheduler = self._start(
            "scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--no-jupyter", log="scheduler.log"
        )
        log = self.folder / "scheduler.log"
        found = wait_for(lambda: re.search(r"Scheduler at:\s+(tcp://127\.0\.0\.1:\d+)", log.read_text()))
        self.address = found.group(1)

    def start_worker(self) -> subprocess.Popen[bytes]:
        """Starts a worker of one thread."""
        name = f"worker-{self._started}"
        self._started += 1
        worker = self._start(
            "worker", self.address, "--host", "127.0.0.1", "--nthreads", "1", "--no-nanny", "--no-dashboard",
            "--local-directory", str(self.folder / name), "--memory-limit", "0", log=f"{name}.log",
        )
        self.workers.append(worker)
        return worker

    def _start(self, *arguments: str, log: str) -> subprocess.Popen[bytes]:
        output = open(self.folder / log, "wb")
        environment = {**os.environ, **self._environment, "DASK_DISTRIBUTED__COMM__TIMEOUTS__CONNECT": "5s"}
        command = [sys.executable, "-m", "distributed.cli.dask_" + arguments[0], *arguments[1:]]
        return subprocess.Popen(command, stdout=output, stderr=output, env=environment)

    def close(self) -> None:
        """Ends all processes of the cluster."""
        for process in [*self.workers, self.scheduler]:
            if process.poll() is None:
                process.kill()
            process.wait()


@pytest.fixture
def cluster(tmp_path: Path) -> Iterator[Cluster]:
    """A scheduler without workers."""
    pytest.importorskip("distributed", reason="the package distributed is not installed: pip install distributed")
    folder = tmp_path / "cluster"
    folder.mkdir()
    made = Cluster(folder)
    yield made
    made.close()


def wait_for(condition: Callable[[], Any], seconds: float = 60.0) -> Any:
    """Waits until a condition has a value that counts as true, and returns it."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        value = condition()
        if value:
            return value
        time.sleep(0.02)
    raise AssertionError(f"nothing came of {condition} in {seconds} s")


KILL = signal.SIGKILL
