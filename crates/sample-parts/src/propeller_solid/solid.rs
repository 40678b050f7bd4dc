//! Propellers as one watertight solid.

use facemill_surface_model::TriMesh;
use nalgebra::{Point3, Rotation3, Vector3};

use crate::propeller::anti_singing::RUN_OUT;
use crate::propeller::blade::BladeResolution;
use crate::propeller::blade_grid::BladeGrid;
use crate::propeller::blade_section::BladeSide;
use crate::propeller::blade_surface::BladeSurface;
use crate::propeller::hub::{MARGIN, ROUNDING, root_range};
use crate::propeller::spec::PropellerSpec;
use crate::propeller::table::Hand;
use crate::propeller_solid::ball::{FilletContact, ball_at, fault};
use crate::propeller_solid::blade_sheets::{BladeSheets, blade_sheets};
use crate::propeller_solid::bore::Bore;
use crate::propeller_solid::contact_loop::ContactLoop;
use crate::propeller_solid::contour::Contour;
use crate::propeller_solid::hub_ends::HubEnds;
use crate::propeller_solid::hub_patch::{HubLoop, HubPatch, corner, largest_span};
use crate::propeller_solid::root_fillet::{RootFillet, contour_angle};
use crate::propeller_solid::sector::{CYLINDER, Sector};
use crate::spec_error::{SpecError, in_range};

/// Form of a propeller as one solid, besides its blades.
#[derive(Clone, Debug, PartialEq)]
pub struct SolidForm {
    /// Fillet between each blade and the hub.
    pub fillet: RootFillet,
    /// Bore through the hub; `None` for a hub without.
    pub bore: Option<Bore>,
}

/// Least radius of a fillet over the hub radius: smaller ones are edges to any cutter.
const LEAST_FILLET: f64 = 1e-3;

/// Most vertices of all blades: 40 million triangles.
const MOST_VERTICES: f64 = 2e7;

/// Least length of the cylinder beyond the fillets over the hub radius, where the hub's length is
/// given.
const LEAST_MARGIN: f64 = 0.01;

/// Returns a whole propeller as one closed solid: hub, blades and a rolling-ball fillet at each
/// root, mm, in the frame of [`crate::blade`].
///
/// In each place around a blade's root a ball of the fillet's radius touches blade and hub, and an
/// arc about its centre, in the plane of both contacts, leads from one to the other. Blade and hub
/// end at the contacts, and all three share vertices there. The fillet is tangent to both; where
/// the radius varies it consists of the balls' arcs, and is not the envelope of the balls. Blades
/// are at the places of [`crate::blade_pose`]; `docs/method.md` has the derivation.
///
/// Groups, for each blade k from 1:
/// - `blade-k/suction` and `pressure`: those of [`crate::blade`] outside the fillet, with rows
///   spread from the fillet to the rounding of the tip, and more columns at the edges where the
///   fillet needs them;
/// - `blade-k/suction-leading-edge`, `suction-trailing-edge`, `suction-tip`, and the same of the
///   pressure side: edges and tip up to the line where both sides meet;
/// - `blade-k/suction-fillet` and `pressure-fillet`: a structured strip between both curves of
///   contact, halved where both sides meet;
/// - `hub/cylinder`, `hub/ends` (rounded), `hub/faces` (flat), and `hub/bore` if there is one. The
///   cylinder is that of [`crate::hub`], or as much longer as the fillets need where the table
///   gives no length.
///
/// **Guarantee.** Each edge belongs to two triangles of opposite sense, and all are wound outward.
/// Vertices lie on blade, ball, hub and bore. Triangles of the hub are within `chord_tolerance` of
/// it; those of the fillet, too, by an estimate in the middle of each column; blades are as near as
/// the resolution makes them. No ball cuts into its blade or a neighbour at the places of the
/// mesh's vertices; of more than 20 million pairs of balls and vertices, only every n-th is
/// tested. A turn by 2π/Z maps the mesh on itself up to rounding. The same arguments give the same
/// mesh.
///
/// ```
/// use facemill_sample_parts::{
///     BladeResolution, Bore, PropellerSeries, PropellerSpec, RootFillet, SolidForm, SpecError, propeller_solid,
/// };
///
/// let spec = PropellerSpec::new(PropellerSeries::Dtmb4119, 3048.0)?;
/// let form = SolidForm { fillet: RootFillet::constant(60.0)?, bore: Some(Bore::cylinder(120.0)?) };
/// let solid = propeller_solid(&spec, &form, BladeResolution::new(24, 36)?, 1.0)?;
/// assert!(solid.groups().iter().any(|group| group.name == "blade-3/suction-fillet"));
/// # Ok::<(), SpecError>(())
/// ```
///
/// # Errors
/// - The tolerance is not between 1e-5 and 1e-1 of the hub radius.
/// - A radius of the fillet is below 1e-3 of the hub radius, or a ball of it reaches the rounding
///   of the tip or 0.05 R before an anti-singing edge; a radius of the bore is not between 0.02 and
///   0.7 of the hub radius.
/// - The hub's length, if the table gives one, leaves no room for the fillets.
/// - A ball cuts into a blade, the fillet folds, fillets of two blades meet, or an edge is sharp
///   ([`SpecError::Fillet`], with the place).
/// - Tolerance and resolution take more columns, vertices or triangles than there may be.
pub fn propeller_solid(
    spec: &PropellerSpec,
    form: &SolidForm,
    resolution: BladeResolution,
    chord_tolerance: f64,
) -> Result<TriMesh, SpecError> {
    let hub_radius = spec.hub_radius();
    in_range("chord tolerance of the solid", chord_tolerance, 1e-5 * hub_radius, 0.1 * hub_radius)?;
    let surface = BladeSurface::new(spec);
    check_radii(&surface, &form.fillet)?;
    if let Some(bore) = form.bore {
        bore.check(hub_radius)?;
    }
    let contour = Contour::new(&surface);
    let grid = BladeGrid::new(&surface, resolution);
    let contacts = ContactLoop::new(&contour, &form.fillet, &grid.fractions, chord_tolerance)?;
    contacts.check_folds()?;
    let n_vertices = spec.n_blades() * 2 * contacts.angles.len() * (contacts.n_arc + grid.radii.len());
    in_range("number of vertices of a solid's blades", n_vertices as f64, 0.0, MOST_VERTICES)?;
    let mut sector = Sector::new(spec.n_blades());
    let sheets = blade_sheets(&mut sector, &contour, &grid, &contacts);
    check_balls(&sector, &sheets, &contacts)?;
    add_hub(&mut sector, spec, form.bore, &contacts, &sheets, chord_tolerance)?;
    Ok(sector.build(spec.hand() == Hand::Left))
}

/// Returns the ball of a root fillet that touches a side of the first blade at a chord fraction
/// from 0 to 1; fractions beyond are taken as these.
///
/// Centres of such balls are what a ball cutter of the same radius follows to cut the fillet.
///
/// ```
/// use facemill_sample_parts::{BladeSide, PropellerSeries, PropellerSpec, RootFillet, SpecError, fillet_contact};
///
/// let spec = PropellerSpec::new(PropellerSeries::Dtmb4119, 1000.0)?;
/// let ball = fillet_contact(&spec, &RootFillet::constant(20.0)?, BladeSide::Suction, 0.4)?;
/// let from_axis = ball.centre.x.hypot(ball.centre.y);
/// assert!((from_axis - (spec.hub_radius() + 20.0)).abs() < 1e-6);
/// assert!((ball.on_arc(1.0) - ball.on_hub).norm() < 1e-6 && ball.arc_angle() < 2.0);
/// # Ok::<(), SpecError>(())
/// ```
///
/// # Errors
/// When a radius of the fillet is out of the range of [`propeller_solid`], the edge is sharp there,
/// or blade and hub meet at an angle without room for a ball.
pub fn fillet_contact(
    spec: &PropellerSpec,
    fillet: &RootFillet,
    side: BladeSide,
    chord_fraction: f64,
) -> Result<FilletContact, SpecError> {
    let surface = BladeSurface::new(spec);
    check_radii(&surface, fillet)?;
    let contact = ball_at(&Contour::new(&surface), fillet, contour_angle(side, chord_fraction.clamp(0.0, 1.0)))?;
    let contact = FilletContact { side, ..contact };
    Ok(if spec.hand() == Hand::Left { contact.mirrored() } else { contact })
}

/// Refuses radii with which no ball can lie between hub and tip.
pub(crate) fn check_radii(surface: &BladeSurface, fillet: &RootFillet) -> Result<(), SpecError> {
    let spec = surface.spec();
    let (hub_radius, radius) = (spec.hub_radius(), 0.5 * spec.diameter());
    let smooth_up_to = match spec.anti_singing_edge() {
        Some(edge) => edge.range()[0] - RUN_OUT,
        None => 1.0 - surface.tip_rounding_ratio(),
    };
    let most = 0.5 * (radius * smooth_up_to - hub_radius);
    for extreme in fillet.extremes() {
        in_range("fillet radius", extreme, LEAST_FILLET * hub_radius, most)?;
    }
    Ok(())
}

/// Most pairs of balls and points that are tested; of more, each n-th.
const MOST_PAIRS: usize = 20_000_000;

/// Refuses balls that cut into their own blade or its neighbours, at the mesh's vertices that a
/// ball can reach.
fn check_balls(sector: &Sector, sheets: &BladeSheets, contacts: &ContactLoop) -> Result<(), SpecError> {
    let balls = contacts.around();
    let reach = balls.iter().map(|(_, ball)| ball.centre.x.hypot(ball.centre.y) + ball.radius).fold(0.0, f64::max);
    let near = sheets.blade_points(sector).filter(|p| p.x.hypot(p.y) <= reach);
    let points: Vec<Point3<f64>> = near.collect();
    let turns = [-1.0, 0.0, 1.0].map(|turn| Rotation3::from_axis_angle(&Vector3::z_axis(), turn * sector.angle()));
    let stride = (balls.len() * points.len() * turns.len()).div_ceil(MOST_PAIRS);
    for (angle, ball) in &balls {
        // Normals by differences leave about 1e-8 of the radius.
        let least_sq = (ball.radius * (1.0 - 1e-6)).powi(2);
        for (k, turn) in turns.iter().enumerate() {
            let centre = turn * ball.centre;
            if points.iter().step_by(stride).any(|p| (p - centre).norm_squared() < least_sq) {
                let what = if k == 1 { "its blade" } else { "the next blade" };
                let message = format!("a ball of {:.4} mm cuts into {what}; make the radius smaller", ball.radius);
                return Err(fault(*angle, message));
            }
        }
    }
    Ok(())
}

/// Adds the hub around the fillets.
fn add_hub(
    sector: &mut Sector,
    spec: &PropellerSpec,
    bore: Option<Bore>,
    contacts: &ContactLoop,
    sheets: &BladeSheets,
    tolerance: f64,
) -> Result<(), SpecError> {
    let (hub_radius, n_blades) = (spec.hub_radius(), spec.n_blades());
    let balls = contacts.around();
    let angles: Vec<f64> = balls.iter().map(|ball| ball.0).collect();
    let around = HubLoop::new(balls.iter().map(|ball| ball.1.on_hub), &angles, n_blades, hub_radius)?;
    let roots = around.z_range(n_blades, hub_radius);
    let cylinder = cylinder_range(spec, roots)?;
    let band = [(roots[0] - MARGIN * hub_radius).max(cylinder[0]), (roots[1] + MARGIN * hub_radius).min(cylinder[1])];
    let scaled = band.map(|z| n_blades as f64 * z / hub_radius);
    let patch = HubPatch::new(&around, scaled, largest_span(tolerance, n_blades, hub_radius))
        .ok_or(SpecError::Unmeshed { tolerance })?;
    let mut vertices = sheets.hub_loop();
    vertices.extend(patch.points(n_blades, hub_radius).map(|p| sector.vertex(p)));
    for triangle in &patch.triangles {
        sector.triangle(CYLINDER, triangle.map(|v| corner(&vertices, v)));
    }
    let ring = |is_upper: bool| -> Vec<u32> {
        (0..patch.n_around).map(|i| vertices[patch.ring_vertex(is_upper, i)]).collect()
    };
    HubEnds { radius: hub_radius, cylinder, band, bore, tolerance }.add_to(sector, [&ring(false), &ring(true)]);
    Ok(())
}

/// Range of the hub's cylinder in z around fillets that take up `roots`.
fn cylinder_range(spec: &PropellerSpec, roots: [f64; 2]) -> Result<[f64; 2], SpecError> {
    let hub_radius = spec.hub_radius();
    let (low, high) = root_range(spec);
    let Some(length) = spec.hub_length() else {
        let margin = MARGIN * hub_radius;
        return Ok([low.min(roots[0]) - margin, high.max(roots[1]) + margin]);
    };
    let middle = 0.5 * (low + high);
    let needed = (roots[1] - middle).max(middle - roots[0]) + (LEAST_MARGIN + ROUNDING) * hub_radius;
    in_range("hub length with root fillets", length, 2.0 * needed, f64::MAX)?;
    let half = 0.5 * length - ROUNDING * hub_radius;
    Ok([middle - half, middle + half])
}
