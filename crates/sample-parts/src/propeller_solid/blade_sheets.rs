//! Fillet and blade of a sector, as sheets of rows from hub to tip.

use std::f64::consts::TAU;

use nalgebra::Point3;

use crate::propeller::blade_grid::BladeGrid;
use crate::propeller::blade_section::BladeSide;
use crate::propeller_solid::ball::FilletContact;
use crate::propeller_solid::contact_loop::ContactLoop;
use crate::propeller_solid::contour::Contour;
use crate::propeller_solid::root_fillet::{contour_angle, place_of};
use crate::propeller_solid::sector::{Corner, Sector, SideGroup};

/// Vertices of both sides by row, from the hub over the fillet to the tip, and column, from leading
/// to trailing edge.
#[derive(Debug)]
pub(crate) struct BladeSheets {
    /// Suction and pressure side; both edges and the last row are shared.
    sides: [Vec<Vec<u32>>; 2],
    /// Row of the contacts with the blade.
    contact_row: usize,
}

impl BladeSheets {
    /// Returns the vertices on the hub, once around as the contacts.
    pub(crate) fn hub_loop(&self) -> Vec<u32> {
        let [suction, pressure] = [0, 1].map(|side| &self.sides[side][0]);
        let back = pressure[1..pressure.len() - 1].iter().rev();
        suction.iter().chain(back).copied().collect()
    }

    /// Returns the blade's points outside the fillet and on its border.
    pub(crate) fn blade_points<'s>(&'s self, sector: &'s Sector) -> impl Iterator<Item = Point3<f64>> {
        let rows = self.sides.iter().flat_map(|side| &side[self.contact_row..]);
        rows.flatten().map(|&vertex| sector.place(Corner::Turned { vertex, turn: 0 }))
    }
}

/// Adds fillet and blade to a sector.
///
/// Columns have constant chord fractions. On each, rows keep the proportion of the grid between the
/// contact and the rounding of the tip; from there outward they are the grid's.
pub(crate) fn blade_sheets(
    sector: &mut Sector,
    contour: &Contour<'_>,
    grid: &BladeGrid,
    contacts: &ContactLoop,
) -> BladeSheets {
    let (last, n_arc) = (contacts.angles.len() - 1, contacts.n_arc);
    let [mut suction, mut pressure]: [Vec<Vec<u32>>; 2] = [Vec::new(), Vec::new()];
    let n_rows = n_arc + grid.radii.len() - grid.hub_row;
    for row in 0..n_rows {
        let mut vertex =
            |angle: f64, ball: &FilletContact| sector.vertex(place(contour, grid, n_arc, row, (angle, ball)));
        let columns = || contacts.angles.iter().enumerate();
        let on_suction: Vec<u32> = columns().map(|(k, angle)| vertex(*angle, &contacts.suction[k])).collect();
        let on_pressure = if row + 1 == n_rows {
            on_suction.clone()
        } else {
            let inner = columns().skip(1).take(last - 1);
            let mut on_pressure = vec![on_suction[0]];
            on_pressure.extend(inner.map(|(k, angle)| vertex(TAU - angle, &contacts.pressure[k])));
            on_pressure.push(on_suction[last]);
            on_pressure
        };
        suction.push(on_suction);
        pressure.push(on_pressure);
    }
    let sheets = BladeSheets { sides: [suction, pressure], contact_row: n_arc };
    add_quads(sector, grid, contacts, &sheets);
    sheets
}

/// Place of a row on the column of a ball: on the ball's arc below the contact, on the blade above.
fn place(
    contour: &Contour<'_>,
    grid: &BladeGrid,
    n_arc: usize,
    row: usize,
    (angle, ball): (f64, &FilletContact),
) -> Point3<f64> {
    match row.checked_sub(n_arc) {
        None if row == 0 => ball.on_hub,
        None => ball.on_arc(1.0 - row as f64 / n_arc as f64),
        Some(0) => ball.on_blade,
        Some(row) => {
            let section = contour.section(row_radius(grid, ball, row));
            let (side, fraction) = place_of(angle);
            section.point(side, section.column(side, fraction))
        }
    }
}

/// Radius of a blade's row, counted from the contacts, on the column of a ball.
fn row_radius(grid: &BladeGrid, ball: &FilletContact, row: usize) -> f64 {
    let radius = grid.radii[grid.hub_row + row];
    let [hub, tip] = [grid.radii[grid.hub_row], grid.radii[grid.tip_row]];
    if radius >= tip {
        return radius;
    }
    let contact = ball.on_blade.x.hypot(ball.on_blade.y);
    contact + (radius - hub) * (tip - contact) / (tip - hub)
}

/// Adds the quads of both sides to their groups.
fn add_quads(sector: &mut Sector, grid: &BladeGrid, contacts: &ContactLoop, sheets: &BladeSheets) {
    // Columns between those of the grid belong to the band that they are in.
    let columns_before = |fraction: f64| {
        let border = contour_angle(BladeSide::Suction, fraction) - 1e-9;
        contacts.angles.iter().filter(|angle| **angle < border).count()
    };
    let leading = columns_before(grid.fractions[grid.n_edge]);
    let trailing = columns_before(grid.fractions[grid.fractions.len() - 1 - grid.n_edge]);
    let tip_row = sheets.contact_row + grid.tip_row - grid.hub_row;
    let group = |row: usize, column: usize| {
        if row < sheets.contact_row {
            SideGroup::Fillet
        } else if row >= tip_row {
            SideGroup::Tip
        } else if column < leading {
            SideGroup::LeadingEdge
        } else if column >= trailing {
            SideGroup::TrailingEdge
        } else {
            SideGroup::Side
        }
    };
    let [suction, pressure] = &sheets.sides;
    for row in 0..suction.len() - 1 {
        for k in 0..suction[row].len() - 1 {
            let quad = |s: &[Vec<u32>]| {
                let vertices = [s[row][k], s[row][k + 1], s[row + 1][k + 1], s[row + 1][k]];
                vertices.map(|vertex| Corner::Turned { vertex, turn: 0 })
            };
            let [on_suction, on_pressure] = [quad(suction), quad(pressure)];
            // As in `close_sheets`: a diagonal between shared vertices would lie on both sides.
            let is_shared = |v: Corner| on_suction.contains(&v) && on_pressure.contains(&v);
            sector.quad_without(group(row, k).of(0), on_suction, is_shared);
            let [a, b, c, d] = on_pressure;
            sector.quad_without(group(row, k).of(1), [a, d, c, b], is_shared);
        }
    }
}
