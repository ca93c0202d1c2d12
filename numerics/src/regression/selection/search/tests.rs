//! Searches with known answers.

use std::sync::atomic::{AtomicUsize, Ordering};

use super::*;
use crate::observer::Unobserved;
use crate::points::cloud::Cloud;
use crate::regression::solver::trend::Mean;
use crate::regression::sums::regularization::Regularization;
use crate::testing::Random;

fn line(n: usize, random: &mut Random) -> (Cloud, Vec<f64>) {
    let points: Vec<f64> = (0..n).map(|_| 6.0 * random.uniform()).collect();
    let values = points.iter().map(|x| (1.5 * x).sin() + 0.15 * random.normal()).collect();
    (Cloud::new(points, 1).unwrap(), values)
}

fn start(length_scale: f64, alpha: f64) -> Hyperparameters {
    Hyperparameters {
        family: Family::Gauss,
        length_scales: vec![length_scale],
        variance: 1.0,
        noise: Regularization::Uniform(alpha),
    }
}

fn vary(parameters: &[Parameter], min: f64, max: f64) -> Vec<Variation> {
    parameters.iter().map(|&parameter| Variation { parameter, min, max }).collect()
}

fn selection<'a>(
    cloud: &'a Cloud,
    values: &'a [f64],
    start: &'a Hyperparameters,
    vary: &'a [Variation],
) -> Selection<'a> {
    Selection {
        observations: Observations { cloud, values, mean: Mean::Zero },
        criterion: Criterion::MarginalLikelihood,
        start,
        vary,
        prior: ScalePrior::Flat,
        families: &[],
        restarts: 0,
        seed: 0,
        max_evaluations: MAX_EVALUATIONS,
    }
}

const CRITERIA: [Criterion; 3] =
    [Criterion::MarginalLikelihood, Criterion::LeaveOneOut, Criterion::GeneralizedCrossValidation];

#[test]
fn nothing_on_a_fine_grid_is_better_than_the_optimum() {
    let (cloud, values) = line(40, &mut Random(5));
    let start = start(0.5, 0.1);
    let vary = vary(&[Parameter::LengthScale, Parameter::Alpha], 1e-3, 1e2);
    for criterion in CRITERIA {
        let asked = Selection { criterion, ..selection(&cloud, &values, &start, &vary) };
        let found = select(&Selection { restarts: 4, ..asked }, &Unobserved).unwrap();
        assert!(found.converged, "{criterion:?}: {found:?}");
        let mut best = f64::NEG_INFINITY;
        for i in 0..60 {
            for j in 0..60 {
                let at = |k: i32| 1e-3 * 1e5f64.powf(f64::from(k) / 59.0);
                let here = self::start(at(i), at(j));
                let asked = Selection { criterion, ..selection(&cloud, &values, &here, &[]) };
                let score = select(&asked, &Unobserved);
                if let Ok(found) = score {
                    assert!(found.gradient.is_empty() && found.evaluations == 1);
                    best = best.max(found.score);
                }
            }
        }
        assert!(found.score >= best, "{criterion:?}: {} against {best} on a grid", found.score);
        assert!(found.score - best < 0.5 * best.abs().min(1.0), "{criterion:?}: {}, {best}", found.score);
    }
}

#[test]
fn at_an_optimum_within_the_bounds_there_is_no_slope() {
    let (cloud, values) = line(60, &mut Random(6));
    let start = start(0.3, 0.1);
    let vary = vary(&[Parameter::LengthScale, Parameter::Variance, Parameter::Alpha], 1e-4, 1e3);
    for criterion in [Criterion::MarginalLikelihood, Criterion::LeaveOneOut] {
        let asked = Selection { criterion, ..selection(&cloud, &values, &start, &vary) };
        let found = select(&asked, &Unobserved).unwrap();
        assert!(found.free.iter().all(|(_, side)| side.is_none()), "{found:?}");
        assert!(found.gradient.iter().all(|slope| slope.abs() < 0.01), "{found:?}");
        assert!(found.evaluations < 60, "{}", found.evaluations);
    }
}

#[test]
fn bounds_hold_and_are_named_where_they_matter() {
    let (cloud, values) = line(40, &mut Random(7));
    let start = start(0.5, 1.0);
    let vary = [
        Variation { parameter: Parameter::Alpha, min: 0.5, max: 2.0 },
        Variation { parameter: Parameter::LengthScale, min: 0.1, max: 10.0 },
    ];
    let asked = selection(&cloud, &values, &start, &vary);
    let found = select(&asked, &Unobserved).unwrap();
    assert_eq!(found.hyperparameters.noise, Regularization::Uniform(0.5));
    assert_eq!(found.free[0], (Parameter::Alpha, Some(Side::Min)));
    assert!(found.converged && found.gradient[0] < 0.0);
}

#[test]
fn restarts_find_the_better_of_two_modes() {
    // Two modes: all is noise, or all is structure of short range (Rasmussen and Williams 2006, fig. 5.5).
    let points: Vec<f64> = (0..30).map(f64::from).map(|i| 0.2 * i).collect();
    let values: Vec<f64> = points.iter().map(|x| (7.0 * x).sin()).collect();
    let cloud = Cloud::new(points, 1).unwrap();
    let start = start(50.0, 1.0);
    let vary = vary(&[Parameter::LengthScale, Parameter::Alpha], 1e-2, 1e2);
    let asked = selection(&cloud, &values, &start, &vary);
    let alone = select(&asked, &Unobserved).unwrap();
    let found = select(&Selection { restarts: 8, ..asked }, &Unobserved).unwrap();
    assert!(found.score > alone.score + 1.0, "{} against {}", found.score, alone.score);
    assert!(found.hyperparameters.length_scales[0] < 2.0, "{found:?}");
    assert_eq!(found, select(&Selection { restarts: 8, ..asked }, &Unobserved).unwrap());
}

#[test]
fn the_best_family_wins_and_all_are_scored() {
    let (cloud, values) = line(50, &mut Random(8));
    let start = start(0.5, 0.05);
    let parameters = [Parameter::LengthScale, Parameter::Variance, Parameter::Alpha, Parameter::Epsilon];
    let vary = vary(&parameters, 1e-3, 1e2);
    let families = [Family::Matern { order: 0 }, Family::Laplace { epsilon: 0.1 }, Family::Gauss];
    let asked = selection(&cloud, &values, &start, &vary);
    let found = select(&Selection { families: &families, ..asked }, &Unobserved).unwrap();
    assert_eq!(found.families.len(), 3);
    let scores: Vec<f64> = found.families.iter().map(|(_, score)| score.unwrap()).collect();
    assert_eq!(scores.iter().copied().fold(f64::MIN, f64::max), found.score);
    assert!(scores[1] >= scores[0] && found.score == scores.iter().copied().fold(scores[0], f64::max));
    assert_eq!(found.gradient.len(), 4);
}

#[test]
fn axes_that_do_not_matter_get_long_length_scales() {
    let random = &mut Random(9);
    let cloud = Cloud::new((0..240).map(|_| random.uniform()).collect(), 3).unwrap();
    let values: Vec<f64> = cloud.points().map(|x| (6.0 * x[0]).sin() + 0.05 * random.normal()).collect();
    let start = start(0.5, 0.05);
    let mut vary = vary(&[Parameter::LengthScales], 1e-2, 1e2);
    vary.push(Variation { parameter: Parameter::Alpha, min: 1e-6, max: 1.0 });
    let asked = selection(&cloud, &values, &start, &vary);
    let found = select(&asked, &Unobserved).unwrap();
    let scales = &found.hyperparameters.length_scales;
    assert!(scales[0] < 1.0 && scales[1] > 5.0 && scales[2] > 5.0, "{scales:?}");
    assert_eq!((found.gradient.len(), found.free.len()), (4, 4));
}

#[test]
fn searches_that_make_no_sense_are_refused() {
    let (cloud, values) = line(10, &mut Random(10));
    let start = start(0.5, 0.05);
    let refused = |vary: &[Variation]| {
        let criterion = Criterion::LeaveOneOut;
        let asked = Selection { criterion, ..selection(&cloud, &values, &start, vary) };
        select(&asked, &Unobserved).unwrap_err()
    };
    let one = |parameter, min, max| Variation { parameter, min, max };
    for (vary, entry) in [
        (vec![one(Parameter::Alpha, 0.0, 1.0)], 0),
        (vec![one(Parameter::Alpha, 1.0, f64::NAN)], 0),
        (vec![one(Parameter::Alpha, 0.1, 1.0), one(Parameter::Variance, 2.0, 1.0)], 1),
        (vec![one(Parameter::Alpha, 0.1, 1.0), one(Parameter::Alpha, 0.1, 1.0)], 1),
        (vec![one(Parameter::LengthScaleOfAxis(1), 0.1, 1.0)], 0),
        (vec![one(Parameter::Epsilon, 0.1, 1.0)], 0),
    ] {
        let found = refused(&vary);
        assert!(matches!(found, NumericsError::InvalidVariation { entry: e, .. } if e == entry), "{found:?}");
    }
}

/// An observer that cancels after a given number of checks.
struct Impatient(AtomicUsize);

impl Observer for Impatient {
    fn enter(&self, _stage: Stage) {}

    fn is_cancelled(&self) -> bool {
        self.0.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |left| left.checked_sub(1)).is_err()
    }
}

#[test]
fn a_cancelled_search_stops() {
    let (cloud, values) = line(60, &mut Random(11));
    let start = start(0.5, 0.1);
    let vary = vary(&[Parameter::LengthScale, Parameter::Variance, Parameter::Alpha], 1e-4, 1e3);
    for looks in [0, 3, 40, 100] {
        for restarts in [0, 5] {
            let asked =
                Selection { criterion: Criterion::LeaveOneOut, ..selection(&cloud, &values, &start, &vary) };
            let observer = Impatient(AtomicUsize::new(looks));
            let found = select(&Selection { restarts, ..asked }, &observer);
            assert_eq!(found.unwrap_err(), NumericsError::Cancelled);
        }
    }
}

#[test]
fn evaluations_are_bounded() {
    let (cloud, values) = line(60, &mut Random(12));
    let start = start(5.0, 1.0);
    let vary = vary(&[Parameter::LengthScale, Parameter::Variance, Parameter::Alpha], 1e-4, 1e3);
    let asked = selection(&cloud, &values, &start, &vary);
    let found = select(&Selection { max_evaluations: 5, ..asked }, &Unobserved).unwrap();
    assert!(found.evaluations <= 7 && !found.converged, "{found:?}");
}

/// A hundred values at random points in six dimensions, of which the first matters a little.
fn weak(random: &mut Random) -> (Cloud, Vec<f64>) {
    let cloud = Cloud::new((0..600).map(|_| random.normal()).collect(), 6).unwrap();
    let values = cloud.points().map(|x| 0.3 * x[0] + random.normal()).collect();
    (cloud, values)
}

#[test]
fn a_prior_keeps_axes_from_fitting_noise() {
    let mut gain = 0.0;
    for seed in 1..=4 {
        let random = &mut Random(seed);
        let ((cloud, values), (others, other_values)) = (weak(random), weak(random));
        let start = start(2.0, 0.5);
        let mut vary = vary(&[Parameter::LengthScales], 1e-2, 1e3);
        vary.extend(self::vary(&[Parameter::Variance, Parameter::Alpha], 1e-4, 1e2));
        let [flat, robust] = [ScalePrior::Flat, ScalePrior::JointlyRobust].map(|prior| {
            let asked = Selection { prior, restarts: 2, ..selection(&cloud, &values, &start, &vary) };
            let found = select(&asked, &Unobserved).unwrap();
            let elsewhere = selection(&others, &other_values, &found.hyperparameters, &[]);
            (found.score, select(&elsewhere, &Unobserved).unwrap().score)
        });
        // The prior has a price in the likelihood of the values, and gains in that of others.
        assert!(flat.0 > robust.0 - 1e-3, "{seed}: {flat:?} {robust:?}");
        gain += robust.1 - flat.1;
    }
    assert!(gain > 0.0, "{gain}");
}

#[test]
fn starts_of_a_large_search_descend_on_a_sample() {
    // The start takes all for noise. A restart finds the structure, on a sample first.
    let points: Vec<f64> = (0..900).map(|i| 0.02 * f64::from(i)).collect();
    let random = &mut Random(13);
    let values: Vec<f64> = points.iter().map(|x| (7.0 * x).sin() + 0.3 * random.normal()).collect();
    let cloud = Cloud::new(points, 1).unwrap();
    let start = start(50.0, 1.0);
    let vary = vary(&[Parameter::LengthScale, Parameter::Alpha], 1e-2, 1e2);
    let asked = selection(&cloud, &values, &start, &vary);
    let found = select(&Selection { restarts: 4, ..asked }, &Unobserved).unwrap();
    let noise = found.hyperparameters.noise.at(0).sqrt();
    assert!(found.converged && (0.27..0.33).contains(&noise), "{found:?}");
    assert!(found.hyperparameters.length_scales[0] < 1.0, "{found:?}");
    let alone = select(&Selection { start: &found.hyperparameters, ..asked }, &Unobserved).unwrap();
    assert!((alone.score - found.score).abs() < 1e-3, "{} {}", alone.score, found.score);
}
