//! Search for the best hyperparameters over several families and starts.

mod descent;
mod served;
mod starts;
mod walk;

use crate::error::{NumericsError, Result};
use crate::kernel::Family;
use crate::observer::{Observer, Stage};
use crate::regression::selection::criterion::Criterion;
use crate::regression::selection::evaluation::space::Space;
use crate::regression::selection::evaluation::{Evaluator, never_definite};
use crate::regression::selection::parameters::{Hyperparameters, Parameter, Variation};
use crate::regression::selection::prior::{JointlyRobust, ScalePrior};
use crate::regression::selection::subject::{Observations, Subject};
use crate::regression::solver::trend::Trend;
pub use descent::Side;
use descent::{finish, side};
pub(super) use starts::{MAX_FROM_EVERY_START, SAMPLE};
use starts::{SpaceResult, Starts, ascended};
use walk::DescentEnd;

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
    /// Prior on the length scales of axes, if any of them varies. Its logarithm is added to the criterion,
    /// for cross-validation to `−½n ln(−score)`. Scores are those of the criterion alone.
    pub prior: ScalePrior,
    /// Families to try; empty for the family of the start alone. Laplace takes its ε from here unless ε
    /// varies.
    pub families: &'a [Family],
    /// Further starts, spread over the logarithms of the bounds. With more than 768 points, starts descend on
    /// a sample of 384, and the likeliest end by all points descends further on all of them.
    pub restarts: usize,
    /// Seed of the further starts.
    pub seed: u64,
    /// Largest number of evaluations of each descent, usually [`MAX_EVALUATIONS`].
    pub max_evaluations: usize,
}

/// The best hyperparameters that a search found.
#[derive(Debug, Clone, PartialEq)]
pub struct SearchResult {
    pub hyperparameters: Hyperparameters,
    /// Score of the criterion. Greater is better.
    pub score: f64,
    /// Derivatives of the score by the logarithms of the free numbers, without those of the prior.
    /// [`Parameter::LengthScales`] has one for each axis. Same order as `free`.
    pub gradient: Vec<f64>,
    /// Parameter of each free number, and the bound that it is at, if any.
    pub free: Vec<(Parameter, Option<Side>)>,
    /// Evaluations of the criterion by all descents together.
    pub evaluations: usize,
    /// True if no component of the gradient, the prior's included, exceeds 0.01 per factor of e, in units of
    /// log likelihood. Components that lead out of the bounds do not count.
    pub converged: bool,
    /// Mean from generalised least squares, in coordinates of the cloud.
    pub trend: Option<Trend>,
    /// Families as requested, each with its best score. `None` if its matrix was not positive definite at any
    /// start.
    pub families: Vec<(Family, Option<f64>)>,
}

/// Searches for the best hyperparameters: from the start and further starts, with every family.
///
/// The start is moved into the bounds first. The number of threads changes the result by rounding only.
///
/// # Errors
/// [`NumericsError::InvalidVariation`] with the entry. [`NumericsError::LengthMismatch`] of values or noise.
/// [`NumericsError::MeanNotDetermined`], for leave-one-out also if the mean is not determined without one of
/// the points. [`NumericsError::NotPositiveDefinite`] if the matrix is not positive definite at any start.
/// [`NumericsError::Cancelled`], and the errors of [`Hyperparameters::kernel_on`].
pub fn select(selection: &Selection<'_>, observer: &dyn Observer) -> Result<SearchResult> {
    observer.enter(Stage::Factor);
    search(selection, observer)
}

/// Searches as [`select`] does, as a part of other work.
///
/// # Errors
/// Returns the errors of [`select`].
pub(super) fn search(selection: &Selection<'_>, observer: &dyn Observer) -> Result<SearchResult> {
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
        let space = match selection.prior {
            ScalePrior::Flat => Space::of(&base, vary, cloud.dimension())?,
            ScalePrior::JointlyRobust => {
                Space::of(&base, vary, cloud.dimension())?.with_prior(JointlyRobust::of(cloud))
            }
        };
        // An invalid start is refused here, with its reason.
        space.at(&space.start()).kernel_on(cloud)?;
        spaces.push(space);
    }
    let starts = |space| Starts { space, at: starts(space, selection) };
    let starts: Vec<Starts<'_>> = spaces.iter().map(starts).collect();
    let ascended = ascended(&subject, selection, &starts, observer)?;
    best_of(&subject, selection, &spaces, ascended, observer)
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
fn starts(space: &Space, selection: &Selection<'_>) -> Vec<Vec<f64>> {
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
    std::iter::once(space.start()).chain((0..n_restarts).map(restart)).collect()
}

/// Returns the next number in `[0, 1)` (SplitMix64: Steele, Lea and Flood 2014).
fn uniform(state: &mut u64) -> f64 {
    *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let mut z = *state;
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
}

/// Picks the best descent and refines it with the evaluations that it has left. `ascended` is in the order of
/// the spaces.
fn best_of(
    subject: &Subject<'_>,
    selection: &Selection<'_>,
    spaces: &[Space],
    ascended: Vec<SpaceResult>,
    observer: &dyn Observer,
) -> Result<SearchResult> {
    let mut evaluations: usize = ascended.iter().map(|ascended| ascended.evaluations).sum();
    let mut scores = vec![None; spaces.len()];
    let mut best: Option<(usize, DescentEnd, usize)> = None;
    for (family, SpaceResult { best: found, used, .. }) in ascended.into_iter().enumerate() {
        let Some(found) = found else { continue };
        scores[family] = Some(found.score);
        if best.as_ref().is_none_or(|(_, best, _)| best.merit < found.merit) {
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
    Ok(SearchResult {
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
