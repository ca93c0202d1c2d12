use super::lists::Lists;
use super::*;
use crate::kernel::Family;
use crate::observer::Unobserved;
use crate::regression::sums::symmetric::kernel_times;
use crate::testing::{Random, circle, fibonacci_sphere};

/// Kernels that are analytic wherever two points differ.
const FAMILIES: [Family; 4] = [
    Family::Laplace { epsilon: 0.0 },
    Family::Matern { order: 1 },
    Family::InverseMultiquadric,
    Family::Gauss,
];

fn fast(cloud: &Cloud, kernel: &Kernel) -> FastSums {
    FastSums::of(cloud, kernel, &Unobserved).unwrap()
}

fn weights(n: usize) -> Vec<f64> {
    let mut random = Random(7);
    (0..n).map(|_| random.normal()).collect()
}

/// Largest error of a product, over the sum of the weights' magnitudes times k₀.
fn error(cloud: &Cloud, kernel: &Kernel, accuracy: f64) -> f64 {
    let weights = weights(cloud.n_points());
    let exact = kernel_times(cloud, kernel, &weights, &Unobserved).unwrap();
    let found = fast(cloud, kernel).plan(accuracy).times(&weights, &Unobserved).unwrap();
    let errors = found.iter().zip(&exact).map(|(found, exact)| (found - exact).abs());
    let total: f64 = weights.iter().map(|weight| weight.abs()).sum();
    errors.fold(0.0, f64::max) / (kernel.at_zero() * total)
}

/// Points of a sphere, 1 % of them within a hundredth of it, with ten far ones and a few copies.
fn uneven() -> Cloud {
    let sphere = fibonacci_sphere(3_000);
    let mut points = sphere.coordinates().to_vec();
    points.extend(fibonacci_sphere(300).points().flat_map(|x| [1.0 + 0.01 * x[0], 0.01 * x[1], 0.01 * x[2]]));
    points.extend((0..10).flat_map(|i| [f64::from(i), 50.0, -30.0 * f64::from(i)]));
    points.extend_from_slice(&sphere.coordinates()[..60]);
    points.extend(sphere.coordinates()[..3].repeat(200));
    Cloud::new(points, 3).unwrap()
}

#[test]
fn products_are_as_exact_as_asked() {
    let mut random = Random(3);
    let line = Cloud::new((0..2_000).map(|_| random.normal()).collect(), 1).unwrap();
    let square = Cloud::new((0..6_000).map(|_| random.uniform()).collect(), 2).unwrap();
    for cloud in [line, square, circle(2_000), fibonacci_sphere(4_000), uneven()] {
        for family in FAMILIES {
            let kernel = Kernel::new(family, 0.7, 1.7).unwrap();
            for accuracy in [1e-1, 1e-3, 1e-6, 1e-10] {
                let error = error(&cloud, &kernel, accuracy);
                let (n, d) = (cloud.n_points(), cloud.dimension());
                assert!(error <= accuracy, "{family:?}, {n} points, {d} axes: {error} > {accuracy}");
            }
        }
    }
}

#[test]
fn units_offsets_and_stretched_axes_change_nothing() {
    let sphere = fibonacci_sphere(3_000);
    let plain = error(&sphere, &Kernel::new(Family::Matern { order: 1 }, 0.5, 1.0).unwrap(), 1e-5);
    assert!(plain <= 1e-5);
    for (unit, offset) in [(1e-9, 0.0), (1e7, 0.0), (1.0, 1e6), (1e-3, -5.0)] {
        let moved = sphere.coordinates().iter().map(|x| unit * x + offset).collect();
        let kernel = Kernel::new(Family::Matern { order: 1 }, 0.5 * unit, 1.0).unwrap();
        // Coordinates of 1e6 have lost ten digits of the sphere.
        let error = error(&Cloud::new(moved, 3).unwrap(), &kernel, 1e-5);
        assert!(error <= 2.0 * plain, "{unit} {offset}: {error} against {plain}");
    }
    let lengths = [0.5, 5.0, 0.05];
    let stretched =
        sphere.points().flat_map(|x| x.iter().zip(lengths).map(|(x, l)| x * l / 0.5).collect::<Vec<_>>());
    let kernel = Kernel::of_axes(Family::Matern { order: 1 }, &lengths, 1.0).unwrap();
    let error = error(&Cloud::new(stretched.collect(), 3).unwrap(), &kernel, 1e-5);
    assert!(error <= 2.0 * plain, "{error} against {plain}");
}

#[test]
fn several_columns_are_those_of_one_each() {
    let (cloud, kernel) = (uneven(), Kernel::new(Family::Laplace { epsilon: 0.0 }, 0.5, 2.0).unwrap());
    let (n, sums) = (cloud.n_points(), fast(&cloud, &kernel));
    let (columns, plan) = (weights(3 * n), sums.plan(1e-4));
    let together = plan.times(&columns, &Unobserved).unwrap();
    for (column, found) in columns.chunks_exact(n).zip(together.chunks_exact(n)) {
        let alone = plan.times(column, &Unobserved).unwrap();
        // Sums of 4,000 terms of about 1, in another order.
        assert!(alone.iter().zip(found).all(|(a, b)| (a - b).abs() < 1e-10));
    }
}

#[test]
fn every_two_points_are_in_one_pair_of_clusters() {
    for cloud in [circle(100), circle(1_000), fibonacci_sphere(5_000), uneven()] {
        let sums = fast(&cloud, &Kernel::new(Family::Gauss, 1.0, 1.0).unwrap());
        let clusters = &sums.clusters;
        let n_levels = (clusters.indices().end as f64).log2() as usize;
        for smallest in (0..n_levels).map(|level| 1 << level) {
            let lists = Lists::of(clusters, smallest);
            let size = |index: usize| clusters.at(index).points.len();
            let of = |lists: &[Vec<u32>]| -> usize {
                let lists = lists.iter().enumerate();
                lists.flat_map(|(a, list)| list.iter().map(move |&b| size(a) * size(b as usize))).sum()
            };
            assert_eq!(of(&lists.far) + of(&lists.near), cloud.n_points() * cloud.n_points());
            // What is a target is a source as well.
            for (a, list) in lists.far.iter().enumerate() {
                assert!(list.iter().all(|&b| lists.far[b as usize].contains(&(a as u32))));
            }
        }
    }
}

#[test]
fn pairs_grow_like_the_points() {
    let pairs = |n: usize| {
        let kernel = Kernel::new(Family::Laplace { epsilon: 0.0 }, 1.0, 1.0).unwrap();
        fast(&fibonacci_sphere(n), &kernel).plan(1e-3).n_pairs()
    };
    let (few, many) = (pairs(20_000), pairs(80_000));
    // A plain product takes sixteen times as many.
    assert!(many < 6.0 * few, "{few} {many}");
}
