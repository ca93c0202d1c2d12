//! Search for the points around a query.

use std::sync::Arc;

use crate::machine::heap::{arc_payload, block_bytes};
use crate::machine::small::Small;
use crate::points::neighbours::{Neighbour, Neighbours};
use crate::points::sampling::Sampling;
use crate::regression::solver::System;

/// An index of the points nearest to a query, i.e. with the greatest covariances.
pub(super) enum Near {
    /// The index of the cloud as it is, kept with its sampling.
    Sampled(Arc<Sampling>),
    /// An index in stretched coordinates, in which the kernel has one length scale.
    Stretched(Neighbours),
}

impl Near {
    /// Writes the `count` points nearest to x into `found`, nearest first.
    pub(super) fn nearest_into(&self, system: &System, x: &[f64], count: usize, found: &mut Vec<Neighbour>) {
        match self {
            Self::Sampled(sampling) => sampling.neighbours().nearest_into(x, count, found),
            Self::Stretched(neighbours) => {
                let stretched = x.iter().enumerate().map(|(axis, x)| x * system.kernel().stretch(axis));
                neighbours.nearest_into(&stretched.collect::<Small>(), count, found);
            }
        }
    }

    pub(super) fn n_bytes(&self) -> usize {
        match self {
            Self::Sampled(sampling) => block_bytes(arc_payload::<Sampling>()) + sampling.n_bytes(),
            Self::Stretched(neighbours) => neighbours.n_bytes(),
        }
    }
}
