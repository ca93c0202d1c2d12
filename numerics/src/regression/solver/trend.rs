//! The mean of a function: a combination of few known functions, with coefficients found together with the
//! weights.
//!
//! Let `u = Σ_a β_a f_a + Σ_j λ_j k(·, x_j)`, F the `f_a` at the points, and W = (K + αI)⁻¹. Generalised
//! least squares give `β = (FᵀWF)⁻¹FᵀWY` and `Λ = W(Y − Fβ)`. This is universal kriging, and the posterior
//! under a flat prior on β (Rasmussen and Williams 2006, sec. 2.7; Chilès and Delfiner 2012, sec. 3.4).

use faer::linalg::solvers::Solve;
use faer::{Mat, MatMut, Side};
use rayon::prelude::*;

use super::Solver;
use crate::error::{NumericsError, Result};
use crate::machine::heap::vec_bytes;
use crate::machine::vector::dot;
use crate::observer::Observer;
use crate::points::cloud::Cloud;

/// Functions that a mean combines.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
pub enum Mean {
    /// No function: far from the points, u tends to 0.
    #[default]
    Zero,
    /// The constant.
    Constant,
    /// The constant and the coordinates.
    Linear,
}

impl Mean {
    /// Returns the number of functions in dimension d.
    pub(crate) fn n_functions(self, dimension: usize) -> usize {
        match self {
            Self::Zero => 0,
            Self::Constant => 1,
            Self::Linear => 1 + dimension,
        }
    }
}

/// Least share of the square of a function that the others must leave of it at the points. With less, the
/// mean is not determined.
const DEPENDENT: f64 = 1e-12;

/// Functions of a mean, relative to the centre of a cloud and in units of its size.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Basis {
    mean: Mean,
    centre: Vec<f64>,
    size: f64,
}

impl Basis {
    pub(crate) fn of(mean: Mean, cloud: &Cloud) -> Self {
        let (min, max) = cloud.bounding_box();
        let centre = min.iter().zip(&max).map(|(a, b)| 0.5 * (a + b)).collect();
        let radius = cloud.radius();
        Self { mean, centre, size: if radius > 0.0 { radius } else { 1.0 } }
    }

    pub(crate) fn n_functions(&self) -> usize {
        self.mean.n_functions(self.centre.len())
    }

    /// Writes the functions at a point, `[p]`.
    pub(crate) fn at(&self, x: &[f64], functions: &mut [f64]) {
        let (Some((constant, linear)), true) = (functions.split_first_mut(), self.mean != Mean::Zero) else {
            return;
        };
        *constant = 1.0;
        let scaled = x.iter().zip(&self.centre).map(|(x, centre)| (x - centre) / self.size);
        linear.iter_mut().zip(scaled).for_each(|(function, x)| *function = x);
    }

    /// Adds the derivatives of the functions along a vector.
    pub(crate) fn add_slopes(&self, along: &[f64], functions: &mut [f64]) {
        let slopes = functions.iter_mut().skip(1).zip(along);
        slopes.for_each(|(function, component)| *function += component / self.size);
    }

    /// Returns `(FᵀWF)⁻¹FᵀW`, `[p, n]`: the coefficients of the mean as functionals of the values.
    ///
    /// # Errors
    /// [`NumericsError::MeanNotDetermined`] if the points do not distinguish the functions, and the errors of
    /// [`Solver::solve_in_place`].
    pub(crate) fn functionals(&self, solver: &Solver, observer: &dyn Observer) -> Result<Vec<f64>> {
        let (n, p) = (solver.n_points(), self.n_functions());
        let columns = self.columns(solver.cloud());
        let mut weights = columns.clone();
        solver.solve_in_place(MatMut::from_column_major_slice_mut(&mut weights, n, p), observer)?;
        let gram = Mat::from_fn(p, p, |a, b| dot(&columns[a * n..][..n], &weights[b * n..][..n]));
        let solved = solve_gram(&gram, Mat::from_fn(p, n, |a, i| weights[a * n + i]));
        let solved = solved.ok_or(NumericsError::MeanNotDetermined)?;
        Ok((0..p * n).map(|at| solved[(at / n, at % n)]).collect())
    }

    /// Turns rows that weigh the values without their mean, `[rows, n]`, into rows that weigh the values:
    /// `row − (row F − exact)(FᵀWF)⁻¹FᵀW`.
    ///
    /// `exact` gives what a row must yield on each of the functions. A row for which it gives nothing is left
    /// as it is.
    ///
    /// # Errors
    /// Returns the errors of [`Basis::functionals`].
    pub(crate) fn make_exact(
        &self,
        solver: &Solver,
        rows: &mut [f64],
        exact: impl Fn(usize) -> Option<Vec<f64>> + Sync,
        observer: &dyn Observer,
    ) -> Result<()> {
        let n = solver.n_points();
        let (of_values, columns) = (self.functionals(solver, observer)?, self.columns(solver.cloud()));
        rows.par_chunks_mut(n).enumerate().for_each(|(index, row)| {
            let Some(exact) = exact(index) else { return };
            let found = columns.chunks_exact(n).map(|function| dot(function, row));
            let excess: Vec<f64> = found.zip(&exact).map(|(found, exact)| found - exact).collect();
            for (functional, excess) in of_values.chunks_exact(n).zip(&excess) {
                row.iter_mut().zip(functional).for_each(|(entry, f)| *entry -= excess * f);
            }
        });
        Ok(())
    }

    /// Returns the functions at the points of a cloud, `[n, p]` column by column.
    pub(crate) fn columns(&self, cloud: &Cloud) -> Vec<f64> {
        let (n, p) = (cloud.n_points(), self.n_functions());
        let (mut columns, mut functions) = (vec![0.0; n * p], vec![0.0; p]);
        for (i, x) in cloud.points().enumerate() {
            self.at(x, &mut functions);
            functions.iter().enumerate().for_each(|(a, f)| columns[a * n + i] = *f);
        }
        columns
    }
}

/// A mean with its coefficients.
#[derive(Debug, Clone, PartialEq)]
pub struct Trend {
    basis: Basis,
    coefficients: Vec<f64>,
    /// Covariance `(FᵀWF)⁻¹` of the coefficients, `[p, p]`, under the kernel that they were found with. Empty
    /// if they are known.
    covariance: Vec<f64>,
}

/// Uncertainty of the coefficients of a mean.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TrendUncertainty<'a> {
    pub(crate) basis: &'a Basis,
    /// Covariance of the coefficients, `[p, p]`, under the kernel that they were found with.
    pub(crate) covariance: &'a [f64],
}

impl Trend {
    /// Creates a mean with known coefficients, one for each function.
    pub(crate) fn new(basis: Basis, coefficients: Vec<f64>) -> Self {
        Self { basis, coefficients, covariance: Vec::new() }
    }

    /// Creates a mean with estimated coefficients and their covariance `[p, p]`, under the kernel that they
    /// were found with.
    pub(crate) fn found(basis: Basis, coefficients: Vec<f64>, covariance: Vec<f64>) -> Self {
        Self { basis, coefficients, covariance }
    }

    /// Returns the uncertainty of the coefficients, or `None` if they are known.
    pub(crate) fn uncertainty(&self) -> Option<TrendUncertainty<'_>> {
        let Self { basis, covariance, .. } = self;
        (!covariance.is_empty()).then_some(TrendUncertainty { basis, covariance })
    }

    /// Finds the mean of values `[n]` under a solver. `None` for [`Mean::Zero`].
    ///
    /// # Errors
    /// [`NumericsError::MeanNotDetermined`] if the points do not distinguish its functions, and the errors of
    /// [`Solver::solve_in_place`].
    pub(crate) fn fit(
        solver: &Solver,
        values: &[f64],
        mean: Mean,
        observer: &dyn Observer,
    ) -> Result<Option<Self>> {
        Ok(Self::fit_each(solver, values, mean, observer)?.map(|mut trends| trends.remove(0)))
    }

    /// Finds the mean of each of k lists of values `[k, n]`.
    ///
    /// # Errors
    /// Returns the errors of [`Trend::fit`].
    pub(super) fn fit_each(
        solver: &Solver,
        values: &[f64],
        mean: Mean,
        observer: &dyn Observer,
    ) -> Result<Option<Vec<Self>>> {
        if mean == Mean::Zero {
            return Ok(None);
        }
        let (cloud, n) = (solver.cloud(), solver.n_points());
        let basis = Basis::of(mean, cloud);
        let columns = basis.columns(cloud);
        let mut weights = solver.weights_of_one(observer)?.into_owned();
        weights.extend_from_slice(&columns[n..]);
        let p = basis.n_functions();
        let others = MatMut::from_column_major_slice_mut(&mut weights[n..], n, p - 1);
        solver.solve_in_place(others, observer)?;
        // The average of a list is subtracted first, since it would cost digits of the differences.
        let lists = values.chunks_exact(n);
        let shared: Vec<f64> = lists.clone().map(|list| list.iter().sum::<f64>() / n as f64).collect();
        let moments: Vec<f64> = lists
            .zip(&shared)
            .flat_map(|(list, shared)| {
                let rest: Vec<f64> = list.iter().map(|value| value - shared).collect();
                weights.chunks_exact(n).map(|weights| dot(weights, &rest)).collect::<Vec<f64>>()
            })
            .collect();
        let gram = Mat::from_fn(p, p, |a, b| dot(&columns[a * n..][..n], &weights[b * n..][..n]));
        let right = |a: usize, b: usize| match b.checked_sub(p) {
            Some(list) => moments[list * p + a],
            None => f64::from(u8::from(a == b)),
        };
        let right = Mat::from_fn(p, p + shared.len(), right);
        let solved = solve_gram(&gram, right).ok_or(NumericsError::MeanNotDetermined)?;
        let column = |b: usize| solved.col(b).iter().copied();
        let covariance: Vec<f64> = (0..p).flat_map(column).collect();
        let trend = |(list, shared): (usize, &f64)| {
            let mut coefficients: Vec<f64> = column(p + list).collect();
            coefficients[0] += shared;
            Self { basis: basis.clone(), coefficients, covariance: covariance.clone() }
        };
        Ok(Some(shared.iter().enumerate().map(trend).collect()))
    }

    /// Returns `m(x)`.
    pub(crate) fn at(&self, x: &[f64]) -> f64 {
        let mut functions = vec![0.0; self.coefficients.len()];
        self.basis.at(x, &mut functions);
        dot(&functions, &self.coefficients)
    }

    /// Returns `∇m`, the same everywhere.
    pub(crate) fn gradient(&self) -> Vec<f64> {
        let slopes = self.coefficients[1..].iter().map(|slope| slope / self.basis.size);
        slopes.chain(std::iter::repeat(0.0)).take(self.basis.centre.len()).collect()
    }

    /// Returns the values without the mean, `[n]`.
    pub(crate) fn removed_from(&self, values: &[f64], cloud: &Cloud) -> Vec<f64> {
        cloud.points().zip(values).map(|(x, value)| value - self.at(x)).collect()
    }

    pub(crate) fn basis(&self) -> &Basis {
        &self.basis
    }

    /// Returns the mean as a function of the coordinates: the constant, then the slopes, if it has any.
    pub fn of_coordinates(&self) -> Vec<f64> {
        let slopes: Vec<f64> = self.coefficients[1..].iter().map(|slope| slope / self.basis.size).collect();
        let at_centre: f64 = slopes.iter().zip(&self.basis.centre).map(|(slope, x)| slope * x).sum();
        std::iter::once(self.coefficients[0] - at_centre).chain(slopes).collect()
    }

    /// Bytes held on the heap.
    pub(crate) fn n_bytes(&self) -> usize {
        vec_bytes(&self.coefficients) + vec_bytes(&self.covariance) + vec_bytes(&self.basis.centre)
    }
}

/// Solves `G X = columns` with G symmetric and positive definite. `None` if G is not, by [`DEPENDENT`].
pub(crate) fn solve_gram(gram: &Mat<f64>, columns: Mat<f64>) -> Option<Mat<f64>> {
    let p = gram.nrows();
    // Dividing by the diagonal allows functions of any size.
    let roots: Vec<f64> = (0..p).map(|a| gram[(a, a)].sqrt()).collect();
    if roots.iter().any(|root| root.is_nan() || *root <= 0.0) {
        return None;
    }
    let scaled = Mat::from_fn(p, p, |a, b| gram[(a, b)] / (roots[a] * roots[b]));
    let factor = scaled.llt(Side::Lower).ok()?;
    let pivots = factor.L().diagonal().column_vector();
    if pivots.iter().any(|pivot| pivot * pivot < DEPENDENT) {
        return None;
    }
    let right = Mat::from_fn(p, columns.ncols(), |a, b| columns[(a, b)] / roots[a]);
    let solved = factor.solve(right);
    Some(Mat::from_fn(p, columns.ncols(), |a, b| solved[(a, b)] / roots[a]))
}

/// Makes the first p columns orthonormal and the others orthogonal to them (modified Gram–Schmidt). Returns
/// `ln det FᵀF` of the first p, or `None` if one of them vanishes.
pub(crate) fn remove_mean(columns: &mut [f64], n: usize, p: usize) -> Option<f64> {
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
