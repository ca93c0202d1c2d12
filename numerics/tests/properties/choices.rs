//! Choices that are made for a cloud: sites, means of points, groups of values. They depend on distances
//! only, so neither the order of the points nor the axes matter.

use std::sync::Arc;

use gramian_numerics::kernel::defaults::Purpose;
use gramian_numerics::observer::Unobserved;
use gramian_numerics::patches::{PatchGeometry, Patches};
use gramian_numerics::points::cloud::Cloud;
use gramian_numerics::points::sampling::Sampling;
use gramian_numerics::regression::selection::{LearnedModel, Noise, ObservedCloud, learn};
use gramian_numerics::regression::solver::trend::Mean;
use gramian_numerics::surface::Surface;
use gramian_numerics::surface::geometry::{Geometry, GeometryRequest};
use gramian_numerics::surface::local::{Learning, LocalInputs, LocalSurface};

use crate::common::fits;
use crate::common::random::Random;
use crate::support::rotation;

/// Random points of a flattened circle or sphere with noise of 1 %.
fn noisy(n: usize, d: usize) -> Cloud {
    let mut random = Random(11);
    let mut point = || {
        let x: Vec<f64> = (0..d).map(|_| random.normal()).collect();
        let length = x.iter().map(|c| c * c).sum::<f64>().sqrt();
        let axes = [1.0, 0.8, 0.6];
        (0..d).map(|c| axes[c] * x[c] / length + 0.01 * random.normal()).collect::<Vec<f64>>()
    };
    Cloud::new((0..n).flat_map(|_| point()).collect(), d).unwrap()
}

/// The index of point i of n in another order. 1,009 is a prime that divides none of the sizes here.
fn place(i: usize, n: usize) -> usize {
    i * 1009 % n
}

/// The cloud rotated and in another order.
fn moved(cloud: &Cloud) -> Cloud {
    let (n, d) = (cloud.n_points(), cloud.dimension());
    let turned = rotation(d, &[0.3, 1.1, 2.0]);
    let mut coordinates = vec![0.0; n * d];
    for (i, x) in cloud.points().enumerate() {
        let entry = |row: usize| (0..d).map(|c| turned[row * d + c] * x[c]).sum::<f64>();
        (0..d).for_each(|row| coordinates[place(i, n) * d + row] = entry(row));
    }
    Cloud::new(coordinates, d).unwrap()
}

fn regressed(cloud: &Cloud) -> PatchGeometry {
    let cloud = Arc::new(cloud.clone());
    let sampling = Arc::new(Sampling::of(&cloud, &Unobserved).unwrap());
    Patches::of(cloud.clone(), sampling, &Unobserved)
        .unwrap()
        .at(&cloud, &|_| true, true, &Unobserved)
        .unwrap()
}

#[test]
fn regressions_change_by_rounding_alone() {
    for (n, d) in [(700, 2), (1500, 3), (5000, 3)] {
        let cloud = noisy(n, d);
        let (a, b) = (regressed(&cloud), regressed(&moved(&cloud)));
        let (x, y) = (a.curvatures.as_ref().unwrap(), b.curvatures.as_ref().unwrap());
        let greatest = x.mean.iter().fold(0.0, |greatest: f64, mean| greatest.max(mean.abs()));
        for i in 0..n {
            let j = place(i, n);
            let curvatures = (x.mean[i] - y.mean[j]).abs() / greatest;
            let deviations = (a.normal_std[i] - b.normal_std[j]).abs();
            assert!(curvatures < 1e-9 && deviations < 1e-9, "{n}, {d}: {curvatures} {deviations}");
        }
    }
}

#[test]
fn parts_with_the_same_sites_learn_the_same() {
    let mut random = Random(7);
    let on_sphere = (0..4000).flat_map(|_| random.on_sphere());
    let whole = Cloud::new(on_sphere.collect(), 3).unwrap();
    let above = |least: f64| {
        let points = whole.points().filter(|x| x[2] > least);
        Cloud::new(points.flatten().copied().collect(), 3).unwrap()
    };
    // Neighbourhoods have a radius of at most 0.2, so those of the sites lie within the part.
    let (part, sites) = (above(-0.4), above(0.9));
    let at_sites = |cloud: &Cloud| {
        let cloud = Arc::new(cloud.clone());
        let sampling = Arc::new(Sampling::of(&cloud, &Unobserved).unwrap());
        Patches::learned_at(&sites, cloud, sampling, &Unobserved).unwrap()
    };
    let (of_whole, of_part) = (at_sites(&whole), at_sites(&part));
    assert!(of_whole.kernel().length_scale > 0.1);
    assert!((of_whole.kernel().length_scale / of_part.kernel().length_scale - 1.0).abs() < 1e-12);
    assert_eq!(of_whole.noise(), of_part.noise());
}

#[test]
fn parts_with_the_hyperparameters_of_the_whole_have_its_surface() {
    let mut random = Random(8);
    let on_sphere = (0..4000).flat_map(|_| random.on_sphere());
    let whole = Arc::new(Cloud::new(on_sphere.collect(), 3).unwrap());
    let above = |least: f64| {
        let points = whole.points().filter(|x| x[2] > least);
        Arc::new(Cloud::new(points.flatten().copied().collect(), 3).unwrap())
    };
    let surface = |cloud: &Arc<Cloud>, learning: Option<&Learning>| {
        let sampling = Arc::new(Sampling::of(cloud, &Unobserved).unwrap());
        let given = LocalInputs { normals: None, learning };
        LocalSurface::of(cloud.clone(), sampling, given, &Unobserved).unwrap()
    };
    let of_whole = surface(&whole, None);
    let known = of_whole.hyperparameters();
    assert!(known.regression.coarser.is_empty());
    let of_part = surface(&above(0.0), Some(&Learning::Known(Arc::new(known.clone()))));
    assert_eq!(of_part.hyperparameters(), known);
    let queries = above(0.7);
    let at_queries =
        |surface: &LocalSurface| surface.patches().at(&queries, &|_| true, true, &Unobserved).unwrap();
    let (a, b) = (at_queries(&of_whole), at_queries(&of_part));
    // Normals have either sign. Neighbours are the same, so what differs is the order of sums.
    let is_close = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(x, y)| (x.abs() - y.abs()).abs() < 1e-9);
    assert!(is_close(&a.normals, &b.normals) && is_close(&a.normal_std, &b.normal_std));
    assert!(is_close(&a.shapes, &b.shapes));
}

#[test]
fn queries_that_are_points_have_the_deviations_of_points() {
    let dense = {
        let cloud = noisy(400, 3);
        let (kernel, alpha) = fits::default_kernel_and_alpha(&cloud, Purpose::Curvatures);
        fits::surface(&fits::factorize(&cloud, kernel, alpha))
    };
    let local = {
        let cloud = Arc::new(noisy(3000, 3));
        let sampling = Arc::new(Sampling::of(&cloud, &Unobserved).unwrap());
        let given = LocalInputs { normals: None, learning: None };
        Surface::Local(Box::new(LocalSurface::of(cloud, sampling, given, &Unobserved).unwrap()))
    };
    let request = GeometryRequest { has_deviations: true, ..GeometryRequest::CURVATURES };
    for surface in [dense, local] {
        let cloud = surface.cloud().clone();
        let at = |queries: &Cloud| Geometry::of(&surface, queries, &request, &Unobserved).unwrap();
        // Every third point, and a place beside the last one, so that the queries are no part of the cloud.
        let mut places: Vec<f64> = cloud.points().step_by(3).flatten().copied().collect();
        places.extend(cloud.point(1).iter().map(|x| 1.0001 * x));
        let queries = Cloud::new(places, 3).unwrap();
        let (all, some) = (at(&cloud), at(&queries));
        let (all, some) = (all.deviations().unwrap(), some.deviations().unwrap());
        for query in 0..queries.n_points() - 1 {
            for (of_points, of_queries) in [(&all.normal, &some.normal), (&all.mean, &some.mean)] {
                let (a, b) = (of_points[3 * query], of_queries[query]);
                assert!((a - b).abs() <= 1e-9 * a.abs(), "{query}: {a} as a point, {b} as a query");
            }
        }
        let last = queries.n_points() - 1;
        assert!(some.mean[last] < all.mean[1], "{} beside a point, {} at it", some.mean[last], all.mean[1]);
    }
}

fn learned(cloud: &Cloud, values: &[f64]) -> LearnedModel {
    let sampling = Sampling::of(cloud, &Unobserved).unwrap();
    let (noise, mean) = (Noise::Unknown, Mean::Constant);
    learn(ObservedCloud { cloud, sampling: &sampling, values, noise, mean }, &Unobserved).unwrap()
}

#[test]
fn what_values_decide_changes_by_rounding_alone() {
    for (n, d) in [(600, 2), (3000, 2), (3000, 3)] {
        let cloud = noisy(n, d);
        let mut random = Random(5);
        let values: Vec<f64> =
            cloud.points().map(|x| (3.0 * x[0]).sin() + x[1] + 0.02 * random.normal()).collect();
        let mut others = vec![0.0; n];
        values.iter().enumerate().for_each(|(i, value)| others[place(i, n)] = *value);
        let (a, b) = (learned(&cloud, &values), learned(&moved(&cloud), &others));
        assert_eq!(a.family, b.family);
        // Searches end where the likelihood is flat to rounding, which leaves half of the
        // digits: 1e-6 allows for more.
        for (x, y) in [(a.length_scale, b.length_scale), (a.ratio, b.ratio), (a.variance, b.variance)] {
            assert!((x / y - 1.0).abs() < 1e-6, "{n}, {d}: {x} {y}");
        }
    }
}
