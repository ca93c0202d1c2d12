//! Passes over lists of squared distances that covariances overwrite in place.

use pulp::Simd;

use super::{Distances, Family};
use crate::machine::registers::Pack;

/// Constants of the covariance of a squared distance, which is `variance · φ`, or 0 where φ is below `least`.
#[derive(Clone, Copy)]
pub(crate) struct Scaling {
    /// 1/ℓ², unit 1/L².
    pub inverse_square_length: f64,
    pub variance: f64,
    pub least: f64,
}

impl Scaling {
    /// Overwrites squared distances, the first of these lists, by covariances, and the others by φ′ and φ″.
    #[inline(always)]
    pub(crate) fn covariances<S: Simd, const N: usize>(
        self,
        simd: S,
        family: Family,
        mut lists: [&mut [S::f64s]; N],
    ) {
        let Self { inverse_square_length, variance, least } = self;
        let reborrowed = lists.each_mut().map(|list| &mut **list);
        family.profiles(Distances { simd, inverse_square_length, lists: reborrowed });
        for at in 0..lists[0].len() {
            let correlation = Pack::<S, 1>::read(simd, lists[0], at);
            (correlation.select_below(least, 0.0, variance) * correlation).write(lists[0], at);
        }
    }
}
