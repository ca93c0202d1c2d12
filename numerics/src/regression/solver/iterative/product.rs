//! Products with the matrix that are no more exact than they need be.

use crate::error::{NumericsError, Result};
use crate::machine::random::Random;
use crate::machine::vector::norm;
use crate::observer::Observer;
use crate::points::cloud::Cloud;
use crate::regression::solver::system::{FEW, System};
use crate::regression::sums::expansion::Expansion;
use crate::regression::sums::fast::FastSums;

/// Number of points from which products are planned. Those of fewer take less than a tenth of a second.
const LEAST_POINTS: usize = 30_000;

/// Rows in which a product is compared with the plain sum.
const ROWS: usize = 128;

/// Seed of the rows.
const SEED: u64 = 36;

/// With kernels interpolated to a part p of k₀, the error of a product Ax was about `p^(5/4) k₀|x|/300` for
/// Matérn kernels and Laplace on 100,000 points: errors of single kernels mostly cancel. This is a sixth of
/// that number, so that the first try suffices.
const CANCELLED: f64 = 50.0;

/// The inverse of 5/4.
const POWER: f64 = 0.8;

/// Time of a pair of a fast product, over that of a plain one.
const PER_PAIR: f64 = 1.2;

/// Largest part to which kernels are interpolated.
const COARSEST: f64 = 0.01;

/// Smallest part to which they are: nodes are no more exact.
const FINEST: f64 = 1e-14;

/// Most products that are tried before the plain one.
const TRIES: usize = 3;

/// Products `(K + D)X` by fast sums where these take fewer pairs than plain ones.
pub(super) struct Product {
    /// None where there are few points, or many dimensions.
    fast: Option<Fast>,
}

struct Fast {
    sums: FastSums,
    /// Indices of the rows that are compared, with their points.
    rows: Vec<usize>,
    places: Cloud,
}

impl Product {
    /// # Errors
    /// [`NumericsError::Cancelled`].
    pub(super) fn of(system: &System, observer: &dyn Observer) -> Result<Self> {
        let (cloud, n) = (system.cloud(), system.n_points());
        if n < LEAST_POINTS || cloud.dimension() > FastSums::MAX_DIMENSION {
            return Ok(Self { fast: None });
        }
        let rows: Vec<usize> = (0..ROWS as u64).map(|row| Random::of(SEED, row).below(n)).collect();
        let sums = FastSums::of(cloud, system.kernel(), observer)?;
        Ok(Self { fast: Some(Fast { sums, places: cloud.select(&rows), rows }) })
    }

    /// `(K + D)X` for columns `[n, k]`, each with an error of at most `accuracy` of its size.
    ///
    /// # Errors
    /// [`NumericsError::Overflow`], [`NumericsError::Cancelled`].
    pub(super) fn times(
        &self,
        system: &System,
        columns: &[f64],
        accuracy: f64,
        observer: &dyn Observer,
    ) -> Result<Vec<f64>> {
        match self.fast.as_ref().map(|fast| fast.times(system, columns, accuracy, observer)) {
            Some(Ok(Some(products))) => Ok(products),
            // The plain product names the point at which a sum leaves float64.
            Some(Ok(None) | Err(NumericsError::Overflow { .. })) | None => system.times(columns, observer),
            Some(Err(error)) => Err(error),
        }
    }

    pub(super) fn n_bytes(&self) -> usize {
        self.fast.as_ref().map_or(0, |fast| fast.sums.n_bytes())
    }
}

impl Fast {
    /// Returns `None` where the plain product takes fewer pairs.
    fn times(
        &self,
        system: &System,
        columns: &[f64],
        accuracy: f64,
        observer: &dyn Observer,
    ) -> Result<Option<Vec<f64>>> {
        let n_plain = plain_pairs(system.n_points(), columns.len());
        let exact = self.exact_rows(system, columns, observer)?;
        // Where weights cancel in the product, errors do not.
        let size = norm(&exact) / (ROWS as f64).sqrt() / system.kernel().at_zero();
        let mut part = (CANCELLED * accuracy * size / norm(columns)).powf(POWER).min(COARSEST);
        for _ in 0..TRIES {
            if part.is_nan() || part < FINEST {
                break;
            }
            let plan = self.sums.plan(part);
            if PER_PAIR * plan.n_pairs() > n_plain {
                break;
            }
            let mut products = plan.times(columns, observer)?;
            system.add_noise(columns, &mut products);
            let error = self.error(&exact, &products);
            if error <= accuracy {
                return Ok(Some(products));
            }
            part *= (0.3 * accuracy / error).powf(POWER);
        }
        Ok(None)
    }

    /// `(K + D)X` in the rows that are compared, `[rows, k]`.
    fn exact_rows(&self, system: &System, columns: &[f64], observer: &dyn Observer) -> Result<Vec<f64>> {
        let of_column = |weights: &[f64]| {
            let expansion = Expansion { centres: system.cloud(), kernel: system.kernel(), weights };
            let mut sums = expansion.values_at(&self.places, observer)?;
            let noise = self.rows.iter().map(|&row| system.regularization().at(row) * weights[row]);
            sums.iter_mut().zip(noise).for_each(|(sum, noise)| *sum += noise);
            Ok(sums)
        };
        Ok(columns.chunks_exact(system.n_points()).map(of_column).collect::<Result<Vec<_>>>()?.concat())
    }

    /// Largest relative error of a column, over the rows that are compared.
    fn error(&self, exact: &[f64], products: &[f64]) -> f64 {
        let n = products.len() * ROWS / exact.len();
        let of_column = |(exact, product): (&[f64], &[f64])| {
            let errors: Vec<f64> = self.rows.iter().zip(exact).map(|(&row, x)| product[row] - x).collect();
            let (error, size) = (norm(&errors), norm(exact));
            if error == 0.0 { 0.0 } else { error / size }
        };
        exact.chunks_exact(ROWS).zip(products.chunks_exact(n)).map(of_column).fold(0.0, f64::max)
    }
}

/// Kernels that the plain product of columns with this many numbers evaluates.
fn plain_pairs(n_points: usize, n_numbers: usize) -> f64 {
    let (n, k) = (n_points as f64, n_numbers / n_points);
    if k <= FEW { 0.5 * k as f64 * n * n } else { n * n }
}
