//! A model of a 3MF package: unit, objects, build.

use std::collections::BTreeMap;

use nalgebra::{Matrix3, Point3, Vector3};

use crate::import::settings::ImportFault;
use crate::import::threemf::package::part_name;
use crate::import::threemf::xml_part::{XmlPart, XmlTag};

/// A model.
#[derive(Clone, Debug)]
pub(super) struct ModelPart {
    /// Name of the unit in the file, and its length, mm.
    pub(super) unit: (&'static str, f64),
    /// Objects by their ids.
    pub(super) objects: BTreeMap<u32, ModelObject>,
    /// Items of the build.
    pub(super) items: Vec<Placement>,
}

/// An object: a mesh, or others placed together.
#[derive(Clone, Debug, Default)]
pub(super) struct ModelObject {
    pub(super) name: String,
    /// Whether it is no part but holds one in a printer.
    pub(super) is_support: bool,
    pub(super) vertices: Vec<Point3<f64>>,
    pub(super) triangles: Vec<[u32; 3]>,
    pub(super) components: Vec<Placement>,
}

/// An object in a place.
#[derive(Clone, Debug)]
pub(super) struct Placement {
    /// Part that has the object, if it is another one.
    pub(super) part: Option<String>,
    pub(super) object: u32,
    pub(super) transform: Affine,
    /// Part number of a build item, empty without one.
    pub(super) part_number: String,
}

/// A matrix and a shift: `linear * p + shift`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Affine {
    pub(super) linear: Matrix3<f64>,
    pub(super) shift: Vector3<f64>,
}

impl Affine {
    pub(super) fn identity() -> Self {
        Self { linear: Matrix3::identity(), shift: Vector3::zeros() }
    }

    /// First `inner`, then this one.
    pub(super) fn after(&self, inner: &Self) -> Self {
        Self { linear: self.linear * inner.linear, shift: self.linear * inner.shift + self.shift }
    }

    pub(super) fn apply(&self, p: &Point3<f64>) -> Point3<f64> {
        Point3::from(self.linear * p.coords + self.shift)
    }
}

const UNITS: [(&str, f64); 6] =
    [("micron", 0.001), ("millimeter", 1.0), ("centimeter", 10.0), ("inch", 25.4), ("foot", 304.8), ("meter", 1000.0)];

/// Unit of a model that names none.
const MILLIMETER: (&str, f64) = UNITS[1];

/// Namespaces of elements and attributes that are read.
const CORE: &str = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02";
const PRODUCTION: &str = "http://schemas.microsoft.com/3dmanufacturing/production/2015/06";

/// Namespace that changes no triangle, though a file may require it: colours, materials, textures.
const MATERIALS: &str = "http://schemas.microsoft.com/3dmanufacturing/material/2015/02";

/// Most objects, components and build items of all models of a package: each takes some ten times
/// the memory of its text.
const MOST_OBJECTS: usize = 1_000_000;

/// Most characters of a name: each placed mesh may have a copy.
const MOST_NAME: usize = 200;

/// Element that contains the next ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum ModelElement {
    Model,
    Resources,
    Object,
    Mesh,
    Vertices,
    Triangles,
    Components,
    Build,
    /// Anything else.
    Ignored,
}

/// Reads a model; `n_objects` counts the objects, components and items of all models read so far.
pub(super) fn read_model(name: &str, xml: &mut XmlPart<'_>, n_objects: &mut usize) -> Result<ModelPart, ImportFault> {
    let mut reader = ModelReader {
        name,
        n_objects,
        core: String::new(),
        path_attribute: None,
        around: Vec::new(),
        current: None,
        part: ModelPart { unit: MILLIMETER, objects: BTreeMap::new(), items: Vec::new() },
    };
    while let Some(tag) = xml.next_tag()? {
        if let Err(problem) = reader.take(tag) {
            return Err(match problem {
                Problem::Message(message) => match reader.current {
                    Some(id) => ImportFault::Element { element: format!("{name}, object {id}"), message },
                    None => xml.fault(&message),
                },
                Problem::Fault(fault) => fault,
            });
        }
    }
    Ok(reader.part)
}

/// A fault whose place the caller knows, or one that says its own.
enum Problem {
    Message(String),
    Fault(ImportFault),
}

impl From<String> for Problem {
    fn from(message: String) -> Self {
        Self::Message(message)
    }
}

impl From<ImportFault> for Problem {
    fn from(fault: ImportFault) -> Self {
        Self::Fault(fault)
    }
}

struct ModelReader<'n> {
    name: &'n str,
    /// Objects, components and items of all models so far.
    n_objects: &'n mut usize,
    /// Prefix of the core namespace.
    core: String,
    /// Name of the attribute that names another part.
    path_attribute: Option<String>,
    around: Vec<ModelElement>,
    /// Object that is read.
    current: Option<u32>,
    part: ModelPart,
}

impl ModelReader<'_> {
    fn take(&mut self, tag: &XmlTag) -> Result<(), Problem> {
        self.around.truncate(tag.level);
        if !self.around.contains(&ModelElement::Object) {
            self.current = None;
        }
        let element = self.element(tag)?;
        if !tag.is_empty {
            self.around.push(element);
        }
        Ok(())
    }

    fn element(&mut self, tag: &XmlTag) -> Result<ModelElement, Problem> {
        let Some(around) = self.around.last() else {
            self.model(tag)?;
            return Ok(ModelElement::Model);
        };
        if tag.prefix != self.core {
            return Ok(ModelElement::Ignored);
        }
        Ok(match (around, tag.name.as_str()) {
            (ModelElement::Model, "resources") => ModelElement::Resources,
            (ModelElement::Model, "build") => ModelElement::Build,
            (ModelElement::Resources, "object") => {
                self.object(tag)?;
                ModelElement::Object
            }
            (ModelElement::Object, "mesh") => ModelElement::Mesh,
            (ModelElement::Object, "components") => ModelElement::Components,
            (ModelElement::Mesh, "vertices") => ModelElement::Vertices,
            (ModelElement::Mesh, "triangles") => ModelElement::Triangles,
            (ModelElement::Vertices, "vertex") => {
                self.vertex(tag)?;
                ModelElement::Ignored
            }
            (ModelElement::Triangles, "triangle") => {
                self.triangle(tag)?;
                ModelElement::Ignored
            }
            (ModelElement::Components, "component") => {
                let placement = self.placement(tag)?;
                self.open_object()?.components.push(placement);
                ModelElement::Ignored
            }
            (ModelElement::Build, "item") => {
                let placement = self.placement(tag)?;
                self.part.items.push(placement);
                ModelElement::Ignored
            }
            _ => ModelElement::Ignored,
        })
    }

    fn model(&mut self, tag: &XmlTag) -> Result<(), Problem> {
        let prefix_of = |namespace: &str| {
            let declared = tag.attributes().iter().filter(|(_, value)| value == namespace);
            declared
                .filter_map(|(name, _)| match name.strip_prefix("xmlns")? {
                    "" => Some(""),
                    prefix => prefix.strip_prefix(':'),
                })
                .next()
        };
        let core = prefix_of(CORE).ok_or_else(|| format!("its outermost element is not of the namespace {CORE}"))?;
        if tag.prefix != core || tag.name != "model" {
            return Err(format!("its outermost element is \"{}\", not \"model\"", tag.name.escape_debug()).into());
        }
        self.core = core.to_owned();
        self.path_attribute = prefix_of(PRODUCTION).map(|prefix| format!("{prefix}:path"));
        for prefix in tag.attribute("requiredextensions").unwrap_or_default().split_whitespace() {
            let namespace = tag.attribute(&format!("xmlns:{prefix}")).unwrap_or(prefix);
            if ![CORE, PRODUCTION, MATERIALS].contains(&namespace) {
                let shown: String = namespace.chars().take(100).collect();
                let feature = format!("the extension {}, which {} requires,", shown.escape_debug(), self.name);
                return Err(ImportFault::Unsupported { feature, hint: "write the file without it" }.into());
            }
        }
        if let Some(unit) = tag.attribute("unit") {
            let known = UNITS.into_iter().find(|(name, _)| *name == unit);
            self.part.unit = known.ok_or_else(|| {
                let names = UNITS.map(|(name, _)| name).join(", ");
                format!("its unit is \"{}\"; known are {names}", unit.escape_debug())
            })?;
        }
        Ok(())
    }

    fn object(&mut self, tag: &XmlTag) -> Result<(), Problem> {
        let id = id_of(tag, "id")?;
        let is_support = matches!(tag.attribute("type"), Some("support" | "solidsupport"));
        self.count()?;
        let name = name_of(tag, "name");
        let object = ModelObject { name, is_support, ..ModelObject::default() };
        self.current = Some(id);
        match self.part.objects.insert(id, object) {
            Some(_) => Err(format!("there are two objects with the id {id}").into()),
            None => Ok(()),
        }
    }

    fn open_object(&mut self) -> Result<&mut ModelObject, Problem> {
        let open = self.current.and_then(|id| self.part.objects.get_mut(&id));
        open.ok_or_else(|| Problem::Message("it is in no object".to_owned()))
    }

    fn vertex(&mut self, tag: &XmlTag) -> Result<(), Problem> {
        let n = self.open_object()?.vertices.len();
        let mut point: Point3<f64> = Point3::origin();
        for (k, axis) in ["x", "y", "z"].into_iter().enumerate() {
            let text = tag.attribute(axis).ok_or_else(|| format!("vertex {n} has no {axis}"))?;
            point[k] = text.trim().parse().map_err(|_| format!("vertex {n} has {axis} = {}", shown(text)))?;
        }
        if !point.iter().all(|x| x.is_finite()) {
            let place = format!("{}, object {}, vertex {n}", self.name, self.current.unwrap_or_default());
            return Err(ImportFault::NotFinite { place }.into());
        }
        self.open_object()?.vertices.push(point);
        Ok(())
    }

    fn triangle(&mut self, tag: &XmlTag) -> Result<(), Problem> {
        let object = self.open_object()?;
        let (n, n_vertices) = (object.triangles.len(), object.vertices.len());
        let mut corners = [0; 3];
        for (corner, name) in corners.iter_mut().zip(["v1", "v2", "v3"]) {
            let text = tag.attribute(name).ok_or_else(|| format!("triangle {n} has no {name}"))?;
            let index: u64 = text.trim().parse().map_err(|_| format!("triangle {n} has {name} = {}", shown(text)))?;
            let known = u32::try_from(index).ok().filter(|v| (*v as usize) < n_vertices);
            *corner = known
                .ok_or_else(|| format!("triangle {n} uses vertex {index}, but there are only {n_vertices} vertices"))?;
        }
        object.triangles.push(corners);
        Ok(())
    }

    /// Counts an object or a placement.
    fn count(&mut self) -> Result<(), Problem> {
        *self.n_objects += 1;
        if *self.n_objects > MOST_OBJECTS {
            let message =
                format!("the package has more than {MOST_OBJECTS} objects, components and items; write fewer of them");
            return Err(message.into());
        }
        Ok(())
    }

    fn placement(&mut self, tag: &XmlTag) -> Result<Placement, Problem> {
        self.count()?;
        let object = id_of(tag, "objectid")?;
        let path = self.path_attribute.as_ref().and_then(|name| tag.attribute(name));
        let part = path.map(|path| part_name(self.name, path)).transpose()?;
        let transform = tag.attribute("transform").map(transform_of).transpose()?;
        Ok(Placement {
            part,
            object,
            transform: transform.unwrap_or(Affine::identity()),
            part_number: name_of(tag, "partnumber"),
        })
    }
}

/// A name, cut to [`MOST_NAME`]; empty without one.
fn name_of(tag: &XmlTag, attribute: &str) -> String {
    tag.attribute(attribute).unwrap_or_default().trim().chars().take(MOST_NAME).collect()
}

fn id_of(tag: &XmlTag, name: &str) -> Result<u32, String> {
    let text = tag.attribute(name).ok_or_else(|| format!("\"{}\" has no {name}", tag.name.escape_debug()))?;
    text.trim().parse().map_err(|_| format!("{name} is {}, which is no id", shown(text)))
}

/// Twelve numbers: rows of the matrix that is multiplied from the right, the shift last.
fn transform_of(text: &str) -> Result<Affine, String> {
    let wrong = || format!("the transform {} is not of 12 finite numbers", shown(text));
    let mut numbers = [0.0; 12];
    let mut words = text.split_whitespace();
    for number in &mut numbers {
        let value: f64 = words.next().and_then(|word| word.parse().ok()).ok_or_else(wrong)?;
        *number = Some(value).filter(|value| value.is_finite()).ok_or_else(wrong)?;
    }
    if words.next().is_some() {
        return Err(wrong());
    }
    let linear = Matrix3::from_column_slice(&numbers[..9]);
    Ok(Affine { linear, shift: Vector3::from_column_slice(&numbers[9..]) })
}

fn shown(text: &str) -> String {
    let start: String = text.chars().take(60).collect();
    format!("\"{}\"", start.escape_debug())
}
