//! Scores compared with their definitions, and slopes with differences.

use std::sync::Arc;

use super::*;
use crate::kernel::Family;
use crate::observer::Unobserved;
use crate::points::cloud::Cloud;
use crate::regression::selection::parameters::{Parameter, Variation};
use crate::regression::selection::subject::Observations;
use crate::regression::solver::trend::Mean;
use crate::regression::solver::{Solution, Solver, System};
use crate::regression::sums::regularization::Regularization;
use crate::testing::{Random, all_families};

const CRITERIA: [Criterion; 3] =
    [Criterion::MarginalLikelihood, Criterion::LeaveOneOut, Criterion::GeneralizedCrossValidation];

fn cube(n: usize, d: usize, random: &mut Random) -> Cloud {
    Cloud::new((0..n * d).map(|_| 2.0 * random.uniform() - 1.0).collect(), d).unwrap()
}

fn values(cloud: &Cloud, random: &mut Random) -> Vec<f64> {
    cloud.points().map(|x| 3.0 + (2.0 * x[0]).sin() + x[1] + 0.2 * random.normal()).collect()
}

fn per_point(n: usize) -> Regularization {
    Regularization::per_point((0..n).map(|i| 0.02 + 0.1 * (i as f64 * 0.7).sin().powi(2)).collect()).unwrap()
}

fn free(parameters: &[Parameter]) -> Vec<Variation> {
    parameters.iter().map(|&parameter| Variation { parameter, min: 1e-3, max: 1e3 }).collect()
}

fn score(subject: &Subject<'_>, criterion: Criterion, at: &Hyperparameters) -> f64 {
    Evaluator::new(subject, criterion, true).score(at, &Unobserved).unwrap().unwrap().score
}

/// Compares slopes with central differences.
fn check_slopes(subject: &Subject<'_>, criterion: Criterion, base: &Hyperparameters, vary: &[Variation]) {
    let space = Space::of(base, vary, subject.cloud.dimension()).unwrap();
    let x = space.start();
    let mut evaluator = Evaluator::new(subject, criterion, false);
    let at = space.at(&x);
    let state = evaluator.score(&at, &Unobserved).unwrap().unwrap();
    let gradient = evaluator.gradient(&space, &at, &state, &Unobserved).unwrap();
    assert_eq!(gradient.len(), space.n_free());
    for (k, slope) in gradient.iter().enumerate() {
        let step = 1e-4;
        let moved = |by: f64| {
            let mut x = x.clone();
            x[k] += by;
            score(subject, criterion, &space.at(&x))
        };
        // Difference quotients of fourth order.
        let near = (moved(step) - moved(-step)) / (2.0 * step);
        let far = (moved(2.0 * step) - moved(-2.0 * step)) / (4.0 * step);
        let difference = (4.0 * near - far) / 3.0;
        let scale = 1e-3 * (1.0 + state.score.abs());
        assert!(
            (slope - difference).abs() <= 1e-5 * (slope.abs() + scale),
            "{criterion:?} {base:?} number {k}: {slope:e} against {difference:e}"
        );
    }
}

#[test]
fn slopes_of_every_family_and_criterion_agree_with_differences() {
    let random = &mut Random(1);
    let cloud = cube(40, 3, random);
    let values = values(&cloud, random);
    for mean in [Mean::Zero, Mean::Constant, Mean::Linear] {
        let subject = Subject::of(Observations { cloud: &cloud, values: &values, mean }).unwrap();
        for family in all_families() {
            for criterion in CRITERIA {
                let mut base = Hyperparameters {
                    family,
                    length_scales: vec![0.9],
                    variance: 1.7,
                    noise: Regularization::Uniform(0.05),
                };
                let mut parameters = vec![Parameter::LengthScale, Parameter::Variance, Parameter::Alpha];
                let has_epsilon = matches!(family, Family::Laplace { epsilon } if epsilon > 0.0);
                parameters.extend(has_epsilon.then_some(Parameter::Epsilon));
                check_slopes(&subject, criterion, &base, &free(&parameters));
                base.length_scales = vec![0.8, 1.1, 2.0];
                base.noise = per_point(40);
                let parameters = [Parameter::Variance, Parameter::LengthScales];
                check_slopes(&subject, criterion, &base, &free(&parameters));
            }
        }
    }
}

#[test]
fn slopes_of_many_points_and_of_one_axis_agree_with_differences() {
    let random = &mut Random(2);
    // More than one block and more than one task.
    let cloud = cube(300, 4, random);
    let values = values(&cloud, random);
    let subject = Subject::of(Observations { cloud: &cloud, values: &values, mean: Mean::Constant }).unwrap();
    let base = Hyperparameters {
        family: Family::Matern { order: 2 },
        length_scales: vec![1.2],
        variance: 0.7,
        noise: Regularization::Uniform(0.05),
    };
    for criterion in CRITERIA {
        let parameters = [Parameter::LengthScaleOfAxis(2), Parameter::Alpha];
        check_slopes(&subject, criterion, &base, &free(&parameters));
    }
}

/// Returns a factorized system and its solution.
fn solved(cloud: &Cloud, values: &[f64], mean: Mean, at: &Hyperparameters) -> (Solver, Solution) {
    let kernel = at.kernel_on(cloud).unwrap();
    let system = System::new(Arc::new(cloud.clone()), kernel, at.noise.clone()).unwrap();
    let solver = Solver::dense(system, &Unobserved).unwrap();
    let solution = Solution::with_mean(&solver, values, mean, &Unobserved).unwrap();
    (solver, solution)
}

#[test]
fn likelihood_and_mean_are_those_of_the_solver() {
    let random = &mut Random(3);
    let cloud = cube(60, 2, random);
    let values = values(&cloud, random);
    for mean in [Mean::Zero, Mean::Constant, Mean::Linear] {
        for noise in [Regularization::Uniform(0.1), per_point(60)] {
            let at = Hyperparameters {
                family: Family::Matern { order: 1 },
                length_scales: vec![0.5, 2.0],
                variance: 2.0,
                noise,
            };
            let subject = Subject::of(Observations { cloud: &cloud, values: &values, mean }).unwrap();
            let mut evaluator = Evaluator::new(&subject, Criterion::MarginalLikelihood, false);
            let found = evaluator.score(&at, &Unobserved).unwrap().unwrap().score;
            let (solver, solution) = solved(&cloud, &values, mean, &at);
            let expected = -0.5
                * (solution.energy + solver.log_determinant().unwrap() + 60.0 * std::f64::consts::TAU.ln());
            assert!((found - expected).abs() < 1e-10 * expected.abs(), "{found} against {expected}");
            let coefficients = evaluator.trend().map(|trend| trend.of_coordinates());
            let Some(trend) = &solution.trend else { continue };
            for (a, b) in coefficients.unwrap().iter().zip(&trend.of_coordinates()) {
                assert!((a - b).abs() < 1e-10, "{a} against {b}");
            }
        }
    }
}

#[test]
fn cross_validation_is_that_of_the_hat_matrix() {
    let random = &mut Random(4);
    let (n, cloud) = (30, cube(30, 2, random));
    let values = values(&cloud, random);
    for mean in [Mean::Zero, Mean::Linear] {
        for noise in [Regularization::Uniform(0.1), per_point(n)] {
            let at = Hyperparameters {
                family: Family::Gauss,
                length_scales: vec![0.8],
                variance: 2.0,
                noise: noise.clone(),
            };
            let subject = Subject::of(Observations { cloud: &cloud, values: &values, mean }).unwrap();
            let found = score(&subject, Criterion::GeneralizedCrossValidation, &at);
            let smoothed = |values: &[f64]| -> Vec<f64> {
                let (_, solution) = solved(&cloud, values, mean, &at);
                (0..n).map(|i| values[i] - noise.at(i) * solution.weights[i]).collect()
            };
            let unit = |i: usize| (0..n).map(|k| f64::from(u8::from(k == i))).collect::<Vec<f64>>();
            let freedom: f64 = (0..n).map(|i| 1.0 - smoothed(&unit(i))[i]).sum();
            let mean_noise = (0..n).map(|i| noise.at(i)).sum::<f64>() / n as f64;
            let fit = smoothed(&values);
            let misfit: f64 = (0..n).map(|i| (values[i] - fit[i]).powi(2) * mean_noise / noise.at(i)).sum();
            let expected = -(n as f64) * misfit / (freedom * freedom);
            assert!((found - expected).abs() < 1e-8 * expected.abs(), "{found} against {expected}");
        }
    }
}

#[test]
fn matrices_that_are_not_definite_have_no_score_and_too_few_points_no_mean() {
    let cloud = Cloud::new(vec![0.0, 0.0, 1.0], 1).unwrap();
    let at = Hyperparameters {
        family: Family::Gauss,
        length_scales: vec![1.0],
        variance: 1.0,
        noise: Regularization::Uniform(0.0),
    };
    let subject =
        Subject::of(Observations { cloud: &cloud, values: &[1.0, 2.0, 3.0], mean: Mean::Zero }).unwrap();
    for criterion in CRITERIA {
        let found = Evaluator::new(&subject, criterion, false).score(&at, &Unobserved).unwrap();
        assert!(found.is_none());
    }
    let pair = Cloud::new(vec![0.0, 1.0], 1).unwrap();
    let refused = Subject::of(Observations { cloud: &pair, values: &[1.0, 2.0], mean: Mean::Linear }).err();
    assert_eq!(refused, Some(NumericsError::MeanNotDetermined));
}
