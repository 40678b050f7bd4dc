use facemill_inverse_kinematics::AxisValues;

use super::knots::Grain;
use super::polyline::Polyline;
use super::spline::{Quartic, Spline};

/// Spans of a spline for a law from rest to rest.
///
/// Its first and last piece lie on straight lines and are parametrised by another variable x with r
/// ~ x³, so the path is at rest with finite jerk there.
#[derive(Clone, Debug)]
pub(crate) struct Spans {
    pub(crate) spline: Spline,
    places: Vec<SpanPlace>,
}

/// Place of a span in its piece, as one of several equal parts.
#[derive(Clone, Copy, Debug)]
struct SpanPlace {
    piece: u32,
    part: u32,
    parts: u32,
}

/// Number of spans of the first and the last piece, in which speeds grow from rest.
const RAMP: u32 = 12;

/// Largest number of spans of a piece on one line. Its bends are about as far away as it is long,
/// so speeds change within it only where it is shorter than so many spans.
const STRAIGHT: f64 = 8.0;

/// Largest length of a span, as a fraction of its distance from the stop.
const ONSET: f64 = 0.5;

/// From rest over 1 to the rate 2 at x = 1: 2x³ − x⁴. Its second derivative vanishes at both ends.
const RISE: Quartic = [0.0, 0.0, 0.0, 2.0, -1.0];
/// The same backward: 1 − 2(1 − x)³ + (1 − x)⁴.
const FALL: Quartic = [0.0, 2.0, 0.0, -2.0, 1.0];

impl Spans {
    /// Cuts the spline within the tolerance of a polyline into spans; `None` where they are more
    /// than `most` per line, not counting those for the way from rest and back.
    pub(crate) fn along(polyline: &Polyline, tolerance: &AxisValues, grain: &Grain, most: f64) -> Option<Self> {
        let most = most * polyline.lines() as f64;
        // Its first and its last piece are the ramps.
        let spline = Spline::along(polyline, tolerance, grain, most + 2.0)?;
        let pieces = spline.pieces();
        let mut places = Vec::with_capacity(pieces + 2 * RAMP as usize);
        for piece in 0..pieces {
            let (a, b) = spline.range(piece);
            let speed = spline.lines(piece).map(|line| polyline.caps[line]).fold(1.0, f64::min);
            let from_stop = a.min(polyline.length() - b);
            let parts = ((b - a) / (speed * grain.span)).max((b - a) / (ONSET * from_stop)).ceil();
            let most = if spline.is_on_line(piece) { STRAIGHT } else { f64::from(u16::MAX) };
            let parts = if piece == 0 || piece + 1 == pieces { RAMP } else { parts.clamp(1.0, most) as u32 };
            places.extend((0..parts).map(|part| SpanPlace { piece: piece as u32, part, parts }));
        }
        let spans = Self { spline, places };
        (spans.bending() as f64 <= most).then_some(spans)
    }

    /// Returns the number of spans, not counting those for the way from rest and back.
    pub(crate) fn bending(&self) -> usize {
        self.places.len().saturating_sub(2 * RAMP as usize)
    }

    pub(crate) fn len(&self) -> usize {
        self.places.len()
    }

    /// Returns the lines of the polyline that take part in a span, from the first to the last.
    pub(crate) fn lines(&self, span: usize) -> std::ops::RangeInclusive<usize> {
        self.spline.lines(self.places[span].piece as usize)
    }

    /// Returns r minus the start of a piece, and its part at the start or the end, if it is a ramp.
    fn ramp(&self, piece: usize) -> Option<&'static Quartic> {
        match piece {
            0 => Some(&RISE),
            _ if piece + 1 == self.spline.pieces() => Some(&FALL),
            _ => None,
        }
    }

    /// Returns r over a span, minus the start of its piece.
    pub(crate) fn advance(&self, span: usize) -> Quartic {
        let place = self.places[span];
        let (a, b) = self.spline.range(place.piece as usize);
        let whole = self.ramp(place.piece as usize).map_or([0.0, b - a, 0.0, 0.0, 0.0], |c| c.map(|c| c * (b - a)));
        place.restrict(&whole)
    }

    /// Returns r at the end of a span.
    pub(crate) fn end(&self, span: usize) -> f64 {
        let place = self.places[span];
        let (a, b) = self.spline.range(place.piece as usize);
        if place.part + 1 == place.parts { b } else { a + self.advance(span).iter().sum::<f64>() }
    }

    /// Returns the length of a span in the path variable.
    pub(crate) fn length(&self, span: usize) -> f64 {
        let place = self.places[span];
        let (a, b) = self.spline.range(place.piece as usize);
        let rate = if self.ramp(place.piece as usize).is_some() { 2.0 } else { 1.0 };
        rate * (b - a) / f64::from(place.parts)
    }

    /// Returns the axes as polynomials in the span's own s, and r minus the start of its piece.
    pub(crate) fn polynomials(&self, span: usize, axes: &mut Vec<Quartic>) -> Quartic {
        let place = self.places[span];
        self.spline.polynomials(place.piece as usize, axes);
        for axis in axes.iter_mut() {
            if let Some(ramp) = self.ramp(place.piece as usize) {
                let [start, rise, ..] = *axis;
                *axis = ramp.map(|c| c * rise);
                axis[0] += start;
            }
            *axis = place.restrict(axis);
        }
        self.advance(span)
    }

    /// Returns the axes as in [`Spans::polynomials`] with their limits; on a straight piece only r
    /// with the limits that the axes set it, which is equivalent and cheaper.
    pub(crate) fn limited(
        &self,
        span: usize,
        each: &[[f64; 3]],
        axes: &mut Vec<Quartic>,
        limits: &mut Vec<[f64; 3]>,
    ) -> Quartic {
        limits.clear();
        let piece = self.places[span].piece as usize;
        if !self.spline.is_straight(piece) {
            limits.extend_from_slice(each);
            return self.polynomials(span, axes);
        }
        self.spline.polynomials(piece, axes);
        let (a, b) = self.spline.range(piece);
        let mut most = [0.0_f64; 3];
        for (axis, limit) in axes.iter().zip(each) {
            let slope = (axis[1] / (b - a)).abs();
            let of_r = [slope * slope * limit[0], slope * limit[1], slope * limit[2]];
            most = std::array::from_fn(|d| most[d].max(of_r[d]));
        }
        limits.push(most);
        let advance = self.advance(span);
        axes.clear();
        axes.push(advance);
        advance
    }

    /// Returns s of a span at which r is reached.
    pub(crate) fn s_at(&self, span: usize, r: f64) -> f64 {
        let (a, _) = self.spline.range(self.places[span].piece as usize);
        let c = self.advance(span);
        if c[2..].iter().all(|&c| c == 0.0) {
            return ((r - a - c[0]) / c[1]).clamp(0.0, 1.0);
        }
        let (mut low, mut high) = (0.0, 1.0);
        // Halves down to the last bit.
        for _ in 0..54 {
            let mid = 0.5 * (low + high);
            if c.iter().rev().fold(0.0, |sum, c| sum * mid + c) < r - a { low = mid } else { high = mid }
        }
        0.5 * (low + high)
    }
}

impl SpanPlace {
    /// Returns a polynomial over the piece in the s of this part.
    fn restrict(&self, c: &Quartic) -> Quartic {
        let mut out = *c;
        if self.parts == 1 {
            return out;
        }
        let h = 1.0 / f64::from(self.parts);
        let start = f64::from(self.part) * h;
        // Taylor coefficients at the part's start.
        for i in 0..4 {
            for j in (i..4).rev() {
                out[j] += start * out[j + 1];
            }
        }
        let mut scale = 1.0;
        for c in &mut out {
            *c *= scale;
            scale *= h;
        }
        out
    }
}
