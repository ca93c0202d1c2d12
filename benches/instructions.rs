//! Hot parts, one at a time, for counting their instructions: `benches/instructions.py` runs this under
//! callgrind.
//!
//! `cargo bench --bench instructions -- PART` runs one part once. Without a name it runs all parts and prints
//! their names. Only what happens inside [`measured`] is counted. Everything runs on the calling thread, so
//! that callgrind sees it.

#[path = "../numerics/benches/support/mod.rs"]
mod support;

use std::hint::black_box;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use gramian::http::fields::limits::{Limits, unobserved};
use gramian::store::key::CloudId;
use gramian_host::wire::read::parse::parse_json;
use gramian_host::wire::read::points::Points;
use gramian_host::wire::write::array::Array;
use gramian_numerics::kernel::{Family, Kernel};
use gramian_numerics::machine::instruction_set::InstructionSet;
use gramian_numerics::observer::{Observer, Stage, Unobserved};
use gramian_numerics::points::sampling::Sampling;
use gramian_numerics::regression::function::posterior;
use gramian_numerics::regression::solver::{Solution, Solver, System};
use gramian_numerics::regression::sums::jets::{JetOrder, Jets};
use gramian_numerics::regression::sums::nodes::Nodes;
use gramian_numerics::regression::sums::regularization::Regularization;
use gramian_numerics::surface::Surface;
use support::common::clouds::fibonacci_sphere;
use support::common::fits;
use support::scattered;

const GAUSS: Family = Family::Gauss;
const LAPLACE: Family = Family::Laplace { epsilon: 1.0 };
const MATERN: Family = Family::Matern { order: 2 };

/// A part: its name and its function.
type Part = (&'static str, fn());

const PARTS: [Part; 18] = [
    ("gram_gauss_1024", || gram(GAUSS)),
    ("gram_matern_1024", || gram(MATERN)),
    ("jets_value_gauss", || jets(GAUSS, JetOrder::Value)),
    ("jets_value_matern", || jets(MATERN, JetOrder::Value)),
    ("jets_hessian_gauss", || jets(GAUSS, JetOrder::Hessian)),
    ("jets_hessian_laplace", || jets(LAPLACE, JetOrder::Hessian)),
    ("jets_hessian_matern", || jets(MATERN, JetOrder::Hessian)),
    ("portable_value_gauss", || portable_jets(JetOrder::Value)),
    ("portable_hessian_gauss", || portable_jets(JetOrder::Hessian)),
    ("factorize_512", || factorize(512)),
    ("factorize_1024", || factorize(1024)),
    ("weights_1024", weights),
    ("variances_1024", variances),
    ("neighbours_2000", neighbours),
    ("surface_600", surface),
    ("json_points", json_points),
    ("json_array", json_array),
    ("cloud_id", cloud_id),
];

fn main() {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build_global();
    pool.expect("no pool is there yet");
    let asked: Vec<String> = std::env::args().skip(1).filter(|argument| !argument.starts_with('-')).collect();
    println!("instruction set: {}", InstructionSet::best().name());
    for (name, run) in PARTS.iter().filter(|(name, _)| asked.is_empty() || asked.iter().any(|a| a == name)) {
        println!("part: {name}");
        run();
    }
}

/// Runs what callgrind counts. It must stay a separate function, because callgrind selects it by name.
#[inline(never)]
fn measured<T>(part: impl FnOnce() -> T) -> T {
    black_box(part())
}

/// An observer that cancels a factorization after the Gram matrix.
#[derive(Default)]
struct UpToGram(AtomicBool);

impl Observer for UpToGram {
    fn enter(&self, stage: Stage) {
        self.0.store(stage == Stage::Factor, Ordering::Relaxed);
    }

    fn is_cancelled(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

fn gram(family: Family) {
    let (cloud, kernel) = (Arc::new(scattered(1024, 3, 1)), kernel(family));
    let observer = UpToGram::default();
    let outcome = measured(|| {
        System::new(cloud, kernel, Regularization::Uniform(1e-6))
            .and_then(|system| Solver::dense(system, &observer))
            .map(drop)
    });
    assert!(outcome.is_err(), "it stops behind the Gram matrix");
}

fn jets(family: Family, order: JetOrder) {
    let (cloud, queries, kernel) = (scattered(1024, 3, 1), scattered(256, 3, 2), kernel(family));
    let weights = vec![1.0; 1024];
    measured(|| Jets::evaluate(&cloud, &kernel, &weights, &queries, order, &Unobserved)).unwrap();
}

/// Evaluates jets with the portable instruction set, which every machine of this architecture has.
fn portable_jets(order: JetOrder) {
    let (cloud, queries, kernel) = (scattered(1024, 3, 1), scattered(256, 3, 2), kernel(GAUSS));
    let portable = InstructionSet::available().into_iter().find(|set| set.name() == "portable");
    let (nodes, weights) = (Nodes::on(portable.unwrap(), &cloud), vec![1.0; 1024]);
    measured(|| Jets::over(&nodes, &kernel, &weights, &queries, order, &Unobserved)).unwrap();
}

fn factorized(n: usize) -> Solver {
    let cloud = Arc::new(scattered(n, 3, 1));
    System::new(cloud, kernel(MATERN), Regularization::Uniform(1e-6))
        .and_then(|system| Solver::dense(system, &Unobserved))
        .unwrap()
}

fn factorize(n: usize) {
    measured(|| factorized(n));
}

fn weights() {
    let factor = factorized(1024);
    let values: Vec<f64> = factor.cloud().points().map(|x| x[0] * x[1] + x[2]).collect();
    measured(|| Solution::of(&factor, &values, &Unobserved)).unwrap();
}

fn variances() {
    let (factor, queries) = (factorized(1024), scattered(64, 3, 2));
    measured(|| posterior::variances(&factor, &queries, &Unobserved)).unwrap();
}

/// Builds the k-d tree and searches the neighbours of every point.
fn neighbours() {
    let cloud = scattered(2000, 3, 1);
    measured(|| Sampling::of(&cloud, &Unobserved)).unwrap();
}

/// Builds a surface: tree, local fits, jets at the points and orientation.
fn surface() {
    let signature = fits::signature(&fits::factorize(&fibonacci_sphere(600), kernel(MATERN), 1e-6));
    measured(|| Surface::of(signature, None, &Unobserved)).unwrap();
}

fn json_points() {
    let cloud = scattered(5000, 3, 3);
    let rows: Vec<&[f64]> = cloud.points().collect();
    let text = serde_json::to_vec(&serde_json::json!({ "points": rows })).unwrap();
    let lists = Limits::NONE.lists();
    let context = unobserved(&lists);
    let request = measured(|| parse_json::<Request>(&text, &context)).unwrap();
    assert_eq!(request.points.coordinates, cloud.coordinates());
}

#[derive(serde::Deserialize)]
struct Request {
    points: Points,
}

fn json_array() {
    let array = Array::new(scattered(5000, 3, 3).coordinates().to_vec(), &[5000, 3]);
    let mut text = Vec::new();
    measured(|| array.write_json(0..15_000, &mut text));
}

fn cloud_id() {
    let cloud = scattered(20_000, 3, 3);
    measured(|| CloudId::of(&cloud, None));
}

fn kernel(family: Family) -> Kernel {
    Kernel::new(family, 0.5, 1.0).unwrap()
}
