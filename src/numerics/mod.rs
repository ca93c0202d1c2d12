//! The numerical heart: f64 in, f64 out.
//!
//! Pure by rule: no JSON, HTTP, async, environment, clock or global state. Heavy loops run on the rayon pool of the calling
//! thread; stages and cancellation pass through an [`observer::Observer`].

pub mod cloud;
pub mod defaults;
pub mod degeneracy;
pub mod duplicates;
pub mod error;
pub mod geometry;
pub mod interpolant;
pub mod jets;
pub mod kernel;
pub mod neighbours;
pub mod noise;
pub mod observer;
pub mod operators;
pub mod posterior;
pub mod regularization;
pub mod solver;
pub mod surface;

mod eigen;
mod examination;
mod gram;
pub(crate) mod heap;
mod nodes;
mod offset;
mod orientation;
mod patch;
mod rescue;
mod resolution;
mod shape;
mod simd;
#[cfg(test)]
mod testing;
mod vector;

/// The instruction set that the kernel loops run on, chosen at run time.
pub fn instruction_set() -> &'static str {
    struct Name;
    impl pulp::WithSimd for Name {
        type Output = &'static str;
        #[inline(always)]
        fn with_simd<S: pulp::Simd>(self, _simd: S) -> &'static str {
            match S::F64_LANES {
                8 => "AVX-512",
                4 => "AVX2 and FMA",
                2 => "128-bit vectors",
                _ => "portable",
            }
        }
    }
    pulp::Arch::new().dispatch(Name)
}
