//! Batches of functions on one cloud that differ only in their values.

use std::sync::Arc;

use crate::error::Result;
use crate::observer::{Observer, Stage};
use crate::points::cloud::Cloud;
use crate::regression::function::interpolant::Interpolant;
use crate::regression::solver::trend::Mean;
use crate::regression::solver::{Solution, Solver};
use crate::regression::sums::jets::JetOrder;
use crate::regression::sums::many::values_of_each;

/// k functions `u_i(x) = m_i(x) + Σ_j λ_ij k(x, z_j)` over the centres of one solver.
pub struct Batch {
    pub solver: Arc<Solver>,
    /// `[k]`
    pub solutions: Vec<Arc<Solution>>,
}

/// Jets of k functions at m queries.
#[derive(Debug, Clone, Default)]
pub struct BatchJets {
    /// `[k, m]`, unit V.
    pub values: Vec<f64>,
    /// `[k, m, d]`, unit V/L; empty unless asked for.
    pub gradients: Vec<f64>,
    /// `[k, m, d, d]`, unit V/L²; empty unless asked for.
    pub hessians: Vec<f64>,
}

impl Batch {
    /// Fits k lists of values `[k, n]`, each with a mean of its own.
    ///
    /// # Errors
    /// Returns the errors of [`Solution::of_each`].
    pub fn fit(solver: Arc<Solver>, values: &[f64], mean: Mean, observer: &dyn Observer) -> Result<Self> {
        let solutions = Solution::of_each(&solver, values, mean, observer)?;
        Ok(Self { solver, solutions: solutions.into_iter().map(Arc::new).collect() })
    }

    /// Iterates over the functions, each as an interpolant of its own.
    pub fn interpolants(&self) -> impl Iterator<Item = Interpolant> {
        let with = |solution: &Arc<Solution>| Interpolant {
            solver: self.solver.clone(),
            solution: solution.clone(),
        };
        self.solutions.iter().map(with)
    }

    /// Evaluates all functions at queries `[m, d]`.
    ///
    /// # Errors
    /// Returns the errors of [`Interpolant::at`].
    pub fn at(&self, queries: &Cloud, order: JetOrder, observer: &dyn Observer) -> Result<BatchJets> {
        if order == JetOrder::Value {
            return Ok(BatchJets { values: self.values_at(queries, observer)?, ..BatchJets::default() });
        }
        let mut found = BatchJets::default();
        for function in self.interpolants() {
            let jets = function.at(queries, order, observer)?;
            found.values.extend(jets.values());
            found.gradients.extend(jets.gradients());
            if order == JetOrder::Hessian {
                found.hessians.extend(jets.hessians());
            }
        }
        Ok(found)
    }

    fn values_at(&self, queries: &Cloud, observer: &dyn Observer) -> Result<Vec<f64>> {
        self.solver.cloud().check_same_dimension(queries)?;
        observer.enter(Stage::Evaluate);
        let Some(first) = self.solutions.first() else { return Ok(Vec::new()) };
        // All lists have weights at the same centres, since a solver decides where they are.
        let expansion = self.solver.expansion(&first.weights);
        let weights: Vec<f64> =
            self.solutions.iter().flat_map(|solution| solution.weights.iter().copied()).collect();
        let mut values = values_of_each(expansion.centres, expansion.kernel, &weights, queries, observer)?;
        for (values, solution) in values.chunks_exact_mut(queries.n_points()).zip(&self.solutions) {
            let Some(trend) = &solution.trend else { continue };
            values.iter_mut().zip(queries.points()).for_each(|(value, x)| *value += trend.at(x));
        }
        Ok(values)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::NumericsError;
    use crate::kernel::Kernel;
    use crate::observer::Unobserved;
    use crate::regression::solver::System;
    use crate::regression::sums::regularization::Regularization;
    use crate::testing::{all_families, fibonacci_sphere};

    /// Three lists of n values: around 1000, all zero, and of magnitude 1e6.
    fn lists(n: usize) -> Vec<f64> {
        let list = |offset: f64, factor: f64| {
            (0..n).map(move |i| offset + factor * (0.37 * i as f64).sin()).collect::<Vec<f64>>()
        };
        [list(1e3, 1.0), list(0.0, 0.0), list(-2.0, 1e6)].concat()
    }

    #[test]
    fn each_function_is_what_its_values_give_alone() {
        let (n, m) = (300, 300);
        let (cloud, queries) = (Arc::new(fibonacci_sphere(n)), fibonacci_sphere(m));
        for family in all_families() {
            for (mean, alpha) in [(Mean::Zero, 1e-3), (Mean::Constant, 1e-4), (Mean::Linear, 1e-2)] {
                let kernel = Kernel::new(family, 0.4, 2.0).unwrap();
                let alpha = Regularization::uniform(alpha).unwrap();
                let system = System::new(cloud.clone(), kernel, alpha).unwrap();
                let solver = Arc::new(Solver::dense(system, &Unobserved).unwrap());
                let values = lists(n);
                let batch = Batch::fit(solver.clone(), &values, mean, &Unobserved).unwrap();
                let found = batch.at(&queries, JetOrder::Value, &Unobserved).unwrap();
                for (at, list) in values.chunks_exact(n).enumerate() {
                    let alone = Interpolant::fit_with_mean(solver.clone(), list, mean, &Unobserved).unwrap();
                    let jets = alone.at(&queries, JetOrder::Value, &Unobserved).unwrap();
                    // Sums of 300 terms run in another order, and solves differ in their last bits.
                    let size = list.iter().fold(0.0f64, |a, v| a.max(v.abs()));
                    let allowed = 1e-9 * size;
                    for (query, value) in jets.values().iter().enumerate() {
                        let difference = (found.values[at * m + query] - value).abs();
                        assert!(difference <= allowed, "{family:?} {mean:?} list {at}: {difference}");
                    }
                    let solution = &batch.solutions[at];
                    assert!((solution.energy - alone.solution.energy).abs() <= 1e-9 * alone.solution.energy);
                    // A residual that is rounding (Higham 2002, th. 7.1) is not refined.
                    let largest = solution.weights.iter().fold(0.0f64, |a, w| a.max(w.abs()));
                    let rounding = f64::EPSILON * (solver.norm1() * largest + size);
                    assert!(solution.relative_residual <= 1e-12 || solution.residual_max <= rounding);
                }
            }
        }
    }

    #[test]
    fn derivatives_are_those_of_each_and_lists_that_are_not_whole_are_refused() {
        let cloud = Arc::new(fibonacci_sphere(60));
        let kernel = Kernel::new(all_families()[0], 0.8, 1.0).unwrap();
        let system = System::new(cloud.clone(), kernel, Regularization::uniform(1e-6).unwrap()).unwrap();
        let solver = Arc::new(Solver::dense(system, &Unobserved).unwrap());
        let batch = Batch::fit(solver.clone(), &lists(60), Mean::Constant, &Unobserved).unwrap();
        let queries = fibonacci_sphere(7);
        let found = batch.at(&queries, JetOrder::Hessian, &Unobserved).unwrap();
        for (at, function) in batch.interpolants().enumerate() {
            let jets = function.at(&queries, JetOrder::Hessian, &Unobserved).unwrap();
            assert_eq!(found.gradients[at * 21..][..21], jets.gradients());
            assert_eq!(found.hessians[at * 63..][..63], jets.hessians());
        }
        let refused = Batch::fit(solver, &lists(60)[1..], Mean::Zero, &Unobserved);
        assert!(matches!(refused.err(), Some(NumericsError::LengthMismatch { .. })));
    }
}
