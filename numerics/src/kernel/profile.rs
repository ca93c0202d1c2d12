//! The profile φ of a family with its derivatives, and their evaluation for a list of distances.

use pulp::Simd;

use crate::machine::registers::{IN_FLIGHT, Pack};

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

/// The profiles of a family: those of its formula, or of the one that its parameter selects.
pub(super) trait Profiles {
    /// Overwrites squared distances by φ, and the other lists by φ′ and φ″, as [`Distances`] describes.
    fn evaluate<S: Simd, const N: usize>(self, distances: Distances<'_, S, N>);

    /// Calls `terms` with φ of each pack of distances, in one loop that keeps it in registers.
    fn fold<S: Simd>(self, inverse_square_length: f64, terms: &mut impl Terms<S>);
}

/// A sum over packs of pairs whose terms need φ alone.
pub(crate) trait Terms<S: Simd> {
    /// Number of packs.
    fn n_packs(&self) -> usize;

    /// Squared distances of a pack of pairs, unit L².
    fn squared_distances(&self, at: usize) -> Pack<S>;

    /// Adds the terms of a pack.
    fn add(&mut self, at: usize, phi: Pack<S>);
}

impl<P: Profile> Profiles for P {
    #[inline(always)]
    fn evaluate<S: Simd, const N: usize>(self, distances: Distances<'_, S, N>) {
        let Distances { simd, inverse_square_length, lists } = distances;
        for at in 0..lists[0].len() / IN_FLIGHT {
            let profile = self.at(Pack::read(simd, lists[0], at) * inverse_square_length);
            for order in 0..N {
                profile[order].write(lists[order], at);
            }
        }
    }

    #[inline(always)]
    fn fold<S: Simd>(self, inverse_square_length: f64, terms: &mut impl Terms<S>) {
        for at in 0..terms.n_packs() {
            let [phi, ..] = self.at(terms.squared_distances(at) * inverse_square_length);
            terms.add(at, phi);
        }
    }
}

/// Squared distances whose profiles are evaluated up to derivative `N − 1`.
pub(crate) struct Distances<'a, S: Simd, const N: usize> {
    pub simd: S,
    /// 1/ℓ², unit 1/L².
    pub inverse_square_length: f64,
    /// Lists of equally many registers, a multiple of [`IN_FLIGHT`]. The first holds the squared distances,
    /// unit L², and takes φ. The others take φ′ and φ″.
    pub lists: [&'a mut [S::f64s]; N],
}
