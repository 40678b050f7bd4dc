//! Build of a 3MF package: objects within objects, each in its place.

use std::collections::BTreeMap;

use crate::import::RawMesh;
use crate::import::settings::ImportFault;
use crate::import::threemf::model_part::{Affine, ModelObject, ModelPart, Placement};

/// Most triangles, vertices and objects that the build of a package may have beyond those that are
/// written in it, because objects may be placed many times.
const MOST_REPEATED: u64 = 1 << 22;

/// Most groups of a package: one for each placed mesh whose name differs from that of the one
/// before.
const MOST_GROUPS: usize = 1 << 16;

/// An object of any part.
type ObjectKey<'p> = (&'p str, u32);

/// Size of an object when all objects within it are in their places.
#[derive(Clone, Copy, Debug, Default)]
struct BuiltSize {
    triangles: u64,
    vertices: u64,
    /// Objects placed, itself included.
    objects: u64,
}

impl BuiltSize {
    fn add(&mut self, other: Self) {
        self.triangles = self.triangles.saturating_add(other.triangles);
        self.vertices = self.vertices.saturating_add(other.vertices);
        self.objects = self.objects.saturating_add(other.objects);
    }

    fn largest(self) -> u64 {
        self.triangles.max(self.vertices).max(self.objects)
    }
}

/// Returns the meshes that the build of the main model places, in mm.
pub(super) fn add_build(main: &str, parts: &BTreeMap<String, ModelPart>) -> Result<RawMesh, ImportFault> {
    let (main_name, main_part) = parts.get_key_value(main).ok_or_else(|| element(main, "it was not read"))?;
    if let Some((name, part)) = parts.iter().find(|(_, part)| part.unit != main_part.unit) {
        let message = format!("its unit is {}, that of {main} is {}; write one unit", part.unit.0, main_part.unit.0);
        return Err(element(name, &message));
    }
    if main_part.items.is_empty() {
        return Err(element(main, "its build has no item; place an object in it"));
    }
    let assembly = Assembly { parts };
    let sizes = assembly.sizes(main_name, &main_part.items)?;
    let written: u64 = parts.values().flat_map(|part| part.objects.values()).map(written_size).sum();
    let mut built = BuiltSize::default();
    for item in &main_part.items {
        let key = assembly.key_of(main_name, item, &format!("{main}, build"))?;
        built.add(sizes.get(&key).copied().unwrap_or_default());
        if built.largest() > written.saturating_add(MOST_REPEATED) {
            let message = format!(
                "its components repeat to more than {MOST_REPEATED} triangles, vertices or objects beyond those in the \
                 file; place fewer of them"
            );
            return Err(element(&format!("{}, object {}", key.0, key.1), &message));
        }
    }
    let mut mesh = RawMesh::default();
    for item in &main_part.items {
        assembly.add_item(&mut mesh, main_name, item, main_part.unit.1, &sizes)?;
    }
    Ok(mesh)
}

fn written_size(object: &ModelObject) -> u64 {
    (object.triangles.len().max(object.vertices.len()) + object.components.len() + 1) as u64
}

fn element(name: &str, message: &str) -> ImportFault {
    ImportFault::Element { element: name.to_owned(), message: message.to_owned() }
}

struct Assembly<'p> {
    parts: &'p BTreeMap<String, ModelPart>,
}

impl<'p> Assembly<'p> {
    /// The object that a placement in a part names; `placed_in` is for the error.
    fn key_of(&self, part: &'p str, placement: &Placement, placed_in: &str) -> Result<ObjectKey<'p>, ImportFault> {
        let name = placement.part.as_deref().unwrap_or(part);
        let found = self.parts.get_key_value(name).filter(|(_, part)| part.objects.contains_key(&placement.object));
        found.map(|(name, _)| (name.as_str(), placement.object)).ok_or_else(|| {
            element(placed_in, &format!("it places object {}, which {name} does not have", placement.object))
        })
    }

    fn object(&self, key: ObjectKey<'p>) -> &'p ModelObject {
        // `key_of` makes keys of objects that are there.
        &self.parts[key.0].objects[&key.1]
    }

    /// Sizes of all objects that items place, each after those within it. Refuses objects within
    /// themselves.
    fn sizes(&self, main: &'p str, items: &'p [Placement]) -> Result<BTreeMap<ObjectKey<'p>, BuiltSize>, ImportFault> {
        let mut sizes: BTreeMap<ObjectKey<'p>, BuiltSize> = BTreeMap::new();
        let mut is_open: BTreeMap<ObjectKey<'p>, bool> = BTreeMap::new();
        for item in items {
            // Objects with the number of their components that are done.
            let mut path: Vec<(ObjectKey<'p>, usize)> = vec![(self.key_of(main, item, &format!("{main}, build"))?, 0)];
            while let Some((key, next)) = path.pop() {
                if sizes.contains_key(&key) {
                    continue;
                }
                let object = self.object(key);
                let placed_in = || format!("{}, object {}", key.0, key.1);
                if next == 0 {
                    is_open.insert(key, true);
                }
                if let Some(component) = object.components.get(next) {
                    let inner = self.key_of(key.0, component, &placed_in())?;
                    if is_open.get(&inner) == Some(&true) {
                        let message = format!("its components lead back to it by way of object {}", inner.1);
                        return Err(element(&placed_in(), &message));
                    }
                    path.push((key, next + 1));
                    path.push((inner, 0));
                    continue;
                }
                sizes.insert(key, self.size_of(key, &sizes)?);
                is_open.insert(key, false);
            }
        }
        Ok(sizes)
    }

    /// Size of an object whose components have theirs. Objects without a triangle count as nothing,
    /// since they are not placed.
    fn size_of(
        &self,
        key: ObjectKey<'p>,
        sizes: &BTreeMap<ObjectKey<'p>, BuiltSize>,
    ) -> Result<BuiltSize, ImportFault> {
        let object = self.object(key);
        let mut size = BuiltSize { objects: 1, ..BuiltSize::default() };
        if !object.is_support {
            size.triangles = object.triangles.len() as u64;
            size.vertices = object.vertices.len() as u64;
            for component in &object.components {
                let inner = self.key_of(key.0, component, key.0)?;
                size.add(sizes.get(&inner).copied().unwrap_or_default());
            }
        }
        Ok(if size.triangles == 0 { BuiltSize::default() } else { size })
    }

    fn add_item(
        &self,
        mesh: &mut RawMesh,
        main: &'p str,
        item: &'p Placement,
        mm_per_unit: f64,
        sizes: &BTreeMap<ObjectKey<'p>, BuiltSize>,
    ) -> Result<(), ImportFault> {
        let key = self.key_of(main, item, main)?;
        let mut todo = vec![(key, item.transform, item.part_number.as_str())];
        while let Some((key, transform, name_around)) = todo.pop() {
            if sizes.get(&key).is_none_or(|size| size.triangles == 0) {
                continue;
            }
            let object = self.object(key);
            let name = if object.name.is_empty() { name_around } else { &object.name };
            if !object.triangles.is_empty() {
                let by_id = format!("object {}", key.1);
                mesh.begin_group(if name.is_empty() { &by_id } else { name });
                if mesh.groups.len() > MOST_GROUPS {
                    let message = format!(
                        "with it the build has more than {MOST_GROUPS} groups; place fewer objects, or give those that \
                         follow each other one name"
                    );
                    return Err(element(&format!("{}, object {}", key.0, key.1), &message));
                }
                add_mesh(mesh, object, &transform, mm_per_unit, key)?;
            }
            for component in object.components.iter().rev() {
                let inner = self.key_of(key.0, component, key.0)?;
                todo.push((inner, transform.after(&component.transform), name));
            }
        }
        Ok(())
    }
}

/// Adds the mesh of an object; a mirroring transform reverses its winding.
fn add_mesh(
    mesh: &mut RawMesh,
    object: &ModelObject,
    transform: &Affine,
    mm_per_unit: f64,
    key: ObjectKey<'_>,
) -> Result<(), ImportFault> {
    let n = u32::try_from(object.vertices.len()).ok();
    let first = u32::try_from(mesh.vertices.len()).ok().filter(|first| n.and_then(|n| first.checked_add(n)).is_some());
    let first = first.ok_or(ImportFault::TooLarge { limit: u32::MAX as usize / 3 })?;
    let mirrors = transform.linear.determinant() < 0.0;
    for triangle in &object.triangles {
        let [a, b, c] = triangle.map(|v| v + first);
        mesh.push(if mirrors { [a, c, b] } else { [a, b, c] })?;
    }
    for (k, vertex) in object.vertices.iter().enumerate() {
        let placed = transform.apply(vertex) * mm_per_unit;
        if !placed.iter().all(|x| x.is_finite()) {
            let place = format!("{}, object {}, vertex {k}, in its place,", key.0, key.1);
            return Err(ImportFault::NotFinite { place });
        }
        mesh.vertices.push(placed);
    }
    Ok(())
}
