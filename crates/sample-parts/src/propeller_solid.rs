//! Propellers as one watertight solid: hub with bore, blades and root fillets.

pub(crate) mod ball;
pub(crate) mod blade_sheets;
pub(crate) mod bore;
pub(crate) mod contact_loop;
pub(crate) mod contour;
pub(crate) mod fitted;
pub(crate) mod hub_ends;
pub(crate) mod hub_patch;
pub(crate) mod root_fillet;
pub(crate) mod sector;
pub(crate) mod solid;
