use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::machine_file::{Joint, MachineFile};

/// Values of a machine file that are typical ones and not those of a real machine.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AssumedFile {
    /// Kind of the values.
    pub value: AssumedValue,
    /// Addresses of the axes that they belong to; not with `bodies`, `motion`, `feed`
    /// and `tool_change`. Default:
    /// all axes, or the machine as a whole.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub axes: Vec<String>,
}

/// Kinds of values that a machine file may have assumed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum AssumedValue {
    /// Places and directions of axes: the rows or lines of the chains.
    Dimensions,
    /// Smallest and largest values.
    Limits,
    /// Home positions.
    Home,
    /// Largest speeds.
    MaxVelocity,
    /// Largest accelerations.
    MaxAcceleration,
    /// Largest jerks.
    MaxJerk,
    /// Senses in which axes count.
    Sense,
    /// Shapes, places and clearances of bodies.
    Bodies,
    /// Motion of the control between two positions.
    Motion,
    /// Feeds the control can be given.
    Feed,
    /// Time of a tool change.
    ToolChange,
}

impl AssumedValue {
    /// Whether each axis has such a value of its own.
    pub fn is_of_axes(self) -> bool {
        !matches!(self, Self::Bodies | Self::Motion | Self::Feed | Self::ToolChange)
    }

    /// In words.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Dimensions => "dimensions",
            Self::Limits => "limits",
            Self::Home => "home",
            Self::MaxVelocity => "max velocity",
            Self::MaxAcceleration => "max acceleration",
            Self::MaxJerk => "max jerk",
            Self::Sense => "sense",
            Self::Bodies => "bodies",
            Self::Motion => "motion",
            Self::Feed => "feed",
            Self::ToolChange => "tool change",
        }
    }
}

impl Joint {
    /// Address of the axis in NC text, as the file has it.
    pub fn axis(&self) -> &str {
        match self {
            Self::Prismatic(j) => &j.axis,
            Self::Revolute(j) => &j.axis,
        }
    }
}

impl MachineFile {
    /// The joints of all chains: the workpiece's from the bed outward, then each tool chain's.
    pub fn joints(&self) -> impl Iterator<Item = &Joint> {
        let table = (&self.workpiece_chain.rows, &self.workpiece_chain.lines);
        let heads = self.tool_chains.iter().map(|chain| (&chain.rows, &chain.lines));
        std::iter::once(table).chain(heads).flat_map(|(rows, lines)| {
            let of_rows = rows.iter().filter_map(|row| row.joint.as_ref());
            of_rows.chain(lines.iter().flat_map(|lines| &lines.axes).map(|line| &line.joint))
        })
    }

    /// Whether this value of an axis, given by its address, is an assumed one.
    pub fn is_assumed(&self, value: AssumedValue, axis: &str) -> bool {
        self.assumed.iter().any(|a| a.value == value && (a.axes.is_empty() || a.axes.iter().any(|l| l == axis)))
    }
}
