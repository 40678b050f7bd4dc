//! What the readers of all dialects share.

pub(crate) mod expression;
pub(crate) mod feed_place;
pub(crate) mod functions;
pub(crate) mod heidenhain;
pub(crate) mod length_check;
pub(crate) mod modal;
pub(crate) mod notes;
pub(crate) mod number;
pub(crate) mod siemens;
pub(crate) mod source;
pub(crate) mod unfollowed;
pub(crate) mod variables;
