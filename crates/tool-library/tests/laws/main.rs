//! Laws of tool libraries and tool tables.

mod hostile_libraries;
mod kit;
mod read_tools;
mod tool_tables;
