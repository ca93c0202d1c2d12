//! A look at how many landmarks a kernel needs, before any are chosen.

use super::pivots::{sampled, tolerance};
use crate::error::Result;
use crate::kernel::Kernel;
use crate::observer::Observer;
use crate::points::cloud::Cloud;
use crate::solver::dense::Pivoting;
use crate::sums::regularization::Regularization;

/// Points of the smaller of two samples. The larger one has twice as many.
const FEW: usize = 1_000;

/// Most landmarks of a sample: the look takes the square of them for each of its points.
const MOST: usize = 1_200;

/// Growth of the landmarks from the smaller to the larger sample up to which they are expected to be few. It
/// is 2 for rough kernels, of which every point is a landmark, and falls to 1.
const GROWTH: f64 = 1.4;

/// Estimates how many landmarks all points need, from two random samples. `None` if they are as many as the
/// points, or if there are too few points to tell.
///
/// # Errors
/// [`crate::error::NumericsError::Cancelled`].
pub fn expected_landmarks(
    cloud: &Cloud,
    kernel: &Kernel,
    noise: &Regularization,
    observer: &dyn Observer,
) -> Result<Option<usize>> {
    let n = cloud.n_points();
    if n <= 2 * FEW {
        return Ok(None);
    }
    let mut ranks = [0; 2];
    for (rank, count) in ranks.iter_mut().zip([FEW, 2 * FEW]) {
        let sample = cloud.select(&sampled(n, count));
        let (most, exact) = (MOST.min(count), Regularization::Uniform(0.0));
        let mut columns = vec![0.0; count * most];
        let pivoting = Pivoting::new(&sample, kernel, &exact, &mut columns);
        let pivots = pivoting.to(tolerance(n, kernel, noise)).run(most, observer)?;
        if !pivots.is_complete || pivots.rank == count {
            return Ok(None);
        }
        *rank = pivots.rank;
    }
    let growth = ranks[1] as f64 / ranks[0] as f64;
    Ok((growth <= GROWTH).then_some((ranks[1] as f64 * growth) as usize))
}
