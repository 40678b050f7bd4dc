"""Plans, verification, feeds, machines, poses and meshes."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import facemill
from conftest import ROOT, run_command, small_job, wavy, write_job
from facemill import Verdict


def random_joints(machine: facemill.Machine, n: int) -> np.ndarray:
    """Returns joint values within the limits, and within half a turn."""
    low, high = machine.limits.T
    is_linear = np.isin([name[0] for name in machine.axis_names], ["X", "Y", "Z", "U", "V", "W"])
    half = np.where(is_linear, np.inf, 170.0)
    low, high = np.maximum(low, -half), np.minimum(high, half)
    return np.random.default_rng(1).uniform(low, high, (n, len(low)))


def heads(name: str) -> bool:
    return not name.startswith("dual")


@pytest.mark.parametrize("name", [name for name in facemill.presets() if heads(name)])
def test_inverse_solutions_lead_to_the_poses_of_forward(name: str) -> None:
    machine = facemill.Machine(name)
    positions, axes = machine.forward(random_joints(machine, 300), 120.0)
    np.testing.assert_allclose(np.linalg.norm(axes, axis=1), 1.0, atol=1e-12)
    joints = machine.inverse(positions, 3.0 * axes, 120.0)
    assert not np.isnan(joints).any(), "each pose is that of joints within the limits"
    reached = machine.forward(joints, 120.0)
    np.testing.assert_allclose(reached[0], positions, atol=1e-8)
    np.testing.assert_allclose(reached[1], axes, atol=1e-11)


def test_a_head_that_tilts_moves_the_tip_on_a_circle() -> None:
    machine = facemill.Machine("head-b-table-c")
    assert machine.axis_names == ["X", "Y", "Z", "B", "C"]
    # The B axis lies 350 mm above the spindle nose, the tip 120 mm below it.
    tilt = np.radians([0.0, 30.0, 60.0])
    joints = np.zeros((3, 5))
    joints[:, 3] = np.degrees(tilt)
    positions, axes = machine.forward(joints, 120.0)
    np.testing.assert_allclose(axes, np.stack([np.sin(tilt), 0 * tilt, np.cos(tilt)], axis=1), atol=1e-12)
    pivot = np.array([0.0, 0.0, 350.0])
    np.testing.assert_allclose(positions, pivot - 470.0 * axes, atol=1e-9)
    # Axis C turns the tool about the workpiece, as the words of a program count it.
    one = machine.forward([0, 0, 0, 30, 90], 120.0)
    turn = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]])
    np.testing.assert_allclose(one[0], turn @ positions[1], atol=1e-9)
    np.testing.assert_allclose(one[1], turn @ axes[1], atol=1e-12)


def test_inverse_stays_near_and_marks_poses_out_of_reach() -> None:
    machine = facemill.Machine("head-b-table-c")
    positions, axes = machine.forward([[100, 0, 500, -20, 40]], 120.0)
    near = machine.inverse(positions, axes, 120.0, near=[100, 0, 500, -20, 400])
    np.testing.assert_allclose(near, [[100, 0, 500, -20, 400]], atol=1e-9)
    far = machine.inverse([[0, 0, 9000], positions[0]], [[0, 0, 1], axes[0]], 120.0)
    assert np.isnan(far[0]).all() and not np.isnan(far[1]).any()


def test_wrong_arrays_are_refused() -> None:
    machine = facemill.Machine("head-b-table-c")
    with pytest.raises(facemill.Error, match="joints: must be an array of 5 columns, has the shape"):
        machine.forward(np.zeros((2, 4)))
    with pytest.raises(facemill.Error, match="same number of rows"):
        machine.inverse(np.zeros((2, 3)), np.ones((3, 3)))
    with pytest.raises(facemill.Error, match="axes: row 1 has no direction"):
        machine.inverse(np.zeros((2, 3)), [[0, 0, 1], [0, 0, 0]])
    with pytest.raises(facemill.Error, match="presets are"):
        facemill.Machine("no-such-machine")
    with pytest.raises(facemill.Error, match="two heads"):
        facemill.Machine("dual-c-horizontal-xyzb")


def test_a_plan_has_the_bytes_of_the_command(tmp_path: Path, command: Path) -> None:
    job = write_job(tmp_path / "job")
    out = tmp_path / "out"
    done = run_command(command, "plan", job, "--out", out, "--quiet", "--certificates", "--no-html")
    report = facemill.plan(job, certificates=True)
    assert report.exit_code == done.returncode
    written = {file.name: file.read_bytes() for file in out.iterdir() if file.name != "timings.json"}
    assert report.files == written
    assert report.program.encode() == written["program.nc"]
    assert report.to_dict() == json.loads(written["report.json"])
    assert report.totals["cc_points"] > 0 and report.totals == report.to_dict()["totals"]
    report.write(tmp_path / "again")
    assert (tmp_path / "again/program.nc").read_bytes() == written["program.nc"]


def test_a_job_of_values_is_planned_as_one_of_files(tmp_path: Path) -> None:
    job, files = small_job()
    path = write_job(tmp_path)
    program = facemill.plan(job, files=files, verify=False).program
    assert program == facemill.plan(path, verify=False).program
    in_folder = facemill.plan(job, folder=tmp_path, verify=False)
    assert program == in_folder.program and not in_folder.verified
    # A setting of a path does the same as a change of the dict.
    coarse = facemill.plan(path, verify=False, settings={"operations[0].tolerances.max_step_mm": 3.0})
    job["operations"][0]["tolerances"]["max_step_mm"] = 3.0
    changed = facemill.plan(job, files=files, verify=False)
    assert [line for line in coarse.program.splitlines() if line[:1] != "("] == [
        line for line in changed.program.splitlines() if line[:1] != "("
    ]
    assert coarse.program != program


def test_wrong_jobs_raise_with_file_and_field(tmp_path: Path) -> None:
    job, files = small_job()
    job["operations"][0]["tolerances"]["gouge_mm"] = -1
    with pytest.raises(facemill.Error, match=r"job\.json: operations\[0\]\.tolerances\.gouge_mm") as caught:
        facemill.plan(job, files=files)
    assert isinstance(caught.value, ValueError) and caught.value.exit_code == 2
    path = write_job(tmp_path)
    (tmp_path / "tool.json").write_text(path.with_name("tool.json").read_text().replace("facemill-tool/1", "nothing/1"))
    with pytest.raises(facemill.Error, match=r"tool\.json: format"):
        facemill.plan(path)
    with pytest.raises(facemill.Error, match="cannot read .*nowhere"):
        facemill.plan(tmp_path / "nowhere/job.json")
    with pytest.raises(facemill.Error, match="none of index 7"):
        facemill.plan(*small_job()[:1], files=files, setup=7)


def test_verify_finds_a_cut_that_is_too_deep() -> None:
    job, files = small_job()
    program = facemill.plan(job, files=files).program
    clean = facemill.verify(program, job, files=files)
    assert clean.is_clean and clean.times["constant_cutting_s"] > 0
    # Every cut of the program 0.5 mm deeper: Z words of blocks with a feed.
    lines = program.splitlines()
    deep = [k for k, line in enumerate(lines) if line[:1] != "(" and "F" in line and "Z" in line]

    def lower(line: str) -> str:
        at = line.index("Z") + 1
        end = at
        while end < len(line) and line[end] in "-+.0123456789":
            end += 1
        return f"{line[:at]}{float(line[at:end]) - 0.5:.3f}{line[end:]}"

    for k in deep:
        lines[k] = lower(lines[k])
    found = facemill.verify("\n".join(lines), job, files=files)
    assert not found.is_clean and {f["kind"] for f in found.findings} >= {"gouge"}
    with pytest.raises(facemill.Error, match="nc.txt"):
        facemill.verify("G1 X)(", job, files=files, name="nc.txt")


def with_a_call(program: str) -> tuple[str, str]:
    """Returns the program with three of its cuts in the subprogram O2999, and this."""
    lines = program.splitlines()
    is_cut = [" X" in f" {line}" and not {"G0", "G00"} & set(line.split()) for line in lines]
    at = next(k for k in range(len(lines)) if all(is_cut[k : k + 6])) + 2
    main = [*lines[:at], "M98 P2999", *lines[at + 3 :]]
    sub = ["%", "O2999", *lines[at : at + 3], "M99", "%"]
    return "\n".join(main) + "\n", "\n".join(sub) + "\n"


def test_verify_expands_called_subprograms(tmp_path: Path) -> None:
    job, files = small_job()
    program = facemill.plan(job, files=files, verify=False).program
    main, sub = with_a_call(program)
    flat = facemill.verify(program, job, files=files).to_dict()
    # A call whose subprogram is nowhere stays, and is a finding.
    alone = facemill.verify(main, job, files=files)
    assert not alone.is_clean and alone.called_files == []
    (tmp_path / "O2999.nc").write_text(sub)
    for given in [{"O2999.nc": sub}, {"o2999.NC": sub.encode()}, tmp_path]:
        called = facemill.verify(main, job, files=files, subprograms=given)
        assert called.is_clean, called.findings
        values = called.to_dict()
        for key in ["times", "n_blocks", "cutting_length_mm", "findings"]:
            assert values[key] == flat[key], key
        [file] = called.called_files
        assert file["file"].lower() == "o2999.nc" and file["first_line"] == len(main.splitlines()) + 1
    # A subprogram in the text of the program needs no file: one that calls goes before the end.
    own = facemill.verify(main.rstrip("%\n") + "\n" + sub.removeprefix("%\n"), job, files=files)
    assert own.is_clean and own.called_files == []
    # A fault of the file has its line, which counts on behind the program.
    lines = sub.splitlines()
    lines[3] = "G1 Z-900."
    found = facemill.verify(main, job, files=files, subprograms={"O2999.nc": "\n".join(lines)})
    line = called.called_files[0]["first_line"] + 3
    assert line in {f["worst_line"] for f in found.findings if "worst_line" in f}
    with pytest.raises(facemill.Error, match="nc/O2999.nc.*line 4"):
        lines[3] = "G1 X)("
        facemill.verify(main, job, files=files, name="nc/main.nc", subprograms={"O2999.nc": "\n".join(lines)})
    with pytest.raises(facemill.Error, match="is no folder"):
        facemill.verify(main, job, files=files, subprograms=tmp_path / "O2999.nc")


PROGRAM = """\
G21 G90 G94
G54
G0 G43 X800. Y0. Z600. B0. C0. H1
G1 C2. F1000.
X790. C8. B1.
X700.
G0 Z900.
M30
"""


def test_feeds_move_the_tip_at_its_speed() -> None:
    machine = facemill.Machine("head-b-table-c")
    retimed = facemill.feedrate(PROGRAM, machine, tool_length=250.0)
    lines = retimed.program.splitlines()
    # 2 degrees at a radius of 800 mm are 28 mm of the tip, and count as 2.
    feed = float(lines[3].rsplit("F", 1)[1])
    assert feed == pytest.approx(1000.0 * 2.0 / (800.0 * np.radians(2.0)), abs=0.1)
    assert "F1000" in lines[5], "the table is at rest"
    slower = facemill.feedrate(PROGRAM, machine, 250.0, tip_feed=500.0)
    assert float(slower.program.splitlines()[3].rsplit("F", 1)[1]) == pytest.approx(feed / 2, abs=0.1)
    assert facemill.feedrate(PROGRAM, machine, 250.0, time_law=True).summary["time_law"] is not None
    with pytest.raises(facemill.Error, match="line 2"):
        facemill.feedrate(PROGRAM.replace("G54", "Q)"), machine, 250.0)


def test_feeds_of_called_subprograms_are_those_of_the_flat_program(tmp_path: Path) -> None:
    machine = facemill.Machine("head-b-table-c")
    main, sub = with_a_call(PROGRAM.replace("X700.", "X700.\nX695. C12.\nX690.\nX680. C20. B2.\nX670."))
    flat = facemill.feedrate(main.replace("M98 P2999\n", "".join(sub.splitlines(True)[2:-2])), machine, 250.0)
    assert flat.called_files == []
    (tmp_path / "O2999.nc").write_text(sub)
    for given in [{"O2999.nc": sub}, {"o2999.NC": sub.encode()}, tmp_path]:
        called = facemill.feedrate(main, machine, 250.0, subprograms=given)
        assert called.program == flat.program and "M98" not in called.program
        assert called.summary == flat.summary and called.summary["changed"] > 0
        [file] = called.called_files
        assert file["file"].lower() == "o2999.nc" and file["first_line"] == len(main.splitlines()) + 1
    # A subprogram in the text of the program needs no file.
    own = facemill.feedrate(main + sub.removeprefix("%\n"), machine, 250.0)
    assert own.called_files == [] and own.summary == flat.summary
    # A call that stays may move axes.
    with pytest.raises(facemill.Error, match="nc/main.nc.*line [0-9]+") as caught:
        facemill.feedrate(main, machine, 250.0, name="nc/main.nc")
    assert caught.value.exit_code == 2 and "M98 P2999" in str(caught.value)
    # Faults of reading and of feeds have file and line as written.
    lines = sub.splitlines()
    for wrong in ["G1 X)(", "G1 B500."]:
        lines[3] = wrong
        with pytest.raises(facemill.Error, match="nc/O2999.nc.*line 4"):
            facemill.feedrate(main, machine, 250.0, name="nc/main.nc", subprograms={"O2999.nc": "\n".join(lines)})
    with pytest.raises(facemill.Error, match="is no folder"):
        facemill.feedrate(main, machine, 250.0, subprograms=tmp_path / "O2999.nc")


def test_poses_are_judged_as_the_surface_lies() -> None:
    job, files = small_job()
    test = facemill.PoseTest(job, files=files)
    vertices, _ = wavy(13, 24.0)
    top = vertices[np.argmax(vertices[:, 2])]
    heights = np.array([20.0, 1.0, -0.5, -40.0, 9000.0])
    tips = top + heights[:, None] * np.array([0.0, 0.0, 1.0])
    verdicts = test.verdicts(tips, np.tile([0.0, 0.0, 1.0], (5, 1)))
    assert verdicts[:2].tolist() == [Verdict.FREE, Verdict.FREE]
    assert verdicts[2] == Verdict.GOUGE and verdicts[4] == Verdict.UNREACHABLE
    assert verdicts[3] != Verdict.FREE
    reasons = test.reasons(tips, np.tile([0.0, 0.0, 1.0], (5, 1)))
    assert reasons[0] is None and "gouges part" in reasons[2] and "axis Z" in reasons[4]
    with pytest.raises(facemill.Error, match="none named"):
        facemill.PoseTest(job, files=files, operation="nothing")


@pytest.mark.parametrize("ending", ["obj", "stl", "glb"])
def test_meshes_come_back_as_they_went(tmp_path: Path, ending: str) -> None:
    vertices, triangles = wavy(5, 8.0)
    path = tmp_path / f"mesh.{ending}"
    facemill.write_mesh(path, vertices, triangles)
    read, joined = facemill.read_mesh(path, unit="mm" if ending == "stl" else None)
    assert read.dtype == np.float64 and joined.dtype == np.uint32
    corners, expected = read[joined], vertices[triangles]
    order = np.lexsort(corners.mean(axis=1).round(3).T), np.lexsort(expected.mean(axis=1).round(3).T)
    # Of a triangle any corner may be the first.
    given, wanted = corners[order[0]].mean(axis=1), expected[order[1]].mean(axis=1)
    np.testing.assert_allclose(given, wanted, atol=1e-5)
    with pytest.raises(facemill.Error, match="indices"):
        facemill.write_mesh(path, vertices, triangles.astype(float))
    with pytest.raises(facemill.Error, match="ending"):
        facemill.write_mesh(tmp_path / "mesh.step", vertices, triangles)


def test_the_first_program_of_the_page_runs(tmp_path: Path) -> None:
    page = (ROOT / "docs/python.md").read_text()
    program = page.split("## First program")[1].split("```python\n")[1].split("```")[0]
    assert len(program.splitlines()) <= 10
    facemill.write_mesh(tmp_path / "part.stl", *wavy(9, 16.0))
    done = subprocess.run([sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "findings          0" in done.stdout
    assert (tmp_path / "out/part/program.nc").read_text().rstrip().endswith("%")


def test_ctrl_c_ends_a_plan(tmp_path: Path) -> None:
    path = write_job(tmp_path)
    text = (
        "import facemill, sys; print('begins', flush=True)\n"
        "try:\n    while True: facemill.plan(sys.argv[1], settings={'operations[0].tolerances.max_step_mm': 0.05})\n"
        "except KeyboardInterrupt: sys.exit(42)\n"
    )
    process = subprocess.Popen([sys.executable, "-c", text, path], stdout=subprocess.PIPE)
    assert process.stdout is not None and process.stdout.readline() == b"begins\n"
    time.sleep(0.5)
    process.send_signal(signal.SIGINT)
    assert process.wait(timeout=20) == 42


@pytest.mark.parametrize("call", ["test.verdicts(at, up)", "machine.inverse(at, up, tool_length=120)"])
def test_ctrl_c_ends_a_call_on_many_poses(tmp_path: Path, call: str) -> None:
    text = (
        "import facemill, numpy, sys\n"
        "test, machine = facemill.PoseTest(sys.argv[1]), facemill.Machine('head-b-table-c')\n"
        "n = 3_000_000\n"
        "at, up = numpy.tile([0.0, 0.0, 300.0], (n, 1)), numpy.tile([0.0, 0.1, 1.0], (n, 1))\n"
        "print('begins', flush=True)\n"
        f"try:\n    {call}\n"
        "except KeyboardInterrupt: sys.exit(42)\n"
    )
    process = subprocess.Popen([sys.executable, "-c", text, write_job(tmp_path)], stdout=subprocess.PIPE)
    assert process.stdout is not None and process.stdout.readline() == b"begins\n"
    time.sleep(0.3)
    sent = time.monotonic()
    process.send_signal(signal.SIGINT)
    assert process.wait(timeout=20) == 42 and time.monotonic() - sent < 1.5


def test_every_error_has_an_exit_code() -> None:
    assert facemill.Error("wrong").exit_code == 2
    with pytest.raises(facemill.Error) as raised:
        facemill.read_mesh("missing.obj")
    assert raised.value.exit_code == 2
