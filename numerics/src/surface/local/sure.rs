//! Least ratio of a curvature to its deviation that counts as known, chosen from the ratios all over a cloud.

use crate::machine::normal::cumulative;

/// Ratio of a curvature to its deviation from which the curvature counts as known: three deviations are half
/// of it. Of the curvatures that pass and are not bent, less than 1 % are off by half, at any noise
/// (docs/error-bars.md).
const SURE: f64 = 6.0;

/// Share of a cloud that must pass [`SURE`] for that bound to be kept. If fewer pass, the bound is raised:
/// among many uncertain curvatures some pass by luck.
const FEW: f64 = 0.3;

/// Share of the passing curvatures that may pass by luck while off by half.
const LUCKY: f64 = 0.02;

/// Standard deviation of a measured ratio about the true one. It would be 1 if deviations were known. They
/// are estimated from a few dozen points, and those that come out too small pass first.
const SPREAD: f64 = 2.0;

/// Share of a cloud that must pass the raised bound. If fewer pass, they are a few that are wrong in ways of
/// their own, and none is accepted.
const LEAST_SHARE: f64 = 0.02;

/// Step between the bounds that are tried, up to four times [`SURE`].
const STEP: f64 = 0.5;

/// Most ratios that are looked at. Larger clouds are thinned evenly.
const MAX_RATIOS: usize = 4096;

/// Returns the least ratio of a curvature to its deviation that is sure, from the ratios all over a cloud. It
/// is infinite if none is sure.
///
/// A measured ratio is z + ε, z the true one. It passes a bound t while off by half of the truth for ε beyond
/// both t − z and z/2. The measured ratios stand for the true ones.
///
/// Of the 243 noisy clouds of docs/error-bars.md, 77 have more than 2 % of curvatures off by half without a
/// flag under the bound of 6 alone. Under this bound 3 have.
pub fn least_ratio(ratios: &[f64]) -> f64 {
    let share =
        |bound: f64| ratios.iter().filter(|&&ratio| ratio >= bound).count() as f64 / ratios.len() as f64;
    if ratios.is_empty() || share(SURE) >= FEW {
        return SURE;
    }
    let some: Vec<f64> = ratios.iter().step_by(ratios.len().div_ceil(MAX_RATIOS)).copied().collect();
    let beyond = |x: f64| cumulative(-x / SPREAD);
    let is_sure = |&bound: &f64| {
        let passing: f64 = some.iter().map(|z| beyond(bound - z)).sum();
        let lucky: f64 = some.iter().map(|z| beyond((bound - z).max(0.5 * z))).sum();
        lucky <= LUCKY * passing
    };
    let mut bounds = (0..=(3.0 * SURE / STEP) as usize).map(|step| SURE + STEP * step as f64);
    bounds.find(is_sure).filter(|&bound| share(bound) >= LEAST_SHARE).unwrap_or(f64::INFINITY)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Random;

    /// Returns measured ratios around one true ratio.
    fn measured(n: usize, truth: f64, random: &mut Random) -> Vec<f64> {
        (0..n).map(|_| truth + random.normal()).collect()
    }

    #[test]
    fn where_many_are_sure_nothing_is_asked_of_them() {
        let mut random = Random(1);
        assert_eq!(least_ratio(&measured(1000, 8.0, &mut random)), SURE);
        assert_eq!(least_ratio(&measured(1000, 5.6, &mut random)), SURE);
        assert_eq!(least_ratio(&[]), SURE);
    }

    #[test]
    fn the_lucky_of_many_that_are_not_sure_do_not_pass() {
        for truth in [2.0, 3.0, 4.0, 4.5] {
            let ratios = measured(5000, truth, &mut Random(2));
            let bound = least_ratio(&ratios);
            let n_passing = ratios.iter().filter(|&&ratio| ratio >= bound).count();
            assert_eq!(n_passing, 0, "{truth}: beyond {bound}");
        }
    }

    #[test]
    fn an_edge_of_a_flat_cloud_passes() {
        let mut random = Random(3);
        let mut ratios = measured(5000, 0.5, &mut random);
        ratios.extend(measured(200, 20.0, &mut random));
        let bound = least_ratio(&ratios);
        assert!(ratios[5000..].iter().all(|&ratio| ratio >= bound), "{bound}");
    }
}
