use super::*;
use crate::observer::Unobserved;
use crate::testing::{Random, fibonacci_sphere};

/// A smooth field on a sphere, with noise of this standard deviation.
fn field(n: usize, noise: f64) -> (Cloud, Vec<f64>) {
    let cloud = fibonacci_sphere(n);
    let mut random = Random(n as u64 + 1);
    let noises: Vec<f64> = (0..n).map(|_| random.normal()).collect();
    let smooth = |x: &[f64]| (2.0 * x[0]).sin() + x[1] * x[2];
    let values = cloud.points().enumerate().map(|(i, x)| smooth(x) + noise * noises[i]);
    (cloud.clone(), values.collect())
}

fn learned(cloud: &Cloud, values: &[f64], noise: Noise<'_>) -> LearnedModel {
    let sampling = Sampling::of(cloud, &Unobserved).unwrap();
    let observed = ObservedCloud { cloud, sampling: &sampling, values, noise, mean: Mean::Constant };
    learn(observed, &Unobserved).unwrap()
}

#[test]
fn exact_values_are_taken_as_exact_and_noise_is_found() {
    for n in [100, 256, 900] {
        let (cloud, values) = field(n, 0.0);
        assert!(learned(&cloud, &values, Noise::Unknown).ratio < 1.01e-10, "{n}");
        for noise in [0.003, 0.03, 0.2] {
            let (cloud, values) = field(n, noise);
            let found = learned(&cloud, &values, Noise::Unknown);
            let deviation = (found.ratio * found.variance).sqrt();
            // A hundred values determine their noise to a tenth. A step of the grid changes it by a third.
            assert!((0.6..1.6).contains(&(deviation / noise)), "{n} {noise}: {deviation}");
        }
    }
}

#[test]
fn neither_units_nor_offsets_change_what_is_learned() {
    let (cloud, values) = field(200, 0.02);
    let plain = learned(&cloud, &values, Noise::Unknown);
    for (factor, offset) in [(1e-6, 0.0), (1e6, -1e6), (1.0, 1e6), (1e140, 0.0), (1e-140, 0.0)] {
        let moved: Vec<f64> = values.iter().map(|v| factor * v + offset).collect();
        let found = learned(&cloud, &moved, Noise::Unknown);
        assert_eq!((found.family, found.ratio), (plain.family, plain.ratio));
        assert_eq!(found.length_scale, plain.length_scale);
        let variance = factor * factor * plain.variance;
        assert!((found.variance / variance - 1.0).abs() < 1e-6, "{}", found.variance);
    }
    let scaled = Cloud::new(cloud.coordinates().iter().map(|x| 1e3 * x).collect(), 3).unwrap();
    let found = learned(&scaled, &values, Noise::Unknown);
    assert!((found.length_scale / plain.length_scale - 1e3).abs() < 1e-9 && found.ratio == plain.ratio);
}

#[test]
fn a_noise_that_is_known_is_kept() {
    let (cloud, values) = field(200, 0.05);
    let found = learned(&cloud, &values, Noise::Uniform(0.0025));
    assert!((found.ratio * found.variance / 0.0025 - 1.0).abs() < 1e-12);
    let alike = learned(&cloud, &values, Noise::PerPoint(&[0.0025; 200]));
    assert_eq!((alike.family, alike.ratio), (found.family, found.ratio));
    let (cloud, values) = field(200, 0.0);
    assert_eq!(learned(&cloud, &values, Noise::Uniform(0.0)).ratio, 0.0);
}

#[test]
fn rough_fields_get_rough_kernels() {
    let cloud = fibonacci_sphere(400);
    let step: Vec<f64> = cloud.points().map(|x| (x[0] / 0.05).tanh()).collect();
    assert_eq!(learned(&cloud, &step, Noise::Unknown).family, Family::Matern { order: 2 });
    let smooth: Vec<f64> = cloud.points().map(|x| (2.0 * x[0]).sin()).collect();
    assert_eq!(learned(&cloud, &smooth, Noise::Unknown).family, Family::Gauss);
}

#[test]
fn a_hot_spot_shortens_the_length_scale_and_outliers_do_not() {
    let (cloud, plain) = field(2000, 0.01);
    let length = |values: &[f64]| learned(&cloud, values, Noise::Unknown).length_scale;
    let expected = length(&plain);
    // The spot covers a two-hundredth of the sphere.
    let spot = |x: &[f64]| (-(1.0 - x[0]) / 0.01).exp();
    let with_spot: Vec<f64> = plain.iter().zip(cloud.points()).map(|(value, x)| value + spot(x)).collect();
    let found = length(&with_spot);
    assert!(found < 0.4 * expected, "{found} of {expected}");
    // One value in 500 is off by 10 or 100 deviations of the noise. The family may change to one with half
    // the length.
    for off in [0.1, 1.0] {
        let error = |i: usize| if i % 500 == 250 { off } else { 0.0 };
        let with_outliers: Vec<f64> = plain.iter().enumerate().map(|(i, value)| value + error(i)).collect();
        let found = length(&with_outliers);
        assert!(found > 0.4 * expected, "{off}: {found} of {expected}");
    }
}

#[test]
fn a_place_that_no_length_scale_explains_is_named() {
    let (cloud, plain) = field(1000, 0.01);
    let place = |values: &[f64]| learned(&cloud, values, Noise::Unknown).disagreement?.place;
    assert_eq!(place(&plain), None);
    let is_above = |x: &[f64]| x[0] + 0.3 * x[1] > 0.0;
    let step = plain.iter().zip(cloud.points()).map(|(value, x)| value + f64::from(u8::from(is_above(x))));
    let found = place(&step.collect::<Vec<f64>>()).unwrap();
    // Points are 0.11 apart.
    let x = cloud.point(found.point);
    assert!((x[0] + 0.3 * x[1]).abs() < 0.2, "{x:?}");
    assert!((12..=32).contains(&found.n_points) && found.deviations > 1.4, "{found:?}");
}

#[test]
fn few_values_and_equal_ones_decide_nothing() {
    let family = Family::Matern { order: 2 };
    for n in [1, 2, 7] {
        let (cloud, values) = field(n, 0.0);
        assert_eq!(learned(&cloud, &values, Noise::Unknown).family, family);
    }
    let cloud = fibonacci_sphere(50);
    assert!(learned(&cloud, &[3.0; 50], Noise::Unknown).ratio < 1.01e-10);
    let together = Cloud::new(vec![1.0; 60], 3).unwrap();
    let values: Vec<f64> = (0..20).map(f64::from).collect();
    assert!(learned(&together, &values, Noise::Unknown).variance > 0.0);
}

#[test]
fn points_that_coincide_have_a_mean_though_some_have_no_noise() {
    // Every point occurs twice, and every third one is exact. One cloud forms one group, the other several.
    for n in [60, 500] {
        let (half, values) = field(n, 0.0);
        let cloud = Cloud::new(half.coordinates().repeat(2), 3).unwrap();
        let values = values.repeat(2);
        let noise: Vec<f64> = (0..2 * n).map(|i| if i % 3 == 0 { 0.0 } else { 1e-4 }).collect();
        let sampling = Sampling::of(&cloud, &Unobserved).unwrap();
        let (mean, noise) = (Mean::Constant, Noise::PerPoint(&noise));
        let observed = ObservedCloud { cloud: &cloud, sampling: &sampling, values: &values, noise, mean };
        let kernel = Kernel::new(Family::Gauss, 1.0, 1.0).unwrap();
        assert!(learn_mean(observed, &kernel, &Unobserved).unwrap().trend.is_some(), "{n}");
        assert!(learn(observed, &Unobserved).unwrap().trend.is_some(), "{n}");
    }
}

/// A field with noise of 0.3, some of whose rows are sent twice: `n_copies` as they are, and `n_differing`
/// with another noise.
fn field_with_rows_twice(seed: u64, n_copies: usize, n_differing: usize) -> (Cloud, Vec<f64>) {
    let n = 500;
    let mut random = Random(seed);
    let mut coordinates: Vec<f64> = (0..2 * n).map(|_| random.uniform()).collect();
    let smooth = |x: &[f64]| (5.0 * x[0]).sin() + (4.0 * x[1]).cos() * x[0];
    let field: Vec<f64> = coordinates.chunks(2).map(smooth).collect();
    let mut values: Vec<f64> = field.iter().map(|u| u + 0.3 * random.normal()).collect();
    for copy in 0..n_copies + n_differing {
        let point = copy * 7 % n;
        coordinates.extend_from_within(2 * point..2 * point + 2);
        values.push(if copy < n_copies { values[point] } else { field[point] + 0.3 * random.normal() });
    }
    (Cloud::new(coordinates, 2).unwrap(), values)
}

#[test]
fn rows_that_repeat_leave_the_noise_as_it_is() {
    for seed in 1..=10 {
        for (n_copies, n_differing) in [(0, 0), (10, 0), (50, 0), (200, 0), (0, 3), (50, 1), (200, 20)] {
            let (cloud, values) = field_with_rows_twice(seed, n_copies, n_differing);
            let found = learned(&cloud, &values, Noise::Unknown);
            let deviation = (found.ratio * found.variance).sqrt();
            // A step of the grid is a third of the deviation, and 500 values know theirs to a thirtieth.
            assert!((0.2..0.42).contains(&deviation), "{seed} {n_copies} {n_differing}: {deviation}");
            assert!(found.variance < 20.0, "{seed} {n_copies} {n_differing}: {}", found.variance);
        }
    }
}

#[test]
fn rows_at_one_place_have_the_noise_that_they_scatter_by() {
    let cloud = Cloud::new(vec![1.0; 20], 2).unwrap();
    let values: Vec<f64> = (0..10).map(f64::from).collect();
    let found = learned(&cloud, &values, Noise::Unknown);
    // One place decides no kernel. The squares about the mean are 82.5, with 9 degrees of freedom.
    let noise = found.ratio * found.variance;
    assert!((noise - 82.5 / 9.0).abs() < 1e-9, "{noise}");
}

#[test]
fn rows_at_one_place_are_read_in_any_unit_and_if_all_are_zero() {
    let cloud = Cloud::new(vec![1.0; 20], 2).unwrap();
    for unit in [0.0, 1e-140, 1.0, 1e140] {
        let values: Vec<f64> = (0..10).map(|row| unit * f64::from(row)).collect();
        let found = learned(&cloud, &values, Noise::Unknown);
        let least = if unit > 0.0 { 0.1 } else { 0.0 };
        assert!(found.ratio.is_finite() && found.ratio >= least, "{unit}: {}", found.ratio);
        assert!(found.variance.is_finite(), "{unit}: {}", found.variance);
    }
}

/// Rows of six columns, of which the values depend on two, with noise of 0.05 in them. Columns have these
/// units.
fn table(seed: u64, n: usize, units: [f64; 6]) -> (Cloud, Vec<f64>) {
    let mut random = Random(seed);
    let rows: Vec<f64> = (0..6 * n).map(|_| random.normal()).collect();
    let value = |x: &[f64]| (2.0 * x[0]).sin() + 0.5 * x[1] * x[1];
    let values = rows.chunks_exact(6).map(|x| value(x) + 0.05 * random.normal()).collect();
    let scaled = rows.iter().enumerate().map(|(at, x)| units[at % 6] * x).collect();
    (Cloud::new(scaled, 6).unwrap(), values)
}

#[test]
fn columns_of_a_table_have_length_scales_in_their_units() {
    // One size forms one group, the other several.
    for n in [150, 500] {
        let in_units = |units: [f64; 6]| -> Vec<f64> {
            let (cloud, values) = table(n as u64, n, units);
            let found = learned(&cloud, &values, Noise::Unknown);
            let deviation = (found.ratio * found.variance).sqrt();
            assert!((0.03..0.08).contains(&deviation), "{n}: noise {deviation}");
            let scales = found.length_scales.unwrap_or_else(|| panic!("{n}: one length scale for all"));
            scales.iter().zip(units).map(|(scale, unit)| scale / unit).collect()
        };
        let found = in_units([1e-3, 1e2, 1.0, 1e3, 1e-2, 10.0]);
        let most = found[0].max(found[1]);
        assert!(found[2..].iter().all(|&scale| scale > 2.0 * most), "{n}: {found:?}");
        // A descent begins at what the comparison before it found, which depends on units a little. Its end
        // does not, up to the family.
        let others = in_units([1e3, 1.0, 1e-2, 1.0, 1e2, 1e-3]);
        let ratio = found[1] / found[0] * others[0] / others[1];
        assert!(ratio.ln().abs() < 0.7, "{n}: {found:?} {others:?}");
    }
}

#[test]
fn a_noise_that_is_known_is_kept_for_columns_and_a_column_that_does_not_vary_is_no_obstacle() {
    let (cloud, values) = table(3, 200, [1e-3, 1e2, 0.0, 1e3, 1e-2, 10.0]);
    let uniform = learned(&cloud, &values, Noise::Uniform(0.0025));
    assert!((uniform.ratio * uniform.variance / 0.0025 - 1.0).abs() < 1e-12);
    let per_point = learned(&cloud, &values, Noise::PerPoint(&[0.0025; 200]));
    for found in [uniform, per_point] {
        let scales = found.length_scales.unwrap();
        assert!(scales[0] < 0.01 && scales[1] > 10.0 && scales[2] == scales[0], "{scales:?}");
    }
}

#[test]
fn noise_and_places_have_one_length_scale() {
    for seed in 1..=5 {
        let mut random = Random(seed);
        let (cloud, _) = table(seed, 150, [1e-3, 1e2, 1.0, 1e3, 1e-2, 10.0]);
        let noise: Vec<f64> = (0..150).map(|_| random.normal()).collect();
        assert_eq!(learned(&cloud, &noise, Noise::Unknown).length_scales, None, "{seed}");
    }
    // Layers: the values depend on one coordinate alone. Places may be rotated all the same.
    let cloud = fibonacci_sphere(300);
    let layers: Vec<f64> = cloud.points().map(|x| (4.0 * x[2]).sin()).collect();
    assert_eq!(learned(&cloud, &layers, Noise::Unknown).length_scales, None);
}
