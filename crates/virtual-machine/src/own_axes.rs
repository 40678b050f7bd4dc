use facemill_inverse_kinematics::Machine;
use nalgebra::Isometry3;

/// By a mm or a rad every joint moves what is behind it by far more than this, rounding by far less.
const MOVED: f64 = 1e-6;

/// Whether each axis moves the tool against the work. Those of another head do not.
pub(crate) fn own_axes(machine: &Machine) -> Vec<bool> {
    let home = machine.home();
    let at_home = machine.forward(&home, 0.0);
    let moves = |k: usize| {
        let mut q = home;
        q[k] += 1.0;
        differs(&machine.forward(&q, 0.0), &at_home)
    };
    (0..home.len()).map(moves).collect()
}

/// Whether two poses are not the same.
pub(crate) fn differs(a: &Isometry3<f64>, b: &Isometry3<f64>) -> bool {
    (a.to_homogeneous() - b.to_homogeneous()).norm() > MOVED
}
