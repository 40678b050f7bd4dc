// Coarse indices of meshes and paths, for pictures in motion where the processor draws.

const SIGNS = [1, 2, 4];

/**
 * Index of a coarse mesh on the same vertices, of at most so many triangles: all vertices in a cell whose normals have the same
 * signs are one. `null` where the mesh has no more than that.
 */
export function coarseTriangles(positions, normals, triangles, most) {
  if (triangles.length <= 3 * most) return null;
  const n = positions.length / 3;
  const [low, high] = [[Infinity, Infinity, Infinity], [-Infinity, -Infinity, -Infinity]];
  for (let k = 0; k < positions.length; k++) {
    low[k % 3] = Math.min(low[k % 3], positions[k]);
    high[k % 3] = Math.max(high[k % 3], positions[k]);
  }
  const size = Math.max(...high.map((x, c) => x - low[c])) || 1;
  for (let cell = size / 200; ; cell *= 1.3) {
    const [nx, ny] = [0, 1].map((c) => Math.floor((high[c] - low[c]) / cell) + 1);
    const first = new Map();
    const taken = new Uint32Array(n);
    for (let v = 0; v < n; v++) {
      const [x, y, z] = [0, 1, 2].map((c) => Math.floor((positions[3 * v + c] - low[c]) / cell));
      const side = SIGNS.reduce((sum, sign, c) => sum + (normals[3 * v + c] > 0 ? sign : 0), 0);
      const key = 8 * (x + nx * (y + ny * z)) + side;
      const known = first.get(key);
      taken[v] = known === undefined ? v : known;
      if (known === undefined) first.set(key, v);
    }
    const index = [];
    for (let t = 0; t < triangles.length && index.length <= 3 * most; t += 3) {
      const [a, b, c] = [taken[triangles[t]], taken[triangles[t + 1]], taken[triangles[t + 2]]];
      if (a !== b && b !== c && c !== a) index.push(a, b, c);
    }
    if (index.length <= 3 * most) return Uint32Array.from(index);
  }
}

/**
 * Index of coarse segments on the vertices of fine ones (two for each, in order), with the motion of the last fine one in each:
 * segments that join are one while the points between are within `within` of it, at most `most` of them.
 */
export function coarseSegments(positions, motions, within, most = 64) {
  const index = [];
  const ends = [];
  const at = (vertex, c) => positions[3 * vertex + c];
  const joins = (k) => [0, 1, 2].every((c) => at(2 * k - 1, c) === at(2 * k, c));
  const isNear = (from, to) => {
    const d = [0, 1, 2].map((c) => at(to, c) - at(from, c));
    const square = d[0] * d[0] + d[1] * d[1] + d[2] * d[2] || 1;
    for (let vertex = from + 1; vertex < to; vertex += 2) {
      const e = [0, 1, 2].map((c) => at(vertex, c) - at(from, c));
      const share = Math.min(Math.max((e[0] * d[0] + e[1] * d[1] + e[2] * d[2]) / square, 0), 1);
      if (Math.hypot(e[0] - share * d[0], e[1] - share * d[1], e[2] - share * d[2]) > within) return false;
    }
    return true;
  };
  for (let k = 0; k < motions.length; ) {
    let end = k + 1;
    while (end < motions.length && end - k < most && joins(end) && isNear(2 * k, 2 * end + 1)) end++;
    index.push(2 * k, 2 * end - 1);
    ends.push(motions[end - 1]);
    k = end;
  }
  return { index: Uint32Array.from(index), motions: Uint32Array.from(ends) };
}
