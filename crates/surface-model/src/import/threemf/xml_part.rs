//! XML of a part of a package, tag by tag, in bounded memory.

use std::cell::Cell;
use std::io::{self, BufReader, Read};
use std::rc::Rc;

use quick_xml::events::{BytesStart, Event};
use quick_xml::{Reader, XmlVersion};

use crate::import::settings::ImportFault;

/// Longest tag, text or comment, bytes: it is held in memory as a whole.
const MOST_EVENT: u64 = 1 << 24;

/// Most attributes of a tag.
const MOST_ATTRIBUTES: usize = 64;

/// Deepest nesting of tags: a model has six levels, and extensions a few more.
const MOST_LEVELS: usize = 64;

/// Reads no more than a budget, and no more than [`MOST_EVENT`] between two calls of
/// [`Self::begin_event`].
pub(super) struct BoundedRead<'r> {
    inner: Box<dyn Read + 'r>,
    budget: Rc<Cell<u64>>,
    in_event: u64,
}

impl<'r> BoundedRead<'r> {
    pub(super) fn new(inner: Box<dyn Read + 'r>, budget: Rc<Cell<u64>>) -> Self {
        Self { inner, budget, in_event: 0 }
    }

    fn begin_event(&mut self) {
        self.in_event = 0;
    }
}

impl Read for BoundedRead<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let n = self.inner.read(buffer)?;
        let read = n as u64;
        self.in_event += read;
        if self.in_event > MOST_EVENT {
            return Err(io::Error::other(format!("a tag or text is longer than {MOST_EVENT} bytes")));
        }
        let left = self.budget.get().checked_sub(read);
        let left = left.ok_or_else(|| {
            io::Error::other("it unpacks to far more than its size, or to more than 2 GiB; write a smaller mesh")
        })?;
        self.budget.set(left);
        Ok(n)
    }
}

/// A tag that opens, or stands alone.
pub(super) struct XmlTag {
    /// Namespace prefix, empty without one.
    pub(super) prefix: String,
    /// Name without the prefix.
    pub(super) name: String,
    /// Whether it closes at once.
    pub(super) is_empty: bool,
    /// Number of tags around it.
    pub(super) level: usize,
    /// Names with their prefixes, and values; behind the first `n_attributes` those of other tags.
    attributes: Vec<(String, String)>,
    n_attributes: usize,
}

impl XmlTag {
    /// Attributes: names with their prefixes, and values.
    pub(super) fn attributes(&self) -> &[(String, String)] {
        &self.attributes[..self.n_attributes]
    }

    /// Value of an attribute by its whole name.
    pub(super) fn attribute(&self, name: &str) -> Option<&str> {
        self.attributes().iter().find(|(known, _)| known == name).map(|(_, value)| value.as_str())
    }
}

/// A part as it is read.
pub(super) struct XmlPart<'r> {
    name: String,
    reader: Reader<BufReader<BoundedRead<'r>>>,
    buffer: Vec<u8>,
    level: usize,
    has_root: bool,
    tag: XmlTag,
}

impl<'r> XmlPart<'r> {
    pub(super) fn new(name: &str, read: BoundedRead<'r>) -> Self {
        let tag = XmlTag {
            prefix: String::new(),
            name: String::new(),
            is_empty: false,
            level: 0,
            attributes: Vec::new(),
            n_attributes: 0,
        };
        let reader = Reader::from_reader(BufReader::new(read));
        Self { name: name.to_owned(), reader, buffer: Vec::new(), level: 0, has_root: false, tag }
    }

    /// Next tag that opens or stands alone; `None` at the end, where all tags are closed.
    pub(super) fn next_tag(&mut self) -> Result<Option<&XmlTag>, ImportFault> {
        loop {
            self.buffer.clear();
            self.reader.get_mut().get_mut().begin_event();
            match self.reader.read_event_into(&mut self.buffer) {
                Ok(Event::Start(start)) => {
                    fill(&mut self.tag, &start, self.level, false).map_err(|m| self.fault(&m))?;
                    self.open()?;
                    self.level += 1;
                    return Ok(Some(&self.tag));
                }
                Ok(Event::Empty(start)) => {
                    fill(&mut self.tag, &start, self.level, true).map_err(|m| self.fault(&m))?;
                    self.open()?;
                    return Ok(Some(&self.tag));
                }
                Ok(Event::End(_)) => self.level = self.level.saturating_sub(1),
                Ok(Event::DocType(_)) => return Err(self.fault("it has a document type, which 3MF forbids")),
                Ok(Event::Eof) if self.level == 0 && self.has_root => return Ok(None),
                Ok(Event::Eof) => return Err(self.fault("the XML ends in the middle: it is truncated")),
                Ok(_) => {}
                Err(quick_xml::Error::Io(e)) => return Err(self.fault(&format!("it cannot be read: {e}"))),
                Err(e) => return Err(self.fault(&format!("the XML is wrong: {e}"))),
            }
        }
    }

    fn open(&mut self) -> Result<(), ImportFault> {
        if self.level == 0 && std::mem::replace(&mut self.has_root, true) {
            return Err(self.fault("it has two outermost elements"));
        }
        if self.level >= MOST_LEVELS {
            return Err(self.fault(&format!("its elements are nested deeper than {MOST_LEVELS}")));
        }
        Ok(())
    }

    /// A fault here.
    pub(super) fn fault(&self, message: &str) -> ImportFault {
        let element = format!("{}, byte {}", self.name.escape_debug(), self.reader.buffer_position());
        ImportFault::Element { element, message: message.to_owned() }
    }
}

/// Fills a tag anew; strings of the last one are used again.
fn fill(tag: &mut XmlTag, start: &BytesStart<'_>, level: usize, is_empty: bool) -> Result<(), String> {
    let name = start.name();
    tag.prefix.clear();
    if let Some(prefix) = name.prefix() {
        tag.prefix.push_str(prefix.as_ref());
    }
    tag.name.clear();
    tag.name.push_str(name.local_name().as_ref());
    tag.is_empty = is_empty;
    tag.level = level;
    tag.n_attributes = 0;
    // The reader's own search for attributes that are there twice has no bound.
    for attribute in start.attributes().with_checks(false) {
        let attribute = attribute.map_err(|e| format!("an attribute is wrong: {e}"))?;
        let value = attribute.normalized_value(XmlVersion::Implicit1_0);
        let value = value.map_err(|e| format!("an attribute is wrong: {e}"))?;
        if tag.n_attributes == MOST_ATTRIBUTES {
            return Err(format!("\"{}\" has more than {MOST_ATTRIBUTES} attributes", tag.name.escape_debug()));
        }
        let key = attribute.key.as_ref();
        if tag.attributes().iter().any(|(known, _)| known == key) {
            return Err(format!("\"{}\" has {} twice", tag.name.escape_debug(), key.escape_debug()));
        }
        if tag.n_attributes == tag.attributes.len() {
            tag.attributes.push((String::new(), String::new()));
        }
        let (name_of, value_of) = &mut tag.attributes[tag.n_attributes];
        name_of.clear();
        name_of.push_str(key);
        value_of.clear();
        value_of.push_str(&value);
        tag.n_attributes += 1;
    }
    Ok(())
}
