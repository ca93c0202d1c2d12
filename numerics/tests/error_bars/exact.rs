//! Exact points of smooth surfaces, where local regressions take a trend of fourth order.

use std::f64::consts::TAU;
use std::sync::Arc;

use gramian_numerics::observer::Unobserved;
use gramian_numerics::patches::{PatchHyperparameters, Patches};
use gramian_numerics::points::cloud::Cloud;
use gramian_numerics::points::sampling::Sampling as Sampled;

use crate::common::clouds::{TORUS, torus_point};
use crate::common::random::Random;
use crate::sampling::{Sampling, sample};
use crate::shapes::Shape;
use crate::sweep::{Case, Row, patches, quantile};

fn exact(shape: Shape, sampling: Sampling, n_points: usize) -> Row {
    Case { shape, sampling, n_points, noise: 0.0 }.run(1)
}

/// Local regressions of 2,000 random points of an ellipsoid with noise.
fn learned(noise: f64) -> Patches {
    let mut random = Random(5);
    let mut moved = sample(Shape::Ellipsoid, Sampling::Random, 2000, &mut random).concat();
    moved.iter_mut().for_each(|x| *x += noise * random.normal());
    patches(&Arc::new(Cloud::new(moved, 3).unwrap()))
}

#[test]
fn errors_of_curvatures_fall_with_the_fourth_power_of_the_spacing() {
    for shape in [Shape::Torus, Shape::Ellipsoid, Shape::Cyclide, Shape::Blob] {
        let [coarse, fine] = [1000, 10_000].map(|n| quantile(&exact(shape, Sampling::Random, n).errors, 0.5));
        // The spacing falls by √10. With quadrics as the trend, errors fall by 7 to 31, to 6e-4 and more.
        assert!(fine < 1e-4 && fine * 32.0 < coarse, "{shape:?}: {coarse:e}, {fine:e}");
    }
}

#[test]
fn errors_next_to_rounding_are_within_their_bars() {
    // What the closed form leaves of a sphere is a millionth of a millionth of its heights.
    for sampling in [Sampling::Regular, Sampling::Random] {
        for n_points in [4000, 10_000] {
            let row = exact(Shape::Sphere, sampling, n_points);
            assert!(row.coverages().iter().all(|&share| share >= 90.0), "{:?}", row.coverages());
        }
    }
}

#[test]
fn points_with_noise_keep_quadrics() {
    assert!(!learned(0.0).hyperparameters().quartic_noise_ratios.is_empty());
    assert!(learned(1e-3).hyperparameters().quartic_noise_ratios.is_empty());
}

/// Largest errors of the mean curvature, 1/L, at points on lines around the tube of a torus: at equal steps
/// along these and from line to line. First with what is learned, then with quadrics alone.
fn worst_on_lattice(n_lines: usize, n_along: usize) -> [f64; 2] {
    let step = |at: usize, of: usize| TAU * at as f64 / of as f64;
    let angles = (0..n_lines * n_along).map(|i| [step(i / n_along, n_lines), step(i % n_along, n_along)]);
    let places: Vec<[f64; 2]> = angles.collect();
    let points = places.iter().flat_map(|&[u, v]| torus_point(u, v)).collect();
    let cloud = Arc::new(Cloud::new(points, 3).unwrap());
    let sampling = Arc::new(Sampled::of(&cloud, &Unobserved).unwrap());
    let learned = patches(&cloud);
    let quadrics = PatchHyperparameters { quartic_noise_ratios: Vec::new(), ..learned.hyperparameters() };
    let quadrics = Patches::with(&quadrics, cloud.clone(), sampling, &Unobserved).unwrap();
    let [ring, tube] = TORUS;
    let error = |(shape, &[_, v]): (&[f64], &[f64; 2])| {
        let exact = 0.5 * (v.cos() / (ring + tube * v.cos()) + 1.0 / tube);
        (0.5 * (shape[0] + shape[4] + shape[8]).abs() - exact).abs()
    };
    [learned, quadrics].map(|patches| {
        let found = patches.at(&cloud, &|_| true, true, &Unobserved).unwrap();
        found.shapes.chunks_exact(9).zip(&places).map(error).fold(0.0, f64::max)
    })
}

#[test]
fn lattices_and_lines_get_quadrics_where_they_do_not_determine_more() {
    // Neighbourhoods see seven lines or three.
    for (n_lines, n_along) in [(200, 100), (80, 250)] {
        let [learned, quadrics] = worst_on_lattice(n_lines, n_along);
        assert!(learned <= 1.1 * quadrics, "{n_lines} lines: {learned:e} for {quadrics:e}");
    }
}
