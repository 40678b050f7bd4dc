//! Places of a part on the stock's lines of all directions.

use facemill_cl_data::Monitor;
use facemill_surface_model::Surface;
use facemill_z_map::{Cavity, Deviation, DeviationError, DeviationPoint, DexelMap};
use nalgebra::{Point3, Vector3};

/// Comparison of the stock with a part on lines of one direction or several.
pub(crate) struct StockPlaces<'a> {
    directions: Vec<Deviation<'a>>,
}

impl<'a> StockPlaces<'a> {
    /// Compares stock with a part; `stock` is before and after the cut, on the lines of each
    /// direction.
    ///
    /// # Errors
    /// As [`DexelMap::deviation`].
    pub(crate) fn of(
        stock: &[[&DexelMap; 2]],
        part: &'a Surface,
        monitor: &dyn Monitor,
    ) -> Result<Self, DeviationError> {
        let of_direction = |[before, now]: &[&DexelMap; 2]| now.deviation(before, part, monitor);
        Ok(Self { directions: stock.iter().map(of_direction).collect::<Result<_, _>>()? })
    }

    /// Returns all places, direction by direction.
    pub(crate) fn all(&self) -> impl Iterator<Item = DeviationPoint> + '_ {
        self.directions.iter().flat_map(Deviation::places)
    }

    /// Returns the place next to a point of the part with this normal, on the lines most nearly
    /// parallel to it that have one.
    pub(crate) fn near(&self, point: &Point3<f64>, normal: &Vector3<f64>) -> Option<DeviationPoint> {
        let mut squarest: Vec<&Deviation<'_>> = self.directions.iter().collect();
        let square = |d: &Deviation<'_>| d.along().dot(normal).abs();
        squarest.sort_by(|a, b| square(b).total_cmp(&square(a)));
        squarest.iter().find_map(|d| d.near(point, normal))
    }

    /// Returns the deepest of all cavities.
    pub(crate) fn deepest_cavity(&self) -> Option<Cavity> {
        let cavities = self.directions.iter().filter_map(Deviation::deepest_cavity);
        cavities.reduce(|a, b| if b.depth > a.depth { b } else { a })
    }
}
