//! The profile of a family at distance 0.

use pulp::{Simd, WithSimd};

use super::family::Family;
use super::profile::Distances;
use crate::machine::instruction_set::Portable;
use crate::machine::registers::Block;

impl Family {
    /// Returns φ, φ′ and φ″ at 0, for families that have them there.
    pub(crate) fn profile_at_zero(self) -> [f64; 3] {
        Portable {}.vectorize(AtZero(self))
    }
}

/// Evaluates the profile of a family at a block of distances 0.
struct AtZero(Family);

impl WithSimd for AtZero {
    type Output = [f64; 3];

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let mut found = [Block::ZERO; 3];
        let lists = found.each_mut().map(Block::registers_mut::<S>);
        self.0.profiles(Distances { simd, inverse_square_length: 1.0, lists });
        found.map(|block| block.0[0])
    }
}
