//! Search for the best hyperparameters over several families and starts.

mod descent;
mod served;
mod walk;

use rayon::prelude::*;

use crate::error::{NumericsError, Result};
use crate::kernel::Family;
use crate::observer::{Observer, Stage};
use crate::regression::selection::criterion::Criterion;
use crate::regression::selection::evaluation::space::Space;
use crate::regression::selection::evaluation::{Evaluator, never_definite};
use crate::regression::selection::parameters::{Hyperparameters, Parameter, Variation};
use crate::regression::selection::subject::{Observations, Subject};
use crate::regression::solver::trend::Trend;
pub use descent::Side;
use descent::{descend, finish, side};
use walk::Found;

/// Usual limit of evaluations of one descent.
pub const MAX_EVALUATIONS: usize = 200;

/// Largest number of points for which descents run side by side, one on each thread. So small a factorization
/// does not keep two threads busy.
pub(super) const MAX_SIDE_BY_SIDE_POINTS: usize = 1024;

/// A search: the data, the criterion, and the range of hyperparameters.
#[derive(Debug, Clone, Copy)]
pub struct Selection<'a> {
    pub observations: Observations<'a>,
    pub criterion: Criterion,
    /// Start of the search. Hyperparameters that do not vary keep these values.
    pub start: &'a Hyperparameters,
    /// Free parameters. If there are none, only the start is evaluated.
    pub vary: &'a [Variation],
    /// Families to try; empty for the family of the start alone. Laplace takes its ε from here unless ε
    /// varies.
    pub families: &'a [Family],
    /// Further starts, spread over the logarithms of the bounds.
    pub restarts: usize,
    /// Seed of the further starts.
    pub seed: u64,
    /// Largest number of evaluations of each descent, usually [`MAX_EVALUATIONS`].
    pub max_evaluations: usize,
}

/// The best hyperparameters that a search found.
#[derive(Debug, Clone, PartialEq)]
pub struct Selected {
    pub hyperparameters: Hyperparameters,
    /// Score of the criterion. Greater is better.
    pub score: f64,
    /// Derivatives of the score by the logarithms of the free numbers. [`Parameter::LengthScales`] has one
    /// for each axis. Same order as `free`.
    pub gradient: Vec<f64>,
    /// Parameter of each free number, and the bound that it is at, if any.
    pub free: Vec<(Parameter, Option<Side>)>,
    /// Evaluations of the criterion by all descents together.
    pub evaluations: usize,
    /// True if no component of the gradient exceeds 0.01 per factor of e, in units of log likelihood.
    /// Components that lead out of the bounds do not count.
    pub converged: bool,
    /// Mean from generalised least squares, in coordinates of the cloud.
    pub trend: Option<Trend>,
    /// Families as requested, each with its best score. `None` if its matrix was not positive definite at any
    /// start.
    pub families: Vec<(Family, Option<f64>)>,
}

/// Searches for the best hyperparameters: from the start and further starts, with every family, each in a
/// descent of its own.
///
/// The start is moved into the bounds first. The number of threads changes the result by rounding only.
///
/// # Errors
/// [`NumericsError::InvalidVariation`] with the entry. [`NumericsError::LengthMismatch`] of values or noise.
/// [`NumericsError::MeanNotDetermined`], for leave-one-out also if the mean is not determined without one of
/// the points. [`NumericsError::NotPositiveDefinite`] if the matrix is not positive definite at any start.
/// [`NumericsError::Cancelled`], and the errors of [`Hyperparameters::kernel_on`].
pub fn select(selection: &Selection<'_>, observer: &dyn Observer) -> Result<Selected> {
    let Selection { observations, vary, start, .. } = *selection;
    let (subject, cloud) = (Subject::of(observations)?, observations.cloud);
    start.noise.check_matches(cloud)?;
    if selection.criterion == Criterion::LeaveOneOut {
        subject.check_without_one()?;
    }
    let families = if selection.families.is_empty() { &[start.family] } else { selection.families };
    check_epsilon(families, vary)?;
    let mut spaces = Vec::with_capacity(families.len());
    for &family in families {
        let base = Hyperparameters { family, ..start.clone() };
        let space = Space::of(&base, vary, cloud.dimension())?;
        // An invalid start is refused here, with its reason.
        space.at(&space.start()).kernel_on(cloud)?;
        spaces.push(space);
    }
    observer.enter(Stage::Factor);
    let jobs: Vec<(&Space, Vec<f64>)> = spaces.iter().flat_map(|space| starts(space, selection)).collect();
    let descents = run_all(&subject, selection, &jobs, observer)?;
    best_of(&subject, selection, &spaces, descents, observer)
}

/// Refuses a varying ε unless one of the families has it.
fn check_epsilon(families: &[Family], vary: &[Variation]) -> Result<()> {
    let has_epsilon = families.iter().any(|family| matches!(family, Family::Laplace { .. }));
    match vary.iter().position(|variation| variation.parameter == Parameter::Epsilon) {
        Some(entry) if !has_epsilon => {
            let requirement = "must not be epsilon, which only laplace has";
            Err(NumericsError::InvalidVariation { entry, requirement })
        }
        _ => Ok(()),
    }
}

/// Returns the start of a space, then the restarts: points of the R-sequence (Roberts 2018), shifted by an
/// offset from the seed.
fn starts<'a>(space: &'a Space, selection: &Selection<'_>) -> Vec<(&'a Space, Vec<f64>)> {
    let bounds = space.bounds();
    let dimension = bounds.len();
    // The root of x^(d+1) = x + 1.
    let root = (0..64).fold(2.0f64, |x, _| (1.0 + x).powf(1.0 / (dimension as f64 + 1.0)));
    let mut seed = selection.seed;
    let offsets: Vec<f64> = bounds.iter().map(|_| uniform(&mut seed)).collect();
    let restart = |k: usize| {
        let coordinate = |(c, &(min, max)): (usize, &(f64, f64))| {
            let share = (offsets[c] + (k + 1) as f64 / root.powi(c as i32 + 1)).fract();
            min + share * (max - min)
        };
        bounds.iter().enumerate().map(coordinate).collect()
    };
    let n_restarts = if dimension == 0 { 0 } else { selection.restarts };
    let all = std::iter::once(space.start()).chain((0..n_restarts).map(restart));
    all.map(|start| (space, start)).collect()
}

/// Returns the next number in `[0, 1)` (SplitMix64: Steele, Lea and Flood 2014).
fn uniform(state: &mut u64) -> f64 {
    *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let mut z = *state;
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
}

/// Runs all descents. Results are in the order of the jobs.
fn run_all(
    subject: &Subject<'_>,
    selection: &Selection<'_>,
    jobs: &[(&Space, Vec<f64>)],
    observer: &dyn Observer,
) -> Result<Vec<(Option<Found>, usize)>> {
    let side_by_side = jobs.len() > 1 && subject.n_points() <= MAX_SIDE_BY_SIDE_POINTS;
    // Side by side, each evaluator keeps to its own thread.
    let evaluator = || Evaluator::new(subject, selection.criterion, side_by_side);
    let job = |evaluator: &mut Evaluator<'_>, (space, start): &(&Space, Vec<f64>)| {
        descend(evaluator, space, start, selection.max_evaluations, observer)
    };
    if side_by_side {
        jobs.par_iter().with_max_len(1).map_init(evaluator, job).collect()
    } else {
        let mut evaluator = evaluator();
        jobs.iter().map(|start| job(&mut evaluator, start)).collect()
    }
}

/// Picks the best descent and refines it with the evaluations that it has left. `descents` holds them family
/// by family.
fn best_of(
    subject: &Subject<'_>,
    selection: &Selection<'_>,
    spaces: &[Space],
    descents: Vec<(Option<Found>, usize)>,
    observer: &dyn Observer,
) -> Result<Selected> {
    let mut evaluations: usize = descents.iter().map(|(_, evaluations)| evaluations).sum();
    // Every space has the same free numbers (other families ignore ε), so each has equally many starts.
    let per_family = descents.len() / spaces.len();
    let mut scores = vec![None; spaces.len()];
    let mut best: Option<(usize, Found, usize)> = None;
    for (at, (found, used)) in descents.into_iter().enumerate() {
        let Some(found) = found else { continue };
        let family = at / per_family;
        scores[family] = Some(scores[family].map_or(found.score, |score: f64| score.max(found.score)));
        if best.as_ref().is_none_or(|(_, best, _)| best.score < found.score) {
            best = Some((family, found, used));
        }
    }
    let Some((family, found, used)) = best else {
        let start = spaces[0].at(&spaces[0].start());
        return Err(never_definite(&start, subject.n_points()));
    };
    let space = &spaces[family];
    let mut evaluator = Evaluator::new(subject, selection.criterion, false);
    let left = selection.max_evaluations.saturating_sub(used);
    let (found, used_to_finish) = finish(&mut evaluator, space, found, left, observer)?;
    evaluations += used_to_finish;
    scores[family] = Some(found.score);
    let sides = found.logarithms.iter().zip(space.bounds()).map(|(&x, (min, max))| side(x, min, max));
    Ok(Selected {
        free: space.parameters().zip(sides).collect(),
        hyperparameters: found.hyperparameters,
        score: found.score,
        gradient: found.gradient,
        evaluations,
        converged: found.converged,
        trend: evaluator.trend(),
        families: spaces.iter().map(Space::family).zip(scores).collect(),
    })
}

#[cfg(test)]
mod tests;
