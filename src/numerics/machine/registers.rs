//! Registers of f64 with the arithmetic of formulas.
//!
//! A formula is written once, over [`Pack`]s, for every instruction set. A pack is a few registers side by side: the
//! instructions of one do not wait for those of another, which hides the latency of long dependent chains such as the
//! polynomial of the exponential. Every function between [`super::instruction_set::InstructionSet::dispatch`] and
//! here is `#[inline(always)]`, and loop bodies and profiles are methods of traits, not closures or functions passed as
//! values: what is not compiled into the dispatched function itself falls back to one call per instruction, 50 times
//! slower.

use std::any::TypeId;
use std::ops::{Add, Div, Mul, Neg, Sub};

use pulp::Simd;

use super::instruction_set::Portable;

/// Points per block: a multiple of every pack. The temporaries of a pass over 128 pairs at d = 3 are 6 KiB of L1 cache;
/// blocks of 64 sum Hessians 20 % slower, of 256 no more than 3 % faster.
pub(crate) const BLOCK: usize = 128;

/// Registers per pack where a profile is computed. By `cargo bench --bench kernels` 8 are 10 to 20 % faster than 4 and up to
/// 40 % faster than 2, with 32 registers (AVX-512) and with 16 (AVX2): what does not fit waits in the L1 cache.
pub(crate) const IN_FLIGHT: usize = 8;

/// One number per point of a block, on the boundary of a cache line, so that no load straddles two.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
pub(crate) struct Block(pub(crate) [f64; BLOCK]);

impl Block {
    pub(crate) const ZERO: Self = Self([0.0; BLOCK]);
}

/// `N` registers, i.e. `N · S::F64_LANES` numbers.
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

    /// The numbers of a block from `at · N · S::F64_LANES` on.
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

    /// `self·b + c`, rounded once where the instruction set has it (elsewhere a library call would cost more than it is
    /// worth).
    #[inline(always)]
    pub(crate) fn mul_add(mut self, b: Self, c: Self) -> Self {
        // The one set that has no fused multiplication and does not say so. Decided when compiled.
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

    /// `yes` where the number is below the bound, `no` elsewhere.
    #[inline(always)]
    pub(crate) fn select_below(self, bound: f64, yes: f64, no: f64) -> Self {
        self.map(|simd, x| {
            let below = simd.less_than_f64s(x, simd.splat_f64s(bound));
            simd.select_f64s(below, simd.splat_f64s(yes), simd.splat_f64s(no))
        })
    }

    /// Adds the low 12 bits of `exponents`, an integer in the low bits of a float, to the exponents: `self · 2^k`.
    #[inline(always)]
    pub(crate) fn scale_by_power_of_two(mut self, exponents: Self) -> Self {
        let simd = self.simd;
        for i in 0..N {
            let k = simd.transmute_u64s_f64s(exponents.registers[i]);
            // A multiplication by a power of two compiles to a shift; the trait has no shift of 64 bits.
            let k = simd.mul_u64s(k, simd.splat_u64s(1 << 52));
            let bits = simd.transmute_u64s_f64s(self.registers[i]);
            self.registers[i] = simd.transmute_f64s_u64s(simd.add_u64s(bits, k));
        }
        self
    }

    /// The sum of the registers, lane by lane.
    #[inline(always)]
    pub(crate) fn sum_registers(self) -> Pack<S, 1> {
        let mut sum = Pack { simd: self.simd, registers: [self.registers[0]] };
        for register in &self.registers[1..] {
            sum = sum + Pack { simd: self.simd, registers: [*register] };
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
    /// The sum of the lanes.
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
