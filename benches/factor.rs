//! The speed of the factorization against faer's matrix product of the same size, in one run.
//!
//! `cargo bench --bench factor [-- n]`; the two are measured in turn, so that a drifting machine disturbs both.

use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, Par};
use gramian::numerics::cloud::Cloud;
use gramian::numerics::kernel::{Family, Kernel};
use gramian::numerics::observer::{Observer, Stage};
use gramian::numerics::regularization::Regularization;
use gramian::numerics::solver::GramFactor;

const ROUNDS: usize = 7;

/// Time spent in each stage.
#[derive(Default)]
struct Stopwatch(Mutex<Vec<(Stage, Instant)>>);

impl Observer for Stopwatch {
    fn enter(&self, stage: Stage) {
        self.0.lock().unwrap().push((stage, Instant::now()));
    }

    fn is_cancelled(&self) -> bool {
        false
    }
}

impl Stopwatch {
    fn time(&self, stage: Stage, end: Instant) -> Duration {
        let entries = self.0.lock().unwrap();
        let at = entries.iter().position(|entry| entry.0 == stage).unwrap();
        entries.get(at + 1).map_or(end, |next| next.1) - entries[at].1
    }
}

fn main() {
    let n = std::env::args().skip(1).find_map(|argument| argument.parse().ok()).unwrap_or(4000);
    let n_threads = rayon::current_num_threads();
    println!("n = {n}, {n_threads} threads, best of {ROUNDS}");
    let cloud = Arc::new(sphere(n));
    let (a, mut c) = (Mat::from_fn(n, n, |i, j| ((i * 7 + j) % 13) as f64), Mat::zeros(n, n));
    let (mut product, mut gram, mut factor, mut condition) =
        (Best::new(), Best::new(), Best::new(), Best::new());
    for _ in 0..ROUNDS {
        let began = Instant::now();
        matmul(c.as_mut(), Accum::Replace, a.as_ref(), a.as_ref(), 1.0, Par::rayon(n_threads));
        product.offer(began.elapsed());
        let stopwatch = Stopwatch::default();
        let kernel = Kernel::new(Family::Matern { order: 2 }, 0.2, 1.0).unwrap();
        let alpha = Regularization::uniform(1e-6).unwrap();
        GramFactor::factorize(cloud.clone(), kernel, alpha, &stopwatch).unwrap();
        let end = Instant::now();
        gram.offer(stopwatch.time(Stage::Gram, end));
        factor.offer(stopwatch.time(Stage::Factor, end));
        condition.offer(stopwatch.time(Stage::Condition, end));
    }
    let cubed = (n as f64).powi(3);
    let (product_rate, factor_rate) = (2.0 * cubed / product.0 / 1e9, cubed / 3.0 / factor.0 / 1e9);
    println!("matrix product  {:8.1} ms  {product_rate:6.1} GFLOP/s", product.0 * 1e3);
    let percent = 100.0 * factor_rate / product_rate;
    println!(
        "factorization   {:8.1} ms  {factor_rate:6.1} GFLOP/s, {percent:.0} % of the product",
        factor.0 * 1e3
    );
    let pairs = (n * (n + 1) / 2) as f64 / gram.0 / 1e9;
    println!("Gram assembly   {:8.1} ms  {pairs:6.2} G pairs/s", gram.0 * 1e3);
    println!("condition       {:8.1} ms", condition.0 * 1e3);
}

/// The least of some times, in seconds.
struct Best(f64);

impl Best {
    fn new() -> Self {
        Self(f64::INFINITY)
    }

    fn offer(&mut self, time: Duration) {
        self.0 = self.0.min(time.as_secs_f64());
    }
}

/// n points on the unit sphere.
fn sphere(n: usize) -> Cloud {
    let golden = std::f64::consts::PI * (1.0 + 5f64.sqrt());
    let point = |i: usize| {
        let z = 1.0 - (2 * i + 1) as f64 / n as f64;
        let (r, t) = ((1.0 - z * z).sqrt(), golden * i as f64);
        [r * t.cos(), r * t.sin(), z]
    };
    Cloud::new((0..n).flat_map(point).collect(), 3).unwrap()
}
