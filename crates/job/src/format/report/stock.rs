//! Stock of a report: material that the program of a setup cuts.

use schemars::JsonSchema;
use serde::Serialize;

/// Stock that the program of a setup cuts.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct PlannedStockReport {
    /// Stock on which postures, entries, links and chips are planned: the setup's own, or all that
    /// the programs before it may leave (docs/dexel.md#a-bound-of-what-is-left).
    pub planned_on: String,
    /// Reason why the stock was not cut; `null` if it was.
    pub not_cut_because: Option<String>,
    /// Stock at the beginning: the setup's own stock, with the reason why it is not the rest of the
    /// setup before, or that rest.
    pub began_as: Option<String>,
    /// Result of cutting, as in the file of `verify` (docs/formats.md#verification-of-a-program);
    /// `null` if nothing was cut.
    pub cut: Option<StockReport>,
    /// Whether it began as the setup's own stock.
    #[serde(skip)]
    #[schemars(skip)]
    pub began_as_own: bool,
}

impl PlannedStockReport {
    /// Returns whether the setup's own stock was cut, rather than the rest of the one before.
    pub fn began_as_own(&self) -> bool {
        self.began_as_own
    }

    /// Returns the report on stock that was not cut.
    pub fn not_cut(why: impl Into<String>) -> Self {
        Self {
            planned_on: String::new(),
            not_cut_because: Some(why.into()),
            began_as: None,
            cut: None,
            began_as_own: false,
        }
    }

    /// Returns the report on a program whose positions and certificates alone were requested.
    pub fn not_requested(is_verified: bool) -> Self {
        Self::not_cut(not_requested(is_verified))
    }
}

/// Returns the reason why the stock is not cut without a fault.
pub fn not_requested(is_verified: bool) -> &'static str {
    if is_verified { "it was not requested" } else { "the program was not verified" }
}

/// Name of stock that no program has cut before.
pub const OWN_STOCK: &str = "the setup's stock";

/// Result of cutting stock.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct StockReport {
    /// Distance of the lines that the stock is made of, mm.
    pub cell_mm: f64,
    /// Largest error of the cut stock on every line, mm.
    pub tolerance_mm: f64,
    /// Axes of the lines' frame along which there are lines: `z`, or all three.
    pub lines_along: Vec<&'static str>,
    /// Whether a surface that the operations cut has walls along the lines, so that no line shows
    /// the cutting of stock on them.
    pub walls_not_seen: bool,
    /// Volume of the stock before the program, mm³: with lines along three axes, their mean.
    pub before_mm3: f64,
    /// Volume that the program removed, mm³.
    pub removed_mm3: f64,
    /// Volume that each of several heads removed, mm³: material that both reach at once counts for
    /// the first. Absent with one head.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub removed_by_heads_mm3: Vec<f64>,
    /// Cutting blocks in air: no line loses material in them, nor within twice `cell_mm` of them
    /// along the tip's path. It is an estimate: material between the lines is not seen, and air
    /// beside material is not counted.
    pub blocks_in_air: usize,
    /// Low and high corner of the rectangle that has lines, x and y of the lines' frame, mm.
    pub region_mm: [[f64; 2]; 2],
    /// Blocks in which the tool may reach stock beyond that rectangle: collisions with it are not
    /// detected.
    pub blocks_not_covered: usize,
    /// Line of the first of them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub first_line_not_covered: Option<u32>,
}

impl StockReport {
    /// Returns lines for a person.
    pub fn summary_lines(&self) -> Vec<String> {
        let mut lines = vec![format!(
            "  stock             {:.1} of {:.1} cm3 cut, on lines {} mm apart along {}; {} blocks in air",
            self.removed_mm3 / 1000.0,
            self.before_mm3 / 1000.0,
            self.cell_mm,
            self.lines_along.join(", "),
            self.blocks_in_air
        )];
        if self.walls_not_seen {
            let walls = "  walls             along z, where no line shows the cutting of stock on them";
            lines.push(walls.to_owned());
        }
        let of_head = |(k, taken): (usize, &f64)| format!("head {} {:.1}", k + 1, taken / 1000.0);
        let of_heads: Vec<String> = self.removed_by_heads_mm3.iter().enumerate().map(of_head).collect();
        if !of_heads.is_empty() {
            lines.push(format!("  cut by            {} cm3", of_heads.join(", ")));
        }
        lines.extend(self.first_line_not_covered.map(|line| {
            let [[x0, y0], [x1, y1]] = self.region_mm;
            format!(
                "  not covered       {} blocks, first in line {line}, may reach stock beyond x {x0:.1} to {x1:.1}, \
                 y {y0:.1} to {y1:.1}: it is not seen",
                self.blocks_not_covered
            )
        }));
        lines
    }
}
