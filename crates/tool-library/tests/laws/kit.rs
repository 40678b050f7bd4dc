//! Libraries written by hand in the documented form, and archives of them.

use std::io::Write;

use facemill_tool_library::{ImportedTool, LibraryTool, ToolRefusal, read_library};
use flate2::Crc;
use flate2::write::DeflateEncoder;
use serde_json::{Value, json};

/// A bull nose end mill in inches, number 7, in a holder in mm: shaft with a neck, three presets.
pub(crate) fn inch_tool() -> Value {
    json!({
        "type": "bull nose end mill", "unit": "inches", "description": "1/2 r1/16 long reach",
        "guid": "0", "product-id": "X-1", "vendor": "none", "BMC": "carbide",
        "post-process": { "number": 7, "length-offset": 17, "diameter-offset": 27, "turret": 0, "live": true },
        "geometry": {
            "DC": 0.5, "RE": 0.0625, "NOF": 4, "LCF": 1.0, "LB": 3.0, "OAL": 4.5, "SFDM": 0.625,
            "shoulder-length": 1.0, "HAND": true, "CSP": false, "assemblyGaugeLength": 5.755905511811024
        },
        "expressions": { "tool_diameter": ".5 in", "tool_bodyLength": "3 in", "tool_description": "'x'" },
        "shaft": { "type": "shaft", "segments": [
            { "height": 1.5, "lower-diameter": 0.48, "upper-diameter": 0.48 },
            { "height": 0.25, "lower-diameter": 0.48, "upper-diameter": 0.625 }
        ] },
        "holder": {
            "type": "holder", "unit": "millimeters", "description": "HSK63 ER32", "gaugeLength": 70.0,
            "segments": [
                { "height": 20.0, "lower-diameter": 40.0, "upper-diameter": 50.0 },
                { "height": 0.0, "lower-diameter": 50.0, "upper-diameter": 63.0 },
                { "height": 50.0, "lower-diameter": 63.0, "upper-diameter": 63.0 },
                { "height": 2.0, "lower-diameter": 48.0, "upper-diameter": 48.0 }
            ]
        },
        "start-values": { "presets": [
            { "name": "steel", "n": 3000, "v_f": 50, "v_f_leadIn": 40, "v_f_plunge": 20, "tool-coolant": "flood" },
            { "name": "by tooth", "n": 1000, "f_z": 0.002, "tool-coolant": "disabled" },
            { "name": "bare" }
        ] }
    })
}

/// The library of these tools.
pub(crate) fn library(tools: &[Value]) -> Vec<u8> {
    serde_json::to_vec(&json!({ "data": tools, "version": 36 })).expect("JSON")
}

/// The inch tool with values replaced by pointer; `null` is written as it is.
pub(crate) fn changed(values: &[(&str, Value)]) -> Value {
    let mut tool = inch_tool();
    for (pointer, value) in values {
        let (object, key) = pointer.rsplit_once('/').expect("a pointer");
        let object = if object.is_empty() { Some(&mut tool) } else { tool.pointer_mut(object) };
        let object = object.and_then(Value::as_object_mut).unwrap_or_else(|| panic!("{pointer}"));
        object.insert(key.to_owned(), value.clone());
    }
    tool
}

/// The inch tool without a key.
pub(crate) fn without(pointer: &str) -> Value {
    let mut tool = inch_tool();
    let (object, key) = pointer.rsplit_once('/').expect("a pointer");
    let object = if object.is_empty() { Some(&mut tool) } else { tool.pointer_mut(object) };
    let removed = object.and_then(Value::as_object_mut).and_then(|object| object.remove(key));
    assert!(removed.is_some(), "{pointer}");
    tool
}

/// The only tool of a library.
pub(crate) fn read_one(tool: &Value) -> LibraryTool {
    let mut all = read_library(&library(std::slice::from_ref(tool))).expect("a library");
    assert_eq!(all.len(), 1);
    all.remove(0)
}

/// The only tool of a library, which is sound.
pub(crate) fn imported(tool: &Value) -> ImportedTool {
    read_one(tool).import.unwrap_or_else(|why| panic!("{why}"))
}

/// Keys of the faults of the only tool, and all of them as one text.
pub(crate) fn faults(tool: &Value) -> (Vec<String>, String) {
    let why = read_one(tool).import.expect_err("a fault");
    let text = why.to_string();
    match why {
        ToolRefusal::Faults { first, .. } => (first.into_iter().map(|fault| fault.key).collect(), text),
        other => panic!("{other}"),
    }
}

/// Entry of an archive.
pub(crate) struct ZipEntry<'a> {
    pub(crate) name: &'a str,
    pub(crate) text: &'a [u8],
    pub(crate) is_stored: bool,
    pub(crate) flags: u16,
    pub(crate) method: Option<u16>,
    /// Size in the directory, where it is not that of the text.
    pub(crate) stated: Option<u32>,
    pub(crate) checksum: Option<u32>,
}

impl<'a> ZipEntry<'a> {
    pub(crate) fn new(name: &'a str, text: &'a [u8]) -> Self {
        Self { name, text, is_stored: false, flags: 0, method: None, stated: None, checksum: None }
    }
}

/// An archive of these entries, as the published description of the format has it.
pub(crate) fn zip(entries: &[ZipEntry<'_>]) -> Vec<u8> {
    let (mut bytes, mut directory) = (Vec::new(), Vec::new());
    for entry in entries {
        let packed = if entry.is_stored {
            entry.text.to_vec()
        } else {
            let mut encoder = DeflateEncoder::new(Vec::new(), flate2::Compression::best());
            encoder.write_all(entry.text).expect("in memory");
            encoder.finish().expect("in memory")
        };
        let mut sum = Crc::new();
        sum.update(entry.text);
        let method = entry.method.unwrap_or(if entry.is_stored { 0 } else { 8 });
        let mut common = Vec::new();
        for word in [20, entry.flags, method, 0, 0] {
            common.extend(word.to_le_bytes());
        }
        common.extend(entry.checksum.unwrap_or(sum.sum()).to_le_bytes());
        common.extend((packed.len() as u32).to_le_bytes());
        common.extend(entry.stated.unwrap_or(entry.text.len() as u32).to_le_bytes());
        let local = bytes.len() as u32;
        bytes.extend(b"PK\x03\x04");
        bytes.extend(&common);
        bytes.extend((entry.name.len() as u16).to_le_bytes());
        bytes.extend(0u16.to_le_bytes());
        bytes.extend(entry.name.as_bytes());
        bytes.extend(&packed);
        directory.extend(b"PK\x01\x02\x14\x00");
        directory.extend(&common);
        directory.extend((entry.name.len() as u16).to_le_bytes());
        directory.extend([0; 12]);
        directory.extend(local.to_le_bytes());
        directory.extend(entry.name.as_bytes());
    }
    let start = bytes.len() as u32;
    bytes.extend(&directory);
    bytes.extend(b"PK\x05\x06\0\0\0\0");
    bytes.extend((entries.len() as u16).to_le_bytes());
    bytes.extend((entries.len() as u16).to_le_bytes());
    bytes.extend((directory.len() as u32).to_le_bytes());
    bytes.extend(start.to_le_bytes());
    bytes.extend([0, 0]);
    bytes
}
