use super::*;
use crate::error::NumericsError;
use crate::kernel::{Family, Kernel};
use crate::observer::Unobserved;
use crate::regression::function::interpolant::Interpolant;
use crate::regression::function::posterior::variances;
use crate::regression::solver::Solver;
use crate::regression::sums::regularization::Regularization;
use crate::testing::{all_families, fibonacci_sphere};

const EVERYTHING: KrigingRequest<'_> =
    KrigingRequest { order: JetOrder::Hessian, has_variances: true, has_deviations: false, trend: None };

fn system(cloud: &Cloud, family: Family, alpha: f64) -> System {
    let kernel = Kernel::new(family, 0.9, 1.7).unwrap();
    System::new(Arc::new(cloud.clone()), kernel, Regularization::uniform(alpha).unwrap()).unwrap()
}

fn moving(system: System) -> LocalKriging {
    let sampling = Arc::new(Sampling::of(system.cloud(), &Unobserved).unwrap());
    LocalKriging::new(system, sampling, &Unobserved).unwrap()
}

#[test]
fn one_observation_has_the_textbook_posterior_on_every_instruction_set() {
    let cloud = Cloud::new(vec![0.0], 1).unwrap();
    let kernel = Kernel::new(Family::Gauss, 0.9, 2.0).unwrap();
    let system = System::new(Arc::new(cloud), kernel, Regularization::Uniform(0.5)).unwrap();
    let moving = moving(system);
    let queries = Cloud::new(vec![0.0, 0.9, 1e90], 1).unwrap();
    let k = 2.0 * (-1.0f64).exp();
    for set in InstructionSet::available() {
        let found = moving.at_with(set, &[3.0], &queries, EVERYTHING, &Unobserved).unwrap();
        let expected = [6.0 / 2.5, 3.0 * k / 2.5, 0.0];
        let latent = [2.0 - 4.0 / 2.5, 2.0 - k * k / 2.5, 2.0];
        let variances = found.variances.unwrap();
        for query in 0..3 {
            assert!((found.jets.value(query) - expected[query]).abs() < 1e-14, "{}", set.name());
            assert!((variances.latent[query] - latent[query]).abs() < 1e-14);
        }
        let slope = -2.0 * 0.9 / 0.81 * 3.0 * k / 2.5;
        assert!((found.jets.gradient(1)[0] - slope).abs() < 1e-14);
        assert_eq!((found.jets.gradient(2), found.n_dependent), (&[0.0][..], 0));
    }
}

#[test]
fn a_small_cloud_has_the_dense_posterior_for_every_kernel_and_instruction_set() {
    let cloud = fibonacci_sphere(NEIGHBOURS - 1);
    let values: Vec<f64> = cloud.points().map(|x| (2.0 * x[0] + x[1]).sin() + x[2]).collect();
    let queries: Vec<f64> = (0..57).map(|i| 1.3 * (0.37 * i as f64).sin()).collect();
    let queries = Cloud::new(queries, 3).unwrap();
    for family in all_families() {
        let solver = Arc::new(Solver::dense(system(&cloud, family, 1e-6), &Unobserved).unwrap());
        let rounding = 100.0 * 127.0 * f64::EPSILON / solver.reciprocal_condition().unwrap();
        let dense = Interpolant::fit(solver.clone(), &values, &Unobserved).unwrap();
        let dense = dense.at(&queries, JetOrder::Hessian, &Unobserved).unwrap();
        let latent = variances(&solver, &queries, &Unobserved).unwrap().latent;
        for set in InstructionSet::available() {
            let found = moving(system(&cloud, family, 1e-6))
                .at_with(set, &values, &queries, EVERYTHING, &Unobserved)
                .unwrap();
            let context = format!("{family:?}, {}", set.name());
            are_close(&found.jets.values(), &dense.values(), rounding, &context);
            are_close(&found.jets.gradients(), &dense.gradients(), rounding, &context);
            are_close(&found.jets.hessians(), &dense.hessians(), rounding, &context);
            are_close(&found.variances.unwrap().latent, &latent, rounding, &context);
        }
    }
}

#[test]
fn a_small_cloud_has_the_dense_deviations_of_derivatives_on_every_instruction_set() {
    let cloud = fibonacci_sphere(NEIGHBOURS - 1);
    let values = vec![1.0; NEIGHBOURS - 1];
    let queries: Vec<f64> = (0..57).map(|i| 1.3 * (0.37 * i as f64).sin()).collect();
    // The last query is a point of the cloud, where differences are 0.
    let queries = Cloud::new([&queries, cloud.point(5)].concat(), 3).unwrap();
    for family in all_families() {
        let solver = Arc::new(Solver::dense(system(&cloud, family, 1e-3), &Unobserved).unwrap());
        let rounding = 100.0 * 127.0 * f64::EPSILON / solver.reciprocal_condition().unwrap();
        let dense = Interpolant::fit(solver, &values, &Unobserved).unwrap();
        let squares = |deviations: &[f64]| deviations.iter().map(|s| s * s).collect::<Vec<f64>>();
        for order in [JetOrder::Value, JetOrder::Gradient, JetOrder::Hessian] {
            let request = KrigingRequest { order, has_variances: false, has_deviations: true, trend: None };
            let expected = JetDeviations::of(&dense, 1.0, &queries, order.degree(), &Unobserved);
            for set in InstructionSet::available() {
                let moving = moving(system(&cloud, family, 1e-3));
                let found = moving.at_with(set, &values, &queries, request, &Unobserved);
                let (Ok(found), Ok(expected)) = (&found, &expected) else {
                    let kernel = moving.system().kernel();
                    assert!(kernel.has_kink() || !kernel.has_second_derivatives() && order.degree() == 2);
                    assert_eq!(found.as_ref().err(), expected.as_ref().err(), "{family:?}");
                    continue;
                };
                let (found, context) =
                    (found.deviations.as_ref().unwrap(), format!("{family:?}, {}", set.name()));
                are_close(&squares(&found.values), &squares(&expected.values), rounding, &context);
                are_close(&squares(&found.gradients), &squares(&expected.gradients), rounding, &context);
                are_close(&squares(&found.hessians), &squares(&expected.hessians), rounding, &context);
            }
        }
    }
}

#[test]
fn covariances_and_distances_that_are_next_to_nothing_change_no_answer() {
    let comb = |i: usize| [3.0 * (i % 7) as f64, 80.0 * i as f64 * (0.37 * i as f64).sin()];
    let specks = |i: usize| [1e-160 * (i % 11) as f64, 1e-157 * (i as f64).sin()];
    for cloud in [(0..127).flat_map(comb).collect(), (0..127).flat_map(specks).collect()] {
        let cloud = Cloud::new(cloud, 2).unwrap();
        let values: Vec<f64> = (0..127).map(|i| (0.7 * f64::from(i)).sin()).collect();
        for family in all_families() {
            let dense = Arc::new(Solver::dense(system(&cloud, family, 1e-2), &Unobserved).unwrap());
            let rounding = 100.0 * 127.0 * f64::EPSILON / dense.reciprocal_condition().unwrap();
            let latent = variances(&dense, &cloud, &Unobserved).unwrap().latent;
            let dense = Interpolant::fit(dense, &values, &Unobserved).unwrap();
            let dense = dense.at(&cloud, JetOrder::Value, &Unobserved).unwrap();
            for set in InstructionSet::available() {
                let request = KrigingRequest { order: JetOrder::Value, ..EVERYTHING };
                let found = moving(system(&cloud, family, 1e-2));
                let found = found.at_with(set, &values, &cloud, request, &Unobserved).unwrap();
                let context = format!("{family:?}, {}", set.name());
                are_close(&found.jets.values(), &dense.values(), rounding, &context);
                are_close(&found.variances.unwrap().latent, &latent, rounding, &context);
            }
        }
    }
}

fn are_close(found: &[f64], expected: &[f64], tolerance: f64, context: &str) {
    let largest = expected.iter().fold(0.0, |a: f64, x| a.max(x.abs()));
    assert_eq!(found.len(), expected.len());
    for (a, b) in found.iter().zip(expected) {
        assert!(
            (a - b).abs() <= tolerance * largest,
            "{context}: {a} and {b}, {:e}",
            (a - b).abs() / largest
        );
    }
}

/// Returns 1000 points of a spiral that fills a cube, and values of size 1 at them.
fn spiral() -> (Cloud, Vec<f64>) {
    let coordinate =
        |i: usize| 2.0 * ((i / 3) as f64 * [0.819_172_51, 0.671_043_61, 0.549_700_48][i % 3]).fract() - 1.0;
    let cloud = Cloud::new((0..3000).map(coordinate).collect(), 3).unwrap();
    let values = cloud.points().map(|x| (2.0 * x[0] + x[1]).sin() * x[2]).collect();
    (cloud, values)
}

fn inside() -> Cloud {
    Cloud::new((0..60).map(|i| 0.8 * (0.83 * f64::from(i)).sin()).collect(), 3).unwrap()
}

#[test]
fn derivatives_are_those_of_the_function_that_the_neighbours_define() {
    let (cloud, values) = spiral();
    let moving = moving(system(&cloud, Family::Matern { order: 2 }, 1e-4));
    let at = |queries: &Cloud| moving.at(&values, queries, EVERYTHING, &Unobserved).unwrap().jets;
    let (queries, h) = (inside(), 1e-5);
    let jets = at(&queries);
    for axis in 0..3 {
        let moved = |step: f64| {
            let mut rows = queries.coordinates().to_vec();
            rows.iter_mut().skip(axis).step_by(3).for_each(|x| *x += step);
            at(&Cloud::new(rows, 3).unwrap())
        };
        let (before, after) = (moved(-h), moved(h));
        for query in 0..queries.n_points() {
            let slope = (after.value(query) - before.value(query)) / (2.0 * h);
            assert!((jets.gradient(query)[axis] - slope).abs() < 1e-6, "{query}");
            for other in 0..3 {
                let bend = (after.gradient(query)[other] - before.gradient(query)[other]) / (2.0 * h);
                assert!((jets.hessian(query)[3 * axis + other] - bend).abs() < 1e-4, "{query}");
            }
        }
    }
}

#[test]
fn values_are_met_without_noise_and_variances_lie_between_nothing_and_the_prior() {
    let (cloud, values) = spiral();
    for family in all_families() {
        let moving = moving(system(&cloud, family, 0.0));
        let request = KrigingRequest {
            order: JetOrder::Value,
            has_variances: true,
            has_deviations: false,
            trend: None,
        };
        let found = moving.at(&values, &cloud, request, &Unobserved).unwrap();
        let (k0, variances) = (moving.system().kernel().at_zero(), found.variances.unwrap());
        for (query, value) in values.iter().enumerate() {
            // Dependent neighbours are left out, which costs as much as rounding: 1e-9 of k₀.
            assert!((found.jets.value(query) - value).abs() < 1e-5, "{family:?}: {query}");
            assert!((0.0..1e-9 * k0).contains(&variances.latent[query]), "{family:?}: {query}");
        }
        assert!(variances.clamped.iter().all(|&query| variances.latent[query] == 0.0));
        let found = moving.at(&values, &inside(), request, &Unobserved).unwrap();
        assert!(found.variances.unwrap().latent.iter().all(|v| (0.0..=k0).contains(v)), "{family:?}");
    }
}

#[test]
fn far_from_the_cloud_the_prior_is_all_there_is() {
    let (cloud, values) = spiral();
    let queries = Cloud::new(vec![1e40, 0.0, 0.0, 0.0, 1e100, 0.0], 3).unwrap();
    for family in all_families() {
        let moving = moving(system(&cloud, family, 1e-6));
        let found = moving.at(&values, &queries, EVERYTHING, &Unobserved).unwrap();
        assert!(found.jets.values().iter().chain(&found.jets.hessians()).all(|u| u.abs() < 1e-30));
        assert_eq!(found.variances.unwrap().latent, [moving.system().kernel().at_zero(); 2], "{family:?}");
    }
}

#[test]
fn repeated_observations_with_noise_count_as_often_as_they_are_there() {
    // Three observations with noise 0.3 at one place are equivalent to one with noise 0.1.
    let place = [0.2, 0.4, 0.1];
    let kernel = Kernel::new(Family::Gauss, 0.9, 1.7).unwrap();
    let of = |n: usize, noise: f64| {
        let cloud = Cloud::new(place.repeat(n), 3).unwrap();
        let noise = Regularization::per_point(vec![noise; n]).unwrap();
        moving(System::new(Arc::new(cloud), kernel.clone(), noise).unwrap())
            .at(&vec![2.0; n], &inside(), EVERYTHING, &Unobserved)
            .unwrap()
    };
    let (one, three) = (of(1, 0.1), of(3, 0.3));
    are_close(&three.jets.hessians(), &one.jets.hessians(), 1e-14, "Hessians");
    are_close(&three.variances.unwrap().latent, &one.variances.unwrap().latent, 1e-14, "variances");
}

#[test]
fn what_follows_from_nearer_points_is_left_out_and_counted() {
    let (cloud, values) = spiral();
    let kernel = Kernel::new(Family::Gauss, 4.0, 1.0).unwrap();
    let system = System::new(Arc::new(cloud), kernel, Regularization::Uniform(0.0)).unwrap();
    let queries = inside();
    let found = moving(system).at(&values, &queries, EVERYTHING, &Unobserved).unwrap();
    assert_eq!(found.n_dependent, queries.n_points());
    for (query, x) in queries.points().enumerate() {
        let expected = (2.0 * x[0] + x[1]).sin() * x[2];
        // A point that is left out has at most the deviation √(64ε) = 1e-7 given those before it. The error
        // is at most this times the native norm of the function. With a kernel four times as wide as the
        // cloud, the norm is some 1e5. Measured: 3e-3.
        assert!(
            (found.jets.value(query) - expected).abs() < 1e-2,
            "{query}: {}",
            found.jets.value(query) - expected
        );
    }
}

#[test]
fn a_kink_at_a_point_has_no_gradient() {
    let (cloud, values) = spiral();
    let moving = moving(system(&cloud, Family::Laplace { epsilon: 0.0 }, 1e-4));
    let queries = Cloud::new([&[0.1, 0.2, 0.3], cloud.point(77)].concat(), 3).unwrap();
    let refused = moving.at(&values, &queries, EVERYTHING, &Unobserved).err();
    assert_eq!(refused, Some(NumericsError::KernelNotSmooth { query: 1, point: 77 }));
    let request =
        KrigingRequest { order: JetOrder::Value, has_variances: false, has_deviations: false, trend: None };
    assert!(moving.at(&values, &queries, request, &Unobserved).is_ok());
}

#[test]
fn threads_and_company_change_no_bit() {
    let (cloud, values) = spiral();
    let moving = moving(system(&cloud, Family::Matern { order: 1 }, 1e-4));
    let queries = inside();
    let all = moving.at(&values, &queries, EVERYTHING, &Unobserved).unwrap();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(3).build().unwrap();
    let again = pool.install(|| moving.at(&values, &queries, EVERYTHING, &Unobserved).unwrap());
    assert_eq!(all.jets.hessians(), again.jets.hessians());
    for (query, x) in queries.points().enumerate() {
        let alone = Cloud::new(x.to_vec(), 3).unwrap();
        let alone = moving.at(&values, &alone, EVERYTHING, &Unobserved).unwrap();
        assert_eq!(alone.jets.hessian(0), all.jets.hessian(query));
        assert_eq!(alone.variances.unwrap().latent[0], all.variances.as_ref().unwrap().latent[query]);
    }
}

#[test]
fn wrong_lengths_values_beyond_float64_and_a_caller_who_is_gone_are_refused() {
    let (cloud, mut values) = spiral();
    let moving = moving(system(&cloud, Family::Gauss, 1e-4));
    let ask = |values: &[f64], queries: &Cloud| moving.at(values, queries, EVERYTHING, &Unobserved).err();
    assert!(matches!(ask(&values[1..], &cloud), Some(NumericsError::LengthMismatch { .. })));
    let flat = Cloud::new(vec![0.0; 2], 2).unwrap();
    assert!(matches!(ask(&values, &flat), Some(NumericsError::DimensionMismatch { .. })));
    values[77] = 1.7e308;
    let there = Cloud::new(cloud.point(77).to_vec(), 3).unwrap();
    assert_eq!(ask(&values, &there), Some(NumericsError::Overflow { query: 0 }));
    let gone = moving.at(&values, &cloud, EVERYTHING, &Gone);
    assert_eq!(gone.err(), Some(NumericsError::Cancelled));
}

/// An observer that always cancels.
struct Gone;

impl Observer for Gone {
    fn enter(&self, _stage: Stage) {}

    fn is_cancelled(&self) -> bool {
        true
    }
}
