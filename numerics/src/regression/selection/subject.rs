//! Values at points with the functions of their mean, the data of every evaluation.

use faer::Mat;

use crate::error::{NumericsError, Result};
use crate::machine::vector::dot;
use crate::points::cloud::Cloud;
use crate::regression::solver::trend::{Basis, Mean, Trend, remove_mean, solve_gram};
use crate::regression::sums::regularization::Regularization;

/// Least difference between 1 and a leverage. Less is rounding.
const LEVERAGE: f64 = 1e-10;

/// Values at the points of a cloud, and the mean of the process that they are explained by.
#[derive(Debug, Clone, Copy)]
pub struct Observations<'a> {
    pub cloud: &'a Cloud,
    /// Y, `[n]`, unit V.
    pub values: &'a [f64],
    pub mean: Mean,
}

/// Observations prepared for evaluations, which all share them.
pub(super) struct Subject<'a> {
    pub(super) cloud: &'a Cloud,
    /// Values, `[n]`. If there is a mean, their average is subtracted.
    pub(super) values: Vec<f64>,
    shared: f64,
    basis: Basis,
    /// F, `[n, p]` column by column.
    pub(super) functions: Vec<f64>,
    pub(super) n_functions: usize,
}

impl<'a> Subject<'a> {
    /// Prepares observations.
    ///
    /// # Errors
    /// [`NumericsError::LengthMismatch`]. [`NumericsError::MeanNotDetermined`] if the points do not
    /// distinguish the functions of the mean, or if there are no more points than functions.
    pub(super) fn of(observations: Observations<'a>) -> Result<Self> {
        let Observations { cloud, values, mean } = observations;
        cloud.check_one_per_point(values)?;
        let (n, basis) = (values.len(), Basis::of(mean, cloud));
        let (functions, p) = (basis.columns(cloud), basis.n_functions());
        let column = |a: usize| &functions[a * n..][..n];
        let gram = Mat::from_fn(p, p, |a, b| dot(column(a), column(b)));
        if p > 0 && (n <= p || solve_gram(&gram, Mat::identity(p, p)).is_none()) {
            return Err(NumericsError::MeanNotDetermined);
        }
        // A large average would cost digits of the differences between values.
        let shared = if p > 0 { values.iter().sum::<f64>() / n as f64 } else { 0.0 };
        let values = values.iter().map(|value| value - shared).collect();
        Ok(Self { cloud, values, shared, basis, functions, n_functions: p })
    }

    /// Checks that the mean is determined without any one of the points: each leverage `fᵀ(FᵀF)⁻¹f` is
    /// below 1.
    ///
    /// # Errors
    /// [`NumericsError::MeanNotDetermined`].
    pub(super) fn check_without_one(&self) -> Result<()> {
        let (n, p) = (self.n_points(), self.n_functions);
        if p == 0 {
            return Ok(());
        }
        let column = |a: usize| &self.functions[a * n..][..n];
        let gram = Mat::from_fn(p, p, |a, b| dot(column(a), column(b)));
        let rows = Mat::from_fn(p, n, |a, i| column(a)[i]);
        let solved = solve_gram(&gram, rows).ok_or(NumericsError::MeanNotDetermined)?;
        let leverage = |i: usize| (0..p).map(|a| column(a)[i] * solved[(a, i)]).sum::<f64>();
        if (0..n).any(|i| leverage(i) >= 1.0 - LEVERAGE) {
            Err(NumericsError::MeanNotDetermined)
        } else {
            Ok(())
        }
    }

    /// Returns the least norm that the mean can leave of the values: the residual norm of ordinary least
    /// squares.
    pub(super) fn rest(&self) -> f64 {
        let n = self.n_points();
        let mut columns = self.functions.clone();
        columns.extend_from_slice(&self.values);
        let found = remove_mean(&mut columns, n, self.n_functions);
        let rest = &columns[self.n_functions * n..];
        found.map_or(0.0, |_| dot(rest, rest).sqrt())
    }

    pub(super) fn n_points(&self) -> usize {
        self.values.len()
    }

    /// Returns the mean with the coefficients `[p]` of generalised least squares. `None` if there is no mean.
    pub(super) fn trend(&self, mut coefficients: Vec<f64>) -> Option<Trend> {
        *coefficients.first_mut()? += self.shared;
        Some(Trend::new(self.basis.clone(), coefficients))
    }
}

/// Returns the noise in units of its mean, `[n]`. It is 1 where the noise is uniform or zero everywhere.
pub(super) fn relative_noise(noise: &Regularization, n: usize) -> Vec<f64> {
    match noise {
        Regularization::Uniform(_) => vec![1.0; n],
        Regularization::PerPoint(variances) => {
            let mean = variances.iter().sum::<f64>() / n as f64;
            if mean > 0.0 { variances.iter().map(|v| v / mean).collect() } else { vec![1.0; n] }
        }
    }
}
