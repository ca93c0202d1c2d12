//! The neighbourhoods of several queries side by side, one in each lane.

use super::kriging::COLUMNS;
use crate::numerics::points::neighbours::{Neighbour, on_grid};
use crate::numerics::solver::System;

/// The nearest points of a few queries, as many for each.
pub(super) struct Batch {
    pub dimension: usize,
    /// Points of a neighbourhood.
    pub count: usize,
    lanes: usize,
    /// From the nearest point to each of the others as the kernel stretches it, `[d, places, lanes]`, unit L:
    /// differences are what distances are made of, and from a query far away all of them would be the same.
    ///
    /// Differences are rounded to the grid of the neighbours, so that no square of one is subnormal. The step of the
    /// grid is 1e-14 of the shortest length scale that a kernel takes.
    pub points: Vec<f64>,
    /// From the nearest point to the query, likewise, `[d, lanes]`.
    pub query: Vec<f64>,
    /// `[places, lanes]`, unit V; 0 in places that are left empty.
    pub values: Vec<f64>,
    /// `[places, lanes]`, unit V².
    pub noise: Vec<f64>,
}

impl Batch {
    pub(super) fn new(dimension: usize, count: usize, lanes: usize) -> Self {
        let n_places = count.next_multiple_of(COLUMNS);
        Self {
            dimension,
            count,
            lanes,
            points: vec![0.0; dimension * n_places * lanes],
            query: vec![0.0; dimension * lanes],
            values: vec![0.0; n_places * lanes],
            noise: vec![0.0; n_places * lanes],
        }
    }

    /// Places for points, of which the last few may be left empty.
    pub(super) fn n_places(&self) -> usize {
        self.count.next_multiple_of(COLUMNS)
    }

    /// Puts a query with its nearest points, the nearest one first, into a lane.
    pub(super) fn put(
        &mut self,
        lane: usize,
        x: &[f64],
        nearest: &[Neighbour],
        system: &System,
        values: &[f64],
    ) {
        let (lanes, n_places, kernel) = (self.lanes, self.n_places(), system.kernel());
        let Some(origin) = nearest.first().map(|first| system.cloud().point(first.point)) else { return };
        for (axis, (x, o)) in x.iter().zip(origin).enumerate() {
            self.query[axis * lanes + lane] = on_grid((x - o) * kernel.stretch(axis));
        }
        for (j, neighbour) in nearest.iter().enumerate() {
            let at = j * lanes + lane;
            for (axis, (x, o)) in system.cloud().point(neighbour.point).iter().zip(origin).enumerate() {
                self.points[axis * n_places * lanes + at] = on_grid((x - o) * kernel.stretch(axis));
            }
            self.values[at] = values[neighbour.point];
            self.noise[at] = system.regularization().at(neighbour.point);
        }
    }

    /// Fills an unused lane with what another has, so that it takes no exceptions.
    pub(super) fn copy_lane(&mut self, from: usize, to: usize) {
        let lanes = self.lanes;
        for list in [&mut self.points, &mut self.query, &mut self.values, &mut self.noise] {
            list.chunks_exact_mut(lanes).for_each(|row| row[to] = row[from]);
        }
    }
}
