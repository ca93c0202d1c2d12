//! Batches of neighbourhoods, solved together in buffers that a thread reuses.

use std::ops::Range;

use rayon::prelude::*;

use super::level::Level;
use super::neighbourhood::{Neighbourhood, Scratch};
use super::regression::{Batch, Krige, Model, ModelResult, workspace};
use crate::error::Result;
use crate::machine::instruction_set::InstructionSet;
use crate::machine::lanes::Workspace;
use crate::observer::Observer;
use crate::points::cloud::Cloud;
use crate::points::neighbours::{Neighbour, Walk};

/// A neighbourhood with the result of each model there.
pub(super) type Found = (Neighbourhood, Vec<ModelResult>);

/// Purpose for which a batch is solved. Derivatives at the query are computed for predictions only.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Purpose {
    Likelihood,
    Prediction,
}

/// Buffers that a thread reuses from one batch to the next.
pub(super) struct Room<'a> {
    level: &'a Level,
    walk: Walk<'a>,
    batch: Batch,
    workspace: Workspace,
    scratch: Scratch,
    nearest: Vec<Neighbour>,
    set: InstructionSet,
    /// True if no lane has a neighbourhood.
    is_empty: bool,
    /// Results by lane and model.
    pub kriged: Vec<Vec<ModelResult>>,
}

impl<'a> Room<'a> {
    pub(super) fn new(level: &'a Level, lanes: usize) -> Self {
        let (dimension, count) = (level.support.cloud().dimension(), level.count);
        Self {
            level,
            walk: Walk::over(level.support.neighbours()),
            batch: Batch::new(dimension, count, lanes),
            workspace: workspace(dimension, count),
            scratch: Scratch { noise: level.bend_noise, ..Scratch::default() },
            nearest: Vec::new(),
            set: InstructionSet::best(),
            is_empty: true,
            kriged: vec![Vec::new(); lanes],
        }
    }

    pub(super) fn dimension(&self) -> usize {
        self.batch.dimension
    }

    /// Fills the lanes with the neighbourhoods of a range of queries.
    pub(super) fn put(&mut self, queries: &Cloud, range: Range<usize>) -> Vec<Option<Neighbourhood>> {
        let support = &self.level.support;
        let mut places = Vec::with_capacity(range.len());
        for (lane, query) in range.enumerate() {
            let x = queries.point(query);
            self.walk.points_into(x, self.level.count, &mut self.nearest);
            let place =
                Neighbourhood::put(support, x, &mut self.nearest, &mut self.batch, lane, &mut self.scratch);
            if place.is_none() {
                self.batch.keep(lane, 0);
            }
            places.push(place);
        }
        // Lanes without a neighbourhood get a copy of one that has. Their results are never read.
        let filled = places.iter().position(Option::is_some);
        self.is_empty = filled.is_none();
        if let Some(filled) = filled {
            let is_empty = |lane: usize| places.get(lane).is_none_or(Option::is_none);
            for lane in (0..self.batch.lanes).filter(|&lane| is_empty(lane)) {
                self.batch.copy_lane(filled, lane);
            }
        }
        places
    }

    /// Solves the current batch for each model and stores the results in `kriged`.
    pub(super) fn krige<'m>(&mut self, models: impl IntoIterator<Item = &'m Model>, purpose: Purpose) {
        self.kriged.iter_mut().for_each(Vec::clear);
        if self.is_empty {
            return;
        }
        for model in models {
            let predicts = purpose != Purpose::Likelihood;
            let krige = Krige { batch: &self.batch, model, workspace: &mut self.workspace, predicts };
            for (slot, kriged) in self.kriged.iter_mut().zip(self.set.dispatch(krige)) {
                slot.push(kriged);
            }
        }
    }
}

impl Level {
    /// Solves each query for the given models. A query without a neighbourhood gives `None`.
    pub(super) fn krige_each(
        &self,
        queries: &Cloud,
        models: &[Model],
        purpose: Purpose,
        observer: &dyn Observer,
    ) -> Result<Vec<Option<Found>>> {
        let m = queries.n_points();
        let lanes = InstructionSet::best().n_lanes();
        let batches = (0..m.div_ceil(lanes)).into_par_iter().map_init(
            || Room::new(self, lanes),
            |room, batch| {
                observer.checkpoint()?;
                let first = batch * lanes;
                let places = room.put(queries, first..(first + lanes).min(m));
                room.krige(models, purpose);
                let found = places.into_iter().enumerate();
                Ok(found
                    .map(|(lane, place)| place.map(|place| (place, room.kriged[lane].clone())))
                    .collect::<Vec<_>>())
            },
        );
        let batches: Vec<Vec<Option<Found>>> = batches.collect::<Result<_>>()?;
        Ok(batches.into_iter().flatten().collect())
    }
}
