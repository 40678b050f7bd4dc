//! Figures of the gouged, remaining and finished surface of a part behind a program.

use schemars::JsonSchema;
use serde::Serialize;

/// Deviation of the cut stock from the part with its allowance: the surface that the program should
/// have left.
///
/// Largest values are exact on every line of the stock within `uncertainty_mm`; they say nothing
/// between lines. Areas are estimates: those of small triangles, each with the deviation of the
/// nearest place of a line.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct DeviationReport {
    /// Largest deviation within tolerance, to both sides. Without `--deviation-tolerance-mm` the
    /// largest `limit_mm` of the setup's operations: their `cusp_mm` with path chord, linearisation
    /// and gouge tolerance.
    pub tolerance_mm: f64,
    /// Largest error of deviations on lines: twice `--stock-tolerance-mm`. What `--rest` hands on
    /// has the error of the commands that cut it.
    pub uncertainty_mm: f64,
    /// Whether the program has cut deeper than the gouge limit and the uncertainty permit, or
    /// through a surface that is not closed; the exit code is then 1, as with a finding. The
    /// findings show where the cutter was too deep; this shows the effect in the stock.
    pub exceeds_gouge_limit: bool,
    /// Figures of the surface that the setup's operations cut.
    pub drive: DeviationFigures,
    /// Figures of all the setup's part surfaces, including these.
    pub part: DeviationFigures,
    /// The deepest place within the part without stock, with material over and under it on its
    /// line, if there is one; its value is at most a twentieth and 0.01 mm too deep.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cavity: Option<DeviationPlace>,
    /// Measured cusps between passes, at up to 300 of their points, against predicted ones; absent
    /// if the program has no passes on the part that their words describe (positions with tool
    /// vectors do not).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cusps: Option<CuspReport>,
}

/// Figures of a surface.
#[derive(Clone, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct DeviationFigures {
    /// The deepest place below the surface, as a positive length; `null` if no material is missing.
    pub largest_gouge: Option<DeviationPlace>,
    /// The greatest height above the surface where the program has cut.
    pub largest_excess: Option<DeviationPlace>,
    /// The greatest height above the surface where the program has not cut.
    pub largest_not_reached: Option<DeviationPlace>,
    /// Area by condition.
    pub area_mm2: DeviationAreas,
    /// Measured area by deviation, in steps of half the tolerance within four times the tolerance,
    /// and beyond.
    pub histogram: Vec<DeviationBin>,
}

/// Deviation and its place.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct DeviationPlace {
    /// Amount, mm.
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
    /// Of a surface that is not closed: no stock at all under it. Of a program that changes tools,
    /// or with `--after`, also where the setup's own stock lacks material.
    pub no_stock: f64,
    /// No line goes through the surface near it: walls along the lines, surfaces inside another
    /// shell, and those that the lines of the stock do not reach.
    pub not_measured: f64,
}

/// Area of a surface whose deviation is in a range.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct DeviationBin {
    /// Lower bound of the deviation, mm; absent for the lowest range.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub from_mm: Option<f64>,
    /// Upper bound of the deviation, exclusive, mm; absent for the highest range.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub to_mm: Option<f64>,
    /// Area, mm².
    pub area_mm2: f64,
}

/// Cusp heights measured at a sample of places between neighbouring passes, against the ridge that
/// the outlines of the tilted cutter leave there. Both are estimates: the measured height is that
/// of the highest line on the path across, which misses the ridge by up to half a cell.
#[derive(Clone, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct CuspReport {
    /// Points of passes in the sample; the same ones for the same program.
    pub sampled: usize,
    /// Those with a neighbouring pass at least four cells away, and a predicted ridge that is
    /// distinct from the uncertainty.
    pub compared: usize,
    /// Those where the outlines leave a strip that is not cut at all.
    pub uncut: usize,
    /// All others, by the reason why no comparison is made there: with `compared` and `uncut` these
    /// add up to `sampled`.
    pub not_compared: CuspsNotCompared,
    /// The highest predicted ridge among those compared, mm.
    pub largest_predicted_mm: f64,
    /// The highest ridge measured between the same passes, mm.
    pub largest_measured_mm: f64,
    /// Measured by predicted height; absent if none were compared.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ratio: Option<CuspRatios>,
}

/// Numbers of sampled points without a comparison of cusps, by reason.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, JsonSchema)]
pub struct CuspsNotCompared {
    /// No ridge is predicted: no other pass is within three radii of the cutter beside the point.
    pub no_neighbour: usize,
    /// The neighbouring pass is nearer than four cells, too near for the lines.
    pub too_close: usize,
    /// A pass ends beside the point, nearer than the neighbour: the ridge is not between the two.
    pub beside_an_end: usize,
    /// The predicted ridge is not distinct from the uncertainty: it is lower than twice that.
    pub too_low: usize,
    /// The stock shows no height on the path to the neighbour.
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
