use nalgebra::Point3;

use crate::import::settings::ImportFault;
use crate::mesh::tri_mesh::Group;

/// Triangles as read from a file: in its unit and frame, neither welded nor checked.
#[derive(Default)]
pub(crate) struct RawMesh {
    pub(crate) vertices: Vec<Point3<f64>>,
    pub(crate) triangles: Vec<[u32; 3]>,
    pub(crate) groups: Vec<Group>,
}

/// Later stages number the sides of the triangles with 32 bits.
const MAX_TRIANGLES: usize = 1 << 29;

impl RawMesh {
    /// Assigns the following triangles to a group of this name; the last group may be continued.
    pub(super) fn begin_group(&mut self, name: &str) {
        if self.groups.last().is_some_and(|g| g.name == name) {
            return;
        }
        // Groups before the last one have triangles.
        self.groups.pop_if(|last| last.triangles.is_empty());
        let n = self.triangles.len();
        self.groups.push(Group { name: name.to_owned(), triangles: n..n });
    }

    /// Appends a triangle; the first one without a group starts one without a name.
    pub(super) fn push(&mut self, triangle: [u32; 3]) -> Result<(), ImportFault> {
        if self.triangles.len() >= MAX_TRIANGLES {
            return Err(ImportFault::TooLarge { limit: MAX_TRIANGLES });
        }
        if self.groups.is_empty() {
            self.begin_group("");
        }
        self.triangles.push(triangle);
        if let Some(g) = self.groups.last_mut() {
            g.triangles.end = self.triangles.len();
        }
        Ok(())
    }

    /// Appends a triangle with vertices of its own.
    pub(super) fn push_corners(&mut self, corners: [Point3<f64>; 3]) -> Result<(), ImportFault> {
        let first = self.vertices.len() as u32;
        self.push([first, first + 1, first + 2])?;
        self.vertices.extend(corners);
        Ok(())
    }
}

#[cfg(test)]
#[path = "../../tests/unit/import/raw_mesh.rs"]
mod tests;
