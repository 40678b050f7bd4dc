//! The ZIP package of a 3MF file.

use std::cell::Cell;
use std::collections::BTreeMap;
use std::io::{Cursor, Read};
use std::rc::Rc;

use zip::ZipArchive;
use zip::result::ZipError;

use crate::import::settings::ImportFault;
use crate::import::threemf::xml_part::{BoundedRead, XmlPart};
use crate::import::uri;

/// Most files in a package: an assembly has a few dozen, and each takes memory before it is read.
const MOST_FILES: usize = 65_535;

/// Signature of a file in the directory of a package.
const DIRECTORY_ENTRY: &[u8] = b"PK\x01\x02";

/// Most bytes that all models of a package may unpack to: as many as a mesh file may have.
const MOST_UNPACKED: u64 = 1 << 31;

/// Most bytes that a byte of the package may become: coordinates as text shrink to a tenth, a few
/// tags over and over to a fiftieth, and blanks to a thousandth.
const MOST_RATIO: u64 = 64;

/// Bytes that any package may unpack to, however small it is.
const LEAST_UNPACKED: u64 = 1 << 20;

/// Relationship to the main model.
const MODEL_RELATION: &str = "http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel";

/// Where the relations of the package are.
const RELATIONS: &str = "_rels/.rels";

/// An open package.
pub(super) struct Package<'b> {
    archive: ZipArchive<Cursor<&'b [u8]>>,
    /// Names of the files by those in lower case: names of parts are the same in any case.
    names: BTreeMap<String, String>,
    /// Bytes that may still be unpacked.
    budget: Rc<Cell<u64>>,
}

impl<'b> Package<'b> {
    pub(super) fn open(bytes: &'b [u8]) -> Result<Self, ImportFault> {
        let n_files =
            bytes.windows(DIRECTORY_ENTRY.len()).filter(|window| *window == DIRECTORY_ENTRY).take(MOST_FILES + 1);
        if n_files.count() > MOST_FILES {
            return Err(package_fault(format!("it has more than {MOST_FILES} files; write the model alone")));
        }
        let archive = ZipArchive::new(Cursor::new(bytes)).map_err(|e| package_fault(zip_text(&e)))?;
        let most = (bytes.len() as u64).saturating_mul(MOST_RATIO).clamp(LEAST_UNPACKED, MOST_UNPACKED);
        let names = archive.file_names().map(|name| (name.to_ascii_lowercase(), name.to_owned())).collect();
        Ok(Self { archive, names, budget: Rc::new(Cell::new(most)) })
    }

    /// Name of the main model, from the relations of the package.
    pub(super) fn main_model(&mut self) -> Result<String, ImportFault> {
        let target = self.part(RELATIONS, |xml| {
            let mut target = None;
            while let Some(tag) = xml.next_tag()? {
                if tag.attribute("Type").is_some_and(|kind| kind == MODEL_RELATION) && target.is_none() {
                    target = tag.attribute("Target").map(str::to_owned);
                }
            }
            Ok(target)
        })?;
        let target = target.ok_or_else(|| part_fault(RELATIONS, "it names no 3D model; write the file anew as 3MF"))?;
        part_name(RELATIONS, &target)
    }

    /// Unpacks a file of the package while `read` reads it.
    pub(super) fn part<T>(
        &mut self,
        name: &str,
        read: impl FnOnce(&mut XmlPart<'_>) -> Result<T, ImportFault>,
    ) -> Result<T, ImportFault> {
        let known = self.names.get(&name.to_ascii_lowercase());
        let known = known.ok_or_else(|| part_fault(name, "the package has no such file"))?;
        let budget = Rc::clone(&self.budget);
        let file = self.archive.by_name(known).map_err(|e| part_fault(name, &zip_text(&e)))?;
        let unpacked: Box<dyn Read + '_> = Box::new(file);
        read(&mut XmlPart::new(name, BoundedRead::new(unpacked, budget)))
    }
}

/// Turns a name in a part, such as `/3D/3dmodel.model`, into that of a file of the package.
pub(super) fn part_name(written_in: &str, name: &str) -> Result<String, ImportFault> {
    let decoded = uri::percent_decoded(name).replace('\\', "/");
    let inner = decoded.strip_prefix('/').unwrap_or(&decoded);
    let is_inner = inner.split('/').all(|part| !matches!(part, "" | "." | "..") && !part.contains([':', '\0']));
    if is_inner {
        return Ok(inner.to_owned());
    }
    let shown: String = name.chars().take(60).collect();
    let message = format!("the name \"{}\" leads out of the package", shown.escape_debug());
    Err(part_fault(written_in, &message))
}

pub(super) fn part_fault(name: &str, message: &str) -> ImportFault {
    let shown: String = name.chars().take(100).collect();
    ImportFault::Element { element: shown.escape_debug().to_string(), message: message.to_owned() }
}

fn package_fault(message: String) -> ImportFault {
    ImportFault::Element { element: "the 3MF package".to_owned(), message }
}

fn zip_text(e: &ZipError) -> String {
    format!("it cannot be unpacked: {e}")
}
