//! SIMD registers of f64 with the operators of arithmetic.
//!
//! A formula is written once, over [`Pack`]s, for every instruction set. A pack is a few registers side by
//! side. Instructions on one register do not wait for those on another. This hides the latency of long
//! dependent chains, such as the polynomial of the exponential.
//!
//! Every function between [`super::instruction_set::InstructionSet::dispatch`] and here is
//! `#[inline(always)]`. Loop bodies and profiles are methods of traits, not functions passed as values, and
//! closures only where they store what a loop has at hand. Otherwise they would not be compiled into the
//! dispatched function itself. Code outside it falls back to one call per instruction, 50 times slower.

pub(crate) mod exp;

use std::any::{Any, TypeId};
use std::ops::{Add, Div, Mul, Neg, Sub};

use pulp::Simd;

use super::instruction_set::Portable;

/// Points per block: a multiple of every pack.
///
/// The temporaries of a pass over 128 pairs at d = 3 are 6 KiB of L1 cache. Blocks of 64 sum Hessians 20 %
/// slower, blocks of 256 no more than 3 % faster.
pub(crate) const BLOCK: usize = 128;

/// Registers per pack where a profile is computed.
///
/// By `cargo bench --bench kernels`, 8 are 10 to 20 % faster than 4 and up to 40 % faster than 2. This holds
/// with 32 registers (AVX-512) and with 16 (AVX2): packs that do not fit wait in the L1 cache.
pub(crate) const IN_FLIGHT: usize = 8;

/// The numbers of a block, one per point. They start at a cache line, so that no load straddles two.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
pub(crate) struct Block(pub(crate) [f64; BLOCK]);

impl Block {
    pub(crate) const ZERO: Self = Self([0.0; BLOCK]);

    #[inline(always)]
    pub(crate) fn registers_mut<S: Simd>(&mut self) -> &mut [S::f64s] {
        S::as_mut_simd_f64s(&mut self.0).0
    }
}

/// A pack of `N` registers, i.e. `N · S::F64_LANES` numbers.
#[derive(Clone, Copy)]
pub(crate) struct Pack<S: Simd, const N: usize = IN_FLIGHT> {
    simd: S,
    registers: [S::f64s; N],
}

impl<S: Simd, const N: usize> Pack<S, N> {
    /// Packs per block.
    pub(crate) const PER_BLOCK: usize = BLOCK / (N * S::F64_LANES);

    #[inline(always)]
    pub(crate) fn splat(simd: S, x: f64) -> Self {
        Self { simd, registers: [simd.splat_f64s(x); N] }
    }

    #[inline(always)]
    pub(crate) fn simd(self) -> S {
        self.simd
    }

    /// Loads pack number `at` of a block: its numbers from `at · N · S::F64_LANES` on.
    #[inline(always)]
    pub(crate) fn load(simd: S, block: &Block, at: usize) -> Self {
        let (registers, _) = S::as_simd_f64s(&block.0);
        Self { simd, registers: registers.as_chunks().0[at] }
    }

    #[inline(always)]
    pub(crate) fn store(self, block: &mut Block, at: usize) {
        let (registers, _) = S::as_mut_simd_f64s(&mut block.0);
        registers.as_chunks_mut().0[at] = self.registers;
    }

    /// Reads pack number `at` of a list of registers: those from `at · N` on.
    #[inline(always)]
    pub(crate) fn read(simd: S, registers: &[S::f64s], at: usize) -> Self {
        Self { simd, registers: registers.as_chunks().0[at] }
    }

    #[inline(always)]
    pub(crate) fn write(self, registers: &mut [S::f64s], at: usize) {
        registers.as_chunks_mut().0[at] = self.registers;
    }

    /// Returns `self·b + c`, rounded once if the instruction set has a fused instruction.
    ///
    /// Otherwise it rounds twice, because the library call that rounds once would cost more than it is worth.
    #[inline(always)]
    pub(crate) fn mul_add(mut self, b: Self, c: Self) -> Self {
        // The portable set has no fused instruction, and its `mul_add_e_f64s` would call the library. Decided
        // when compiled.
        if TypeId::of::<S>() == TypeId::of::<Portable>() {
            return self * b + c;
        }
        for i in 0..N {
            self.registers[i] = self.simd.mul_add_e_f64s(self.registers[i], b.registers[i], c.registers[i]);
        }
        self
    }

    #[inline(always)]
    pub(crate) fn sqrt(self) -> Self {
        self.map(|simd, x| simd.sqrt_f64s(x))
    }

    /// Returns √x within 1 ulp and 1/√x within 2 ulp, for x in [1e-200, 1e300]. A result that is not used is
    /// not computed.
    ///
    /// With AVX-512 it starts from an approximation to 14 bits. One step of Goldschmidt's iteration follows,
    /// then a correction of the rounding of each result (Markstein 2004). These are ten instructions, where
    /// the dividing unit takes 40 cycles per register.
    #[inline(always)]
    pub(crate) fn sqrt_and_inverse(self) -> (Self, Self) {
        let Some(approximate) = self.approximate_inverse_sqrt() else {
            let root = self.sqrt();
            return (root, 1.0 / root);
        };
        let splat = |x| Self::splat(self.simd, x);
        let (root, minus_half_inverse) = (self * approximate, approximate * -0.5);
        let error = root.mul_add(minus_half_inverse, splat(0.5));
        let root = root.mul_add(error, root);
        let minus_half_inverse = minus_half_inverse.mul_add(error, minus_half_inverse);
        let root = root.mul_add(root, -self).mul_add(minus_half_inverse, root);
        // The root is right now, so the whole error is that of the inverse.
        let minus_inverse = minus_half_inverse * 2.0;
        let error = root.mul_add(minus_inverse, splat(1.0));
        (root, -minus_inverse.mul_add(error, minus_inverse))
    }

    /// Returns 1/√x to 14 bits, or `None` if there is no instruction for it. Decided when compiled.
    #[inline(always)]
    fn approximate_inverse_sqrt(self) -> Option<Self> {
        #[cfg(target_arch = "x86_64")]
        if let Some(v4) = (&self.simd as &dyn Any).downcast_ref::<pulp::x86::V4>() {
            return Some(self.map(|_, x| bytemuck::cast(v4.avx512f._mm512_rsqrt14_pd(bytemuck::cast(x)))));
        }
        None
    }

    #[inline(always)]
    pub(crate) fn abs(self) -> Self {
        self.map(|simd, x| simd.abs_f64s(x))
    }

    #[inline(always)]
    pub(crate) fn at_least(self, bound: f64) -> Self {
        self.map(|simd, x| simd.max_f64s(x, simd.splat_f64s(bound)))
    }

    #[inline(always)]
    pub(crate) fn at_most(self, bound: f64) -> Self {
        self.map(|simd, x| simd.min_f64s(x, simd.splat_f64s(bound)))
    }

    /// Returns `yes` where the number is below the bound, and `no` elsewhere.
    #[inline(always)]
    pub(crate) fn select_below(self, bound: f64, yes: f64, no: f64) -> Self {
        self.map(|simd, x| {
            let below = simd.less_than_f64s(x, simd.splat_f64s(bound));
            simd.select_f64s(below, simd.splat_f64s(yes), simd.splat_f64s(no))
        })
    }

    /// Returns `self · 2^k`: adds k to the exponent fields. k is the integer in the low 12 bits of each float
    /// in `exponents`.
    #[inline(always)]
    pub(crate) fn scale_by_power_of_two(mut self, exponents: Self) -> Self {
        let simd = self.simd;
        for i in 0..N {
            let k = simd.transmute_u64s_f64s(exponents.registers[i]);
            // The trait has no shift of 64 bits. A multiplication by a power of two compiles to one.
            let k = simd.mul_u64s(k, simd.splat_u64s(1 << 52));
            let bits = simd.transmute_u64s_f64s(self.registers[i]);
            self.registers[i] = simd.transmute_f64s_u64s(simd.add_u64s(bits, k));
        }
        self
    }

    /// Returns `sum` plus the products with `other`, added register by register.
    ///
    /// These N additions wait for each other, but their chain is shorter than the other work on a pack.
    #[inline(always)]
    pub(crate) fn add_products_to(self, other: Self, mut sum: Pack<S, 1>) -> Pack<S, 1> {
        for i in 0..N {
            let (a, b) = ([self.registers[i]], [other.registers[i]]);
            sum = Pack { simd: self.simd, registers: a }.mul_add(Pack { simd: self.simd, registers: b }, sum);
        }
        sum
    }

    #[inline(always)]
    fn map(mut self, f: impl Fn(S, S::f64s) -> S::f64s) -> Self {
        for register in &mut self.registers {
            *register = f(self.simd, *register);
        }
        self
    }
}

impl<S: Simd> Pack<S, 1> {
    /// Reads register number `at` of a list of numbers.
    #[inline(always)]
    pub(crate) fn of_numbers(simd: S, numbers: &[f64], at: usize) -> Self {
        Self::read(simd, S::as_simd_f64s(numbers).0, at)
    }

    /// Returns the sum of the lanes.
    #[inline(always)]
    pub(crate) fn sum_lanes(self) -> f64 {
        self.simd.reduce_sum_f64s(self.registers[0])
    }
}

macro_rules! operator {
    ($($trait:ident $function:ident $instruction:ident),*) => {$(
        impl<S: Simd, const N: usize> $trait for Pack<S, N> {
            type Output = Self;
            #[inline(always)]
            fn $function(mut self, other: Self) -> Self {
                for i in 0..N {
                    self.registers[i] = self.simd.$instruction(self.registers[i], other.registers[i]);
                }
                self
            }
        }

        impl<S: Simd, const N: usize> $trait<f64> for Pack<S, N> {
            type Output = Self;
            #[inline(always)]
            fn $function(self, other: f64) -> Self {
                self.$function(Self::splat(self.simd, other))
            }
        }

        impl<S: Simd, const N: usize> $trait<Pack<S, N>> for f64 {
            type Output = Pack<S, N>;
            #[inline(always)]
            fn $function(self, other: Pack<S, N>) -> Pack<S, N> {
                Pack::splat(other.simd, self).$function(other)
            }
        }
    )*};
}

operator!(Add add add_f64s, Sub sub sub_f64s, Mul mul mul_f64s, Div div div_f64s);

impl<S: Simd, const N: usize> Neg for Pack<S, N> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.map(|simd, x| simd.neg_f64s(x))
    }
}

#[cfg(test)]
mod tests {
    use pulp::WithSimd;

    use super::*;
    use crate::machine::instruction_set::InstructionSet;

    /// Computes the square roots of numbers and their inverses.
    struct Roots<'a>(&'a [f64]);

    impl WithSimd for Roots<'_> {
        type Output = Vec<(f64, f64)>;

        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
            let mut found = Vec::new();
            for numbers in self.0.chunks(BLOCK) {
                let (mut roots, mut inverses) = (Block([1.0; BLOCK]), Block::ZERO);
                roots.0[..numbers.len()].copy_from_slice(numbers);
                for at in 0..Pack::<S>::PER_BLOCK {
                    let (root, inverse) = Pack::<S>::load(simd, &roots, at).sqrt_and_inverse();
                    root.store(&mut roots, at);
                    inverse.store(&mut inverses, at);
                }
                found.extend(roots.0.into_iter().zip(inverses.0).take(numbers.len()));
            }
            found
        }
    }

    #[test]
    fn roots_are_right_to_an_ulp_and_their_inverses_to_two() {
        // The numbers are a Weyl sequence over every binade of the range, and squares, whose roots are exact.
        let mantissa = |i: i32| 1.0 + (f64::from(i) * 0.618_033_988_749_894_9).fract();
        let mut numbers: Vec<f64> =
            (0..200_000).map(|i| mantissa(i) * 2f64.powi(i % 1659 - 664)).filter(|x| *x < 1e300).collect();
        numbers.extend((1..5000).map(|i| f64::from(i * i)));
        for set in InstructionSet::available() {
            for (&x, (root, inverse)) in numbers.iter().zip(set.dispatch(Roots(&numbers))) {
                // The error of the root: (root² − x)/(2·root), with the difference rounded only once.
                let error = root.mul_add(root, -x) / (2.0 * root);
                assert!(error.abs() <= root.next_up() - root, "√{x:e} on {}: off by {error:e}", set.name());
                // The relative error of the inverse: inverse·(root − error) − 1. The product inverse·root − 1
                // is rounded once, by at most ε/4 of an ulp.
                let product = inverse.mul_add(root, -1.0) - inverse * error;
                let allowed = 2.0 * (inverse.next_up() - inverse) / inverse;
                assert!(product.abs() <= allowed, "1/√{x:e} on {}: off by {product:e}", set.name());
            }
        }
    }
}
