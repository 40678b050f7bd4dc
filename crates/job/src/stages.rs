//! Stages of a long computation, and their monitors.

use facemill_cl_data::{Monitor, Silent};

/// Gives each stage of a plan the monitor it reports to.
pub trait Stages {
    /// Names the stages to come, in their order. Some may not come, and some again.
    fn expect(&self, _stages: Vec<&'static str>) {}
    /// Starts a stage of `n` steps; it ends when the monitor is dropped.
    fn start(&self, what: &'static str, n: usize) -> Box<dyn Monitor>;
}

/// Stages that show nothing and are never cancelled.
#[derive(Clone, Copy, Debug, Default)]
pub struct SilentStages;

impl Stages for SilentStages {
    fn start(&self, _what: &'static str, _n: usize) -> Box<dyn Monitor> {
        Box::new(Silent)
    }
}

/// Reads meshes.
pub const READ: &str = "read the meshes";

/// Lays the passes of an operation.
pub const LAY: &str = "lay the passes";

/// Finds postures at all points of the path.
pub const POSTURES: &str = "tilt and rotate";

/// Plans passes beside the pole again.
pub const DETOURS: &str = "other ways past the pole";

/// Tests passes in another place of the pattern.
pub const PLACES: &str = "other places of the pattern";

/// Plans passes put between those laid.
pub const ADDED: &str = "passes between";

/// Puts postures between points.
pub const BETWEEN: &str = "between points";

/// Draws the feasible postures of one point.
pub const PICTURE: &str = "picture of the postures";

/// Makes entries and links.
pub const LINKS: &str = "entries and links";

/// Takes cusps and chips along the passes.
pub const CHIPS: &str = "cusps and chips";

/// Looks for changes with which points that were left out have a posture.
pub const HELP: &str = "what would help";

/// Looks for faster links.
pub const SHORTEN: &str = "shorten links";

/// Writes the program, with feeds that the axes reach.
pub const WRITE: &str = "write the program";

/// Runs the program.
pub const VERIFY: &str = "verify program";

/// Proves what its blocks do between their ends.
pub const CERTIFY: &str = "certify program";

/// Cuts the stock.
pub const CUT: &str = "cut the stock";

/// Looks what meets the stock between its lines.
pub const LOOK: &str = "look between the lines";

/// Measures what the program leaves on the surface that is asked for.
pub const MATERIAL: &str = "material left";

/// Times the program by its text.
pub const TIMES: &str = "times of the program";
