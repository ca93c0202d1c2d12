//! Consistency of solvers: each is compared with the dense one over every kernel that it accepts
//! and every verb that it serves (after tinygp's "consistent with direct"). Every verb that it does
//! not serve must be refused.
//!
//! The dense solver is compared with itself on the same points in
//! another order, so that no two numbers come from the same operations.
//!
//! The local solver is not listed, because it has no single function to evaluate here. On a cloud of its
//! neighbours alone it gives the dense answers for every kernel
//! (src/regression/function/local_kriging/tests.rs). Its error on larger clouds is tested in moving.rs.

#[path = "../common/mod.rs"]
mod common;
mod local_kriging;
mod verbs;

use std::sync::Arc;

use common::clouds::{fibonacci_sphere, wave};
use common::kernels::all_families;
use gramian_numerics::error::{NumericsError, SolverKind};
use gramian_numerics::kernel::{Family, Kernel};
use gramian_numerics::observer::Unobserved;
use gramian_numerics::points::cloud::Cloud;
use gramian_numerics::regression::solver::{Solver, System};
use gramian_numerics::regression::sums::regularization::Regularization;
use strum::VariantArray;
use verbs::{Setting, VERBS};

/// A solver, the difference from the dense answers allowed beyond rounding, and the verbs that it refuses.
struct Candidate {
    kind: SolverKind,
    make: fn(System) -> Result<Solver, NumericsError>,
    tolerance: f64,
    refuses: &'static [&'static str],
}

/// What needs more than weights for given values.
const NO_WEIGHTS: [&str; 3] =
    ["surface gradient as matrices", "Laplace–Beltrami operator as matrix", "log marginal likelihood"];

/// Every solver with one function through all points, the dense one first.
fn solvers() -> Vec<Candidate> {
    SolverKind::VARIANTS.iter().filter_map(|&kind| candidate(kind)).collect()
}

fn candidate(kind: SolverKind) -> Option<Candidate> {
    let of = |make, tolerance, refuses| Some(Candidate { kind, make, tolerance, refuses });
    match kind {
        SolverKind::Dense => of(|system| Solver::dense(system, &Unobserved), 0.0, &[]),
        // A millionth of the noise may remain of the diagonal.
        SolverKind::Landmark => of(|system| Solver::landmark(system, &Unobserved), 1e-6, &[]),
        // The residual is 1e-12, and the matrices of smooth kernels have conditions to match.
        SolverKind::Iterative => {
            of(|system| Solver::iterative_to(1e-12, system, &Unobserved), 1e-6, &NO_WEIGHTS)
        }
        SolverKind::Local => None,
    }
}

const N_POINTS: usize = 150;

/// The index in the second order of point i of the first: a permutation, since 149 is coprime to 150.
fn shuffled(i: usize) -> usize {
    (i * 149 + 7) % N_POINTS
}

#[test]
fn every_solver_answers_as_the_dense_one() {
    let cloud = fibonacci_sphere(N_POINTS);
    let mut other = vec![0.0; 3 * N_POINTS];
    (0..N_POINTS).for_each(|i| other[3 * shuffled(i)..][..3].copy_from_slice(cloud.point(i)));
    let other = Cloud::new(other, 3).unwrap();
    for family in all_families() {
        let dense = (solvers()[0].make)(system(&cloud, family)).unwrap();
        // A solve loses digits of the weights, and digits of answers that are small against their terms.
        let rounding = 100.0 * N_POINTS as f64 * f64::EPSILON / dense.reciprocal_condition().unwrap();
        let dense = Setting { solver: Arc::new(dense), values: cloud.points().map(wave).collect() };
        for candidate in solvers() {
            let solver = Arc::new((candidate.make)(system(&other, family)).unwrap());
            let setting = Setting { solver, values: other.points().map(wave).collect() };
            for verb in VERBS {
                let context = format!("{} of {:?}, {family:?}", verb.name, candidate.kind);
                let (expected, found) = ((verb.ask)(&dense), (verb.ask)(&setting));
                if candidate.refuses.contains(&verb.name) {
                    assert!(matches!(found, Err(NumericsError::Unsupported { .. })), "{context}");
                    continue;
                }
                let (Ok(expected), Ok(found)) = (&expected, &found) else {
                    // Kernels with a kink have no derivatives at the points, so both solvers refuse.
                    assert!(is_kink(&expected) && is_kink(&found), "{context}: {expected:?}, {found:?}");
                    continue;
                };
                let found = if verb.has_column_per_point { in_first_order(found) } else { found.clone() };
                let largest = expected.iter().fold(0.0, |a: f64, x| a.max(x.abs()));
                let allowed = (rounding + candidate.tolerance) * largest;
                assert_eq!(expected.len(), found.len(), "{context}");
                for (a, b) in expected.iter().zip(&found) {
                    assert!((a - b).abs() <= allowed, "{context}: {a} and {b}, allowed {allowed:e}");
                }
            }
        }
    }
}

/// The system of a cloud with α = 1e-6, which leaves half of the digits of the smoothest kernels.
fn system(cloud: &Cloud, family: Family) -> System {
    let kernel = Kernel::new(family, 0.9, 1.7).unwrap();
    System::new(Arc::new(cloud.clone()), kernel, Regularization::Uniform(1e-6)).unwrap()
}

/// Reorders the columns of rows, one per point, to the first order of the points.
fn in_first_order(rows: &[f64]) -> Vec<f64> {
    rows.chunks_exact(N_POINTS).flat_map(|row| (0..N_POINTS).map(|i| row[shuffled(i)])).collect()
}

fn is_kink(outcome: &Result<Vec<f64>, NumericsError>) -> bool {
    matches!(outcome, Err(NumericsError::KernelNotSmooth { .. }))
}
