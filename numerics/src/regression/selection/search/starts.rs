//! Descents from several starts.
//!
//! With more than [`MAX_FROM_EVERY_START`] points, a descent on all of them takes seconds to minutes. There,
//! every start descends on a sample, which costs next to nothing beside one evaluation of all points. The
//! likeliest end by all points, or the first start if that is likelier, then descends on all of them.

use rayon::prelude::*;

use super::descent::descend;
use super::walk::{DescentEnd, Walk};
use super::{MAX_SIDE_BY_SIDE_POINTS, Selection};
use crate::error::{NumericsError, Result};
use crate::machine::random::mixed;
use crate::observer::Observer;
use crate::regression::selection::evaluation::Evaluator;
use crate::regression::selection::evaluation::space::Space;
use crate::regression::selection::subject::{Observations, Subject};

/// Largest number of points with which every start descends on all of them, and number of points of a sample.
pub(in crate::regression::selection) const MAX_FROM_EVERY_START: usize = 768;
pub(in crate::regression::selection) const SAMPLE: usize = 384;

/// Starts of the descents of a space, the first one given by the client.
pub(super) struct Starts<'a> {
    pub(super) space: &'a Space,
    pub(super) at: Vec<Vec<f64>>,
}

/// The best end of the descents of a space, the evaluations of the descent that led there, and of all.
pub(super) struct SpaceResult {
    pub(super) best: Option<DescentEnd>,
    pub(super) used: usize,
    pub(super) evaluations: usize,
}

/// Descends from all starts of all spaces. Results are in the order of the spaces.
///
/// # Errors
/// `NumericsError::Cancelled`, and the errors of the evaluations.
pub(super) fn ascended(
    subject: &Subject<'_>,
    selection: &Selection<'_>,
    starts: &[Starts<'_>],
    observer: &dyn Observer,
) -> Result<Vec<SpaceResult>> {
    let has_several = starts.iter().any(|starts| starts.at.len() > 1);
    if has_several && subject.n_points() > MAX_FROM_EVERY_START {
        return by_sample(subject, selection, starts, observer);
    }
    let descents = on_all(subject, selection, starts, observer)?;
    let mut descents = descents.into_iter();
    let of_space = |starts: &Starts<'_>| {
        let mut ascended = SpaceResult { best: None, used: 0, evaluations: 0 };
        for (found, used) in descents.by_ref().take(starts.at.len()) {
            ascended.evaluations += used;
            let Some(found) = found else { continue };
            if ascended.best.as_ref().is_none_or(|best| best.merit < found.merit) {
                (ascended.best, ascended.used) = (Some(found), used);
            }
        }
        ascended
    };
    Ok(starts.iter().map(of_space).collect())
}

/// Descends from all starts on all points. Results are in the order of the starts.
fn on_all(
    subject: &Subject<'_>,
    selection: &Selection<'_>,
    starts: &[Starts<'_>],
    observer: &dyn Observer,
) -> Result<Vec<(Option<DescentEnd>, usize)>> {
    let jobs: Vec<(&Space, &[f64])> =
        starts.iter().flat_map(|starts| starts.at.iter().map(|at| (starts.space, &at[..]))).collect();
    let side_by_side = jobs.len() > 1 && subject.n_points() <= MAX_SIDE_BY_SIDE_POINTS;
    // Side by side, each evaluator keeps to its own thread.
    let evaluator = || Evaluator::new(subject, selection.criterion, side_by_side);
    let job = |evaluator: &mut Evaluator<'_>, &(space, start): &(&Space, &[f64])| {
        descend(evaluator, space, start, selection.max_evaluations, observer)
    };
    if side_by_side {
        jobs.par_iter().with_max_len(1).map_init(evaluator, job).collect()
    } else {
        let mut evaluator = evaluator();
        jobs.iter().map(|start| job(&mut evaluator, start)).collect()
    }
}

/// Descends from all starts on a sample, and from the likeliest end of each space on all points.
fn by_sample(
    subject: &Subject<'_>,
    selection: &Selection<'_>,
    starts: &[Starts<'_>],
    observer: &dyn Observer,
) -> Result<Vec<SpaceResult>> {
    let ends = ends_on_sample(selection, starts, observer)?;
    let mut evaluator = Evaluator::new(subject, selection.criterion, false);
    let mut all = Vec::with_capacity(starts.len());
    for (starts, (ends, n_on_sample)) in starts.iter().zip(ends) {
        let begin = Walk::new(&mut evaluator, starts.space, observer);
        let (begin, n_compared) = likeliest(begin, starts.at.iter().take(1).chain(&ends))?;
        let (best, used) = match begin {
            Some(at) => descend(&mut evaluator, starts.space, &at, selection.max_evaluations, observer)?,
            None => (None, 0),
        };
        all.push(SpaceResult { best, used, evaluations: n_on_sample + n_compared + used });
    }
    Ok(all)
}

/// Ends of the descents of each space on a sample, with the number of their evaluations.
fn ends_on_sample(
    selection: &Selection<'_>,
    starts: &[Starts<'_>],
    observer: &dyn Observer,
) -> Result<Vec<(Vec<Vec<f64>>, usize)>> {
    let Observations { cloud, values, mean } = selection.observations;
    let points = sample(cloud.n_points());
    let cloud = cloud.select(&points);
    let values: Vec<f64> = points.iter().map(|&point| values[point]).collect();
    let subject = match Subject::of(Observations { cloud: &cloud, values: &values, mean }) {
        // Too few to determine the mean: the starts themselves are compared.
        Err(NumericsError::MeanNotDetermined) => {
            return Ok(starts.iter().map(|starts| (starts.at.clone(), 0)).collect());
        }
        subject => subject?,
    };
    let spaces: Vec<Space> = starts.iter().map(|starts| starts.space.on(&points)).collect();
    let on_sample = |(starts, space)| -> Starts<'_> {
        let starts: &Starts<'_> = starts;
        Starts { space, at: starts.at.clone() }
    };
    let on_sample: Vec<Starts<'_>> = starts.iter().zip(&spaces).map(on_sample).collect();
    let mut descents = on_all(&subject, selection, &on_sample, observer)?.into_iter();
    let of_space = |starts: &Starts<'_>| {
        let (mut ends, mut n_evaluations) = (Vec::new(), 0);
        for (found, used) in descents.by_ref().take(starts.at.len()) {
            n_evaluations += used;
            ends.extend(found.map(|found| found.logarithms));
        }
        (ends, n_evaluations)
    };
    Ok(starts.iter().map(of_space).collect())
}

/// Returns the candidate of the greatest merit, the first of equals, and the number of candidates.
fn likeliest<'c>(
    mut walk: Walk<'_, '_>,
    candidates: impl Iterator<Item = &'c Vec<f64>>,
) -> Result<(Option<Vec<f64>>, usize)> {
    for candidate in candidates {
        walk.merit(candidate)?;
    }
    Ok((walk.best.map(|(logarithms, _)| logarithms), walk.evaluations))
}

/// Returns a sample of n points, in an order that has nothing to do with that of the points.
fn sample(n: usize) -> Vec<usize> {
    let mut points: Vec<usize> = (0..n).collect();
    points.sort_unstable_by_key(|&point| mixed(point as u64 + 1));
    points.truncate(SAMPLE);
    points
}
