//! Laws of propeller files.

mod hostile_files;
mod kit;
mod openprop;
mod own_sections;
mod series;
mod shapes;
