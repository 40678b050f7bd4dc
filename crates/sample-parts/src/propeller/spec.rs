use std::sync::Arc;

use nalgebra::{Isometry3, Vector3};

use crate::propeller::anti_singing::AntiSingingEdge;
use crate::propeller::table::{Hand, PropellerTable, dtmb_4119, dtmb_4382, vp1304};
use crate::spec_error::{SpecError, in_range};

/// A published propeller series.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum PropellerSeries {
    /// DTMB 4119: three blades, no skew, no rake, hub 0.2 D.
    Dtmb4119,
    /// DTMB 4382: five blades, 36° skew, no rake besides what skew along the helix brings, hub 0.2
    /// D.
    Dtmb4382,
    /// SVA Potsdam test case VP1304: five blades with skew and rake, hub 0.3 D.
    ///
    /// Its rake is taken as aft, so that with what skew adds the middles of the chords lie on a
    /// straight line from 0.6 R outward; BladeX's particulars have the same sense, but its single
    /// blade has it ahead.
    Vp1304,
    /// Wageningen B screw, rake 15° aft, hub 0.18 D for up to three blades and 0.167 D above; four
    /// blades have less pitch toward the hub.
    WageningenB {
        /// Number of blades Z, 2 to 7.
        n_blades: usize,
        /// Expanded area over disk area, AE/A0, 0.3 to 1.05.
        area_ratio: f64,
        /// Pitch over diameter at and beyond 0.6 R, 0.5 to 1.4.
        pitch_ratio: f64,
    },
}

impl PropellerSeries {
    /// The radial table of the series; `None` for Wageningen B, whose laws are formulas.
    pub fn table(self) -> Option<PropellerTable> {
        match self {
            Self::Dtmb4119 => Some(dtmb_4119()),
            Self::Dtmb4382 => Some(dtmb_4382()),
            Self::Vp1304 => Some(vp1304()),
            Self::WageningenB { .. } => None,
        }
    }
}

/// A propeller of a series or by a table at a diameter; every value in it is in range.
#[derive(Clone, Debug, PartialEq)]
pub struct PropellerSpec {
    shape: PropellerShape,
    diameter: f64,
    anti_singing_edge: Option<AntiSingingEdge>,
}

/// Shape of a propeller, whatever its diameter.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum PropellerShape {
    /// A radial table.
    Table(Arc<PropellerTable>),
    /// A screw of the series by its formulas.
    WageningenB { n_blades: usize, area_ratio: f64, pitch_ratio: f64 },
}

impl PropellerSpec {
    /// A propeller of `series` with `diameter` in mm, 1 to 20,000.
    ///
    /// # Errors
    /// When the diameter or a parameter of the series is out of its range.
    pub fn new(series: PropellerSeries, diameter: f64) -> Result<Self, SpecError> {
        check_diameter(diameter)?;
        let shape = match series {
            PropellerSeries::WageningenB { n_blades, area_ratio, pitch_ratio } => {
                #[expect(clippy::cast_precision_loss, reason = "only for the message")]
                in_range("number of blades", n_blades as f64, 2.0, 7.0)?;
                in_range("expanded area ratio", area_ratio, 0.3, 1.05)?;
                in_range("pitch ratio", pitch_ratio, 0.5, 1.4)?;
                PropellerShape::WageningenB { n_blades, area_ratio, pitch_ratio }
            }
            PropellerSeries::Dtmb4119 => PropellerShape::Table(Arc::new(dtmb_4119())),
            PropellerSeries::Dtmb4382 => PropellerShape::Table(Arc::new(dtmb_4382())),
            PropellerSeries::Vp1304 => PropellerShape::Table(Arc::new(vp1304())),
        };
        Ok(Self { shape, diameter, anti_singing_edge: None })
    }

    /// A propeller by a table whose numbers are in range.
    pub(crate) fn of_checked(table: PropellerTable, diameter: f64) -> Self {
        Self { shape: PropellerShape::Table(Arc::new(table)), diameter, anti_singing_edge: None }
    }

    /// The propeller with an edge that its sections have room for.
    pub(crate) fn with_checked_edge(self, edge: AntiSingingEdge) -> Self {
        Self { anti_singing_edge: Some(edge), ..self }
    }

    /// Anti-singing trailing edge, if there is one.
    pub fn anti_singing_edge(&self) -> Option<AntiSingingEdge> {
        self.anti_singing_edge
    }

    pub(crate) fn shape(&self) -> &PropellerShape {
        &self.shape
    }

    /// Diameter D, mm.
    pub fn diameter(&self) -> f64 {
        self.diameter
    }

    /// Number of blades Z.
    pub fn n_blades(&self) -> usize {
        match &self.shape {
            PropellerShape::Table(table) => table.n_blades,
            PropellerShape::WageningenB { n_blades, .. } => *n_blades,
        }
    }

    /// Hand: right of all series.
    pub fn hand(&self) -> Hand {
        match &self.shape {
            PropellerShape::Table(table) => table.hand,
            PropellerShape::WageningenB { .. } => Hand::Right,
        }
    }

    /// Radius of the hub's cylinder, mm.
    pub fn hub_radius(&self) -> f64 {
        let ratio = match &self.shape {
            PropellerShape::Table(table) => table.hub_ratio,
            PropellerShape::WageningenB { n_blades: ..=3, .. } => 0.18,
            PropellerShape::WageningenB { .. } => 0.167,
        };
        ratio * self.diameter / 2.0
    }

    /// Length of the hub with its rounded ends, mm, if the table says one.
    pub(crate) fn hub_length(&self) -> Option<f64> {
        match &self.shape {
            PropellerShape::Table(table) => table.hub_length_ratio.map(|ratio| ratio * self.diameter),
            PropellerShape::WageningenB { .. } => None,
        }
    }
}

pub(crate) fn check_diameter(diameter: f64) -> Result<f64, SpecError> {
    in_range("diameter", diameter, 1.0, 20_000.0)
}

/// Where blade `blade_index` is: blade 0 turned about +Z by 2π·k/Z.
///
/// Maps the frame of [`crate::blade`] to the propeller's. Any index is allowed; Z gives blade 0
/// again up to rounding.
pub fn blade_pose(spec: &PropellerSpec, blade_index: usize) -> Isometry3<f64> {
    let n_blades = spec.n_blades();
    #[expect(clippy::cast_precision_loss, reason = "both are below 13")]
    let angle = std::f64::consts::TAU * (blade_index % n_blades) as f64 / n_blades as f64;
    Isometry3::rotation(Vector3::z() * angle)
}
