//! Answers of operators that the values do not support.
//!
//! A learned kernel fits the values, and its deviations are about as large as its errors. A given kernel may
//! not fit the values. It may be too wide for what they show, have less noise than they have, or be about 0
//! where they have an offset. For a given kernel, errors are those of the served answers if the values come
//! from the process that would have been learned.

use rayon::prelude::*;

use super::deviations::functionals;
use super::{Operator, regular};
use crate::error::{NumericsError, Result};
use crate::kernel::Kernel;
use crate::machine::vector::norm;
use crate::observer::Observer;
use crate::points::cloud::Cloud;
use crate::points::neighbours::{Neighbour, Neighbours};
use crate::points::thinning::thinned_points;
use crate::regression::function::errors::{Judgement, Process};
use crate::regression::function::functionals::{JetFunctional, ScaledFit, deviations, has_variance};
use crate::regression::function::interpolant::Interpolant;
use crate::regression::selection::LearnedModel;
use crate::regression::solver::trend::Trend;
use crate::regression::sums::regularization::Regularization;
use crate::surface::geometry::Geometry;

/// Most functionals whose errors are computed. They cost little beside a factorization of as many points as
/// need them.
pub(crate) const JUDGED_FUNCTIONALS: usize = 256;

/// Nearest judged queries of a query that is not judged itself. It takes the greatest of their errors.
const AROUND: usize = 4;

/// Largest deviation of a sure answer, over the root mean square of the true answers. An error of half of
/// that root mean square is two and a half such deviations.
const UNCERTAIN: f64 = 0.2;

/// Least share of answers that are sure. If fewer seem sure, their errors were taken for too small, and no
/// answer is believed.
const BELIEVED: f64 = 0.1;

/// Halvings of an interval of 52 binary digits, which leave three decimal digits.
const STEPS: usize = 16;

/// Weight of the prior, in queries.
const N_BEFOREHAND: usize = 4;

/// Answers to be judged: an operator on a function. Kernel and noise are `factor` times those of the solver.
#[derive(Clone, Copy)]
pub struct OperatorAnswers<'a> {
    pub geometry: &'a Geometry,
    pub interpolant: &'a Interpolant,
    pub factor: f64,
    pub queries: &'a Cloud,
    /// Answers of the operator, `[m, k]`.
    pub found: &'a [f64],
    /// Process learned from the values, where the kernel is given.
    pub learned: Option<&'a LearnedModel>,
}

impl OperatorAnswers<'_> {
    /// Finds the queries, ascending, that known deviations `[m, k]` make uncertain.
    ///
    /// # Errors
    /// [`NumericsError::InvalidKernelParameter`] for a process beyond float64.
    pub fn by_deviations(self, deviations: &[f64]) -> Result<Vec<usize>> {
        let (kernel, factor) = self.process()?;
        let findings = Findings { geometry: self.geometry, found: self.found, kernel: &kernel, factor };
        let k = findings.n_components();
        let operator = if k == 1 { Operator::LaplaceBeltrami } else { Operator::SurfaceGradient };
        let some: Vec<usize> = regular(self.geometry).take(findings.n_judged()).collect();
        Ok(findings.doubtful(deviations, &self.functionals(operator, &some)))
    }

    /// Finds the queries, ascending, at which the answers of an operator are uncertain.
    ///
    /// Errors are computed for at most `JUDGED_FUNCTIONALS` functionals, at queries that are spread as all
    /// queries are. Each of the other queries takes the greatest error of those around it. All queries are
    /// uncertain for a kernel whose process has no such derivatives.
    ///
    /// # Errors
    /// [`NumericsError::DimensionMismatch`], [`NumericsError::MeanNotDetermined`],
    /// [`NumericsError::Overflow`], [`NumericsError::Cancelled`].
    pub fn judge(self, operator: Operator, observer: &dyn Observer) -> Result<Vec<usize>> {
        let regular: Vec<usize> = regular(self.geometry).collect();
        let has_derivatives = has_variance(self.interpolant.solver.kernel(), operator.order().degree());
        if regular.is_empty() || !has_derivatives {
            return Ok(regular);
        }
        let (kernel, factor) = self.process()?;
        let findings = Findings { geometry: self.geometry, found: self.found, kernel: &kernel, factor };
        let k = findings.n_components();
        let places = self.queries.select(&regular);
        let chosen = thinned_points(&places, findings.n_judged(), observer)?;
        let judged: Vec<usize> = chosen.iter().map(|&at| regular[at]).collect();
        let functionals = self.functionals(operator, &judged);
        let errors = self.errors(&functionals, observer)?;
        let errors: Vec<f64> = errors.chunks_exact(k).map(norm).collect();
        let most = findings.most(judged.into_iter().zip(errors.iter().copied()), &functionals);
        let coarse = places.select(&chosen);
        let near = Neighbours::of(&coarse, observer)?;
        let is_doubtful = |found: &mut Vec<Neighbour>, at: usize| {
            observer.checkpoint()?;
            near.nearest_into(places.point(at), AROUND, found);
            let count = if found[0].squared_distance == 0.0 { 1 } else { found.len() };
            Ok::<_, NumericsError>(!found[..count].iter().all(|n| errors[n.point] <= most))
        };
        let doubtful: Vec<bool> =
            (0..regular.len()).into_par_iter().map_init(Vec::new, is_doubtful).collect::<Result<_, _>>()?;
        let n_sure = doubtful.iter().filter(|is_doubtful| !**is_doubtful).count();
        let is_believed = n_sure as f64 >= BELIEVED * regular.len() as f64;
        let is_left = |&(_, is_doubtful): &(usize, bool)| is_doubtful || !is_believed;
        Ok(regular.into_iter().zip(doubtful).filter(is_left).map(|(query, _)| query).collect())
    }

    fn functionals(&self, operator: Operator, judged: &[usize]) -> Vec<JetFunctional> {
        judged.iter().flat_map(|&query| functionals(self.geometry, operator, query)).collect()
    }

    /// Returns the kernel of the process that the values come from, and its scale factor.
    ///
    /// Beside a kernel that stretches coordinates, the process is learned in the stretched coordinates.
    fn process(&self) -> Result<(Kernel, f64)> {
        let own = self.interpolant.solver.kernel();
        let Some(learned) = self.learned else { return Ok((own.clone(), self.factor)) };
        let found = learned.kernel(1.0)?;
        let kernel = match own.length_scales() {
            None => found,
            Some(axes) => {
                let of_axis = |axis: usize| found.length_scale() / found.stretch(axis);
                let scaled = (0..axes.len()).map(|axis| axes[axis] / own.length_scale() * of_axis(axis));
                Kernel::of_axes(learned.family, &scaled.collect::<Vec<f64>>(), 1.0)?
            }
        };
        Ok((kernel, learned.variance))
    }

    fn errors(&self, functionals: &[JetFunctional], observer: &dyn Observer) -> Result<Vec<f64>> {
        let (interpolant, queries) = (self.interpolant, self.queries);
        let (solver, solution) = (&*interpolant.solver, &*interpolant.solution);
        let (kernel, factor) = (&self.process()?.0, self.process()?.1);
        let errors_under = |noise: f64, trend: Option<&Trend>| {
            let process = Process { kernel, noise, factor, trend };
            Judgement { process, interpolant, queries }.errors(functionals, observer)
        };
        if let Some(LearnedModel { ratio, trend, .. }) = self.learned {
            return errors_under(*ratio, trend.as_ref());
        }
        match deviations(ScaledFit { solver, solution, factor }, queries, functionals, observer) {
            // The pivoted fallback has no variances, but it has weights.
            Err(NumericsError::NotPositiveDefinite { .. }) => {
                let noise = match solver.regularization() {
                    Regularization::Uniform(alpha) => *alpha,
                    Regularization::PerPoint(_) => 0.0,
                };
                errors_under(noise, solution.trend.as_ref())
            }
            found => found.map(|found| found.found),
        }
    }
}

/// Answers of an operator, for a process with a kernel that is scaled by a factor.
pub(super) struct Findings<'a> {
    pub(super) geometry: &'a Geometry,
    /// Answers of the operator, `[m, k]`.
    pub(super) found: &'a [f64],
    pub(super) kernel: &'a Kernel,
    pub(super) factor: f64,
}

impl Findings<'_> {
    fn n_components(&self) -> usize {
        self.found.len() / self.geometry.n_queries()
    }

    /// Returns how many queries are judged at most.
    pub(super) fn n_judged(&self) -> usize {
        (JUDGED_FUNCTIONALS / self.n_components()).max(1)
    }

    /// Finds the queries, ascending, that deviations `[m, k]` make uncertain. `functionals` are those of some
    /// queries.
    pub(super) fn doubtful(&self, deviations: &[f64], functionals: &[JetFunctional]) -> Vec<usize> {
        let k = self.n_components();
        let of = |query: usize| (query, norm(&deviations[query * k..][..k]));
        let most = self.most(regular(self.geometry).map(of), functionals);
        // NaN counts as doubtful.
        let is_sure = |(_, deviation): &(usize, f64)| *deviation <= most;
        regular(self.geometry).map(of).filter(|of| !is_sure(of)).map(|(query, _)| query).collect()
    }

    /// Computes the largest deviation of a sure answer, from deviations at some queries.
    ///
    /// Squares f² of the answers are those of the true answers plus those of the errors e. Between points of
    /// random density errors differ so much that their mean carries no information. So the mean square of the
    /// true answers is the s² for which `Σ f²/(s² + e²)` is the number of queries (Paule and Mandel 1982). A
    /// few queries may all lie where there is nothing to find: the prior counts like [`N_BEFOREHAND`] more.
    fn most(&self, deviations: impl Iterator<Item = (usize, f64)>, functionals: &[JetFunctional]) -> f64 {
        let k = self.n_components();
        let prior: f64 = functionals.iter().map(|functional| functional.prior_variance(self.kernel)).sum();
        let beforehand = (prior * k as f64 / functionals.len().max(1) as f64).sqrt() * self.factor.sqrt();
        let lengths = deviations.map(|(query, error)| (norm(&self.found[query * k..][..k]), error));
        let lengths: Vec<(f64, f64)> = lengths.chain([(beforehand, 0.0); N_BEFOREHAND]).collect();
        // In units of the greatest length, because its square may overflow. Without a positive one nothing is
        // sure.
        let unit = lengths.iter().map(|(found, _)| *found).fold(0.0, f64::max);
        let squared = |&(found, error): &(f64, f64)| ((found / unit).powi(2), (error / unit).powi(2));
        let squares: Vec<(f64, f64)> = lengths.iter().map(squared).collect();
        // Errors that the process does not expect would count as true answers, so the prior bounds them.
        UNCERTAIN * (unit * spread_beside_errors(&squares).sqrt()).min(beforehand)
    }
}

/// Solves `Σ f²/(s² + e²) = n` for s², from n pairs of f² and e². Returns 0 without a positive solution.
fn spread_beside_errors(squares: &[(f64, f64)]) -> f64 {
    let n = squares.len() as f64;
    let excess = |s: f64| squares.iter().map(|(found, error)| found / (s + error)).sum::<f64>() - n;
    let mut most = squares.iter().map(|(found, _)| found).sum::<f64>() / n;
    let mut least = most * f64::EPSILON;
    if least == 0.0 || excess(least) <= 0.0 {
        return 0.0;
    }
    // The excess falls with s², and is negative at the mean of f². The logarithm is bisected.
    for _ in 0..STEPS {
        let middle = (least * most).sqrt();
        if excess(middle) > 0.0 { least = middle } else { most = middle }
    }
    least
}
