//! Answers of operators that the values do not bear out.
//!
//! Two things say so. Deviations that leave little of what is found: at the rim, far from the points, between points that are too few for the
//! kernel. And values that contradict it: by themselves they have the variance `YᵀPY/(n − p)` (Rasmussen and Williams 2006, sec. 5.4.1),
//! P the inverse of `K + N` without the p functions of the mean, and where that is many times what the kernel says, there is noise
//! that nobody has told, or a kernel far too smooth. Deviations as judged here are those of the values' own variance.

use super::super::geometry::Geometry;
use super::deviations::Applied;
use super::{Operator, regular};
use crate::numerics::error::NumericsError;
use crate::numerics::function::functionals::{deviations, has_variance};
use crate::numerics::function::interpolant::Interpolant;
use crate::numerics::machine::vector::norm;
use crate::numerics::observer::Observer;
use crate::numerics::points::cloud::Cloud;
use crate::numerics::points::neighbours::Neighbours;
use crate::numerics::points::thinning::thinned_points;

/// Functionals whose deviations are found: what they take is little beside a factorization of as many points as need them.
pub const JUDGED_FUNCTIONALS: usize = 128;

/// Deviations beyond this share of the root mean square of what is found leave little of it: an error of half of that is two deviations.
const UNCERTAIN: f64 = 0.25;

/// What is doubtful about an operator on values.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Doubts {
    /// Everything: the process has no derivatives of this order.
    TooRough,
    /// These queries, ascending.
    Uncertain(Vec<usize>),
}

/// What there is to judge: an operator on a function, of which kernel and noise are `factor` times those of the solver.
#[derive(Clone, Copy)]
pub struct Judged<'a> {
    pub geometry: &'a Geometry,
    pub interpolant: &'a Interpolant,
    pub factor: f64,
    pub queries: &'a Cloud,
    /// What was found, `[m, k]`.
    pub found: &'a [f64],
}

impl Judged<'_> {
    /// Judges `∇_M u`; see [`Judged::laplace_beltrami`].
    ///
    /// # Errors
    /// [`NumericsError::DimensionMismatch`], [`NumericsError::Cancelled`].
    pub fn surface_gradient(self, observer: &dyn Observer) -> Result<Doubts, NumericsError> {
        self.judge(Operator::SurfaceGradient, observer)
    }

    /// Judges `Δ_M u` by the deviations at queries that are spread as all are, [`JUDGED_FUNCTIONALS`] of them at most, of which each of the others has
    /// that of the nearest. Without a Cholesky factor nothing is known, and nothing doubtful.
    ///
    /// # Errors
    /// [`NumericsError::DimensionMismatch`], [`NumericsError::Cancelled`].
    pub fn laplace_beltrami(self, observer: &dyn Observer) -> Result<Doubts, NumericsError> {
        self.judge(Operator::LaplaceBeltrami, observer)
    }

    /// Judges by deviations that are known, `[m, k]`.
    pub fn by_deviations(self, deviations: &[f64]) -> Doubts {
        let own = overdispersion(self.interpolant, self.factor).sqrt();
        let k = self.n_components();
        let of = |query: usize| own * norm(&deviations[query * k..][..k]);
        Doubts::Uncertain(self.doubtful(regular(self.geometry).map(|query| (query, of(query)))))
    }

    fn judge(self, operator: Operator, observer: &dyn Observer) -> Result<Doubts, NumericsError> {
        let (solver, solution) = (&*self.interpolant.solver, &*self.interpolant.solution);
        if !has_variance(solver.kernel(), operator.order()) {
            return Ok(Doubts::TooRough);
        }
        let regular: Vec<usize> = regular(self.geometry).collect();
        if regular.is_empty() {
            return Ok(Doubts::Uncertain(regular));
        }
        let k = self.n_components();
        let places = self.queries.select(&regular);
        let chosen = thinned_points(&places, (JUDGED_FUNCTIONALS / k).max(1));
        let Self { geometry, interpolant, factor, queries, .. } = self;
        let applied = Applied { geometry, interpolant, factor, queries };
        let functionals: Vec<_> =
            chosen.iter().flat_map(|&at| applied.functionals(operator, regular[at])).collect();
        let of_chosen = match deviations((solver, solution, factor), queries, &functionals, observer) {
            Ok(found) => found,
            Err(NumericsError::NotPositiveDefinite { .. }) => return Ok(Doubts::Uncertain(Vec::new())),
            Err(error) => return Err(error),
        };
        let own = overdispersion(interpolant, factor).sqrt();
        let of_chosen: Vec<f64> = of_chosen.chunks_exact(k).map(|of| own * norm(of)).collect();
        let coarse = places.select(&chosen);
        let near = Neighbours::of(&coarse);
        let nearest = |at: usize| near.nearest(&coarse, places.point(at), 1)[0].point;
        let all = regular.iter().enumerate().map(|(at, &query)| (query, of_chosen[nearest(at)]));
        Ok(Doubts::Uncertain(self.doubtful(all)))
    }

    fn n_components(&self) -> usize {
        self.found.len() / self.queries.n_points()
    }

    /// Queries whose deviation leaves little.
    fn doubtful(&self, deviations: impl Iterator<Item = (usize, f64)>) -> Vec<usize> {
        let k = self.n_components();
        let norms: Vec<f64> =
            regular(self.geometry).map(|query| norm(&self.found[query * k..][..k])).collect();
        let least = UNCERTAIN * norm(&norms) / (norms.len() as f64).sqrt();
        deviations.filter(|(_, deviation)| *deviation > least).map(|(query, _)| query).collect()
    }
}

/// The variance that the values have by themselves over that of the kernel, 1 at least.
fn overdispersion(interpolant: &Interpolant, factor: f64) -> f64 {
    let solution = &interpolant.solution;
    let n_functions = solution.trend.as_ref().map_or(0, |trend| trend.of_coordinates().len());
    let n_free = interpolant.solver.n_points().saturating_sub(n_functions).max(1);
    (solution.energy / (n_free as f64 * factor)).max(1.0)
}
