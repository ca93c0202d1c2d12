//! The instruction set of the kernel loops, chosen at run time.
//!
//! Everything here is safe code: [`pulp`] compiles a loop that is generic over [`pulp::Simd`] for AVX-512,
//! for AVX2 with FMA, for NEON and for the portable baseline.

use pulp::{Simd, WithSimd};

/// An instruction set that the kernel loops are compiled for and this machine has.
#[derive(Debug, Clone, Copy)]
pub struct InstructionSet(pulp::Arch);

/// The portable baseline: registers of two lanes, which every 64-bit processor has.
///
/// It is 1.2 to 1.7 times as fast as single numbers where sums of Hessians prevail.
pub(crate) type Portable = pulp::Scalar128b;

impl InstructionSet {
    /// Returns the best instruction set of this machine.
    pub fn best() -> Self {
        Self(pulp::Arch::new())
    }

    /// Returns all instruction sets of this machine, the best first and the portable one last.
    pub fn available() -> Vec<Self> {
        let mut sets = vec![Self::best()];
        #[cfg(target_arch = "x86_64")]
        if let (pulp::Arch::V4(_), Some(v3)) = (sets[0].0, pulp::x86::V3::try_new()) {
            sets.push(Self(pulp::Arch::V3(v3)));
        }
        if !matches!(sets[0].0, pulp::Arch::Scalar) {
            sets.push(Self(pulp::Arch::Scalar));
        }
        sets
    }

    /// Returns the number of f64 in a register.
    pub(crate) fn n_lanes(self) -> usize {
        self.dispatch(Lanes)
    }

    /// Returns the name that `GET /version` shows.
    pub fn name(self) -> &'static str {
        match self.0 {
            pulp::Arch::Scalar => "portable",
            #[cfg(target_arch = "x86_64")]
            pulp::Arch::V3(_) => "AVX2 and FMA",
            #[cfg(target_arch = "x86_64")]
            pulp::Arch::V4(_) => "AVX-512",
            _ => "128-bit vectors",
        }
    }

    /// Runs a loop that is compiled for each instruction set.
    ///
    /// `pulp::Arch::dispatch` would compile another copy of every loop, with one lane, that is never used.
    #[inline(always)]
    pub(crate) fn dispatch<Op: WithSimd>(self, op: Op) -> Op::Output {
        match self.0 {
            #[cfg(target_arch = "x86_64")]
            pulp::Arch::V4(simd) => Simd::vectorize(simd, op),
            #[cfg(target_arch = "x86_64")]
            pulp::Arch::V3(simd) => Simd::vectorize(simd, op),
            #[cfg(target_arch = "aarch64")]
            pulp::Arch::Neon(simd) => Simd::vectorize(simd, op),
            _ => op.with_simd(Portable {}),
        }
    }
}

/// Runs a loop that is compiled once for an instruction set, not into each function that calls it.
///
/// A function without `#[inline(always)]` does not have the instructions of the one that calls it. Here they
/// are enabled anew.
#[inline(never)]
pub(crate) fn outlined<S: Simd, Op: WithSimd>(simd: S, op: Op) -> Op::Output {
    simd.vectorize(op)
}

struct Lanes;

impl WithSimd for Lanes {
    type Output = usize;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) -> usize {
        S::F64_LANES
    }
}
