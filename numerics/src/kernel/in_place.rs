//! Passes over a block of squared distances that covariances overwrite in place.

use pulp::Simd;

use super::Pairs;
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
    #[inline(always)]
    fn q<S: Simd>(self, simd: S, entries: &[S::f64s], at: usize) -> Pack<S> {
        Pack::read(simd, entries, at) * self.inverse_square_length
    }

    #[inline(always)]
    fn covariance<S: Simd>(self, correlation: Pack<S>) -> Pack<S> {
        correlation.select_below(self.least, 0.0, self.variance) * correlation
    }
}

/// A pass that overwrites squared distances by covariances.
pub(crate) struct Covariances<'a, S: Simd> {
    pub simd: S,
    pub entries: &'a mut [S::f64s],
    pub scaling: Scaling,
}

impl<S: Simd> Pairs<S> for Covariances<'_, S> {
    type Others = ();

    #[inline(always)]
    fn pack(&mut self, at: usize) -> (Pack<S>, ()) {
        (self.scaling.q(self.simd, self.entries, at), ())
    }

    #[inline(always)]
    fn take(&mut self, at: usize, (): (), profile: [Pack<S>; 3]) {
        self.scaling.covariance(profile[0]).write(self.entries, at);
    }
}

/// A pass that overwrites squared distances by covariances and also writes φ′ and φ″.
pub(crate) struct CovariancesAndSlopes<'a, S: Simd> {
    pub simd: S,
    pub entries: &'a mut [S::f64s],
    pub first: &'a mut [S::f64s],
    pub second: &'a mut [S::f64s],
    pub scaling: Scaling,
}

impl<S: Simd> Pairs<S> for CovariancesAndSlopes<'_, S> {
    type Others = ();

    #[inline(always)]
    fn pack(&mut self, at: usize) -> (Pack<S>, ()) {
        (self.scaling.q(self.simd, self.entries, at), ())
    }

    #[inline(always)]
    fn take(&mut self, at: usize, (): (), profile: [Pack<S>; 3]) {
        self.scaling.covariance(profile[0]).write(self.entries, at);
        profile[1].write(self.first, at);
        profile[2].write(self.second, at);
    }
}
