//! Noise of the points of a cloud, estimated from the cloud alone.

use rayon::prelude::*;

use super::cloud::Cloud;
use super::patch::Patch;
use super::quadric::{Quadric, n_coefficients};
use super::sampling::{Sampling, median};
use crate::error::Result;
use crate::observer::Observer;

/// Residual degrees of freedom of the smaller neighbourhood. They are few, so that the neighbourhood stays
/// small against the curvature of coarse clouds.
const DEGREES_OF_FREEDOM: usize = 2;

/// Number of points examined, or up to twice as many. The median of 1,000 estimates scatters by 4 %.
const MAX_SITES: usize = 1000;

/// Estimates the standard deviation of the noise of the points across their surface, unit L. Returns 0 where
/// no noise shows, and for clouds that are too small.
///
/// At every examined point one quadric is fitted to the k₁ nearest points and another to the 2k₁ nearest.
/// Both residual variances s² contain the noise variance σ². They also contain what a quadric misses of a
/// smooth surface: it grows like the distance cubed, so its part in s² grows by ρ = 2^{6/(d−1)}. The
/// combination `(ρ s₁² − s₂²)/(ρ − 1)` cancels that part.
///
/// The median over the points ignores edges and outliers. It is divided by the median of a χ² variable over
/// its degrees of freedom (Wilson and Hilferty 1931). The estimate is within a tenth up to σ = 0.3 spacings.
/// Beyond, it is too low, because the neighbourhoods are no longer those of the surface.
///
/// # Errors
/// `NumericsError::Cancelled`.
pub fn estimate_noise(cloud: &Cloud, sampling: &Sampling, observer: &dyn Observer) -> Result<f64> {
    let (n, d) = (cloud.n_points(), cloud.dimension());
    if d < 2 {
        return Ok(0.0);
    }
    let n_small = n_coefficients(d) + DEGREES_OF_FREEDOM;
    let n_large = 2 * n_small;
    if n < 2 * n_large {
        return Ok(0.0);
    }
    let growth = 2f64.powf(6.0 / (d - 1) as f64);
    let variance_at = |point: usize| {
        let x = cloud.point(point);
        let nearest = sampling.neighbours().nearest_positions(x, n_large);
        let variance = |count: usize| {
            let nearest = nearest.get(..count)?;
            let patch = Patch::of(cloud, x, nearest.iter().map(|found| found.point))?;
            Some((Quadric::of(&patch)?.residual * patch.radius).powi(2))
        };
        Some((growth * variance(n_small)? - variance(n_large)?) / (growth - 1.0))
    };
    let look_around = |site: usize| {
        observer.checkpoint()?;
        Ok(variance_at(site))
    };
    let sites = sampling.of_every_spacing(MAX_SITES);
    let variances: Vec<Option<f64>> = sites.into_par_iter().map(look_around).collect::<Result<_>>()?;
    let correction = (1.0 - 2.0 / (9.0 * DEGREES_OF_FREEDOM as f64)).powi(3);
    let variance = median(variances.into_iter().flatten().collect());
    Ok(variance.map_or(0.0, |variance| (variance.max(0.0) / correction).sqrt()))
}

/// Flops of [`estimate_noise`]: searches, and two quadrics each by orthogonal factorization.
pub fn noise_flops(n_points: usize, dimension: usize) -> f64 {
    let (n, sites) = (n_points as f64, n_points.min(2 * MAX_SITES) as f64);
    let visited = n.min(200.0 * 2f64.powi(dimension.min(60) as i32));
    let (n_columns, d) = (n_coefficients(dimension.max(2)) as f64, dimension as f64);
    let n_rows = 2.0 * (n_columns + DEGREES_OF_FREEDOM as f64);
    sites * (visited * (3.0 * d + 10.0) + 6.0 * n_rows * n_columns * n_columns)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::observer::Unobserved;
    use crate::testing::{circle, fibonacci_sphere};

    fn noise_of(cloud: &Cloud) -> f64 {
        estimate_noise(cloud, &Sampling::of(cloud, &Unobserved).unwrap(), &Unobserved).unwrap()
    }

    /// Returns the cloud with noise of mean 0 and standard deviation `sigma` on every coordinate: cosines of
    /// large angles.
    fn noisy(cloud: &Cloud, sigma: f64) -> Cloud {
        let moved =
            |(i, x): (usize, &f64)| x + sigma * 2f64.sqrt() * (12.9898 * (i as f64 + 1.0).powi(2)).cos();
        Cloud::new(cloud.coordinates().iter().enumerate().map(moved).collect(), cloud.dimension()).unwrap()
    }

    #[test]
    fn exact_clouds_have_next_to_no_noise() {
        for cloud in [circle(60), fibonacci_sphere(400)] {
            let noise = noise_of(&cloud);
            // The spacings are 0.1 and 0.18.
            assert!(noise < 1e-3, "{noise}");
        }
    }

    #[test]
    fn noise_is_found_to_a_fifth() {
        for cloud in [circle(400), fibonacci_sphere(1500)] {
            for sigma in [0.002, 0.005] {
                let cloud = noisy(&cloud, sigma);
                let noise = noise_of(&cloud);
                // The median of 400 estimates with two degrees of freedom scatters by some 7 %.
                assert!((noise / sigma - 1.0).abs() < 0.2, "{sigma}: {noise}");
            }
        }
    }

    #[test]
    fn noise_scales_with_the_cloud() {
        let cloud = noisy(&fibonacci_sphere(300), 0.01);
        let scaled = Cloud::new(cloud.coordinates().iter().map(|x| 1e-3 * x).collect(), 3).unwrap();
        let [a, b] = [&cloud, &scaled].map(noise_of);
        assert!((1e3 * b / a - 1.0).abs() < 1e-9);
    }
}
