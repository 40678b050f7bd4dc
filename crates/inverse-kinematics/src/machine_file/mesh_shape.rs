use std::sync::Arc;

use facemill_cl_data::ConvexPolyhedron;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::machine_file::error::{FieldProblem, MachineError};
use crate::machine_file::{BodyFile, DhRow, LineChain, MachineFile, ShapeFile};

/// A body that is the convex hull of a mesh. The hull holds the mesh, so nothing that keeps clear
/// of it meets the mesh; a casting with a hollow is described by several bodies, one for each
/// convex piece.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MeshShapeFile {
    /// Mesh file (OBJ, STL, glTF, GLB, 3MF), relative to the machine file; glTF is turned from y up
    /// to z up.
    #[schemars(length(min = 1))]
    pub file: String,
    /// Unit of the file. Default: metre for glTF, the file's own for 3MF, else millimetre.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unit: Option<MeshUnitFile>,
    /// Groups to use, together one hull; `*` matches any run of characters. Default: all.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub groups: Option<Vec<String>>,
    /// The hull. The text of a machine file does not have it: [`MachineFile::with_hulls`] puts it
    /// here.
    #[serde(skip)]
    pub hull: Option<Arc<ConvexPolyhedron>>,
}

/// Length unit of a mesh file.
// Exhaustive for callers: a unit must not be taken for another.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum MeshUnitFile {
    /// 1000 mm.
    Metre,
    /// 10 mm.
    Centimetre,
    /// 1 mm.
    Millimetre,
    /// 25.4 mm.
    Inch,
}

/// A mesh that a body of a machine file names.
#[derive(Clone, Debug, PartialEq)]
pub struct BodyMesh<'a> {
    /// Path of the field, such as `tool_chains[0].rows[2].bodies[1].shape.mesh`.
    pub field: String,
    /// Name of the body.
    pub body: &'a str,
    /// Content of the field.
    pub shape: &'a MeshShapeFile,
}

impl MeshShapeFile {
    /// The hull.
    ///
    /// # Errors
    /// When nobody has given it; `field` is what the error names.
    pub(crate) fn read(&self, field: &str) -> Result<Arc<ConvexPolyhedron>, MachineError> {
        self.hull.clone().ok_or_else(|| MachineError::Field {
            field: field.to_owned(),
            axis: None,
            problem: FieldProblem::MeshNotRead { file: self.file.clone() },
        })
    }
}

impl MachineFile {
    /// Returns the file with the hull of every mesh of its bodies, from `hull_of`. This crate reads
    /// no files: the caller reads each mesh and makes the hull, in mm, by
    /// [`ConvexPolyhedron::around`].
    ///
    /// ```
    /// use std::sync::Arc;
    /// use facemill_cl_data::{ConvexPolyhedron, PolyhedronError};
    /// use facemill_inverse_kinematics::machine_file::{BodyFile, MeshShapeFile, ShapeFile};
    /// use facemill_inverse_kinematics::Machine;
    /// use nalgebra::Point3;
    ///
    /// let mut file = Machine::head_b_table_c().unwrap().to_file();
    /// let mesh = MeshShapeFile { file: "rail.stl".to_owned(), unit: None, groups: None, hull: None };
    /// let (name, shape) = ("rail".to_owned(), ShapeFile::Mesh(mesh));
    /// let rail = BodyFile { name, shape, position_mm: [0.0; 3], rotation_xyz_deg: [0.0; 3], clearance_mm: 5.0 };
    /// file.bed_bodies.push(rail);
    /// let file = file.with_hulls(|mesh| {
    ///     assert_eq!(mesh.shape.file, "rail.stl");
    ///     let points = [[0.0, 0.0, 0.0], [900.0, 0.0, 0.0], [0.0, 40.0, 0.0], [0.0, 0.0, 60.0]].map(Point3::from);
    ///     ConvexPolyhedron::around(&points, []).map(Arc::new)
    /// })?;
    /// assert!(Machine::from_file(file).is_ok());
    /// # Ok::<(), PolyhedronError>(())
    /// ```
    ///
    /// # Errors
    /// The first of `hull_of`.
    pub fn with_hulls<E>(
        mut self,
        mut hull_of: impl FnMut(&BodyMesh<'_>) -> Result<Arc<ConvexPolyhedron>, E>,
    ) -> Result<Self, E> {
        for (field, body) in self.bodies_mut() {
            let ShapeFile::Mesh(shape) = &body.shape else { continue };
            let hull = hull_of(&BodyMesh { field: format!("{field}.shape.mesh"), body: &body.name, shape })?;
            if let ShapeFile::Mesh(shape) = &mut body.shape {
                shape.hull = Some(hull);
            }
        }
        Ok(self)
    }

    /// Every body with the path of its field.
    fn bodies_mut(&mut self) -> Vec<(String, &mut BodyFile)> {
        let mut all = in_list("bed_bodies", &mut self.bed_bodies);
        all.extend(in_rows("workpiece_chain", &mut self.workpiece_chain.rows));
        all.extend(in_lines("workpiece_chain", self.workpiece_chain.lines.as_mut()));
        for (k, chain) in self.tool_chains.iter_mut().enumerate() {
            all.extend(in_rows(&format!("tool_chains[{k}]"), &mut chain.rows));
            all.extend(in_lines(&format!("tool_chains[{k}]"), chain.lines.as_mut()));
        }
        all
    }
}

fn in_rows<'a>(chain: &str, rows: &'a mut [DhRow]) -> Vec<(String, &'a mut BodyFile)> {
    let each = rows.iter_mut().enumerate();
    each.flat_map(|(k, row)| in_list(&format!("{chain}.rows[{k}].bodies"), &mut row.bodies)).collect()
}

fn in_lines<'a>(chain: &str, lines: Option<&'a mut LineChain>) -> Vec<(String, &'a mut BodyFile)> {
    let each = lines.into_iter().flat_map(|lines| &mut lines.axes).enumerate();
    each.flat_map(|(k, line)| in_list(&format!("{chain}.lines.axes[{k}].bodies"), &mut line.bodies)).collect()
}

fn in_list<'a>(field: &str, bodies: &'a mut [BodyFile]) -> Vec<(String, &'a mut BodyFile)> {
    bodies.iter_mut().enumerate().map(|(k, body)| (format!("{field}[{k}]"), body)).collect()
}
