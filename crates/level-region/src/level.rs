//! A level over stock, with its reach.

use facemill_surface_model::{Group, TriMesh};
use facemill_tool_model::Cutter;

use crate::plane::LevelPlane;
use crate::reach::Reach;
use crate::room::{LevelRoom, Standing};

/// Name of the group of the rectangle that passes are laid in.
const AROUND: &str = "around the stock";

/// Level over a stock, and what a cutter reaches of it.
pub struct Level {
    plane: LevelPlane,
    cutter: Cutter,
    reach: Reach,
    /// Least and largest coordinates of the stock, level's frame.
    extents: [[f64; 2]; 2],
}

impl Level {
    /// Returns a level over a stock with what a cutter reaches of it past bodies that stand there.
    pub fn new(plane: LevelPlane, cutter: &Cutter, standing: Vec<Standing<'_>>, stock: &TriMesh) -> Self {
        let mut extents = [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]];
        for vertex in stock.vertices() {
            let p = plane.seen_from(vertex);
            extents[0] = [extents[0][0].min(p.x), extents[0][1].min(p.y)];
            extents[1] = [extents[1][0].max(p.x), extents[1][1].max(p.y)];
        }
        if !extents.iter().flatten().all(|x| x.is_finite()) {
            extents = [[0.0; 2]; 2];
        }
        let reach = Reach::new(&LevelRoom::new(plane, cutter, standing), extents);
        Self { plane, cutter: *cutter, reach, extents }
    }

    /// Returns the plane.
    pub fn plane(&self) -> &LevelPlane {
        &self.plane
    }

    /// Returns what the cutter reaches.
    pub fn reach(&self) -> &Reach {
        &self.reach
    }

    /// Returns the room of the cutter past bodies.
    pub fn room<'a>(&self, standing: Vec<Standing<'a>>) -> LevelRoom<'a> {
        LevelRoom::new(self.plane, &self.cutter, standing)
    }

    /// Returns the largest distance across the stock on the level, mm.
    pub fn diagonal(&self) -> f64 {
        let [low, high] = self.extents;
        (high[0] - low[0]).hypot(high[1] - low[1])
    }

    /// Returns the rectangle around the stock that passes are laid in, wider by a distance (mm) on
    /// all sides, facing up, workpiece frame.
    pub fn pass_mesh(&self, beyond: f64) -> TriMesh {
        let [low, high] = self.extents;
        let corners = [[low[0] - beyond, low[1] - beyond], [high[0] + beyond, high[1] + beyond]];
        let at = |i: usize, j: usize| self.plane.at(corners[i][0], corners[j][1]);
        let vertices = vec![at(0, 0), at(1, 0), at(1, 1), at(0, 1)];
        let groups = vec![Group { name: AROUND.to_owned(), triangles: 0..2 }];
        TriMesh::with_groups(vertices, vec![[0, 1, 2], [0, 2, 3]], groups).unwrap_or_default()
    }
}
