use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::machine_file::{Joint, MachineFile};

/// Values of a machine file that are typical ones and not those of a real machine.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AssumedFile {
    /// Kind of the values.
    pub value: AssumedValue,
    /// Addresses of the axes that they belong to; not with `bodies`, `motion` and `feed`. Default:
    /// all axes, or the machine as a whole.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub axes: Vec<String>,
}

/// Kinds of values that a machine file may have assumed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum AssumedValue {
    /// Places and directions of axes: the rows of the chains.
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
}

impl AssumedValue {
    /// Whether each axis has such a value of its own.
    pub fn is_of_axes(self) -> bool {
        !matches!(self, Self::Bodies | Self::Motion | Self::Feed)
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
        let rows = self.workpiece_chain.rows.iter().chain(self.tool_chains.iter().flat_map(|c| &c.rows));
        rows.filter_map(|row| row.joint.as_ref())
    }

    /// Whether this value of an axis, given by its address, is an assumed one.
    pub fn is_assumed(&self, value: AssumedValue, axis: &str) -> bool {
        self.assumed.iter().any(|a| a.value == value && (a.axes.is_empty() || a.axes.iter().any(|l| l == axis)))
    }
}
