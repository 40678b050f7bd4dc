//! Effects of words that are not followed, from their beginning to the text that ends them.

/// Cause for which positions do not follow from the words.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Cause {
    /// Nothing but this block.
    Block,
    /// Nothing but the corner that this block ends at: later words are what they seem.
    Corner,
    /// Radius compensation (G41, G42, RL, RR).
    Radius,
    /// Tool vectors or angles that the control turns the axes for (G43.5), or a length that is not
    /// known.
    Vectors,
    /// A tilted plane (G68.2).
    Plane,
    /// Words that are scaled (G51).
    Scale,
    /// Words that are mirrored (G51.1).
    Mirror,
    /// Polar words (G16).
    Polar,
    /// Words that are turned (G68).
    Turn,
    /// Axes that are mapped onto others (G12.1, TRACYL).
    Mapping,
    /// Feed per turn or per tooth (G95).
    Feed,
    /// Constant surface speed (G96).
    SurfaceSpeed,
    /// A motion that is no line or arc (splines, threads); the next motion word ends it.
    Path,
    /// Words that are diameters (G7 of LinuxCNC).
    Diameter,
    /// Every corner is rounded (RNDM).
    Corners,
    /// Nothing that is known ends it.
    Forever,
}

/// The causes in force, in the order in which they began.
#[derive(Clone, Debug, Default)]
pub(crate) struct Unfollowed {
    causes: Vec<(Cause, &'static str)>,
    /// One began in this block.
    begins: bool,
}

impl Unfollowed {
    /// Begins a cause, which `why` names for people.
    pub(crate) fn begin(&mut self, cause: Cause, why: &'static str) {
        self.end(cause);
        self.causes.push((cause, why));
        self.begins = true;
    }

    /// Ends a cause, if it is in force.
    pub(crate) fn end(&mut self, cause: Cause) {
        self.causes.retain(|(other, _)| *other != cause);
    }

    /// Whether a cause is in force.
    pub(crate) fn has(&self, cause: Cause) -> bool {
        self.causes.iter().any(|(other, _)| *other == cause)
    }

    /// Whether words say no positions now, of later blocks neither until they are named again: all
    /// causes but a corner.
    pub(crate) fn loses_all(&self) -> bool {
        self.causes.iter().any(|(cause, _)| *cause != Cause::Corner)
    }

    /// Whether one began in this block.
    pub(crate) fn begins(&self) -> bool {
        self.begins
    }

    /// Ends a block: why its words say no positions, and whether later ones do neither.
    pub(crate) fn end_block(&mut self) -> Option<(&'static str, bool)> {
        self.begins = false;
        let (_, why) = *self.causes.first()?;
        let loses_all = self.loses_all();
        self.causes.retain(|(cause, _)| !matches!(cause, Cause::Block | Cause::Corner));
        Some((why, loses_all))
    }
}
