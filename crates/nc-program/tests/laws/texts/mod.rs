//! Texts as the readers understand them.

pub(crate) mod block_lines;
pub(crate) mod fanuc_reader;
pub(crate) mod fanuc_relatives;
pub(crate) mod feed_places;
pub(crate) mod frames;
pub(crate) mod guards;
pub(crate) mod heidenhain_reader;
pub(crate) mod readers;
pub(crate) mod samples;
pub(crate) mod siemens_reader;
pub(crate) mod state_words;
pub(crate) mod unfollowed;
