//! Stages of a long computation, and their monitors.

use facemill_cl_data::{Monitor, Silent};

/// Supplier of the monitor that each stage of a plan reports to.
pub trait Stages {
    /// Announces the stages to come, in their order. A stage may be skipped, or come again.
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

/// Reading of meshes.
pub const READ: &str = "read the meshes";

/// Bound of the stock that the programs before leave.
pub const STOCK_BEFORE: &str = "stock before";

/// Generation of the passes of an operation.
pub const LAY: &str = "lay the passes";

/// Search for postures at all points of the path.
pub const POSTURES: &str = "tilt and rotate";

/// Replanning of passes beside the pole.
pub const DETOURS: &str = "other ways past the pole";

/// Test of passes in another place of the pattern.
pub const PLACES: &str = "other places of the pattern";

/// Planning of additional passes between the generated ones.
pub const ADDED: &str = "passes between";

/// Interpolation of postures between points.
pub const BETWEEN: &str = "between points";

/// Drawing of the feasible postures of one point.
pub const PICTURE: &str = "picture of the postures";

/// Generation of entries and links.
pub const LINKS: &str = "entries and links";

/// Computation of cusps and chips along the passes.
pub const CHIPS: &str = "cusps and chips";

/// Search for changes that give left-out points a posture.
pub const HELP: &str = "what would help";

/// Search for faster links.
pub const SHORTEN: &str = "shorten links";

/// Writing of the program, with feeds that the axes reach.
pub const WRITE: &str = "write the program";

/// Run of the program.
pub const VERIFY: &str = "verify program";

/// Proof of the motion of its blocks between their ends.
pub const CERTIFY: &str = "certify program";

/// Cutting of the stock.
pub const CUT: &str = "cut the stock";

/// Search for collisions of stock below the distance of its lines.
pub const LOOK: &str = "look between the lines";

/// Measurement of the material that the program leaves on the drive surface.
pub const MATERIAL: &str = "material left";

/// Timing of the program by its text.
pub const TIMES: &str = "times of the program";
