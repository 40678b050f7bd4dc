//! Laws of the dialects, each of writer and reader together and of the reader alone.

mod block_lines;
mod dialect_files;
mod dialects;
mod fanuc;
mod fanuc_reader;
mod fanuc_relatives;
mod feed_places;
mod frames;
mod guards;
mod head_kit;
mod heads;
mod heidenhain_reader;
mod kit;
mod linuxcnc_client;
mod post_file;
mod readers;
mod same_moves;
mod samples;
mod siemens_reader;
mod slow_control;
mod state_words;
mod unfollowed;
mod vectors;
