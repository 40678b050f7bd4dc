//! Blades of an `.inf` file as meshes.

use std::path::Path;

use facemill_blade_file::{BladeFile, EdgeEnd, ProfileBlade, ProfileSection, read_blade};
use facemill_sample_parts::{BladeLoft, BladeSections, EdgeForm, Endwalls, HubLine, HubSector, HubSet, LoftedBlade};
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

/// Returns each blade of a description between its hub and shroud, `scale` times as large; with the
/// sector of the hub around each, up to the middle between blades, if requested. Every given point
/// between the walls is a vertex.
///
/// # Errors
/// If the points describe no smooth blade, or there is no place for a hub.
pub fn lofted_blades(file: &BladeFile, scale: f64, with_hub: bool) -> Result<Vec<SetBlade>, String> {
    let n = file.blades.len();
    let name = |k: usize| match (n, k) {
        (1, _) => String::new(),
        (_, 0) => "main".to_owned(),
        (2, _) => "splitter".to_owned(),
        _ => format!("splitter-{k}"),
    };
    let in_blade = |k: usize, why: String| match name(k) {
        name if name.is_empty() => why,
        name => format!("blade {k} ({name}): {why}"),
    };
    let loft = |(k, blade)| SmoothBlade::new(file, blade, scale).map_err(|why| in_blade(k, why));
    let lofts: Vec<SmoothBlade> = file.blades.iter().enumerate().map(loft).collect::<Result<_, _>>()?;
    let mut walls = Endwalls {
        axis: Unit::new_normalize(file.axis.direction()),
        hub: enlarged(&file.hub, scale),
        shroud: enlarged(&file.shroud, scale),
        hub_sector: None,
    };
    let sectors = if with_hub { hub_sectors(file, &lofts, &walls, in_blade)? } else { Vec::new() };
    let mut blades = Vec::new();
    for (k, SmoothBlade { loft, tolerance, .. }) in lofts.iter().enumerate() {
        walls.hub_sector = sectors.get(k).cloned();
        let lofted = loft.mesh_between(&walls, *tolerance).map_err(|e| in_blade(k, e.to_string()))?;
        blades.push(SetBlade { name: name(k), lofted });
    }
    Ok(blades)
}

/// Returns the sector of the hub of each blade.
fn hub_sectors(
    file: &BladeFile,
    blades: &[SmoothBlade],
    walls: &Endwalls,
    in_blade: impl Fn(usize, String) -> String,
) -> Result<Vec<HubSector>, String> {
    let n_blades = file.n_blades.ok_or("has no \"Number of Blade Sets\", which a hub needs; add it")?;
    if file.hub.is_empty() {
        return Err("has no \"Hub Data File\", which a hub needs; add it".to_owned());
    }
    let size = blades.iter().map(|blade| blade.size).fold(0.0, f64::max);
    let thickness = round_to((HUB_SHARE * size).max(1.0), 1);
    let line =
        |(k, blade): (usize, &SmoothBlade)| blade.loft.line_on_hub(walls).map_err(|e| in_blade(k, e.to_string()));
    let lines: Vec<HubLine> = blades.iter().enumerate().map(line).collect::<Result<_, _>>()?;
    let set = |own: usize| (blades.len() > 1).then(|| HubSet { lines: lines.clone(), own });
    Ok((0..blades.len()).map(|own| HubSector { n_blades, thickness, set: set(own) }).collect())
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

/// A blade as a smooth surface.
struct SmoothBlade {
    loft: BladeLoft,
    /// Largest distance of its points from the first one, mm.
    size: f64,
    /// Chord tolerance of its mesh, mm.
    tolerance: f64,
}

impl SmoothBlade {
    /// The blade, as large as requested.
    fn new(file: &BladeFile, blade: &ProfileBlade, scale: f64) -> Result<Self, String> {
        let scaled = |section: &ProfileSection| enlarged(&section.points, scale);
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
        let size = given.sections.iter().flatten().map(|p| (p - given.sections[0][0]).norm()).fold(0.0, f64::max);
        let tolerance = (CHORD_SHARE * size).clamp(CHORD_LIMITS[0], CHORD_LIMITS[1]);
        let loft = BladeLoft::new(&given, |p| file.downstream(&(p / scale))).map_err(|e| e.to_string())?;
        Ok(Self { loft, size, tolerance })
    }
}

fn enlarged(points: &[Point3<f64>], scale: f64) -> Vec<Point3<f64>> {
    points.iter().map(|p| p * scale).collect()
}
