//! Parts of a program with one tool each.

use crate::read::program::{MotionKind, ReadBlock, ReadCommand, ReadProgram};

impl ReadProgram {
    /// Returns the parts of a program that changes tools, each as a program with the lines that it
    /// has in the whole: from one tool change to the next, the first with all before its own. A
    /// program with at most one change is its only part.
    ///
    /// The way from the last cut of a tool to the change belongs to this tool. A comment that names
    /// the length of a tool belongs to the change behind it where the tool before has cut already.
    /// A change to a tool that was chosen in an earlier block says its number again.
    #[must_use]
    pub fn tool_sections(&self) -> Vec<Self> {
        let is_change = |b: &ReadBlock| b.commands.iter().any(|c| matches!(c, ReadCommand::ToolChange));
        let changes: Vec<usize> = (0..self.blocks.len()).filter(|&k| is_change(&self.blocks[k])).collect();
        if changes.len() < 2 {
            return vec![self.clone()];
        }
        let starts: Vec<usize> = std::iter::once(0).chain(changes[1..].iter().copied()).collect();
        let mut sections: Vec<Self> = Vec::with_capacity(starts.len());
        for (k, &start) in starts.iter().enumerate() {
            let end = starts.get(k + 1).copied().unwrap_or(self.blocks.len());
            let mut blocks = self.blocks[start..end].to_vec();
            if let Some(first) = blocks.first_mut().filter(|_| k > 0) {
                self.name_tool(first, start);
            }
            sections.push(Self { blocks, goes_on: k + 1 < starts.len() || self.goes_on, ..self.of_no_block() });
        }
        let section_at = |line: u32| {
            let behind = starts.partition_point(|&start| self.blocks[start].line <= line);
            behind.saturating_sub(1)
        };
        for note in &self.tool_lengths {
            let at = section_at(note.check.map_or(note.line, |check| check.line));
            let own_change = self.blocks[changes[at]].line;
            let has_cut = self.blocks.iter().any(|b| {
                (own_change..note.line).contains(&b.line)
                    && b.motion.as_ref().is_some_and(|m| matches!(m.kind, MotionKind::Linear | MotionKind::Arc { .. }))
            });
            let of_next = note.check.is_none() && has_cut && at + 1 < sections.len();
            sections[at + usize::from(of_next)].tool_lengths.push(*note);
        }
        for note in &self.notes {
            sections[section_at(note.line)].notes.push(note.clone());
        }
        sections
    }

    /// Returns the program without its blocks and what its lines say.
    fn of_no_block(&self) -> Self {
        Self {
            dialect: self.dialect,
            blocks: Vec::new(),
            tool_lengths: Vec::new(),
            notes: Vec::new(),
            rtcp_rapids: self.rtcp_rapids,
            harmless_functions: self.harmless_functions.clone(),
            goes_on: false,
        }
    }

    /// Adds the number of the tool that was chosen before to a change that does not name it.
    fn name_tool(&self, change: &mut ReadBlock, index: usize) {
        let chosen = |b: &ReadBlock| {
            b.commands.iter().rev().find(|c| matches!(c, ReadCommand::Tool(_) | ReadCommand::ToolName(_))).cloned()
        };
        if chosen(change).is_none()
            && let Some(tool) = self.blocks[..index].iter().rev().find_map(chosen)
        {
            change.commands.insert(0, tool);
        }
    }
}
