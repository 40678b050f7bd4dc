//! Blades of an `.inf` file as meshes.

use std::path::Path;

use facemill_blade_file::{BladeFile, EdgeEnd, ProfileBlade, ProfileSection, read_blade};
use facemill_sample_parts::{BladeLoft, BladeSections, EdgeForm, Endwalls, HubSector, LoftedBlade};
use facemill_surface_model::{Group, TriMesh};
use nalgebra::{Point3, Unit};

use crate::job_parts::{ReadFile, round_to};

/// Chord tolerance of a blade's mesh as a share of its size, and its limits, mm.
const CHORD_SHARE: f64 = 1e-4;
const CHORD_LIMITS: [f64; 2] = [0.002, 0.02];

/// Thickness of the hub's sector as a share of the blade's size.
const HUB_SHARE: f64 = 0.05;

/// One blade of a set as a mesh.
#[derive(Clone, Debug)]
pub struct SetBlade {
    /// `main`, then `splitter`, or `splitter-1` and on where there are several; empty for a blade
    /// alone.
    pub name: String,
    /// The blade, with natural coordinates of its own.
    pub lofted: LoftedBlade,
}

impl SetBlade {
    /// Returns the name of one of its groups in the mesh of the whole set.
    #[must_use]
    pub fn group(&self, name: &str) -> String {
        if self.name.is_empty() { name.to_owned() } else { format!("{}/{name}", self.name) }
    }

    /// Returns its name with a blank behind it, nothing for a blade alone.
    pub(crate) fn word(&self) -> String {
        if self.name.is_empty() { String::new() } else { format!("{} ", self.name) }
    }
}

/// Returns each blade of a description between its hub and shroud, `scale` times as large; with a
/// sector of the hub around it if requested, which only a blade alone has. Every given point
/// between the walls is a vertex.
///
/// # Errors
/// If the points describe no smooth blade, or there is no place for a hub.
pub fn lofted_blades(file: &BladeFile, scale: f64, with_hub: bool) -> Result<Vec<SetBlade>, String> {
    let n = file.blades.len();
    if with_hub && n > 1 {
        return Err(format!("has {n} blades in a set, and a hub is made around a single one; leave the hub out"));
    }
    let name = |k: usize| match (n, k) {
        (1, _) => String::new(),
        (_, 0) => "main".to_owned(),
        (2, _) => "splitter".to_owned(),
        _ => format!("splitter-{k}"),
    };
    let one = |(k, blade): (usize, &ProfileBlade)| {
        let name = name(k);
        let lofted = loft(file, blade, scale, with_hub);
        let lofted = lofted.map_err(|why| if name.is_empty() { why } else { format!("blade {k} ({name}): {why}") })?;
        Ok(SetBlade { name, lofted })
    };
    file.blades.iter().enumerate().map(one).collect()
}

/// Returns the mesh of all blades, whose groups have the name of their blade before their own.
pub(crate) fn set_mesh(blades: &[SetBlade]) -> Result<TriMesh, String> {
    let (mut vertices, mut triangles, mut groups) = (Vec::new(), Vec::new(), Vec::new());
    for blade in blades {
        let mesh = &blade.lofted.mesh;
        let (first, begin) = (u32::try_from(vertices.len()).map_err(|e| e.to_string())?, triangles.len());
        vertices.extend_from_slice(mesh.vertices());
        triangles.extend(mesh.triangles().iter().map(|corners| corners.map(|v| first + v)));
        groups.extend(mesh.groups().iter().map(|group| Group {
            name: blade.group(&group.name),
            triangles: begin + group.triangles.start..begin + group.triangles.end,
        }));
    }
    TriMesh::with_groups(vertices, triangles, groups).map_err(|e| e.to_string())
}

/// Reads an `.inf` file with those that it names, all below its folder.
pub(crate) fn read_blade_file(file: &Path, read: ReadFile<'_>) -> Result<BladeFile, String> {
    let folder = file.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let open = |name: &str| {
        let path = folder.join(name);
        // Links may lead out of the folder, too.
        let real = |path: &Path| path.canonicalize().map_err(|e| format!("{}: {e}", path.display()));
        if !real(&path)?.starts_with(real(folder)?) {
            return Err(format!("{name} is a link out of the folder; put the file itself below it"));
        }
        read(&path)
    };
    let bytes = read(file)?;
    read_blade(&file.display().to_string(), &bytes, open).map_err(|e| e.to_string())
}

/// Returns a blade between hub and shroud, as large as requested.
fn loft(file: &BladeFile, blade: &ProfileBlade, scale: f64, with_hub: bool) -> Result<LoftedBlade, String> {
    let enlarged = |points: &[Point3<f64>]| points.iter().map(|p| p * scale).collect::<Vec<_>>();
    let scaled = |section: &ProfileSection| enlarged(&section.points);
    let first = blade.sections.first().ok_or("the blade has no sections")?;
    let given = BladeSections {
        sections: blade.sections.iter().map(scaled).collect(),
        is_cut_off: !first.is_closed,
        leading: first.leading,
        trailing: first.trailing,
        forms: blade.ends.map(|end| {
            end.map(|end| match end {
                EdgeEnd::Ellipse => EdgeForm::Round,
                EdgeEnd::CutOff => EdgeForm::Flat,
            })
        }),
    };
    let far = given.sections.iter().flatten().map(|p| (p - given.sections[0][0]).norm()).fold(0.0, f64::max);
    let tolerance = (CHORD_SHARE * far).clamp(CHORD_LIMITS[0], CHORD_LIMITS[1]);
    let loft = BladeLoft::new(&given, |p| file.downstream(&(p / scale))).map_err(|e| e.to_string())?;
    let hub_sector = match (with_hub, file.n_blades) {
        (false, _) => None,
        (true, None) => return Err("has no \"Number of Blade Sets\", which a hub needs; add it".to_owned()),
        (true, Some(_)) if file.hub.is_empty() => {
            return Err("has no \"Hub Data File\", which a hub needs; add it".to_owned());
        }
        (true, Some(n_blades)) => Some(HubSector { n_blades, thickness: round_to((HUB_SHARE * far).max(1.0), 1) }),
    };
    let walls = Endwalls {
        axis: Unit::new_normalize(file.axis.direction()),
        hub: enlarged(&file.hub),
        shroud: enlarged(&file.shroud),
        hub_sector,
    };
    loft.mesh_between(&walls, tolerance).map_err(|e| e.to_string())
}
