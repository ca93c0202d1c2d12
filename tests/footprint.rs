//! Test that the bytes counted by the stores are those that the process takes, with the allocator of the
//! server.
//!
//! It is the only test of its process, because all tests of a process share the resident set.

#[path = "../numerics/tests/common/mod.rs"]
mod common;

use std::sync::Arc;
use std::time::Duration;

use gramian::store::clouds::CloudStore;
use gramian::store::key::{CloudId, FitKey, Merging, ValuesKey};
use gramian::store::prepared::{PreparedBytes, PreparedFit, PreparedStore};
use gramian_host::memory::Owner;
use gramian_host::memory::budget::Budget;
use gramian_numerics::error::NumericsError;
use gramian_numerics::error::SolverKind;
use gramian_numerics::kernel::{Family, Kernel};
use gramian_numerics::model::price::system_price;
use gramian_numerics::model::{Model, Recipe};
use gramian_numerics::observer::Unobserved;
use gramian_numerics::points::cloud::Cloud;
use gramian_numerics::points::sampling::Sampling;
use gramian_numerics::regression::solver::{Solution, Solver, System};
use gramian_numerics::regression::sums::regularization::Regularization;
use gramian_numerics::surface::geometry::{Geometry, GeometryRequest};

use crate::common::clouds::fibonacci_sphere;
use crate::common::fits;

#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

/// Least ratio of the count to the growth of the resident set. Memory that is not counted would exceed the
/// budget.
const LEAST: f64 = 0.95;

/// Greatest ratio. What is kept may lie where scratch space was, which does not grow the resident set: some
/// 15 MB of the 200 MB of a measurement.
const GREATEST: f64 = 1.1;

/// Budget that is large enough for every store here, so that nothing is evicted.
const BUDGET: usize = 1 << 34;

/// Readings of one measurement.
const N_READINGS: usize = 24;

const OWNER: Owner = Owner(0);

type Factors = PreparedStore<&'static str>;
type Clouds = CloudStore<NumericsError>;

#[tokio::test]
async fn what_the_stores_count_is_what_they_take() {
    let scattered = |k: usize, from: usize, to: usize| from + k * 7919 % (to - from);
    let factors = |with_surface: bool, from: usize, to: usize| {
        async move |store: &Factors, k: usize| {
            keep_factor(store, scattered(k, from, to), k, with_surface).await
        }
    };
    let clouds = |from: usize, to: usize| {
        async move |store: &Clouds, k: usize| keep_cloud(store, scattered(k, from, to), k).await
    };
    let bytes = PreparedBytes { kept: BUDGET, spare: BUDGET / 8 };
    let (new_factors, new_clouds) = (|| Factors::new(bytes, Budget::new(BUDGET, 1)), || Clouds::new(BUDGET));
    let measurements = [
        growth("weights of 64 to 1,000 values", new_factors(), Factors::n_bytes, 60_000, keep_weights).await,
        growth("clouds of 10 to 300 points", new_clouds(), Clouds::n_bytes, 40_000, clouds(10, 300)).await,
        growth("clouds of 1,000 to 20,000", new_clouds(), Clouds::n_bytes, 900, clouds(1000, 20_000)).await,
        growth("factors of 64 to 512 points", new_factors(), Factors::n_bytes, 1200, factors(false, 64, 512))
            .await,
        growth("with their surfaces", new_factors(), Factors::n_bytes, 1500, factors(true, 64, 512)).await,
        growth("factors of 700 to 1,500", new_factors(), Factors::n_bytes, 150, factors(false, 700, 1500))
            .await,
    ];
    for (name, counted, resident) in measurements {
        let ratio = counted / resident;
        println!("{name}: counted {counted:.1} MB, resident {resident:.1} MB, {ratio:.3}");
        // Where huge pages are off, pages that were never written are not resident. Then the count is an
        // upper bound.
        let greatest = if huge_pages_are_off() { f64::INFINITY } else { GREATEST };
        assert!((LEAST..=greatest).contains(&ratio), "{name}: {counted:.1} MB of {resident:.1} MB");
    }
}

/// Measures by how many megabytes a store and the resident set grow together over the last two thirds of `n`
/// entries: the store's own growth, and the resident set's for as much.
///
/// The first third bears the costs that arise once: threads, their scratch space, and the pages that the
/// allocator begins for every block size. Scratch space that is given back late lifts some of the readings by
/// up to 40 MB, so the ratio is the median of those of all pairs of readings that are far apart (Theil 1950).
async fn growth<S>(
    name: &'static str,
    store: S,
    n_bytes: impl Fn(&S) -> usize,
    n: usize,
    keep: impl AsyncFn(&S, usize),
) -> (&'static str, f64, f64) {
    let between = n / 3 * 2 / N_READINGS;
    let mut readings = Vec::new();
    for k in 0..n {
        keep(&store, k).await;
        if k >= n / 3 && (k - n / 3).is_multiple_of(between) {
            readings.push([n_bytes(&store) as f64, resident_bytes()]);
        }
    }
    // The store is leaked, so that the next one cannot reuse its memory.
    std::mem::forget(store);
    let mut slopes: Vec<f64> = (0..readings.len())
        .flat_map(|i| (i + N_READINGS / 2..readings.len()).map(move |j| [i, j]))
        .map(|[i, j]| (readings[j][1] - readings[i][1]) / (readings[j][0] - readings[i][0]))
        .collect();
    slopes.sort_by(f64::total_cmp);
    let counted = (readings[readings.len() - 1][0] - readings[0][0]) / 1e6;
    (name, counted, counted * slopes[slopes.len() / 2])
}

async fn keep_weights(store: &Factors, k: usize) {
    let cloud = fibonacci_sphere(2);
    let key = key(&cloud, &kernel(0), &Regularization::Uniform(1.0));
    let solution = Solution {
        weights: vec![1.0; 64 + k * 7919 % 936],
        relative_residual: 0.0,
        residual_max: 0.0,
        native_norm_squared: 0.0,
        misfit: 0.0,
        refined: false,
        n_iterations: None,
        product: Vec::new(),
        energy: 0.0,
        trend: None,
        outlier: None,
    };
    store.keep_solution(key, ValuesKey::of(&[k as f64]), Arc::new(solution));
}

async fn keep_cloud(store: &Clouds, n: usize, k: usize) {
    // A parser leaves coordinates like this, grown by doubling.
    let mut coordinates = Vec::new();
    (0..3 * n).for_each(|i| coordinates.push((k * 7 + i) as f64));
    let (stored, is_new) = store.register(OWNER, Cloud::new(coordinates, 3).unwrap(), None);
    assert!(is_new);
    if k.is_multiple_of(20) {
        let cloud = stored.cloud.clone();
        let look = || async move { Sampling::of(&cloud, &Unobserved) };
        store.sampling(OWNER, &stored, look).await.unwrap();
    }
}

async fn keep_factor(store: &Factors, n: usize, k: usize, with_surface: bool) {
    let (cloud, kernel, alpha) = (fibonacci_sphere(n), kernel(k), Regularization::Uniform(1e-6));
    let key = key(&cloud, &kernel, &alpha);
    let factorize = move |memory| async move {
        let factor = System::new(Arc::new(cloud), kernel, alpha)
            .and_then(|system| Solver::dense(system, &Unobserved))
            .unwrap();
        Ok(PreparedFit::new(Model::System(Arc::new(factor)), Duration::ZERO, Duration::ZERO, memory))
    };
    let memory = store.reserve(OWNER, system_price(n, 3).expected.n_bytes, || true).await.unwrap().unwrap();
    let (stored, _) = store.get_or_prepare(key, Some(memory), factorize).await.unwrap().unwrap();
    if with_surface {
        let factor = stored.model().solver().unwrap().clone();
        let make = |memory| async move { Ok((fits::surface(&factor), memory)) };
        let memory =
            store.reserve(OWNER, system_price(n, 3).surface.n_bytes, || true).await.unwrap().unwrap();
        let surface = store.get_or_make_surface(key, &stored, Some(memory), make).await.unwrap().unwrap();
        Geometry::of(&surface, surface.cloud(), &GeometryRequest::CURVATURES, &Unobserved).unwrap();
    }
}

/// Returns a different kernel for every k, so that no two fits are equal.
fn kernel(k: usize) -> Kernel {
    Kernel::new(Family::Matern { order: 2 }, 0.3 + 1e-6 * k as f64, 1.0).unwrap()
}

fn key(cloud: &Cloud, kernel: &Kernel, alpha: &Regularization) -> FitKey {
    let recipe = Recipe::of_values(SolverKind::Dense, kernel.clone(), alpha.clone());
    FitKey::of(OWNER, CloudId::of(cloud, None), &recipe, Merging::Nothing)
}

fn resident_bytes() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let line = status.lines().find(|line| line.starts_with("VmRSS:")).unwrap();
    line.split_whitespace().nth(1).unwrap().parse::<f64>().unwrap() * 1024.0
}

fn huge_pages_are_off() -> bool {
    let setting = std::fs::read_to_string("/sys/kernel/mm/transparent_hugepage/enabled");
    setting.map_or(true, |setting| setting.contains("[never]"))
}
