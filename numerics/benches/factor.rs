//! Speed of the factorization against faer's matrix product of the same size.
//!
//! `cargo bench --bench factor [-- n]`. The two are measured in turn, so that a drifting machine affects
//! both. With `--lockstep` it runs one round for each line on standard input.

#![allow(clippy::disallowed_methods)]

mod support;

use std::sync::Arc;
use std::time::Instant;

use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, Par};
use gramian_numerics::kernel::{Family, Kernel};
use gramian_numerics::observer::Stage;
use gramian_numerics::regression::solver::{Solver, System};
use gramian_numerics::regression::sums::regularization::Regularization;
use support::common::clouds::fibonacci_sphere;
use support::{ROUNDS, Stopwatch, measure, size_argument, timed};

fn main() {
    let n = size_argument(4000);
    let n_threads = rayon::current_num_threads();
    let cloud = Arc::new(fibonacci_sphere(n));
    let (a, mut c) = (Mat::from_fn(n, n, |i, j| ((i * 7 + j) % 13) as f64), Mat::zeros(n, n));
    let bests = measure(|| {
        let mut multiply =
            || matmul(c.as_mut(), Accum::Replace, a.as_ref(), a.as_ref(), 1.0, Par::rayon(n_threads));
        let product = timed(&mut multiply).1;
        let stopwatch = Stopwatch::default();
        let kernel = Kernel::new(Family::Matern { order: 2 }, 0.2, 1.0).unwrap();
        let alpha = Regularization::uniform(1e-6).unwrap();
        System::new(cloud.clone(), kernel, alpha)
            .and_then(|system| Solver::dense(system, &stopwatch))
            .unwrap();
        let end = Instant::now();
        let stage = |stage| stopwatch.time(stage, end);
        vec![
            ("product", product),
            ("gram", stage(Stage::Gram)),
            ("factor", stage(Stage::Factor)),
            ("condition", stage(Stage::Condition)),
        ]
    });
    let Some(bests) = bests else { return };
    println!("n = {n}, {n_threads} threads, best of {ROUNDS}");
    bests.print();
    let cubed = (n as f64).powi(3) / 1e9;
    let (product, factor) = (2.0 * cubed / bests.seconds("product"), cubed / 3.0 / bests.seconds("factor"));
    let percent = 100.0 * factor / product;
    println!("product {product:.1} GFLOP/s, factor {factor:.1} GFLOP/s: {percent:.0} % of the product");
    let pairs = (n * (n + 1) / 2) as f64 / 1e9;
    println!("gram {:.2} G pairs/s", pairs / bests.seconds("gram"));
}
