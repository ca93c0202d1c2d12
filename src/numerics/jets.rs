//! Value, gradient and Hessian of a kernel expansion at many queries, in one fused pass over the points per query.

use pulp::{Simd, WithSimd};
use rayon::prelude::*;

use super::cloud::Cloud;
use super::duplicates::Positions;
use super::error::NumericsError;
use super::heap::vec_bytes;
use super::kernel::Kernel;
use super::nodes::{Nodes, blocked};
use super::observer::Observer;
use super::simd::{BLOCK, Block, LANES, Lanes, add_products, multiply, sum_lanes};

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

    /// Turns raw sums into a jet: factors `variance·{1, 2/ℓ², 4/ℓ⁴}`, and the term `2φ′·I/ℓ²` of the Hessian.
    ///
    /// Multiplying by 1/ℓ one after the other keeps ℓ⁴ out of float64's way.
    fn finish(self, sums: &[Lanes], kernel: &Kernel, jet: &mut [f64]) {
        for (number, lanes) in jet.iter_mut().zip(sums) {
            *number = kernel.variance() * sum_lanes(lanes);
        }
        if self.order == JetOrder::Value {
            return;
        }
        let inverse = 1.0 / kernel.length_scale();
        for slope in &mut jet[self.gradient()..self.hessian()] {
            *slope = 2.0 * *slope * inverse * inverse;
        }
        if self.order == JetOrder::Gradient {
            return;
        }
        let trace_term = 2.0 * kernel.variance() * sum_lanes(&sums[sums.len() - 1]) * inverse * inverse;
        let mut at = self.hessian();
        for a in 0..self.dimension {
            for b in a..self.dimension {
                jet[at] = 4.0 * jet[at] * inverse * inverse * inverse * inverse;
                if a == b {
                    jet[at] += trace_term;
                }
                at += 1;
            }
        }
        if self.order == JetOrder::HessianWithMagnitudes {
            jet[at + 1] *= 2.0 * inverse;
        }
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
        debug_assert_eq!(cloud.dimension(), queries.dimension());
        let layout = Layout { order, dimension: cloud.dimension() };
        let (nodes, weights, width) = (Nodes::of(cloud), blocked(weights), layout.width());
        let mut packed = vec![0.0; queries.n_points() * width];
        let arch = pulp::Arch::new();
        packed.par_chunks_mut(width * QUERIES_PER_TASK).enumerate().try_for_each(|(task, jets)| {
            observer.checkpoint()?;
            let first = task * QUERIES_PER_TASK;
            arch.dispatch(Pass { nodes: &nodes, kernel, weights: &weights, queries, first, jets, layout });
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
    fn with_simd<S: Simd>(self, _simd: S) {
        match self.layout.order {
            JetOrder::Value => self.run::<S, 0, false>(),
            JetOrder::Gradient => self.run::<S, 1, false>(),
            JetOrder::Hessian => self.run::<S, 2, false>(),
            JetOrder::HessianWithMagnitudes => self.run::<S, 2, true>(),
        }
    }
}

impl Pass<'_> {
    #[inline(always)]
    fn run<S: Simd, const ORDER: usize, const MAGNITUDES: bool>(self) {
        let width = self.layout.width();
        // One accumulator more than a jet has numbers: Σ λφ′, which enters the whole diagonal of the Hessian.
        let mut sums = vec![[0.0; LANES]; width + 1];
        let mut differences = vec![[0.0; BLOCK]; self.nodes.dimension()];
        for (k, jet) in self.jets.chunks_exact_mut(width).enumerate() {
            let x = self.queries.point(self.first + k);
            sums.fill([0.0; LANES]);
            for (block, weights) in self.weights.iter().enumerate() {
                let (mut q, mut phi) = ([0.0; BLOCK], [[0.0; BLOCK]; 3]);
                self.nodes.differences::<S>(block, x, self.kernel, &mut differences, &mut q);
                self.kernel.profile_block::<S, ORDER>(&q, &mut phi);
                if MAGNITUDES {
                    let at = self.layout.magnitudes();
                    add_magnitudes::<S>(&mut sums[at..], weights, &q, &phi);
                }
                add_block::<S, ORDER>(&mut sums, weights, &differences, &phi);
            }
            self.layout.finish(&sums, self.kernel, jet);
        }
    }
}

/// Adds `λφ`, `λφ′D`, `λφ″D_aD_b` of a block in the layout of a jet, and `λφ′` to the last accumulator.
#[inline(always)]
fn add_block<S: Simd, const ORDER: usize>(
    sums: &mut [Lanes],
    weights: &Block,
    differences: &[Block],
    phi: &[Block; 3],
) {
    let d = differences.len();
    add_products::<S>(&mut sums[0], weights, &phi[0]);
    if ORDER == 0 {
        return;
    }
    let mut first = [0.0; BLOCK];
    multiply(&mut first, weights, &phi[1]);
    for (sum, difference) in sums[1..].iter_mut().zip(differences) {
        add_products::<S>(sum, &first, difference);
    }
    if ORDER == 1 {
        return;
    }
    if let Some(last) = sums.last_mut() {
        add_products::<S>(last, &first, &[1.0; BLOCK]);
    }
    let mut second = [0.0; BLOCK];
    multiply(&mut second, weights, &phi[2]);
    let mut at = 1 + d;
    for a in 0..d {
        let mut row = [0.0; BLOCK];
        multiply(&mut row, &second, &differences[a]);
        for difference in &differences[a..] {
            add_products::<S>(&mut sums[at], &row, difference);
            at += 1;
        }
    }
}

#[inline(always)]
fn add_magnitudes<S: Simd>(sums: &mut [Lanes], weights: &Block, q: &Block, phi: &[Block; 3]) {
    let (mut magnitude, mut slope) = ([0.0; BLOCK], [0.0; BLOCK]);
    for i in 0..BLOCK {
        magnitude[i] = weights[i].abs();
        slope[i] = -phi[1][i] * q[i].sqrt();
    }
    add_products::<S>(&mut sums[0], &magnitude, &phi[0]);
    add_products::<S>(&mut sums[1], &magnitude, &slope);
}

#[cfg(test)]
mod tests;
