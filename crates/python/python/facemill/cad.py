"""STEP and IGES files as meshes: ``python -m facemill.cad part.step part.obj --chord-mm 0.02``.

Gmsh (``pip install "facemill[cad]"``) reads the file and tessellates its surfaces. The distance of
the triangles from the surfaces is then measured, whatever the settings of Gmsh: points of the
triangles are projected onto their surface, and points of the surface onto the triangles. The larger
of both is ``chord_mm``, which belongs into ``mesh_chord_mm`` of a job. Edges that only one triangle
has are open seams; they are listed with their places.

``--job`` writes the chord to the operations whose drive and part meshes are the written file. Where
other meshes are among them, the larger of both chords stays.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import sys
import tempfile
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Callable, Sequence

from facemill import Error

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

#: Files that Gmsh reads by OpenCASCADE.
ENDINGS = (".step", ".stp", ".iges", ".igs", ".brep")

#: Subdivisions of a triangle's side for points that are projected: both the middles of sides and
#: the centre are among them.
_LATTICE = 6

#: Between these points a distance that falls off as a parabola from its largest value, as on a
#: surface of even curvature, exceeds those of the points by no more than this factor.
_BETWEEN = 1.0 / (1.0 - 1.0 / _LATTICE**2)

#: Length of the unit of vertices with 32 bits, mm, by the ending of the file.
_UNITS = {".stl": 1.0, ".glb": 1000.0}

#: Points along each parameter of a surface that are projected onto the triangles.
_GRID = 24

#: Rounds of refinement until the chord is kept.
_ROUNDS = 8

#: Elements of a full circle of the first round at most: it is fast whatever the chord.
_FIRST_TURNS = 24.0

#: Triangles beyond which a mesh is refused.
_MOST_TRIANGLES = 4_000_000


@dataclass(frozen=True)
class Seam:
    """A chain of edges that one triangle alone has."""

    #: Length of the chain, mm.
    length_mm: float
    #: A place on it, mm.
    at: tuple[float, float, float]
    #: Number of its edges.
    edges: int


@dataclass(frozen=True)
class CadMesh:
    """Mesh of a CAD file, with what was measured on it."""

    #: N × 3 float64, mm.
    vertices: NDArray[np.float64]
    #: M × 3 uint32, counter-clockwise as seen along the surfaces' normals.
    triangles: NDArray[np.uint32]
    #: Number of the CAD surface of each triangle, from 1.
    surfaces: NDArray[np.int64]
    #: Largest distance found between triangles and surfaces, mm, with 1/35 for what is between the
    #: points, rounded up to three digits. An estimate from :attr:`points` points.
    chord_mm: float
    #: Points at which it was measured.
    points: int
    #: Open seams, the longest first; none on a closed surface.
    seams: tuple[Seam, ...]
    #: Number of edges with more than two triangles; none on a closed surface.
    crowded: int = 0

    @property
    def is_closed(self) -> bool:
        """Whether every edge has two triangles, neither fewer nor more."""
        return not self.seams and not self.crowded


def tessellate(
    path: str | os.PathLike[str], chord_mm: float, sew_mm: float = 0.0, ending: str = ".obj"
) -> CadMesh:
    """Returns the surfaces of a STEP, IGES or BREP file as triangles that keep a chord.

    The size of triangles is refined until the measured chord is at most ``chord_mm``. Lengths of the
    file are converted to mm.

    :param chord_mm: largest distance between triangles and surfaces, above 0.
    :param sew_mm: faces whose edges are as near as this are sewn before, 0: none. Files of IGES mostly
        have faces that share no edges.
    :param ending: that of the mesh file to write: vertices are rounded to its numbers before the chord
        is measured, to 32 bits of mm for ``.stl`` and of m for ``.glb``.
    :raises Error: if Gmsh is not installed, the file cannot be read, has no surface, or the chord is
        not reached.
    """
    path = Path(path)
    if path.suffix.lower() not in ENDINGS:
        raise Error(f"{path}: is none of {', '.join(ENDINGS)}; meshes need no conversion")
    for name, value, least in (("chord_mm", chord_mm, 1e-6), ("sew_mm", sew_mm, 0.0)):
        if not least <= value <= 1000.0:
            raise Error(f"{name} is {value}: it must be from {least} to 1000")
    if not path.is_file():
        raise Error(f"{path}: cannot be read: there is no such file")
    try:
        import gmsh
    except ImportError as error:
        raise Error(f'gmsh is not installed ({error}): pip install "facemill[cad]"') from None
    gmsh.initialize(["gmsh", "-nopopup"], readConfigFiles=False, interruptible=False)
    try:
        return _tessellated(gmsh, path, chord_mm, sew_mm, _UNITS.get(ending.lower(), 0.0))
    finally:
        gmsh.finalize()


def _tessellated(gmsh: Any, path: Path, chord_mm: float, sew_mm: float, unit: float) -> CadMesh:
    for name, value in (
        ("General.Terminal", 0),
        ("General.NumThreads", 1),
        ("Mesh.MeshSizeFromPoints", 0),
        ("Mesh.MeshSizeExtendFromBoundary", 0),
        ("Mesh.Algorithm", 6),
        ("Mesh.RandomSeed", 1),
        ("Geometry.OCCSewFaces", 1 if sew_mm > 0.0 else 0),
        ("Geometry.Tolerance", sew_mm if sew_mm > 0.0 else 1e-8),
    ):
        gmsh.option.setNumber(name, value)
    # Readers of IGES convert to mm anyway, and refuse the option.
    is_iges = path.suffix.lower() in (".iges", ".igs")
    gmsh.option.setString("Geometry.OCCTargetUnit", "" if is_iges else "MM")
    try:
        gmsh.model.occ.importShapes(os.fspath(path), highestDimOnly=False)
        gmsh.model.occ.synchronize()
    except Exception as error:
        raise Error(f"{path}: gmsh does not read it: {error}") from None
    faces = sorted(tag for _, tag in gmsh.model.getEntities(2))
    if not faces:
        raise Error(f"{path}: has no surface")
    box = gmsh.model.getBoundingBox(-1, -1)
    size = max(b - a for a, b in zip(box[:3], box[3:]))
    # A chord of a circle: c = r (1 − cos(π/n)). A guess of r that is mostly too small: what is too
    # coarse is refined, what is too fine is not taken back. The guess knows nothing of the number of
    # surfaces, so the first mesh is a coarse one, from which that of the next one follows.
    turns = math.pi / math.acos(1.0 - min(0.5, 8.0 * chord_mm / max(size, chord_mm)))
    turns = min(turns, _FIRST_TURNS)
    for rounds_left in reversed(range(_ROUNDS)):
        gmsh.option.setNumber("Mesh.MeshSizeFromCurvature", math.ceil(turns))
        gmsh.option.setNumber("Mesh.MeshSizeMax", size / 4.0)
        try:
            gmsh.model.mesh.clear()
            gmsh.model.mesh.generate(2)
        except Exception as error:
            raise Error(f"{path}: gmsh does not mesh it: {error}") from None
        count = int(gmsh.option.getNumber("Mesh.NbTriangles"))
        if count > _MOST_TRIANGLES:
            raise Error(
                f"{path}: a mesh for a chord of {chord_mm} mm has {count} triangles, more than {_MOST_TRIANGLES}: "
                "give a larger chord, or split the file in the CAD program"
            )
        mesh = _measured(gmsh, path, faces, unit)
        if mesh.chord_mm <= chord_mm:
            return mesh
        growth = min(4.0, 1.05 * math.sqrt(mesh.chord_mm / chord_mm))
        if not rounds_left or len(mesh.triangles) * growth**2 > _MOST_TRIANGLES:
            raise Error(
                f"{path}: {len(mesh.triangles)} triangles keep {mesh.chord_mm} mm, not {chord_mm}: "
                "give a larger chord, or mend the surface in the CAD program"
            )
        turns *= growth
    raise AssertionError("the last round returns or raises")


def _measured(gmsh: Any, path: Path, faces: Sequence[int], unit: float) -> CadMesh:
    """Returns the present mesh with its chord and seams; vertices have 32 bits of a unit, if there is one."""
    import numpy as np

    nodes, coordinates, _ = gmsh.model.mesh.getNodes(returnParametricCoord=False)
    at = np.asarray(coordinates, dtype=np.float64).reshape(-1, 3)
    if unit:
        at = (at / unit).astype(np.float32).astype(np.float64) * unit
    index = np.zeros(int(nodes.max()) + 1, dtype=np.int64)
    index[nodes] = np.arange(len(nodes))
    worst, points = 0.0, 0
    parts = []
    for face in faces:
        _, corners = gmsh.model.mesh.getElementsByType(2, face)
        triangles = index[np.asarray(corners, dtype=np.int64)].reshape(-1, 3)
        if not len(triangles):
            raise Error(f"{path}: gmsh makes no triangles of surface {face}: mend it in the CAD program")
        found, count = _chord_of_face(gmsh, face, at[triangles])
        worst, points = max(worst, found), points + count
        parts.append(triangles)
    for _, curve in gmsh.model.getEntities(1):
        _, ends = gmsh.model.mesh.getElementsByType(1, curve)
        lines = at[index[np.asarray(ends, dtype=np.int64)].reshape(-1, 2)]
        on_lines = np.concatenate([lines[:, 0] + t * (lines[:, 1] - lines[:, 0]) for t in (0.25, 0.5, 0.75)])
        if len(on_lines):
            worst = max(worst, _off(gmsh, 1, curve, on_lines))
            points += len(on_lines)
    triangles = np.concatenate(parts)
    surfaces = np.repeat(np.arange(1, len(parts) + 1), [len(part) for part in parts])
    # Equal places are one vertex, as in a job; corners that meet leave an empty triangle.
    vertices, same = np.unique(at, axis=0, return_inverse=True)
    triangles = same.reshape(-1)[triangles]
    kept = (triangles != np.roll(triangles, 1, axis=1)).all(axis=1)
    triangles, surfaces = triangles[kept], surfaces[kept]
    used, compact = np.unique(triangles, return_inverse=True)
    vertices, triangles = vertices[used], compact.reshape(-1, 3)
    triangles = _oriented(vertices, triangles, surfaces)
    chord, seams = _up(_BETWEEN * worst), _seams(vertices, triangles)
    return CadMesh(vertices, triangles.astype(np.uint32), surfaces, chord, points, seams, _crowded(triangles))


def _chord_of_face(gmsh: Any, face: int, corners: NDArray[np.float64]) -> tuple[float, int]:
    """Returns the largest distance between a surface and its triangles, and the points tried."""
    import numpy as np

    steps = [
        (i / _LATTICE, j / _LATTICE) for i in range(_LATTICE + 1) for j in range(_LATTICE + 1 - i) if 0 < i + j
    ]
    worst = 0.0
    for s, t in steps:
        on_triangles = corners[:, 0] + s * (corners[:, 1] - corners[:, 0]) + t * (corners[:, 2] - corners[:, 0])
        worst = max(worst, _off(gmsh, 2, face, on_triangles))
    on_surface = _points_of_face(gmsh, face)
    if len(on_surface):
        worst = max(worst, float(_distances(on_surface, corners).max()))
    return worst, len(steps) * len(corners) + len(on_surface)


def _off(gmsh: Any, dimension: int, tag: int, points: NDArray[np.float64]) -> float:
    """Returns the largest distance of points from a curve or surface."""
    import numpy as np

    closest, _ = gmsh.model.getClosestPoint(dimension, tag, points.reshape(-1).tolist())
    return float(np.linalg.norm(np.asarray(closest).reshape(-1, 3) - points, axis=1).max())


def _points_of_face(gmsh: Any, face: int) -> NDArray[np.float64]:
    """Returns points of a surface inside of its borders, evenly over its parameters, off the mesh."""
    import numpy as np

    low, high = (np.asarray(bounds, dtype=np.float64) for bounds in gmsh.model.getParametrizationBounds(2, face))
    if not (np.isfinite(low).all() and np.isfinite(high).all()):
        return np.empty((0, 3))
    # Off the middles and ends, where nodes are.
    steps = (np.arange(_GRID) + 0.381966) / _GRID
    pairs = [(low[0] + u * (high[0] - low[0]), low[1] + v * (high[1] - low[1])) for u in steps for v in steps]
    inside = [pair for pair in pairs if gmsh.model.isInside(2, face, list(pair), parametric=True)]
    if not inside:
        return np.empty((0, 3))
    return np.asarray(gmsh.model.getValue(2, face, [value for pair in inside for value in pair])).reshape(-1, 3)


def _distances(points: NDArray[np.float64], corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """Returns the distance of each point from the nearest of the triangles."""
    import numpy as np

    centres = corners.mean(axis=1)
    reach = np.linalg.norm(corners - centres[:, None], axis=2).max(axis=1)
    out = np.empty(len(points))
    for k, point in enumerate(points):
        away = np.linalg.norm(centres - point, axis=1)
        first = np.argpartition(away, min(8, len(away) - 1))[:8]
        near = _to_triangles(point, corners[first]).min()
        left = np.flatnonzero(away - reach < near)
        out[k] = min(near, _to_triangles(point, corners[left]).min()) if len(left) else near
    return out


def _to_triangles(point: NDArray[np.float64], corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """Returns the distances of a point from triangles."""
    import numpy as np

    a = corners[:, 0]
    normal = np.cross(corners[:, 1] - a, corners[:, 2] - a)
    length = np.maximum(np.linalg.norm(normal, axis=1), np.finfo(float).tiny)
    height = np.einsum("ij,ij->i", point - a, normal) / length
    inside = np.ones(len(corners), dtype=bool)
    edges = np.full(len(corners), np.inf)
    for k in range(3):
        start, way = corners[:, k], corners[:, (k + 1) % 3] - corners[:, k]
        to = point - start
        inside &= np.einsum("ij,ij->i", np.cross(way, to), normal) >= 0.0
        square = np.maximum(np.einsum("ij,ij->i", way, way), np.finfo(float).tiny)
        share = np.clip(np.einsum("ij,ij->i", to, way) / square, 0.0, 1.0)
        edges = np.minimum(edges, np.linalg.norm(to - share[:, None] * way, axis=1))
    return np.where(inside, np.minimum(np.abs(height), edges), edges)


def _edges(triangles: NDArray[np.int64]) -> NDArray[np.int64]:
    """Returns the directed edges of triangles, three after the other."""
    import numpy as np

    return np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=-1).reshape(-1, 2)


def _oriented(
    vertices: NDArray[np.float64], triangles: NDArray[np.int64], surfaces: NDArray[np.int64]
) -> NDArray[np.int64]:
    """Returns the triangles with neighbouring surfaces turned alike, and closed bodies outward.

    Triangles of one surface are turned alike already. The surface with the least number keeps its
    sense in an open body, and in a closed one that lies in another: a hollow of it, or a body of its own.
    """
    import numpy as np

    owners: dict[tuple[int, int], list[tuple[int, bool]]] = defaultdict(list)
    for k, (a, b) in enumerate(_edges(triangles).tolist()):
        owners[min(a, b), max(a, b)].append((int(surfaces[k // 3]), a < b))
    neighbours: dict[int, list[tuple[int, bool]]] = defaultdict(list)
    for pair in owners.values():
        if len(pair) == 2 and pair[0][0] != pair[1][0]:
            turned = pair[0][1] == pair[1][1]
            neighbours[pair[0][0]].append((pair[1][0], turned))
            neighbours[pair[1][0]].append((pair[0][0], turned))
    is_turned: dict[int, bool] = {}
    closed: list[NDArray[np.bool_]] = []
    out = triangles.copy()
    for root in np.unique(surfaces).tolist():
        if root in is_turned:
            continue
        is_turned[root] = False
        body, queue = [], [root]
        while queue:
            surface = queue.pop()
            body.append(surface)
            for other, turned in neighbours[surface]:
                if other not in is_turned:
                    is_turned[other] = is_turned[surface] != turned
                    queue.append(other)
        flip = np.isin(surfaces, [surface for surface in body if is_turned[surface]])
        out[flip] = out[flip][:, ::-1]
        mine = np.isin(surfaces, body)
        if not _seams(vertices, out[mine]):
            closed.append(mine)
    corners = [vertices[out[mine]] for mine in closed]
    for k, mine in enumerate(closed):
        a, b, c = (corners[k][:, i] for i in range(3))
        volume = float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum())
        if volume < 0.0 and not any(_lies_in(corners[k], other) for j, other in enumerate(corners) if j != k):
            out[mine] = out[mine][:, ::-1]
    return out


def _lies_in(inner: NDArray[np.float64], outer: NDArray[np.float64]) -> bool:
    """Returns whether a closed surface lies in another, which it does not cross, by their corners."""
    import numpy as np

    low, high = outer.min(axis=(0, 1)), outer.max(axis=(0, 1))
    if (inner.min(axis=(0, 1)) < low).any() or (inner.max(axis=(0, 1)) > high).any():
        return False
    # A ray that is parallel to no face of usual parts crosses the outer surface an odd number of times.
    way = np.array([0.5377, 0.3162, 0.7816])
    start = inner[0].mean(axis=0)
    a, u, v = outer[:, 0], outer[:, 1] - outer[:, 0], outer[:, 2] - outer[:, 0]
    across = np.cross(way, v)
    whole = np.einsum("ij,ij->i", u, across)
    whole[whole == 0.0] = np.finfo(float).tiny
    to = start - a
    s = np.einsum("ij,ij->i", to, across) / whole
    turned = np.cross(to, u)
    t = turned @ way / whole
    far = np.einsum("ij,ij->i", v, turned) / whole
    return bool(((s >= 0.0) & (t >= 0.0) & (s + t <= 1.0) & (far > 0.0)).sum() % 2)


def _crowded(triangles: NDArray[np.int64]) -> int:
    """Returns the number of edges with more than two triangles."""
    import numpy as np

    _, count = np.unique(np.sort(_edges(triangles), axis=1), axis=0, return_counts=True)
    return int((count > 2).sum())


def _seams(vertices: NDArray[np.float64], triangles: NDArray[np.int64]) -> tuple[Seam, ...]:
    """Returns the chains of edges that one triangle alone has, the longest first."""
    import numpy as np

    edges = np.sort(_edges(triangles), axis=1)
    unique, count = np.unique(edges, axis=0, return_counts=True)
    single = unique[count == 1]
    chain_of: dict[int, int] = {}
    chains: dict[int, list[tuple[int, int]]] = {}
    for a, b in single.tolist():
        first, second = chain_of.get(a), chain_of.get(b)
        name = first if first is not None else second if second is not None else a
        chains.setdefault(name, []).append((a, b))
        if first is not None and second is not None and first != second:
            moved = chains.pop(second)
            chains[first].extend(moved)
            for edge in moved:
                chain_of[edge[0]] = chain_of[edge[1]] = first
        chain_of[a] = chain_of[b] = name

    def seam(chain: list[tuple[int, int]]) -> Seam:
        ends = np.asarray(chain)
        length = float(np.linalg.norm(vertices[ends[:, 0]] - vertices[ends[:, 1]], axis=1).sum())
        x, y, z = vertices[int(ends.min())].tolist()
        return Seam(length, (x, y, z), len(chain))

    return tuple(sorted((seam(chain) for chain in chains.values()), key=lambda s: (-s.length_mm, s.at)))


def _up(value: float) -> float:
    """Returns a length rounded up to three digits."""
    if value <= 0.0:
        return 0.0
    unit = 10.0 ** (math.floor(math.log10(value)) - 2)
    return round(math.ceil(value / unit) * unit, 12)


def obj_bytes(mesh: CadMesh) -> bytes:
    """Returns the OBJ file of a mesh, in mm, with a group ``surface_K`` for each surface of the file."""
    lines = [f"v {x:.9f} {y:.9f} {z:.9f}" for x, y, z in mesh.vertices.tolist()]
    last = 0
    for surface, (a, b, c) in zip(mesh.surfaces.tolist(), mesh.triangles.tolist()):
        if surface != last:
            lines.append(f"g surface_{surface}")
            last = surface
        lines.append(f"f {a + 1} {b + 1} {c + 1}")
    return ("\n".join(lines) + "\n").encode()


def with_chord(
    job: dict[str, Any], chord_mm: float, is_mesh: Callable[[str], bool]
) -> tuple[dict[str, Any], list[str]]:
    """Returns a job with this chord as ``mesh_chord_mm`` of the operations on a mesh, and what was done.

    An operation whose drive and part meshes are all the mesh gets the chord; one with other meshes
    among them keeps its own where that is larger; one without the mesh stays as it is.

    :param is_mesh: whether a mesh entry's ``file`` is the mesh.
    :raises Error: if an operation has no tolerances, or no setup of the job.
    """
    changed: dict[str, Any] = json.loads(json.dumps(job))
    operations = changed.get("operations") if isinstance(changed, dict) else None
    if not isinstance(operations, list) or not operations:
        raise Error("operations: the job has none")
    setups = changed.get("setups")
    if not isinstance(setups, list) or not all(isinstance(setup, dict) for setup in setups):
        raise Error("setups: the job has none")
    said = []
    for k, operation in enumerate(operations):
        tolerances = operation.get("tolerances") if isinstance(operation, dict) else None
        if not isinstance(tolerances, dict):
            raise Error(f"operations[{k}].tolerances: is missing")
        before = tolerances.get("mesh_chord_mm", 0.0)
        if not isinstance(before, (int, float)):
            raise Error(f"operations[{k}].tolerances.mesh_chord_mm: is no number")
        name = f"operation {operation.get('name', k)!r}"
        setup = operation.get("setup")
        mine = [s for s in setups if setup is None or s.get("name") == setup]
        if not mine:
            raise Error(f"operations[{k}].setup: no setup has the name {setup!r}")
        entries = [entry for s in mine for entry in s.get("meshes") or [] if isinstance(entry, dict)]
        meshes = [entry for entry in entries if entry.get("role") in ("drive", "part")]
        are = [is_mesh(str(entry.get("file"))) for entry in meshes]
        if not any(are):
            said.append(f"{name} stays at mesh_chord_mm {before}: none of its drive and part meshes is this one")
            continue
        chord = chord_mm if all(are) else max(before, chord_mm)
        tolerances["mesh_chord_mm"] = chord
        if all(are):
            said.append(f"{name}: mesh_chord_mm is {chord}, was {before}")
        elif chord == before:
            said.append(f"{name} stays at mesh_chord_mm {before}: other drive and part meshes may need it")
        else:
            said.append(f"{name}: mesh_chord_mm is {chord}, was {before}; it has other drive and part meshes, too")
    return changed, said


def _write(path: Path, content: bytes) -> None:
    """Writes a file whole or not at all."""
    try:
        handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
        try:
            with os.fdopen(handle, "wb") as file:
                file.write(content)
            os.chmod(name, 0o666 & ~_umask())
            os.replace(name, path)
        except BaseException:
            os.unlink(name)
            raise
    except OSError as error:
        raise Error(f"{path}: cannot be written: {error.strerror}") from None


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


def _job_of(path: Path, chord_mm: float, mesh: Path) -> tuple[bytes, list[str]]:
    try:
        job = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise Error(f"{path}: cannot be read: {error.strerror}") from None
    except ValueError as error:
        raise Error(f"{path}: is no JSON: {error}") from None
    try:
        changed, said = with_chord(job, chord_mm, lambda file: (path.parent / file).resolve() == mesh.resolve())
        return (json.dumps(changed, indent=2, ensure_ascii=False) + "\n").encode(), said
    except Error as error:
        raise Error(f"{path}: {error}") from None


def summary(mesh: CadMesh) -> str:
    """Returns what was measured, in lines."""
    lines = [
        f"{len(mesh.triangles)} triangles, {len(mesh.vertices)} vertices, "
        f"{len(set(mesh.surfaces.tolist()))} surfaces",
        f"chord kept: {mesh.chord_mm} mm, from {mesh.points} distances between triangles and surfaces",
    ]
    if mesh.is_closed:
        lines.append("closed: every edge has two triangles")
    if mesh.crowded:
        lines.append(f"{mesh.crowded} edges with more than two triangles: bodies touch, or a surface is there twice")
    for seam in mesh.seams[:10]:
        x, y, z = seam.at
        lines.append(f"open seam of {seam.length_mm:.3f} mm ({seam.edges} edges) at ({x:.3f}, {y:.3f}, {z:.3f})")
    if len(mesh.seams) > 10:
        lines.append(f"and {len(mesh.seams) - 10} shorter open seams")
    return "\n".join(lines)


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command; returns its exit code, 2 for wrong input."""
    parser = argparse.ArgumentParser(
        prog="python -m facemill.cad", description="Tessellates a STEP or IGES file and measures the chord kept."
    )
    parser.add_argument("cad", type=Path, help="STEP, IGES or BREP file")
    parser.add_argument("mesh", type=Path, help="mesh to write: .obj (one group for each surface), .stl or .glb")
    parser.add_argument("--chord-mm", type=float, required=True, help="largest distance from the surfaces, mm")
    parser.add_argument("--sew-mm", type=float, default=0.0, help="sew faces whose edges are as near, mm")
    parser.add_argument("--job", type=Path, help="job file whose operations on the mesh get the measured chord as mesh_chord_mm")
    given = parser.parse_args(arguments)
    try:
        if given.mesh.suffix.lower() not in (".obj", ".stl", ".glb"):
            raise Error(f"{given.mesh}: must end in .obj, .stl or .glb")
        mesh = tessellate(given.cad, given.chord_mm, given.sew_mm, given.mesh.suffix)
        if given.mesh.suffix.lower() == ".obj":
            content = obj_bytes(mesh)
        else:
            from facemill import mesh_bytes

            content = mesh_bytes(given.mesh.name, mesh.vertices, mesh.triangles)
        job, said = _job_of(given.job, mesh.chord_mm, given.mesh) if given.job else (None, [])
        _write(given.mesh, content)
        if job is not None:
            _write(given.job, job)
    except Error as error:
        print(f"facemill: {error}", file=sys.stderr)
        return 2
    print(f"{given.mesh}: {summary(mesh)}")
    if job is not None:
        print("\n".join(f"{given.job}: {line}" for line in said))
    return 0


if __name__ == "__main__":
    sys.exit(main())
