//! 3MF: a ZIP package with models in XML.
//!
//! 3MF Core Specification 1.3 (units, objects, components, build items, matrices as row vectors),
//! and of the production extension the models beside the main one.

mod assembly;
mod model_part;
mod package;
mod xml_part;

use std::collections::{BTreeMap, BTreeSet};

use super::RawMesh;
use crate::import::settings::ImportFault;
use crate::import::threemf::assembly::add_build;
use crate::import::threemf::model_part::{ModelPart, read_model};
use crate::import::threemf::package::Package;

/// Reads a 3MF package: all meshes that the build of its main model places, in mm.
///
/// Each mesh object that is placed starts a group: its name, else that of the nearest object around
/// it, else the part number of the build item, else `object` and its id; names are cut to 200
/// characters. Colours, materials and textures are not read, and supports are left out.
pub(super) fn read(bytes: &[u8]) -> Result<RawMesh, ImportFault> {
    let mut package = Package::open(bytes)?;
    let main = package.main_model()?;
    let mut parts: BTreeMap<String, ModelPart> = BTreeMap::new();
    let mut todo = vec![main.clone()];
    let mut named: BTreeSet<String> = todo.iter().cloned().collect();
    let mut n_objects = 0;
    while let Some(name) = todo.pop() {
        let part = package.part(&name, |xml| read_model(&name, xml, &mut n_objects))?;
        let placements = part.objects.values().flat_map(|object| &object.components).chain(&part.items);
        let others = placements.filter_map(|placement| placement.part.clone());
        todo.extend(others.filter(|other| named.insert(other.clone())));
        parts.insert(name, part);
    }
    add_build(&main, &parts)
}
