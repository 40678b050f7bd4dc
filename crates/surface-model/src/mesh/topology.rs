use crate::mesh::edges::{DisjointSets, Edges};
use crate::mesh::tri_mesh::TriMesh;

/// Components of a mesh, and edges that a solid would not have.
#[derive(Clone, Debug)]
pub struct Topology {
    /// Edges of one triangle.
    pub n_open_edges: usize,
    /// Edges of three or more triangles.
    pub n_non_manifold_edges: usize,
    /// Edges of two triangles that are wound against each other.
    pub n_miswound_edges: usize,
    /// Components by their first triangle.
    pub components: Vec<Component>,
    /// Component of each triangle.
    pub component_of: Vec<u32>,
}

/// Triangles that hang together by edges.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Component {
    /// Number of triangles.
    pub n_triangles: usize,
    /// Whether it bounds a volume: on every edge as many sides run one way as the other.
    pub closed: bool,
    /// Volume that it bounds, negative if it is wound inside out; `null` if it is not closed.
    pub volume_mm3: Option<f64>,
}

impl Component {
    /// Returns whether it is closed and wound inside out. That winding is correct for a cavity
    /// inside another component.
    pub fn is_inverted(&self) -> bool {
        self.volume_mm3.is_some_and(|v| v < 0.0)
    }
}

impl Topology {
    /// Finds components and counts edges.
    #[must_use]
    pub fn of(mesh: &TriMesh, edges: &Edges) -> Self {
        let (components, component_of) = components(mesh, edges);
        let mut topology =
            Self { n_open_edges: 0, n_non_manifold_edges: 0, n_miswound_edges: 0, components, component_of };
        for edge in 0..edges.len() as u32 {
            let (up, down) = edges.directions(mesh, edge);
            match up + down {
                1 => topology.n_open_edges += 1,
                2 => topology.n_miswound_edges += usize::from(up != down),
                _ => topology.n_non_manifold_edges += 1,
            }
            if up != down {
                let component = topology.component_of[edges.sides(edge)[0] as usize / 3];
                topology.components[component as usize].closed = false;
            }
        }
        topology.add_volumes(mesh);
        topology
    }

    /// Computes volumes by the divergence theorem about a vertex of each component, which keeps the
    /// cancellation small.
    fn add_volumes(&mut self, mesh: &TriMesh) {
        let mut sums = vec![(None, 0.0); self.components.len()];
        for (t, &c) in self.component_of.iter().enumerate() {
            let [p, q, r] = mesh.corners(t);
            let (origin, sum) = &mut sums[c as usize];
            let o = *origin.get_or_insert(p);
            *sum += (p - o).dot(&(q - o).cross(&(r - o))) / 6.0;
        }
        for (component, (_, sum)) in self.components.iter_mut().zip(sums) {
            component.volume_mm3 = component.closed.then_some(sum).filter(|v| v.is_finite());
        }
    }
}

/// Returns components, taken as closed, and the component of each triangle.
fn components(mesh: &TriMesh, edges: &Edges) -> (Vec<Component>, Vec<u32>) {
    let n = mesh.triangles().len();
    let mut sets = DisjointSets::new(n);
    for edge in 0..edges.len() as u32 {
        let sides = edges.sides(edge);
        for &side in &sides[1..] {
            sets.join(sides[0] / 3, side / 3);
        }
    }
    let mut components: Vec<Component> = Vec::new();
    let mut component_of = vec![0; n];
    for t in 0..n {
        // The lowest triangle represents its set, so it has been seen before the others.
        let first = sets.find(t as u32) as usize;
        if first == t {
            component_of[t] = components.len() as u32;
            components.push(Component { n_triangles: 0, closed: true, volume_mm3: None });
        } else {
            component_of[t] = component_of[first];
        }
        components[component_of[t] as usize].n_triangles += 1;
    }
    (components, component_of)
}

#[cfg(test)]
#[path = "../../tests/unit/mesh/topology.rs"]
mod tests;
