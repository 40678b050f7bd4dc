//! Bodies that are certainly free of a map.

use facemill_cl_data::{Aabb, Solid};
use nalgebra::{Isometry3, Point3};

use crate::map::ZMap;
use crate::pyramid::Block;
use crate::separation::{Gap, gap};

/// Whether the cell maxima prove that a solid, dilation included, is above the mesh: that it has no
/// point in common with the columns under the maxima of the cells, down to −∞.
///
/// `true` is a proof, up to rounding that is charged to it, and also says that the solid is not
/// inside the part, as long as the map's z points out of the material. `false` proves nothing: the
/// solid is in the mesh, or nearer to it than the cells are fine, or under an overhang, or the pose
/// is not finite.
///
/// `map_from_solid` leads from the solid's own frame to the map's. The pyramid is descended only
/// where its coarser maxima decide nothing, so a solid high above the part costs a handful of
/// comparisons.
pub fn certainly_free(zmap: &ZMap, solid: &Solid, map_from_solid: &Isometry3<f64>) -> bool {
    let bounds = solid.aabb().transformed(map_from_solid);
    let corners = [bounds.min, bounds.max];
    if !corners.iter().all(|p| p.coords.iter().all(|c| c.is_finite())) || bounds.is_empty() {
        return false;
    }
    let largest = corners.iter().fold(map_from_solid.translation.vector.amax(), |m, p| m.max(p.coords.amax()));
    // Rounding of the motion and of the separation, as for the mesh itself.
    let slack = zmap.grid().slack + 64.0 * f64::EPSILON * largest;
    let query = Query { zmap, solid, map_from_solid, reach: bounds.dilated(slack), distance: solid.rounding() + slack };
    query.is_free()
}

/// Steps of the search for a separating plane over a block of cells, where a finer answer can
/// follow.
const STEPS_OVER_BLOCK: usize = 3;
/// The same over a single cell, where nothing can. Fewer leave poses unknown whose gap is small
/// against the cell.
const STEPS_OVER_CELL: usize = 24;

struct Query<'a> {
    zmap: &'a ZMap,
    solid: &'a Solid,
    map_from_solid: &'a Isometry3<f64>,
    /// Box around the dilated solid.
    reach: Aabb,
    /// Least distance of a column from the undilated body.
    distance: f64,
}

impl Query<'_> {
    fn is_free(&self) -> bool {
        let pyramid = self.zmap.pyramid();
        let mut open = vec![pyramid.top()];
        while let Some(block) = open.pop() {
            let Some(column) = self.column(block) else { continue };
            let is_cell = block.level == 0;
            let steps = if is_cell { STEPS_OVER_CELL } else { STEPS_OVER_BLOCK };
            match gap(&column, self.solid, self.map_from_solid, self.distance, steps) {
                Gap::AtLeast(_) => {}
                Gap::Within | Gap::Unknown if is_cell => return false,
                Gap::Within | Gap::Unknown => open.extend(pyramid.children(block)),
            }
        }
        true
    }

    /// Returns the part of a block's columns that the box around the solid can reach; `None` if
    /// that is empty.
    fn column(&self, block: Block) -> Option<Aabb> {
        let (grid, reach) = (self.zmap.grid(), &self.reach);
        let [columns, rows] = self.zmap.pyramid().cells(block);
        let (min_x, max_x) = (grid.node_x(columns.start).max(reach.min.x), grid.node_x(columns.end).min(reach.max.x));
        let (min_y, max_y) = (grid.node_y(rows.start).max(reach.min.y), grid.node_y(rows.end).min(reach.max.y));
        let max_z = self.zmap.pyramid().max(block).min(reach.max.z);
        let column = Aabb { min: Point3::new(min_x, min_y, reach.min.z), max: Point3::new(max_x, max_y, max_z) };
        (!column.is_empty()).then_some(column)
    }
}
