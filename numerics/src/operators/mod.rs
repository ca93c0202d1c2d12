//! Surface gradient and Laplace–Beltrami operator, applied to values and as matrices.
//!
//! The surface comes as a [`Geometry`], the values as an [`Interpolant`]. Their clouds and kernels may differ
//! (the paper's last remark). In a matrix, rows are queries and columns are nodes: `M = B (K + αI)⁻¹` with B
//! the operator applied to each kernel translate. It takes a solve with m right-hand sides.

mod deviations;
mod doubts;
mod kriged;
pub mod price;
mod resolution;
mod stencils;

use std::sync::Arc;

use faer::MatMut;
use pulp::{Simd, WithSimd};
use rayon::prelude::*;

use crate::error::{NumericsError, Quantity, Result, SolverKind};
use crate::kernel::Kernel;
use crate::machine::registers::{BLOCK, Block, Pack};
use crate::machine::vector::dot;
use crate::observer::{Observer, Stage};
use crate::points::cloud::Cloud;
use crate::regression::function::interpolant::Interpolant;
use crate::regression::solver::trend::{Basis, Mean};
use crate::regression::solver::{Method, Solver};
use crate::regression::sums::jets::{JetOrder, Jets, check_smooth_at};
use crate::regression::sums::nodes::{BlockPairs, Nodes};
use crate::surface::curvature::tangential_trace;
use crate::surface::geometry::Geometry;
pub(crate) use doubts::JUDGED_FUNCTIONALS;
pub use doubts::OperatorAnswers;
pub use kriged::{KrigedFunction, OfKriged};
pub use stencils::{RowKind, SparseMatrix, Stencils};

/// An operator on functions u over a surface. Answers at null queries are zero.
///
/// - The surface gradient `∇_M u = ∇u − (∇u·ν)ν`, `[m, d]`, unit V/L.
/// - The Laplace–Beltrami operator `Δ_M u = tr D²u − νᵀD²uν − tr(Dν) ∂_νu`, `[m]`, unit V/L². The last term
///   has a minus (errata.md, 1). On the unit circle Δ cos θ = −cos θ. The result does not depend on the
///   orientation of ν.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Operator {
    SurfaceGradient,
    LaplaceBeltrami,
}

impl Operator {
    /// The derivatives of u that the operator needs.
    fn order(self) -> JetOrder {
        match self {
            Self::SurfaceGradient => JetOrder::Gradient,
            Self::LaplaceBeltrami => JetOrder::Hessian,
        }
    }

    /// Numbers per query: d, or 1.
    pub fn n_components(self, dimension: usize) -> usize {
        match self {
            Self::SurfaceGradient => dimension,
            Self::LaplaceBeltrami => 1,
        }
    }

    /// Applies the operator to a function at the queries of the geometry, `[m, d]` or `[m]`.
    ///
    /// # Errors
    /// Returns the errors of [`Interpolant::at`].
    pub fn apply(
        self,
        geometry: &Geometry,
        interpolant: &Interpolant,
        queries: &Cloud,
        observer: &dyn Observer,
    ) -> Result<Vec<f64>> {
        Ok(self.of_jets(geometry, &interpolant.at(queries, self.order(), observer)?))
    }

    /// Applies the operator to a function known by its jets.
    fn of_jets(self, geometry: &Geometry, jets: &Jets) -> Vec<f64> {
        match self {
            Self::SurfaceGradient => surface_gradient_of(geometry, jets),
            Self::LaplaceBeltrami => laplace_beltrami_of(geometry, jets),
        }
    }

    /// Computes the operator as a matrix, with rows for the queries and columns for the nodes: `[d, m, n]`, a
    /// matrix for each component, or `[m, n]`. It is not symmetric in general.
    ///
    /// # Errors
    /// [`NumericsError::DimensionMismatch`], [`NumericsError::KernelNotSmooth`], [`NumericsError::Overflow`],
    /// [`NumericsError::MeanNotDetermined`], [`NumericsError::Cancelled`]. [`NumericsError::Unsupported`] by
    /// conjugate gradients, which have no weights but for given values.
    pub fn matrix(
        self,
        geometry: &Geometry,
        solver: &Arc<Solver>,
        queries: &Cloud,
        mean: Mean,
        observer: &dyn Observer,
    ) -> Result<Vec<f64>> {
        if solver.method() == Method::ConjugateGradients {
            let (solver, quantity) = (SolverKind::Iterative, Quantity::DenseMatrix);
            return Err(NumericsError::Unsupported { solver, quantity });
        }
        let mut matrix = operator_matrix(geometry, solver, queries, self, observer)?;
        OnMean { geometry, solver, mean, operator: self }.make_exact(&mut matrix, observer)?;
        Ok(matrix)
    }
}

fn surface_gradient_of(geometry: &Geometry, jets: &Jets) -> Vec<f64> {
    let d = jets.dimension();
    let mut gradients = vec![0.0; jets.n_queries() * d];
    for query in regular(geometry) {
        let (gradient, normal) = (jets.gradient(query), geometry.normal(query));
        let along = dot(gradient, normal);
        for (c, slot) in gradients[query * d..][..d].iter_mut().enumerate() {
            *slot = gradient[c] - along * normal[c];
        }
    }
    gradients
}

fn laplace_beltrami_of(geometry: &Geometry, jets: &Jets) -> Vec<f64> {
    let mut values = vec![0.0; jets.n_queries()];
    for query in regular(geometry) {
        let normal = geometry.normal(query);
        let along = dot(jets.gradient(query), normal);
        values[query] =
            tangential_trace(&jets.hessian(query), normal) - geometry.trace_of_shape_operator(query) * along;
    }
    values
}

/// Computes the matrix `BW`, `[components, m, n]` row-major, with `W = (K + αI)⁻¹`.
///
/// B is filled first. The solve with `Wᵀ` for its rows is in place, so that B and the answer share one
/// buffer.
///
/// # Errors
/// [`NumericsError::DimensionMismatch`], [`NumericsError::KernelNotSmooth`], [`NumericsError::Overflow`],
/// [`NumericsError::Cancelled`].
fn operator_matrix(
    geometry: &Geometry,
    solver: &Arc<Solver>,
    queries: &Cloud,
    operator: Operator,
    observer: &dyn Observer,
) -> Result<Vec<f64>> {
    let (cloud, kernel) = (solver.cloud(), solver.kernel());
    cloud.check_same_dimension(queries)?;
    check_smooth_at(cloud, kernel, queries, observer)?;
    observer.enter(Stage::Evaluate);
    let (n, m) = (cloud.n_points(), queries.n_points());
    let n_rows = operator.n_components(cloud.dimension()) * m;
    let nodes = Nodes::of(cloud);
    let mut matrix = vec![0.0; n_rows * n];
    matrix.par_chunks_mut(n).enumerate().try_for_each(|(index, row)| {
        observer.checkpoint()?;
        let (component, query) = (index / m, index % m);
        if !geometry.is_null()[query] {
            let x = queries.point(query);
            let tangential_trace = stretched_trace(kernel, geometry.normal(query));
            let nodes = &nodes;
            nodes.dispatch(Row {
                nodes,
                kernel,
                geometry,
                operator,
                component,
                query,
                x,
                tangential_trace,
                row,
            });
        }
        Ok::<_, NumericsError>(())
    })?;
    observer.enter(Stage::Solve);
    for rows in matrix.chunks_mut(n * ROWS_PER_SOLVE) {
        observer.checkpoint()?;
        let count = rows.len() / n;
        let columns = MatMut::from_column_major_slice_mut(rows, n, count);
        solver.solve_transposed_in_place(columns, observer)?;
    }
    // Without branches, so that it is vectorised.
    let is_finite = |row: &[f64]| row.iter().fold(true, |all, x| all & x.is_finite());
    match matrix.par_chunks(n).position_first(|row| !is_finite(row)) {
        Some(index) => Err(NumericsError::Overflow { query: index % m }),
        None => Ok(matrix),
    }
}

/// What a matrix must yield on the functions of a mean.
struct OnMean<'a> {
    geometry: &'a Geometry,
    solver: &'a Solver,
    mean: Mean,
    operator: Operator,
}

impl OnMean<'_> {
    /// Turns the matrix `BW` into that for functions with a mean, `BW − (BWF − LF)(FᵀWF)⁻¹FᵀW`.
    ///
    /// F are the mean's functions at the nodes, and LF is the operator on them. On constants, and for a
    /// linear mean on coordinates, the result is the operator itself.
    fn make_exact(&self, matrix: &mut [f64], observer: &dyn Observer) -> Result<()> {
        let &Self { geometry, solver, mean, operator } = self;
        if mean == Mean::Zero {
            return Ok(());
        }
        let (basis, m) = (Basis::of(mean, solver.cloud()), geometry.n_queries());
        let exact = |index: usize| {
            let (component, query) = (index / m, index % m);
            let mut exact = vec![0.0; basis.n_functions()];
            basis.add_slopes(&on_coordinates(geometry, operator, component, query), &mut exact);
            Some(exact).filter(|_| !geometry.is_null()[query])
        };
        basis.make_exact(solver, matrix, exact, observer)
    }
}

/// Returns the vector `[d]` whose product with the gradient of a linear function is the operator on it: a row
/// of P, or `−tr(Dν)ν`.
fn on_coordinates(geometry: &Geometry, operator: Operator, component: usize, query: usize) -> Vec<f64> {
    let normal = geometry.normal(query);
    let entry = |c: usize| match operator {
        Operator::SurfaceGradient => f64::from(u8::from(c == component)) - normal[component] * normal[c],
        Operator::LaplaceBeltrami => -geometry.trace_of_shape_operator(query) * normal[c],
    };
    (0..normal.len()).map(entry).collect()
}

/// Right-hand sides per solve. So many run at the speed of matrix products, and a cancellation is noticed
/// within a fraction of a second.
const ROWS_PER_SOLVE: usize = 1024;

fn regular(geometry: &Geometry) -> impl Iterator<Item = usize> {
    (0..geometry.n_queries()).filter(|&query| !geometry.is_null()[query])
}

/// Returns `tr S² − νᵀS²ν`, S the factors by which a kernel stretches coordinates. It is d − 1 without
/// stretching.
fn stretched_trace(kernel: &Kernel, normal: &[f64]) -> f64 {
    if !kernel.is_stretched() {
        return (normal.len() - 1) as f64;
    }
    let across = |(axis, nu): (usize, &f64)| kernel.stretch(axis).powi(2) * (1.0 - nu * nu);
    normal.iter().enumerate().map(across).sum()
}

/// A row of B: the operator applied to `k(·, x_j)` for all j, at one query x.
///
/// With D = x − x_j and a = ν·D:
///
/// - `P∇k = 2vφ′/ℓ² (D − aν)`,
/// - `Δ_M k = v[4φ″/ℓ⁴ (|D|² − a²) + 2φ′/ℓ² (d − 1 − tr(Dν) a)]`.
///
/// Where the kernel stretches coordinates by S = diag(s), D is `S²(x − x_j)`, and `tr S² − νᵀS²ν` takes the
/// place of d − 1.
struct Row<'a> {
    nodes: &'a Nodes,
    kernel: &'a Kernel,
    geometry: &'a Geometry,
    operator: Operator,
    component: usize,
    query: usize,
    x: &'a [f64],
    /// Factor `tr S² − νᵀS²ν`, d − 1 without stretching.
    tangential_trace: f64,
    row: &'a mut [f64],
}

impl WithSimd for Row<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { nodes, kernel, x, .. } = self;
        let mut differences = vec![Block::ZERO; x.len()];
        let mut profiles = [Block::ZERO; 3];
        for block in 0..self.row.len().div_ceil(BLOCK) {
            nodes.squared_distances(
                simd,
                BlockPairs { kernel, x, block },
                &mut profiles[0],
                &mut differences,
            );
            kernel.profiles(simd, profiles.each_mut().map(Block::registers_mut::<S>));
            let start = block * BLOCK;
            let end = (start + BLOCK).min(self.row.len());
            let out = match self.operator {
                Operator::SurfaceGradient => self.of_surface_gradient(simd, &differences, &profiles),
                Operator::LaplaceBeltrami => self.of_laplace_beltrami(simd, &differences, &profiles),
            };
            self.row[start..end].copy_from_slice(&out.0[..end - start]);
        }
    }
}

impl Row<'_> {
    /// Returns a = ν·D and |D|² of a pack.
    #[inline(always)]
    fn along<S: Simd>(&self, simd: S, differences: &[Block], at: usize) -> (Pack<S>, Pack<S>) {
        let normal = self.geometry.normal(self.query);
        let (mut along, mut square) = (Pack::splat(simd, 0.0), Pack::splat(simd, 0.0));
        for (c, stretched) in differences.iter().enumerate() {
            let difference = Pack::load(simd, stretched, at) * self.kernel.stretch(c);
            along = difference.mul_add(Pack::splat(simd, normal[c]), along);
            square = difference.mul_add(difference, square);
        }
        (along, square)
    }

    #[inline(always)]
    fn of_surface_gradient<S: Simd>(
        &self,
        simd: S,
        differences: &[Block],
        [_, slope, _]: &[Block; 3],
    ) -> Block {
        let Self { kernel, component, .. } = *self;
        let normal = self.geometry.normal(self.query)[component];
        let factor = 2.0 * kernel.variance() * kernel.inverse_square_length();
        let mut out = Block::ZERO;
        for at in 0..Pack::<S>::PER_BLOCK {
            let (along, _) = self.along(simd, differences, at);
            let own = Pack::load(simd, &differences[component], at) * kernel.stretch(component);
            let tangential = own - along * normal;
            (factor * Pack::load(simd, slope, at) * tangential).store(&mut out, at);
        }
        out
    }

    #[inline(always)]
    fn of_laplace_beltrami<S: Simd>(
        &self,
        simd: S,
        differences: &[Block],
        [_, slope, bend]: &[Block; 3],
    ) -> Block {
        let Self { kernel, geometry, query, tangential_trace, .. } = *self;
        let inverse_square = kernel.inverse_square_length();
        let first = 2.0 * kernel.variance() * inverse_square;
        let mut out = Block::ZERO;
        for at in 0..Pack::<S>::PER_BLOCK {
            let (along, square) = self.along(simd, differences, at);
            // (|D|² − a²)/ℓ².
            let tangential = square * inverse_square - along * along * inverse_square;
            let turned = tangential_trace - along * geometry.trace_of_shape_operator(query);
            let of_slope = first * Pack::load(simd, slope, at) * turned;
            (2.0 * first * Pack::load(simd, bend, at)).mul_add(tangential, of_slope).store(&mut out, at);
        }
        out
    }
}

#[cfg(test)]
mod tests;
