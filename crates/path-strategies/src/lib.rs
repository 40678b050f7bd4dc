//! Passes of a job without its program: laid by its own strategies, or planned by several ones to
//! compare them.
//!
//! Modules, each of which imports those above it alone:
//!
//! | module | holds |
//! |---|---|
//! | `paths_file` | format of laid and compared passes |
//! | `strategies_file` | format of a list of strategies to compare |
//! | `directions` | directions of parallel planes for a region: by its extent, and by the motion of the rotary axes |
//! | `flows` | flows and spirals between two borders of a region |
//! | `candidates` | planes and flows for the regions of a job's operations |
//! | `strategies` | strategies that a job can be planned by |
//! | `compared` | plans of a job by several strategies, one after the other |
//! | `fastest` | the compared plan of least time among the complete ones |
//! | `laid` | passes as the job's own strategies lay them, before any posture is planned |

mod candidates;
mod compared;
mod directions;
mod fastest;
mod flows;
mod laid;
mod paths_file;
mod strategies;
mod strategies_file;
#[cfg(test)]
#[path = "../tests/unit/test_kit.rs"]
mod test_kit;

pub use crate::compared::{CompareRequest, ComparisonSteps, compare_paths};
pub use crate::fastest::fastest;
pub use crate::laid::{LaidPaths, lay_paths};
pub use crate::paths_file::{
    ComparedStrategy, FastestStrategy, LaidPasses, PATHS_FORMAT, PassedOverStrategy, PathsFile, PlannedPasses,
};
pub use crate::strategies::{NamedStrategy, default_strategies, listed_strategies};
pub use crate::strategies_file::StrategiesFile;
