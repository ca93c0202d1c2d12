//! Standard deviations of linear functionals of a jet: value, derivatives, and operators at a query.
//!
//! A functional is `Fu = c u + g·∇u + A : D²u`. For a process with covariance k, its covariance with the
//! value at x_j is F applied to k(·, x_j). Its posterior variance is `FF'k − |L⁻¹Fk(X)|²`, as for a value
//! (Rasmussen and Williams 2006, sec. 9.4).

use pulp::{Simd, WithSimd};
use rayon::prelude::*;

use super::COLUMNS_AT_ONCE;
use super::mean_variance::MeanVariance;
use crate::error::{NumericsError, Result};
use crate::kernel::Kernel;
use crate::machine::registers::{BLOCK, Block, Pack};
use crate::machine::small::{Small, zeros};
use crate::machine::vector::dot;
use crate::observer::{Observer, Stage};
use crate::points::cloud::Cloud;
use crate::regression::solver::trend::{Basis, Trend};
use crate::regression::solver::{Solution, Solver};
use crate::regression::sums::jets::check_smooth_at;
use crate::regression::sums::nodes::{BlockPairs, Nodes};

/// The functional `c u + g·∇u + A : D²u` at a query.
#[derive(Debug, Clone)]
pub(crate) struct JetFunctional {
    pub(crate) query: usize,
    /// c.
    pub(crate) of_value: f64,
    /// g, `[d]`.
    pub(crate) of_gradient: Small,
    /// A, symmetric `[d, d]`, or empty if it is 0.
    pub(crate) of_hessian: Small,
}

impl JetFunctional {
    /// Returns the value as a functional.
    pub(crate) fn value(query: usize, dimension: usize) -> Self {
        Self { query, of_value: 1.0, of_gradient: zeros(dimension), of_hessian: Small::new() }
    }

    /// Returns the derivative along a vector `[d]`.
    pub(crate) fn derivative(query: usize, along: &[f64]) -> Self {
        Self { query, of_value: 0.0, of_gradient: Small::from_slice(along), of_hessian: Small::new() }
    }

    /// Returns entry (a, b) of the Hessian as a functional.
    pub(crate) fn second_derivative(query: usize, dimension: usize, a: usize, b: usize) -> Self {
        let mut of_hessian = zeros(dimension * dimension);
        of_hessian[a * dimension + b] += 0.5;
        of_hessian[b * dimension + a] += 0.5;
        Self { query, of_value: 0.0, of_gradient: zeros(dimension), of_hessian }
    }

    /// Returns the functional for coordinates in units of ℓ, stretched by the kernel.
    ///
    /// Axis a has the factor `f_a = s_a/ℓ`, with s_a the kernel's stretch. The result has `f_a g_a` and
    /// `f_a f_b A_ab`.
    fn in_length_scales(&self, kernel: &Kernel) -> Self {
        let (mut found, d) = (self.clone(), self.of_gradient.len());
        let factor = |axis: usize| kernel.stretch(axis) / kernel.length_scale();
        found.of_gradient.iter_mut().enumerate().for_each(|(a, g)| *g *= factor(a));
        let entries = found.of_hessian.iter_mut().enumerate();
        entries.for_each(|(at, entry)| *entry *= factor(at / d) * factor(at % d));
        found
    }

    /// Returns the largest coefficient in magnitude, in units of ℓ, or 1 if all are 0.
    ///
    /// Squares of a functional divided by its size do not overflow.
    pub(super) fn size(&self, kernel: &Kernel) -> f64 {
        let Self { of_value, of_gradient, of_hessian, .. } = self.in_length_scales(kernel);
        let largest = of_gradient.iter().chain(&of_hessian).fold(of_value.abs(), |a, b| a.max(b.abs()));
        if largest > 0.0 { largest } else { 1.0 }
    }

    /// Returns the functional divided by `size`.
    pub(super) fn over(&self, size: f64) -> Self {
        let mut found = self.clone();
        found.of_value /= size;
        found.of_gradient.iter_mut().chain(&mut found.of_hessian).for_each(|entry| *entry /= size);
        found
    }

    /// Returns the functional applied to a mean.
    pub(super) fn of_mean(&self, trend: &Trend, queries: &Cloud) -> f64 {
        let value = if self.of_value == 0.0 { 0.0 } else { trend.at(queries.point(self.query)) };
        self.of_value * value + dot(&self.of_gradient, &trend.gradient())
    }

    /// Returns the functional applied to each function of a mean at the query's position x, `[p]`.
    ///
    /// These functions are linear, so A does not matter.
    pub(super) fn on_mean(&self, basis: &Basis, x: &[f64]) -> Vec<f64> {
        let mut functions = vec![0.0; basis.n_functions()];
        basis.at(x, &mut functions);
        functions.iter_mut().for_each(|f| *f *= self.of_value);
        basis.add_slopes(&self.of_gradient, &mut functions);
        functions
    }

    /// Returns the coefficients on derivatives in units of ℓ. The coefficient c of the value is left out.
    ///
    /// First `[d]` for the gradient, then the upper triangle of the Hessian. Entries off the diagonal count
    /// twice, once for each of their places.
    pub(super) fn coefficients(&self, kernel: &Kernel) -> Small {
        let Self { of_gradient, of_hessian, .. } = self.in_length_scales(kernel);
        let (mut coefficients, d) = (of_gradient, self.of_gradient.len());
        if !of_hessian.is_empty() {
            let pairs = (0..d).flat_map(|a| (a..d).map(move |b| (a, b)));
            let entry = |(a, b)| {
                if a == b { of_hessian[a * d + a] } else { of_hessian[a * d + b] + of_hessian[b * d + a] }
            };
            coefficients.extend(pairs.map(entry));
        }
        coefficients
    }

    fn has_derivatives(&self) -> bool {
        self.has_hessian() || self.of_gradient.iter().any(|g| *g != 0.0)
    }

    fn has_hessian(&self) -> bool {
        !self.of_hessian.is_empty()
    }

    /// Returns `sᵀAs` as a sum of products, one for each nonzero entry of the upper triangle of A.
    ///
    /// Entries off the diagonal count twice, once for each of their places.
    fn form(&self) -> Vec<FormTerm> {
        let d = self.of_gradient.len();
        let entry = |a: usize, b: usize| self.of_hessian[a * d + b];
        let pairs = (0..if self.has_hessian() { d } else { 0 }).flat_map(|a| (a..d).map(move |b| (a, b)));
        let term =
            |(a, b)| FormTerm { a, b, factor: if a == b { entry(a, a) } else { entry(a, b) + entry(b, a) } };
        pairs.map(term).filter(|term| term.factor != 0.0).collect()
    }

    fn trace(&self) -> f64 {
        self.of_hessian.iter().step_by(self.of_gradient.len() + 1).sum()
    }

    /// Returns the prior variance `FF'k`.
    ///
    /// The variance of the value is `vφ(0)`, that of a first derivative `−2vφ′(0)/ℓ²`. The variance of a
    /// second derivative is `12vφ″(0)/ℓ⁴` along one axis and `4vφ″(0)/ℓ⁴` for a mixed one. The value and a
    /// second derivative along an axis have the covariance `2vφ′(0)/ℓ²`.
    pub(crate) fn prior_variance(&self, kernel: &Kernel) -> f64 {
        let Self { of_value, of_gradient, of_hessian, .. } = &self.in_length_scales(kernel);
        let [value, slope, bend] = kernel.profile_at_zero();
        let first = 2.0 * slope;
        let mut total = of_value * of_value * value - first * dot(of_gradient, of_gradient);
        if self.has_hessian() {
            let trace: f64 = of_hessian.iter().step_by(of_gradient.len() + 1).sum();
            total += 2.0 * of_value * trace * first;
            total += 4.0 * bend * (trace * trace + 2.0 * dot(of_hessian, of_hessian));
        }
        kernel.variance() * total
    }
}

/// The term `factor · s_a s_b` of a quadratic form.
#[derive(Debug, Clone, Copy)]
struct FormTerm {
    a: usize,
    b: usize,
    factor: f64,
}

/// Returns whether the kernel's process has derivatives up to `order`, i.e. their variance is finite.
pub(crate) fn has_variance(kernel: &Kernel, order: usize) -> bool {
    match order {
        0 => true,
        1 => !kernel.has_kink(),
        _ => !kernel.has_kink() && kernel.has_second_derivatives(),
    }
}

/// A fitted function whose kernel and noise are `factor` times those of the solver.
#[derive(Clone, Copy)]
pub(crate) struct ScaledFit<'a> {
    pub(crate) solver: &'a Solver,
    pub(crate) solution: &'a Solution,
    pub(crate) factor: f64,
}

/// Standard deviations of functionals.
pub(crate) struct Deviations {
    /// `[functionals]`
    pub(crate) found: Vec<f64>,
    /// Functionals whose variance rounding made negative. Their deviation is 0.
    pub(crate) clamped: Vec<usize>,
}

/// Returns the posterior standard deviations of functionals given the values at the points.
///
/// # Errors
/// - [`NumericsError::DimensionMismatch`].
/// - [`NumericsError::KernelNotSmooth`] for derivatives at points of the cloud.
/// - [`NumericsError::NotPositiveDefinite`] without a Cholesky factor.
/// - [`NumericsError::Overflow`] if a deviation is not finite.
/// - [`NumericsError::Cancelled`].
pub(crate) fn deviations(
    fit: ScaledFit<'_>,
    queries: &Cloud,
    functionals: &[JetFunctional],
    observer: &dyn Observer,
) -> Result<Deviations> {
    let ScaledFit { solver, solution, factor } = fit;
    let kernel = solver.kernel();
    solver.cloud().check_same_dimension(queries)?;
    if functionals.iter().any(JetFunctional::has_derivatives) {
        check_smooth_at(solver.cloud(), kernel, queries, observer)?;
    }
    let covariances = Covariant::of(solver.known_points(), kernel);
    let of_mean =
        solution.trend.as_ref().map(|trend| MeanVariance::of(solver, trend, observer)).transpose()?;
    let (mut found, mut clamped) = (Vec::with_capacity(functionals.len()), Vec::new());
    for block in functionals.chunks(COLUMNS_AT_ONCE) {
        observer.checkpoint()?;
        // Normalised so that squares do not overflow.
        let sizes: Vec<f64> = block.iter().map(|functional| functional.size(kernel)).collect();
        let block: Vec<JetFunctional> = block.iter().zip(&sizes).map(|(of, &size)| of.over(size)).collect();
        observer.enter(Stage::Evaluate);
        let mut columns = vec![0.0; solver.known_points().n_points() * block.len()];
        covariances.fill(&block, queries, &mut columns);
        observer.enter(Stage::Solve);
        let whitened = solver.whitened(columns, observer)?;
        let variance = |(column, functional): (&[f64], &JetFunctional)| {
            let explained = whitened.explained(column, column);
            let unexplained = of_mean.as_ref().map(|mean| {
                let on_mean = functional.on_mean(mean.basis, queries.point(functional.query));
                let h = mean.unexplained(on_mean, column);
                mean.product(&h, &h)
            });
            let variance = functional.prior_variance(kernel) - explained;
            // NaN propagates.
            ((if variance < 0.0 { 0.0 } else { variance }) + unexplained.unwrap_or(0.0), variance < 0.0)
        };
        let columns = whitened.columns.par_chunks_exact(whitened.n_rows);
        let variances = columns.zip(&block).map(variance).collect::<Vec<_>>();
        let first = found.len();
        for (at, ((variance, is_negative), size)) in variances.into_iter().zip(sizes).enumerate() {
            found.push(factor.sqrt() * variance.sqrt() * size);
            if is_negative {
                clamped.push(first + at);
            }
        }
    }
    match found.iter().position(|deviation| !deviation.is_finite()) {
        Some(at) => Err(NumericsError::Overflow { query: functionals[at].query }),
        None => Ok(Deviations { found, clamped }),
    }
}

/// Covariances of functionals with the values at the points of a cloud.
pub(crate) struct Covariant<'a> {
    nodes: Nodes,
    kernel: &'a Kernel,
}

impl<'a> Covariant<'a> {
    pub(crate) fn of(cloud: &Cloud, kernel: &'a Kernel) -> Self {
        Self { nodes: Nodes::of(cloud), kernel }
    }

    /// Fills one column `[n]` per functional with `F k(·, x_j)` for all j.
    ///
    /// The caller ensures that the kernel has the derivatives.
    pub(crate) fn fill(&self, functionals: &[JetFunctional], queries: &Cloud, columns: &mut [f64]) {
        let Self { nodes, kernel } = self;
        columns.par_chunks_exact_mut(nodes.n_points()).zip(functionals).for_each(|(column, functional)| {
            let (x, functional) = (queries.point(functional.query), &functional.in_length_scales(kernel));
            let form = &functional.form();
            nodes.dispatch(Covariances { nodes, kernel, functional, form, x, column });
        });
    }
}

/// A pass that computes `F k(·, x_j)` for all j.
///
/// With s = (x − x_j)/ℓ it is `v[cφ + 2φ′(g·s + tr A) + 4φ″ sᵀAs]`. Here s, g and A are in units of ℓ,
/// stretched by the kernel.
struct Covariances<'a> {
    nodes: &'a Nodes,
    kernel: &'a Kernel,
    functional: &'a JetFunctional,
    /// The nonzero terms of `sᵀAs`: few for one entry of a Hessian, whatever the dimension.
    form: &'a [FormTerm],
    x: &'a [f64],
    column: &'a mut [f64],
}

impl WithSimd for Covariances<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { nodes, kernel, x, .. } = self;
        let inverse = 1.0 / kernel.length_scale();
        let mut differences = vec![Block::ZERO; x.len()];
        let mut profiles = [Block::ZERO; 3];
        for block in 0..self.column.len().div_ceil(BLOCK) {
            nodes.squared_distances(
                simd,
                BlockPairs { kernel, x, block },
                &mut profiles[0],
                &mut differences,
            );
            kernel.profiles(simd, profiles.each_mut().map(Block::registers_mut::<S>));
            for differences in &mut differences {
                for at in 0..Pack::<S>::PER_BLOCK {
                    (Pack::<S>::load(simd, differences, at) * inverse).store(differences, at);
                }
            }
            let start = block * BLOCK;
            let end = (start + BLOCK).min(self.column.len());
            let out = self.of(simd, &differences, &profiles);
            self.column[start..end].copy_from_slice(&out.0[..end - start]);
        }
    }
}

impl Covariances<'_> {
    /// Computes the covariances with the points of a block from the entries of s, `[d]`, and φ, φ′, φ″.
    #[inline(always)]
    fn of<S: Simd>(&self, simd: S, s: &[Block], [value, slope, bend]: &[Block; 3]) -> Block {
        let Self { kernel, functional, form: terms, .. } = self;
        let trace = if functional.has_hessian() { functional.trace() } else { 0.0 };
        let first = 2.0 * kernel.variance();
        let of_value = Pack::splat(simd, kernel.variance() * functional.of_value);
        let mut out = Block::ZERO;
        for at in 0..Pack::<S>::PER_BLOCK {
            let (mut along, mut form) = (Pack::<S>::splat(simd, 0.0), Pack::<S>::splat(simd, 0.0));
            for (s, &g) in s.iter().zip(&functional.of_gradient) {
                along = Pack::load(simd, s, at).mul_add(Pack::splat(simd, g), along);
            }
            for FormTerm { a, b, factor } in *terms {
                let other = Pack::load(simd, &s[*b], at) * *factor;
                form = Pack::load(simd, &s[*a], at).mul_add(other, form);
            }
            let of_slopes = first * Pack::load(simd, slope, at) * (along + trace);
            let of_bends = (2.0 * first) * Pack::load(simd, bend, at) * form;
            // At D = 0, φ″ may be as large as float64 allows.
            let jets = of_slopes + of_bends;
            Pack::load(simd, value, at).mul_add(of_value, jets).store(&mut out, at);
        }
        out
    }
}
