use std::sync::Arc;

use super::*;
use crate::kernel::{Family, Kernel};
use crate::machine::vector::norm;
use crate::observer::Unobserved;
use crate::points::cloud::Cloud;
use crate::regression::solver::trend::Mean;
use crate::regression::solver::{RightHandSide, Solution, Solver};
use crate::regression::sums::regularization::Regularization;
use crate::testing::Random;

/// Random points of a torus (2, ½).
fn torus(n: usize, seed: u64) -> Cloud {
    let mut random = Random(seed);
    let point = |random: &mut Random| {
        let (u, v) = (std::f64::consts::TAU * random.uniform(), std::f64::consts::TAU * random.uniform());
        let r = 2.0 + 0.5 * v.cos();
        [r * u.cos(), r * u.sin(), 0.5 * v.sin()]
    };
    Cloud::new((0..n).flat_map(|_| point(&mut random)).collect(), 3).unwrap()
}

fn matern(order: u8) -> Kernel {
    Kernel::new(Family::Matern { order }, 0.5, 1.0).unwrap()
}

fn system(cloud: Cloud, kernel: Kernel, noise: Regularization) -> System {
    System::new(Arc::new(cloud), kernel, noise).unwrap()
}

fn field(cloud: &Cloud) -> Vec<f64> {
    cloud.points().map(|x| (2.0 * x[0]).sin() + x[1] * x[2]).collect()
}

fn iterations(of: System, tolerance: f64) -> usize {
    let values = field(of.cloud());
    let solver = Solver::iterative_to(tolerance, of, &Unobserved).unwrap();
    let solution = Solution::of(&solver, &values, &Unobserved).unwrap();
    assert!(solution.relative_residual <= tolerance, "{}", solution.relative_residual);
    solution.n_iterations.unwrap()
}

#[test]
fn weights_are_those_of_the_dense_solver() {
    let cloud = torus(1_500, 1);
    let values = field(&cloud);
    let noises = [0.0, 1e-4, 0.1].map(|alpha| Regularization::uniform(alpha).unwrap());
    let per_point = Regularization::per_point((0..1_500).map(|i| 1e-3 * f64::from(i % 3)).collect()).unwrap();
    for noise in noises.into_iter().chain([per_point]) {
        for kernel in [
            matern(0),
            matern(1),
            matern(2),
            Kernel::new(Family::Laplace { epsilon: 0.0 }, 0.5, 7.0).unwrap(),
        ] {
            let of = system(cloud.clone(), kernel, noise.clone());
            let dense = Solver::dense(of.clone(), &Unobserved).unwrap();
            let expected = Solution::of(&dense, &values, &Unobserved).unwrap();
            let solver = Solver::iterative_to(1e-11, of, &Unobserved).unwrap();
            let found = Solution::of(&solver, &values, &Unobserved).unwrap();
            let off = found.weights.iter().zip(&expected.weights).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
            assert!(off.sqrt() <= 1e-6 * norm(&expected.weights), "{off:e}");
            assert!(found.relative_residual <= 1e-11);
        }
    }
}

#[test]
fn the_factor_is_exact_where_each_point_is_given_all_before_it() {
    let of = system(torus(GIVEN_AND_OWN, 2), matern(1), Regularization::uniform(1e-4).unwrap());
    assert!(iterations(of, 1e-5) == 1);
}

/// As many points as are given all others.
const GIVEN_AND_OWN: usize = columns::MOST;

#[test]
fn iterations_hardly_grow_with_the_number_of_points() {
    let of = |n| iterations(system(torus(n, 3), matern(1), Regularization::uniform(1e-4).unwrap()), 1e-8);
    let (few, many) = (of(1_000), of(8_000));
    assert!(few <= 10 && many < 2 * few, "{few} {many}");
}

#[test]
fn clusters_far_points_and_offsets_do_not_matter() {
    let mut rows: Vec<f64> = torus(2_000, 4).coordinates().to_vec();
    let cluster: Vec<f64> = torus(200, 5).coordinates().iter().map(|x| 0.01 * x).collect();
    rows.extend(cluster);
    rows.extend((0..30).map(|i| 1e3 * f64::from(i + 1)));
    for (offset, unit) in [(0.0, 1.0), (1e6, 1.0), (0.0, 1e-6)] {
        let moved: Vec<f64> = rows.iter().map(|x| unit * (x + offset)).collect();
        let cloud = Cloud::new(moved, 3).unwrap();
        let kernel = Kernel::new(Family::Matern { order: 1 }, 0.5 * unit, 1.0).unwrap();
        let values: Vec<f64> = (0..cloud.n_points()).map(|i| (i as f64).sin()).collect();
        let of = system(cloud, kernel, Regularization::uniform(1e-4).unwrap());
        let solver = Solver::iterative_to(1e-8, of, &Unobserved).unwrap();
        let n_iterations = Solution::of(&solver, &values, &Unobserved).unwrap().n_iterations.unwrap();
        assert!(n_iterations <= 15, "{n_iterations}");
    }
}

#[test]
fn what_cannot_be_reached_is_refused_with_what_was() {
    let of = system(torus(300, 6), matern(2), Regularization::uniform(1e-9).unwrap());
    let values = field(of.cloud());
    let solver = Solver::iterative_to(1e-18, of, &Unobserved).unwrap();
    match Solution::of(&solver, &values, &Unobserved) {
        Err(NumericsError::NotConverged { relative_residual, tolerance }) => {
            assert!(tolerance == 1e-18 && relative_residual < 1e-6, "{relative_residual:e}");
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn products_are_as_exact_as_they_need_be() {
    let of = system(torus(30_000, 6), matern(1), Regularization::uniform(1e-3).unwrap());
    let product = Product::of(&of, &Unobserved).unwrap();
    let values = field(of.cloud());
    // Weights of alternating signs cancel in the sums, those of the values do not.
    let rough = (0..30_000).map(|i| if i % 2 == 0 { 1.0 } else { -1.0 }).collect();
    for column in [values.clone(), rough] {
        let exact = of.times(&column, &Unobserved).unwrap();
        for accuracy in [1e-2, 1e-5, 1e-8] {
            let found = product.times(&of, &column, accuracy, &Unobserved).unwrap();
            let errors: Vec<f64> = found.iter().zip(&exact).map(|(a, b)| a - b).collect();
            // The error is measured in 128 rows.
            assert!(
                norm(&errors) <= 1.5 * accuracy * norm(&exact),
                "{accuracy}: {}",
                norm(&errors) / norm(&exact)
            );
        }
    }
    let few = iterations(system(torus(7_500, 6), matern(1), Regularization::uniform(1e-3).unwrap()), 1e-9);
    assert!(iterations(of, 1e-9) < 2 * few);
}

/// Solves for values from earlier solutions, to a tolerance of 1e-9.
fn from(earlier: &[Arc<Solution>], solver: &Solver, values: &[f64]) -> Arc<Solution> {
    let found =
        Solution::starting(solver, RightHandSide { values, earlier }, Mean::Zero, &Unobserved).unwrap();
    assert!(found.relative_residual <= 1e-9, "{}", found.relative_residual);
    Arc::new(found)
}

#[test]
fn values_near_earlier_ones_take_fewer_iterations() {
    let of = system(torus(2_000, 7), matern(1), Regularization::uniform(1e-4).unwrap());
    let at = |time: f64| -> Vec<f64> {
        of.cloud().points().map(|x| ((2.0 + time) * x[0]).sin() + (time * x[1]).cos() * x[2]).collect()
    };
    let solver = Solver::iterative_to(1e-9, of.clone(), &Unobserved).unwrap();
    let cold = from(&[], &solver, &at(0.06));
    let n_iterations = |of: &Solution| of.n_iterations.unwrap();
    // The latest is first. Of values that change evenly, more of them leave less.
    let (mut earlier, mut taken): (Vec<Arc<Solution>>, _) = (Vec::new(), Vec::new());
    for step in 0..4 {
        let found = from(&earlier, &solver, &at(0.02 * f64::from(step)));
        taken.push(n_iterations(&found));
        earlier.insert(0, found);
    }
    assert!(taken[1] < taken[0] && taken[3] + 2 <= taken[0], "{taken:?}");
    let off = earlier[0].weights.iter().zip(&cold.weights).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
    assert!(off <= 1e-5 * norm(&cold.weights), "{off:e}");
    // The same again, and a multiple of it, are known already.
    assert_eq!(n_iterations(&from(&earlier, &solver, &at(0.02))), 0);
    let larger: Vec<f64> = at(0.04).iter().map(|value| -1e200 * value).collect();
    assert_eq!(n_iterations(&from(&earlier, &solver, &larger)), 0);
}

#[test]
fn a_tighter_tolerance_takes_the_iterations_that_are_left() {
    let of = system(torus(2_000, 8), matern(1), Regularization::uniform(1e-4).unwrap());
    let values = field(of.cloud());
    let coarse = Solver::iterative_to(1e-5, of, &Unobserved).unwrap();
    let fine = coarse.with_tolerance(1e-9).unwrap();
    let cold = from(&[], &fine, &values).n_iterations.unwrap();
    let first = Arc::new(Solution::of(&coarse, &values, &Unobserved).unwrap());
    let warm = from(std::slice::from_ref(&first), &fine, &values).n_iterations.unwrap();
    assert!(warm < cold && warm + first.n_iterations.unwrap() <= cold + 1, "{warm} {cold}");
}

#[test]
fn earlier_solutions_without_relation_change_nothing() {
    let of = system(torus(500, 9), matern(1), Regularization::uniform(1e-4).unwrap());
    let values = field(of.cloud());
    let solver = Solver::iterative_to(1e-9, of, &Unobserved).unwrap();
    let cold = from(&[], &solver, &values);
    let rough: Vec<f64> = (0..500).map(|i| f64::from(i % 2)).collect();
    let other = from(&[], &solver, &rough);
    let huge: Vec<f64> = rough.iter().map(|value| 1e300 * value).collect();
    let zero = from(&[], &solver, &[0.0; 500]);
    let earlier = [other.clone(), zero, from(&[], &solver, &huge), other];
    assert_eq!(*from(&earlier, &solver, &values), *cold);
    let nothing = from(&earlier, &solver, &[0.0; 500]);
    assert!(nothing.weights.iter().all(|weight| *weight == 0.0));
}
