//! Closed forms compared with fits that really leave a point out.

use std::sync::Arc;

use super::*;
use crate::kernel::{Family, Kernel};
use crate::observer::Unobserved;
use crate::points::cloud::Cloud;
use crate::regression::solver::System;
use crate::regression::solver::trend::Mean;
use crate::testing::Random;

const N: usize = 25;

fn cloud(random: &mut Random) -> Cloud {
    Cloud::new((0..2 * N).map(|_| 2.0 * random.uniform() - 1.0).collect(), 2).unwrap()
}

fn noises() -> [Regularization; 2] {
    let variances = (0..N).map(|i| 0.01 + 0.3 * (i as f64).sin().powi(2)).collect();
    [Regularization::Uniform(0.04), Regularization::per_point(variances).unwrap()]
}

fn solved(cloud: &Cloud, values: &[f64], mean: Mean, noise: Regularization) -> (Solver, Solution) {
    let kernel = Kernel::new(Family::Matern { order: 2 }, 1.3, 0.8).unwrap();
    let system = System::new(Arc::new(cloud.clone()), kernel, noise).unwrap();
    let solver = Solver::dense(system, &Unobserved).unwrap();
    let solution = Solution::with_mean(&solver, values, mean, &Unobserved).unwrap();
    (solver, solution)
}

/// Returns the mean and latent variance at point i from all other points: the value and variance of kriging,
/// by its weights.
fn from_others(cloud: &Cloud, values: &[f64], mean: Mean, noise: &Regularization, i: usize) -> (f64, f64) {
    let others: Vec<usize> = (0..N).filter(|&k| k != i).collect();
    let rest = cloud.select(&others);
    let of_others = |all: &dyn Fn(usize) -> f64| others.iter().map(|&k| all(k)).collect::<Vec<f64>>();
    let noise = Regularization::per_point(of_others(&|k| noise.at(k))).unwrap();
    let (solver, solution) = solved(&rest, &of_others(&|k| values[k]), mean, noise);
    let kernel = solver.kernel();
    let x = cloud.point(i);
    let predicted = |solution: &Solution| {
        let at = Cloud::new(x.to_vec(), 2).unwrap();
        let value = solver.expansion(&solution.weights).values_at(&at, &Unobserved).unwrap()[0];
        value + solution.trend.as_ref().map_or(0.0, |trend| trend.at(x))
    };
    // Error variance of the prediction w·Y: k₀ − 2w·k + wᵀ(K + N)w. Unit values give the weights w.
    let unit = |k: usize| (0..N - 1).map(|l| f64::from(u8::from(l == k))).collect::<Vec<f64>>();
    let weights: Vec<f64> = (0..N - 1)
        .map(|k| predicted(&Solution::with_mean(&solver, &unit(k), mean, &Unobserved).unwrap()))
        .collect();
    let covariance = |a: &[f64], b: &[f64]| {
        let r = 5f64.sqrt() * ((a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2)).sqrt() / 1.3;
        0.8 * (1.0 + r + r * r / 3.0) * (-r).exp()
    };
    let mut variance = kernel.at_zero();
    for (a, wa) in weights.iter().enumerate() {
        variance -= 2.0 * wa * covariance(x, rest.point(a));
        variance += wa * wa * solver.regularization().at(a);
        for (b, wb) in weights.iter().enumerate() {
            variance += wa * wb * covariance(rest.point(a), rest.point(b));
        }
    }
    (predicted(&solution), variance)
}

#[test]
fn predictions_are_those_of_all_other_points() {
    let random = &mut Random(21);
    let cloud = cloud(random);
    let values: Vec<f64> = cloud.points().map(|x| 2.0 + x[0].sin() + 0.3 * random.normal()).collect();
    for noise in noises() {
        for mean in [Mean::Zero, Mean::Constant, Mean::Linear] {
            let (solver, solution) = solved(&cloud, &values, mean, noise.clone());
            let found = leave_one_out(&solver, &solution, &values, 1.0, &Unobserved).unwrap();
            for i in 0..N {
                let (expected, variance) = from_others(&cloud, &values, mean, &noise, i);
                assert!((found.means[i] - expected).abs() < 1e-9, "{mean:?}");
                assert!((found.variances[i] - variance).abs() < 1e-9, "{mean:?}");
                let observed = variance + noise.at(i);
                assert!((found.observation_variances[i] - observed).abs() < 1e-9);
                let density = -0.5 * ((TAU * observed).ln() + (values[i] - expected).powi(2) / observed);
                assert!((found.log_predictive_densities[i] - density).abs() < 1e-7);
            }
        }
    }
}

#[test]
fn both_ways_agree_and_a_factor_scales_variances_alone() {
    let random = &mut Random(22);
    let cloud = cloud(random);
    let values: Vec<f64> = cloud.points().map(|x| x[0] + 0.3 * random.normal()).collect();
    for noise in noises() {
        let (solver, solution) = solved(&cloud, &values, Mean::Linear, noise.clone());
        let found = leave_one_out(&solver, &solution, &values, 1.0, &Unobserved).unwrap();
        let at = Hyperparameters::of(solver.kernel(), noise);
        let data = Observations { cloud: &cloud, values: &values, mean: Mean::Linear };
        let again = leave_one_out_with(data, &at, &Unobserved).unwrap();
        let scaled = leave_one_out(&solver, &solution, &values, 4.0, &Unobserved).unwrap();
        for i in 0..N {
            assert!((found.means[i] - again.means[i]).abs() < 1e-10);
            assert!((found.variances[i] - again.variances[i]).abs() < 1e-10);
            assert_eq!(found.means[i], scaled.means[i]);
            assert!((4.0 * found.variances[i] - scaled.variances[i]).abs() < 1e-12);
        }
        assert!((found.score() - again.score()).abs() < 1e-8);
    }
}
