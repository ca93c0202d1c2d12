//! Value, gradient and Hessian of a kernel expansion at many queries.
//!
//! One fused pass over the points per query computes all of them.

mod centres;
mod pass;
mod tiles;
mod totals;

use rayon::prelude::*;

use super::nodes::{Nodes, blocked};
use crate::error::{NumericsError, Result};
use crate::kernel::Kernel;
use crate::machine::heap::vec_bytes;
use crate::machine::small::{Small, zeros};
use crate::observer::Observer;
use crate::points::cloud::Cloud;
use crate::points::duplicates::Positions;
use pass::Pass;
use totals::Expansion;

/// Queries per task. A task of one query at n = 2,000 is about 5 µs of work.
const QUERIES_PER_TASK: usize = 8;

/// Values of `u(x) = Σ_j λ_j k(x, x_j)` with derivatives up to an order, at m queries.
#[derive(Clone)]
pub struct Jets {
    packed: Vec<f64>,
    layout: Layout,
}

/// The derivatives that a pass computes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum JetOrder {
    Value,
    Gradient,
    Hessian,
    /// The Hessian, and the sums of absolute values that bound the rounding errors of value and gradient.
    HessianWithMagnitudes,
}

impl JetOrder {
    /// Returns the order of the highest derivatives, 0 to 2.
    pub fn degree(self) -> usize {
        match self {
            Self::Value => 0,
            Self::Gradient => 1,
            Self::Hessian | Self::HessianWithMagnitudes => 2,
        }
    }
}

/// The layout of one query's numbers: value, gradient `[d]`, upper triangle of the Hessian row by row, two
/// magnitudes. Lower orders end earlier.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Layout {
    order: JetOrder,
    dimension: usize,
}

impl Layout {
    pub(crate) fn new(order: JetOrder, dimension: usize) -> Self {
        Self { order, dimension }
    }

    fn gradient(self) -> usize {
        1
    }

    fn hessian(self) -> usize {
        1 + self.dimension
    }

    fn magnitudes(self) -> usize {
        self.hessian() + self.dimension * (self.dimension + 1) / 2
    }

    /// Numbers per query.
    pub(crate) fn width(self) -> usize {
        match self.order {
            JetOrder::Value => 1,
            JetOrder::Gradient => self.hessian(),
            JetOrder::Hessian => self.magnitudes(),
            JetOrder::HessianWithMagnitudes => self.magnitudes() + 2,
        }
    }

    /// Number of sums over the points behind a jet with a Hessian: one for each of its entries, and `Σλφ′`.
    fn n_sums(self) -> usize {
        self.magnitudes() + 1
    }

    /// Turns the sums `Σλφ`, `Σλφ′D_a`, `Σλφ″D_aD_b` and `Σλφ′` into as many entries of a jet as there is
    /// room for.
    ///
    /// The factors are `variance·{1, 2/ℓ², 4/ℓ⁴}`. The diagonal of the Hessian also gets
    /// `2·variance·Σλφ′/ℓ²`. If the kernel stretches coordinates, D are stretched differences, and a
    /// derivative along an axis takes the factor of this axis.
    ///
    /// Multiplications by 1/ℓ one after the other avoid ℓ⁴, which may leave float64.
    pub(crate) fn finish(self, kernel: &Kernel, sums: &[f64], jet: &mut [f64]) {
        let (variance, inverse) = (kernel.variance(), 1.0 / kernel.length_scale());
        let trace = 2.0 * variance * sums[self.magnitudes()] * inverse * inverse;
        let (mut row, mut column) = (0, 0);
        for (at, (slot, sum)) in jet.iter_mut().zip(sums).enumerate() {
            let sum = variance * sum;
            *slot = match at {
                0 => sum,
                at if at < self.hessian() => 2.0 * sum * inverse * inverse * kernel.stretch(at - 1),
                _ => {
                    let entry = 4.0 * sum * inverse * inverse * inverse * inverse;
                    let entry = if row == column { entry + trace } else { entry };
                    let entry = entry * kernel.stretch(row) * kernel.stretch(column);
                    column += 1;
                    if column == self.dimension {
                        row += 1;
                        column = row;
                    }
                    entry
                }
            };
        }
    }
}

impl Jets {
    /// Evaluates the expansion with `weights` (one per point of `cloud`) at the queries.
    ///
    /// Each query is summed in the order of the points, whatever the number of threads. The caller has
    /// checked that the kernel has the derivatives asked for (`check_smooth_at`).
    ///
    /// # Errors
    /// [`NumericsError::DimensionMismatch`] for queries of another dimension than the points,
    /// [`NumericsError::Overflow`] if a result leaves float64, [`NumericsError::Cancelled`].
    pub fn evaluate(
        cloud: &Cloud,
        kernel: &Kernel,
        weights: &[f64],
        queries: &Cloud,
        order: JetOrder,
        observer: &dyn Observer,
    ) -> Result<Self> {
        Self::over(&Nodes::of(cloud), kernel, weights, queries, order, observer)
    }

    /// Evaluates an expansion over points that are laid out already.
    ///
    /// # Errors
    /// Returns the errors of [`Jets::evaluate`].
    pub fn over(
        nodes: &Nodes,
        kernel: &Kernel,
        weights: &[f64],
        queries: &Cloud,
        order: JetOrder,
        observer: &dyn Observer,
    ) -> Result<Self> {
        let (expected, found) = (nodes.dimension(), queries.dimension());
        if expected != found {
            return Err(NumericsError::DimensionMismatch { expected, found });
        }
        let layout = Layout { order, dimension: nodes.dimension() };
        let (weights, width) = (blocked(weights), layout.width());
        let expansion = Expansion { nodes, kernel, weights: &weights };
        let mut packed = vec![0.0; queries.n_points() * width];
        packed.par_chunks_mut(width * QUERIES_PER_TASK).enumerate().try_for_each(|(task, jets)| {
            observer.checkpoint()?;
            let first = task * QUERIES_PER_TASK;
            nodes.dispatch(Pass { expansion, queries, first, jets, layout });
            match jets.iter().position(|x| !x.is_finite()) {
                Some(at) => Err(NumericsError::Overflow { query: first + at / width }),
                None => Ok(()),
            }
        })?;
        Ok(Self { packed, layout })
    }

    /// Evaluates value, gradient and Hessian at the points of the cloud themselves.
    ///
    /// Each pair is evaluated only once where that pays. The order of the sums then differs from
    /// [`Jets::evaluate`], and depends only on the number of points.
    ///
    /// # Errors
    /// Returns the errors of [`Jets::evaluate`].
    pub fn at_points(
        cloud: &Cloud,
        kernel: &Kernel,
        weights: &[f64],
        observer: &dyn Observer,
    ) -> Result<Self> {
        if cloud.dimension() > centres::MAX_DIMENSION || cloud.n_points() < centres::MIN_POINTS {
            return Self::evaluate(cloud, kernel, weights, cloud, JetOrder::Hessian, observer);
        }
        Self::by_half_of_the_pairs(&Nodes::of(cloud), cloud, kernel, weights, observer)
    }

    fn by_half_of_the_pairs(
        nodes: &Nodes,
        cloud: &Cloud,
        kernel: &Kernel,
        weights: &[f64],
        observer: &dyn Observer,
    ) -> Result<Self> {
        let layout = Layout { order: JetOrder::Hessian, dimension: cloud.dimension() };
        let expansion = Expansion { nodes, kernel, weights: &blocked(weights) };
        let packed = centres::jets(expansion, cloud, layout, observer)?;
        Ok(Self { packed, layout })
    }

    /// Wraps numbers that were computed elsewhere, `[m, width]`.
    pub(crate) fn of(layout: Layout, packed: Vec<f64>) -> Self {
        Self { packed, layout }
    }

    /// Adds a linear function, given by its value at a query and its gradient `[d]`.
    pub(crate) fn plus_linear(
        mut self,
        queries: &Cloud,
        gradient: &[f64],
        value: impl Fn(&[f64]) -> f64,
    ) -> Self {
        let layout = self.layout;
        for (jet, x) in self.packed.chunks_exact_mut(layout.width()).zip(queries.points()) {
            jet[0] += value(x);
            let slopes = jet[layout.gradient()..].iter_mut().zip(gradient);
            slopes.for_each(|(slot, slope)| *slot += slope);
        }
        self
    }

    pub fn n_queries(&self) -> usize {
        self.packed.len() / self.layout.width()
    }

    pub fn dimension(&self) -> usize {
        self.layout.dimension
    }

    /// Bytes held on the heap.
    pub(crate) fn n_bytes(&self) -> usize {
        vec_bytes(&self.packed)
    }

    fn jet(&self, query: usize) -> &[f64] {
        let width = self.layout.width();
        &self.packed[query * width..][..width]
    }

    /// u at a query, unit of the values.
    pub fn value(&self, query: usize) -> f64 {
        self.jet(query)[0]
    }

    /// u at every query, `[m]`.
    pub fn values(&self) -> Vec<f64> {
        (0..self.n_queries()).map(|query| self.value(query)).collect()
    }

    /// ∇u at a query, `[d]`.
    pub fn gradient(&self, query: usize) -> &[f64] {
        &self.jet(query)[self.layout.gradient()..][..self.layout.dimension]
    }

    /// ∇u at every query, `[m, d]`.
    pub fn gradients(&self) -> Vec<f64> {
        (0..self.n_queries()).flat_map(|query| self.gradient(query)).copied().collect()
    }

    /// D²u at a query, symmetric `[d, d]`.
    pub fn hessian(&self, query: usize) -> Small {
        let d = self.layout.dimension;
        let mut packed = self.jet(query)[self.layout.hessian()..].iter();
        let mut full = zeros(d * d);
        for a in 0..d {
            for (b, &entry) in (a..d).zip(&mut packed) {
                full[a * d + b] = entry;
                full[b * d + a] = entry;
            }
        }
        full
    }

    /// D²u at every query, `[m, d, d]`.
    pub fn hessians(&self) -> Vec<f64> {
        (0..self.n_queries()).flat_map(|query| self.hessian(query)).collect()
    }

    /// Returns `Σ|λ_j||k_j|` and `Σ|λ_j||∇k_j|` at a query. Only order [`JetOrder::HessianWithMagnitudes`]
    /// has them.
    pub(crate) fn magnitudes(&self, query: usize) -> (f64, f64) {
        let jet = self.jet(query);
        let at = self.layout.magnitudes();
        (jet[at], jet[at + 1])
    }
}

/// Refuses queries at which a kernel with a kink has no gradient.
///
/// # Errors
/// [`NumericsError::KernelNotSmooth`] with the first query that is a point of the cloud.
/// [`NumericsError::Cancelled`].
pub(crate) fn check_smooth_at(
    cloud: &Cloud,
    kernel: &Kernel,
    queries: &Cloud,
    observer: &dyn Observer,
) -> Result<()> {
    if !kernel.has_kink() {
        return Ok(());
    }
    let positions = Positions::of(cloud, observer)?;
    match queries.points().enumerate().find_map(|(query, x)| Some((query, positions.find(x)?))) {
        Some((query, point)) => Err(NumericsError::KernelNotSmooth { query, point }),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests;
