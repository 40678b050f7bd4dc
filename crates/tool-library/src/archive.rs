//! Libraries in zip archives (`.tools`): the one entry that holds the tools.
//!
//! The directory at the archive's end says where entries are, how large, and how packed; sizes are
//! compared with their bounds before anything is unpacked, and unpacking ends at the stated size.

use std::io::Read;

use flate2::Crc;
use flate2::read::DeflateDecoder;

use crate::fault::ArchiveFault;

/// Most bytes of an unpacked library, as of every file of text. A vendor's catalogue has a tenth.
const MAX_BYTES: u32 = 64 << 20;

/// Most entries of an archive; a library has one.
const MAX_ENTRIES: usize = 64;

/// Name of the entry with the tools.
const LIBRARY_ENTRY: &str = "tools.json";

/// Signatures of the directory's end, its headers, and the header before an entry's bytes.
const END: &[u8] = b"PK\x05\x06";
const DIRECTORY: &[u8] = b"PK\x01\x02";
const LOCAL: &[u8] = b"PK\x03\x04";

/// Lengths of these three without names and comments.
const END_SIZE: usize = 22;
const DIRECTORY_SIZE: usize = 46;
const LOCAL_SIZE: usize = 30;

/// A size or place that only the 64-bit form of archives has.
const IN_64_BITS: u32 = u32::MAX;

/// Returns whether bytes begin as a zip archive.
pub(crate) fn is_archive(bytes: &[u8]) -> bool {
    bytes.starts_with(LOCAL) || bytes.starts_with(END)
}

/// Entry of the directory.
struct ArchiveEntry {
    name: String,
    is_encrypted: bool,
    method: u16,
    checksum: u32,
    packed: u32,
    unpacked: u32,
    local: u32,
}

/// Unpacks the library of an archive.
///
/// # Errors
/// Where the archive is damaged, encrypted, of a form that libraries do not have, or too large;
/// where names lead out of it; where not exactly one entry is a library.
pub(crate) fn library_text(bytes: &[u8]) -> Result<Vec<u8>, ArchiveFault> {
    let entries = directory(bytes)?;
    if let Some(outside) = entries.iter().find(|entry| leads_outside(&entry.name)) {
        return Err(ArchiveFault::OutsideName(outside.name.chars().take(80).collect()));
    }
    if entries.iter().any(|entry| entry.is_encrypted) {
        return Err(ArchiveFault::Unsupported("with a password"));
    }
    let is_json = |entry: &&ArchiveEntry| entry.name.to_lowercase().ends_with(".json");
    let json: Vec<&ArchiveEntry> = entries.iter().filter(is_json).collect();
    match json[..] {
        [entry] if entry.name.eq_ignore_ascii_case(LIBRARY_ENTRY) => unpack(bytes, entry),
        [] | [_] => Err(ArchiveFault::NoLibrary),
        _ => {
            let names: Vec<String> = json.iter().map(|entry| entry.name.escape_debug().take(80).collect()).collect();
            Err(ArchiveFault::SeveralLibraries(names.join(", ")))
        }
    }
}

/// Whether a name, used as a path, would leave the folder that it is unpacked in.
fn leads_outside(name: &str) -> bool {
    name.starts_with('/') || name.contains(['\\', ':', '\0']) || name.split('/').any(|part| part == "..")
}

fn u16_at(bytes: &[u8], at: usize) -> Option<u16> {
    Some(u16::from_le_bytes(bytes.get(at..at.checked_add(2)?)?.try_into().ok()?))
}

fn u32_at(bytes: &[u8], at: usize) -> Option<u32> {
    Some(u32::from_le_bytes(bytes.get(at..at.checked_add(4)?)?.try_into().ok()?))
}

/// Returns the place of the directory's end: the last one whose comment ends with the file.
fn end_of_directory(bytes: &[u8]) -> Option<usize> {
    let last = bytes.len().checked_sub(END_SIZE)?;
    let first = last.saturating_sub(usize::from(u16::MAX));
    (first..=last).rev().find(|&at| {
        let comment = u16_at(bytes, at + 20).map(usize::from);
        bytes[at..].starts_with(END) && comment.is_some_and(|n| at + END_SIZE + n == bytes.len())
    })
}

fn directory(bytes: &[u8]) -> Result<Vec<ArchiveEntry>, ArchiveFault> {
    const SHORT: ArchiveFault = ArchiveFault::Broken("its directory is cut off");
    let end = end_of_directory(bytes).ok_or(ArchiveFault::Broken("its end is missing"))?;
    let word = |at: usize| u16_at(bytes, end + at).ok_or(SHORT);
    if [word(4)?, word(6)?] != [0, 0] || word(8)? != word(10)? {
        return Err(ArchiveFault::Unsupported("in several parts"));
    }
    let n = usize::from(word(10)?);
    let start = u32_at(bytes, end + 16).ok_or(SHORT)?;
    if start == IN_64_BITS || n == usize::from(u16::MAX) {
        return Err(ArchiveFault::Unsupported("in the 64-bit form"));
    }
    if n > MAX_ENTRIES {
        return Err(ArchiveFault::TooManyEntries(n));
    }
    let mut at = start as usize;
    let mut entries = Vec::with_capacity(n);
    for _ in 0..n {
        let (entry, next) = directory_entry(bytes, at)?;
        entries.push(entry);
        at = next;
    }
    Ok(entries)
}

/// Returns the directory's entry at a place, and the place of the next one.
fn directory_entry(bytes: &[u8], at: usize) -> Result<(ArchiveEntry, usize), ArchiveFault> {
    const SHORT: ArchiveFault = ArchiveFault::Broken("its directory is cut off");
    if !bytes.get(at..).is_some_and(|rest| rest.starts_with(DIRECTORY)) {
        return Err(ArchiveFault::Broken("its directory is not where its end says"));
    }
    let word = |offset: usize| u16_at(bytes, at + offset).ok_or(SHORT);
    let long = |offset: usize| u32_at(bytes, at + offset).ok_or(SHORT);
    let n_name = usize::from(word(28)?);
    let name = bytes.get(at + DIRECTORY_SIZE..at + DIRECTORY_SIZE + n_name).ok_or(SHORT)?;
    let entry = ArchiveEntry {
        name: String::from_utf8_lossy(name).into_owned(),
        // Passwords, strong encryption, and a directory that is encrypted.
        is_encrypted: word(8)? & 0x2041 != 0,
        method: word(10)?,
        checksum: long(16)?,
        packed: long(20)?,
        unpacked: long(24)?,
        local: long(42)?,
    };
    let next = at + DIRECTORY_SIZE + n_name + usize::from(word(30)?) + usize::from(word(32)?);
    Ok((entry, next))
}

fn unpack(bytes: &[u8], entry: &ArchiveEntry) -> Result<Vec<u8>, ArchiveFault> {
    if [entry.packed, entry.unpacked, entry.local].contains(&IN_64_BITS) {
        return Err(ArchiveFault::Unsupported("in the 64-bit form"));
    }
    if entry.unpacked > MAX_BYTES {
        return Err(ArchiveFault::TooLarge(u64::from(entry.unpacked) / 1_000_000));
    }
    let packed = packed_bytes(bytes, entry)?;
    let text = match entry.method {
        0 => packed.to_vec(),
        8 => inflate(packed, entry.unpacked)?,
        _ => return Err(ArchiveFault::Unsupported("packed in another way than \"deflate\"")),
    };
    if text.len() != entry.unpacked as usize {
        return Err(ArchiveFault::Damaged("it has another size than stated"));
    }
    let mut checksum = Crc::new();
    checksum.update(&text);
    if checksum.sum() != entry.checksum {
        return Err(ArchiveFault::Damaged("its checksum is wrong"));
    }
    Ok(text)
}

/// Returns the packed bytes of an entry, behind the header that repeats its name.
fn packed_bytes<'a>(bytes: &'a [u8], entry: &ArchiveEntry) -> Result<&'a [u8], ArchiveFault> {
    const AWAY: ArchiveFault = ArchiveFault::Damaged("it is not where the directory says");
    let at = entry.local as usize;
    let header = bytes.get(at..).filter(|rest| rest.starts_with(LOCAL)).ok_or(AWAY)?;
    let n_name = usize::from(u16_at(header, 26).ok_or(AWAY)?);
    let n_extra = usize::from(u16_at(header, 28).ok_or(AWAY)?);
    let name = header.get(LOCAL_SIZE..LOCAL_SIZE + n_name).ok_or(AWAY)?;
    if name != entry.name.as_bytes() {
        return Err(ArchiveFault::Damaged("it has two names"));
    }
    let from = LOCAL_SIZE + n_name + n_extra;
    header.get(from..from + entry.packed as usize).ok_or(AWAY)
}

/// Unpacks up to one byte more than stated, so that a longer text is noticed and not held.
fn inflate(packed: &[u8], stated: u32) -> Result<Vec<u8>, ArchiveFault> {
    let mut text = Vec::new();
    let mut bounded = DeflateDecoder::new(packed).take(u64::from(stated) + 1);
    bounded.read_to_end(&mut text).map_err(|_| ArchiveFault::Damaged("it cannot be unpacked"))?;
    Ok(text)
}
