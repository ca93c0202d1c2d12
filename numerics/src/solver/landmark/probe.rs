//! An estimate of how many landmarks a kernel needs, from a sample of the points.

use faer::{Mat, MatRef};

use super::pivots::{shuffled, tolerance};
use super::rows::{Coordinates, Rows};
use crate::error::Result;
use crate::kernel::Kernel;
use crate::machine::price::Price;
use crate::observer::Observer;
use crate::points::cloud::Cloud;
use crate::solver::dense::Pivoting;
use crate::sums::price::pair_flops;
use crate::sums::regularization::Regularization;

/// Most points of the sample, and most landmarks among them. The probe takes the square of the landmarks for
/// each point of the sample.
const MOST_SAMPLED: usize = 2_000;
const MOST_LANDMARKS: usize = 1_200;

/// Points of the sample, over the largest number of landmarks that is of use. A sample of which every point
/// is a landmark tells nothing about the others.
const SAMPLED_PER_LANDMARK: usize = 2;

/// Least number of points of the sample, so that one block of pivots leaves some over.
const LEAST_SAMPLED: usize = 512;

/// Points outside the sample at which the diagonal that remains is evaluated.
const CHECKED: usize = 128;

/// Factor by which the landmarks predicted from a few pivots must exceed the largest useful number before the
/// probe gives up. Until the pivots cover the cloud, the diagonal falls more slowly than later.
const DOUBT: f64 = 3.0;

/// Estimates how many landmarks all points need. `None` if they are more than `most`.
///
/// The diagonal that remains falls from k₀ to the tolerance τ, roughly by equal factors for equal numbers of
/// landmarks. So r landmarks of a sample, which leave ρ at points outside it, predict for all points
///
/// ```text
/// r ln(k₀/τ) / ln(k₀/ρ)
/// ```
///
/// # Errors
/// [`crate::error::NumericsError::Cancelled`].
pub fn expected_landmarks(
    cloud: &Cloud,
    kernel: &Kernel,
    noise: &Regularization,
    most: usize,
    observer: &dyn Observer,
) -> Result<Option<usize>> {
    let (n, most) = (cloud.n_points(), most.min(MOST_LANDMARKS));
    let n_sampled = n_sampled(n, most);
    if most == 0 || n_sampled + CHECKED > n {
        return Ok(None);
    }
    // Pivots of equal size are taken in their order, so the first ones are to lie everywhere.
    let drawn = shuffled(n, n_sampled + CHECKED);
    let (sample, others) = (cloud.select(&drawn[..n_sampled]), cloud.select(&drawn[n_sampled..]));
    let (tolerance, exact) = (tolerance(n, kernel, noise), Regularization::Uniform(0.0));
    let mut columns = vec![0.0; sample.n_points() * most];
    let pivoting = Pivoting::new(&sample, kernel, &exact, &mut columns);
    let pivots = pivoting.to(tolerance).doubting(DOUBT).run(most, observer)?;
    if !pivots.is_complete || pivots.rank == 0 {
        return Ok(None);
    }
    let rank = pivots.rank;
    let l = MatRef::from_column_major_slice(&columns, sample.n_points(), most);
    let l11 = Mat::from_fn(rank, rank, |i, j| if i < j { 0.0 } else { l[(i, j)] });
    let landmarks = sample.select(&pivots.order[..rank]);
    let rows = Rows::of(pivots.order[..rank].to_vec(), landmarks, l11, Coordinates::Whitened);
    let remaining = rows.largest_remaining(kernel, &others, observer)?;
    let expected = rank as f64 / tolerance.progress(remaining, rank, kernel.at_zero());
    Ok((expected <= most as f64).then_some(expected as usize))
}

/// Largest price of [`expected_landmarks`].
pub fn probe_price(n_points: usize, dimension: usize, most: usize) -> Price {
    let most = most.min(MOST_LANDMARKS);
    let (sampled, rank) = (n_sampled(n_points, most) as f64, most as f64);
    let flops = sampled * rank * (pair_flops(dimension, 0) + rank) + CHECKED as f64 * rank * rank;
    // The sample is drawn by a key for each point.
    let n_numbers = 2 * n_points + n_sampled(n_points, most) * (most + dimension + 2) + 3 * most * most;
    Price::of_numbers(n_numbers, flops + 4.0 * n_points as f64)
}

fn n_sampled(n_points: usize, most: usize) -> usize {
    (SAMPLED_PER_LANDMARK * most).clamp(LEAST_SAMPLED, MOST_SAMPLED).min(n_points)
}
