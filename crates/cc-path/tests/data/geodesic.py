"""Writes geodesic.csv: exact distances on meshes (Mitchell, Mount, Papadimitriou 1987, as in libigl).

    python3 -m venv venv && venv/bin/pip install libigl==2.6.3 numpy && venv/bin/python geodesic.py

Meshes and curves are those of `tests/unit/distance/curve_distance.rs`, which has the same formulas.
Each line: mesh, vertex, distance from the vertex to the curve on the mesh, mm. The curve is the
column of vertices i = SOURCE. The distance to it is the least of a parabola through the three
nearest of its vertices.
"""

import math
import os

import igl
import numpy as np

N, M, SOURCE = 48, 96, 12


def jitter(i, j):
    """Irregular offsets in -0.3..0.3 of a cell; none on the curve and the border."""
    if i in (0, SOURCE, N) or j in (0, M):
        return 0.0, 0.0
    wave = lambda a: math.modf(abs(math.sin(a)) * 43758.5453)[0] - 0.5
    return 0.6 * wave(12.9898 * i + 78.233 * j), 0.6 * wave(39.346 * i + 11.135 * j)


def plane(u, v):
    return 48.0 * u, 384.0 * v, 0.0


def cylinder(u, v):
    angle = 1.6 * (u - 0.5)
    return 40.0 * math.sin(angle), 60.0 * v, 40.0 * math.cos(angle)


def torus(u, v):
    polar, turn = 1.6 * (u - 0.5), 0.8 * v
    ring = 80.0 + 30.0 * math.cos(polar)
    return ring * math.cos(turn), ring * math.sin(turn), 30.0 * math.sin(polar)


def waves(u, v):
    x, y = 60.0 * u, 80.0 * v
    return x, y, 6.0 * math.sin(x / 11.0) * math.cos(y / 13.0) + 0.1 * y


def grid(place):
    vertices, faces = [], []
    for i in range(N + 1):
        for j in range(M + 1):
            di, dj = jitter(i, j)
            vertices.append(place((i + di) / N, (j + dj) / M))
    at = lambda i, j: i * (M + 1) + j
    for i in range(N):
        for j in range(M):
            faces.append((at(i, j), at(i + 1, j), at(i + 1, j + 1)))
            faces.append((at(i, j), at(i + 1, j + 1), at(i, j + 1)))
    return np.array(vertices), np.array(faces, dtype=np.int64)


def to_curve(distances, vertices, curve):
    k = min(max(int(np.argmin(distances)), 1), len(curve) - 2)
    points = vertices[curve[k - 1 : k + 2]]
    ways = np.array([-np.linalg.norm(points[1] - points[0]), 0.0, np.linalg.norm(points[2] - points[1])])
    square, linear, constant = np.polyfit(ways, distances[k - 1 : k + 2] ** 2, 2)
    return math.sqrt(constant - linear * linear / (4.0 * square))


def main():
    lines = ["mesh,vertex,distance_mm"]
    curve = np.array([SOURCE * (M + 1) + j for j in range(M + 1)], dtype=np.int64)
    none = np.array([], dtype=np.int64)
    for place in (plane, cylinder, torus, waves):
        vertices, faces = grid(place)
        for i in (6, 15, 18, 21, 24):
            for j in range(24, M - 20, 7):
                source = np.array([i * (M + 1) + j], dtype=np.int64)
                distances = igl.exact_geodesic(vertices, faces, source, none, curve, none)
                exact = to_curve(np.asarray(distances).ravel(), vertices, curve)
                lines.append(f"{place.__name__},{source[0]},{exact:.6f}")
    with open(os.path.join(os.path.dirname(os.path.abspath(__file__)), "geodesic.csv"), "w") as out:
        out.write("\n".join(lines) + "\n")


main()
