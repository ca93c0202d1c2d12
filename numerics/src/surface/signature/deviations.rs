//! Standard deviations of the geometry of a signature function, from local regressions.

use super::SignatureSurface;
use crate::error::Result;
use crate::machine::small::Small;
use crate::machine::vector::{dot, norm};
use crate::observer::Observer;
use crate::points::cloud::Cloud;
use crate::surface::curvature::principal_curvatures;
use crate::surface::served::{Deviations, GeometryArrays};

/// Computes deviations: the root of the sum of the squares of the deviation of a local regression and of the
/// difference from it.
///
/// A global function has no deviation of its own. Where both agree, that of the regression holds for it too.
///
/// # Errors
/// Returns the errors of [`crate::patches::Patches::of`].
pub(super) fn deviations(
    surface: &SignatureSurface,
    queries: &Cloud,
    served: &GeometryArrays,
    observer: &dyn Observer,
) -> Result<Deviations> {
    let (m, d) = (queries.n_points(), queries.dimension());
    let k = d - 1;
    let are_points = surface.sampling.neighbours().hold(queries);
    let mut local = surface.patches(observer)?.at(queries, &|query| are_points[query], true, observer)?;
    let mut found = Deviations {
        is_known: vec![false; m],
        height: vec![0.0; m],
        normal: vec![0.0; m],
        principal: vec![0.0; m * k],
        mean: vec![0.0; m],
        gaussian: vec![0.0; m],
    };
    let Some(of_local) = local.curvatures.take() else { return Ok(found) };
    for query in 0..m {
        let verdict = served.verdict(query);
        if verdict.is_null() || !local.is_known[query] {
            continue;
        }
        let gradient = served.gradient(query);
        let length = norm(gradient);
        let normal: Small = gradient.iter().map(|g| verdict.sign * g / length).collect();
        let (curvatures, _) = principal_curvatures(gradient, served.hessian(query), verdict.sign);
        let other = &local.normals[query * d..][..d];
        let cosine = dot(&normal, other);
        let side = if cosine < 0.0 { -1.0 } else { 1.0 };
        let (others, _) = principal_curvatures(other, &local.shapes[query * d * d..][..d * d], side);
        let mut of_principal = Small::from_slice(&of_local.principal[query * k..][..k]);
        if side < 0.0 {
            of_principal.reverse();
        }
        let with = |deviation: f64, a: f64, b: f64| (deviation * deviation + (a - b) * (a - b)).sqrt();
        let angle = (1.0 - cosine * cosine).max(0.0).sqrt().asin();
        found.is_known[query] = true;
        found.height[query] = with(local.height_std[query], local.heights[query], 0.0);
        found.normal[query] = with(local.normal_std[query], angle, 0.0);
        for i in 0..k {
            found.principal[query * k + i] = with(of_principal[i], curvatures[i], others[i]);
        }
        let mean = |values: &Small| values.iter().sum::<f64>() / k as f64;
        let product = |values: &Small| values.iter().product::<f64>();
        found.mean[query] = with(of_local.mean[query], mean(&curvatures), mean(&others));
        found.gaussian[query] = with(of_local.gaussian[query], product(&curvatures), product(&others));
    }
    Ok(found)
}
