//! Value, gradient and Hessian of a kernel expansion at many queries, in one fused pass over the points per query.

use pulp::{Simd, WithSimd};
use rayon::prelude::*;

use super::cloud::Cloud;
use super::duplicates::Positions;
use super::error::NumericsError;
use super::kernel::{Kernel, Pairs};
use super::nodes::{Nodes, blocked};
use super::observer::Observer;
use super::simd::{Block, Pack};
use super::tiles::{Sum, add_gradient, add_hessian};

/// Queries per task; a task of one query at n = 2,000 is about 5 µs of work.
const QUERIES_PER_TASK: usize = 8;

/// `u(x) = Σ_j λ_j k(x, x_j)` with its derivatives up to an order, at m queries.
#[derive(Clone)]
pub struct Jets {
    packed: Vec<f64>,
    layout: Layout,
}

/// Which derivatives a pass computes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum JetOrder {
    Value,
    Gradient,
    Hessian,
    /// The Hessian, and the sums of absolute values that bound the rounding errors of value and gradient.
    HessianWithMagnitudes,
}

/// One query's numbers: value, gradient `[d]`, upper triangle of the Hessian row by row, two magnitudes.
#[derive(Debug, Clone, Copy)]
struct Layout {
    order: JetOrder,
    dimension: usize,
}

impl Layout {
    fn gradient(self) -> usize {
        1
    }

    fn hessian(self) -> usize {
        1 + self.dimension
    }

    fn magnitudes(self) -> usize {
        self.hessian() + self.dimension * (self.dimension + 1) / 2
    }

    fn width(self) -> usize {
        match self.order {
            JetOrder::Value => 1,
            JetOrder::Gradient => self.hessian(),
            JetOrder::Hessian => self.magnitudes(),
            JetOrder::HessianWithMagnitudes => self.magnitudes() + 2,
        }
    }
}

impl Jets {
    /// Evaluates the expansion with `weights` (one per point of `cloud`) at the queries.
    ///
    /// Each query is summed in the order of the points, whatever the number of threads. The caller has checked that the
    /// kernel has the derivatives asked for ([`check_smooth_at`]).
    ///
    /// # Errors
    /// [`NumericsError::Overflow`] where a result leaves float64, [`NumericsError::Cancelled`].
    pub fn evaluate(
        cloud: &Cloud,
        kernel: &Kernel,
        weights: &[f64],
        queries: &Cloud,
        order: JetOrder,
        observer: &dyn Observer,
    ) -> Result<Self, NumericsError> {
        Self::over(&Nodes::of(cloud), kernel, weights, queries, order, observer)
    }

    /// The same over points that are laid out already.
    ///
    /// # Errors
    /// Those of [`Jets::evaluate`].
    pub fn over(
        nodes: &Nodes,
        kernel: &Kernel,
        weights: &[f64],
        queries: &Cloud,
        order: JetOrder,
        observer: &dyn Observer,
    ) -> Result<Self, NumericsError> {
        debug_assert_eq!(nodes.dimension(), queries.dimension());
        let layout = Layout { order, dimension: nodes.dimension() };
        let (weights, width) = (blocked(weights), layout.width());
        let mut packed = vec![0.0; queries.n_points() * width];
        packed.par_chunks_mut(width * QUERIES_PER_TASK).enumerate().try_for_each(|(task, jets)| {
            observer.checkpoint()?;
            let first = task * QUERIES_PER_TASK;
            nodes.dispatch(Pass { nodes, kernel, weights: &weights, queries, first, jets, layout });
            match jets.iter().position(|x| !x.is_finite()) {
                Some(at) => Err(NumericsError::Overflow { query: first + at / width }),
                None => Ok(()),
            }
        })?;
        Ok(Self { packed, layout })
    }

    pub fn n_queries(&self) -> usize {
        self.packed.len() / self.layout.width()
    }

    pub fn dimension(&self) -> usize {
        self.layout.dimension
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

    /// D²u at a query, symmetric `[d, d]`.
    pub fn hessian(&self, query: usize) -> Vec<f64> {
        let d = self.layout.dimension;
        let mut packed = self.jet(query)[self.layout.hessian()..].iter();
        let mut full = vec![0.0; d * d];
        for a in 0..d {
            for (b, &entry) in (a..d).zip(&mut packed) {
                full[a * d + b] = entry;
                full[b * d + a] = entry;
            }
        }
        full
    }

    /// `Σ|λ_j||k_j|` and `Σ|λ_j||∇k_j|` at a query; order [`JetOrder::HessianWithMagnitudes`] only.
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
pub fn check_smooth_at(cloud: &Cloud, kernel: &Kernel, queries: &Cloud) -> Result<(), NumericsError> {
    if !kernel.has_kink() {
        return Ok(());
    }
    let positions = Positions::of(cloud);
    match queries.points().enumerate().find_map(|(query, x)| Some((query, positions.find(x)?))) {
        Some((query, point)) => Err(NumericsError::KernelNotSmooth { query, point }),
        None => Ok(()),
    }
}

/// The pass over all points for some consecutive queries.
struct Pass<'a> {
    nodes: &'a Nodes,
    kernel: &'a Kernel,
    weights: &'a [Block],
    queries: &'a Cloud,
    first: usize,
    jets: &'a mut [f64],
    layout: Layout,
}

impl WithSimd for Pass<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        match self.layout.order {
            JetOrder::Value => self.run::<S, 0, false>(simd),
            JetOrder::Gradient => self.run::<S, 1, false>(simd),
            JetOrder::Hessian => self.run::<S, 2, false>(simd),
            JetOrder::HessianWithMagnitudes => self.run::<S, 2, true>(simd),
        }
    }
}

impl Pass<'_> {
    #[inline(always)]
    fn run<S: Simd, const ORDER: usize, const MAGNITUDES: bool>(mut self, simd: S) {
        let jets = std::mem::take(&mut self.jets);
        let mut sums = Sums::new(simd, self.layout.dimension);
        let width = self.layout.width();
        for (k, jet) in jets.chunks_exact_mut(width).enumerate() {
            let x = self.queries.point(self.first + k);
            sums.clear(simd);
            for (block, weights) in self.weights.iter().enumerate() {
                let sums = &mut sums;
                let pairs = Weighted::<S, ORDER, MAGNITUDES> { simd, pass: &self, block, x, weights, sums };
                self.kernel.profiles(pairs);
                if ORDER >= 1 {
                    add_gradient(simd, &sums.first, &sums.differences, &mut sums.gradient);
                }
                if ORDER >= 2 {
                    add_hessian(simd, &sums.second, &sums.differences, &mut sums.hessian);
                }
            }
            sums.finish::<ORDER, MAGNITUDES>(self.kernel, jet);
        }
    }
}

/// What a pass has summed up for a query, and the block at hand.
struct Sums<S: Simd> {
    /// `Σλφ`.
    value: Sum<S>,
    /// `Σλφ′`, which enters the whole diagonal of the Hessian.
    trace: Sum<S>,
    /// `Σ|λ|φ` and `Σ|λφ′|√q`.
    magnitudes: [Sum<S>; 2],
    /// `Σλφ′D_a`.
    gradient: Vec<Sum<S>>,
    /// `Σλφ″D_aD_b`, a ≤ b, row by row.
    hessian: Vec<Sum<S>>,
    /// `D_a`, `λφ′`, `λφ″` of the block.
    differences: Vec<Block>,
    first: Block,
    second: Block,
}

impl<S: Simd> Sums<S> {
    #[inline(always)]
    fn new(simd: S, d: usize) -> Self {
        let zero = Sum::splat(simd, 0.0);
        Self {
            value: zero,
            trace: zero,
            magnitudes: [zero; 2],
            gradient: vec![zero; d],
            hessian: vec![zero; d * (d + 1) / 2],
            differences: vec![Block::ZERO; d],
            first: Block::ZERO,
            second: Block::ZERO,
        }
    }

    #[inline(always)]
    fn clear(&mut self, simd: S) {
        let zero = Sum::splat(simd, 0.0);
        (self.value, self.trace, self.magnitudes) = (zero, zero, [zero; 2]);
        self.gradient.fill(zero);
        self.hessian.fill(zero);
    }

    /// Turns the sums into a jet: factors `variance·{1, 2/ℓ², 4/ℓ⁴}`, and the term `2φ′·I/ℓ²` of the Hessian.
    ///
    /// Multiplying by 1/ℓ one after the other keeps ℓ⁴ out of float64's way.
    #[inline(always)]
    fn finish<const ORDER: usize, const MAGNITUDES: bool>(&self, kernel: &Kernel, jet: &mut [f64]) {
        let (variance, inverse) = (kernel.variance(), 1.0 / kernel.length_scale());
        let mut jet = jet.iter_mut();
        let mut put = |number: f64| {
            if let Some(slot) = jet.next() {
                *slot = number;
            }
        };
        put(variance * self.value.sum_lanes());
        if ORDER == 0 {
            return;
        }
        for sum in &self.gradient {
            put(2.0 * (variance * sum.sum_lanes()) * inverse * inverse);
        }
        if ORDER == 1 {
            return;
        }
        let d = self.gradient.len();
        let trace_term = 2.0 * variance * self.trace.sum_lanes() * inverse * inverse;
        let mut packed = self.hessian.iter();
        for a in 0..d {
            for (b, sum) in (a..d).zip(&mut packed) {
                let entry = 4.0 * (variance * sum.sum_lanes()) * inverse * inverse * inverse * inverse;
                put(if a == b { entry + trace_term } else { entry });
            }
        }
        if MAGNITUDES {
            put(variance * self.magnitudes[0].sum_lanes());
            put(variance * self.magnitudes[1].sum_lanes() * 2.0 * inverse);
        }
    }
}

/// Computes a block's differences and weighted profiles, and adds up what needs no difference.
struct Weighted<'a, S: Simd, const ORDER: usize, const MAGNITUDES: bool> {
    simd: S,
    pass: &'a Pass<'a>,
    block: usize,
    x: &'a [f64],
    weights: &'a Block,
    sums: &'a mut Sums<S>,
}

impl<S: Simd, const ORDER: usize, const MAGNITUDES: bool> Pairs<S> for Weighted<'_, S, ORDER, MAGNITUDES> {
    type Others = Pack<S>;

    #[inline(always)]
    fn pack(&mut self, at: usize) -> (Pack<S>, Pack<S>) {
        let Pass { nodes, kernel, .. } = self.pass;
        let differences = &mut self.sums.differences;
        let q = nodes.scaled_distances(self.simd, (self.block, at), self.x, kernel, |c, difference| {
            if ORDER >= 1 {
                difference.store(&mut differences[c], at);
            }
        });
        (q, q)
    }

    #[inline(always)]
    fn take(&mut self, at: usize, q: Pack<S>, [phi, slope, bend]: [Pack<S>; 3]) {
        let weight = Pack::load(self.simd, self.weights, at);
        let sums = &mut *self.sums;
        sums.value = sums.value + (weight * phi).sum_registers();
        if ORDER >= 1 {
            (weight * slope).store(&mut sums.first, at);
        }
        if ORDER >= 2 {
            sums.trace = sums.trace + (weight * slope).sum_registers();
            (weight * bend).store(&mut sums.second, at);
        }
        if MAGNITUDES {
            let weight = weight.abs();
            sums.magnitudes[0] = sums.magnitudes[0] + (weight * phi).sum_registers();
            sums.magnitudes[1] = sums.magnitudes[1] - (weight * slope * q.sqrt()).sum_registers();
        }
    }
}

#[cfg(test)]
mod tests;
