//! Faults, assumed values and notes of a tool that is being read.

use facemill_tool_model::AssumedMeasure;

use crate::fault::ToolFault;

/// All that is to be reported of a tool besides its measures.
#[derive(Default)]
pub(crate) struct ToolRemarks {
    pub(crate) faults: Vec<ToolFault>,
    pub(crate) assumed: Vec<AssumedMeasure>,
    pub(crate) notes: Vec<String>,
}

impl ToolRemarks {
    pub(crate) fn fault(&mut self, key: impl Into<String>, fault: impl Into<String>) {
        self.faults.push(ToolFault::new(key, fault));
    }

    pub(crate) fn assume(&mut self, key: &str, reason: impl Into<String>) {
        self.assumed.push(AssumedMeasure { key: key.to_owned(), reason: reason.into() });
    }

    pub(crate) fn note(&mut self, note: impl Into<String>) {
        self.notes.push(note.into());
    }

    /// Returns whether a key has a fault already.
    pub(crate) fn has_fault_at(&self, key: &str) -> bool {
        self.faults.iter().any(|fault| fault.key == key)
    }
}
