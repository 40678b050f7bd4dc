//! Stock of a report: what the program of a setup cuts.

use schemars::JsonSchema;
use serde::Serialize;

/// What the program of a setup cuts of the stock.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct PlannedStockReport {
    /// Why the stock was not cut; `null` where it was.
    pub not_cut_because: Option<String>,
    /// What it began as: the setup's own stock, with why it is not the rest of the setup before, or
    /// that rest.
    pub began_as: Option<String>,
    /// What was cut; `null` where nothing was.
    pub cut: Option<StockReport>,
    /// Whether it began as the setup's own stock.
    #[serde(skip)]
    #[schemars(skip)]
    pub began_as_own: bool,
}

impl PlannedStockReport {
    /// Whether the setup's own stock was cut, and not the rest of the one before.
    pub fn began_as_own(&self) -> bool {
        self.began_as_own
    }

    /// Of stock that was not cut.
    pub fn not_cut(why: impl Into<String>) -> Self {
        Self { not_cut_because: Some(why.into()), began_as: None, cut: None, began_as_own: false }
    }

    /// Of a program whose positions and certificates alone were asked for.
    pub fn not_asked(is_verified: bool) -> Self {
        Self::not_cut(not_asked(is_verified))
    }
}

/// Why no stock is cut that nothing is wrong with.
pub fn not_asked(is_verified: bool) -> &'static str {
    if is_verified { "it was not asked for" } else { "the program was not verified" }
}

/// What stock begins as that no program was run on before.
pub const OWN_STOCK: &str = "the setup's stock";

/// What was cut.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct StockReport {
    /// Distance of the lines that the stock is made of, mm.
    pub cell_mm: f64,
    /// How far from the truth what is cut may be, on every line, mm.
    pub tolerance_mm: f64,
    /// Axes of the lines' frame along which there are lines: `z`, or all three.
    pub lines_along: Vec<&'static str>,
    /// Whether a surface that the operations cut has walls along the lines, and nothing shows what
    /// is cut of the stock on them.
    pub walls_not_seen: bool,
    /// Volume of the stock before the program, mm³: with lines along three axes a mean of them.
    pub before_mm3: f64,
    /// What the program took, mm³.
    pub removed_mm3: f64,
    /// What each of several heads took of that, mm³: what both reach at once counts for the first.
    /// Absent with one head.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub removed_by_heads_mm3: Vec<f64>,
    /// Cutting blocks on which nothing was taken, by no head.
    pub blocks_in_air: usize,
    /// Low and high corner of the rectangle that has lines, x and y of the lines' frame, mm.
    pub region_mm: [[f64; 2]; 2],
    /// Blocks on which the tool may reach stock beyond that rectangle: what it meets there is not
    /// seen.
    pub blocks_not_covered: usize,
    /// Line of the first of them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub first_line_not_covered: Option<u32>,
}

impl StockReport {
    /// Lines for a person.
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
            let walls = "  walls             stand along z, where no line shows what is cut of the stock on them";
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
