//! Eight numbers side by side: plain arrays, in loops that the compiler turns into vector
//! instructions.

use nalgebra::Vector3;
use pulp::{Arch, NullaryFnOnce};

/// Children of a node. Eight doubles are two AVX2 registers or one of AVX-512; with four, the tree
/// is deeper and slower.
pub(crate) const N: usize = 8;

/// One number for each child.
pub(crate) type Lanes = [f64; N];

/// Three coordinates, each for all children.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lanes3 {
    pub(crate) x: Lanes,
    pub(crate) y: Lanes,
    pub(crate) z: Lanes,
}

impl Lanes3 {
    pub(crate) const ZERO: Self = Self { x: [0.0; N], y: [0.0; N], z: [0.0; N] };

    pub(crate) fn set(&mut self, lane: usize, v: &Vector3<f64>) {
        (self.x[lane], self.y[lane], self.z[lane]) = (v.x, v.y, v.z);
    }

    #[inline(always)]
    pub(crate) fn get(&self, lane: usize) -> Vector3<f64> {
        Vector3::new(self.x[lane], self.y[lane], self.z[lane])
    }
}

/// Returns the result of `run`, computed with the processor's vector instructions.
///
/// They reach what is inlined and nothing else: `run` has to be marked `#[inline(always)]` and what
/// it calls, too. A closure given to [`Arch::dispatch`] itself is called through a shim that is
/// not.
#[inline(always)]
pub(crate) fn vectorized<R>(arch: Arch, run: impl Fn() -> R) -> R {
    struct VectorCall<F>(F);
    impl<R, F: Fn() -> R> NullaryFnOnce for VectorCall<F> {
        type Output = R;

        #[inline(always)]
        fn call(self) -> R {
            (self.0)()
        }
    }
    arch.dispatch(VectorCall(run))
}
