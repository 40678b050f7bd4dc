use facemill_inverse_kinematics::Axis;

/// Largest velocity, acceleration and jerk of one axis, the same in both directions: mm or rad per
/// s, s² and s³.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisBounds {
    /// Largest speed, mm/s or rad/s.
    pub velocity: f64,
    /// Largest acceleration, mm/s² or rad/s².
    pub acceleration: f64,
    /// Largest jerk, mm/s³ or rad/s³.
    pub jerk: f64,
}

impl AxisBounds {
    /// Returns the limits of an axis of a machine; `None` where its file gives no acceleration or
    /// no jerk.
    pub fn of_axis(axis: &Axis) -> Option<Self> {
        Some(Self { velocity: axis.max_velocity, acceleration: axis.max_acceleration?, jerk: axis.max_jerk? })
    }

    /// Velocity, acceleration and jerk in this order.
    pub(crate) fn as_array(&self) -> [f64; 3] {
        [self.velocity, self.acceleration, self.jerk]
    }
}

/// Limits that a motion must keep at all times.
#[derive(Clone, Debug, PartialEq)]
pub struct MotionBounds {
    /// Limits of every axis, in axis order.
    pub axes: Vec<AxisBounds>,
    /// Largest speed of the tip, mm/min, for a path with a tip.
    pub tip_feed: Option<f64>,
}

/// Limiting factor of a motion.
///
/// Exhaustive, so that a new one is handled everywhere: reports name each.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum MotionLimit {
    /// The speed of this axis, by index.
    Velocity(usize),
    /// The acceleration of this axis.
    Acceleration(usize),
    /// The jerk of this axis.
    Jerk(usize),
    /// The cap on the speed of the tip.
    TipFeed,
}

/// Reason why there is no time law.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TimeLawError {
    /// A limit is not a positive number.
    #[error("the {what} limit of axis {axis} is {value}, but has to be a finite number above 0")]
    BadLimit {
        /// Index of the axis.
        axis: usize,
        /// `velocity`, `acceleration` or `jerk`.
        what: &'static str,
        /// Given value.
        value: f64,
    },
    /// The cap on the tip feed is not a positive number.
    #[error("the tip feed is capped at {value} mm/min, but the cap has to be a finite number above 0")]
    BadTipFeed {
        /// Given value, mm/min.
        value: f64,
    },
    /// There is a cap on the tip feed, but the path has no tip.
    #[error("the tip feed is capped, but the path gives no tip: give it, or no cap")]
    NoTip,
    /// The number of axes of the path differs from the number of limits.
    #[error("the path has {path} axes, but limits are given for {bounds}")]
    AxisCount {
        /// Axes of the path.
        path: usize,
        /// Axes with limits.
        bounds: usize,
    },
    /// The ends of the path's pieces are not at least two finite, strictly ascending numbers.
    #[error("the ends of the path's pieces have to be two or more finite numbers that ascend: number {index} does not")]
    BadBreaks {
        /// Index of the first one that is wrong.
        index: usize,
    },
    /// A position of the path or one of its derivatives is not finite.
    #[error("the path or one of its derivatives is not finite in piece {piece} at parameter {parameter}")]
    NotFinite {
        /// Index of the piece.
        piece: usize,
        /// Place in the path's parameter.
        parameter: f64,
    },
    /// Position, first or second derivative jumps between two pieces, so no motion with finite jerk
    /// passes there.
    #[error("derivative {order} of axis {axis} jumps at the start of piece {piece}: stop there, or blend the corner")]
    Jump {
        /// Index of the piece that starts there.
        piece: usize,
        /// Index of the axis.
        axis: usize,
        /// 0 for the position, 1 and 2 for derivatives.
        order: usize,
    },
    /// The path between two close points contradicts their derivatives.
    #[error("piece {piece} of the path is not smooth at parameter {parameter}, or its derivatives are not its own")]
    NotSmooth {
        /// Index of the piece.
        piece: usize,
        /// Place in the path's parameter.
        parameter: f64,
    },
    /// The path does not move over a part of its parameter.
    #[error("no axis moves in a part of piece {piece} of the path: leave that part out")]
    NoMotion {
        /// Index of the piece.
        piece: usize,
    },
}

impl MotionBounds {
    /// Returns limits of these axes without a cap on the tip feed.
    pub fn new(axes: Vec<AxisBounds>) -> Self {
        Self { axes, tip_feed: None }
    }

    /// Refuses limits that are not positive numbers.
    ///
    /// # Errors
    /// [`TimeLawError::BadLimit`], [`TimeLawError::BadTipFeed`].
    pub fn check(&self) -> Result<(), TimeLawError> {
        let good = |value: f64| value > 0.0 && value.is_finite();
        for (axis, bounds) in self.axes.iter().enumerate() {
            for (what, value) in ["velocity", "acceleration", "jerk"].into_iter().zip(bounds.as_array()) {
                if !good(value) {
                    return Err(TimeLawError::BadLimit { axis, what, value });
                }
            }
        }
        match self.tip_feed {
            Some(value) if !good(value) => Err(TimeLawError::BadTipFeed { value }),
            _ => Ok(()),
        }
    }
}
