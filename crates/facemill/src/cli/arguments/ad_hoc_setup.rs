//! Arguments that name part, stock, machine and tool one by one, in place of a job.

use std::path::{Path, PathBuf};

use clap::Args;
use facemill::job_file::{UnitFile, UpAxisFile};
use facemill::nc_program::Dialect;
use facemill::surface_model::{ImportSettings, LengthUnit, MeshFormat, UpAxis};
use facemill::virtual_machine::Assumption;
use facemill::{AD_HOC_GOUGE_LIMIT, AdHocSetup, AdHocStock, Failure, Job};

/// Default register of the work offset.
pub(crate) const WORK_REGISTER: &str = "G54";

#[derive(Args)]
pub(crate) struct StandArguments {
    /// Mesh of the part (.obj, .stl, .gltf, .glb, .3mf), in place of a job: its frame is the
    /// workpiece frame
    #[arg(long, value_name = "MESH", requires_all = ["stock", "machine", "tool"], conflicts_with_all = ["job", "setup"])]
    part: Option<PathBuf>,
    /// Material before the program: box (the smallest around the part), offset:MM (a layer on the
    /// part), or a mesh
    #[arg(long, value_name = "MESH|box|offset:MM", value_parser = stock, requires = "part")]
    stock: Option<AdHocStock>,
    /// Machine file
    #[arg(long, value_name = "FILE", requires = "part")]
    machine: Option<PathBuf>,
    /// Tool file
    #[arg(long, value_name = "FILE", requires = "part")]
    tool: Option<PathBuf>,
    /// Mesh that nothing may touch, such as a clamp; several can be given
    #[arg(long, value_name = "MESH", requires = "part")]
    fixture: Vec<PathBuf>,
    /// Unit of all meshes: metre, centimetre, millimetre, inch; default: metre for glTF, millimetre
    /// for others
    #[arg(long, value_name = "UNIT", value_parser = unit, requires = "part")]
    mesh_unit: Option<UnitFile>,
    /// Up axis of all meshes: x, y, z; default: y for glTF, z for others
    #[arg(long, value_name = "AXIS", value_parser = up_axis, requires = "part")]
    mesh_up: Option<UpAxisFile>,
    /// Position of the workpiece frame on the machine's table, mm; default: 0,0,0
    #[arg(long, value_name = "X,Y,Z", value_parser = place, allow_hyphen_values = true, requires = "part")]
    mount: Option<[f64; 3]>,
    /// Machine's X, Y and Z at the program's zero, mm; default: 0,0,0
    #[arg(long, value_name = "X,Y,Z", value_parser = place, allow_hyphen_values = true, requires = "part")]
    work_offset: Option<[f64; 3]>,
    /// Register of the work offset: G54, G54P1 and so on, also for controls with other names
    /// (preset 1 of Heidenhain is G54); default: G54
    #[arg(long, value_name = "NAME", requires = "part")]
    work_register: Option<String>,
    /// Dialect file of the control, for functions that its machine builder made harmless; default:
    /// the dialect's own
    #[arg(long, value_name = "FILE", requires = "part")]
    dialect_file: Option<PathBuf>,
    /// Register of the tool's length (H); default: the tool file's
    #[arg(long, value_name = "N", requires = "part")]
    length_register: Option<u32>,
}

impl StandArguments {
    /// Returns the assumptions for omitted options that affect the findings; none if no part is
    /// named. `dialect` is the option for the control.
    pub(crate) fn assumptions(&self, dialect: Option<Dialect>) -> Vec<Assumption> {
        let (Some(part), Some(tool)) = (&self.part, &self.tool) else { return Vec::new() };
        let control = dialect.unwrap_or_default();
        let has_registers = !matches!(control, Dialect::Siemens840d | Dialect::Heidenhain);
        let [units, ups] = self.taken_meshes(part);
        let taken = [
            (dialect.is_none(), format!("no --dialect: the program is read as one for {}", control.name())),
            (self.mount.is_none(), "no --mount: the workpiece frame is taken to be that of the table".to_owned()),
            (
                self.work_offset.is_none(),
                "no --work-offset: the program's X, Y and Z are taken to be 0 where those of the machine are"
                    .to_owned(),
            ),
            (
                self.work_register.is_none(),
                format!("no --work-register: the work offset is taken to be in {WORK_REGISTER}"),
            ),
            (
                self.length_register.is_none() && has_registers,
                format!("no --length-register: the tool's length is taken to be where {} says", tool.display()),
            ),
            (self.mesh_unit.is_none(), format!("no --mesh-unit: {units}")),
            (self.mesh_up.is_none(), format!("no --mesh-up: {ups}")),
        ];
        taken.into_iter().filter(|(is_taken, _)| *is_taken).map(|(_, text)| Assumption { line: None, text }).collect()
    }

    /// Returns the assumptions on unit and up axis of part, stock and fixtures, by their formats.
    fn taken_meshes(&self, part: &Path) -> [String; 2] {
        let stock = self.stock.iter().filter_map(|stock| match stock {
            AdHocStock::Mesh(file) => Some(file.as_path()),
            AdHocStock::Box | AdHocStock::Offset(_) => None,
        });
        let mut meshes: Vec<&Path> = vec![part];
        for mesh in stock.chain(self.fixture.iter().map(PathBuf::as_path)) {
            if !meshes.contains(&mesh) {
                meshes.push(mesh);
            }
        }
        let taken = |mesh: &Path| {
            let settings = ImportSettings::default_for(MeshFormat::from_extension(mesh.extension()?.to_str()?)?);
            let unit = match settings.unit {
                LengthUnit::Metre => "metres",
                LengthUnit::Centimetre => "centimetres",
                LengthUnit::Millimetre => "millimetres",
                LengthUnit::Inch => "inches",
            };
            let up_axis = match settings.up_axis {
                UpAxis::X => "x",
                UpAxis::Y => "y",
                UpAxis::Z => "z",
            };
            Some([unit, up_axis])
        };
        let of_each = |describe: &dyn Fn(&Path, [&str; 2]) -> String| {
            let all = meshes.iter().filter_map(|mesh| Some(describe(mesh, taken(mesh)?)));
            all.collect::<Vec<_>>().join(", ")
        };
        [
            of_each(&|mesh, [unit, _]| format!("{} is taken in {unit}", mesh.display())),
            of_each(&|mesh, [_, up]| format!("{up} of {} is taken to be up", mesh.display())),
        ]
    }

    /// Returns the default depth of the cutter that is a finding, mm; `None` if no part is named:
    /// the job then sets it.
    pub(crate) fn gouge_limit(&self) -> Option<f64> {
        self.part.as_ref().map(|_| AD_HOC_GOUGE_LIMIT)
    }

    /// Returns the job of these arguments, for a program of this control; `None` if no part is
    /// named.
    ///
    /// # Errors
    /// As [`Job::of_ad_hoc_setup`].
    pub(crate) fn job(&self, dialect: Dialect) -> Result<Option<Job>, Failure> {
        // clap ensures that all four are present if one is.
        let (Some(part), Some(stock), Some(machine), Some(tool)) = (&self.part, &self.stock, &self.machine, &self.tool)
        else {
            return Ok(None);
        };
        let stand = AdHocSetup {
            part: part.clone(),
            fixtures: self.fixture.clone(),
            unit: self.mesh_unit,
            up_axis: self.mesh_up,
            stock: stock.clone(),
            machine: machine.clone(),
            tool: tool.clone(),
            length_register: self.length_register,
            dialect,
            dialect_file: self.dialect_file.clone(),
            mount: self.mount.unwrap_or_default(),
            work_offset: self.work_offset.unwrap_or_default(),
            register: self.work_register.clone().unwrap_or_else(|| WORK_REGISTER.to_owned()),
        };
        Job::of_ad_hoc_setup(&stand).map(Some)
    }
}

pub(crate) fn stock(text: &str) -> Result<AdHocStock, String> {
    if text == "box" {
        return Ok(AdHocStock::Box);
    }
    let Some(allowance) = text.strip_prefix("offset:") else { return Ok(AdHocStock::Mesh(PathBuf::from(text))) };
    match allowance.parse::<f64>() {
        Ok(mm) if mm >= 0.0 && mm.is_finite() => Ok(AdHocStock::Offset(mm)),
        _ => Err("offset: must be followed by a thickness in mm of at least 0, as in offset:2.5".to_owned()),
    }
}

/// Returns a position from three numbers, mm.
pub(crate) fn place(text: &str) -> Result<[f64; 3], String> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|part| part.trim().parse::<f64>()).collect();
    match numbers.as_deref() {
        Ok(&[x, y, z]) if [x, y, z].iter().all(|v| v.is_finite()) => Ok([x, y, z]),
        _ => Err("must be three numbers in mm with commas between, X,Y,Z".to_owned()),
    }
}

pub(crate) fn unit(text: &str) -> Result<UnitFile, String> {
    match text {
        "metre" => Ok(UnitFile::Metre),
        "centimetre" => Ok(UnitFile::Centimetre),
        "millimetre" => Ok(UnitFile::Millimetre),
        "inch" => Ok(UnitFile::Inch),
        _ => Err("must be metre, centimetre, millimetre or inch".to_owned()),
    }
}

pub(crate) fn up_axis(text: &str) -> Result<UpAxisFile, String> {
    match text {
        "x" => Ok(UpAxisFile::X),
        "y" => Ok(UpAxisFile::Y),
        "z" => Ok(UpAxisFile::Z),
        _ => Err("must be x, y or z".to_owned()),
    }
}

#[cfg(test)]
#[path = "../../../tests/unit/cli/arguments/ad_hoc_setup.rs"]
mod tests;
