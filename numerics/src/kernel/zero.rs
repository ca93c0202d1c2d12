//! The profile of a family at distance 0.

use pulp::{Simd, WithSimd};

use super::family::Family;
use super::profile::Pairs;
use crate::machine::instruction_set::Portable;
use crate::machine::registers::{Block, Pack};

impl Family {
    /// Returns φ, φ′ and φ″ at 0, for families that have them there.
    pub(crate) fn profile_at_zero(self) -> [f64; 3] {
        Portable {}.vectorize(AtZero(self))
    }
}

/// Evaluates the profile of a family over one block of pairs at distance 0.
struct AtZero(Family);

impl WithSimd for AtZero {
    type Output = [f64; 3];

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let mut found = [Block::ZERO; 3];
        self.0.profiles(Zero { simd, found: &mut found });
        found.map(|block| block.0[0])
    }
}

struct Zero<'a, S: Simd> {
    simd: S,
    found: &'a mut [Block; 3],
}

impl<S: Simd> Pairs<S> for Zero<'_, S> {
    type Others = ();

    #[inline(always)]
    fn pack(&mut self, _at: usize) -> (Pack<S>, ()) {
        (Pack::splat(self.simd, 0.0), ())
    }

    #[inline(always)]
    fn take(&mut self, at: usize, (): (), profile: [Pack<S>; 3]) {
        for (block, value) in self.found.iter_mut().zip(profile) {
            value.store(block, at);
        }
    }
}
