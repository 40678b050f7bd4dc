use std::collections::BTreeMap;

/// Variables whose values the text so far says: from plain assignments that every run of the
/// program comes by.
#[derive(Debug, Default)]
pub(crate) struct Variables {
    values: BTreeMap<Box<[u8]>, f64>,
}

/// Most variables that are remembered. More are taken as not known, so that no program fills the
/// memory.
const MOST: usize = 10_000;

impl Variables {
    /// The value of a variable, by its name in upper case.
    pub(crate) fn get(&self, name: &[u8]) -> Option<f64> {
        self.values.get(name).copied()
    }

    /// Sets a variable; `None` makes it unknown.
    pub(crate) fn set(&mut self, name: &[u8], value: Option<f64>) {
        match value {
            Some(value) if self.values.len() < MOST || self.values.contains_key(name) => {
                self.values.insert(name.into(), value);
            }
            _ => {
                self.values.remove(name);
            }
        }
    }

    /// Something that is not followed may have set any of them, or come here from elsewhere.
    pub(crate) fn forget_all(&mut self) {
        self.values.clear();
    }
}
