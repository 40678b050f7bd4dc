//! Check that stock and clearance surface enclose the part.

use facemill_cutter_location::Pieces;
use facemill_surface_model::TriMesh;
use nalgebra::Point3;

use crate::format::job_file::{SetupFile, StockFile};
use crate::frames::direction;
use crate::load::clearance_surface::clearance_surface;
use crate::load::obstacle_meshes::{ObstacleMesh, ObstacleRole};

/// Distance by which rounding alone may put a part out of its stock, mm: mesh files have single
/// precision.
const STOCK_ROUNDING: f64 = 1e-3;

/// Reports the first body that reaches out of stock or clearance surface, as `field: what is wrong
/// and what to do`.
///
/// The part must lie in the stock: in a box or cylinder itself, in the bounding box of a mesh,
/// since a casting may lack some material but not be elsewhere. Part, stock and fixtures must lie
/// inside the clearance surface. `obstacles` are those of the job, without the machine's bodies;
/// workpiece frame.
///
/// # Errors
/// If there is one.
pub(crate) fn check_enclosure(
    at: &str,
    file: &SetupFile,
    stock_thickness: f64,
    obstacles: &[ObstacleMesh],
) -> Result<(), String> {
    check_stock(at, file, obstacles)?;
    let surface = clearance_surface(&file.clearance);
    for o in obstacles {
        let skin = match o.role {
            ObstacleRole::Part | ObstacleRole::Check => stock_thickness.max(o.allowance),
            ObstacleRole::Fixture | ObstacleRole::Table | ObstacleRole::Stock => o.allowance,
        };
        let Some((place, height)) = farthest(&o.mesh, |p| surface.height(p)) else { continue };
        if height + skin > 0.0 {
            return Err(format!(
                "{at}.clearance: {} with its stock or allowance reaches {:.3} mm beyond the clearance surface at {}; rapids would \
                 go through it, so move the surface out",
                o.name_at(&place),
                height + skin,
                text(&place)
            ));
        }
    }
    Ok(())
}

fn check_stock(at: &str, file: &SetupFile, obstacles: &[ObstacleMesh]) -> Result<(), String> {
    let Some(outside) = outside_of_stock(&file.stock, obstacles) else { return Ok(()) };
    let parts = obstacles.iter().filter(|o| o.role == ObstacleRole::Part);
    let worst = parts.filter_map(|o| farthest(&o.mesh, &outside)).max_by(|a, b| a.1.total_cmp(&b.1));
    match worst {
        Some((place, distance)) if distance > STOCK_ROUNDING => Err(format!(
            "{at}.stock: the part reaches {distance:.3} mm out of it at {}; give stock that contains the part, in the \
             right unit and frame",
            text(&place)
        )),
        _ => Ok(()),
    }
}

/// Distance of a point outside the stock, negative inside, mm.
type Outside<'a> = Box<dyn Fn(&Point3<f64>) -> f64 + 'a>;

/// Returns `None` if the stock is a layer on the part.
fn outside_of_stock<'a>(stock: &'a StockFile, obstacles: &[ObstacleMesh]) -> Option<Outside<'a>> {
    let of_box = |min: Point3<f64>, max: Point3<f64>| -> Outside<'a> {
        Box::new(move |p: &Point3<f64>| (min - p).sup(&(p - max)).max())
    };
    match stock {
        StockFile::Offset(_) => None,
        StockFile::Box(b) => Some(of_box(b.min_mm.into(), b.max_mm.into())),
        StockFile::Cylinder(c) => {
            let (base, axis) = (Point3::from(c.base_mm), direction(&c.axis));
            Some(Box::new(move |p: &Point3<f64>| {
                let d = p - base;
                let along = d.dot(&axis);
                let radial = (d - axis.into_inner() * along).norm();
                (radial - c.radius_mm).max(-along).max(along - c.height_mm)
            }))
        }
        StockFile::Mesh(_) => {
            let bounds = obstacles.iter().find(|o| o.role == ObstacleRole::Stock)?.mesh.aabb();
            Some(of_box(bounds.min, bounds.max))
        }
    }
}

/// Returns the triangles' corner of largest height, and its height.
fn farthest(mesh: &TriMesh, height: impl Fn(&Point3<f64>) -> f64) -> Option<(Point3<f64>, f64)> {
    let corners = mesh.triangles().iter().flatten().map(|&v| mesh.vertices()[v as usize]);
    corners.map(|p| (p, height(&p))).max_by(|a, b| a.1.total_cmp(&b.1))
}

fn text(p: &Point3<f64>) -> String {
    format!("({:.1}, {:.1}, {:.1})", p.x, p.y, p.z)
}

#[cfg(test)]
#[path = "../../tests/unit/load/enclosure.rs"]
mod tests;
