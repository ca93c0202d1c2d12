//! The residual of the true system, `Y − (K + D)Λ`.

use super::{LandmarkFit, Landmarks};
use crate::error::Result;
use crate::machine::random::Random;
use crate::machine::vector::norm;
use crate::observer::Observer;
use crate::regression::sums::expansion::Expansion;

/// Pairs of points that the residual is summed over: all of 14,000 points, or some rows of more.
const PAIRS: usize = 200_000_000;

/// Least number of rows.
const LEAST_ROWS: usize = 256;

/// Seed of the rows.
const SEED: u64 = 34;

/// Relative residual of the weights at the landmarks alone from which those of all points are tried.
const EXACT: f64 = 1e-10;

/// Size of the residual, over that of the values.
#[derive(Debug, Clone, Copy)]
pub(in crate::regression::solver) struct TrueResidual {
    /// `|Y − (K + D)Λ| / |Y|`, 0 for Y = 0. Estimated by a sample of rows where there are many.
    pub relative: f64,
    /// Largest entry that was seen.
    pub max: f64,
}

impl TrueResidual {
    /// Measures the residual of two sets of weights, and returns that of the better one: b at the landmarks
    /// and 0 elsewhere, which is exact where there is no noise, and `D⁻¹(Y − u)` at all points.
    ///
    /// # Errors
    /// [`crate::error::NumericsError::Cancelled`].
    pub(in crate::regression::solver) fn of(
        landmarks: &Landmarks,
        values: &[f64],
        fitted: &LandmarkFit,
        observer: &dyn Observer,
    ) -> Result<Self> {
        let noise = landmarks.system.regularization();
        let mut rest: Vec<f64> = values.iter().zip(&fitted.at_points).map(|(y, u)| y - u).collect();
        for (&point, weight) in landmarks.points().iter().zip(&fitted.at_landmarks) {
            rest[point] -= noise.at(point) * weight;
        }
        let at_landmarks = Self::measured(values, &rest);
        if at_landmarks.relative <= EXACT {
            return Ok(at_landmarks);
        }
        let at_all = Self::of_all(landmarks, values, fitted, observer)?;
        Ok(if at_all.relative < at_landmarks.relative { at_all } else { at_landmarks })
    }

    fn of_all(
        landmarks: &Landmarks,
        values: &[f64],
        fitted: &LandmarkFit,
        observer: &dyn Observer,
    ) -> Result<Self> {
        let (system, n) = (&landmarks.system, values.len());
        let rows: Vec<usize> = match (PAIRS / n).max(LEAST_ROWS) {
            n_rows if n_rows >= n => (0..n).collect(),
            n_rows => (0..n_rows as u64).map(|row| Random::of(SEED, row).below(n)).collect(),
        };
        let places = system.cloud().select(&rows);
        let expansion =
            Expansion { centres: system.cloud(), kernel: system.kernel(), weights: &fitted.weights };
        let products = expansion.values_at(&places, observer)?;
        let rest = rows.iter().zip(&products).map(|(&row, product)| {
            values[row] - product - system.regularization().at(row) * fitted.weights[row]
        });
        let own: Vec<f64> = rows.iter().map(|&row| values[row]).collect();
        Ok(Self::measured(&own, &rest.collect::<Vec<f64>>()))
    }

    fn measured(values: &[f64], rest: &[f64]) -> Self {
        let size = norm(values);
        Self {
            relative: if size == 0.0 { norm(rest) } else { norm(rest) / size },
            max: rest.iter().fold(0.0, |max: f64, r| max.max(r.abs())),
        }
    }
}
