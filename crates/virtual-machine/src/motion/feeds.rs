//! Meaning of F in a block, by control and by the program's earlier statements.

use facemill_inverse_kinematics::{AxisValues, Machine};
use facemill_nc_program::read::{Feed, ReadBlock};
use facemill_nc_program::{Dialect, FeedMode};

use crate::motion::counted_axes::{CountedAxes, norm_of_all};

/// Feeds of a program so far.
pub(crate) struct Feeds {
    dialect: Dialect,
    counted: CountedAxes,
    /// Why what F means is not known any more.
    changed: Option<String>,
    /// Last reported reason why a meaning is unknown.
    reported: Option<String>,
}

impl Feeds {
    pub(crate) fn new(dialect: Dialect) -> Self {
        Self { dialect, counted: CountedAxes::default(), changed: None, reported: None }
    }

    /// Takes note of what a block says of feeds. Others report functions that switch kinematics.
    /// Changes of feeds are not followed back.
    pub(crate) fn read(&mut self, block: &ReadBlock) {
        if matches!(self.dialect, Dialect::Siemens840d | Dialect::Heidenhain)
            && let Err(why) = self.counted.read(self.dialect, block)
        {
            self.changed = Some(why);
        }
    }

    /// The feed of a block as machines are timed by it: in mm/min the speed over all axes, 1 deg as
    /// 1 mm, or that of the tip, whatever axes the control's F counts. `feed_unit` is how many
    /// mm/min an F of 1 is.
    ///
    /// # Errors
    /// When it is not known; with the reason, if that has not been reported.
    pub(crate) fn over_all_axes(
        &mut self,
        machine: &Machine,
        feed: Feed,
        feed_unit: f64,
        [start, end]: [&AxisValues; 2],
    ) -> Result<Feed, Option<String>> {
        let found = match (&self.changed, feed.mode) {
            (Some(why), _) => Err(why.clone()),
            (None, FeedMode::G94) => {
                let counted = self.counted.length(self.dialect, machine, [start, end], feed_unit);
                counted.map(|(length, is_all)| {
                    let share = if is_all || length == 0.0 { 1.0 } else { norm_of_all(machine, start, end) / length };
                    Feed { value: feed.value * share, ..feed }
                })
            }
            (None, FeedMode::Rtcp) if self.dialect == Dialect::Siemens840d => {
                self.counted.check_tip(machine).map(|()| feed)
            }
            (None, FeedMode::Rtcp | FeedMode::G93) => Ok(feed),
        };
        found.map_err(|why| {
            let is_reported = self.reported.as_ref() == Some(&why);
            self.reported = Some(why.clone());
            (!is_reported).then_some(why)
        })
    }
}
