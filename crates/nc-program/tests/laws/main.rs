//! Laws of the dialects, each of writer and reader together and of the reader alone.

mod dialect_files;
mod dialects;
mod fanuc;
mod head_kit;
mod heads;
mod kit;
mod linuxcnc_client;
mod offset_tables;
mod post_file;
mod same_moves;
mod slow_control;
mod texts;
mod vectors;
