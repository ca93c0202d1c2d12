//! Columns of the sparse factor, one in each lane of a register.

use pulp::{Simd, WithSimd};

use super::order::{GIVEN, Order};
use crate::kernel::Kernel;
use crate::machine::instruction_set::InstructionSet;
use crate::machine::lanes::{COLUMNS, Layout, Lower, Rounding, Workspace};
use crate::machine::registers::Pack;
use crate::points::neighbours::on_grid;
use crate::regression::solver::PIVOT_TOLERANCE;
use crate::regression::solver::system::System;
use crate::regression::sums::side_by_side::SideBySide;

/// Most points of a small system: those that a point is given, and itself.
pub(super) const MOST: usize = GIVEN + 1;

/// The system in the order of its factor. Its kernel has variance 1.
pub(super) struct OrderedSystem<'a> {
    pub system: &'a System,
    pub order: &'a Order,
    pub kernel: Kernel,
}

/// Buffers for a few columns, which a thread reuses.
pub(super) struct Room {
    set: InstructionSet,
    workspace: Workspace,
    points: Vec<f64>,
    noise: Vec<f64>,
}

impl Room {
    pub(super) fn new(set: InstructionSet, dimension: usize) -> Self {
        let lanes = set.n_lanes();
        Self {
            set,
            workspace: Workspace::new(Layout::in_blocks(MOST).row(MOST + 1)),
            points: vec![0.0; dimension * MOST * lanes],
            noise: vec![0.0; MOST * lanes],
        }
    }

    /// Computes the columns of places that are given equally many points, at most one for each lane, into
    /// `columns`, `[places, MOST]`: entries at the points that each is given, in their order, then its own.
    pub(super) fn columns_at(&mut self, of: &OrderedSystem<'_>, first: usize, columns: &mut [f32]) {
        let (lanes, dimension) = (self.set.n_lanes(), of.system.cloud().dimension());
        let (n_columns, count) = (columns.len() / MOST, Order::count(first) + 1);
        let n_places = count.next_multiple_of(COLUMNS);
        for lane in 0..lanes {
            // Unused lanes repeat the last column.
            self.put(of, first + lane.min(n_columns - 1), lane);
        }
        let systems = SideBySide {
            dimension,
            count,
            points: &self.points[..dimension * n_places * lanes],
            noise: &self.noise[..n_places * lanes],
        };
        let found = columns.chunks_exact_mut(MOST);
        let pass = Pass { systems, n_places, kernel: &of.kernel, workspace: &mut self.workspace };
        let numbers = self.set.dispatch(pass);
        for (lane, column) in found.enumerate() {
            for (entry, numbers) in column.iter_mut().zip(numbers.chunks_exact(lanes)).take(count) {
                *entry = numbers[lane] as f32;
            }
        }
    }

    /// Writes the points of a place into a lane, as differences from its own.
    fn put(&mut self, of: &OrderedSystem<'_>, place: usize, lane: usize) {
        let (cloud, noise) = (of.system.cloud(), of.system.regularization());
        let (lanes, dimension, count) = (self.set.n_lanes(), cloud.dimension(), Order::count(place));
        let n_places = (count + 1).next_multiple_of(COLUMNS);
        let own = of.order.points[place] as usize;
        let given = of.order.given[place * GIVEN..][..count].iter().map(|&at| of.order.points[at as usize]);
        for (j, point) in given.map(|point| point as usize).chain([own]).enumerate() {
            for axis in 0..dimension {
                let step = cloud.point(point)[axis] - cloud.point(own)[axis];
                self.points[(axis * n_places + j) * lanes + lane] = on_grid(step * of.kernel.stretch(axis));
            }
            self.noise[j * lanes + lane] = noise.at(point) / of.system.kernel().variance();
        }
    }
}

/// A pass that factorizes `A = LLᵀ` in each lane and finds the last column of `L⁻ᵀ`.
struct Pass<'a> {
    systems: SideBySide<'a>,
    n_places: usize,
    kernel: &'a Kernel,
    workspace: &'a mut Workspace,
}

impl WithSimd for Pass<'_> {
    type Output = Vec<f64>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Vec<f64> {
        let Self { systems, n_places, kernel, workspace } = self;
        let registers = workspace.registers::<S>();
        let mut lower = Lower { simd, layout: Layout::in_blocks(n_places), registers };
        systems.fill_triangle(kernel, &mut lower);
        lower.factorize_wide(n_places..n_places, &Definite { least: PIVOT_TOLERANCE * kernel.at_zero() });
        let row = lower.row(n_places);
        for j in 0..n_places {
            let entry = if j + 1 == systems.count { 1.0 } else { 0.0 };
            lower.set(row + j, lower.splat(entry));
        }
        lower.back_substitute(row, row);
        let mut found = vec![0.0; n_places * S::F64_LANES];
        let (slots, _) = S::as_mut_simd_f64s(&mut found);
        (0..n_places).for_each(|j| lower.at(row + j).write(slots, j));
        found
    }
}

/// Rounding of a factor whose matrix is made definite: its columns only precondition.
struct Definite {
    least: f64,
}

impl<S: Simd> Rounding<S> for Definite {
    const JOINS_PRODUCTS: bool = true;

    #[inline(always)]
    fn entry(&self, _i: usize, entry: Pack<S, 1>) -> Pack<S, 1> {
        entry
    }

    #[inline(always)]
    fn inverse_root(&self, square: Pack<S, 1>) -> Pack<S, 1> {
        square.at_least(self.least).sqrt_and_inverse().1
    }
}
