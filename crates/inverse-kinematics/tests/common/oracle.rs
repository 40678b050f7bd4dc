//! A second inverse solution: damped Newton with finite differences on Craig's matrices, from many
//! seeds.

use facemill_cl_data::ClPoint;
use facemill_inverse_kinematics::machine_file::{DhRow, MachineFile};
use facemill_inverse_kinematics::*;
use nalgebra::{Matrix4, Point3, SMatrix, SVector, Unit, Vector3};

use super::{Random, craig};

/// Length that counts as much as 1 rad, mm.
const LENGTH: f64 = 500.0;

/// A machine read from its file.
pub struct Oracle<'m> {
    machine: &'m Machine,
    file: MachineFile,
    tool_length: f64,
    /// The axes that move the tool.
    own: [usize; 5],
}

/// Values that reach a pose.
#[derive(Debug)]
pub struct OracleSolution {
    pub values: AxisValues,
    /// Least singular value of the Jacobian, lengths counted in units of 500 mm: a measure of how
    /// far the solution is from double.
    pub least_singular: f64,
}

impl<'m> Oracle<'m> {
    pub fn new(machine: &'m Machine, tool_length: f64) -> Self {
        let mut own = (0..machine.axes().len()).filter(|&k| machine.axes()[k].carried_by != Carrier::OtherHead);
        let own = std::array::from_fn(|_| own.next().unwrap());
        Self { machine, file: machine.to_file(), tool_length, own }
    }

    pub fn cl_point(&self, q: &AxisValues) -> ClPoint {
        let value = |axis: &str| q[self.machine.axis_index(axis).unwrap()];
        let chain = |rows: &[DhRow]| rows.iter().fold(Matrix4::identity(), |m, row| m * craig(row, &value));
        let table = chain(&self.file.workpiece_chain.rows);
        let nose = chain(&self.file.tool_chains[self.machine.head()].rows);
        let tip = nose.column(3).xyz() - nose.column(2).xyz() * self.tool_length;
        let back = table.fixed_view::<3, 3>(0, 0).transpose();
        let axis: Vector3<f64> = back * nose.column(2).xyz();
        ClPoint { tip: Point3::from(back * (tip - table.column(3).xyz())), axis: Unit::new_normalize(axis) }
    }

    /// Indices of the axes that move the tool.
    pub fn own(&self) -> [usize; 5] {
        self.own
    }

    fn residual(&self, q: &AxisValues, cl: &ClPoint) -> SVector<f64, 6> {
        let at = self.cl_point(q);
        let (tip, axis) = ((at.tip - cl.tip) / LENGTH, *at.axis - *cl.axis);
        SVector::from_iterator(tip.iter().chain(axis.iter()).copied())
    }

    /// Returns a value's unit in the Jacobian.
    fn unit(&self, k: usize) -> f64 {
        if self.machine.axes()[k].kind == AxisKind::Linear { LENGTH } else { 1.0 }
    }

    pub fn jacobian(&self, q: &AxisValues, cl: &ClPoint) -> SMatrix<f64, 6, 5> {
        let step = 2e-6;
        SMatrix::from_columns(&self.own.map(|k| {
            let (mut up, mut down) = (*q, *q);
            up[k] += step * self.unit(k);
            down[k] -= step * self.unit(k);
            (self.residual(&up, cl) - self.residual(&down, cl)) / (2.0 * step)
        }))
    }

    /// Returns the signed volume of the Jacobian, tool axis taken across itself: 0 where two
    /// solutions meet.
    pub fn volume(&self, q: &AxisValues) -> f64 {
        let cl = self.cl_point(q);
        let j = self.jacobian(q, &cl);
        // With the tool axis itself as a sixth column the determinant is that of the five others,
        // up to a fixed sign.
        let mut full = SMatrix::<f64, 6, 6>::zeros();
        full.fixed_view_mut::<6, 5>(0, 0).copy_from(&j);
        full.fixed_view_mut::<3, 1>(3, 5).copy_from(&cl.axis.into_inner());
        full.determinant()
    }

    /// Makes one damped Newton run; `None` where it does not converge.
    pub fn newton(&self, cl: &ClPoint, start: AxisValues) -> Option<OracleSolution> {
        let mut q = start;
        let mut damping = 1e-3;
        let mut r = self.residual(&q, cl);
        for _ in 0..60 {
            let j = self.jacobian(&q, cl);
            let mut normal = j.tr_mul(&j);
            for k in 0..5 {
                normal[(k, k)] = normal[(k, k)] * (1.0 + damping) + 1e-15;
            }
            let change = normal.lu().solve(&(-j.tr_mul(&r)))?;
            let mut next = q;
            for (i, k) in self.own.into_iter().enumerate() {
                next[k] += change[i] * self.unit(k);
            }
            let next_r = self.residual(&next, cl);
            if next_r.norm() < r.norm() {
                (q, r, damping) = (next, next_r, damping * 0.1);
            } else if r.norm() < 1e-12 {
                let least_singular = j.svd(false, false).singular_values.min();
                return Some(OracleSolution { values: q, least_singular });
            } else {
                damping = damping.max(1e-9) * 8.0;
            }
        }
        None
    }

    /// Returns the solutions that runs from random seeds find within the limits, rotary values in
    /// ±π.
    pub fn solutions(&self, cl: &ClPoint, n_seeds: usize, r: &mut Random) -> Vec<OracleSolution> {
        let mut all = Vec::new();
        for _ in 0..n_seeds {
            let Some(mut found) = self.newton(cl, super::random_values(r, self.machine)) else { continue };
            for (k, axis) in self.machine.axes().iter().enumerate() {
                if axis.kind == AxisKind::Rotary {
                    let turn = std::f64::consts::TAU;
                    found.values[k] -= turn * (found.values[k] / turn).round();
                }
            }
            if self.machine.first_beyond_limit(&found.values).is_none() {
                all.push(found);
            }
        }
        all
    }
}
