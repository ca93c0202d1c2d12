//! What is looked at: values at points, and what their mean may be.

use faer::Mat;

use super::learning::remove_mean;
use crate::error::NumericsError;
use crate::machine::vector::dot;
use crate::points::cloud::Cloud;
use crate::solver::trend::{Basis, Mean, Trend, solve_gram};
use crate::sums::regularization::Regularization;

/// What a leverage lacks of 1 at least: less is rounding.
const LEVERAGE: f64 = 1e-10;

/// Values at the points of a cloud with a mean: what all evaluations share.
pub(super) struct Subject<'a> {
    pub(super) cloud: &'a Cloud,
    /// `[n]`, without what all of them share where there is a mean.
    pub(super) values: Vec<f64>,
    shared: f64,
    basis: Basis,
    /// F, `[n, p]` column by column.
    pub(super) functions: Vec<f64>,
    pub(super) n_functions: usize,
}

impl<'a> Subject<'a> {
    /// # Errors
    /// [`NumericsError::LengthMismatch`]; [`NumericsError::MeanNotDetermined`] if the points do not tell the functions of the mean apart, or there
    /// are no more of them.
    pub(super) fn of(cloud: &'a Cloud, values: &[f64], mean: Mean) -> Result<Self, NumericsError> {
        cloud.check_one_per_point(values)?;
        let (n, basis) = (values.len(), Basis::of(mean, cloud));
        let (functions, p) = (basis.columns(cloud), basis.n_functions());
        let column = |a: usize| &functions[a * n..][..n];
        let gram = Mat::from_fn(p, p, |a, b| dot(column(a), column(b)));
        if p > 0 && (n <= p || solve_gram(&gram, Mat::identity(p, p)).is_none()) {
            return Err(NumericsError::MeanNotDetermined);
        }
        // What all values share would cost digits of what they do not share.
        let shared = if p > 0 { values.iter().sum::<f64>() / n as f64 } else { 0.0 };
        let values = values.iter().map(|value| value - shared).collect();
        Ok(Self { cloud, values, shared, basis, functions, n_functions: p })
    }

    /// Whether the mean is determined without any one of the points: none has all of the leverage, `fᵀ(FᵀF)⁻¹f < 1`.
    ///
    /// # Errors
    /// [`NumericsError::MeanNotDetermined`].
    pub(super) fn check_without_one(&self) -> Result<(), NumericsError> {
        let (n, p) = (self.n_points(), self.n_functions);
        if p == 0 {
            return Ok(());
        }
        let column = |a: usize| &self.functions[a * n..][..n];
        let gram = Mat::from_fn(p, p, |a, b| dot(column(a), column(b)));
        let rows = Mat::from_fn(p, n, |a, i| column(a)[i]);
        let solved = solve_gram(&gram, rows).ok_or(NumericsError::MeanNotDetermined)?;
        let leverage = |i: usize| (0..p).map(|a| column(a)[i] * solved[(a, i)]).sum::<f64>();
        match (0..n).any(|i| leverage(i) >= 1.0 - LEVERAGE) {
            true => Err(NumericsError::MeanNotDetermined),
            false => Ok(()),
        }
    }

    /// The norm of what the mean leaves of the values at least: what it leaves where all of them weigh the same.
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

    /// The mean with coefficients that generalised least squares found, `[p]`.
    pub(super) fn trend(&self, mut coefficients: Vec<f64>) -> Option<Trend> {
        *coefficients.first_mut()? += self.shared;
        Some(Trend::new(self.basis.clone(), coefficients))
    }
}

/// The noise in units of its mean: 1 where it is the same everywhere, or nothing.
pub(super) fn relative_noise(noise: &Regularization, n: usize) -> Vec<f64> {
    match noise {
        Regularization::Uniform(_) => vec![1.0; n],
        Regularization::PerPoint(variances) => {
            let mean = variances.iter().sum::<f64>() / n as f64;
            if mean > 0.0 { variances.iter().map(|v| v / mean).collect() } else { vec![1.0; n] }
        }
    }
}
