//! Time of a path over 1,000 α against that of the single eigendecomposition that it needs.
//!
//! `cargo bench --bench selection [-- n]`.

#![allow(clippy::disallowed_methods)]

mod support;

use std::time::Instant;

use gramian_numerics::kernel::{Family, Kernel};
use gramian_numerics::observer::Stage;
use gramian_numerics::regression::selection::{
    Criterion, Hyperparameters, Observations, alpha_path, default_alphas,
};
use gramian_numerics::regression::solver::trend::Mean;
use gramian_numerics::regression::sums::regularization::Regularization;
use support::common::clouds::{fibonacci_sphere, waves};
use support::{Stopwatch, size_argument};

const N_ALPHAS: usize = 1000;

fn main() {
    let n = size_argument(2000);
    let cloud = fibonacci_sphere(n);
    let values = waves(&cloud);
    let kernel = Kernel::new(Family::Matern { order: 2 }, 0.5, 1.0).unwrap();
    let at = Hyperparameters::of(&kernel, Regularization::Uniform(1e-3));
    let alphas = default_alphas(n, &kernel, N_ALPHAS);
    println!("n = {n}, {N_ALPHAS} alphas, {} threads, best of 3", rayon::current_num_threads());
    println!("| criterion | mean | eigendecomposition | the rest | whole over eigendecomposition |");
    println!("|---|---|---|---|---|");
    for criterion in
        [Criterion::MarginalLikelihood, Criterion::LeaveOneOut, Criterion::GeneralizedCrossValidation]
    {
        for mean in [Mean::Zero, Mean::Linear] {
            let round = || {
                let (stopwatch, began) = (Stopwatch::default(), Instant::now());
                let data = Observations { cloud: &cloud, values: &values, mean };
                alpha_path(data, &at, &alphas, criterion, &stopwatch).unwrap();
                let whole = began.elapsed().as_secs_f64();
                (whole, stopwatch.time(Stage::Factor, Instant::now()).as_secs_f64())
            };
            let best = (0..3).map(|_| round()).min_by(|a, b| a.0.total_cmp(&b.0)).unwrap();
            let (whole, decomposition) = best;
            let rest = whole - decomposition;
            let ratio = whole / decomposition;
            println!("| {criterion:?} | {mean:?} | {decomposition:.2} s | {rest:.2} s | {ratio:.2} |");
        }
    }
}
