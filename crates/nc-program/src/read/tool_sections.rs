//! Parts of a program with one tool each.

use crate::read::program::{MotionKind, ReadCommand, ReadProgram, ToolLengthNote};

impl ReadProgram {
    /// Returns the parts of a program that changes tools, each as a program with the lines that it
    /// has in the whole: from one change to another tool to the next, the first with all before its
    /// own change. A program of one tool is its only part; a call of the tool in the spindle, as
    /// for another speed, is no change.
    ///
    /// The way from the last cut of a tool to the change belongs to this tool. A comment that names
    /// the length of a tool belongs to the change behind it where the tool before has cut already.
    /// A tool that is made ready in an earlier block is called at its change alone.
    #[must_use]
    pub fn tool_sections(&self) -> Vec<Self> {
        self.sections_at(&self.tool_changes(false))
    }

    /// Returns the parts of a program as [`tool_sections`](Self::tool_sections) does, but begins
    /// one at every tool change (M6, TOOL CALL with a tool), also to the tool in the spindle: for a
    /// program whose parts follow each other with one tool.
    #[must_use]
    pub fn change_sections(&self) -> Vec<Self> {
        self.sections_at(&self.tool_changes(true))
    }

    fn sections_at(&self, changes: &[(usize, Option<ReadCommand>)]) -> Vec<Self> {
        if changes.len() < 2 {
            return vec![self.clone()];
        }
        let starts: Vec<usize> = std::iter::once(0).chain(changes[1..].iter().map(|(k, _)| *k)).collect();
        let mut sections: Vec<Self> = Vec::with_capacity(starts.len());
        for (k, &start) in starts.iter().enumerate() {
            let end = starts.get(k + 1).copied().unwrap_or(self.blocks.len());
            let mut blocks = self.blocks[start..end].to_vec();
            let goes_on = k + 1 < starts.len() || self.goes_on;
            for block in blocks.iter_mut().filter(|b| goes_on && !b.changes_tool()) {
                block.commands.retain(|c| !is_tool(c));
            }
            let (change, tool) = &changes[k];
            if let (Some(block), Some(tool)) = (blocks.get_mut(change - start), tool)
                && !block.commands.iter().any(is_tool)
            {
                block.commands.insert(0, tool.clone());
            }
            sections.push(Self { blocks, goes_on, ..self.of_no_block() });
        }
        let section_at = |line: u32| {
            let behind = starts.partition_point(|&start| self.blocks[start].line <= line);
            behind.saturating_sub(1)
        };
        for note in &self.tool_lengths {
            let at = section_at(note.line);
            let own_change = self.blocks[changes[at].0].line;
            let has_cut = self.blocks.iter().any(|b| {
                (own_change..note.line).contains(&b.line)
                    && b.motion.as_ref().is_some_and(|m| matches!(m.kind, MotionKind::Linear | MotionKind::Arc { .. }))
            });
            let is_comment = note.check.is_none_or(|check| check.line != note.line);
            let of_comment = at + usize::from(is_comment && has_cut && at + 1 < sections.len());
            match note.check.map(|check| (section_at(check.line), check.line)) {
                // A check of another tool that compares with the length of this one.
                Some((of_check, line)) if of_check != of_comment => {
                    sections[of_comment].tool_lengths.push(ToolLengthNote { check: None, ..*note });
                    sections[of_check].tool_lengths.push(ToolLengthNote { line, ..*note });
                }
                _ => sections[of_comment].tool_lengths.push(*note),
            }
        }
        for note in &self.notes {
            sections[section_at(note.line)].notes.push(note.clone());
        }
        sections
    }

    /// Returns the number of the tool that it calls first; `None` where it calls none, or one by a
    /// name.
    #[must_use]
    pub fn called_tool(&self) -> Option<u32> {
        let mut called = self.blocks.iter().flat_map(|b| &b.commands).filter(|c| is_tool(c));
        if let Some(ReadCommand::Tool(number)) = called.next() { Some(*number) } else { None }
    }

    /// Returns the blocks of tool changes, with the tool where it is known: of all, or of those to
    /// another tool than that in the spindle.
    fn tool_changes(&self, also_to_same: bool) -> Vec<(usize, Option<ReadCommand>)> {
        let mut changes: Vec<(usize, Option<ReadCommand>)> = Vec::new();
        let mut called = None;
        for (k, block) in self.blocks.iter().enumerate() {
            called = block.commands.iter().rev().find(|c| is_tool(c)).cloned().or(called);
            if !block.changes_tool() {
                continue;
            }
            let is_same = changes.last().is_some_and(|(_, tool)| tool.is_some() && *tool == called);
            if also_to_same || !is_same {
                changes.push((k, called.clone()));
            }
        }
        changes
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
}

fn is_tool(command: &ReadCommand) -> bool {
    matches!(command, ReadCommand::Tool(_) | ReadCommand::ToolName(_))
}

#[cfg(test)]
#[path = "../../tests/unit/read/tool_sections.rs"]
mod tests;
