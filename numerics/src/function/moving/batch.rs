//! The neighbourhoods of several queries side by side, one in each lane.

use super::parts::{COLUMNS, Parts};
use super::quantities::Sized;
use crate::kernel::Kernel;
use crate::machine::small::{Small, zeros};
use crate::points::neighbours::{Neighbour, on_grid};
use crate::solver::System;
use crate::solver::trend::Basis;

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
    /// The functions of the mean at the points, `[p, places, lanes]`.
    pub functions: Vec<f64>,
    /// Coefficients of functionals on derivatives in units of ℓ, `[functionals, derivatives, lanes]`.
    pub functionals: Vec<f64>,
}

/// What is known at the points of a cloud.
pub(super) struct Observations<'a> {
    pub system: &'a System,
    /// Without their mean, `[n]`, unit V.
    pub values: &'a [f64],
    /// The functions of the mean, if its coefficients are not known exactly.
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

    /// Puts the functionals of a query into a lane.
    pub(super) fn put_functionals(&mut self, lane: usize, functionals: &[Sized], kernel: &Kernel) {
        let coefficients = functionals.iter().flat_map(|functional| functional.coefficients(kernel));
        let slots = self.functionals[lane..].iter_mut().step_by(self.lanes);
        slots.zip(coefficients).for_each(|(slot, coefficient)| *slot = coefficient);
    }

    /// Fills an unused lane with what another has, so that it takes no exceptions.
    pub(super) fn copy_lane(&mut self, from: usize, to: usize) {
        let lanes = self.lanes;
        let Self { points, query, values, noise, functions, functionals, .. } = self;
        for list in [points, query, values, noise, functions, functionals] {
            list.chunks_exact_mut(lanes).for_each(|row| row[to] = row[from]);
        }
    }
}
