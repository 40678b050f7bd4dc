//! Laws of the page: the scripts that it holds.

mod bundle;
mod line_places;
