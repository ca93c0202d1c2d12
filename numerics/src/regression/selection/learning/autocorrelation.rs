//! Correlation of what kernel and noise leave unexplained, between near points.
//!
//! A fine ripple with a few points a wave is more likely noise than a reason for a short length scale, if
//! another feature of the values is long. Noise is independent from point to point, a ripple is not.

use std::collections::HashMap;

use super::ObservedCloud;
use crate::regression::solver::Autocorrelation;

/// Least number of deviations by which the coefficient of independent residuals is exceeded. Products of
/// normal numbers have longer tails than normal numbers, so this is more than it would be for a sum of these.
const SIGNIFICANT: f64 = 4.0;

/// Number of rings of neighbours. On a line of even spacing they are one, two and three spacings away. At
/// some of these distances a ripple of two points a wave and more has equal or opposite values.
const RINGS: usize = 3;

/// Least mean square of residuals, in deviations, whose correlation counts. Where a kernel is rougher than
/// most of the values, so that it suits one place, residuals are correlated, but deviations are long enough.
const LEAST_MEAN_SQUARE: f64 = 0.7;

/// Pairs of rows at some distance from each other, the smaller one first, each once.
type Pairs = Vec<[usize; 2]>;

/// Pairs of near points among some.
pub(super) struct Rings([Pairs; RINGS]);

impl Rings {
    /// Pairs each of these points with its neighbours of the ranks 1, 2d + 1 and 4d + 1, where they are among
    /// them too. `points` are the first points at their positions, by row.
    pub(super) fn of(observed: &ObservedCloud<'_>, points: &[usize]) -> Self {
        let row_of: HashMap<usize, usize> =
            points.iter().enumerate().map(|(row, &point)| (point, row)).collect();
        let width = 2 * observed.cloud.dimension();
        let mut rings: [Pairs; RINGS] = Default::default();
        for (row, &point) in points.iter().enumerate() {
            let count = (RINGS - 1) * width + 2;
            let near = observed.sampling.neighbours().nearest_positions(observed.cloud.point(point), count);
            // The first one is the point itself.
            for (pairs, neighbour) in rings.iter_mut().zip(near.iter().skip(1).step_by(width)) {
                let other = row_of.get(&neighbour.point).filter(|&&other| other != row);
                pairs.extend(other.map(|&other| [row.min(other), row.max(other)]));
            }
        }
        for pairs in &mut rings {
            pairs.sort_unstable();
            pairs.dedup();
        }
        Self(rings)
    }

    /// Returns the autocorrelation of whitened values `[k, n]` that is farthest beyond chance, if one is.
    ///
    /// `mean_square` is that of the values in deviations. Of m pairs of independent values, the deviation of
    /// a coefficient is `1/√m`. More lists are no more pairs, since what they have in common is not known.
    pub(super) fn autocorrelation(
        &self,
        whitened: &[f64],
        n: usize,
        mean_square: f64,
    ) -> Option<Autocorrelation> {
        let of_ring = |pairs: &Pairs| {
            let coefficient = coefficient(pairs, whitened, n);
            Autocorrelation { coefficient, n_pairs: pairs.len() }
        };
        let significance = |of: &Autocorrelation| of.coefficient.abs() * (of.n_pairs as f64).sqrt();
        let counts = mean_square >= LEAST_MEAN_SQUARE;
        let found = self.0.iter().map(of_ring).filter(|of| counts && significance(of) > SIGNIFICANT);
        found.max_by(|a, b| significance(a).total_cmp(&significance(b)))
    }
}

/// Returns `Σ z_i z_j / Σ ½(z_i² + z_j²)` over pairs of rows: the coefficient of Moran (1950, Biometrika 37)
/// with weight 1 for each pair. NaN if all are 0.
fn coefficient(pairs: &Pairs, whitened: &[f64], n: usize) -> f64 {
    let of_list = |list: &[f64]| {
        let of_pair = |&[i, j]: &[usize; 2]| (list[i] * list[j], 0.5 * (list[i].powi(2) + list[j].powi(2)));
        pairs.iter().map(of_pair).fold((0.0, 0.0), |(a, b), (c, d)| (a + c, b + d))
    };
    let (products, squares) =
        whitened.chunks_exact(n).map(of_list).fold((0.0, 0.0), |(a, b), (c, d)| (a + c, b + d));
    products / squares
}

#[cfg(test)]
mod tests {
    use super::super::Noise;
    use super::*;
    use crate::observer::Unobserved;
    use crate::points::cloud::Cloud;
    use crate::points::sampling::Sampling;
    use crate::regression::solver::trend::Mean;
    use crate::testing::Random;

    const N: usize = 400;

    /// Returns the autocorrelation of residuals at random places of an interval, a function of place and
    /// noise.
    fn found(n_lists: usize, residual: impl Fn(f64, f64) -> f64) -> Option<Autocorrelation> {
        let mut random = Random(3);
        let cloud = Cloud::new((0..N).map(|_| random.uniform()).collect(), 1).unwrap();
        let list: Vec<f64> = cloud.points().map(|x| residual(x[0], random.normal())).collect();
        let sampling = Sampling::of(&cloud, &Unobserved).unwrap();
        let (values, noise, mean) = (&list[..], Noise::Unknown, Mean::Zero);
        let observed = ObservedCloud { cloud: &cloud, sampling: &sampling, values, noise, mean };
        let points: Vec<usize> = (0..N).collect();
        Rings::of(&observed, &points).autocorrelation(&list.repeat(n_lists), N, 1.0)
    }

    #[test]
    fn a_wave_is_correlated_and_noise_is_not() {
        assert_eq!(found(1, |_, noise| noise), None);
        // Four points a wave: nearest neighbours are an eighth of a wave apart in the mean.
        let wave = |x: f64, noise: f64| (100.0 * std::f64::consts::TAU * x).sin() + 0.1 * noise;
        let Autocorrelation { coefficient, n_pairs } = found(1, wave).unwrap();
        assert!(
            (0.4..0.9).contains(&coefficient) && (N / 2..N).contains(&n_pairs),
            "{coefficient} {n_pairs}"
        );
    }

    #[test]
    fn equal_lists_are_no_evidence_beyond_one() {
        let faint = |x: f64, noise: f64| (100.0 * std::f64::consts::TAU * x).sin() + 3.0 * noise;
        for n_lists in [1, 16] {
            assert_eq!(found(n_lists, |_, noise| noise), None);
            assert_eq!(found(n_lists, faint), None);
        }
    }

    #[test]
    fn residuals_that_are_all_0_are_not_correlated() {
        assert_eq!(found(1, |_, _| 0.0), None);
    }
}
