//! A program of two heads in one channel, read by the kit's own rules: nine words, two lengths, one
//! feed.
//!
//! Nothing here comes from the crates under test: words are read from the text, and both tools'
//! places are products of matrices made from the rows of the machine file.

use nalgebra::{Isometry3, Point3, Unit, Vector3};
use serde_json::Value;

use crate::oracles::brute::{Frustum, RoundedCylinder, in_tool};
use crate::oracles::craig::{Words, end_of};
use crate::oracles::read_back::{TipAndAxis, number};

/// A motion of the program's body.
#[derive(Clone, Debug)]
pub struct DualBlock {
    /// Its line, from 1.
    pub line: usize,
    /// G0.
    pub rapid: bool,
    /// Names of its axis words, as they stand.
    pub named: Vec<String>,
    /// Words of all axes before it.
    pub from: Words,
    /// Words of all axes behind it.
    pub to: Words,
    /// F in effect, mm/min; 0 before the first.
    pub feed: f64,
    /// Heads at work: where a comment names one head and its pass, the other one is idle.
    pub working: [bool; 2],
}

/// Motions of a program from where the lengths of both heads are compensated on until that ends.
///
/// # Panics
/// When a word is none.
pub fn dual_blocks(nc: &str) -> Vec<DualBlock> {
    let (mut at, mut blocks) = (Words::new(), Vec::new());
    let (mut feed, mut rapid, mut lengths, mut working) = (0.0, true, 0, [true; 2]);
    for (line, text) in nc.lines().enumerate() {
        if let Some(comment) = text.strip_prefix('(') {
            let alone = |h: usize| comment.starts_with(&format!("HEAD {} PASS", h + 1));
            working = [!alone(1), !alone(0)];
            continue;
        }
        let codes: Vec<&str> = text.split_whitespace().collect();
        let is_motion = text.starts_with('N') && !text.contains(['[', '#']) && !codes.contains(&"G28");
        if !is_motion {
            continue;
        }
        if codes.contains(&"G49") && lengths == 2 {
            break;
        }
        let is_body = lengths == 2;
        let (from, mut named) = (at.clone(), Vec::new());
        for code in codes {
            let value = |text: &str| text.parse::<f64>().unwrap_or_else(|_| panic!("line {}: {code}", line + 1));
            match code {
                "G0" => rapid = true,
                "G1" => rapid = false,
                "G43" => lengths += 1,
                _ if code.starts_with('F') => feed = value(&code[1..]),
                _ if code.starts_with(['X', 'Y', 'Z', 'A', 'B', 'C']) => {
                    let (name, text) = code.split_once('=').unwrap_or((&code[..1], &code[1..]));
                    at.insert(name.to_owned(), value(text));
                    named.push(name.to_owned());
                }
                _ => {}
            }
        }
        if is_body && !named.is_empty() {
            blocks.push(DualBlock { line: line + 1, rapid, named, from, to: at.clone(), feed, working });
        }
    }
    blocks
}

/// Both heads of a machine file over one table.
pub struct TwoHeads {
    machine: Value,
    /// Gauge length of each head's tool, mm.
    gauges: [f64; 2],
    table_from_work: Isometry3<f64>,
}

impl TwoHeads {
    /// Of a machine file, the lengths of both tools, and how the workpiece is mounted.
    pub fn new(machine: Value, gauges: [f64; 2], table_from_work: Isometry3<f64>) -> Self {
        Self { machine, gauges, table_from_work }
    }

    /// Names of all axes of the machine.
    pub fn axes(&self) -> Vec<String> {
        self.joints().map(|joint| joint["axis"].as_str().expect("a name").to_owned()).collect()
    }

    /// Words of all axes at home, with the lengths of both tools on.
    pub fn home(&self) -> Words {
        let home = |joint: &Value| number(joint.get("home_mm").unwrap_or(&joint["home_deg"]));
        let mut words: Words = self.axes().into_iter().zip(self.joints().map(home)).collect();
        for (h, gauge) in self.gauges.iter().enumerate() {
            *words.get_mut(&format!("Z{}", h + 1)).expect("a spindle axis") -= gauge;
        }
        words
    }

    fn joints(&self) -> impl Iterator<Item = &Value> {
        let chains = std::iter::once(&self.machine["workpiece_chain"])
            .chain(self.machine["tool_chains"].as_array().expect("chains"));
        let rows = chains.flat_map(|chain| chain["rows"].as_array().expect("rows"));
        rows.filter_map(|row| row["joint"].as_object()?.values().next())
    }

    /// Tip and axis of a head's tool (0 or 1) in the workpiece frame. With its length compensated a
    /// head's Z is higher than its word by that.
    ///
    /// # Panics
    /// When a word is missing.
    pub fn place(&self, head: usize, words: &Words) -> TipAndAxis {
        let mut words = words.clone();
        *words.get_mut(&format!("Z{}", head + 1)).expect("a spindle axis") += self.gauges[head];
        let table = end_of(&self.machine["workpiece_chain"]["rows"], &words);
        let nose = end_of(&self.machine["tool_chains"][head]["rows"], &words);
        let work_from_table = self.table_from_work.inverse().to_homogeneous();
        let work_from_tool = work_from_table * table.try_inverse().expect("a frame") * nose;
        let tip = work_from_tool.transform_point(&Point3::new(0.0, 0.0, -self.gauges[head]));
        (tip, Unit::new_normalize(work_from_tool.transform_vector(&Vector3::z())))
    }

    /// Time of a block, s: the norm over all axes, 1 deg as 1 mm, over F; of a rapid that of the
    /// slowest axis.
    ///
    /// # Panics
    /// When a word is missing.
    pub fn time(&self, block: &DualBlock) -> f64 {
        let way = |name: &str| block.to[name] - block.from[name];
        if block.rapid {
            self.axis_time(block)
        } else {
            60.0 * norm(block.to.keys().map(|name| way(name))) / block.feed
        }
    }

    /// Time that the axes need for a block, each at its largest speed, s.
    pub fn axis_time(&self, block: &DualBlock) -> f64 {
        let of = |joint: &Value| {
            let name = joint["axis"].as_str().expect("a name");
            let speed = joint.get("max_velocity_mm_min").unwrap_or(&joint["max_velocity_deg_min"]);
            60.0 * (block.to[name] - block.from[name]).abs() / number(speed)
        };
        self.joints().map(of).fold(0.0, f64::max)
    }
}

fn norm(ways: impl Iterator<Item = f64>) -> f64 {
    ways.map(|w| w * w).sum::<f64>().sqrt()
}

/// A whole tool in its own frame.
pub struct ToolShape {
    cutter: RoundedCylinder,
    sections: Vec<Frustum>,
}

impl ToolShape {
    /// Of a tool file.
    ///
    /// # Panics
    /// When it is none.
    pub fn of(tool: &Value) -> Self {
        let height = number(&tool["flute_length_mm"]);
        let mut low = height;
        let stacks = ["body", "holder"].map(|stack| tool[stack]["sections"].as_array().expect("sections"));
        let section = |s: &Value| {
            let high = low + number(&s["length_mm"]);
            let [radius_low, radius_high] = ["diameter_low_mm", "diameter_high_mm"].map(|key| 0.5 * number(&s[key]));
            let frustum = Frustum { low, high, radius_low, radius_high };
            low = high;
            frustum
        };
        let sections = stacks.into_iter().flatten().map(section).collect();
        let (radius, corner) = (number(&tool["radius_mm"]), number(&tool["corner_radius_mm"]));
        Self { cutter: RoundedCylinder { radius, corner, height }, sections }
    }

    /// Its cutter.
    pub fn cutter(&self) -> &RoundedCylinder {
        &self.cutter
    }

    /// Distance of a point from it, workpiece frame, mm; negative inside its cutter, 0 in its other
    /// bodies.
    fn distance(&self, (tip, axis): &TipAndAxis, point: &Point3<f64>) -> f64 {
        let (rho, z) = in_tool(tip, axis, point);
        let sections = self.sections.iter().map(|s| s.distance(rho, z));
        sections.fold(self.cutter.signed_distance(rho, z), f64::min)
    }

    /// Points of its surface, on faces and walls, some `step` (mm) apart; of its cutter only on
    /// request.
    fn points(&self, (tip, axis): &TipAndAxis, step: f64, cutter: bool) -> Vec<Point3<f64>> {
        let RoundedCylinder { radius, corner, height } = self.cutter;
        let rim = radius - corner;
        let mut outline = Vec::new();
        if cutter {
            outline.extend([(0.0, 0.0), (rim, 0.0)]);
            outline.extend((1..=6).map(|k| {
                let (sin, cos) = (f64::from(k) * 15f64).to_radians().sin_cos();
                (rim + corner * sin, corner * (1.0 - cos))
            }));
            outline.push((radius, height));
        }
        outline.extend(self.sections.iter().flat_map(|s| [(s.radius_low, s.low), (s.radius_high, s.high)]));
        let across = any_across(axis);
        let third = axis.cross(&across);
        let mut points = Vec::new();
        for w in outline.windows(2) {
            let ((a, low), (b, high)) = (w[0], w[1]);
            let n = ((b - a).hypot(high - low) / step).ceil().max(1.0) as usize;
            for k in 0..=n {
                let t = k as f64 / n as f64;
                let (rho, z) = (a + (b - a) * t, low + (high - low) * t);
                let turns = (std::f64::consts::TAU * rho / step).ceil().max(1.0) as usize;
                points.extend((0..turns).map(|i| {
                    let (sin, cos) = (std::f64::consts::TAU * i as f64 / turns as f64).sin_cos();
                    tip + axis.into_inner() * z + (across * cos + third * sin) * rho
                }));
            }
        }
        points
    }
}

fn any_across(axis: &Unit<Vector3<f64>>) -> Vector3<f64> {
    let other = if axis.x.abs() < 0.5 { Vector3::x() } else { Vector3::y() };
    axis.cross(&other).normalize()
}

/// Distance of two tools by points of their surfaces some `step` apart, mm: at most that much more
/// than there is. Not above 0: they intersect.
pub fn tools_apart(tools: &[ToolShape; 2], places: [&TipAndAxis; 2], step: f64) -> f64 {
    apart(tools, places, step, true)
}

/// The same between all but the cutter of either tool and the whole other one.
pub fn bodies_apart(tools: &[ToolShape; 2], places: [&TipAndAxis; 2], step: f64) -> f64 {
    apart(tools, places, step, false)
}

fn apart(tools: &[ToolShape; 2], places: [&TipAndAxis; 2], step: f64, cutters: bool) -> f64 {
    let from = |h: usize| {
        let points = tools[h].points(places[h], step, cutters);
        points.iter().map(|p| tools[1 - h].distance(places[1 - h], p)).fold(f64::INFINITY, f64::min)
    };
    from(0).min(from(1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_motions_under_both_lengths_are_read() {
        let nc = "%\nO1 (BOTH X)\nN1 G0 X1=1. C5.\nN2 G43 Z1=2. H1\nN3 G43 Z2=-3. H2\n(PASS)\nN4 G1 X1=1.5 F100.\n\
                  (HEAD 2 PASS 1 PLACE 1)\nN5 C-6.25\nN6 G0 Z2=0.\nN7 G49\nN8 G0 X1=9.\n";
        let blocks = dual_blocks(nc);
        let reported: Vec<_> = blocks.iter().map(|b| (b.line, b.rapid, b.feed, b.working)).collect();
        let both = [true, true];
        let second = [false, true];
        assert_eq!(reported, [(7, false, 100.0, both), (9, false, 100.0, second), (10, true, 100.0, second)]);
        assert_eq!((blocks[1].from["C"], blocks[1].to["C"], blocks[2].to["X1"]), (5.0, -6.25, 1.5));
        assert_eq!(blocks[0].named, ["X1"]);
    }

    /// Two plain cylinders on one line, faces toward each other, and then side by side.
    #[test]
    fn tools_are_as_far_apart_as_their_faces_and_walls() {
        let tool = || ToolShape {
            cutter: RoundedCylinder { radius: 10.0, corner: 1.0, height: 5.0 },
            sections: vec![Frustum { low: 5.0, high: 40.0, radius_low: 8.0, radius_high: 12.0 }],
        };
        let tools = [tool(), tool()];
        let at = |x: f64, z: f64, up: f64| (Point3::new(x, 0.0, z), Unit::new_normalize(Vector3::new(0.0, 0.0, up)));
        let faces = tools_apart(&tools, [&at(0.0, 0.0, 1.0), &at(0.0, -7.0, -1.0)], 2.0);
        assert!((faces - 7.0).abs() < 1e-9, "{faces}");
        let bodies = bodies_apart(&tools, [&at(0.0, 0.0, 1.0), &at(0.0, -7.0, -1.0)], 2.0);
        assert!((bodies - 12.0).abs() < 1e-9, "{bodies}");
        let walls = tools_apart(&tools, [&at(0.0, 0.0, 1.0), &at(30.0, 0.0, 1.0)], 1.0);
        assert!((6.0..6.2).contains(&walls), "{walls}");
        assert!(tools_apart(&tools, [&at(0.0, 0.0, 1.0), &at(15.0, -3.0, -1.0)], 1.0) > 0.0);
        assert!(tools_apart(&tools, [&at(0.0, 0.0, 1.0), &at(15.0, 3.0, -1.0)], 1.0) <= 0.0);
    }
}
