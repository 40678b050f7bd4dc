//! Commands for files of the shop's equipment: machines and tools.

pub(crate) mod machine_commands;
mod machine_new;
mod machine_prompts;
pub(crate) mod tool_commands;
pub(crate) mod tool_files;
mod tool_import;
mod tool_text;
