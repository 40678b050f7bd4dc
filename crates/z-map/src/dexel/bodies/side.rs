//! Where lines along +z enter a body that moves straight and does not turn.

use nalgebra::Vector3;

use crate::dexel::bodies::body::Corner;
use crate::dexel::bodies::lanes::{Course, Lanes, Verdicts, Wide};
use crate::dexel::bodies::placed::{Entry, Placed, Support};

/// A body's straight motion, seen from below.
///
/// The swept solid is convex. Over (x, y) its lower surface is the least height, over the positions
/// of the motion, at which the line enters the body; as a function of the position this is convex.
/// So the least is at the start where the surface there does not face the motion, at the end where
/// it does, and otherwise on the tunnel between the two, where the normal is across the motion.
#[derive(Clone, Debug)]
pub(crate) struct Side<'a> {
    start: Placed<'a>,
    end: Placed<'a>,
    motion: Vector3<f64>,
    tunnel: Option<Tunnel>,
}

/// The normals across a motion: `down` cos + `w` sin.
#[derive(Clone, Debug)]
struct Tunnel {
    /// Direction of the motion in the plane of the lattice, and its length there.
    e: Vector3<f64>,
    length: f64,
    /// In the plane of the lattice across the motion.
    w: Vector3<f64>,
    /// Across the motion and `w`, downward.
    down: Vector3<f64>,
    /// Sine of the normal along a line of the tunnel that faces neither side of a flat end of the
    /// body.
    flat: Option<Flat>,
}

/// A flat end of the body that slides in its own plane.
#[derive(Clone, Debug)]
struct Flat {
    sine: f64,
    centre: Vector3<f64>,
    radius: f64,
    /// Unit vectors in the plane: along the motion, and across it.
    along: Vector3<f64>,
    across: Vector3<f64>,
}

/// Which part of the swept surface a line met.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
enum SidePart {
    #[default]
    Start,
    End,
    Tunnel,
}

/// Start values from the line before; answers do not depend on them beyond rounding.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Warm {
    part: SidePart,
    /// x, y, height and slopes along x and y at the start and at the end.
    at: [Option<[f64; 5]>; 2],
    sine: f64,
}

/// Length in the lattice's plane below which a motion counts as being along the lines, mm: the
/// swept solid is then wrong by less than this. Much smaller, and rounding of the tunnel's heights
/// would be larger than that.
const ALONG_LINES: f64 = 1e-9;

/// Largest distance from the line of the point whose tangent plane gives the height, mm: the height
/// is wrong by its square over the radius of curvature.
const REACHED: f64 = 1e-6;

/// Sine of the angle between the plane of a flat end and the motion below which it slides in its
/// plane. On a body of 100 mm the swept solid is wrong by 10⁻⁷ mm.
const IN_PLANE: f64 = 1e-9;

impl<'a> Side<'a> {
    pub(crate) fn new(start: Placed<'a>, end: Placed<'a>) -> Self {
        let motion = end.tip - start.tip;
        let tunnel = Tunnel::new(&start, &motion);
        Self { start, end, motion, tunnel }
    }

    pub(crate) fn mirrored(&self) -> Self {
        Self::new(self.start.mirrored(), self.end.mirrored())
    }

    /// Largest coordinate of the swept solid along a direction.
    pub(crate) fn height_in(&self, n: &Vector3<f64>) -> f64 {
        self.start.height_in(n) + n.dot(&self.motion).max(0.0)
    }

    /// Where the line through (x, y) enters the swept solid; `None` where it misses.
    pub(crate) fn entry(&self, x: f64, y: f64, warm: &mut Warm) -> Option<Entry> {
        if self.motion == Vector3::zeros() {
            return self.cap(0, x, y, warm);
        }
        if warm.part == SidePart::Tunnel
            && let Some((entry, place)) = self.tunnel_entry(x, y, warm)
            && (0.0..=1.0).contains(&place)
        {
            return Some(entry);
        }
        let order = if warm.part == SidePart::End { [1, 0] } else { [0, 1] };
        let mut caps = [None; 2];
        for k in order {
            caps[k] = self.cap(k, x, y, warm);
            if let Some(entry) = caps[k] {
                let facing = entry.normal.dot(&self.motion);
                if (k == 0 && facing <= 0.0) || (k == 1 && facing >= 0.0) {
                    warm.part = if k == 0 { SidePart::Start } else { SidePart::End };
                    return Some(entry);
                }
            }
        }
        let tunnel = self.tunnel_entry(x, y, warm);
        // Which part it is can be lost in rounding at the border of two: all that are met lie in
        // the swept solid.
        let lies_within = |(_, place): &(Entry, f64)| (-1e-9..=1.0 + 1e-9).contains(place);
        let of_tunnel = tunnel.filter(lies_within).map(|(entry, _)| entry);
        if of_tunnel.is_some() {
            warm.part = SidePart::Tunnel;
        }
        let all = caps.into_iter().chain([of_tunnel]).flatten();
        all.reduce(|least, entry| if entry.height < least.height { entry } else { least })
    }

    /// Whether a point is inside the body at the start or at the end.
    pub(crate) fn holds(&self, p: &Vector3<f64>) -> bool {
        self.start.holds(p) || self.end.holds(p)
    }

    /// Returns the losses of sixteen lines, as far as they are quickly found.
    #[inline(always)]
    pub(crate) fn verdicts(&self, x: &Wide, y: f64, tops: &Wide, floors: &Wide, warm: &mut Warm) -> Verdicts {
        let Placed { body, ref tip, ref axis, .. } = self.start;
        let course = Course::same(tip, &self.motion);
        warm.verdicts(&Lanes { body, axis, course, x: *x, y, tops: *tops, floors: *floors })
    }

    /// Entry into the body at the start (0) or at the end (1).
    #[inline]
    fn cap(&self, k: usize, x: f64, y: f64, warm: &mut Warm) -> Option<Entry> {
        let placed = if k == 0 { &self.start } else { &self.end };
        // The tangent is below the surface: Newton begins on the good side.
        let near = warm.at[k].map(|[from, row, height, a, b]| height + a * (x - from) + b * (y - row));
        let entry = placed.entry(x, y, near);
        warm.at[k] = entry.map(|e| [x, y, e.height, -e.normal.x / e.normal.z, -e.normal.y / e.normal.z]);
        entry
    }

    fn tunnel_entry(&self, x: f64, y: f64, warm: &mut Warm) -> Option<(Entry, f64)> {
        self.tunnel.as_ref()?.entry(&self.start, &self.motion, x, y, &mut warm.sine)
    }
}

impl Warm {
    /// Returns the losses of sixteen lines, as far as they are quickly found: first by the part
    /// that the last line met.
    #[inline(always)]
    pub(crate) fn verdicts(&mut self, lanes: &Lanes) -> Verdicts {
        if self.part != SidePart::Tunnel {
            let verdicts = lanes.cap(if self.part == SidePart::End { 1.0 } else { 0.0 });
            if verdicts.are_complete() {
                return verdicts;
            }
        }
        let (verdicts, share) = lanes.any();
        self.part = match share {
            0.0 => SidePart::Start,
            1.0 => SidePart::End,
            _ => SidePart::Tunnel,
        };
        verdicts
    }
}

impl Tunnel {
    fn new(start: &Placed, motion: &Vector3<f64>) -> Option<Self> {
        let length = motion.x.hypot(motion.y);
        if length <= ALONG_LINES {
            return None;
        }
        let e = Vector3::new(motion.x / length, motion.y / length, 0.0);
        let w = Vector3::new(-e.y, e.x, 0.0);
        let down = (e * motion.z - Vector3::z() * length).normalize();
        let flat = Flat::new(start, &(motion / motion.norm()), &down, &w);
        Some(Self { e, length, w, down, flat })
    }

    fn normal(&self, sine: f64) -> Vector3<f64> {
        self.down * (1.0 - sine * sine).max(0.0).sqrt() + self.w * sine
    }

    /// Entry into the tunnel without ends, and the place on the motion, 0 at the start and 1 at the
    /// end, that touches there.
    ///
    /// The farthest boundary point across the motion moves to one side as the normal turns to it:
    /// its place is a rising function, whose root between the extremes is found by Newton's method
    /// within a bracket.
    fn entry(&self, start: &Placed, motion: &Vector3<f64>, x: f64, y: f64, sine: &mut f64) -> Option<(Entry, f64)> {
        let at = Vector3::new(x, y, 0.0);
        let aside = at.dot(&self.w);
        if let Some(found) = self.flat.as_ref().and_then(|flat| flat.entry(self, motion, &at, aside)) {
            return Some(found);
        }
        let place = |point: &Vector3<f64>| (at - point).dot(&self.e) / self.length;
        let mut bracket: [Bracket; 2] = [(-1.0, None), (1.0, None)];
        let mut m = sine.clamp(-0.999, 0.999);
        for _ in 0..200 {
            let n = self.normal(m);
            let support = start.support(&n);
            let off = aside - support.point.dot(&self.w);
            let slope = self.spread(start, m, &support);
            let end = usize::from(off < 0.0);
            bracket[end] = (m, Some((support.point, off)));
            let width = bracket[1].0 - bracket[0].0;
            let step = off / slope;
            let next = m + step;
            let is_short = step.abs() < 1e-8 * (1.0 - m * m) && slope > 0.0;
            // Beside a flat end the place jumps: there a short step does not mean that it is
            // reached.
            let has_converged = is_short && off.abs() < REACHED;
            if has_converged || width < 1e-15 {
                let point = if has_converged { support.point } else { between(&bracket)? };
                let share = place(&point);
                *sine = m;
                // From a point of the surface beside the line, along the tangent plane: an error of
                // second order.
                let base = point + motion * share;
                let beside = at - base;
                let height = base.z - (n.x * beside.x + n.y * beside.y) / n.z;
                return (n.z < 0.0).then_some((Entry { height, normal: n }, share));
            }
            m = if slope > 0.0 && !is_short && next > bracket[0].0 && next < bracket[1].0 {
                next
            } else {
                0.5 * (bracket[0].0 + bracket[1].0)
            };
        }
        None
    }

    /// How fast the farthest point moves aside as the sine grows.
    fn spread(&self, start: &Placed, m: f64, support: &Support) -> f64 {
        let cosine = (1.0 - m * m).max(1e-30).sqrt();
        let turn = self.w - self.down * (m / cosine);
        let mut spread = support.ring.rounding * turn.dot(&self.w);
        if support.across > 0.0 {
            let turn = turn - start.axis * turn.dot(&start.axis);
            let out = support.out;
            let moved = turn.dot(&self.w) - self.w.dot(&out) * turn.dot(&out);
            spread += support.ring.radius * moved / support.across;
        }
        spread
    }
}

/// A sine, and of its normal the farthest point and how far the line is ahead of it.
type Bracket = (f64, Option<(Vector3<f64>, f64)>);

/// The point between the ends of a bracket, on the side that a line meets: where the boundary is
/// straight there.
fn between(bracket: &[Bracket; 2]) -> Option<Vector3<f64>> {
    let [(_, Some((low, ahead))), (_, Some((high, behind)))] = bracket else { return None };
    let share = if ahead - behind > 0.0 { ahead / (ahead - behind) } else { 0.5 };
    Some(low + (high - low) * share)
}

impl Flat {
    fn new(start: &Placed, motion: &Vector3<f64>, down: &Vector3<f64>, w: &Vector3<f64>) -> Option<Self> {
        let axis = start.axis;
        if axis.dot(motion).abs() > IN_PLANE {
            return None;
        }
        // The end that looks downward. The plane of the normals holds the axis, as both are across
        // the motion.
        let outward = if axis.dot(down) < 0.0 { -axis } else { axis };
        let (cosine, sine) = (outward.dot(down), outward.dot(w));
        if cosine <= 0.0 || outward.z >= 0.0 {
            return None;
        }
        let along = outward.dot(&axis);
        let reach = |c: &Corner| c.reach(0.0, along);
        let highest = start.body.corners().iter().map(reach).fold(f64::NEG_INFINITY, f64::max);
        let ends = start.body.corners().iter().filter(|c| reach(c) >= highest).map(|c| c.flat_end(along));
        let widest = ends.reduce(|a, b| if b.radius > a.radius { b } else { a })?;
        let centre = start.tip + axis * widest.height + outward * widest.rounding;
        let across = motion.cross(&axis).normalize();
        Some(Self { sine, centre, radius: widest.radius, along: *motion, across })
    }

    /// Entry through the flat end where the line meets it, and the nearest place on the motion
    /// within 0 and 1 if there is one.
    fn entry(&self, tunnel: &Tunnel, motion: &Vector3<f64>, at: &Vector3<f64>, aside: f64) -> Option<(Entry, f64)> {
        let aside = (aside - self.centre.dot(&tunnel.w)) / self.across.dot(&tunnel.w);
        let half = self.radius * self.radius - aside * aside;
        if half.is_nan() || half <= 0.0 {
            return None;
        }
        let (half, length) = (half.sqrt(), motion.norm());
        let middle = self.centre + self.across * aside;
        let ahead = (at - middle).dot(&tunnel.e) / self.along.dot(&tunnel.e);
        let place = if ahead < -half {
            (ahead + half) / length
        } else if ahead > length + half {
            (ahead - half) / length
        } else {
            (ahead / length).clamp(0.0, 1.0)
        };
        let normal = tunnel.normal(self.sine);
        Some((Entry { height: middle.z + self.along.z * ahead, normal }, place))
    }
}
