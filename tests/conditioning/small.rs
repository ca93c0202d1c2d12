//! Clouds with too few points or dimensions for a surface: interpolation works, geometry is right or flagged.

use gramian::numerics::cloud::Cloud;
use gramian::numerics::geometry::Geometry;
use gramian::numerics::kernel::Family;
use gramian::numerics::observer::Unobserved;

use crate::support::*;

/// Families with derivatives at the points.
fn smooth_families() -> impl Iterator<Item = Family> {
    FAMILIES.into_iter().filter(|&family| !kernel(family, 1.0).has_kink())
}

/// Finite at regular queries, unit normals, nothing but flags elsewhere.
fn assert_finite(geometry: &Geometry, what: &str) {
    let curvatures = geometry.curvatures(&Unobserved).unwrap();
    let d = geometry.dimension();
    for query in (0..geometry.n_queries()).filter(|&query| !geometry.is_degenerate()[query]) {
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
                // The gradient vanishes at the maximum of u, and no surface passes there.
                assert_eq!(
                    geometry(&factor, &point).1.is_degenerate(),
                    [true],
                    "{family:?} in dimension {d}"
                );
                // Around it the level surfaces are spheres: normal outwards, all curvatures 1/distance.
                let (_, sphere) = geometry(&factor, &at(0.5));
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
            assert_finite(&geometry(&factor, &points).1, &format!("{family:?} in dimension {d}"));
        }
    }
}

/// 40 points of a curve or surface patch without thickness, and the queries: the points and as many beside them.
fn flat(point: impl Fn(&mut Random) -> [f64; 3], off: [f64; 3]) -> (Cloud, Cloud) {
    let mut random = Random(11);
    let points: Vec<[f64; 3]> = (0..40).map(|_| point(&mut random)).collect();
    let beside = points.iter().map(|x| std::array::from_fn(|c| x[c] + off[c]));
    let queries: Vec<[f64; 3]> = points.iter().copied().chain(beside).collect();
    (cloud(&points), cloud(&queries))
}

/// Fits waves and the constant at three α, on a line or plane.
fn check_flat(points: &Cloud, queries: &Cloud, what: &str, check: impl Fn(&Geometry, &str)) {
    let values = waves(points);
    for family in smooth_families() {
        let length_scale = if matches!(family, Family::Wendland { .. }) { 2.0 } else { 0.6 };
        for alpha in [0.0, 1e-10, 1e-4] {
            let what = format!("{family:?} on {what}, α = {alpha}");
            let factor = factorize(points, kernel(family, length_scale), alpha);
            let u = fit(&factor, &values);
            // What Cholesky or the fallback leave, or what α does: λ_min of these clouds is far below 1e-4.
            let error = distance(&jets(&u, points)[0], &values);
            assert!(error < if alpha == 1e-4 { 0.1 } else { 1e-6 }, "{what}: {error:e}");
            let (_, geometry) = geometry(&factor, queries);
            assert_finite(&geometry, &what);
            println!(
                "{what}: rank {}, {} of {} degenerate",
                factor.rank(),
                geometry.degenerate().len(),
                queries.n_points()
            );
            check(&geometry, &what);
        }
    }
}

#[test]
fn a_cloud_on_a_plane_is_met_and_its_normals_are_right_or_flagged() {
    // u is even across the plane: its gradient there lies in the plane, and no normal is right.
    let (points, queries) = flat(|r| [r.uniform(), r.uniform(), 0.25], [0.0, 0.0, 0.05]);
    check_flat(&points, &queries, "a plane", |geometry, what| {
        let wrong = (0..40)
            .filter(|&query| !geometry.is_degenerate()[query] && geometry.normal(query)[2].abs() < 0.5)
            .count();
        println!("{what}: {wrong} wrong");
    });
}

#[test]
fn a_cloud_on_a_line_is_met_and_its_normals_are_flagged() {
    let (points, queries) = flat(
        |r| {
            let t = r.uniform();
            [t, 0.5 * t, 0.1 - t]
        },
        [0.05, -0.1, 0.0],
    );
    check_flat(&points, &queries, "a line", |geometry, what| {
        let unflagged = (0..40).filter(|&query| !geometry.is_degenerate()[query]).count();
        println!("{what}: {unflagged} not flagged");
    });
}
