//! Libraries in zip archives (`.tools`): the one entry that holds the tools.
//!
//! Names, sizes and forms of all entries are compared with their bounds before anything is
//! unpacked, and unpacking ends at the stated size.

use std::io::{Cursor, Read};

use zip::result::ZipError;
use zip::{CompressionMethod, ZipArchive};

use crate::fault::ArchiveFault;

/// Most bytes of an unpacked library, as of every file of text. A vendor's catalogue has a tenth.
const MAX_BYTES: u64 = 64 << 20;

/// Most entries of an archive; a library has one.
const MAX_ENTRIES: usize = 64;

/// Name of the entry with the tools.
const LIBRARY_ENTRY: &str = "tools.json";

/// Signatures of an archive without entries, of an entry, and of one in the directory.
const END: &[u8] = b"PK\x05\x06";
const LOCAL: &[u8] = b"PK\x03\x04";
const DIRECTORY: &[u8] = b"PK\x01\x02";

/// Returns whether bytes begin as a zip archive.
pub(crate) fn is_archive(bytes: &[u8]) -> bool {
    bytes.starts_with(LOCAL) || bytes.starts_with(END)
}

/// Unpacks the library of an archive.
///
/// # Errors
/// Where the archive is damaged, encrypted, of a form that libraries do not have, or too large;
/// where names lead out of it; where not exactly one entry is a library.
pub(crate) fn library_text(bytes: &[u8]) -> Result<Vec<u8>, ArchiveFault> {
    // Each entry takes memory before any is read.
    let signatures = bytes.windows(DIRECTORY.len()).filter(|window| *window == DIRECTORY);
    let n_signatures = signatures.take(MAX_ENTRIES + 1).count();
    if n_signatures > MAX_ENTRIES {
        return Err(ArchiveFault::TooManyEntries);
    }
    let mut archive = ZipArchive::new(Cursor::new(bytes)).map_err(|e| ArchiveFault::Broken(e.to_string()))?;
    // The last one of several entries with one name is all that the directory's reader keeps.
    if archive.len() != n_signatures {
        return Err(ArchiveFault::Broken("several of its entries have one name".to_owned()));
    }
    let mut json = Vec::new();
    for index in 0..archive.len() {
        let entry = archive.by_index_raw(index).map_err(damaged)?;
        if leads_outside(entry.name()) {
            return Err(ArchiveFault::OutsideName(entry.name().chars().take(80).collect()));
        }
        if entry.encrypted() {
            return Err(ArchiveFault::Unsupported("with a password"));
        }
        if entry.name().to_lowercase().ends_with(".json") {
            json.push((index, entry.name().escape_debug().take(80).collect::<String>()));
        }
    }
    match &json[..] {
        [(index, name)] if name.eq_ignore_ascii_case(LIBRARY_ENTRY) => unpack(&mut archive, *index),
        [] | [_] => Err(ArchiveFault::NoLibrary),
        _ => {
            let names: Vec<String> = json.into_iter().map(|(_, name)| name).collect();
            Err(ArchiveFault::SeveralLibraries(names.join(", ")))
        }
    }
}

/// Whether a name, used as a path, would leave the folder that it is unpacked in.
fn leads_outside(name: &str) -> bool {
    name.starts_with('/') || name.contains(['\\', ':', '\0']) || name.split('/').any(|part| part == "..")
}

fn unpack(archive: &mut ZipArchive<Cursor<&[u8]>>, index: usize) -> Result<Vec<u8>, ArchiveFault> {
    let raw = archive.by_index_raw(index).map_err(damaged)?;
    if !matches!(raw.compression(), CompressionMethod::Stored | CompressionMethod::Deflated) {
        return Err(ArchiveFault::Unsupported("packed in another way than \"deflate\""));
    }
    if raw.size() > MAX_BYTES {
        return Err(ArchiveFault::TooLarge(raw.size() / 1_000_000));
    }
    drop(raw);
    let entry = archive.by_index(index).map_err(damaged)?;
    let stated = entry.size();
    let mut text = Vec::new();
    // One byte more than stated, so that a longer text is noticed and not held.
    entry.take(stated + 1).read_to_end(&mut text).map_err(|e| ArchiveFault::Damaged(e.to_string()))?;
    if text.len() as u64 != stated {
        return Err(ArchiveFault::Damaged("it has another size than stated".to_owned()));
    }
    Ok(text)
}

fn damaged(e: ZipError) -> ArchiveFault {
    ArchiveFault::Damaged(e.to_string())
}
