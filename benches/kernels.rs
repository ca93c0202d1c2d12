//! Kernel evaluations per second and core, by family: values alone, and value, gradient and Hessian summed over the points.
//!
//! `cargo bench --bench kernels`

use std::time::Instant;

use gramian::numerics::cloud::Cloud;
use gramian::numerics::jets::{JetOrder, Jets};
use gramian::numerics::kernel::{Family, Kernel, WendlandSmoothness};
use gramian::numerics::observer::Unobserved;

const N_POINTS: usize = 4096;
const N_QUERIES: usize = 500;
const ROUNDS: usize = 7;

fn main() {
    let one_core = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    println!(
        "d = 3, n = {N_POINTS}, G pairs/s on one core, best of {ROUNDS}, {}",
        gramian::numerics::instruction_set()
    );
    println!("{:28} {:>8} {:>22}", "", "value", "value+gradient+Hessian");
    let families = [
        ("gauss", Family::Gauss),
        ("laplace, epsilon 1", Family::Laplace { epsilon: 1.0 }),
        ("matern, nu 1.5", Family::Matern { order: 1 }),
        ("matern, nu 2.5", Family::Matern { order: 2 }),
        ("matern, nu 8.5", Family::Matern { order: 8 }),
        ("wendland, smoothness 4", Family::Wendland { smoothness: WendlandSmoothness::C4 }),
        ("inverse multiquadric", Family::InverseMultiquadric),
    ];
    for (name, family) in families {
        let [value, hessian] =
            [JetOrder::Value, JetOrder::Hessian].map(|order| one_core.install(|| rate(family, order)));
        println!("{name:28} {value:8.3} {hessian:22.3}");
    }
}

/// G pairs/s.
fn rate(family: Family, order: JetOrder) -> f64 {
    let kernel = Kernel::new(family, 1.5, 1.0).unwrap();
    let (cloud, queries) = (scattered(N_POINTS, 1), scattered(N_QUERIES, 2));
    let weights = vec![1.0; N_POINTS];
    let mut best = f64::INFINITY;
    for _ in 0..ROUNDS {
        let began = Instant::now();
        let jets = Jets::evaluate(&cloud, &kernel, &weights, &queries, order, &Unobserved).unwrap();
        best = best.min(began.elapsed().as_secs_f64());
        std::hint::black_box(jets.value(0));
    }
    (N_POINTS * N_QUERIES) as f64 / best / 1e9
}

/// n points in the unit cube.
fn scattered(n: usize, seed: u64) -> Cloud {
    let mut state = seed;
    let mut next = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 53) as f64
    };
    Cloud::new((0..3 * n).map(|_| next()).collect(), 3).unwrap()
}
