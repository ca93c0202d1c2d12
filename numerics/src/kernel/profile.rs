//! A profile φ and its derivatives, and loops that are compiled with one.

use pulp::Simd;

use crate::machine::registers::Pack;

/// A positive number so small that no scaled distance of distinct points comes near it. Profiles whose derivatives are
/// unbounded at 0 divide by at least this, so that they stay finite and D = 0 annihilates them there.
pub(super) const TINY: f64 = 1e-100;

/// Squared scaled distance beyond which profiles do not change any more in a way that shows.
pub(crate) const HUGE: f64 = 1e300;

/// √q and 1/√q for q up to a bound of at most [`HUGE`], the root at least [`TINY`].
#[inline(always)]
pub(crate) fn distance_and_inverse<S: Simd, const N: usize>(
    q: Pack<S, N>,
    at_most: f64,
) -> (Pack<S, N>, Pack<S, N>) {
    q.at_least(TINY * TINY).at_most(at_most).sqrt_and_inverse()
}

/// A formula.
pub(super) trait Profile {
    /// φ, φ′, φ″ at q, branch-free.
    fn at<S: Simd>(&self, q: Pack<S>) -> [Pack<S>; 3];
}

/// What a family runs over pairs: its formula, or the one of its formulas that its parameter asks for.
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
/// Two methods of a trait and not two closures, because only a method can be made to inline: what is not compiled into
/// the function that has the instruction set falls back to a call per instruction.
pub(crate) trait Pairs<S: Simd> {
    /// What [`Pairs::take`] wants to know of the pairs beside their profile.
    type Others;

    /// q of pack `at`.
    fn pack(&mut self, at: usize) -> (Pack<S>, Self::Others);

    /// Takes φ, φ′, φ″ at that q.
    fn take(&mut self, at: usize, others: Self::Others, profile: [Pack<S>; 3]);
}

/// A loop, compiled with one profile.
#[inline(always)]
fn each<S: Simd>(mut pairs: impl Pairs<S>, profile: impl Profile) {
    for at in 0..Pack::<S>::PER_BLOCK {
        let (q, others) = pairs.pack(at);
        pairs.take(at, others, profile.at(q));
    }
}
