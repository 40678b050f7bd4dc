//! Laws of chip areas, and cases compared with polygons of the true shapes.

mod golden;
mod kit;
mod pass_errors;
mod pass_laws;
mod pass_polygons;
mod polygon_booleans;
mod sections;
mod table;
mod thickness;
