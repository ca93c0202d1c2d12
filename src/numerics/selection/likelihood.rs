//! The restricted likelihood of a sample.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt;
use faer::linalg::triangular_solve::solve_lower_triangular_in_place;
use faer::prelude::{Reborrow, ReborrowMut};
use faer::{MatMut, Par};

use super::sample::Sample;
use crate::numerics::error::NumericsError;
use crate::numerics::kernel::Kernel;
use crate::numerics::machine::vector::dot;
use crate::numerics::observer::Observer;
use crate::numerics::sums::gram::fill_lower_gram;
use crate::numerics::sums::regularization::Regularization;

/// How well a kernel explains a sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Score {
    /// `−ln` of the restricted likelihood, but for a constant.
    pub(super) negative_log: f64,
    /// Of the process, unit V².
    pub(super) variance: f64,
}

/// The score of a kernel of variance 1 with so much noise for it; the variance of the process is the one given, or else the likeliest. `None` where the
/// matrix is not positive definite in float64.
///
/// With K the covariances, `z = L⁻¹y` without its part in the range of `L⁻¹F` and s² the variance:
/// `½|z|²/s² + ½(n − p) ln s² + ½ ln det K + ½ ln det FᵀK⁻¹F` (Rasmussen and Williams 2006, eq. 2.45; Patterson and Thompson 1971), summed over
/// the lists of values, each with a mean of its own.
///
/// # Errors
/// [`NumericsError::Cancelled`].
pub(super) fn score(
    sample: &Sample,
    kernel: &Kernel,
    ratio: f64,
    variance: Option<f64>,
    observer: &dyn Observer,
) -> Result<Option<Score>, NumericsError> {
    let (n, p) = (sample.n_points(), sample.n_functions);
    let n_lists = sample.values.len() / n;
    let noise = match &sample.noise {
        None => Regularization::Uniform(ratio),
        Some(noise) => Regularization::PerPoint(noise.iter().map(|v| v * ratio).collect()),
    };
    let mut buffer = vec![0.0; n * n];
    fill_lower_gram(&sample.cloud, kernel, &noise, &mut buffer, n, observer)?;
    let mut factor = MatMut::from_column_major_slice_mut(&mut buffer, n, n);
    let requirement = llt::factor::cholesky_in_place_scratch::<f64>(n, Par::Seq, Default::default());
    let mut scratch = MemBuffer::new(requirement);
    let factorized = llt::factor::cholesky_in_place(
        factor.rb_mut(),
        Default::default(),
        Par::Seq,
        MemStack::new(&mut scratch),
        Default::default(),
    );
    if factorized.is_err() {
        return Ok(None);
    }
    let mut columns = sample.functions.clone();
    columns.extend_from_slice(&sample.values);
    let right = MatMut::from_column_major_slice_mut(&mut columns, n, p + n_lists);
    solve_lower_triangular_in_place(factor.rb(), right, Par::Seq);
    let log_determinant: f64 = (0..n).map(|i| factor[(i, i)].ln()).sum::<f64>() * 2.0;
    let Some(of_mean) = remove_mean(&mut columns, n, p) else { return Ok(None) };
    let energy = dot(&columns[p * n..], &columns[p * n..]);
    let degrees = (n_lists * (n - p)) as f64;
    let variance = variance.unwrap_or((energy / degrees).max(sample.least_variance));
    let of_determinants = n_lists as f64 * (log_determinant + of_mean);
    let negative_log = 0.5 * (energy / variance + degrees * variance.ln() + of_determinants);
    Ok(negative_log.is_finite().then_some(Score { negative_log, variance }))
}

/// Makes the first p of some columns orthonormal and the others orthogonal to them (modified Gram–Schmidt); says `ln det FᵀF` of the first.
pub(super) fn remove_mean(columns: &mut [f64], n: usize, p: usize) -> Option<f64> {
    let mut log_determinant = 0.0;
    for a in 0..p {
        let (done, rest) = columns.split_at_mut((a + 1) * n);
        let function = &mut done[a * n..];
        let norm = dot(function, function).sqrt();
        if norm.is_nan() || norm <= 0.0 {
            return None;
        }
        function.iter_mut().for_each(|f| *f /= norm);
        log_determinant += 2.0 * norm.ln();
        for column in rest.chunks_exact_mut(n) {
            let along = dot(function, column);
            column.iter_mut().zip(&*function).for_each(|(c, f)| *c -= along * f);
        }
    }
    Some(log_determinant)
}
