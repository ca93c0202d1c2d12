//! The sparse factor of the inverse: `UUᵀ ≈ (K + D)⁻¹`, up to a factor of scale.

use rayon::prelude::*;

use super::columns::{MOST, OrderedSystem, Room};
use super::order::{GIVEN, Order};
use crate::error::Result;
use crate::machine::heap::vec_bytes;
use crate::machine::instruction_set::InstructionSet;
use crate::observer::Observer;
use crate::regression::solver::system::System;

/// Columns that a thread computes before it looks whether it should stop.
const BLOCK: usize = 1024;

/// U, upper triangular in the order of its points. Column i has an entry at point i and at those it is given.
///
/// Its entries are kept in single precision. Any U without a zero on its diagonal is a preconditioner that is
/// symmetric and positive definite, and these are as good as exact ones.
pub(super) struct InverseFactor {
    order: Order,
    /// `[n, MOST]`: entries at the points that each is given, then its own.
    columns: Vec<f32>,
}

impl InverseFactor {
    /// # Errors
    /// [`crate::error::NumericsError::Cancelled`].
    pub(super) fn of(system: &System, observer: &dyn Observer) -> Result<Self> {
        let order = Order::of(system, observer)?;
        let n = system.n_points();
        let mut columns = vec![0.0_f32; n * MOST];
        let ordered =
            OrderedSystem { system, order: &order, kernel: system.kernel().clone().of_variance_one() };
        let set = InstructionSet::best();
        let room = || Room::new(set, system.cloud().dimension());
        let (few, many) = columns.split_at_mut(n.min(GIVEN) * MOST);
        let mut alone = room();
        few.chunks_exact_mut(MOST)
            .enumerate()
            .for_each(|(at, column)| alone.columns_at(&ordered, at, column));
        for (block, columns) in many.chunks_mut(BLOCK * MOST).enumerate() {
            observer.checkpoint()?;
            let first = GIVEN + block * BLOCK;
            let batches = columns.par_chunks_mut(set.n_lanes() * MOST).enumerate();
            batches.for_each_init(room, |room, (batch, columns)| {
                room.columns_at(&ordered, first + batch * set.n_lanes(), columns);
            });
        }
        Ok(Self { order, columns })
    }

    /// `UUᵀr` of a vector `[n]`.
    pub(super) fn apply(&self, vector: &[f64]) -> Vec<f64> {
        let Order { points, given } = &self.order;
        let ordered: Vec<f64> = points.iter().map(|&point| vector[point as usize]).collect();
        let columns = self.columns.par_chunks_exact(MOST).zip(given.par_chunks_exact(GIVEN)).enumerate();
        let whitened = columns.map(|(at, (column, given))| {
            let (own, entries) = split(column, at);
            let products = entries.iter().zip(given).map(|(u, &j)| f64::from(*u) * ordered[j as usize]);
            f64::from(own) * ordered[at] + products.sum::<f64>()
        });
        let whitened: Vec<f64> = whitened.collect();
        let mut found = vec![0.0; vector.len()];
        for (at, (column, given)) in
            self.columns.chunks_exact(MOST).zip(given.chunks_exact(GIVEN)).enumerate()
        {
            let (own, entries) = split(column, at);
            for (u, &j) in entries.iter().zip(given) {
                found[j as usize] += f64::from(*u) * whitened[at];
            }
            found[at] += f64::from(own) * whitened[at];
        }
        let mut unordered = ordered;
        points.iter().zip(found).for_each(|(&point, x)| unordered[point as usize] = x);
        unordered
    }

    pub(super) fn n_bytes(&self) -> usize {
        vec_bytes(&self.columns) + vec_bytes(&self.order.points) + vec_bytes(&self.order.given)
    }
}

/// The entry of a column at its own point, and those at the points that it is given.
fn split(column: &[f32], place: usize) -> (f32, &[f32]) {
    let count = Order::count(place);
    (column[count], &column[..count])
}
