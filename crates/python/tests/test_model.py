"""The model of large clusters agrees with its simulation where one part is the slowest by far."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "benches"))

from simulate import Costs, Load, on_paper, simulated  # noqa: E402

COSTS = Costs(client_chunk=4e-3, client_task=1e-3, scheduler_chunk=3e-3, scheduler_task=1e-4)


@pytest.mark.parametrize(
    ("load", "slowest"),
    [
        (Load(workers=50, tasks=20_000, chunk=1, task_s=2.0), "workers"),
        (Load(workers=500, tasks=20_000, chunk=1, task_s=0.5), "client"),
        (Load(workers=500, tasks=40_000, chunk=10, task_s=1.0), "workers"),
    ],
)
def test_paper_and_simulation_agree(load: Load, slowest: str) -> None:
    paper, part = on_paper(load, COSTS)
    assert part == slowest
    assert simulated(load, COSTS) == pytest.approx(paper, rel=0.15)


def test_a_slow_scheduler_is_the_limit() -> None:
    costs = Costs(client_chunk=1e-4, client_task=1e-5, scheduler_chunk=5e-3, scheduler_task=0.0)
    load = Load(workers=1000, tasks=20_000, chunk=1, task_s=1.0)
    assert on_paper(load, costs) == (pytest.approx(100.0), "scheduler")
    assert simulated(load, costs) == pytest.approx(100.0, rel=0.05)
