//! How the control moves: what a dialect's words select, and whether that is what plan and
//! verification assume.

use facemill_cl_data::{ControlTolerance, CuttingLaw, MotionLaw, RapidLaw};

use crate::dialect::file::{CuttingRule, RtcpRapids, RtcpRule, Switch};
use crate::dialect::fill;
use crate::dialect::post_file::{Orientation, PostError, PostSettings};
use crate::program::FeedMode;
use crate::program::write_error::WriteError;
use crate::words::axis_words::{AxisLetter, AxisWords};
use crate::words::number_text;

/// Decimals of tolerances in words.
const TOLERANCE_DECIMALS: u8 = 4;

impl PostSettings {
    /// The same for a machine: the motion law that plan and verification assume, and where its axes
    /// stand at the reference position (machine values, mm or deg).
    ///
    /// # Errors
    /// When the control does not move so: its words select another law, or none does.
    pub fn on_machine(&self, motion: MotionLaw, home: AxisWords) -> Result<Self, PostError> {
        self.check_rapid(motion.rapid)?;
        self.check_cutting(motion.cutting)?;
        Ok(Self { motion: Some(motion), home: Some(home), ..self.clone() })
    }

    /// The law that the words of a program select: axes on a line without RTCP, and with it the
    /// machine's, or the dialect's first where no machine has been said.
    #[must_use]
    pub fn cutting_law(&self) -> CuttingLaw {
        self.rtcp_law().map_or(CuttingLaw::AxesLinear, |rule| rule.law.into())
    }

    fn check_rapid(&self, law: RapidLaw) -> Result<(), PostError> {
        let is_linear = law == RapidLaw::Linear;
        if self.rules.rapid(is_linear).is_some() {
            return Ok(());
        }
        let (value, allowed) = if is_linear { ("linear", "per_axis") } else { ("per_axis", "linear") };
        Err(PostError::Law { name: self.rules.name.clone(), key: "motion.rapid", value, allowed: allowed.to_owned() })
    }

    fn check_cutting(&self, law: CuttingLaw) -> Result<(), PostError> {
        let Some(rtcp) = self.rules.motion.rtcp.as_ref().filter(|_| self.feed_mode == FeedMode::Rtcp) else {
            return Ok(());
        };
        let rules = self.sayable_laws(rtcp);
        if rules.iter().any(|rule| CuttingLaw::from(rule.law) == law) {
            return Ok(());
        }
        let allowed: Vec<&str> = rules.iter().map(|c| law_name(c.law.into())).collect();
        let (name, value) = (self.rules.name.clone(), law_name(law));
        Err(PostError::Law { name, key: "motion.cutting", value, allowed: allowed.join(" or ") })
    }

    /// `None` without RTCP.
    pub(crate) fn rtcp_law(&self) -> Option<&CuttingRule> {
        let rtcp = self.rules.motion.rtcp.as_ref().filter(|_| self.feed_mode == FeedMode::Rtcp)?;
        let rules = self.sayable_laws(rtcp);
        let of_machine = |rule: &&&CuttingRule| self.motion.is_some_and(|m| m.cutting == CuttingLaw::from(rule.law));
        rules.iter().find(of_machine).or(rules.first()).copied()
    }

    /// The laws that can be had with the way in which the tool's direction is said.
    fn sayable_laws<'a>(&self, rtcp: &'a RtcpRule) -> Vec<&'a CuttingRule> {
        let vectors = rtcp.vectors.as_ref().filter(|_| self.orientation == Orientation::Vectors);
        rtcp.cutting.iter().filter(|rule| vectors.is_none_or(|v| v.laws.contains(&rule.law))).collect()
    }

    /// Returns the motion of rapids under RTCP; `None` without it. Plan and verification have to
    /// assume the same.
    #[must_use]
    pub fn rtcp_rapids(&self) -> Option<RtcpRapids> {
        let rtcp = self.rules.motion.rtcp.as_ref().filter(|_| self.feed_mode == FeedMode::Rtcp);
        rtcp.map(|r| r.rapids)
    }

    /// Returns the words that switch RTCP on with this length register, in order of the text; none
    /// of a setting without it.
    #[must_use]
    pub fn rtcp_on_words(&self, register: u32) -> Vec<String> {
        let rtcp = self.rules.motion.rtcp.as_ref().filter(|_| self.feed_mode == FeedMode::Rtcp);
        let Some(on) = rtcp.map(|rtcp| &rtcp.on) else { return Vec::new() };
        let register = register.to_string();
        let values = [("register", register.as_str()), ("law", self.law_code())];
        let all = on.before.iter().chain([&on.code, &on.end]);
        all.map(|text| fill(text, &values)).filter(|text| !text.is_empty()).collect()
    }

    /// Words that select the law under RTCP.
    pub(crate) fn law_code(&self) -> &str {
        self.rtcp_law().map_or("", |rule| &rule.code)
    }

    /// Returns the tolerance of the control on the path; none if no machine is named.
    pub(crate) fn control_tolerance(&self) -> ControlTolerance {
        self.motion.map(|m| m.control_tolerance).unwrap_or_default()
    }

    /// Lines that allow the control so much, and that undo it; none where its own settings decide.
    pub(crate) fn blending(&self) -> Result<Switch, WriteError> {
        let Some(rule) = &self.rules.motion.blending else { return Ok(Switch { on: Vec::new(), off: Vec::new() }) };
        let allowed = self.control_tolerance();
        if allowed.path <= 0.0 {
            let error = || WriteError::Tolerance { name: self.rules.name.clone(), key: "path_mm" };
            return rule.exact.clone().ok_or_else(error);
        }
        let path = self.tolerance(allowed.path, "path_mm")?;
        let needs_orientation = rule.within.on.iter().any(|line| line.contains("{orientation}"));
        let degrees = allowed.orientation.to_degrees();
        let orientation = if needs_orientation { self.tolerance(degrees, "orientation_deg")? } else { String::new() };
        let values = [("path", path.as_str()), ("orientation", &orientation)];
        let on = rule.within.on.iter().map(|line| fill(line, &values)).collect();
        Ok(Switch { on, off: rule.within.off.clone() })
    }

    /// A tolerance as a word's number, rounded down, so that the control is not allowed more than
    /// was assumed.
    fn tolerance(&self, value: f64, key: &'static str) -> Result<String, WriteError> {
        let units = number_text::units_below(value, TOLERANCE_DECIMALS).filter(|units| *units > 0);
        let units = units.ok_or_else(|| WriteError::Tolerance { name: self.rules.name.clone(), key })?;
        let mut text = String::new();
        number_text::push_units(&mut text, units, TOLERANCE_DECIMALS, true);
        Ok(text)
    }

    /// Lines of the look-ahead; none where the job does not request it.
    pub(crate) fn look_ahead(&self) -> Switch {
        let rule = self.rules.motion.look_ahead.as_ref().filter(|_| self.look_ahead);
        rule.cloned().unwrap_or(Switch { on: Vec::new(), off: Vec::new() })
    }

    /// Machine value of an axis at the reference position, mm or deg.
    pub(crate) fn home_of(&self, axis: AxisLetter) -> Result<f64, WriteError> {
        self.home.as_ref().and_then(|home| home.get(axis)).ok_or(WriteError::NoHome { axis })
    }
}

fn law_name(law: CuttingLaw) -> &'static str {
    match law {
        CuttingLaw::AxesLinear => "axes_linear",
        CuttingLaw::TipAndRotariesLinear => "tip_and_rotaries_linear",
        CuttingLaw::TipLinearVectorTurned => "tip_linear_vector_turned",
    }
}
