//! A Cholesky factorization as plain numbers, which one process takes out and another one restores.

use std::sync::Arc;

use super::dense::Cholesky;
use super::factorized::{Factorization, Solver};
use crate::error::Result;
use crate::machine::pages::SpareBuffer;
use crate::regression::solver::system::System;

/// Parts of a factorization besides its system.
#[derive(Clone, Copy)]
pub struct Factor<'a> {
    /// L in its memory layout (packed.rs).
    pub numbers: &'a [f64],
    /// `(K + αI)⁻¹·1`, `[n]`.
    pub weights_of_one: &'a [f64],
    /// `‖K + αI‖₁`.
    pub norm1: f64,
    pub reciprocal_condition: f64,
}

/// A builder that receives the numbers of a factor in their order.
pub struct FactorBuilder {
    factor: Cholesky,
    n_filled: usize,
}

impl FactorBuilder {
    /// Allocates memory for the factor of n points.
    ///
    /// # Errors
    /// `NumericsError::OutOfMemory`.
    pub fn new(spare: &Arc<SpareBuffer>, n_points: usize) -> Result<Self> {
        Ok(Self { factor: Cholesky::blank(spare, n_points)?, n_filled: 0 })
    }

    /// Returns how many numbers are missing.
    pub fn n_missing(&self) -> usize {
        self.factor.numbers().len() - self.n_filled
    }

    /// Takes the next numbers. Numbers beyond the last one are ignored.
    pub fn push(&mut self, numbers: impl Iterator<Item = f64>) {
        let rest = &mut self.factor.numbers_mut()[self.n_filled..];
        self.n_filled += rest.iter_mut().zip(numbers).map(|(to, from)| *to = from).count();
    }
}

impl Solver {
    /// Restores a solver from its [`Factor`]. Returns `None` unless that is complete and has the size of the
    /// system.
    pub fn restore(
        factor: FactorBuilder,
        system: System,
        weights_of_one: Vec<f64>,
        norm1: f64,
        reciprocal_condition: f64,
    ) -> Option<Self> {
        let n = system.n_points();
        let is_whole = factor.n_missing() == 0 && factor.factor.n_points() == n && weights_of_one.len() == n;
        let factorization = Factorization::Cholesky(factor.factor);
        let reciprocal_condition = Some(reciprocal_condition);
        is_whole.then_some(Self { system, factorization, norm1, reciprocal_condition, weights_of_one })
    }

    /// Returns the factor for storage elsewhere, or `None` if the fallback took its place.
    pub fn factor(&self) -> Option<Factor<'_>> {
        match &self.factorization {
            Factorization::Cholesky(factor) => Some(Factor {
                numbers: factor.numbers(),
                weights_of_one: &self.weights_of_one,
                norm1: self.norm1,
                reciprocal_condition: self.reciprocal_condition.unwrap_or_default(),
            }),
            Factorization::PivotedCholesky { .. }
            | Factorization::Landmark(_)
            | Factorization::Iterative(_) => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::{Family, Kernel};
    use crate::observer::Unobserved;
    use crate::points::cloud::Cloud;
    use crate::regression::solver::Solver;
    use crate::regression::sums::regularization::Regularization;
    use faer::MatMut;

    fn system(n: usize) -> System {
        let points = (0..3 * n).map(|i| (i as f64 * 0.7).sin() * 3.0 + i as f64 * 0.01).collect();
        let kernel = Kernel::new(Family::Gauss, 0.4, 1.5).unwrap();
        let cloud = Arc::new(Cloud::new(points, 3).unwrap());
        System::new(cloud, kernel, Regularization::uniform(1e-3).unwrap()).unwrap()
    }

    #[test]
    fn a_factor_that_is_put_together_again_solves_to_the_same_bits() {
        for n in [1, 2, 7, 64, 505] {
            let solver = Solver::dense(system(n), &Unobserved).unwrap();
            let Factor { numbers, weights_of_one, norm1, reciprocal_condition } = solver.factor().unwrap();
            let mut builder = FactorBuilder::new(&SpareBuffer::up_to(0), n).unwrap();
            for piece in numbers.chunks(100) {
                builder.push(piece.iter().copied());
            }
            let of = |solver: &Solver| {
                let mut x: Vec<f64> = (0..n).map(|i| (i as f64).cos()).collect();
                solver
                    .solve_in_place(MatMut::from_column_major_slice_mut(&mut x, n, 1), &Unobserved)
                    .unwrap();
                (x, solver.log_determinant().unwrap())
            };
            let again =
                Solver::restore(builder, system(n), weights_of_one.to_vec(), norm1, reciprocal_condition)
                    .unwrap();
            assert_eq!(of(&again), of(&solver), "{n}");
            assert_eq!(again.reciprocal_condition(), solver.reciprocal_condition());
        }
    }

    #[test]
    fn what_is_not_whole_is_no_factor() {
        let solver = Solver::dense(system(9), &Unobserved).unwrap();
        let Factor { numbers, weights_of_one, norm1, reciprocal_condition } = solver.factor().unwrap();
        for (n_numbers, n_points, n_weights) in
            [(numbers.len() - 1, 9, 9), (numbers.len(), 8, 9), (numbers.len(), 9, 8)]
        {
            let mut builder = FactorBuilder::new(&SpareBuffer::up_to(0), 9).unwrap();
            builder.push(numbers[..n_numbers].iter().copied());
            let weights = weights_of_one[..n_weights].to_vec();
            assert!(
                Solver::restore(builder, system(n_points), weights, norm1, reciprocal_condition).is_none()
            );
        }
    }
}
