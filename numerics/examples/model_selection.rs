//! Selects a kernel by its likelihood, for comparison with scikit-learn by `bench/peers/model_selection.py`.
//!
//! `cargo run --release --example model_selection FILE FAMILY RESTARTS`. Rows of FILE are coordinates and a
//! value, separated by commas. FAMILY is `gauss` or `matern` (ν = 5/2). Prints likelihood, seconds,
//! evaluations, whether the search converged, and the hyperparameters.

use std::time::Instant;

use gramian_numerics::kernel::Family;
use gramian_numerics::observer::Unobserved;
use gramian_numerics::points::cloud::Cloud;
use gramian_numerics::regression::selection::{
    Criterion, Hyperparameters, MAX_EVALUATIONS, Observations, Parameter, ScalePrior, Selection, Variation,
    select,
};
use gramian_numerics::regression::solver::trend::Mean;
use gramian_numerics::regression::sums::regularization::Regularization;

/// Bounds of length scales, variance and noise, equal to those of the script.
const LENGTH_SCALES: [f64; 2] = [1e-2, 1e3];
const VARIANCE: [f64; 2] = [1e-3, 1e3];
const ALPHA: [f64; 2] = [1e-5, 1e1];
const FIRST_ALPHA: f64 = 0.1;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [file, family, restarts] = &arguments[..] else { panic!("FILE FAMILY RESTARTS") };
    let text = std::fs::read_to_string(file).unwrap();
    let rows: Vec<Vec<f64>> = text
        .lines()
        .map(|line| line.split(',').map(|number| number.trim().parse().unwrap()).collect())
        .collect();
    let dimension = rows[0].len() - 1;
    let cloud =
        Cloud::new(rows.iter().flat_map(|row| &row[..dimension]).copied().collect(), dimension).unwrap();
    let values: Vec<f64> = rows.iter().map(|row| row[dimension]).collect();
    // The Gauss kernel of scikit-learn is exp(−r²/2ℓ²), so its ℓ is multiplied by √2.
    let (family, unit) = match family.as_str() {
        "gauss" => (Family::Gauss, std::f64::consts::SQRT_2),
        _ => (Family::Matern { order: 2 }, 1.0),
    };
    let start = Hyperparameters {
        family,
        length_scales: vec![unit; dimension],
        variance: 1.0,
        noise: Regularization::uniform(FIRST_ALPHA).unwrap(),
    };
    let vary = [
        (Parameter::LengthScales, LENGTH_SCALES.map(|bound| bound * unit)),
        (Parameter::Variance, VARIANCE),
        (Parameter::Alpha, ALPHA),
    ]
    .map(|(parameter, [min, max])| Variation { parameter, min, max });
    let asked = Selection {
        observations: Observations { cloud: &cloud, values: &values, mean: Mean::Zero },
        criterion: Criterion::MarginalLikelihood,
        start: &start,
        vary: &vary,
        prior: ScalePrior::Flat,
        families: &[],
        restarts: restarts.parse().unwrap(),
        seed: 0,
        max_evaluations: MAX_EVALUATIONS,
    };
    let began = Instant::now();
    let found = select(&asked, &Unobserved).unwrap();
    let seconds = began.elapsed().as_secs_f64();
    println!("{} {seconds} {} {}", found.score, found.evaluations, found.converged);
    println!("{:?}", found.hyperparameters);
}
