//! What of a part is gouged, left or within tolerance behind a program, in figures.

use schemars::JsonSchema;
use serde::Serialize;

/// How far the cut stock is from the part and the allowance on it: the surface that the program
/// should have left.
///
/// Largest values are exact on every line of the stock within `uncertainty_mm`; between lines
/// nothing is said. Areas are estimates: those of small triangles, each with the deviation of the
/// line's place that is nearest to it.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct DeviationReport {
    /// Deviation up to which a place is within tolerance, to both sides, mm.
    pub tolerance_mm: f64,
    /// How far deviations on lines may be off, mm: twice the tolerance with which the stock was
    /// cut.
    pub uncertainty_mm: f64,
    /// Whether the program has cut deeper than the gouge limit and the uncertainty allow, or
    /// through a surface that is not closed. The findings tell where the cutter was too deep; this
    /// says that it shows in the stock.
    pub exceeds_gouge_limit: bool,
    /// Of the surface that the setup's operations cut.
    pub drive: DeviationFigures,
    /// Of all the setup's part surfaces, these included.
    pub part: DeviationFigures,
    /// The deepest place within the part that is not stock any more, with material over and under
    /// it on its line, where there is one; told by at most a twentieth and 0.01 mm too deep.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cavity: Option<DeviationPlace>,
    /// Cusps between passes against what was to be expected; absent where the program has no passes
    /// on the part that can be followed by their words (positions with tool vectors cannot).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cusps: Option<CuspReport>,
}

/// Figures of a surface.
#[derive(Clone, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct DeviationFigures {
    /// The deepest place below the surface, as a positive length; `None` where nothing is missing.
    pub largest_gouge: Option<DeviationPlace>,
    /// The most that stands over the surface where the program has cut.
    pub largest_excess: Option<DeviationPlace>,
    /// The most that stands over it where the program has cut nothing.
    pub largest_not_reached: Option<DeviationPlace>,
    /// Area by what it is like.
    pub area_mm2: DeviationAreas,
    /// Measured area by deviation, in steps of half the tolerance within four times the tolerance,
    /// and beyond.
    pub histogram: Vec<DeviationBin>,
}

/// A deviation and where it is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct DeviationPlace {
    /// How much, mm.
    pub value_mm: f64,
    /// Place on the part (of a cavity: in it), workpiece frame, mm.
    pub at_mm: [f64; 3],
}

/// Areas of a surface, mm²; they add up to the surface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct DeviationAreas {
    /// Within the tolerance, and cut by the program or without stock on it.
    pub within: f64,
    /// Deeper than the tolerance.
    pub gouged: f64,
    /// Higher than the tolerance, and cut by the program.
    pub excess: f64,
    /// As it was before the program, with stock on it.
    pub not_reached: f64,
    /// Of a surface that is not closed: no stock at all under it.
    pub no_stock: f64,
    /// No line goes through the surface near it: walls along the lines, what lies inside another
    /// shell, and what the lines of the stock do not reach.
    pub not_measured: f64,
}

/// Area of a surface whose deviation is in a range.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct DeviationBin {
    /// From this deviation on, mm; absent for all that is less.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub from_mm: Option<f64>,
    /// Up to less than this, mm; absent for all that is more.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub to_mm: Option<f64>,
    /// Area, mm².
    pub area_mm2: f64,
}

/// Cusp heights measured at a sample of places between neighbouring passes, against the ridge that
/// the outlines of the tilted cutter leave there. Both are estimates: measured is the highest
/// line's place on the way across, which misses the ridge by up to half a cell.
#[derive(Clone, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct CuspReport {
    /// Points of passes that were drawn, the same ones for the same program.
    pub sampled: usize,
    /// Of them with a neighbouring pass at least four cells away, and a predicted ridge that can be
    /// told from the uncertainty.
    pub compared: usize,
    /// Of those drawn where the outlines leave a strip that is not cut at all.
    pub uncut: usize,
    /// Of those drawn the others, by why nothing is compared there: with `compared` and `uncut`
    /// these add up to `sampled`.
    pub not_compared: CuspsNotCompared,
    /// The highest of the predicted ridges that were compared, mm.
    pub largest_predicted_mm: f64,
    /// The highest measured between the same passes, mm.
    pub largest_measured_mm: f64,
    /// Measured by predicted height; absent where none were compared.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ratio: Option<CuspRatios>,
}

/// Why cusps are not compared at points that were drawn: how many of them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, JsonSchema)]
pub struct CuspsNotCompared {
    /// No ridge is predicted: no other pass is within three radii of the cutter beside the point.
    pub no_neighbour: usize,
    /// The neighbouring pass is nearer than four cells, too near for the lines.
    pub too_close: usize,
    /// A pass ends beside the point, nearer than the neighbour: the ridge is not between the two.
    pub beside_an_end: usize,
    /// The predicted ridge cannot be told from the uncertainty: it is lower than twice that.
    pub too_low: usize,
    /// The stock shows no height on the way to the neighbour.
    pub not_measured: usize,
}

/// Quantiles of the ratio of measured to predicted cusps.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct CuspRatios {
    /// The lowest.
    pub lowest: f64,
    /// Five in a hundred are lower.
    pub p5: f64,
    /// Half are lower.
    pub median: f64,
    /// Ninety-five in a hundred are lower.
    pub p95: f64,
    /// The highest.
    pub highest: f64,
}
