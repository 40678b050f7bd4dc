//! Summary of reading a mesh file, in words.

use crate::format::report::MeshReport;

impl MeshReport {
    /// Returns the numbers of triangles read, repaired, dropped and kept, and the remaining faults.
    pub fn summary_line(&self) -> String {
        let count = |key: &str| self.repair.get(key).and_then(serde_json::Value::as_u64).unwrap_or(0);
        let n = |key: &str, one: &str, more: &str| counted(count(key), one, more);
        let mut parts = vec![n("n_triangles_in", "read 1 triangle", "read # triangles")];
        parts.push(n(
            "n_welded_vertices",
            "welded 1 vertex to another at the same place",
            "welded # vertices to others at the same place",
        ));
        parts.push(n(
            "n_turned",
            "turned 1 triangle with its corners in a line",
            "turned # triangles with their corners in a line",
        ));
        parts.push(n("n_degenerate", "dropped 1 triangle without area", "dropped # triangles without area"));
        parts.push(n(
            "n_duplicates",
            "dropped 1 triangle that was there twice",
            "dropped # triangles that were there twice",
        ));
        let kept = count("n_triangles_in").saturating_sub(count("n_degenerate") + count("n_duplicates"));
        let components = n("n_components", "1 component", "# components");
        let closed = match (count("n_components"), count("n_closed")) {
            (all, closed) if all == closed => "closed".to_owned(),
            (_, 0) => "open".to_owned(),
            (_, closed) => counted(closed, "1 of them closed", "# of them closed"),
        };
        parts.push(format!("kept {} in {components}, {closed}", counted(kept, "1 triangle", "# triangles")));
        if self.reverse_winding {
            parts.push("turned all of them (reverse_winding)".to_owned());
        }
        parts.push(n("n_open_edges", "1 edge has one triangle", "# edges have one triangle"));
        parts.push(n("n_non_manifold_edges", "1 edge has more than two", "# edges have more than two"));
        parts.push(n(
            "n_miswound_edges",
            "at 1 edge triangles are wound against each other",
            "at # edges triangles are wound against each other",
        ));
        parts.push(n(
            "n_inverted",
            "1 closed component is wound inside out",
            "# closed components are wound inside out",
        ));
        parts.retain(|part| !part.is_empty());
        parts.join(", ")
    }
}

/// Returns a count in words, with the number in place of `#`; empty for 0.
fn counted(n: u64, one: &str, more: &str) -> String {
    match n {
        0 => String::new(),
        1 => one.to_owned(),
        n => more.replace('#', &n.to_string()),
    }
}

#[cfg(test)]
#[path = "../../../tests/unit/format/mesh_summary.rs"]
mod tests;
