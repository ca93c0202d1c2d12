//! How sure a curvature has to be in a cloud in which hardly any is.

use crate::machine::normal::cumulative;

/// Curvature over its deviation from which it counts as known: three deviations are half of it. Of those that
/// pass, and are not bent, less than 1 % are off by half, at any noise (docs/error-bars.md).
const SURE: f64 = 6.0;

/// Where a smaller share of a cloud passes, it is asked who does: of many that are not sure some pass by luck.
const FEW: f64 = 0.3;

/// The share of those that pass which may be there by luck, off by half.
const LUCKY: f64 = 0.02;

/// Deviation of a measured ratio about the true one. It would be 1 if deviations were known; they are estimated from a
/// few dozen points, and those that come out too small pass first.
const SPREAD: f64 = 2.0;

/// Where a smaller share than this passes after all, it is a few that are wrong in ways of their own, and none does.
const LEAST_SHARE: f64 = 0.02;

/// Ratios that are tried, in steps of this up to four times [`SURE`].
const STEP: f64 = 0.5;

/// Ratios that are looked at.
const MAX_RATIOS: usize = 4096;

/// The least ratio of a curvature to its deviation that is sure, from the ratios all over a cloud; infinite if
/// none is.
///
/// With true ratios z, a measured one is z + ε. It passes a bound t, and is off by half of what is true, for ε
/// beyond both t − z and z/2. The ratios that were measured stand for the true ones. Of 243 noisy clouds of
/// docs/error-bars.md 77 had more than 2 % that were off by half without a flag by the bound of 6 alone, and 3
/// have by this one.
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

    /// Measured ratios where all true ones are the same.
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
