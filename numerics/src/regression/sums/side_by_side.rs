//! Covariance matrices of small systems side by side, one system in each lane of a register.

use pulp::Simd;

use crate::kernel::Kernel;
use crate::kernel::in_place::Scaling;
use crate::machine::lanes::{Lower, triangle};
use crate::machine::registers::{IN_FLIGHT, Pack};

/// 2⁻⁵⁰⁰. Correlations below this are set to 0, and so are entries of the factor below this times √k₀.
///
/// With k₀ near 1, no product of two remaining entries is subnormal. Some processors take a hundred cycles
/// for each subnormal product. Values that are tiny beside the greatest of their neighbourhood may still lead
/// to some.
pub(crate) const VANISHES: f64 = f64::from_bits((1023 - 500) << 52);

/// The scaling under which correlations that vanish are 0.
pub(crate) fn scaling(kernel: &Kernel) -> Scaling {
    Scaling {
        inverse_square_length: kernel.inverse_square_length(),
        variance: kernel.variance(),
        least: VANISHES,
    }
}

/// The points of some systems, equally many for each.
#[derive(Clone, Copy)]
pub(crate) struct SideBySide<'a> {
    pub dimension: usize,
    /// Points of each system. Places behind them are empty.
    pub count: usize,
    /// Differences of the points from a common origin, stretched by the kernel, `[d, places, lanes]`, unit L.
    pub points: &'a [f64],
    /// Variances of the noise, `[places, lanes]`, unit V².
    pub noise: &'a [f64],
}

impl SideBySide<'_> {
    /// Fills triangles with `K + noise`. Rows of empty places are those of the identity.
    #[inline(always)]
    pub(crate) fn fill_triangle<S: Simd>(&self, kernel: &Kernel, lower: &mut Lower<'_, S>) {
        let (n, count, simd) = (lower.layout.n, self.count, lower.simd);
        let at = |axis: usize, i: usize| Pack::<S, 1>::of_numbers(simd, self.points, axis * n + i);
        for i in 0..count {
            let row = triangle(i);
            for axis in 0..self.dimension {
                let x = at(axis, i);
                for j in 0..i {
                    let step = x - at(axis, j);
                    let before = if axis == 0 { lower.splat(0.0) } else { lower.at(row + j) };
                    lower.set(row + j, step.mul_add(step, before));
                }
            }
        }
        let entries = &mut lower.registers[..triangle(count).next_multiple_of(IN_FLIGHT)];
        scaling(kernel).covariances(simd, kernel.family(), [entries]);
        for i in 0..count {
            let noise = Pack::<S, 1>::of_numbers(simd, self.noise, i);
            lower.set(triangle(i) + i, noise + kernel.at_zero());
        }
        for i in count..n {
            for j in 0..i {
                lower.set(triangle(i) + j, lower.splat(0.0));
            }
            lower.set(triangle(i) + i, lower.splat(1.0));
        }
    }
}
