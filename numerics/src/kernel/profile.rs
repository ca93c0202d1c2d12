//! The profile φ of a family with its derivatives, and the loops over pairs that are compiled for it.

use pulp::Simd;

use crate::machine::registers::Pack;

/// A positive number so small that no scaled distance of distinct points comes near it.
///
/// Profiles with unbounded derivatives at 0 divide by at least this number. So they stay finite, and D = 0
/// annihilates them there.
pub(super) const TINY: f64 = 1e-100;

/// Squared scaled distance beyond which profiles no longer change noticeably.
pub(crate) const HUGE: f64 = 1e300;

/// Returns √q and 1/√q, with q cut off at `at_most`, at most [`HUGE`], and the root at least [`TINY`].
#[inline(always)]
pub(crate) fn distance_and_inverse<S: Simd, const N: usize>(
    q: Pack<S, N>,
    at_most: f64,
) -> (Pack<S, N>, Pack<S, N>) {
    q.at_least(TINY * TINY).at_most(at_most).sqrt_and_inverse()
}

/// The formula of a profile.
pub(super) trait Profile {
    /// φ, φ′, φ″ at q, branch-free.
    fn at<S: Simd>(&self, q: Pack<S>) -> [Pack<S>; 3];
}

/// The loop of a family over pairs. It uses the family's formula, or the one that the parameter selects.
pub(super) trait Profiles {
    fn run<S: Simd>(self, pairs: impl Pairs<S>);
}

impl<P: Profile> Profiles for P {
    #[inline(always)]
    fn run<S: Simd>(self, pairs: impl Pairs<S>) {
        each(pairs, self);
    }
}

/// The body of a loop over the pairs of one query and a block of points.
///
/// It is two methods of a trait and not two closures, because only a method can be made to inline. Code that
/// is not compiled into the function that has the instruction set falls back to one call per instruction.
pub(crate) trait Pairs<S: Simd> {
    /// Data about a pack of pairs that [`Pairs::take`] needs besides their profile.
    type Others;

    /// Returns q of pack `at`, and the data for [`Pairs::take`].
    fn pack(&mut self, at: usize) -> (Pack<S>, Self::Others);

    /// Takes φ, φ′, φ″ of pack `at`, and what [`Pairs::pack`] returned with its q.
    fn take(&mut self, at: usize, others: Self::Others, profile: [Pack<S>; 3]);
}

/// Runs a loop over the packs of a block, compiled for one profile.
#[inline(always)]
fn each<S: Simd>(mut pairs: impl Pairs<S>, profile: impl Profile) {
    for at in 0..Pack::<S>::PER_BLOCK {
        let (q, others) = pairs.pack(at);
        pairs.take(at, others, profile.at(q));
    }
}
