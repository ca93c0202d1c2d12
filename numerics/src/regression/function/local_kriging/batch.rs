//! Batches: the neighbourhoods of several queries side by side, one in each lane.

use super::parts::Parts;
use super::quantities::ScaledFunctional;
use crate::kernel::Kernel;
use crate::machine::lanes::COLUMNS;
use crate::machine::small::{Small, zeros};
use crate::points::neighbours::{Neighbour, on_grid};
use crate::regression::solver::System;
use crate::regression::solver::trend::Basis;

/// The nearest points of a few queries, equally many for each.
pub(super) struct Batch {
    pub dimension: usize,
    /// Points per neighbourhood.
    pub count: usize,
    lanes: usize,
    /// Differences of the points from the nearest one, stretched by the kernel: `[d, places, lanes]`, unit L.
    ///
    /// Distances are made of differences. Taken from a distant query, the differences of all points would
    /// round to the same.
    ///
    /// They are rounded to the grid of the neighbour search, so that none has a subnormal square. The step of
    /// the grid is 1e-14 of the shortest length scale that a kernel takes.
    pub points: Vec<f64>,
    /// Difference of the query from the nearest point, stretched and rounded like `points`: `[d, lanes]`,
    /// unit L.
    pub query: Vec<f64>,
    /// Values without their mean, `[places, lanes]`, unit V; 0 in empty places.
    pub values: Vec<f64>,
    /// Variances of the noise, `[places, lanes]`, unit V²; 0 in empty places.
    pub noise: Vec<f64>,
    /// The functions of the mean at the points, `[p, places, lanes]`.
    pub functions: Vec<f64>,
    /// Coefficients of the functionals on derivatives in units of ℓ, `[functionals, derivatives, lanes]`.
    pub functionals: Vec<f64>,
}

/// Observations at the points of a cloud.
pub(super) struct Observations<'a> {
    pub system: &'a System,
    /// Values without their mean, `[n]`, unit V.
    pub values: &'a [f64],
    /// The functions of the mean, if its coefficients are uncertain.
    pub basis: Option<&'a Basis>,
}

impl Observations<'_> {
    pub(super) fn n_functions(&self) -> usize {
        self.basis.map_or(0, Basis::n_functions)
    }
}

impl Batch {
    pub(super) fn new(observations: &Observations<'_>, parts: Parts, count: usize, lanes: usize) -> Self {
        let n_places = count.next_multiple_of(COLUMNS);
        let dimension = observations.system.cloud().dimension();
        Self {
            dimension,
            count,
            lanes,
            points: vec![0.0; dimension * n_places * lanes],
            query: vec![0.0; dimension * lanes],
            values: vec![0.0; n_places * lanes],
            noise: vec![0.0; n_places * lanes],
            functions: vec![0.0; observations.n_functions() * n_places * lanes],
            functionals: vec![0.0; parts.n_functionals * parts.n_derivatives * lanes],
        }
    }

    /// Places for points per lane, a multiple of [`COLUMNS`]. The last few may stay empty.
    pub(super) fn n_places(&self) -> usize {
        self.count.next_multiple_of(COLUMNS)
    }

    /// Writes a query and its nearest points, nearest first, into a lane.
    pub(super) fn put(
        &mut self,
        lane: usize,
        x: &[f64],
        nearest: &[Neighbour],
        observations: &Observations<'_>,
    ) {
        let Observations { system, values, basis } = *observations;
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
            let Some(basis) = basis else { continue };
            let mut functions: Small = zeros(basis.n_functions());
            basis.at(system.cloud().point(neighbour.point), &mut functions);
            for (function, value) in functions.iter().enumerate() {
                self.functions[function * n_places * lanes + at] = *value;
            }
        }
    }

    /// Writes the functionals of a query into a lane.
    pub(super) fn put_functionals(&mut self, lane: usize, functionals: &[ScaledFunctional], kernel: &Kernel) {
        let coefficients = functionals.iter().flat_map(|functional| functional.coefficients(kernel));
        let slots = self.functionals[lane..].iter_mut().step_by(self.lanes);
        slots.zip(coefficients).for_each(|(slot, coefficient)| *slot = coefficient);
    }

    /// Copies a lane into an unused one, so that unused lanes need no special cases.
    pub(super) fn copy_lane(&mut self, from: usize, to: usize) {
        let lanes = self.lanes;
        let Self { points, query, values, noise, functions, functionals, .. } = self;
        for list in [points, query, values, noise, functions, functionals] {
            list.chunks_exact_mut(lanes).for_each(|row| row[to] = row[from]);
        }
    }
}
