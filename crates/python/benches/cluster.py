"""Costs of batches on a cluster of this machine: processor time of client and scheduler for each task.

``python benches/cluster.py trivial 400`` runs trivial tasks (each verifies a program of one block) on two
workers, with 1 and 100 of them in a chunk, or with the sizes that follow; ``python benches/cluster.py speed
40`` runs the same plans on one worker and on two, ``python benches/cluster.py disk 40`` files results alone.
"""

from __future__ import annotations

import io
import json
import os
import statistics
import sys
import tarfile
import tempfile
import time
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

import facemill.batch
from conftest import Cluster, small_job, wavy, write_batch
from facemill import _facemill
from facemill.batch._worker import run_chunk
from test_batch import chunk_of

PROGRAM = "%\nG21 G90 G94\nG54\nG0 G43 X0. Y0. Z100. B0. C0. H1\nM30\n%\n"


def processor_s(process: int) -> float:
    """Returns the processor time of a process, s."""
    fields = Path(f"/proc/{process}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def peak_mib(process: int) -> float:
    """Returns the largest memory of a process, MiB."""
    lines = Path(f"/proc/{process}/status").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("VmHWM")) / 1024


def trivial_batch(folder: Path, tasks: int) -> Path:
    """Writes a batch of tasks that take milliseconds."""
    job, files = small_job()
    files["part.obj"] = facemill.mesh_bytes("part.obj", *wavy(3, 24.0))
    folder.mkdir()
    for name, content in files.items():
        (folder / name).write_bytes(content)
    (folder / "job.json").write_text(json.dumps(job))
    (folder / "program.nc").write_text(PROGRAM)
    step = [0.5 + 1e-5 * k for k in range(tasks)]
    axis = {"name": "step", "values": {"each": {"key": "operations[0].tolerances.max_step_mm", "values": step}}}
    batch = {
        "format": "facemill-batch/1",
        "jobs": {"sweep": {"job": "job.json", "axes": [axis]}},
        "task": {"verify": {"programs": "program.nc"}},
    }
    (folder / "batch.json").write_text(json.dumps(batch))
    return folder / "batch.json"


def timed(batch: Path, out: Path, cluster: Cluster, **options: Any) -> dict[str, float]:
    """Runs a batch; returns wall time and processor times, s."""
    scheduler = cluster.scheduler.pid
    before = processor_s(scheduler), processor_s(os.getpid()), time.monotonic()
    summary = facemill.batch.run(batch, out, cluster.address, **options)
    assert not summary.failures and len(summary.exit_codes) == summary.tasks, summary.failures
    inside = [json.loads(f.read_bytes())["wall_s"] for f in (out / "tasks").glob("*/times.json")]
    return {
        "tasks": len(inside),
        "wall": time.monotonic() - before[2],
        "scheduler": processor_s(scheduler) - before[0],
        "client": processor_s(os.getpid()) - before[1],
        "in_tasks": sum(inside),
        "median_task": statistics.median(inside),
        "scheduler_mib": peak_mib(scheduler),
    }


def idle_share(cluster: Cluster, seconds: float = 5.0) -> float:
    """Returns the share of a processor that the scheduler takes with workers that have nothing to do."""
    before = processor_s(cluster.scheduler.pid)
    time.sleep(seconds)
    return (processor_s(cluster.scheduler.pid) - before) / seconds


def trivial(tasks: int, folder: Path, chunks: tuple[int, ...] = (1, 100)) -> None:
    """Prints costs of trivial tasks for two sizes of chunks, and the costs of a chunk and a task that follow."""
    batch = trivial_batch(folder / "batch", tasks)
    cluster = Cluster(folder)
    try:
        for _ in range(2):
            cluster.start_worker()
        time.sleep(3.0)
        idle = idle_share(cluster)
        for shared in (False, True):
            costs = []
            for chunk in chunks:
                t = timed(batch, folder / f"out-{chunk}-{shared}", cluster, chunk=chunk, shared=shared)
                each = 1000 / t["tasks"]
                client, scheduler = each * t["client"], each * (t["scheduler"] - idle * t["wall"])
                costs.append((client, scheduler))
                outside = each * (2 * t["wall"] - t["in_tasks"])
                print(
                    f"shared {shared}, chunk {chunk}: wall {t['wall']:.1f} s; a worker's time outside of tasks "
                    f"{outside:.1f} ms a task; processor time a task: client {client:.3f} ms, "
                    f"scheduler {scheduler:.3f} ms; scheduler {t['scheduler_mib']:.0f} MiB",
                    flush=True,
                )
            if len(chunks) == 1:
                continue
            (client, scheduler), (client_many, scheduler_many) = costs[0], costs[-1]
            share = 1 / chunks[0] - 1 / chunks[-1]
            for name, one, many in [("client", client, client_many), ("scheduler", scheduler, scheduler_many)]:
                chunk_ms = (one - many) / share
                print(f"  {name}: {chunk_ms:.2f} ms a chunk, {one - chunk_ms / chunks[0]:.3f} ms a task", flush=True)
    finally:
        cluster.close()


def disk(tasks: int, folder: Path) -> None:
    """Prints the time in which a client files a result."""
    chunk, inputs = chunk_of(trivial_batch(folder / "batch", tasks))
    files: dict[str, list[tuple[str, bytes]]] = {}
    with tarfile.open(fileobj=io.BytesIO(run_chunk(chunk, inputs, folder / "worker"))) as archive:
        for member in archive:
            key, _, name = member.name.partition("/")
            content = archive.extractfile(member)
            assert content is not None
            files.setdefault(key, []).append((name, content.read()))
    began = time.monotonic()
    for key, result in files.items():
        _facemill.file_result(folder / "out", key, result)
    print(f"{1000 * (time.monotonic() - began) / tasks:.1f} ms a result of {len(result)} files")


def speed(tasks: int, folder: Path) -> None:
    """Prints times of the same plans on one worker and on two."""
    batch = write_batch(folder / "batch", tasks, fine=True)
    cluster = Cluster(folder)
    try:
        walls = []
        for workers in (1, 2):
            cluster.start_worker()
            time.sleep(2.0)
            t = timed(batch, folder / f"out-{workers}", cluster)
            over = (workers * t["wall"] - t["in_tasks"]) / tasks
            walls.append(t["wall"])
            print(
                f"{workers} workers: {t['wall']:.1f} s; median of a task {t['median_task']:.2f} s; "
                f"a worker's time outside of tasks {1000 * over:.0f} ms a task",
                flush=True,
            )
        print(f"two workers are {walls[0] / walls[1]:.2f} times as fast as one")
    finally:
        cluster.close()


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as place:
        name, tasks, *chunks = sys.argv[1:]
        if name in ("speed", "disk"):
            {"speed": speed, "disk": disk}[name](int(tasks), Path(place))
        else:
            trivial(int(tasks), Path(place), tuple(map(int, chunks)) or (1, 100))
