//! Laws of parts made from tables and closed forms.

mod kit;

mod analytic_laws;
mod anti_singing_laws;
mod blade_laws;
mod casting_laws;
mod loft_laws;
mod loft_wall_laws;
mod rotor37_laws;
mod solid_faults;
mod solid_laws;
mod turned_solid_laws;
mod vp1304_reference;
