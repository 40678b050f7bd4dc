//! Sections against each other: number, sense, order, crossings.

use nalgebra::{Point2, Point3, Vector3};

use crate::curves::ProfileSection;
use crate::fault::{BladeFault, BladeFileError};
use crate::info::EdgeEnd;

/// Least share of the square over a section's size that it must enclose: less is round-off.
const LEAST_AREA: f64 = 1e-6;

/// Checks that sections describe one blade from hub to shroud; `name` is the blade's in errors.
pub(crate) fn check_sections(file: &str, name: &str, sections: &[ProfileSection]) -> Result<(), BladeFileError> {
    if sections.len() < 2 {
        let fault = BladeFault::TooFew { what: name.to_owned(), given: sections.len(), least: 2 };
        return Err(BladeFileError::of_file(file, fault));
    }
    let first = &sections[0];
    let fault = |section: &ProfileSection, fault| Err(BladeFileError::at(file, section.lines[0], fault));
    for section in sections {
        let name = || section.name.clone();
        if section.points.len() != first.points.len() {
            let (given, first) = (section.points.len(), first.points.len());
            return fault(section, BladeFault::UnequalSections { name: name(), given, first });
        }
        let unlike = |what| BladeFault::UnlikeSections { name: name(), what };
        if section.is_closed != first.is_closed {
            return fault(section, unlike("is closed or open"));
        }
        if section.leading != first.leading || section.trailing != first.trailing {
            return fault(section, unlike("has its marks at other points"));
        }
    }
    let areas = sections
        .iter()
        .map(|section| {
            let flat = || BladeFault::FlatSection(section.name.clone());
            enclosed_area(&section.points).ok_or_else(|| BladeFileError::at(file, section.lines[0], flat()))
        })
        .collect::<Result<Vec<_>, _>>()?;
    check_order(file, sections, &areas)?;
    sections.iter().zip(&areas).try_for_each(|(section, area)| check_crossings(file, section, area))
}

/// Checks that no edge is marked at two corners and said to be rounded.
pub(crate) fn check_ends(
    file: &str,
    first: &ProfileSection,
    ends: &[Option<EdgeEnd>; 2],
) -> Result<(), BladeFileError> {
    for (marks, end) in [first.leading, first.trailing].into_iter().zip(ends) {
        if let (Some([a, b]), Some(EdgeEnd::Ellipse)) = (marks, end)
            && a != b
        {
            let what = "an edge with two marks is cut off, but the .inf file says EllipseEnd; keep one mark (le, te), or \
                        write CutOffEnd";
            let fault = BladeFault::WrongMarks { name: first.name.clone(), what };
            return Err(BladeFileError::at(file, first.lines[a], fault));
        }
    }
    Ok(())
}

fn check_order(file: &str, sections: &[ProfileSection], areas: &[Vector3<f64>]) -> Result<(), BladeFileError> {
    let centres: Vec<Point3<f64>> = sections.iter().map(|section| centre(&section.points)).collect();
    for k in 1..sections.len() {
        let fault = |fault| Err(BladeFileError::at(file, sections[k].lines[0], fault));
        let step = centres[k] - centres[k - 1];
        // Areas of neighbours point to the same side: blades bend, but not by 90° in one step.
        if areas[k].dot(&areas[k - 1]) <= 0.0 {
            return fault(BladeFault::ReversedSection(sections[k].name.clone()));
        }
        let onward = |area: &Vector3<f64>| step.dot(area) * (centres[1] - centres[0]).dot(&areas[0]);
        if onward(&areas[k]) <= 0.0 || onward(&areas[k - 1]) <= 0.0 {
            return fault(BladeFault::DisorderedSection(sections[k].name.clone()));
        }
    }
    Ok(())
}

fn centre(points: &[Point3<f64>]) -> Point3<f64> {
    let sum = points.iter().fold(Vector3::zeros(), |sum, p| sum + p.coords);
    #[expect(clippy::cast_precision_loss, reason = "numbers that large are refused")]
    Point3::from(sum / points.len() as f64)
}

/// Area that points enclose, as a vector across it; none if they are as good as on a line.
fn enclosed_area(points: &[Point3<f64>]) -> Option<Vector3<f64>> {
    let origin = centre(points);
    let sides = points.iter().zip(points.iter().cycle().skip(1));
    let doubled = sides.fold(Vector3::zeros(), |sum, (a, b)| sum + (a - origin).cross(&(b - origin)));
    let size_sq = points.iter().map(|p| (p - origin).norm_squared()).fold(0.0, f64::max);
    (doubled.norm() > LEAST_AREA * size_sq).then_some(0.5 * doubled)
}

/// Checks that the sides of a section, seen along its area, have no common point but the corners
/// of neighbours.
///
/// Each is compared with those whose ranges along the section overlap with its own: at most all
/// pairs of [`crate::MAX_SECTION_POINTS`].
fn check_crossings(file: &str, section: &ProfileSection, area: &Vector3<f64>) -> Result<(), BladeFileError> {
    let n = section.points.len();
    let flat = flattened(&section.points, area);
    let side = |k: usize| [flat[k], flat[(k + 1) % n]];
    let range = |k: usize| {
        let [a, b] = side(k);
        [a.x.min(b.x), a.x.max(b.x)]
    };
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|&a, &b| range(a)[0].total_cmp(&range(b)[0]));
    for (at, &k) in order.iter().enumerate() {
        let [_, end] = range(k);
        for &other in order[at + 1..].iter().take_while(|&&other| range(other)[0] <= end) {
            let is_neighbour = (k + 1) % n == other || (other + 1) % n == k;
            if !is_neighbour && do_meet(&side(k), &side(other)) {
                let [first, second] = [k.min(other), k.max(other)].map(|k| section.lines[k]);
                let fault = BladeFault::CrossedSection { name: section.name.clone(), other: second };
                return Err(BladeFileError::at(file, first, fault));
            }
        }
    }
    Ok(())
}

/// Points seen along a direction, x along their longest extent from the first point.
fn flattened(points: &[Point3<f64>], area: &Vector3<f64>) -> Vec<Point2<f64>> {
    let normal = area.normalize();
    let across = |p: &Point3<f64>| {
        let from_first = p - points[0];
        from_first - normal * normal.dot(&from_first)
    };
    let far = points
        .iter()
        .map(across)
        .fold(Vector3::zeros(), |far: Vector3<f64>, v| if v.norm_squared() > far.norm_squared() { v } else { far });
    let x = far.normalize();
    let y = normal.cross(&x);
    points.iter().map(across).map(|v| Point2::new(v.dot(&x), v.dot(&y))).collect()
}

/// Whether two line segments have a common point.
fn do_meet([a, b]: &[Point2<f64>; 2], [c, d]: &[Point2<f64>; 2]) -> bool {
    let apart = a.y.max(b.y) < c.y.min(d.y) || c.y.max(d.y) < a.y.min(b.y);
    let turn = |p: &Point2<f64>, q: &Point2<f64>, r: &Point2<f64>| (q - p).perp(&(r - p));
    !apart && turn(a, b, c) * turn(a, b, d) <= 0.0 && turn(c, d, a) * turn(c, d, b) <= 0.0
}
