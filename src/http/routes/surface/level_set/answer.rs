//! Answers with a mesh, and with what is known of its vertices.

use std::sync::Arc;

use super::plan::{LevelOfValues, LevelSetWork};
use super::{LevelSetResponse, MeshPart, VertexSupport};
use crate::http::fields::{Diagnostics, Warning, WarningCode};
use crate::http::problem::Problem;
use crate::http::serve::answers::place::Vertices;
use crate::http::serve::answers::surface::DeviationArrays;
use crate::http::serve::fitted::Fits;
use gramian_host::compute::JobObserver;
use gramian_host::wire::write::array::Array;
use gramian_host::wire::write::integers::Integers;
use gramian_host::wire::write::model::Shape;
use gramian_numerics::mesh::fields::interpolant::LevelOf;
use gramian_numerics::mesh::surface::{curvatures_of_level, mesh_of_level, mesh_of_surface};
use gramian_numerics::mesh::{Closedness, DOUBTFUL, LevelSet, Part, Support};
use gramian_numerics::model::{JetRequest, Report};
use gramian_numerics::points::cloud::Cloud;
use gramian_numerics::points::sampling::median;
use gramian_numerics::regression::sums::jets::JetOrder;
use gramian_numerics::surface::Surface;
use gramian_numerics::surface::geometry::Orientation;

/// Share of a level set that is left out as small parts, from which the surface itself may be lacking.
const MUCH_DROPPED: f64 = 0.05;

/// What was asked about the vertices of a mesh.
#[derive(Default)]
struct AtVertices {
    principal: Option<Array>,
    mean: Option<Array>,
    position_std: Option<Array>,
    deviations: Option<DeviationArrays>,
}

/// A mesh with its vertices as queries.
struct QueriedMesh {
    found: LevelSet,
    vertices: Arc<Cloud>,
    /// Share of the points with two sides. Absent for a level of values.
    closedness: Option<f64>,
}

impl QueriedMesh {
    /// Fails with `empty` if the mesh has no vertices.
    fn new(found: LevelSet, closedness: Option<f64>, empty: Problem) -> Result<Self, Problem> {
        let vertices = Cloud::new(found.mesh.vertices.clone(), found.mesh.dimension).map_err(|_| empty)?;
        Ok(Self { found, vertices: Arc::new(vertices), closedness })
    }
}

/// Meshes the surface of a cloud.
///
/// # Errors
/// Returns the refusals of the numerics as a [`Problem`]. 422 at `/step` if there is no surface.
pub fn of_surface(
    work: &LevelSetWork,
    fits: &Fits,
    observer: &JobObserver,
) -> Result<LevelSetResponse, Problem> {
    let (fitted, surface) = (fits.surface(), fits.made_surface()?);
    let made = mesh_of_surface(surface, &work.options, observer);
    let (found, closedness) = made.map_err(|error| fitted.refused(error))?;
    let empty = match surface.as_ref() {
        Surface::Local(_) => "no surface was found here; make step shorter, or bounds wider",
        Surface::Signature(_) => {
            "no surface was found here; ask for the surface local, or for a longer length scale"
        }
    };
    let meshed = QueriedMesh::new(found, Some(closedness.share), Problem::invalid_request("/step", empty))?;
    let (k, d) = (meshed.vertices.n_points(), meshed.vertices.dimension());
    let mut at = AtVertices::default();
    let mut diagnostics = fitted.diagnostics(&Report::of_surface(surface), k);
    if work.asked.has_curvatures || work.asked.geometry.has_deviations {
        let found = fits.geometry(&meshed.vertices, &work.asked.geometry, observer)?;
        if work.asked.has_curvatures {
            let curvatures = found.geometry.curvatures(observer).map_err(|error| fitted.refused(error))?;
            at.principal = Some(found.per_query(curvatures.principal, &[k, d - 1]));
            at.mean = Some(found.per_query(curvatures.mean, &[k]));
        }
        let heights = found.geometry.deviations().map(|known| known.height.clone());
        at.position_std = heights.map(|heights| found.known_per_query(heights, &[k]));
        at.deviations = found.deviations();
        diagnostics = found.diagnostics(fits);
    }
    diagnostics.warnings.extend(warning_of_closedness(closedness, work.options.is_open));
    answer(work, meshed, at, diagnostics)
}

/// Meshes a level of the function through values.
///
/// # Errors
/// Returns the refusals of the numerics as a [`Problem`]. 422 at `/level` if the function does not reach it.
pub fn of_values(
    work: &LevelSetWork,
    of: &LevelOfValues,
    fits: &Fits,
    observer: &JobObserver,
) -> Result<LevelSetResponse, Problem> {
    let LevelOfValues { values, level } = of;
    let function = fits.interpolant(values, observer)?;
    let level = level.or_else(|| median(values.list.clone())).unwrap_or_default();
    let field = LevelOf::new(&function, level, spread(&values.list));
    let made = mesh_of_level(field, &work.options, observer);
    let found = made.map_err(|error| fits.main.refused(error))?;
    let empty = format!("the function does not reach {level} near the points; choose another level");
    let meshed = QueriedMesh::new(found, None, Problem::invalid_request("/level", empty))?;
    let (k, d) = (meshed.vertices.n_points(), meshed.vertices.dimension());
    let asked = JetRequest {
        queries: &meshed.vertices,
        order: if work.asked.has_curvatures { JetOrder::Hessian } else { JetOrder::Gradient },
        has_variances: false,
        deviations: work.asked.geometry.has_deviations.then_some(JetOrder::Value),
    };
    let (found, mut diagnostics) = fits.values_at(values, asked, observer)?;
    let clamped = found.deviations.as_ref().map_or(&[][..], |deviations| &deviations.clamped);
    diagnostics.warn_of_clamping(clamped);
    let mut at = AtVertices::default();
    if work.asked.has_curvatures {
        let sign = if is_turned(work) { 1.0 } else { -1.0 };
        let (principal, mean) = curvatures_of_level(&found.jets, sign);
        at.principal = Some(Array::new(principal, &[k, d - 1]));
        at.mean = Some(Array::new(mean, &[k]));
    }
    if let Some(deviations) = found.deviations {
        // To first order, a vertex moves by the deviation of u over its slope.
        let slope = |vertex: usize| found.jets.gradient(vertex).iter().map(|g| g * g).sum::<f64>().sqrt();
        let moved = deviations.values.iter().enumerate().map(|(vertex, deviation)| deviation / slope(vertex));
        at.position_std = Some(null_unless_finite(moved.collect()));
    }
    answer(work, meshed, at, diagnostics)
}

/// Whether normals point inward, as the gradient does.
fn is_turned(work: &LevelSetWork) -> bool {
    work.asked.geometry.orientation == Orientation::Gradient
}

/// A number per vertex, null where the function is flat and there is none.
fn null_unless_finite(data: Vec<f64>) -> Array {
    let is_null: Vec<bool> = data.iter().map(|x| !x.is_finite()).collect();
    let k = data.len();
    Array::new(data, &[k]).with_nulls(0, &is_null)
}

/// The difference between the greatest and the least value, unit V.
fn spread(values: &[f64]) -> f64 {
    let (min, max) =
        values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(min, max), v| (min.min(*v), max.max(*v)));
    max - min
}

fn warning_of_closedness(closedness: Closedness, is_open: bool) -> Option<Warning> {
    if is_open || closedness.share >= DOUBTFUL {
        return None;
    }
    let detail = format!(
        "{:.1} % of the points have no clear inside and outside; there the mesh may join sheets or close holes wrongly",
        100.0 * (1.0 - closedness.share)
    );
    Some(Warning { code: WarningCode::OpenCloud, detail })
}

/// Warns of parts that were left out. Where a short kernel makes a fine curve a row of islands, they are most
/// of it.
fn warning_of_dropped(parts: &[Part], dropped: &[Part]) -> Option<Warning> {
    if dropped.is_empty() {
        return None;
    }
    let area = |parts: &[Part]| parts.iter().map(|part| part.area).sum::<f64>();
    let share = area(dropped) / (area(parts) + area(dropped));
    let advice = if share > MUCH_DROPPED {
        ", so the mesh may lack most of the surface; ask for the surface local, or for a longer length scale"
    } else {
        ""
    };
    let (n_dropped, percent) = (dropped.len(), 100.0 * share);
    let detail = format!("{n_dropped} small parts were left out, {percent:.2} % of the level set{advice}");
    Some(Warning { code: WarningCode::PartsDropped, detail })
}

/// Warns of vertices that have no points near them.
fn warning_of_support(support: &[Support]) -> Option<Warning> {
    let share =
        |of: Support| 100.0 * support.iter().filter(|s| **s == of).count() as f64 / support.len() as f64;
    let (bridged, extrapolated) = (share(Support::Bridged), share(Support::Extrapolated));
    (bridged + extrapolated > 0.0).then(|| {
        let detail = format!(
            "{bridged:.2} % of the vertices bridge holes of the cloud, and {extrapolated:.2} % lie beyond its points; support says which"
        );
        Warning { code: WarningCode::Bridged, detail }
    })
}

/// Warns of vertices that are far from all points.
fn warning_of_far(parts: &[Part]) -> Option<Warning> {
    let n_far: usize = parts.iter().map(|part| part.n_far).sum();
    (n_far > 0).then(|| {
        let n: usize = parts.iter().map(|part| part.n_vertices).sum();
        let percent = 100.0 * n_far as f64 / n as f64;
        let detail = format!(
            "vertices farther than three spacings from all points: {n_far}, {percent:.2} %; parts has their numbers"
        );
        Warning { code: WarningCode::FarVertices, detail }
    })
}

fn answer(
    work: &LevelSetWork,
    meshed: QueriedMesh,
    at: AtVertices,
    mut diagnostics: Diagnostics,
) -> Result<LevelSetResponse, Problem> {
    let LevelSet { mesh, mut normals, residuals, support, parts, dropped, quality } = meshed.found;
    let (k, d) = (mesh.n_vertices(), mesh.dimension);
    if d == 3 && quality != work.options.quality {
        let detail = "regular triangles would have had another topology; these are raw".to_owned();
        diagnostics.warnings.push(Warning { code: WarningCode::RawMesh, detail });
    }
    diagnostics.warnings.extend(warning_of_dropped(&parts, &dropped));
    diagnostics.warnings.extend(warning_of_support(&support));
    diagnostics.warnings.extend(warning_of_far(&parts));
    let mut cells = mesh.cells;
    if is_turned(work) {
        normals.iter_mut().for_each(|c| *c = -*c);
        cells.chunks_exact_mut(d).for_each(|cell| cell.swap(0, 1));
    }
    let codes = support.iter().map(|support| VertexSupport::from(*support).code()).collect();
    let shape = Shape {
        positions: Arc::new(Vertices(meshed.vertices)),
        cells: cells.clone(),
        labels: vec![("support", codes)],
    };
    let [normal, principal, mean] = match at.deviations {
        None => [None, None, None],
        Some(found) if work.asked.has_curvatures => {
            [Some(found.normal), Some(found.principal), Some(found.mean)]
        }
        Some(found) => [Some(found.normal), None, None],
    };
    Ok(LevelSetResponse {
        vertices: Array::new(mesh.vertices, &[k, d]),
        cells: Integers::rows(cells.into_iter().map(i64::from).collect(), d),
        normals: Array::new(normals, &[k, d]),
        support: support.into_iter().map(VertexSupport::from).collect(),
        residuals: null_unless_finite(residuals),
        principal_curvatures: at.principal,
        mean_curvatures: at.mean,
        position_std: at.position_std,
        normal_std: normal,
        principal_curvature_std: principal,
        mean_curvature_std: mean,
        parts: parts.into_iter().map(MeshPart::from).collect(),
        dropped_parts: dropped.into_iter().map(MeshPart::from).collect(),
        closedness: meshed.closedness,
        diagnostics,
        shape,
    })
}

impl From<Support> for VertexSupport {
    fn from(support: Support) -> Self {
        match support {
            Support::Observed => Self::Observed,
            Support::Bridged => Self::Bridged,
            Support::Extrapolated => Self::Extrapolated,
        }
    }
}

impl From<Part> for MeshPart {
    fn from(part: Part) -> Self {
        let Part { n_vertices, n_cells, euler_characteristic, n_boundary_edges, area, n_far } = part;
        Self { n_vertices, n_cells, euler_characteristic, n_boundary_edges, area, n_far_vertices: n_far }
    }
}
