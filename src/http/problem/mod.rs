//! What clients are told about errors of the numerics: one match from causes to problem documents.

pub mod catalogue;

use serde::Serialize;
use utoipa::ToSchema;

use gramian_host::problem::slug::Slug;
pub use gramian_host::problem::{FieldError, Problem};
use gramian_numerics::error::{NotDefinite, NumericsError};

/// All types of problems that the service answers with: those of the form of a request, of its subject, and
/// all others.
pub fn all() -> Vec<Slug> {
    let general = gramian_host::problem::catalogue::ALL;
    let n_of_form = general.iter().take_while(|slug| **slug != catalogue::UNKNOWN_JOB).count();
    let (of_form, others) = general.split_at(n_of_form);
    [of_form, &catalogue::ALL, others].concat()
}

/// Members of problem documents that this service adds.
#[derive(Debug, Default, Serialize, ToSchema)]
pub struct FurtherMembers {
    /// An alpha for which the computation succeeds, unit of the values squared.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub minimum_alpha: Option<f64>,
    /// The points in question, as positions in the cloud. At most the first 1,000.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    #[schema(required = false)]
    pub point_indices: Vec<usize>,
}

/// Finds a type of problem by the last segment of its `type`.
pub fn named(name: &str) -> Option<Slug> {
    all().into_iter().find(|slug| slug.as_str() == name)
}

/// Most points listed in `point_indices`: bounded, but enough to see the pattern.
const MAX_POINT_INDICES: usize = 1000;

/// Seconds to wait after an allocation failed. Factorizations in progress have ended by then.
const RETRY_AFTER_MEMORY_SECONDS: u64 = 60;

/// Pointers to the parts of a fit in the request. Parts that `surface` leaves out are elsewhere in the
/// request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Pointers {
    /// The points of the cloud, or its id.
    pub points: &'static str,
    pub kernel: &'static str,
    /// `alpha` or `noise_variances`.
    pub regularization: &'static str,
    /// The queries, or the points that serve as queries.
    pub queries: &'static str,
    /// The model of the surface.
    pub surface_model: &'static str,
}

impl Pointers {
    /// Pointers to the fields of the request itself, with the cloud given as points.
    pub const REQUEST: Pointers = Pointers {
        points: "/cloud/points",
        kernel: "/kernel",
        regularization: "/alpha",
        queries: "/queries",
        surface_model: "/surface_model",
    };

    /// Pointer to an entry of a list. A cloud given by id has no entries, so its pointer stays as it is.
    fn entry(list: &str, index: usize) -> String {
        if list.ends_with("/id") { list.to_owned() } else { format!("{list}/{index}") }
    }
}

/// 422 for a list with another number of entries than the cloud has points.
pub fn length_mismatch(pointer: impl Into<String>, expected: usize, found: usize) -> Problem {
    let detail = format!("expected {expected} entries, one per point of the cloud, found {found}");
    Problem::of_field(catalogue::LENGTH_MISMATCH, pointer, detail)
}

/// 422 for points of another dimension than the cloud has.
pub fn dimension_mismatch(pointer: impl Into<String>, expected: usize, found: usize) -> Problem {
    let detail = format!("expected points of dimension {expected}, as in the cloud, found {found}");
    Problem::of_field(catalogue::DIMENSION_MISMATCH, pointer, detail)
}

/// Converts an error of the numerics to a problem with type, pointer and remedy.
pub fn from_numerics(error: NumericsError, pointers: Pointers) -> Problem {
    use NumericsError as E;
    use catalogue::{
        DEADLINE_EXCEEDED, DIMENSION_MISMATCH, INVALID_CLOUD, INVALID_REQUEST, KERNEL_NOT_POSITIVE_DEFINITE,
        KERNEL_NOT_SMOOTH, LENGTH_MISMATCH, NOT_CONVERGED, OVERLOADED, UNSUPPORTED_BY_SOLVER,
    };
    let detail = error.to_string();
    let at = |slug, pointer: &str| Problem::of_field(slug, pointer, detail.clone());
    match error {
        E::EmptyCloud | E::ZeroDimension | E::DimensionTooSmall { .. } => at(INVALID_CLOUD, pointers.points),
        E::RaggedPoints { point, .. } => at(INVALID_CLOUD, &Pointers::entry(pointers.points, point)),
        E::NonFiniteCoordinate { point, coordinate } | E::CoordinateTooLarge { point, coordinate } => {
            at(INVALID_CLOUD, &format!("{}/{coordinate}", Pointers::entry(pointers.points, point)))
        }
        E::DimensionMismatch { .. } => at(DIMENSION_MISMATCH, pointers.queries),
        E::LengthMismatch { .. } => at(LENGTH_MISMATCH, "/values"),
        E::InvalidKernelParameter { parameter, .. } => {
            at(INVALID_REQUEST, &format!("{}/{parameter}", pointers.kernel))
        }
        E::InvalidLengthScale { axis, .. } => {
            let list = format!("{}/length_scales", pointers.kernel);
            at(INVALID_REQUEST, &Pointers::entry(&list, axis))
        }
        E::InvalidRegularization { point: None, .. } => at(INVALID_REQUEST, pointers.regularization),
        E::InvalidRegularization { point: Some(point), .. } => {
            at(INVALID_REQUEST, &Pointers::entry(pointers.regularization, point))
        }
        E::InvalidTile { tile, .. } => at(INVALID_REQUEST, &Pointers::entry("/tiles", tile)),
        E::InvalidRegion { tile, region, .. } => {
            at(INVALID_REQUEST, &format!("/tiles/{tile}/regions/{region}"))
        }
        E::InvalidLink { link } => at(INVALID_REQUEST, &Pointers::entry("/links", link)),
        E::InvalidVariation { entry, .. } => at(INVALID_REQUEST, &Pointers::entry("/vary", entry)),
        E::KernelNotPositiveDefinite { .. } => {
            let remedy = format!("{detail}; choose another family");
            Problem::of_field(KERNEL_NOT_POSITIVE_DEFINITE, format!("{}/family", pointers.kernel), remedy)
        }
        E::KernelNotSmooth { query, .. } => {
            let remedy = format!(
                "{detail}; use laplace with epsilon > 0 or matern with nu of 1.5 or more, query elsewhere, or take the surface \
                 model offset, which needs no gradient"
            );
            Problem::of_field(KERNEL_NOT_SMOOTH, Pointers::entry(pointers.queries, query), remedy)
        }
        E::DerivativesVary { .. } => {
            let remedy = format!("{detail}; use matern with nu of 2.5 or more, or another smooth kernel");
            Problem::of_field(KERNEL_NOT_SMOOTH, format!("{}/family", pointers.kernel), remedy)
        }
        E::DuplicatePoints { points } => duplicates(points, &detail, pointers),
        E::NotPositiveDefinite { reason, minimum_alpha } => {
            not_positive_definite(reason, minimum_alpha, &detail, pointers)
        }
        E::OpenSurface { .. } => at(INVALID_REQUEST, "/open"),
        E::UnsupportedMesh { .. } => at(INVALID_REQUEST, "/surface_model"),
        E::TooManyNodes { .. } => at(INVALID_REQUEST, "/step"),
        E::Unsupported { .. } => at(UNSUPPORTED_BY_SOLVER, "/solver"),
        E::RankTooLarge { .. } => {
            let remedy = "take a smoother kernel or a longer length scale, set a larger alpha, or set \"solver\" to \
                          \"iterative\", \"dense\" or \"local\"";
            at(UNSUPPORTED_BY_SOLVER, "/solver").with_remedy(remedy)
        }
        E::NotConverged { .. } => {
            let remedy = "set a larger tolerance or alpha, take a rougher kernel or a shorter length scale, or set \
                          \"solver\" to \"landmark\" or \"dense\"";
            at(NOT_CONVERGED, "/tolerance").with_remedy(remedy)
        }
        E::Overflow { .. } => {
            Problem::new(INVALID_REQUEST, format!("{detail}; scale the values or the length scale"))
        }
        E::OutOfMemory { .. } => {
            let problem = Problem::new(OVERLOADED, format!("{detail}; try again when less is computed"));
            problem.retry_after(RETRY_AFTER_MEMORY_SECONDS)
        }
        E::MeanNotDetermined => at(INVALID_REQUEST, "/mean"),
        E::WeightsOverflow => at(INVALID_REQUEST, "/values"),
        // The client that cancelled is gone and reads no answer. The deadline has an answer of its own.
        E::Cancelled => Problem::new(DEADLINE_EXCEEDED, detail),
    }
}

/// The refusal of a matrix without a factor, with the alpha that would be enough.
fn not_positive_definite(
    reason: NotDefinite,
    minimum_alpha: f64,
    detail: &str,
    pointers: Pointers,
) -> Problem {
    // Rounded up, so that the remedy works when it is typed in.
    let enough = 1.01 * minimum_alpha;
    let remedy = format!("{detail}; set alpha to {enough:.2e} or more, or use a rougher kernel");
    let further = FurtherMembers {
        minimum_alpha: Some(minimum_alpha).filter(|alpha| alpha.is_finite()),
        point_indices: match reason {
            NotDefinite::NeedsCholesky { point } => vec![point],
            _ => Vec::new(),
        },
    };
    Problem::of_field(catalogue::NOT_POSITIVE_DEFINITE, pointers.regularization, remedy)
        .with_members(&further)
}

fn duplicates(points: Vec<usize>, detail: &str, pointers: Pointers) -> Problem {
    let remedy = format!(
        "{detail}; set alpha (or their noise_variances) above 0, or alpha to 0 and \"duplicates\" to \"merge\" to \
         average their values"
    );
    let fields = points.iter().take(10).map(|&point| FieldError {
        pointer: Pointers::entry(pointers.points, point),
        detail: "coincides with another point".to_owned(),
    });
    // A cloud given by its id has one pointer for all its points.
    let problem = Problem::new(catalogue::DUPLICATE_POINTS, remedy).with_fields(fields);
    let point_indices = points.into_iter().take(MAX_POINT_INDICES).collect();
    problem.with_members(&FurtherMembers { minimum_alpha: None, point_indices })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pointers_lead_into_the_fit_that_failed() {
        let error = NumericsError::RaggedPoints { point: 17, expected: 3, found: 2 };
        let problem = from_numerics(error.clone(), Pointers::REQUEST);
        assert_eq!(problem.fields()[0].pointer, "/cloud/points/17");
        let elsewhere = Pointers { points: "/surface/cloud/points", ..Pointers::REQUEST };
        let problem = from_numerics(error.clone(), elsewhere);
        assert_eq!(problem.fields()[0].pointer, "/surface/cloud/points/17");
        let by_id = Pointers { points: "/cloud/id", ..Pointers::REQUEST };
        assert_eq!(from_numerics(error, by_id).fields()[0].pointer, "/cloud/id");
    }
}
