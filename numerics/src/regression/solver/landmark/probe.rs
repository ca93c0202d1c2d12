//! An estimate of how many landmarks a kernel needs, from a sample of the points.

use super::pivots::{shuffled, tolerance};
use crate::error::Result;
use crate::kernel::Kernel;
use crate::machine::price::Price;
use crate::observer::Observer;
use crate::points::cloud::Cloud;
use crate::regression::solver::dense::{Pivoting, Step};
use crate::regression::sums::price::pair_flops;
use crate::regression::sums::regularization::Regularization;

/// Most points of the sample, and most landmarks of use. The probe takes up to the square of the landmarks
/// for each point of the sample.
const MOST_SAMPLED: usize = 2_000;
const MOST_LANDMARKS: usize = 1_200;

/// Points of the sample, over the largest number of landmarks that is of use. A sample of which every second
/// point is a landmark tells little about the others. Nor are landmarks of use if every second point is one.
const SAMPLED_PER_LANDMARK: usize = 2;

/// Least number of points of the sample.
const LEAST_SAMPLED: usize = 512;

/// Progress at which the number of landmarks is predicted. On ten clouds of one to three dimensions it was
/// then within a quarter of what all points needed, mostly within a tenth, and rarely above it.
const ENOUGH: f64 = 0.5;

/// Number of pivots from which the probe may give up, and factor by which the landmarks predicted must exceed
/// the largest useful number. Until the pivots cover the cloud, the diagonal falls more slowly than later.
const COVERING: usize = 100;
const DOUBT: f64 = 2.0;

/// Bounds of the exponent of a fall. Between two blocks it may be anything.
const EXPONENTS: [f64; 2] = [0.25, 3.0];

/// Progress of pivoting at a rank: the logarithm of what the diagonal has fallen by, over that of all that it
/// has to fall by.
#[derive(Clone, Copy)]
struct Fall {
    rank: f64,
    progress: f64,
}

/// Predicts the rank at which progress is 1, from earlier falls and the last one, whose progress is positive.
///
/// Progress is taken as a power of the rank: log-eigenvalues of smooth kernels in d dimensions fall with
/// `r^{1/d}`, those of rough ones with log r. The exponent is that from half of the last rank on.
fn predicted_rank(falls: &[Fall], last: Fall) -> f64 {
    let half = falls.iter().find(|fall| 2.0 * fall.rank >= last.rank && fall.progress > 0.0);
    let exponent = match half {
        Some(half) if half.rank < last.rank => {
            (last.progress / half.progress).ln() / (last.rank / half.rank).ln()
        }
        _ => 1.0,
    };
    let [least, most] = EXPONENTS;
    last.rank * last.progress.powf(-1.0 / exponent.clamp(least, most))
}

/// Estimates how many landmarks all points need. `None` if they are more than `most`, or than is of use.
///
/// A sample of the points is pivoted until its diagonal has fallen halfway, in logarithms, from k₀ to what
/// may remain. The rest is predicted.
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
    let n = cloud.n_points();
    let most = of_use(n, most);
    if most == 0 {
        return Ok(None);
    }
    // Pivots of equal size are taken in their order, so the first ones are to lie everywhere.
    let sample = cloud.select(&shuffled(n, n_sampled(n, most)));
    let (tolerance, exact) = (tolerance(n, kernel, noise), Regularization::Uniform(0.0));
    let mut columns = vec![0.0; sample.n_points() * most];
    let mut pivoting = Pivoting::new(&sample, kernel, &exact, &mut columns).to(tolerance);
    let mut falls = Vec::new();
    let expected = loop {
        match pivoting.step(most, observer)? {
            Step::Complete => break pivoting.rank() as f64,
            Step::Full => return Ok(None),
            Step::Further => {}
        }
        let rank = pivoting.rank();
        let progress = tolerance.progress(pivoting.largest_remaining(), rank, kernel.at_zero());
        let last = Fall { rank: rank as f64, progress };
        let predicted = if progress > 0.0 { predicted_rank(&falls, last) } else { f64::INFINITY };
        if progress >= ENOUGH {
            break predicted;
        }
        if rank >= COVERING && predicted > DOUBT * most as f64 {
            return Ok(None);
        }
        falls.push(last);
    };
    Ok((expected <= most as f64).then_some(expected as usize))
}

/// Largest price of [`expected_landmarks`].
pub fn probe_price(n_points: usize, dimension: usize, most: usize) -> Price {
    let most = of_use(n_points, most);
    let (sampled, rank) = (n_sampled(n_points, most) as f64, most as f64);
    let flops = sampled * rank * (pair_flops(dimension, 0) + rank);
    // The sample is drawn by a key for each point.
    let n_numbers = 2 * n_points + n_sampled(n_points, most) * (most + dimension + 2);
    Price::of_numbers(n_numbers, flops + 4.0 * n_points as f64)
}

/// Largest number of landmarks that is of use and can be predicted, if a caller has use for `most`.
fn of_use(n_points: usize, most: usize) -> usize {
    most.min(MOST_LANDMARKS).min(n_points / SAMPLED_PER_LANDMARK)
}

fn n_sampled(n_points: usize, most: usize) -> usize {
    (SAMPLED_PER_LANDMARK * most).clamp(LEAST_SAMPLED, MOST_SAMPLED).min(n_points)
}
