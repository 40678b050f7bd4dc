"""CAD files as meshes: measured chords against closed forms, open seams, units. Needs gmsh."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, Callable

import numpy as np
import pytest

import facemill
from facemill import cad

gmsh = pytest.importorskip("gmsh", reason="gmsh is not installed: pip install gmsh")


def write(path: Path, make: Callable[[Any], Any]) -> Path:
    """Writes a CAD file of shapes."""
    gmsh.initialize()
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        make(gmsh.model.occ)
        gmsh.model.occ.synchronize()
        gmsh.write(str(path))
    finally:
        gmsh.finalize()
    return path


def drilled(occ: Any) -> None:
    block, hole = occ.addBox(0, 0, 0, 40, 30, 10), occ.addCylinder(20, 15, -1, 0, 0, 12, 6)
    occ.cut([(3, block)], [(3, hole)])


def tube(occ: Any) -> None:
    occ.extrude([(1, occ.addCircle(0, 0, 0, 10))], 0, 0, 25)


def off_sphere(mesh: cad.CadMesh, radius: float, n: int = 30) -> float:
    """Returns the largest distance of triangles from a sphere, by many points."""
    a, b, c = (mesh.vertices[mesh.triangles[:, k]] for k in range(3))
    worst = 0.0
    for i in range(n + 1):
        for j in range(n + 1 - i):
            points = a + i / n * (b - a) + j / n * (c - a)
            worst = max(worst, float(np.abs(np.linalg.norm(points, axis=1) - radius).max()))
    return worst


@pytest.mark.parametrize("wanted", [0.5, 0.05])
def test_the_chord_of_a_ball_is_the_distance_from_the_sphere(tmp_path: Path, wanted: float) -> None:
    mesh = cad.tessellate(write(tmp_path / "ball.step", lambda occ: occ.addSphere(3, 4, 5, 20)), wanted)
    moved = cad.CadMesh(mesh.vertices - [3, 4, 5], mesh.triangles, mesh.surfaces, 0.0, 0, ())
    true = off_sphere(moved, 20.0)
    # 1/35 for what is between the points, and rounded up to three digits.
    assert true <= mesh.chord_mm <= true * 1.04
    assert mesh.chord_mm <= wanted and mesh.is_closed
    assert np.abs(np.linalg.norm(moved.vertices, axis=1) - 20).max() < 1e-6


def test_the_chord_is_measured_and_not_that_of_the_request(tmp_path: Path) -> None:
    path = write(tmp_path / "ball.step", lambda occ: occ.addSphere(0, 0, 0, 20))
    coarse = cad.tessellate(path, 1000.0)
    true = off_sphere(coarse, 20.0)
    assert 0.1 < true <= coarse.chord_mm <= 1.04 * true
    flat = cad.tessellate(write(tmp_path / "box.step", lambda occ: occ.addBox(0, 0, 0, 10, 20, 30)), 0.01)
    assert flat.chord_mm < 1e-9 and flat.is_closed


def test_a_chord_out_of_reach_is_an_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write(tmp_path / "ball.step", lambda occ: occ.addSphere(0, 0, 0, 20))
    monkeypatch.setattr(cad, "_MOST_TRIANGLES", 5000)
    with pytest.raises(facemill.Error, match=r"ball.step: \d+ triangles keep 0\.\d+ mm, not 0.001: give a larger chord"):
        cad.tessellate(path, 0.001)


def test_a_mesh_beside_its_surface_is_found_out(tmp_path: Path) -> None:
    """Half of the triangles of a ball are away: the surface shows it, the triangles do not."""
    path = write(tmp_path / "ball.step", lambda occ: occ.addSphere(0, 0, 0, 20))
    gmsh.initialize()
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.model.occ.importShapes(str(path))
        gmsh.model.occ.synchronize()
        gmsh.option.setNumber("Mesh.MeshSizeMax", 5.0)
        gmsh.model.mesh.generate(2)
        nodes, at, _ = gmsh.model.mesh.getNodes(returnParametricCoord=False)
        index = {int(tag): k for k, tag in enumerate(nodes)}
        _, corners = gmsh.model.mesh.getElementsByType(2)
        places = at.reshape(-1, 3)[[index[int(tag)] for tag in corners]].reshape(-1, 3, 3)
        (_, face), = gmsh.model.getEntities(2)
        whole, _ = cad._chord_of_face(gmsh, face, places)
        half, _ = cad._chord_of_face(gmsh, face, places[places.mean(axis=1)[:, 2] < 0])
    finally:
        gmsh.finalize()
    assert whole < 1.0 and half > 15.0


def test_solids_are_closed_and_turned_outward(tmp_path: Path) -> None:
    mesh = cad.tessellate(write(tmp_path / "drilled.step", drilled), 0.02)
    a, b, c = (mesh.vertices[mesh.triangles[:, k]] for k in range(3))
    volume = np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6
    exact = 40 * 30 * 10 - np.pi * 36 * 10
    assert mesh.is_closed and 0 < volume - exact < 2 * np.pi * 6 * 10 * mesh.chord_mm
    assert 0 < mesh.chord_mm <= 0.02 and set(mesh.surfaces.tolist()) == set(range(1, 8))
    radii = np.linalg.norm(mesh.vertices[:, :2] - [20, 15], axis=1)
    assert radii.min() == pytest.approx(6, abs=1e-6)


def test_open_seams_have_length_and_place(tmp_path: Path) -> None:
    mesh = cad.tessellate(write(tmp_path / "tube.step", tube), 0.05)
    assert not mesh.is_closed and len(mesh.seams) == 2
    for seam in mesh.seams:
        assert 2 * np.pi * 10 * 0.98 < seam.length_mm < 2 * np.pi * 10
        x, y, z = seam.at
        assert np.hypot(x, y) == pytest.approx(10, abs=1e-6) and min(abs(z), abs(z - 25)) < 1e-6


def test_units_of_step_and_iges_become_mm(tmp_path: Path) -> None:
    path = write(tmp_path / "box.step", lambda occ: occ.addBox(0, 0, 0, 10, 20, 30))
    text = path.read_text()
    assert "SI_UNIT(.MILLI.,.METRE.)" in text
    path.write_text(text.replace("SI_UNIT(.MILLI.,.METRE.)", "SI_UNIT(.CENTI.,.METRE.)"))
    assert np.ptp(cad.tessellate(path, 0.1).vertices, axis=0) == pytest.approx([100, 200, 300])
    path = write(tmp_path / "box.igs", lambda occ: occ.addBox(0, 0, 0, 10, 20, 30))
    assert np.ptp(cad.tessellate(path, 0.1).vertices, axis=0) == pytest.approx([10, 20, 30])
    text = path.read_text()
    assert ",2,2HMM," in text
    path.write_text(text.replace(",2,2HMM,", ",1,2HIN,"))
    assert np.ptp(cad.tessellate(path, 0.1).vertices, axis=0) == pytest.approx([254, 508, 762])


def test_faces_of_iges_are_sewn_on_request(tmp_path: Path) -> None:
    path = write(tmp_path / "box.igs", lambda occ: occ.addBox(0, 0, 0, 10, 20, 30))
    assert sum(seam.length_mm for seam in cad.tessellate(path, 0.1).seams) > 100
    assert cad.tessellate(path, 0.1, sew_mm=0.001).is_closed


def test_the_command_writes_mesh_and_chord(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    step, obj, job = (tmp_path / name for name in ("drilled.step", "part.obj", "job.json"))
    write(step, drilled)
    files = facemill.example_job("patch")
    of_mesh = json.loads(files["job.json"])
    of_mesh["setups"][0]["meshes"][0]["file"] = "./part.obj"
    job.write_text(json.dumps(of_mesh))
    assert cad.main([str(step), str(obj), "--chord-mm", "0.02", "--job", str(job)]) == 0
    said = capsys.readouterr().out
    assert "closed: every edge has two triangles" in said and "mesh_chord_mm is" in said
    first = obj.read_bytes()
    mesh = cad.tessellate(step, 0.02)
    assert first == cad.obj_bytes(mesh) and first.count(b"\ng surface_") == 7
    changed = json.loads(job.read_text())
    assert [o["tolerances"]["mesh_chord_mm"] for o in changed["operations"]] == [mesh.chord_mm]
    # The rest of the job is as it was, and the mesh is one for a job.
    of_mesh["operations"][0]["tolerances"]["mesh_chord_mm"] = mesh.chord_mm
    assert changed == of_mesh
    vertices, triangles = facemill.read_mesh(obj)
    assert len(vertices) == len(mesh.vertices) and len(triangles) == len(mesh.triangles)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["drilled.step", "job.json", "part.obj"]


def test_only_operations_on_the_mesh_get_the_chord() -> None:
    def job(*files: str) -> dict[str, Any]:
        meshes = [{"file": file, "role": "drive" if k == 0 else "part"} for k, file in enumerate(files)]
        meshes.append({"file": "vice.obj", "role": "fixture"})
        return {
            "setups": [{"name": "top", "meshes": meshes}, {"name": "other", "meshes": [{"file": "b.obj", "role": "drive"}]}],
            "operations": [
                {"name": "one", "setup": "top", "tolerances": {"mesh_chord_mm": 0.05}},
                {"name": "two", "setup": "other", "tolerances": {"mesh_chord_mm": 0.01}},
            ],
        }

    def chords(chord: float, *files: str) -> tuple[list[float], list[str]]:
        changed, said = cad.with_chord(job(*files), chord, lambda file: file == "a.obj")
        return [o["tolerances"]["mesh_chord_mm"] for o in changed["operations"]], said

    # All meshes are this one: its chord, said if lower. Fixtures have no say.
    found, said = chords(0.02, "a.obj", "a.obj")
    assert found == [0.02, 0.01] and said[0] == "operation 'one': mesh_chord_mm is 0.02, was 0.05"
    assert said[1].startswith("operation 'two' stays at mesh_chord_mm 0.01: none")
    # Others are among them: the larger one.
    found, said = chords(0.02, "a.obj", "b.obj")
    assert found == [0.05, 0.01] and said[0].startswith("operation 'one' stays at mesh_chord_mm 0.05: other")
    found, said = chords(0.2, "a.obj", "b.obj")
    assert found == [0.2, 0.01] and "is 0.2, was 0.05" in said[0]
    assert chords(0.2, "b.obj")[0] == [0.05, 0.01]
    with pytest.raises(facemill.Error, match=r"operations\[0\].setup: no setup has the name 'nowhere'"):
        wrong = job("a.obj")
        wrong["operations"][0]["setup"] = "nowhere"
        cad.with_chord(wrong, 0.1, lambda file: True)


def volume_of(mesh: cad.CadMesh) -> float:
    a, b, c = (mesh.vertices[mesh.triangles[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)


@pytest.mark.parametrize("beside", [False, True])
def test_a_hollow_stays_a_hollow(tmp_path: Path, beside: bool) -> None:
    def hollow(occ: Any) -> None:
        box, ball = occ.addBox(0, 0, 0, 40, 40, 40), occ.addSphere(20, 20, 20, 15)
        occ.cut([(3, box)], [(3, ball)])
        if beside:
            occ.addBox(60, 0, 0, 10, 10, 10)

    mesh = cad.tessellate(write(tmp_path / "hollow.step", hollow), 0.05)
    exact = 40.0**3 - 4 / 3 * np.pi * 15**3 + (1000 if beside else 0)
    assert mesh.is_closed and 0 <= volume_of(mesh) - exact < 4 * np.pi * 15**2 * mesh.chord_mm


def test_edges_of_more_than_two_triangles_are_no_closed_surface(tmp_path: Path) -> None:
    def touching(occ: Any) -> None:
        first, second = occ.addBox(0, 0, 0, 10, 10, 10), occ.addBox(10, 10, 0, 10, 10, 10)
        occ.fragment([(3, first)], [(3, second)])

    mesh = cad.tessellate(write(tmp_path / "touching.step", touching), 0.1)
    assert not mesh.seams and mesh.crowded > 0 and not mesh.is_closed
    assert f"{mesh.crowded} edges with more than two triangles" in cad.summary(mesh)
    assert "closed" not in cad.summary(mesh)


@pytest.mark.parametrize(("ending", "unit"), [(".stl", 1.0), (".glb", 1000.0)])
def test_vertices_are_those_of_the_file(tmp_path: Path, ending: str, unit: float) -> None:
    path = write(tmp_path / "ball.step", lambda occ: occ.addSphere(30000.1, 4, 5, 20))
    mesh = cad.tessellate(path, 0.5, ending=ending)
    assert ((mesh.vertices / unit).astype(np.float32).astype(np.float64) * unit == mesh.vertices).all()
    moved = cad.CadMesh(mesh.vertices - [30000.1, 4, 5], mesh.triangles, mesh.surfaces, 0.0, 0, ())
    # Numbers of 32 bits near 30 m are 0.002 mm apart: vertices are off the ball, and measured there.
    off = np.abs(np.linalg.norm(moved.vertices, axis=1) - 20).max()
    assert off > 1e-4 and off_sphere(moved, 20.0) <= mesh.chord_mm <= 0.5
    target = tmp_path / f"ball{ending}"
    assert cad.main([str(path), str(target), "--chord-mm", "0.5"]) == 0
    vertices, _ = facemill.read_mesh(target)
    assert np.abs(np.sort(vertices, axis=0)[[0, -1]] - np.sort(mesh.vertices, axis=0)[[0, -1]]).max() < 1e-9


def test_a_mesh_too_large_is_refused_before_it_is_measured(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write(tmp_path / "ball.step", lambda occ: occ.addSphere(0, 0, 0, 20))
    monkeypatch.setattr(cad, "_MOST_TRIANGLES", 50)
    monkeypatch.setattr(cad, "_measured", lambda *_: pytest.fail("it is measured"))
    with pytest.raises(facemill.Error, match=r"ball.step: a mesh for a chord of 1e-06 mm has \d+ triangles, more than 50"):
        cad.tessellate(path, 1e-6)


def test_wrong_input_is_named_with_exit_code_2(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    good = write(tmp_path / "box.step", lambda occ: occ.addBox(0, 0, 0, 10, 20, 30))
    (tmp_path / "junk.step").write_bytes(b"ISO-10303-21;\n\x00\xff")
    (tmp_path / "part.stl").write_text("solid\nendsolid\n")
    (tmp_path / "job.json").write_text('{"operations": [{}], "setups": []}')
    (tmp_path / "text.json").write_text("{")
    job = ["--job", str(tmp_path / "job.json")]
    for name, mesh, more, message in (
        ("none.step", "a.obj", [], "none.step: cannot be read"),
        ("part.stl", "a.obj", [], "part.stl: is none of"),
        ("junk.step", "a.obj", [], "junk.step: gmsh does not read it"),
        ("box.step", "a.ply", [], "a.ply: must end in .obj"),
        ("box.step", "no/a.obj", [], "a.obj: cannot be written"),
        ("box.step", "a.obj", job, "job.json: operations[0].tolerances: is missing"),
        ("box.step", "a.obj", ["--job", str(tmp_path / "text.json")], "text.json: is no JSON"),
        ("box.step", "a.obj", ["--chord-mm", "nan"], "chord_mm is nan"),
        ("box.step", "a.obj", ["--sew-mm", "-1"], "sew_mm is -1"),
    ):
        arguments = [str(tmp_path / name), str(tmp_path / mesh), "--chord-mm", "0.1", *more]
        assert cad.main(arguments) == 2, name
        assert message in capsys.readouterr().err
        assert not (tmp_path / "a.obj").exists()
    assert good.exists()
