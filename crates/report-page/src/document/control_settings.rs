//! Settings of the control that a program relies on, for the setup sheet.

use facemill_cl_data::{ControlTolerance, RapidLaw};
use facemill_inverse_kinematics::AxisKind;
use facemill_nc_program::Dialect;
use facemill_nc_program::dialect::{DialectFile, RtcpRapids};

use crate::document::{PageScene, PageSource};
use crate::format::ControlSetting;
use crate::motion::ProgramMotion;

/// Names of the tool's length in programs that compare it with a number.
const LENGTH_CHECKS: [&str; 6] = ["#11001", "#10001", "#2001", "#5403", "$P_TOOLL", "Q114"];

impl PageScene<'_> {
    /// Returns what the control must be set to, besides the work offset.
    pub(super) fn control_settings(&self, source: &PageSource<'_>, motion: &ProgramMotion) -> Vec<ControlSetting> {
        let post = &self.scene.job.post;
        let rules = if post.dialect() == source.dialect { post.rules().clone() } else { source.dialect.file() };
        let text = String::from_utf8_lossy(source.text);
        let rtcp = motion.segments.iter().any(|s| s.is_rtcp);
        let mut settings = self.tool_lengths(source.dialect, &text);
        let mut add = |name: &'static str, value: String| settings.push(ControlSetting { name, value });
        add("Tip control (RTCP, TCPM)", tip_control(&rules, rtcp));
        add("Meaning of F", meaning_of_f(motion, rtcp));
        add("Rapids", self.rapids(&rules, rtcp));
        let ControlTolerance { path, orientation } = self.scene.machine.motion_law().control_tolerance;
        let who = if rules.motion.blending.is_some() {
            "words of the program set it; verification compares them"
        } else {
            "no word of this control sets it: check its parameters"
        };
        add(
            "Smoothing and corners",
            format!("a cut leaves the path by at most {path} mm and {:.4}°; {who}", orientation.to_degrees()),
        );
        let home = self.scene.machine.axes().iter().map(|axis| match axis.kind {
            AxisKind::Rotary => format!("{} {:.4}°", axis.letter, axis.home.to_degrees()),
            AxisKind::Linear => format!("{} {:.3} mm", axis.letter, axis.home),
        });
        add("Reference position of the axes", home.collect::<Vec<_>>().join(", "));
        settings
    }

    fn tool_lengths(&self, dialect: Dialect, text: &str) -> Vec<ControlSetting> {
        let is_checked = LENGTH_CHECKS.iter().any(|name| text.contains(name));
        let check = if is_checked {
            "the program compares it before it moves"
        } else {
            "the program does not compare it: check it by hand"
        };
        let value = |tool: facemill_tool_model::ToolFile| {
            let place = match dialect {
                Dialect::Siemens840d => format!("length 1 of cutting edge D1 of T{}", tool.number),
                Dialect::Heidenhain => format!("L of tool {} in the tool table, DL 0", tool.number),
                _ => format!("H{}, wear 0", tool.length_register.unwrap_or(tool.number)),
            };
            let length = tool.gauge_length_mm;
            format!("{place}: {length:.3} mm from the gauge line of the spindle to the tip; {check}")
        };
        let tools = self.heads.iter().map(|(_, tool)| tool.to_file());
        tools.map(|tool| ControlSetting { name: "Tool length", value: value(tool) }).collect()
    }

    fn rapids(&self, rules: &DialectFile, rtcp: bool) -> String {
        let is_linear = self.scene.machine.motion_law().rapid == RapidLaw::Linear;
        let rule = if is_linear { &rules.motion.rapid_linear } else { &rules.motion.rapid_per_axis };
        let law = if is_linear { "all axes on a line" } else { "each axis at its own speed" };
        let set_by = match rule {
            Some(rule) if rule.code.is_empty() && !rule.note.is_empty() => format!("setting to check: {}", rule.note),
            Some(rule) if !rule.code.is_empty() => format!("selected by {}", rule.code),
            _ => "as this control always does".to_owned(),
        };
        let under_rtcp = match rules.rtcp_rapids() {
            RtcpRapids::TipLinear if rtcp => "; under tip control the tip goes straight, too",
            _ => "",
        };
        format!("{law}: {set_by}{under_rtcp}")
    }
}

fn tip_control(rules: &DialectFile, rtcp: bool) -> String {
    if !rtcp {
        return "off: words are positions of the axes, for this place of the part and this length of the tool alone. With \
                another offset, place or length plan again: entering new values does not correct the path"
            .to_owned();
    }
    let code = rules.motion.rtcp.as_ref().map_or("the program's word", |rtcp| rtcp.on.code.as_str());
    format!(
        "the program switches it on with {code}: the option must be there, and the control must have the machine's centres of \
         rotation as the machine file has them"
    )
}

fn meaning_of_f(motion: &ProgramMotion, rtcp: bool) -> String {
    let has = |is: fn(&crate::motion::Segment) -> bool| motion.segments.iter().any(is);
    match (has(|s| s.inverse_feed.is_some()), rtcp) {
        (true, _) => "inverse time (G93): the reciprocal of the time of each block in minutes",
        (false, true) => "speed of the tip, mm/min",
        (false, false) => "speed along the axes, mm/min; how rotary axes count is in the header of the program",
    }
    .to_owned()
}
