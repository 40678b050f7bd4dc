//! Tool tables of controls: what a control must know of a tool to run its programs.

use std::collections::BTreeMap;
use std::fmt::Write;

use facemill_tool_model::ToolAssembly;

/// Unit of the lengths of a table: that of the control's own configuration.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TableUnit {
    /// mm.
    #[default]
    Millimetre,
    /// Inch.
    Inch,
}

impl TableUnit {
    /// Returns a length, mm, in this unit: to a tenth of a micrometre.
    fn text(self, mm: f64) -> String {
        match self {
            Self::Millimetre => format!("{mm:.4}"),
            Self::Inch => format!("{:.6}", mm / 25.4),
        }
    }

    /// Returns a length, mm, in this unit, in the least increments that all controls take.
    fn word(self, mm: f64) -> String {
        match self {
            Self::Millimetre => format!("{mm:.3}"),
            Self::Inch => format!("{:.4}", mm / 25.4),
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Millimetre => "mm",
            Self::Inch => "inch",
        }
    }
}

/// Why tools have no table.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum TableError {
    /// There is nothing to write.
    #[error("there is no tool")]
    Empty,
    /// A number is larger than the control has.
    #[error("tool {number} \"{name}\": {control} has tool numbers up to {most}; give it another number")]
    Number {
        /// The number.
        number: u32,
        /// Name of the tool.
        name: String,
        /// The control.
        control: &'static str,
        /// Largest number.
        most: u32,
    },
    /// A length register is larger than the control has.
    #[error("tool {number} \"{name}\": its length_register is {register}, and {control} has {most}; give it another")]
    RegisterNumber {
        /// Number of the tool.
        number: u32,
        /// Its name.
        name: String,
        /// The register.
        register: u32,
        /// The control.
        control: &'static str,
        /// Largest register.
        most: u32,
    },
    /// Nobody measured the gauge length, or the holder that it follows from.
    #[error(
        "tool {number} \"{name}\": \"{key}\" is under \"assumed\", so its gauge length is not measured; a table with \
         it would pass the program's own check of the length. Measure the tool, correct gauge_length_mm, and remove \
         \"{key}\" from \"assumed\""
    )]
    AssumedLength {
        /// Number of the tool.
        number: u32,
        /// Its name.
        name: String,
        /// Key under `assumed`.
        key: String,
    },
    /// Two tools have one number.
    #[error("tools \"{first}\" and \"{second}\" both have number {number}; give one of them another")]
    SameNumber {
        /// The number.
        number: u32,
        /// Name of one.
        first: String,
        /// Name of the other.
        second: String,
    },
    /// The row of a length register is that of another tool.
    #[error(
        "tool {number} \"{name}\" has its length in register {register}, which in {control} is that of \"{other}\"; give it \
         another length_register"
    )]
    Register {
        /// Number of the tool.
        number: u32,
        /// Its name.
        name: String,
        /// The register.
        register: u32,
        /// The control.
        control: &'static str,
        /// Name of the tool that has this row.
        other: String,
    },
}

impl TableError {
    /// Returns the number of the tool with the fault, if it is of one.
    #[must_use]
    pub fn number(&self) -> Option<u32> {
        match self {
            Self::Empty => None,
            Self::Number { number, .. }
            | Self::AssumedLength { number, .. }
            | Self::RegisterNumber { number, .. }
            | Self::SameNumber { number, .. }
            | Self::Register { number, .. } => Some(*number),
        }
    }
}

/// Largest numbers of tools: LinuxCNC reads five digits, 840D numbers up to 32000, Heidenhain up to
/// 32767.
const MOST_LINUXCNC: u32 = 99_999;
const MOST_SIEMENS: u32 = 32_000;
const MOST_HEIDENHAIN: u32 = 32_767;

/// Longest comment of a row of LinuxCNC's table and of a tool of 840D.
const MOST_COMMENT: usize = 39;

/// Returns whether a key of a tool file decides the gauge length.
fn is_length_key(key: &str) -> bool {
    key == "gauge_length_mm" || key.starts_with("holder.sections")
}

/// Writes the tool table of LinuxCNC (`tool.tbl`), a row for each tool by number: T number, P
/// pocket (the number), Z gauge length, D diameter, comment. The control reads lengths in the unit
/// of its configuration, so the comment of each row begins with the unit of the row.
///
/// `G43 H` takes the row of that number. A tool with a length register of its own therefore has a
/// second row, of the register's number.
///
/// # Errors
/// Without a tool, where a gauge length is assumed, where numbers are too large or two of them the
/// same, and where a register is another tool's row.
pub fn linuxcnc_table(tools: &[ToolAssembly], unit: TableUnit) -> Result<String, TableError> {
    let by_number = by_number(tools, "LinuxCNC", MOST_LINUXCNC)?;
    let mut rows: BTreeMap<u32, (&ToolAssembly, String)> = BTreeMap::new();
    for (&number, tool) in &by_number {
        rows.insert(number, (tool, tool.name().to_owned()));
    }
    for (&number, tool) in &by_number {
        let register = tool.length_register();
        if register == number {
            continue;
        }
        if let Some((_, other)) = rows.insert(register, (tool, format!("length of T{number}"))) {
            let (name, control) = (tool.name().to_owned(), "LinuxCNC");
            return Err(TableError::Register { number, name, register, control, other });
        }
    }
    let mut text = String::new();
    for (number, (tool, comment)) in rows {
        let (length, diameter) = (unit.text(tool.gauge_length()), unit.text(2.0 * tool.cutter().radius()));
        let comment = plain(&format!("{}, {comment}", unit.name()), MOST_COMMENT);
        // Writing to a string does not fail.
        let _ = writeln!(text, "T{number} P{number} Z{length} D{diameter} ;{comment}");
    }
    Ok(text)
}

/// Writes a program for Siemens 840D that sets the data of tools in cutting edge D1: type, length
/// 1 (gauge length), radius and corner radius, lengths 2 and 3 as 0, and, for tool management, the
/// number as name: programs call tools by number (`T7`). G710, or G700 for inches, comes first:
/// values count in the unit in force.
///
/// Types are those that 3D radius compensation knows: 110 a ball, 120 sharp corners, 121 rounded
/// ones. Wear is left as it is: it is the operator's.
///
/// # Errors
/// Without a tool, where a gauge length is assumed, and where numbers are too large or two of them
/// the same.
pub fn siemens_tool_data(tools: &[ToolAssembly], unit: TableUnit) -> Result<String, TableError> {
    let by_number = by_number(tools, "840D", MOST_SIEMENS)?;
    let mut text = format!(
        "; TOOL DATA, {} TOOL(S), LENGTHS IN {}\n; LENGTH 1 IS FROM THE GAUGE LINE TO THE TIP\n{}\n",
        by_number.len(),
        unit.name().to_uppercase(),
        if unit == TableUnit::Inch { "G700" } else { "G710" }
    );
    for (number, tool) in by_number {
        let cutter = tool.cutter();
        let (radius, corner) = (cutter.radius(), cutter.corner_radius());
        let kind = if corner >= radius {
            110
        } else if corner > 0.0 {
            121
        } else {
            120
        };
        let comment = plain(tool.name(), MOST_COMMENT);
        let (length, radius, corner) = (unit.text(tool.gauge_length()), unit.text(radius), unit.text(corner));
        // Lengths 2 and 3 of an earlier tool with this number would stay in force.
        let _ = writeln!(
            text,
            "\n; T{number} {comment}\n$TC_TP1[{number}]=1\n$TC_TP2[{number}]=\"{number}\"\n$TC_DP1[{number},1]={kind}\n\
             $TC_DP3[{number},1]={length}\n$TC_DP4[{number},1]=0\n$TC_DP5[{number},1]=0\n\
             $TC_DP6[{number},1]={radius}\n$TC_DP7[{number},1]={corner}"
        );
    }
    text.push_str("\nM17\n");
    Ok(text)
}

/// Controls that take lengths of tools by G10.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum G10Control {
    /// FANUC, offset memory C.
    Fanuc,
    /// Haas.
    Haas,
    /// Mazak, EIA programs.
    Mazak,
}

impl G10Control {
    /// Returns its name, its last length register and the digits of its program numbers.
    fn limits(self) -> (&'static str, u32, usize) {
        match self {
            Self::Fanuc => ("FANUC", 999, 4),
            Self::Haas => ("Haas", 200, 5),
            Self::Mazak => ("Mazak", 999, 4),
        }
    }
}

/// Writes a program that sets the length registers of tools by G10: the geometry (L10) is the gauge
/// length, the wear (L11) 0. Radii are comments: programs have no radius compensation, and whether
/// their registers hold radii or diameters is a setting of the control.
///
/// # Errors
/// Without a tool, where a gauge length is assumed, where a register is larger than the control
/// has, and where two tools have one number or one register.
pub fn g10_tool_lengths(
    tools: &[ToolAssembly],
    unit: TableUnit,
    control: G10Control,
    program_number: u32,
) -> Result<String, TableError> {
    let (control, most, digits) = control.limits();
    let by_number = by_number(tools, control, u32::MAX)?;
    let unit_code = if unit == TableUnit::Inch { "G20" } else { "G21" };
    let mut text = format!("%\nO{program_number:0digits$} (LENGTHS OF {} TOOL[S])\n{unit_code} G90\n", by_number.len());
    let mut used: BTreeMap<u32, &str> = BTreeMap::new();
    for (number, tool) in by_number {
        let (register, name) = (tool.length_register(), tool.name().to_owned());
        if register > most {
            return Err(TableError::RegisterNumber { number, name, register, control, most });
        }
        if let Some(other) = used.insert(register, tool.name()) {
            return Err(TableError::Register { number, name, register, control, other: other.to_owned() });
        }
        let length = |mm| unit.word(mm);
        let (radius, corner) = (length(tool.cutter().radius()), length(tool.cutter().corner_radius()));
        let comment = plain(&name, MOST_COMMENT).to_uppercase();
        // Writing to a string does not fail.
        let _ = writeln!(
            text,
            "(T{number} {comment})\n(RADIUS {radius} CORNER RADIUS {corner})\nG10 L10 P{register} R{}\nG10 L11 P{register} R0.",
            length(tool.gauge_length())
        );
    }
    text.push_str("M30\n%\n");
    Ok(text)
}

/// Longest name in a tool table of Heidenhain; later controls take 32 characters.
const MOST_HEIDENHAIN_NAME: usize = 16;

/// Writes the tool table TOOL.T of Heidenhain controls, a row for each tool by number: T, NAME, L
/// (gauge length), R, R2 (corner radius), and the deltas DL, DR and DR2 as 0.
///
/// # Errors
/// Without a tool, where a gauge length is assumed, and where numbers are too large or two of them
/// the same.
pub fn heidenhain_tool_table(tools: &[ToolAssembly], unit: TableUnit) -> Result<String, TableError> {
    let by_number = by_number(tools, "Heidenhain", MOST_HEIDENHAIN)?;
    let row = |cells: [&str; 8]| {
        let [number, name, rest @ ..] = cells;
        let rest: String = rest.iter().map(|cell| format!(" {cell:<12}")).collect();
        format!("{number:<5} {name:<MOST_HEIDENHAIN_NAME$}{rest}").trim_end().to_owned()
    };
    let head = row(["T", "NAME", "L", "R", "R2", "DL", "DR", "DR2"]);
    let mut text = format!("BEGIN TOOL.T {}\n{head}\n", unit.name().to_uppercase());
    for (number, tool) in by_number {
        let name = plain(tool.name(), MOST_HEIDENHAIN_NAME).to_uppercase().replace(' ', "_");
        let values = [tool.gauge_length(), tool.cutter().radius(), tool.cutter().corner_radius()];
        let [length, radius, corner] = values.map(|mm| unit.text(mm));
        text.push_str(&row([&number.to_string(), &name, &length, &radius, &corner, "0", "0", "0"]));
        text.push('\n');
    }
    text.push_str("[END]\n");
    Ok(text)
}

fn by_number<'a>(
    tools: &'a [ToolAssembly],
    control: &'static str,
    most: u32,
) -> Result<BTreeMap<u32, &'a ToolAssembly>, TableError> {
    let mut by_number: BTreeMap<u32, &ToolAssembly> = BTreeMap::new();
    for tool in tools {
        let number = tool.number();
        let assumed = tool.to_file().assumed;
        if let Some(key) = assumed.into_iter().map(|one| one.key).find(|key| is_length_key(key)) {
            return Err(TableError::AssumedLength { number, name: tool.name().to_owned(), key });
        }
        if number > most {
            return Err(TableError::Number { number, name: tool.name().to_owned(), control, most });
        }
        if let Some(first) = by_number.insert(number, tool) {
            let (first, second) = (first.name().to_owned(), tool.name().to_owned());
            return Err(TableError::SameNumber { number, first, second });
        }
    }
    if by_number.is_empty() { Err(TableError::Empty) } else { Ok(by_number) }
}

/// Returns a name in letters that both controls read everywhere: ASCII without quotation marks and
/// marks of comments.
fn plain(name: &str, most: usize) -> String {
    let letter = |c: char| if (' '..='~').contains(&c) && !"\";()%".contains(c) { c } else { '_' };
    name.chars().map(letter).take(most).collect::<String>().trim().to_owned()
}
