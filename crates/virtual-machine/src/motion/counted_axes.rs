//! Which axes an F in mm/min counts, by control.

use std::collections::BTreeMap;

use facemill_inverse_kinematics::{AxisKind, AxisValues, Machine};
use facemill_nc_program::Dialect;
use facemill_nc_program::read::{Compensation, ReadBlock, ReadCommand};

/// Reference radius at which 1 deg of a rotary axis is 1 mm: FGREF.
const DEGREE_IS_A_MM: f64 = 180.0 / std::f64::consts::PI;

/// How far a reference radius may be from that, mm: the decimals that it is written with.
const RADIUS_ROUNDING: f64 = 1e-4;

/// Axes whose way F counts, as far as a program has said.
#[derive(Debug, Default)]
pub struct CountedAxes {
    /// FGROUP of a Siemens control; `None`: the geometry axes.
    group: Option<Vec<String>>,
    /// FGREF by axis.
    radii: BTreeMap<String, f64>,
}

impl CountedAxes {
    /// Takes note of what a block says of it.
    ///
    /// # Errors
    /// When it changes what F means in a way that is not followed.
    pub fn read(&mut self, dialect: Dialect, block: &ReadBlock) -> Result<(), String> {
        if dialect == Dialect::LinuxCnc && matches!(block.compensation, Compensation::Rtcp(_)) {
            return Err("M428 switches the kinematics, and words are no longer those of the axes".to_owned());
        }
        for command in &block.commands {
            if let ReadCommand::Function(code) = command
                && let Some(why) = changed_by(dialect, *code)
            {
                return Err(format!("M{code} {why}"));
            }
            let ReadCommand::Mode(text) = command else { continue };
            let plain: String = text.to_uppercase().split_whitespace().collect();
            if let Some(axes) = plain.strip_prefix("FGROUP(").and_then(|rest| rest.strip_suffix(')')) {
                let named: Vec<String> = axes.split(',').filter(|a| !a.is_empty()).map(str::to_owned).collect();
                self.group = (!named.is_empty()).then_some(named);
            } else if let Some((axis, value)) = plain.strip_prefix("FGREF[").and_then(|rest| rest.split_once("]=")) {
                let value = value.parse().map_err(|_| format!("{text}: its radius is not known"))?;
                self.radii.insert(axis.to_owned(), value);
            } else if changes_feeds(&plain) {
                let what =
                    "changes feeds, or the spindle's speed that they belong to; new ones would not be what they say";
                return Err(format!("{text} {what}"));
            }
        }
        Ok(())
    }

    /// Length of a block as F counts it, mm, and whether that is the norm over all axes (1 deg as 1
    /// mm), which the machine's range of F is of. `feed_unit` is how many mm/min an F of 1 is: in a
    /// program in inches 1 deg counts as 1 inch.
    ///
    /// # Errors
    /// When nothing moves that F counts, or it counts axes in a way that is not known.
    pub fn length(
        &self,
        dialect: Dialect,
        machine: &Machine,
        [from, to]: [&AxisValues; 2],
        feed_unit: f64,
    ) -> Result<(f64, bool), String> {
        let all = norm_of_all(machine, from, to);
        let norm = |kind: AxisKind| {
            let axes = machine.axes().iter().enumerate().filter(move |(_, a)| a.kind == kind);
            axes.map(|(k, a)| a.in_word_unit(to.get_or_zero(k) - from.get_or_zero(k))).fold(0.0, f64::hypot)
        };
        let (linear, turn) = (norm(AxisKind::Linear), norm(AxisKind::Rotary));
        let counts_all = match dialect {
            Dialect::LinuxCnc => false,
            Dialect::Siemens840d => self.is_all(machine)?,
            _ => true,
        };
        let has_turns = turn > 0.0 && (counts_all || linear == 0.0);
        if !counts_all && linear == 0.0 && all > 0.0 && dialect != Dialect::LinuxCnc {
            return Err(
                "rotary axes alone move, and FGROUP does not have them: what F means there is the machine's".to_owned()
            );
        }
        if has_turns && feed_unit != 1.0 {
            if dialect == Dialect::Heidenhain {
                return Err(
                    "how F of a program in inches counts rotary axes is not known on this control; give one in mm"
                        .to_owned(),
                );
            }
            return Ok((linear.hypot(feed_unit * turn), false));
        }
        // Of LinuxCNC F is deg/min where nothing linear moves.
        Ok(if counts_all || linear == 0.0 { (all, counts_all && feed_unit == 1.0) } else { (linear, false) })
    }

    /// Whether F is the speed of the tip under TRAORI of a Siemens control, where FGROUP has the
    /// linear axes alone.
    ///
    /// # Errors
    /// When FGROUP has other axes, too.
    pub fn check_tip(&self, machine: &Machine) -> Result<(), String> {
        match self.is_all(machine)? {
            false => Ok(()),
            true => Err("FGROUP counts rotary axes, too, and F is not the speed of the tip".to_owned()),
        }
    }

    /// Whether FGROUP has all axes, 1 deg as 1 mm, and not the linear ones alone.
    fn is_all(&self, machine: &Machine) -> Result<bool, String> {
        let Some(group) = &self.group else { return Ok(false) };
        let has = |name: &str| group.iter().any(|axis| axis == name);
        let of_kind = |kind| machine.axes().iter().filter(move |a| a.kind == kind).map(|a| a.letter.to_string());
        let linear = of_kind(AxisKind::Linear).all(|name| has(&name));
        let rotary: Vec<String> = of_kind(AxisKind::Rotary).collect();
        let is_mm = |name: &String| self.radii.get(name).is_some_and(|r| (r - DEGREE_IS_A_MM).abs() < RADIUS_ROUNDING);
        match rotary.iter().filter(|name| has(name)).count() {
            0 if linear => Ok(false),
            n if linear && n == rotary.len() && rotary.iter().all(is_mm) => Ok(true),
            _ => Err(format!(
                "FGROUP({}) is neither the linear axes alone nor all axes with FGREF 57.29578 of the rotary ones",
                group.join(",")
            )),
        }
    }
}

/// Why F is not followed behind an M function, where it changes what F counts or how fast a block
/// goes at its F.
fn changed_by(dialect: Dialect, code: u32) -> Option<&'static str> {
    Some(match (dialect, code) {
        (Dialect::LinuxCnc, 430) => "switches the kinematics, and words are no longer those of the axes",
        (Dialect::Heidenhain, 103) => "lowers the feed of plunging; new feeds would not be what they say",
        (Dialect::Heidenhain, 109 | 110) => {
            "holds F at the cutting edge of arcs; feeds would not be what they say: M111 is how feeds are followed"
        }
        (Dialect::Heidenhain, 116) => {
            "makes F of rotary axes mm/min; feeds would not be what they say: M117 is how feeds are followed"
        }
        _ => return None,
    })
}

/// Whether an M function is the control's own and of feeds alone, so that it is no function of the
/// machine's builder: those that [`CountedAxes`] tells of, and M111 and M117, which switch back.
pub(crate) fn is_of_feeds(dialect: Dialect, code: u32) -> bool {
    dialect == Dialect::Heidenhain && (changed_by(dialect, code).is_some() || matches!(code, 111 | 117))
}

/// Whether a word of a Siemens control (upper case, no blanks) changes how fast a block goes at its
/// F: overrides (OVR, OVRA, OVRRAP), feeds of one block (FB), tooth (FZ), hand wheel (FD), cutting
/// speed (SVC), axis (FA, FMA, FL), corner (FRC, FRCM) or turn (FPR, FPRAON), and feeds that change
/// along the path (FLIN, FCUB, FPO); LIMS lowers the spindle, whose speed F belongs to.
fn changes_feeds(plain: &str) -> bool {
    let name = plain.split(|c: char| !c.is_ascii_alphanumeric()).next().unwrap_or(plain);
    matches!(
        name,
        "OVR"
            | "OVRA"
            | "OVRRAP"
            | "FA"
            | "FAD"
            | "FB"
            | "FCUB"
            | "FD"
            | "FL"
            | "FLIN"
            | "FMA"
            | "FPO"
            | "FPR"
            | "FPRAON"
            | "FRC"
            | "FRCM"
            | "FZ"
            | "LIMS"
            | "SVC"
    )
}

/// Euclidean norm over all axes, mm and deg (FEED (1)).
pub(crate) fn norm_of_all(machine: &Machine, from: &AxisValues, to: &AxisValues) -> f64 {
    let way = |k: usize| machine.axes()[k].in_word_unit(to.get_or_zero(k) - from.get_or_zero(k));
    (0..machine.axes().len()).map(way).fold(0.0, f64::hypot)
}
