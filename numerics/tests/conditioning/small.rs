//! Clouds with too few points or dimensions for a surface: interpolation works, geometry is right or flagged.

use gramian_numerics::kernel::Family;
use gramian_numerics::observer::Unobserved;
use gramian_numerics::points::cloud::Cloud;
use gramian_numerics::surface::geometry::Geometry;

use crate::support::*;

/// Families with derivatives at the points.
fn smooth_families() -> impl Iterator<Item = Family> {
    FAMILIES.into_iter().filter(|&family| !kernel(family, 1.0).has_kink())
}

/// Checks that queries with an answer have unit normals and finite curvatures.
fn assert_finite(geometry: &Geometry, what: &str) {
    let curvatures = geometry.curvatures(&Unobserved).unwrap();
    let d = geometry.dimension();
    for query in (0..geometry.n_queries()).filter(|&query| !geometry.is_null()[query]) {
        let norm = geometry.normal(query).iter().map(|x| x * x).sum::<f64>().sqrt();
        assert!((norm - 1.0).abs() < 1e-14, "{what}: a normal of length {norm}");
        assert!(curvatures.principal[query * (d - 1)..][..d - 1].iter().all(|k| k.is_finite()), "{what}");
    }
}

#[test]
fn one_point_is_met_and_its_level_surfaces_are_spheres() {
    for d in 1..=5 {
        let point = Cloud::new((0..d).map(|c| 0.5 - c as f64).collect(), d).unwrap();
        let at = |distance: f64| {
            let mut x = point.coordinates().to_vec();
            x[d - 1] += distance;
            Cloud::new(x, d).unwrap()
        };
        for family in smooth_families().filter(|f| d <= 3 || !matches!(f, Family::Wendland { .. })) {
            for alpha in [0.0, 0.1] {
                let factor = factorize(&point, kernel(family, 2.0), alpha);
                let k0 = factor.kernel().at_zero();
                let u = fit(&factor, &[3.0]);
                assert!((jets(&u, &point)[0][0] - 3.0 * k0 / (k0 + alpha)).abs() < 4.0 * EPS);
                if d == 1 {
                    continue;
                }
                // The gradient vanishes at the maximum of u, so no surface passes there.
                assert_eq!(geometry(&factor, &point).is_null(), [true], "{family:?} in dimension {d}");
                // Around the point the level surfaces are spheres: normal outwards,
                // all curvatures 1/distance.
                let sphere = geometry(&factor, &at(0.5));
                let curvatures = sphere.curvatures(&Unobserved).unwrap();
                assert!((sphere.normal(0)[d - 1] - 1.0).abs() < 8.0 * EPS, "{family:?}");
                assert!(curvatures.principal.iter().all(|k| (k - 2.0).abs() < 1e-13), "{family:?}");
            }
        }
    }
}

#[test]
fn as_many_points_as_dimensions_are_met() {
    for d in 2..=5 {
        let points =
            Cloud::new((0..d * d).map(|i| f64::from(u8::from(i % (d + 1) == 0))).collect(), d).unwrap();
        for family in smooth_families().filter(|f| d <= 3 || !matches!(f, Family::Wendland { .. })) {
            let factor = factorize(&points, kernel(family, 2.0), 0.0);
            let values = waves(&points);
            assert!(distance(&jets(&fit(&factor, &values), &points)[0], &values) < 1e-13);
            assert_finite(&geometry(&factor, &points), &format!("{family:?} in dimension {d}"));
        }
    }
}

/// 40 points without thickness, in the unit square or on a segment of it. Queries are the points, then points
/// displaced from them by `off`.
fn flat(point: impl Fn(f64, f64) -> [f64; 3], off: [f64; 3]) -> (Cloud, Cloud) {
    let mut random = Random(11);
    let points: Vec<[f64; 3]> = (0..40).map(|_| point(random.uniform(), random.uniform())).collect();
    let beside = points.iter().map(|x| std::array::from_fn(|c| x[c] + off[c]));
    let queries: Vec<[f64; 3]> = points.iter().copied().chain(beside).collect();
    (cloud(&points), cloud(&queries))
}

/// Fits waves at several α. `off` is the unit vector from the points to the queries beside them.
fn check_flat(points: &Cloud, queries: &Cloud, off: [f64; 3]) {
    let values = waves(points);
    for family in smooth_families() {
        let length_scale = if matches!(family, Family::Wendland { .. }) { 2.0 } else { 0.6 };
        for alpha in [0.0, 1e-10, 1e-4] {
            let what = format!("{family:?}, α = {alpha}");
            let factor = factorize(points, kernel(family, length_scale), alpha);
            let u = fit(&factor, &values);
            // α moves u at the points by α|Λ|. Cholesky and the fallback leave far less than 1e-6.
            let weights = u.solution.weights.iter().map(|w| w * w).sum::<f64>().sqrt();
            let error = distance(&jets(&u, points)[0], &values);
            assert!(error < 1e-6 + alpha * weights, "{what}: {error:e}");
            check_flat_geometry(&geometry(&factor, queries), off, &what);
        }
    }
}

/// Checks the geometry of a cloud without thickness, by the signature function without the offset model.
///
/// u is even across the points, so its gradient there lies in the line or plane and is no normal: all
/// are null. Beside the points level surfaces wrap the cloud. Normals point away from it, turned by
/// less than 66° at its ends.
fn check_flat_geometry(geometry: &Geometry, off: [f64; 3], what: &str) {
    assert_finite(geometry, what);
    let (on, beside) = geometry.is_null().split_at(geometry.n_queries() / 2);
    assert!(on.iter().all(|&is_null| is_null), "{what}");
    for query in (0..beside.len()).filter(|&query| !beside[query]) {
        let normal = geometry.normal(on.len() + query);
        let away: f64 = normal.iter().zip(off).map(|(a, b)| a * b).sum();
        assert!(away > 0.4, "{what}: query {query} beside the cloud, {away}");
    }
}

#[test]
fn a_cloud_on_a_plane_is_met() {
    let (points, queries) = flat(|s, t| [s, t, 0.25], [0.0, 0.0, 0.05]);
    check_flat(&points, &queries, [0.0, 0.0, 1.0]);
}

#[test]
fn a_cloud_on_a_line_is_met() {
    let (points, queries) = flat(|s, _| [s, 0.5 * s, 0.1 - s], [0.05 / 5f64.sqrt(), -0.1 / 5f64.sqrt(), 0.0]);
    check_flat(&points, &queries, [1.0 / 5f64.sqrt(), -2.0 / 5f64.sqrt(), 0.0]);
}
