//! Points and correlations that are left out because they are rounding.

use pulp::Simd;

use crate::kernel::Kernel;
use crate::machine::lanes::Rounding;
use crate::machine::registers::Pack;
use crate::regression::function::local_kriging::parts::VALUES;
use crate::regression::solver::PIVOT_TOLERANCE;
use crate::regression::sums::side_by_side::VANISHES;

/// Rounding of a factor without the points that depend on others, and without entries next to nothing.
pub(super) struct GuardedRounding {
    /// The least conditional variance of a point that is kept. Smaller ones are rounding, since such a point
    /// follows from those before it.
    dependent: f64,
    /// The least absolute entry.
    least: f64,
    /// The row of the values. They have a unit of their own and may be small, so none is set to 0.
    values: usize,
}

impl GuardedRounding {
    /// Returns the rounding for a kernel and n points.
    #[inline(always)]
    pub(super) fn new(kernel: &Kernel, n: usize) -> Self {
        let k0 = kernel.at_zero();
        Self { dependent: PIVOT_TOLERANCE * k0, least: VANISHES * k0.sqrt(), values: n + VALUES }
    }
}

impl<S: Simd> Rounding<S> for GuardedRounding {
    const JOINS_PRODUCTS: bool = false;

    #[inline(always)]
    fn entry(&self, i: usize, entry: Pack<S, 1>) -> Pack<S, 1> {
        let least = if i == self.values { 0.0 } else { self.least };
        entry * entry.abs().select_below(least, 0.0, 1.0)
    }

    /// Returns 0 for a dependent point, which is thereby left out.
    #[inline(always)]
    fn inverse_root(&self, square: Pack<S, 1>) -> Pack<S, 1> {
        square.select_below(self.dependent, 0.0, 1.0) / square.at_least(self.dependent).sqrt()
    }
}
