//! Readers of NC text, a folder for each family of controls.

pub(crate) mod error;
pub(crate) mod fanuc;
pub(crate) mod feed_place;
pub(crate) mod heidenhain;
pub(crate) mod length_check;
pub(crate) mod modal;
pub(crate) mod notes;
pub(crate) mod position;
pub(crate) mod program;
pub(crate) mod reader;
pub(crate) mod siemens;
pub(crate) mod source;
pub(crate) mod unfollowed;
pub(crate) mod values;
