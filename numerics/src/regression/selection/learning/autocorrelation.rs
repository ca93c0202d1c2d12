//! Correlation of what kernel and noise leave unexplained, between nearest neighbours.
//!
//! A fine ripple between a few points a wave is more likely noise than a reason for a short length scale, if
//! another feature of the values is long. Noise is independent from point to point, a ripple is not.

use std::collections::HashMap;

use super::Observed;
use crate::regression::solver::Autocorrelation;

/// Least number of deviations by which the coefficient of independent residuals is exceeded. Products of
/// normal numbers have longer tails than normal numbers, so this is more than it would be for a sum of these.
const SIGNIFICANT: f64 = 4.0;

/// Pairs of nearest neighbours among some points.
pub(super) struct Pairs {
    /// Pairs of rows, the smaller one first, each once.
    rows: Vec<[usize; 2]>,
}

impl Pairs {
    /// Pairs each of these points with its nearest neighbour, where that is one of them too. `points` are the
    /// first points at their positions, by row.
    pub(super) fn of(observed: &Observed<'_>, points: &[usize]) -> Self {
        let row_of: HashMap<usize, usize> =
            points.iter().enumerate().map(|(row, &point)| (point, row)).collect();
        let nearest = |(row, &point): (usize, &usize)| {
            let near = observed.sampling.neighbours().nearest_positions(observed.cloud.point(point), 2);
            let other = near.into_iter().map(|neighbour| neighbour.point).find(|&other| other != point)?;
            row_of.get(&other).map(|&other| [row.min(other), row.max(other)])
        };
        let mut rows: Vec<[usize; 2]> = points.iter().enumerate().filter_map(nearest).collect();
        rows.sort_unstable();
        rows.dedup();
        Self { rows }
    }

    /// Returns the autocorrelation of whitened values `[k, n]`, if it is positive and beyond chance.
    ///
    /// The coefficient is `Σ z_i z_j / Σ ½(z_i² + z_j²)` over the pairs: that of Moran (1950, Biometrika 37)
    /// with weight 1 for nearest neighbours. Of m pairs of independent values, its deviation is `1/√m`. More
    /// lists are no more pairs, since what they have in common is not known.
    pub(super) fn autocorrelation(&self, whitened: &[f64], n: usize) -> Option<Autocorrelation> {
        let of_list = |list: &[f64]| {
            let of_pair =
                |&[i, j]: &[usize; 2]| (list[i] * list[j], 0.5 * (list[i].powi(2) + list[j].powi(2)));
            self.rows.iter().map(of_pair).fold((0.0, 0.0), |(a, b), (c, d)| (a + c, b + d))
        };
        let (products, squares) =
            whitened.chunks_exact(n).map(of_list).fold((0.0, 0.0), |(a, b), (c, d)| (a + c, b + d));
        let n_pairs = self.rows.len();
        let coefficient = products / squares;
        (coefficient * (n_pairs as f64).sqrt() > SIGNIFICANT)
            .then_some(Autocorrelation { coefficient, n_pairs })
    }
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
        let observed = Observed { cloud: &cloud, sampling: &sampling, values, noise, mean };
        let points: Vec<usize> = (0..N).collect();
        Pairs::of(&observed, &points).autocorrelation(&list.repeat(n_lists), N)
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
