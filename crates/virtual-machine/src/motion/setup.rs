use facemill_cl_data::Cancelled;
use facemill_interference::Interference;
use facemill_inverse_kinematics::Machine;
use facemill_nc_program::{MappedHead, WordMap};
use facemill_tool_model::ToolAssembly;
use nalgebra::Isometry3;

/// The machine as it stands when the program is started: what turns words into motion, and what is
/// in the way.
///
/// Of a machine of several heads it is that of one of them, and a program is run once for each:
/// [`VirtualSetup::machine`] is the head's view, with the axes of all heads,
/// [`VirtualSetup::words`] a map with heads, which is the same for all, and tool and length
/// register are the head's own. Bodies of the other head, and of its tool, are bodies of the view.
#[derive(Clone)]
pub struct VirtualSetup<'a> {
    /// The machine; its motion laws, limits and bodies count.
    pub machine: &'a Machine,
    /// Where the workpiece is mounted on the table.
    pub table_from_work: Isometry3<f64>,
    /// Work offset and length compensation as set on the control: how words become axis values. Its
    /// axes are the machine's, in the same order.
    pub words: &'a WordMap,
    /// Table frame ← frame of X, Y and Z words while RTCP is on. `None` for a machine without X, Y
    /// and Z at right angles: the end of every motion under RTCP is then unknown, a finding.
    pub table_from_rtcp_words: Option<Isometry3<f64>>,
    /// The tool that the program is to put into the spindle.
    pub tool: &'a ToolAssembly,
    /// Number of the register (H) that holds the tool's length; any other one holds nobody knows
    /// what.
    pub length_register: u32,
    /// Obstacles on the table. Bodies of the machine are not among them: all of them come from the
    /// machine.
    pub obstacles: Vec<VirtualObstacle<'a>>,
}

/// Object on the machine's table, as a mesh in the workpiece frame.
#[derive(Clone)]
pub struct VirtualObstacle<'a> {
    /// Name in findings.
    pub name: String,
    /// Its mesh, workpiece frame.
    pub mesh: &'a dyn Interference,
    /// Kind, which limits the cutter.
    pub kind: ObstacleKind,
    /// Material that the cutter has to leave on the mesh, mm.
    pub allowance: f64,
    /// Thickness of uncut stock on the mesh, mm: the cutter in rapid and every other body keep out
    /// of it.
    pub stock: f64,
}

/// Kind of an obstacle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ObstacleKind {
    /// The part: not to be cut below its allowance.
    Part,
    /// A check surface: as the part, with an allowance of its own.
    Check,
    /// A clamp or fixture: not to be touched by anything.
    Fixture,
    /// The stock before cutting: the cutter may enter it, but only in cutting moves.
    Stock,
}

/// How closely the program is looked at, and what is a finding.
#[derive(Clone, Debug, PartialEq)]
pub struct VerifySettings {
    /// Largest way of tip and rim of the cutter, relative to the workpiece, between two tested
    /// positions, mm.
    pub max_step: f64,
    /// Largest turn of the tool axis, relative to the workpiece, between two tested positions, rad.
    pub max_turn: f64,
    /// How much nearer than at tested positions a body may come between them, and how much deeper
    /// the cutter, mm. Positions are added until it is known. Smaller: more of them.
    pub between: f64,
    /// Depth of the cutter below an obstacle's allowance beyond which it is a finding, mm, on lines
    /// before the first section.
    pub gouge_limit: f64,
    /// Parts of the program with gouge limits of their own, in the order of their lines.
    pub sections: Vec<GougeSection>,
    /// Part of a body's clearance that a program may use up between planned points before it is a
    /// collision, mm: poses are planned to touch the clearance, and words are rounded. Up to this
    /// much is a near miss. Too small: every pose at the border of its clearance is reported; too
    /// large: the clearance is not one.
    pub clearance_slack: f64,
    /// Distance outside its clearance up to which a body is reported as a near miss, mm.
    pub near_miss: f64,
    /// How much steeper than the tool allows a ramp may be, rad.
    pub ramp_slack: f64,
    /// Fraction by which an axis may exceed its largest velocity: feeds are written with few
    /// digits.
    pub velocity_slack: f64,
    /// Angle between tool axis and pole (where the tool axis is parallel to the first rotary axis)
    /// up to which a cut is near it, rad.
    pub singular_cone: f64,
    /// Excess of a rotary axis's turn over that of the tool axis in one cutting block near the pole
    /// from which it is reported, rad.
    pub singular_turn: f64,
    /// Limit of the cutter's removal where the stock is cut; `None` for no limit.
    pub removal: Option<RemovalLimit>,
    /// Share by which it may take more: volumes are those of lines, and means over half the
    /// cutter's radius or ten cells.
    pub removal_slack: f64,
    /// Bodies and stock that other runs check against the current stock: this run does not check
    /// them against the initial stock.
    pub as_cut: HeldAsCut,
    /// Lines of the blocks of which [`run_stock`](crate::stock::run::run_stock) is to tell whether
    /// they certainly cut ([`BlockCut::is_certain`](crate::stock::run::BlockCut::is_certain)) or
    /// may be near stock ([`BlockCut::may_be_near`](crate::stock::run::BlockCut::may_be_near)), in
    /// any order: each takes the time of two more sweeps.
    pub probed_lines: Vec<u32>,
    /// Whether the text is a whole program, which has to say where it ends.
    pub is_whole: bool,
    /// Only estimate collisions, from few positions; `None`: as
    /// [`verify`](crate::run::verify::verify) promises.
    pub estimate: Option<Estimate>,
}

/// The paper's rule (VMT), which is fast and proves nothing: in rapids positions a radius of the
/// cutter apart, and only the edges of cutter and bodies.
///
/// Its findings are real; it misses contacts between positions, and those of a side between the
/// edges of a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// Largest way of tip, rim and gauge line, relative to the workpiece, between two positions of
    /// a cutting move, mm. The ends of blocks are positions, too.
    pub cut_step: f64,
}

impl Default for Estimate {
    /// Positions in cuts at most 2 mm apart.
    fn default() -> Self {
        Self { cut_step: 2.0 }
    }
}

/// Parts that runs with cutting check against the current stock; all else is checked against the
/// initial stock, which is on the safe side.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct HeldAsCut {
    /// Tool assembly, cutter in rapid, ramps and the cutter's core: by
    /// [`run_stock`](crate::stock::run::run_stock).
    pub tool: bool,
    /// Bodies of the machine: by
    /// [`remaining_collisions`](crate::stock::unresolved_findings::remaining_collisions), of what
    /// they meet of the stock as it was at first.
    pub machine: bool,
}

impl HeldAsCut {
    /// Where no stock is cut.
    pub const NOTHING: Self = Self { tool: false, machine: false };
    /// Where it is not known what is left between the lines that the stock is cut on.
    pub const TOOL: Self = Self { tool: true, machine: false };
    /// Where it is.
    pub const ALL: Self = Self { tool: true, machine: true };
}

/// How much a cutter may take at a time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RemovalLimit {
    /// Largest removal rate, mm³/min.
    pub largest: f64,
    /// Speed of the tip up to which any rate is allowed, mm/min: the slowest that the job lowers
    /// its feeds to.
    pub slowest: f64,
}

/// A part of the program, from one line to that of the next section, such as an operation with its
/// error budget.
#[derive(Clone, Debug, PartialEq)]
pub struct GougeSection {
    /// Name in reports.
    pub name: String,
    /// Its first line, from 1; above that of the section before.
    pub first_line: u32,
    /// As [`VerifySettings::gouge_limit`], for this part, mm.
    pub gouge_limit: f64,
}

impl VerifySettings {
    /// Number of sections that begin at or before a line: 0 before the first one.
    pub(crate) fn section_of(&self, line: u32) -> usize {
        self.sections.partition_point(|s| s.first_line <= line)
    }

    /// Gouge limit in the part of this number, as [`VerifySettings::section_of`] counts, mm.
    pub(crate) fn gouge_limit_in(&self, section: usize) -> f64 {
        section.checked_sub(1).and_then(|k| self.sections.get(k)).map_or(self.gouge_limit, |s| s.gouge_limit)
    }
}

impl Default for VerifySettings {
    /// Positions at most 0.5 mm and 0.2° apart, and between them nothing by more than 0.05 mm
    /// worse; gouges beyond 0.02 mm; 0.1 mm of clearance slack, no near misses outside the
    /// clearance; ramps by 0.1°, velocities by 2 % and removal rates by 10 % beyond; turns by more
    /// than 10° within 1° of the pole.
    fn default() -> Self {
        Self {
            max_step: 0.5,
            max_turn: 0.2_f64.to_radians(),
            between: 0.05,
            gouge_limit: 0.02,
            sections: Vec::new(),
            clearance_slack: 0.1,
            near_miss: 0.0,
            ramp_slack: 0.1_f64.to_radians(),
            velocity_slack: 0.02,
            singular_cone: 1f64.to_radians(),
            singular_turn: 10f64.to_radians(),
            removal: None,
            removal_slack: 0.1,
            as_cut: HeldAsCut::NOTHING,
            probed_lines: Vec::new(),
            is_whole: false,
            estimate: None,
        }
    }
}

/// Why a program was not verified.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum VerifyError {
    /// Stopped by the monitor.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// The word map is not the machine's.
    #[error("the word map has the axes {words}, the machine {machine}")]
    OtherAxes {
        /// Axes of the word map.
        words: String,
        /// Axes of the machine.
        machine: String,
    },
    /// The machine has more or fewer heads than the word map.
    #[error("the word map has {words} head(s), the machine {machine}")]
    HeadCount {
        /// Heads of the word map.
        words: usize,
        /// Heads of the machine.
        machine: usize,
    },
    /// None of several heads has the setup's length register.
    #[error("length_register is H{register}, which is none of the heads' of the word map")]
    NoHead {
        /// As given.
        register: u32,
    },
    /// The head that the word map has for the length register is not that of the setup.
    #[error("the word map has {words} for {what} of the head `{head}`, the setup {setup}")]
    OtherHead {
        /// Its name.
        head: String,
        /// `the tool number`, `the tool length`.
        what: &'static str,
        /// Of the word map.
        words: f64,
        /// Of the setup.
        setup: f64,
    },
    /// The machine is the view of another head.
    #[error("the machine is no view of the head `{head}`: axis {axis} {problem}")]
    OtherView {
        /// Its name.
        head: String,
        /// Spindle axis of this or another head.
        axis: String,
        /// Fault.
        problem: &'static str,
    },
    /// A body of the machine has no mesh.
    #[error("the body `{body}` of the machine: {problem}")]
    Body {
        /// Its name.
        body: String,
        /// Fault.
        problem: String,
    },
    /// A length of an obstacle is out of its range.
    #[error("{field} of obstacle `{obstacle}` is {value} mm: it must be a finite length of at least 0")]
    Obstacle {
        /// Its name.
        obstacle: String,
        /// `allowance` or `stock`.
        field: &'static str,
        /// As given.
        value: f64,
    },
    /// A tool cannot have a requested property.
    #[error("the tool: {problem}")]
    Tool {
        /// Why.
        problem: String,
    },
    /// A motion cannot be swept.
    #[error("the stock cannot be cut: {problem}")]
    Sweep {
        /// Why.
        problem: String,
    },
    /// The caller requests a proof together with [`VerifySettings::estimate`].
    #[error("{what} cannot be estimated: leave out `estimate` of the settings")]
    Estimated {
        /// Subject.
        what: &'static str,
    },
    /// Setups of several heads do not stand on one machine with one workpiece.
    #[error("setup {setup} of the heads that cut one stock {what}: give the setups of one machine, one for each head")]
    OneStock {
        /// Its number, from 1.
        setup: usize,
        /// Fault.
        what: String,
    },
    /// A section does not follow the one before.
    #[error(
        "section `{section}` starts on line {line}: sections must be in the order of their lines, from 1, each on its own"
    )]
    SectionOrder {
        /// Its name.
        section: String,
        /// Its first line.
        line: u32,
    },
    /// A setting is out of its range.
    #[error("{field} is {value}: it must be finite and {needed}")]
    Setting {
        /// Its name.
        field: &'static str,
        /// As given.
        value: f64,
        /// Required value.
        needed: &'static str,
    },
}

/// Checks what the types do not: axes, lengths and settings.
pub(crate) fn check(setup: &VirtualSetup<'_>, settings: &VerifySettings) -> Result<(), VerifyError> {
    let words: Vec<String> = setup.words.axes().iter().map(|a| a.letter.to_string()).collect();
    let machine: Vec<String> = setup.machine.axes().iter().map(|a| a.letter.to_string()).collect();
    if words != machine {
        return Err(VerifyError::OtherAxes { words: words.join(" "), machine: machine.join(" ") });
    }
    check_head(setup)?;
    for o in &setup.obstacles {
        for (field, value) in [("allowance", o.allowance), ("stock", o.stock)] {
            if !(value >= 0.0 && value.is_finite()) {
                return Err(VerifyError::Obstacle { obstacle: o.name.clone(), field, value });
            }
        }
    }
    for (field, value) in
        [("max_step", settings.max_step), ("max_turn", settings.max_turn), ("between", settings.between)]
    {
        if !(value > 0.0 && value.is_finite()) {
            return Err(VerifyError::Setting { field, value, needed: "above 0" });
        }
    }
    for (field, value) in [
        ("gouge_limit", settings.gouge_limit),
        ("clearance_slack", settings.clearance_slack),
        ("near_miss", settings.near_miss),
        ("ramp_slack", settings.ramp_slack),
        ("velocity_slack", settings.velocity_slack),
        ("singular_cone", settings.singular_cone),
        ("singular_turn", settings.singular_turn),
        ("removal_slack", settings.removal_slack),
    ] {
        if !(value >= 0.0 && value.is_finite()) {
            return Err(VerifyError::Setting { field, value, needed: "at least 0" });
        }
    }
    if let Some(Estimate { cut_step: value }) = settings.estimate
        && !(value > 0.0 && value.is_finite())
    {
        return Err(VerifyError::Setting { field: "estimate.cut_step", value, needed: "above 0" });
    }
    if let Some(RemovalLimit { largest, slowest }) = settings.removal {
        if !(largest > 0.0 && largest.is_finite()) {
            return Err(VerifyError::Setting { field: "removal.largest", value: largest, needed: "above 0" });
        }
        if !(slowest >= 0.0 && slowest.is_finite()) {
            return Err(VerifyError::Setting { field: "removal.slowest", value: slowest, needed: "at least 0" });
        }
    }
    check_sections(&settings.sections)
}

/// By how much two lengths of one tool may differ, mm: rounding.
const SAME_LENGTH: f64 = 1e-6;

/// Of a machine of several heads: the setup has the tool of one of them, and the machine is the
/// view of that one.
fn check_head(setup: &VirtualSetup<'_>) -> Result<(), VerifyError> {
    let (heads, n_views) = (setup.words.heads(), setup.machine.head_count());
    if heads.len().max(1) != n_views {
        return Err(VerifyError::HeadCount { words: heads.len().max(1), machine: n_views });
    }
    if heads.is_empty() {
        return Ok(());
    }
    let own = own_head(setup).ok_or(VerifyError::NoHead { register: setup.length_register })?;
    let (number, length) = (setup.tool.number(), setup.tool.gauge_length());
    let other = |what, words, setup| Err(VerifyError::OtherHead { head: own.name.clone(), what, words, setup });
    if own.tool_number != number {
        return other("the tool number", f64::from(own.tool_number), f64::from(number));
    }
    if (own.tool_length - length).abs() > SAME_LENGTH {
        return other("the tool length", own.tool_length, length);
    }
    for head in heads {
        let axis = setup.words.axes().iter().position(|a| a.letter == head.spindle_axis);
        let problem = match (head == own, axis.is_some_and(|k| setup.machine.moves_tool(k))) {
            (true, false) => "does not move its tool",
            (false, true) => "of another head moves its tool",
            _ => continue,
        };
        let (head, axis) = (own.name.clone(), head.spindle_axis.to_string());
        return Err(VerifyError::OtherView { head, axis, problem });
    }
    Ok(())
}

fn check_sections(sections: &[GougeSection]) -> Result<(), VerifyError> {
    let mut line_before = 0;
    for s in sections {
        if s.first_line <= line_before {
            return Err(VerifyError::SectionOrder { section: s.name.clone(), line: s.first_line });
        }
        line_before = s.first_line;
        if !(s.gouge_limit >= 0.0 && s.gouge_limit.is_finite()) {
            let (field, value) = ("gouge_limit of a section", s.gouge_limit);
            return Err(VerifyError::Setting { field, value, needed: "at least 0" });
        }
    }
    Ok(())
}

/// The head that a setup is of, on a machine of several: the one with its length register.
pub(crate) fn own_head<'a>(setup: &'a VirtualSetup<'a>) -> Option<&'a MappedHead> {
    setup.words.heads().iter().find(|head| head.length_register == setup.length_register)
}
