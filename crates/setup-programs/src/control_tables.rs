//! Tool tables and work offsets of a job's clampings, as the control loads them.

use facemill_job::failure::Failure;
use facemill_job::load::job::Job;
use facemill_job::load::{letter, work_offset};
use facemill_job::validate::setup_names::file_stem;
use facemill_nc_program::dialect::TableForm;
use facemill_nc_program::{AxisSpec, Dialect, WrittenTable, write_work_offset};
use facemill_tool_library::{
    G10Control, TableUnit, g10_tool_lengths, heidenhain_tool_table, linuxcnc_table, siemens_tool_data,
};
use facemill_tool_model::ToolAssembly;

/// Tables of a clamping.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ControlTables {
    /// Names of the setups with one tool each that the clamping consists of.
    pub setups: Vec<String>,
    /// Names and contents: tool table and work offset.
    pub files: [(String, Vec<u8>); 2],
}

/// Returns the tool table and the work offset of each clamping of a job that asks for them
/// (`post.tables`): lengths, radii and machine values that its programs are planned with. None
/// where the job does not ask.
///
/// # Errors
/// If a gauge length is assumed, or a number or a value is none of the control's.
pub fn control_tables(job: &Job) -> Result<Vec<ControlTables>, Failure> {
    let form = job.post.rules().tables.filter(|_| job.post.tables());
    let Some(form) = form else { return Ok(Vec::new()) };
    let clampings = job.clampings();
    let is_alone = clampings.len() == 1;
    let changing = clampings.iter().filter(|(_, of)| of.len() > 1).count();
    // Numbers behind those of all programs.
    let first = (job.file.setups.len() + changing) as u32;
    let mut all = Vec::new();
    for (k, (name, of)) in clampings.into_iter().enumerate() {
        let suffix = if is_alone { String::new() } else { format!("-{}", file_stem(&name)) };
        let number = first + 2 * k as u32;
        let tools = tools_of(job, of.clone());
        let tools = tool_table(job, form, &tools, number)?;
        let offset = offset_table(job, (&name, of.start), number + 1)?;
        let named =
            |what: &str, table: WrittenTable| (format!("{what}{suffix}.{}", table.extension), table.text.into_bytes());
        let setups = of.map(|k| job.file.setups[k].name.clone()).collect();
        all.push(ControlTables { setups, files: [named("tool-table", tools), named("work-offset", offset)] });
    }
    Ok(all)
}

/// Returns the tools of setups, each once.
fn tools_of(job: &Job, setups: std::ops::Range<usize>) -> Vec<ToolAssembly> {
    let mut tools: Vec<ToolAssembly> = Vec::new();
    let second = job.second.iter().map(|second| second.tool.clone());
    for tool in setups.map(|k| job.for_setup(k).tool).chain(second) {
        if tools.iter().all(|known| known.number() != tool.number()) {
            tools.push(tool);
        }
    }
    tools
}

fn tool_table(job: &Job, form: TableForm, tools: &[ToolAssembly], number: u32) -> Result<WrittenTable, Failure> {
    let unit = TableUnit::Millimetre;
    let number = job.post.with_number_after(number).program_number();
    let control = match job.post.dialect() {
        Dialect::Haas => G10Control::Haas,
        Dialect::Mazak => G10Control::Mazak,
        _ => G10Control::Fanuc,
    };
    let (extension, text) = match form {
        TableForm::G10 => (job.post.extension(), g10_tool_lengths(tools, unit, control, number)),
        TableForm::LinuxCnc => ("tbl", linuxcnc_table(tools, unit)),
        TableForm::Siemens840d => ("spf", siemens_tool_data(tools, unit)),
        TableForm::Heidenhain => ("t", heidenhain_tool_table(tools, unit)),
        _ => return Err(Failure::Internal("a form of tables that is not written".to_owned())),
    };
    let text = text.map_err(|e| job.wrong(format!("post.tables: {e}")))?;
    Ok(WrittenTable { extension: extension.to_owned(), text })
}

fn offset_table(job: &Job, (name, setup): (&str, usize), number: u32) -> Result<WrittenTable, Failure> {
    let file = &job.file.setups[setup].work_offset;
    let wrong = |why: String| job.wrong(format!("post.tables: {why}"));
    let register = work_offset(&file.register).ok_or_else(|| wrong(format!("{} is no register", file.register)))?;
    let axis = |axis: &facemill_inverse_kinematics::Axis| {
        let own = axis.letter.as_str();
        let value = file.linear_mm.get(own).or_else(|| file.rotary_deg.get(own));
        Ok(AxisSpec {
            letter: letter(own)?,
            min: f64::NEG_INFINITY,
            max: f64::INFINITY,
            along_spindle: false,
            work_offset: value.copied().unwrap_or(0.0),
        })
    };
    let axes = job.machine.axes().iter().map(axis).collect::<Result<Vec<_>, Failure>>()?;
    let name = format!("{} - {name}", job.file.name);
    write_work_offset(&name, register, &axes, &job.post.with_number_after(number)).map_err(|e| wrong(e.to_string()))
}
