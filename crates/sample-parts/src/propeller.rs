//! Propellers: blades from radial tables, and a hub.

pub(crate) mod anti_singing;
pub(crate) mod anti_singing_check;
pub(crate) mod blade;
pub(crate) mod blade_grid;
pub(crate) mod blade_section;
pub(crate) mod blade_surface;
pub(crate) mod chord_error;
pub(crate) mod from_table;
pub(crate) mod hub;
pub(crate) mod offset_form;
pub(crate) mod spec;
pub(crate) mod table;
pub(crate) mod tables;
pub(crate) mod wageningen;
pub(crate) mod wageningen_tables;
