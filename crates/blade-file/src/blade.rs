//! A blade from all of its files.

use nalgebra::{Point2, Point3};

use crate::curves::{CurveReader, ProfileSection};
use crate::fault::{BladeFault, BladeFileError};
use crate::info::{BladeInfo, EdgeEnd, MOST_PER_SET, RotationAxis};
use crate::section_checks::{check_ends, check_sections};

/// A blade, or a set of a main blade and its splitter blades, as its files describe it, mm.
#[derive(Clone, Debug, PartialEq)]
pub struct BladeFile {
    /// Axis of rotation.
    pub axis: RotationAxis,
    /// Number of blade sets around the axis; of blades, where a set is one blade.
    pub n_blades: Option<u32>,
    /// Blades of a set, at least one, in the order of the files: the main blade, then splitters.
    pub blades: Vec<ProfileBlade>,
    /// Hub from inlet to outlet; empty without a file.
    pub hub: Vec<Point3<f64>>,
    /// Shroud from inlet to outlet; empty without a file.
    pub shroud: Vec<Point3<f64>>,
}

/// One blade of a set.
#[derive(Clone, Debug, PartialEq)]
pub struct ProfileBlade {
    /// Form of leading and trailing edge, where the `.inf` file has it.
    pub ends: [Option<EdgeEnd>; 2],
    /// Sections from hub to shroud, at least two, all with the same number of points and the same
    /// marks.
    pub sections: Vec<ProfileSection>,
}

impl BladeFile {
    /// How far downstream a point is, mm: along the hub from its inlet to the place nearest to the
    /// point in the meridional plane; without a hub, along the axis of rotation.
    pub fn downstream(&self, point: &Point3<f64>) -> f64 {
        let seen = self.meridional(point);
        let (mut best, mut length) = ((f64::INFINITY, seen.x), 0.0);
        for pair in self.hub.windows(2) {
            let [a, b] = [&pair[0], &pair[1]].map(|p| self.meridional(p));
            let side = b - a;
            let share = ((seen - a).dot(&side) / side.norm_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
            let distance = (seen - (a + side * share)).norm();
            if distance < best.0 {
                best = (distance, length + share * side.norm());
            }
            length += side.norm();
        }
        best.1
    }

    /// Place along the axis, and distance from it.
    fn meridional(&self, point: &Point3<f64>) -> Point2<f64> {
        let axis = self.axis.direction();
        let along = axis.dot(&point.coords);
        Point2::new(along, (point.coords - axis * along).norm())
    }
}

/// Reads a blade, or a set of blades: `name` and `bytes` are those of the `.inf` file; `open`
/// returns the bytes of the files that it names, relative to its folder, or why it cannot.
///
/// # Errors
/// If a file is missing or describes no blade.
///
/// ```
/// use facemill_blade_file::read_blade;
///
/// let info = b"Geometry Units: MM\nProfile Data File: profile.curve\n";
/// let wrong = read_blade("blade.inf", info, |_| Ok(b"# Profile 1\n0 0 nan\n".to_vec())).unwrap_err();
/// assert!(wrong.to_string().starts_with("profile.curve, line 2: "));
/// ```
pub fn read_blade(
    name: &str,
    bytes: &[u8],
    mut open: impl FnMut(&str) -> Result<Vec<u8>, String>,
) -> Result<BladeFile, BladeFileError> {
    let info = BladeInfo::read(name, bytes)?;
    let mut content = |(file, line): &(String, usize)| {
        open(file).map_err(|why| BladeFileError::at(name, *line, BladeFault::Unread(why)))
    };
    let (mm_per_unit, mut n_points) = (info.mm_per_unit, 0);
    let mut polyline = |entry: &Option<(String, usize)>, n_points: &mut usize| match entry {
        None => Ok(Vec::new()),
        Some(entry) => CurveReader { file: &entry.0, mm_per_unit, n_points }.polyline(&content(entry)?),
    };
    let hub = polyline(&info.hub_file, &mut n_points)?;
    let shroud = polyline(&info.shroud_file, &mut n_points)?;
    let mut blades: Vec<(&str, Vec<ProfileSection>)> = Vec::new();
    for entry in &info.profile_files {
        let profile = content(entry)?;
        let of_file = CurveReader { file: &entry.0, mm_per_unit, n_points: &mut n_points }.blades(&profile)?;
        blades.extend(of_file.into_iter().map(|sections| (entry.0.as_str(), sections)));
    }
    // At most ten of each of as many profile files as the .inf file has lines.
    let found = u32::try_from(blades.len()).unwrap_or(u32::MAX);
    info.check_blades(name, found)?;
    if found > MOST_PER_SET {
        return Err(BladeFileError::of_file(name, BladeFault::TooManyBlades(MOST_PER_SET)));
    }
    let blade = |(number, (file, sections)): (u32, (&str, Vec<ProfileSection>))| {
        let blade = if found == 1 { "the blade".to_owned() } else { format!("blade {number}") };
        check_sections(file, &blade, &sections)?;
        let ends = info.ends_of(number);
        check_ends(file, &sections[0], &ends)?;
        Ok(ProfileBlade { ends, sections })
    };
    let blades = (0..).zip(blades).map(blade).collect::<Result<_, _>>()?;
    Ok(BladeFile { axis: info.axis, n_blades: info.n_blades, blades, hub, shroud })
}
