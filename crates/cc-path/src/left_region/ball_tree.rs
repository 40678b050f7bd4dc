//! Balls in a tree of boxes.

use nalgebra::{Point3, Unit, Vector3};

/// Ball around a place of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Ball {
    pub(crate) center: Point3<f64>,
    pub(crate) radius: f64,
    /// Normal of the surface at its centre.
    pub(crate) normal: Unit<Vector3<f64>>,
}

/// Balls that are searched by distance.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct BallTree {
    balls: Vec<Ball>,
    /// Indices of balls, those of a node side by side.
    order: Vec<u32>,
    /// Each followed by the nodes below its left side.
    nodes: Vec<Node>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Node {
    low: Point3<f64>,
    high: Point3<f64>,
    /// Largest radius.
    radius: f64,
    first: u32,
    end: u32,
    /// Node of its right side; 0 for a leaf.
    right: u32,
}

/// Largest number of balls in a leaf.
const LEAF: usize = 8;

impl BallTree {
    pub(crate) fn new(balls: Vec<Ball>) -> Self {
        let n = balls.len();
        let mut tree = Self { balls, order: (0..n as u32).collect(), nodes: Vec::new() };
        if n > 0 {
            tree.build(0, n);
        }
        tree
    }

    fn build(&mut self, first: usize, end: usize) {
        let balls = &self.balls;
        let of_node = self.order[first..end].iter().map(|&k| &balls[k as usize]);
        let (mut low, mut high, mut radius) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3], 0.0_f64);
        for ball in of_node {
            for k in 0..3 {
                low[k] = low[k].min(ball.center[k]);
                high[k] = high[k].max(ball.center[k]);
            }
            radius = radius.max(ball.radius);
        }
        let (low, high) = (Point3::from(low), Point3::from(high));
        let at = self.nodes.len();
        self.nodes.push(Node { low, high, radius, first: first as u32, end: end as u32, right: 0 });
        if end - first <= LEAF {
            return;
        }
        let axis = (high - low).imax();
        let middle = (end - first) / 2;
        self.order[first..end].select_nth_unstable_by(middle, |&a, &b| {
            let along = |k: u32| balls[k as usize].center[axis];
            along(a).total_cmp(&along(b)).then(a.cmp(&b))
        });
        self.build(first, first + middle);
        self.nodes[at].right = self.nodes.len() as u32;
        self.build(first + middle, end);
    }

    /// Largest depth of a point in a ball (radius less distance from the centre, mm) of those whose
    /// normals are within 90° of `facing`, or of all; `least` where none is larger.
    pub(crate) fn deepest(&self, point: &Point3<f64>, facing: Option<&Unit<Vector3<f64>>>, least: f64) -> f64 {
        let mut deepest = least;
        if !self.nodes.is_empty() {
            self.deepest_below(0, point, facing, &mut deepest);
        }
        deepest
    }

    fn deepest_below(&self, node: usize, p: &Point3<f64>, facing: Option<&Unit<Vector3<f64>>>, deepest: &mut f64) {
        let Node { radius, right, .. } = self.nodes[node];
        if radius - self.apart(node, p) <= *deepest {
            return;
        }
        if right == 0 {
            for ball in self.leaf(node).map(|k| &self.balls[k]) {
                if facing.is_none_or(|n| n.dot(&ball.normal) > 0.0) {
                    *deepest = deepest.max(ball.radius - (p - ball.center).norm());
                }
            }
            return;
        }
        let mut below = [node + 1, right as usize];
        if self.apart(below[1], p) < self.apart(below[0], p) {
            below.swap(0, 1);
        }
        below.into_iter().for_each(|k| self.deepest_below(k, p, facing, deepest));
    }

    /// Calls with the index of every ball whose centre is within a distance of a point.
    pub(crate) fn visit_within(&self, point: &Point3<f64>, distance: f64, visit: &mut dyn FnMut(usize)) {
        let mut open: Vec<usize> = if self.nodes.is_empty() { Vec::new() } else { vec![0] };
        while let Some(node) = open.pop() {
            if self.apart(node, point) > distance {
                continue;
            }
            match self.nodes[node].right {
                0 => {
                    let near = |k: &usize| (self.balls[*k].center - point).norm() <= distance;
                    self.leaf(node).filter(near).for_each(&mut *visit);
                }
                right => open.extend([right as usize, node + 1]),
            }
        }
    }

    /// Balls that are still in a search which takes out what it finds.
    pub(crate) fn all_open(&self) -> OpenBalls<'_> {
        let open = self.nodes.iter().map(|n| n.end - n.first).collect();
        OpenBalls { tree: self, open, is_taken: vec![false; self.balls.len()] }
    }

    fn leaf(&self, node: usize) -> impl Iterator<Item = usize> + '_ {
        let Node { first, end, .. } = self.nodes[node];
        self.order[first as usize..end as usize].iter().map(|&k| k as usize)
    }

    /// Distance of a point from the centres of a node, at least.
    fn apart(&self, node: usize, p: &Point3<f64>) -> f64 {
        let Node { low, high, .. } = &self.nodes[node];
        (low - p).sup(&(p - high)).sup(&Vector3::zeros()).norm()
    }
}

/// Balls of a tree that were not taken yet.
pub(crate) struct OpenBalls<'t> {
    tree: &'t BallTree,
    /// Number of those of each node.
    open: Vec<u32>,
    is_taken: Vec<bool>,
}

impl OpenBalls<'_> {
    /// Takes all balls that come as near as `gap` (mm) to a ball and whose normals are within 90°
    /// of its.
    pub(crate) fn take_near(&mut self, ball: usize, gap: f64, taken: &mut Vec<u32>) {
        self.take_below(0, ball, gap, taken);
    }

    /// Takes a ball; false where it was taken before.
    pub(crate) fn take(&mut self, ball: usize) -> bool {
        if self.is_taken[ball] {
            return false;
        }
        // A ball is near itself, and only counted where it is.
        let mut taken = Vec::new();
        let at = self.tree.balls[ball].center;
        self.take_exactly(0, ball, &at, &mut taken);
        !taken.is_empty()
    }

    fn take_exactly(&mut self, node: usize, ball: usize, at: &Point3<f64>, taken: &mut Vec<u32>) {
        if self.open[node] == 0 || self.tree.apart(node, at) > 0.0 || !taken.is_empty() {
            return;
        }
        let before = taken.len();
        match self.tree.nodes[node].right {
            0 => {
                if self.tree.leaf(node).any(|k| k == ball) {
                    self.is_taken[ball] = true;
                    taken.push(ball as u32);
                }
            }
            right => [node + 1, right as usize].into_iter().for_each(|k| self.take_exactly(k, ball, at, taken)),
        }
        self.open[node] -= (taken.len() - before) as u32;
    }

    fn take_below(&mut self, node: usize, ball: usize, gap: f64, taken: &mut Vec<u32>) {
        let tree = self.tree;
        let from = &tree.balls[ball];
        let within = |radius: f64| from.radius + radius + gap;
        if self.open[node] == 0 || tree.apart(node, &from.center) > within(tree.nodes[node].radius) {
            return;
        }
        let before = taken.len();
        match tree.nodes[node].right {
            0 => {
                for k in tree.leaf(node) {
                    let other = &tree.balls[k];
                    let is_near = (other.center - from.center).norm() <= within(other.radius);
                    if !self.is_taken[k] && is_near && from.normal.dot(&other.normal) > 0.0 {
                        self.is_taken[k] = true;
                        taken.push(k as u32);
                    }
                }
            }
            right => [node + 1, right as usize].into_iter().for_each(|k| self.take_below(k, ball, gap, taken)),
        }
        self.open[node] -= (taken.len() - before) as u32;
    }
}
