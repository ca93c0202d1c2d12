//! Kernel evaluations per second on one core, by instruction set and family.
//!
//! Measured are entries of the Gram matrix, and values, gradients and Hessians summed over the points. A
//! second table is by dimension and has floating-point operations too.
//!
//! `cargo bench --bench kernels`

#![allow(clippy::disallowed_methods)]

mod support;

use std::time::Instant;

use gramian_numerics::kernel::{Family, Kernel, WendlandSmoothness};
use gramian_numerics::machine::instruction_set::InstructionSet;
use gramian_numerics::observer::Unobserved;
use gramian_numerics::points::cloud::Cloud;
use gramian_numerics::regression::sums::gram::fill_cross_gram;
use gramian_numerics::regression::sums::jets::{JetOrder, Jets};
use gramian_numerics::regression::sums::nodes::Nodes;
use support::scattered;

const N_POINTS: usize = 4096;
const N_QUERIES: usize = 500;
const ROUNDS: usize = 15;

const FAMILIES: [(&str, Family); 7] = [
    ("gauss", Family::Gauss),
    ("laplace, epsilon 1", Family::Laplace { epsilon: 1.0 }),
    ("matern, nu 1.5", Family::Matern { order: 1 }),
    ("matern, nu 2.5", Family::Matern { order: 2 }),
    ("matern, nu 8.5", Family::Matern { order: 8 }),
    ("wendland, smoothness 4", Family::Wendland { smoothness: WendlandSmoothness::C4 }),
    ("inverse multiquadric", Family::InverseMultiquadric),
];

const WORKS: [(&str, Work); 5] = [
    ("gram", Work::Gram),
    ("value", Work::Jets(JetOrder::Value)),
    ("gradient", Work::Jets(JetOrder::Gradient)),
    ("Hessian", Work::Jets(JetOrder::Hessian)),
    ("magnitudes", Work::Jets(JetOrder::HessianWithMagnitudes)),
];

#[derive(Clone, Copy)]
enum Work {
    /// Entries of rows of the cross-Gram matrix, written to a warm buffer.
    Gram,
    /// Sums of all derivatives up to an order.
    Jets(JetOrder),
}

fn main() {
    let one_core = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    one_core.install(|| {
        println!(
            "n = {N_POINTS}, G pairs/s on one core, best of {ROUNDS}; each order includes the lower ones"
        );
        for set in InstructionSet::available() {
            by_family(set);
        }
        by_dimension();
    });
}

fn by_family(set: InstructionSet) {
    print!("\n{:28}", format!("d = 3, {}", set.name()));
    WORKS.iter().for_each(|(name, _)| print!(" {name:>10}"));
    println!();
    for (name, family) in FAMILIES {
        print!("{name:28}");
        WORKS.iter().for_each(|&(_, work)| print!(" {:10.3}", rate(set, family, work, 3)));
        println!();
    }
}

/// Prints rates by dimension. Operations are the multiplications and additions for one pair. Those of
/// the profile are not counted.
fn by_dimension() {
    println!("\n{:28} {:>10} {:>10} {:>10}", "gauss, best set", "value", "Hessian", "G flop/s");
    for d in [1, 2, 3, 4, 6, 8, 16] {
        let set = InstructionSet::best();
        let [value, hessian] =
            [JetOrder::Value, JetOrder::Hessian].map(|order| rate(set, Family::Gauss, Work::Jets(order), d));
        // Differences and their squares, gradient, weighted rows and their products.
        let flops = 3 * d + 2 * d + d + d * (d + 1);
        println!("{:28} {value:10.3} {hessian:10.3} {:10.1}", format!("d = {d}"), hessian * flops as f64);
    }
}

/// The rate of a kind of work in G pairs/s.
fn rate(set: InstructionSet, family: Family, work: Work, d: usize) -> f64 {
    let kernel = Kernel::new(family, 1.5, 1.0).unwrap();
    let (nodes, queries) = (Nodes::on(set, &scattered(N_POINTS, d, 1)), scattered(N_QUERIES, d, 2));
    let weights = vec![1.0; N_POINTS];
    let mut row = vec![0.0; 64 * N_POINTS];
    let first_queries = Cloud::new(queries.coordinates()[..64 * d].to_vec(), d).unwrap();
    let mut best = f64::INFINITY;
    for _ in 0..ROUNDS {
        let began = Instant::now();
        let n_queries = match work {
            Work::Gram => {
                fill_cross_gram(&nodes, &kernel, &first_queries, &mut row, &Unobserved).unwrap();
                std::hint::black_box(row[0]);
                64
            }
            Work::Jets(order) => {
                let jets = Jets::over(&nodes, &kernel, &weights, &queries, order, &Unobserved).unwrap();
                std::hint::black_box(jets.value(0));
                N_QUERIES
            }
        };
        best = best.min(began.elapsed().as_secs_f64() / (n_queries * N_POINTS) as f64);
    }
    1e-9 / best
}
