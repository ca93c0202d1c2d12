//! Error bars of hard clouds: other dimensions, far from the origin, tiny, repeated, flat.

use std::sync::Arc;

use gramian_numerics::observer::Unobserved;
use gramian_numerics::patches::{PatchGeometry, Patches};
use gramian_numerics::points::cloud::Cloud;

use crate::common::clouds::{closed_curve_point, fibonacci_sphere, noisy, random_sphere, random_torus};
use crate::common::random::Random;
use crate::sweep::patches;

fn geometry(cloud: Cloud) -> PatchGeometry {
    let cloud = Arc::new(cloud);
    patches(&cloud).at(&cloud, &|_| true, true, &Unobserved).unwrap()
}

/// Trace of the shape operator over d − 1. The sign depends on the side of the normal.
fn mean_curvature(found: &PatchGeometry, i: usize, d: usize) -> f64 {
    (0..d).map(|a| found.shapes[i * d * d + a * (d + 1)]).sum::<f64>() / (d as f64 - 1.0)
}

fn is_finite(found: &PatchGeometry) -> bool {
    let deviations = found.curvatures.as_ref().unwrap();
    let lists = [
        &found.normals,
        &found.shapes,
        &found.heights,
        &found.normal_std,
        &deviations.principal,
        &deviations.mean,
        &deviations.gaussian,
    ];
    lists.into_iter().flatten().all(|x| x.is_finite())
}

/// Share of points whose mean curvature is right in magnitude to 1.96 deviations.
fn share_within(found: &PatchGeometry, d: usize, truth: &dyn Fn(usize) -> f64) -> f64 {
    let bars = &found.curvatures.as_ref().unwrap().mean;
    let holds = |i: &usize| (mean_curvature(found, *i, d).abs() - truth(*i).abs()).abs() <= 1.96 * bars[*i];
    let n = bars.len();
    (0..n).filter(holds).count() as f64 / n as f64
}

#[test]
fn bars_of_a_closed_curve_hold() {
    let n = 400;
    let angle = |i: usize| std::f64::consts::TAU * i as f64 / n as f64;
    let points: Vec<f64> = (0..n).flat_map(|i| closed_curve_point(angle(i)).0).collect();
    let cloud = Cloud::new(points, 2).unwrap();
    let curvature = |i: usize| {
        let t = angle(i);
        let (s, c) = t.sin_cos();
        let first = [c, 3.0 * s * s * c - 0.5 * s];
        let second = [-s, 6.0 * s * c * c - 3.0 * s.powi(3) - 0.5 * c];
        (first[0] * second[1] - first[1] * second[0]) / first[0].hypot(first[1]).powi(3)
    };
    for (noise, range) in [(0.0, 0.85..=1.0), (0.002, 0.85..=1.0), (0.01, 0.85..=1.0)] {
        let found = geometry(noisy(&cloud, noise, &mut Random(4)));
        assert!(is_finite(&found));
        let share = share_within(&found, 2, &curvature);
        assert!(range.contains(&share), "{noise}: {share}");
    }
}

#[test]
fn bars_of_a_sphere_in_four_dimensions_hold() {
    let mut random = Random(6);
    let on_sphere = |random: &mut Random| {
        let x: Vec<f64> = (0..4).map(|_| random.normal()).collect();
        let length = x.iter().map(|x| x * x).sum::<f64>().sqrt();
        x.into_iter().map(move |x| x / length).collect::<Vec<f64>>()
    };
    let points: Vec<f64> = (0..1500).flat_map(|_| on_sphere(&mut random)).collect();
    let cloud = Cloud::new(points, 4).unwrap();
    for noise in [0.0, 0.005] {
        let found = geometry(noisy(&cloud, noise, &mut random));
        assert!(is_finite(&found) && found.is_known.iter().all(|&known| known));
        let share = share_within(&found, 4, &|_| 1.0);
        // Coverage is lower than for surfaces in space, since 70 neighbours for ten coefficients reach far.
        assert!(share > 0.75, "{noise}: {share}");
    }
}

#[test]
fn place_and_size_change_nothing() {
    let cloud = noisy(&random_torus(600, &mut Random(8)), 0.002, &mut Random(9));
    let found = geometry(cloud.clone());
    for (scale, offset) in [(1e-6, 0.0), (1e6, 0.0), (1.0, 1e6), (1e-100, 0.0)] {
        let moved = cloud.coordinates().iter().map(|x| scale * x + offset).collect();
        let moved = geometry(Cloud::new(moved, 3).unwrap());
        for i in 0..600 {
            let (expected, found) = (mean_curvature(&found, i, 3), scale * mean_curvature(&moved, i, 3));
            let error = (expected.abs() - found.abs()).abs();
            assert!(error < 1e-5 * (1.0 + expected.abs()), "{scale} {offset} {i}: {expected} {found}");
        }
        let bars = |found: &PatchGeometry| found.curvatures.as_ref().unwrap().gaussian.clone();
        for (i, (expected, moved)) in bars(&found).into_iter().zip(bars(&moved)).enumerate() {
            let moved = moved * scale * scale;
            assert!((expected - moved).abs() < 1e-4 * expected, "{scale} {offset} {i}: {expected} {moved}");
        }
    }
}

#[test]
fn repeated_points_count_once() {
    let cloud = random_sphere(500, &mut Random(10));
    let twice = [cloud.coordinates(), cloud.coordinates()].concat();
    let (once, twice) = (geometry(cloud), geometry(Cloud::new(twice, 3).unwrap()));
    for i in 0..500 {
        assert!(twice.is_known[i]);
        assert!((mean_curvature(&once, i, 3).abs() - mean_curvature(&twice, i, 3).abs()).abs() < 1e-2, "{i}");
    }
}

#[test]
fn lines_have_no_answer_and_planes_no_curvature() {
    let mut random = Random(11);
    let line = (0..200).flat_map(|_| [1.0, 2.0, 3.0].map(|c| c * random.uniform())).collect::<Vec<f64>>();
    let along =
        Cloud::new((0..200).flat_map(|i| [line[3 * i], 2.0 * line[3 * i], 0.0]).collect(), 3).unwrap();
    let found = geometry(along);
    assert!(is_finite(&found) && found.is_known.iter().all(|&known| !known));
    let plane = (0..300).flat_map(|_| [random.uniform(), random.uniform(), 0.25]).collect();
    let found = geometry(Cloud::new(plane, 3).unwrap());
    assert!(is_finite(&found) && found.is_known.iter().all(|&known| known));
    assert!((0..300).all(|i| mean_curvature(&found, i, 3).abs() < 1e-6));
}

#[test]
fn clouds_of_a_few_points_have_an_answer_or_none() {
    for n in 1..40 {
        assert!(is_finite(&geometry(fibonacci_sphere(n))), "{n}");
    }
    let same = Cloud::new(vec![0.5; 30], 3).unwrap();
    assert!(geometry(same).is_known.iter().all(|&known| !known));
}

#[test]
fn answers_do_not_depend_on_threads_or_company() {
    let cloud = Arc::new(noisy(&random_torus(700, &mut Random(12)), 0.003, &mut Random(13)));
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        #[expect(clippy::disallowed_methods, reason = "a test waits for its own pool")]
        pool.install(|| {
            let patches: Patches = patches(&cloud);
            let all = patches.at(&cloud, &|_| true, true, &Unobserved).unwrap();
            let one = Cloud::new(cloud.point(17).to_vec(), 3).unwrap();
            (all, patches.at(&one, &|_| true, true, &Unobserved).unwrap())
        })
    };
    let ((one, alone), (three, _)) = (on(1), on(3));
    assert_eq!(one.shapes, three.shapes);
    assert_eq!(one.normal_std, three.normal_std);
    assert_eq!(alone.shapes, one.shapes[17 * 9..18 * 9]);
}
