//! Programs and files of a whole clamping: of all of its tools, with subprograms, and what the
//! control must know for them.

pub(crate) mod control_tables;
pub(crate) mod whole_apt;

pub(crate) mod tool_changes;

pub(crate) mod subprograms;
