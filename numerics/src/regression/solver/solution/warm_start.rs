//! Where an iteration starts: at the combination of earlier solutions that leaves least of the values.
//!
//! Values that change little from one request to the next, or evenly, as those of sensors and simulations do,
//! are nearly combinations of the last ones. As `A wⱼ` is known for each earlier `wⱼ`, with A = K + αI, the
//! least squares of `y − Σⱼ cⱼ A wⱼ` take no pass over pairs of points (Fischer 1998, "Projection techniques
//! for iterative solution of Ax = b with successive right-hand sides").

use super::RightHandSide;
use super::candidate::Candidate;
use crate::error::Result;
use crate::machine::vector::{dot, norm};
use crate::observer::Observer;
use crate::regression::solver::Solver;

/// Part of the values that a start may leave. One that leaves more saves less than an iteration, and values
/// without relation to earlier ones are better solved as if there were none.
const WORTH: f64 = 0.1;

/// Least part of an earlier product that the others must leave of it. With less, it adds rounding alone.
const DEPENDENT: f64 = 1e-4;

/// Weights with their product by A.
struct Direction {
    weights: Vec<f64>,
    product: Vec<f64>,
}

/// Returns the best start, if it is worth it.
///
/// # Errors
/// [`crate::error::NumericsError::Cancelled`].
pub(super) fn warm_start(
    solver: &Solver,
    sought: RightHandSide<'_>,
    observer: &dyn Observer,
) -> Result<Option<Candidate>> {
    let RightHandSide { values, earlier } = sought;
    let mut left = Direction { weights: vec![0.0; values.len()], product: values.to_vec() };
    let mut basis: Vec<Direction> = Vec::with_capacity(earlier.len());
    for solution in earlier.iter().filter(|solution| solution.product.len() == values.len()) {
        observer.checkpoint()?;
        let (weights, product) = (solution.weights.clone(), solution.product.clone());
        if let Some(direction) = (Direction { weights, product }).orthogonal_to(&basis) {
            left.remove(&direction);
            basis.push(direction);
        }
    }
    let weights: Vec<f64> = left.weights.iter().map(|weight| -weight).collect();
    // What is not finite is not worth it either.
    if !(norm(&left.product) < WORTH * norm(values) && weights.iter().all(|weight| weight.is_finite())) {
        return Ok(None);
    }
    let noise = solver.regularization();
    let at_point = |i: usize| values[i] - left.product[i] - noise.at(i) * weights[i];
    let at_points = (0..values.len()).map(at_point).collect();
    Ok(Some(Candidate::evaluated(solver, values, weights, at_points)))
}

impl Direction {
    /// Removes the part along a direction whose product has length 1.
    fn remove(&mut self, direction: &Self) {
        let part = dot(&self.product, &direction.product);
        let pairs = self.product.iter_mut().zip(&direction.product);
        pairs.for_each(|(entry, along)| *entry -= part * along);
        let pairs = self.weights.iter_mut().zip(&direction.weights);
        pairs.for_each(|(entry, along)| *entry -= part * along);
    }

    /// Scales what the others leave to a product of length 1. `None` if that is next to nothing.
    fn orthogonal_to(mut self, others: &[Self]) -> Option<Self> {
        let whole = norm(&self.product);
        // Twice is enough (Giraud, Langou, Rozložník and van den Eshof 2005).
        others.iter().chain(others).for_each(|other| self.remove(other));
        let size = norm(&self.product);
        if whole == 0.0 || !whole.is_finite() || size <= DEPENDENT * whole {
            return None;
        }
        self.product.iter_mut().chain(&mut self.weights).for_each(|entry| *entry /= size);
        Some(self)
    }
}
