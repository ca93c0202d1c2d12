use super::*;
use crate::kernel::Family;
use crate::machine::instruction_set::InstructionSet;
use crate::observer::Unobserved;
use crate::testing::{all_families, fibonacci_sphere};

/// Returns 100 points, their weights of both signs, and 11 queries, in dimension d. With 100 points the last
/// block is padded.
fn expansion(d: usize) -> (Cloud, Vec<f64>, Cloud) {
    let wave = |i: usize| (1.3 * i as f64).sin() + 0.1 * (0.7 * i as f64).cos();
    let cloud = Cloud::new((0..100 * d).map(wave).collect(), d).unwrap();
    let queries = Cloud::new((0..11 * d).map(|i| wave(i + 1000) * 0.9).collect(), d).unwrap();
    (cloud, (0..100).map(|i| wave(3 * i)).collect(), queries)
}

fn jets(cloud: &Cloud, kernel: &Kernel, weights: &[f64], queries: &Cloud, order: JetOrder) -> Jets {
    Jets::evaluate(cloud, kernel, weights, queries, order, &Unobserved).unwrap()
}

fn shifted(queries: &Cloud, axis: usize, h: f64) -> Cloud {
    let d = queries.dimension();
    let move_axis = |(i, &x): (usize, &f64)| if i % d == axis { x + h } else { x };
    Cloud::new(queries.coordinates().iter().enumerate().map(move_axis).collect(), d).unwrap()
}

#[test]
fn derivatives_agree_with_central_differences_for_every_kernel() {
    // With step 1e-5 at unit scales, both errors stay under 1e-7 of the larger numbers. They are the
    // truncation h²/6 · third derivative (up to 1e3 here) and the rounding 1e-16/h · Σ|λ|.
    let h = 1e-5;
    for d in [1, 2, 3, 5] {
        let (cloud, weights, queries) = expansion(d);
        for family in all_families() {
            let kernel = Kernel::new(family, 1.4, 2.0).unwrap();
            let here = jets(&cloud, &kernel, &weights, &queries, JetOrder::Hessian);
            for axis in 0..d {
                let at = |h| jets(&cloud, &kernel, &weights, &shifted(&queries, axis, h), JetOrder::Gradient);
                let (below, above) = (at(-h), at(h));
                for query in 0..queries.n_points() {
                    let slope = (above.value(query) - below.value(query)) / (2.0 * h);
                    let found = here.gradient(query)[axis];
                    assert!((slope - found).abs() < 1e-6, "{family:?} d={d}: {slope} against {found}");
                    let hessian = here.hessian(query);
                    for b in 0..d {
                        let bend = (above.gradient(query)[b] - below.gradient(query)[b]) / (2.0 * h);
                        let found = hessian[axis * d + b];
                        let close = (bend - found).abs() < 1e-5 * (1.0 + found.abs());
                        assert!(close, "{family:?} d={d}: {bend} against {found}");
                    }
                }
            }
        }
    }
}

#[test]
fn lower_orders_repeat_the_numbers_of_higher_ones() {
    let (cloud, weights, queries) = expansion(3);
    for family in all_families() {
        let kernel = Kernel::new(family, 0.8, 1.0).unwrap();
        let all = jets(&cloud, &kernel, &weights, &queries, JetOrder::HessianWithMagnitudes);
        let first = jets(&cloud, &kernel, &weights, &queries, JetOrder::Gradient);
        let values = jets(&cloud, &kernel, &weights, &queries, JetOrder::Value);
        for query in 0..queries.n_points() {
            assert!((all.value(query) - values.value(query)).abs() < 1e-13);
            for (a, b) in all.gradient(query).iter().zip(first.gradient(query)) {
                assert!((a - b).abs() < 1e-12);
            }
        }
    }
}

#[test]
fn every_instruction_set_sums_to_the_same_jets() {
    // Sums of 100 terms of up to 10 each, rounded in different orders, differ by 1000 · 100 ε = 2e-11 at
    // worst.
    let close = |a: f64, b: f64| (a - b).abs() <= 2e-11;
    for d in [1, 2, 3, 4, 5, 7, 8] {
        let (cloud, weights, queries) = expansion(d);
        let kernel = Kernel::new(Family::Matern { order: 2 }, 1.4, 2.0).unwrap();
        let on = |set| {
            let nodes = Nodes::on(set, &cloud);
            let order = JetOrder::HessianWithMagnitudes;
            Jets::over(&nodes, &kernel, &weights, &queries, order, &Unobserved).unwrap()
        };
        let best = on(InstructionSet::best());
        for other in InstructionSet::available().into_iter().skip(1).map(on) {
            assert!(best.packed.iter().zip(&other.packed).all(|(&a, &b)| close(a, b)), "d = {d}");
        }
    }
}

#[test]
fn queries_of_another_dimension_are_refused() {
    let ((cloud, weights, _), (_, _, queries)) = (expansion(3), expansion(2));
    let kernel = Kernel::new(Family::Gauss, 1.0, 1.0).unwrap();
    let found = Jets::evaluate(&cloud, &kernel, &weights, &queries, JetOrder::Value, &Unobserved);
    assert!(matches!(found, Err(NumericsError::DimensionMismatch { expected: 3, found: 2 })));
}

#[test]
fn half_of_the_pairs_give_the_jets_at_the_points() {
    // The sizes are less than a block, one block, one block and a point, an odd and an even number of blocks.
    for (n, d) in [(1, 3), (128, 3), (129, 1), (300, 2), (500, 3)] {
        let wave = |i: usize| (1.3 * i as f64).sin() + 0.1 * (0.7 * i as f64).cos();
        let cloud = Cloud::new((0..n * d).map(wave).collect(), d).unwrap();
        let weights: Vec<f64> = (0..n).map(|i| wave(3 * i)).collect();
        for family in
            all_families().into_iter().filter(|family| !Kernel::new(*family, 0.8, 1.7).unwrap().has_kink())
        {
            let kernel = Kernel::new(family, 0.8, 1.7).unwrap();
            // Profiles differ by a few roundings between instruction sets. Within one set, only the order of
            // n terms differs. Where φ″ is bounded, a term of the Hessian is at most 12 times the greatest of
            // the value (4/ℓ⁴ · φ″q ≤ 12 φ(0)).
            let magnitudes = jets(&cloud, &kernel, &weights, &cloud, JetOrder::HessianWithMagnitudes);
            for set in InstructionSet::available() {
                let nodes = Nodes::on(set, &cloud);
                let expected =
                    Jets::over(&nodes, &kernel, &weights, &cloud, JetOrder::Hessian, &Unobserved).unwrap();
                let found =
                    Jets::by_half_of_the_pairs(&nodes, &cloud, &kernel, &weights, &Unobserved).unwrap();
                for point in 0..n {
                    let scale = magnitudes.magnitudes(point).0 + magnitudes.magnitudes(point).1;
                    let entries = found.jet(point).iter().zip(expected.jet(point));
                    for (at, (a, b)) in entries.enumerate() {
                        let close = (a - b).abs() <= 64.0 * 12.0 * f64::EPSILON * scale;
                        assert!(close, "{family:?}, {point} of {n}, {at} on {}: {a}, {b}", set.name());
                    }
                }
            }
        }
    }
}

#[test]
fn magnitudes_follow_the_unit_of_length() {
    // Scaling by powers of two rounds nothing.
    let (cloud, weights, _) = expansion(3);
    let scaled = |factor: f64| {
        let points = Cloud::new(cloud.coordinates().iter().map(|x| factor * x).collect(), 3).unwrap();
        let kernel = Kernel::new(Family::Matern { order: 2 }, 0.5 * factor, 1.0).unwrap();
        jets(&points, &kernel, &weights, &points, JetOrder::HessianWithMagnitudes)
    };
    let (here, small) = (scaled(1.0), scaled(2f64.powi(-400)));
    for point in 0..cloud.n_points() {
        let ((value, slope), (small_value, small_slope)) = (here.magnitudes(point), small.magnitudes(point));
        assert_eq!((value, slope), (small_value, small_slope * 2f64.powi(-400)), "{point}");
    }
}

#[test]
fn magnitudes_bound_values_and_slopes() {
    let (cloud, weights, queries) = expansion(3);
    for family in all_families() {
        let kernel = Kernel::new(family, 0.8, 3.0).unwrap();
        let jets = jets(&cloud, &kernel, &weights, &queries, JetOrder::HessianWithMagnitudes);
        for query in 0..queries.n_points() {
            let (value, slope) = jets.magnitudes(query);
            let norm = jets.gradient(query).iter().map(|g| g * g).sum::<f64>().sqrt();
            assert!(jets.value(query).abs() <= value * (1.0 + 1e-14));
            assert!(norm <= slope * (1.0 + 1e-14));
        }
    }
    // For a single point of weight 1, the magnitudes are the absolute values themselves.
    let one = Cloud::new(vec![0.0, 0.0, 0.0], 3).unwrap();
    let kernel = Kernel::new(crate::kernel::Family::Gauss, 0.8, 3.0).unwrap();
    let jets = jets_of_one(&one, &kernel);
    let (value, slope) = jets.magnitudes(0);
    assert!((value - jets.value(0)).abs() < 1e-15);
    assert!((slope - jets.gradient(0)[0].abs()).abs() < 1e-15);
}

fn jets_of_one(one: &Cloud, kernel: &Kernel) -> Jets {
    let query = Cloud::new(vec![0.3, 0.0, 0.0], 3).unwrap();
    jets(one, kernel, &[1.0], &query, JetOrder::HessianWithMagnitudes)
}

#[test]
fn kinked_kernels_are_refused_at_their_points_only() {
    let cloud = fibonacci_sphere(20);
    let kernel = Kernel::new(crate::kernel::Family::Laplace { epsilon: 0.0 }, 1.0, 1.0).unwrap();
    let mut coordinates = vec![0.1, 0.2, 0.3];
    coordinates.extend_from_slice(cloud.point(7));
    let queries = Cloud::new(coordinates, 3).unwrap();
    let refusal = check_smooth_at(&cloud, &kernel, &queries, &Unobserved);
    assert_eq!(refusal, Err(NumericsError::KernelNotSmooth { query: 1, point: 7 }));
    let smooth = Kernel::new(crate::kernel::Family::Gauss, 1.0, 1.0).unwrap();
    assert_eq!(check_smooth_at(&cloud, &smooth, &queries, &Unobserved), Ok(()));
}

#[test]
fn results_beyond_float64_are_an_error() {
    let (cloud, _, queries) = expansion(2);
    let kernel = Kernel::new(crate::kernel::Family::Gauss, 5.0, 1.0).unwrap();
    let weights = vec![1e308; 100];
    let outcome = Jets::evaluate(&cloud, &kernel, &weights, &queries, JetOrder::Value, &Unobserved);
    assert!(matches!(outcome, Err(NumericsError::Overflow { query: 0 })));
}
