//! Exact points of smooth surfaces, where local regressions take a trend of fourth order.

use gramian_numerics::patches::Patches;
use gramian_numerics::points::cloud::Cloud;

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
    patches(&std::sync::Arc::new(Cloud::new(moved, 3).unwrap()))
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
