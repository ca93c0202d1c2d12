//! RFC 9457 problem documents: every answer with status 400 or above.

pub mod slug;

use axum::http::{HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use serde::Serialize;
use utoipa::ToSchema;

use gramian_numerics::error::{NotDefinite, NumericsError};
use slug::Slug;

/// Most points listed in `point_indices`: bounded, but enough to see the pattern.
const MAX_POINT_INDICES: usize = 1000;

/// Seconds to wait after an allocation failed. Factorizations in progress have ended by then.
const RETRY_AFTER_MEMORY_SECONDS: u64 = 60;

/// A refusal or failure: its type, what happened where, and the remedy.
#[derive(Debug, Clone)]
pub struct Problem {
    slug: Slug,
    detail: String,
    /// Boxed, because every fallible function can return a problem, and few problems have these members.
    members: Box<Members>,
}

/// Members that only some problems have.
#[derive(Debug, Clone, Default)]
struct Members {
    errors: Vec<FieldError>,
    minimum_alpha: Option<f64>,
    point_indices: Vec<usize>,
    limit: Option<u64>,
    required: Option<u64>,
    retry_after_seconds: Option<u64>,
}

/// A field of the request that was refused.
#[derive(Debug, Clone, Serialize, ToSchema)]
pub struct FieldError {
    /// RFC 6901 pointer into the request body, such as `/cloud/points/17/2`. For query parameters, `/<name>`.
    #[schema(example = "/cloud/points/17/2")]
    pub pointer: String,
    /// The reason why the field was refused.
    #[schema(example = "expected a number, found null")]
    pub detail: String,
}

/// A problem document (RFC 9457, `application/problem+json`).
#[derive(Serialize, ToSchema)]
#[schema(as = Problem)]
pub struct ProblemDocument<'a> {
    /// The type of problem: `/problems/<slug>`, which is also served as a page.
    #[schema(format = "uri-reference", example = "/problems/invalid-request")]
    r#type: String,
    /// The type of problem in words, the same for every occurrence.
    title: &'a str,
    /// The HTTP status code of the response.
    #[schema(example = 422)]
    status: u16,
    /// The specifics of this occurrence: what happened, where, and the remedy if there is one.
    detail: &'a str,
    /// The id of the request, as in `X-Request-Id`.
    instance: &'a str,
    /// The fields that were refused.
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    #[schema(required = false)]
    errors: &'a [FieldError],
    /// An alpha for which the computation succeeds, unit of the values squared.
    #[serde(skip_serializing_if = "Option::is_none")]
    minimum_alpha: Option<f64>,
    /// The points in question, as positions in the cloud. At most the first 1,000.
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    #[schema(required = false)]
    point_indices: &'a [usize],
    /// The limit that was exceeded, in the unit that `detail` names.
    #[serde(skip_serializing_if = "Option::is_none")]
    limit: Option<u64>,
    /// The size that the request would have needed, in the unit of `limit`.
    #[serde(skip_serializing_if = "Option::is_none")]
    required: Option<u64>,
}

/// Pointers to the parts of a fit in the request. Parts that `geometry` leaves out are elsewhere in the
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
}

impl Pointers {
    /// Pointers to the fields of the request itself, with the cloud given as points.
    pub const REQUEST: Pointers = Pointers {
        points: "/cloud/points",
        kernel: "/kernel",
        regularization: "/alpha",
        queries: "/queries",
    };

    /// Pointer to an entry of a list. A cloud given by id has no entries, so its pointer stays as it is.
    fn entry(list: &str, index: usize) -> String {
        if list.ends_with("/id") { list.to_owned() } else { format!("{list}/{index}") }
    }
}

/// Seconds after which another instance has replaced one that drains.
const SECONDS_UNTIL_REPLACED: u64 = 1;

impl Problem {
    pub fn new(slug: Slug, detail: impl Into<String>) -> Self {
        Self { slug, detail: detail.into(), members: Box::default() }
    }

    /// A problem of a field. The field repeats the detail.
    pub fn of_field(slug: Slug, pointer: impl Into<String>, detail: impl Into<String>) -> Self {
        Self::new(slug, detail).at(pointer)
    }

    pub fn invalid_request(pointer: impl Into<String>, detail: impl Into<String>) -> Self {
        Self::of_field(Slug::InvalidRequest, pointer, detail)
    }

    pub fn length_mismatch(pointer: impl Into<String>, expected: usize, found: usize) -> Self {
        let detail = format!("expected {expected} entries, one per point of the cloud, found {found}");
        Self::of_field(Slug::LengthMismatch, pointer, detail)
    }

    pub fn dimension_mismatch(pointer: impl Into<String>, expected: usize, found: usize) -> Self {
        let detail = format!("expected points of dimension {expected}, as in the cloud, found {found}");
        Self::of_field(Slug::DimensionMismatch, pointer, detail)
    }

    /// A problem that states the limit that was exceeded.
    pub fn beyond(slug: Slug, limit: usize, detail: impl Into<String>) -> Self {
        let mut problem = Self::new(slug, detail);
        problem.members.limit = Some(limit as u64);
        problem
    }

    /// 404 for a path that does not exist.
    pub fn not_found() -> Self {
        Self::new(Slug::NotFound, "no such path; /openapi.json lists every path")
    }

    /// 413 for a request whose size in `what` exceeds a limit.
    pub fn too_large(slug: Slug, what: &str, limit: usize, required: Option<usize>) -> Self {
        let needed = required.map(|n| format!(", this request has {n}")).unwrap_or_default();
        let mut problem = Self::beyond(slug, limit, format!("at most {limit} {what} are served{needed}"));
        problem.members.required = required.map(|n| n as u64);
        problem
    }

    /// 503 if no place, memory or thread is free.
    pub fn overloaded(retry_after_seconds: u64) -> Self {
        Self::unavailable("the server is at its limit of simultaneous requests", retry_after_seconds)
    }

    /// 429 beyond a limit of the key.
    pub fn rate_limited(limit: &str, retry_after_seconds: u64) -> Self {
        let detail = format!("this key may make {limit}; try again in {retry_after_seconds} s");
        Self::new(Slug::RateLimited, detail).retry_after(retry_after_seconds)
    }

    /// 503 for another reason than a full queue.
    pub fn unavailable(reason: &str, retry_after_seconds: u64) -> Self {
        let detail = format!("{reason}; try again in {retry_after_seconds} s");
        Self::new(Slug::Overloaded, detail).retry_after(retry_after_seconds)
    }

    fn retry_after(mut self, seconds: u64) -> Self {
        self.members.retry_after_seconds = Some(seconds);
        self
    }

    /// 503 of a process that is shutting down.
    pub fn draining() -> Self {
        Self::unavailable("the server is shutting down", SECONDS_UNTIL_REPLACED)
    }

    /// 500 that reveals nothing internal: the log has the cause under the request id.
    pub fn internal() -> Self {
        Self::new(Slug::Internal, "an internal error occurred; the request id identifies it in the logs")
    }

    /// Appends a remedy to the detail, and to the fields that repeat the detail.
    pub fn with_remedy(mut self, remedy: &str) -> Self {
        let detail = format!("{}; {remedy}", self.detail);
        let repeating = self.members.errors.iter_mut().filter(|error| error.detail == self.detail);
        repeating.for_each(|error| error.detail.clone_from(&detail));
        self.detail = detail;
        self
    }

    /// Adds a field with the detail of this problem.
    pub fn at(mut self, pointer: impl Into<String>) -> Self {
        self.members.errors.push(FieldError { pointer: pointer.into(), detail: self.detail.clone() });
        self
    }

    pub fn slug(&self) -> Slug {
        self.slug
    }

    /// Converts an error of the numerics to a problem with type, pointer and remedy.
    pub fn from_numerics(error: NumericsError, pointers: Pointers) -> Self {
        use NumericsError as E;
        let detail = error.to_string();
        let at = |slug, pointer: &str| Self::of_field(slug, pointer, detail.clone());
        match error {
            E::EmptyCloud | E::ZeroDimension | E::DimensionTooSmall { .. } => {
                at(Slug::InvalidCloud, pointers.points)
            }
            E::RaggedPoints { point, .. } => at(Slug::InvalidCloud, &Pointers::entry(pointers.points, point)),
            E::NonFiniteCoordinate { point, coordinate } | E::CoordinateTooLarge { point, coordinate } => {
                at(Slug::InvalidCloud, &format!("{}/{coordinate}", Pointers::entry(pointers.points, point)))
            }
            E::DimensionMismatch { .. } => at(Slug::DimensionMismatch, pointers.queries),
            E::LengthMismatch { .. } => at(Slug::LengthMismatch, "/values"),
            E::InvalidKernelParameter { parameter, .. } => {
                at(Slug::InvalidRequest, &format!("{}/{parameter}", pointers.kernel))
            }
            E::InvalidLengthScale { axis, .. } => {
                let list = format!("{}/length_scales", pointers.kernel);
                at(Slug::InvalidRequest, &Pointers::entry(&list, axis))
            }
            E::InvalidRegularization { point: None, .. } => at(Slug::InvalidRequest, pointers.regularization),
            E::InvalidRegularization { point: Some(point), .. } => {
                at(Slug::InvalidRequest, &Pointers::entry(pointers.regularization, point))
            }
            E::InvalidTile { tile, .. } => at(Slug::InvalidRequest, &Pointers::entry("/tiles", tile)),
            E::InvalidRegion { tile, region, .. } => {
                at(Slug::InvalidRequest, &format!("/tiles/{tile}/regions/{region}"))
            }
            E::InvalidLink { link } => at(Slug::InvalidRequest, &Pointers::entry("/links", link)),
            E::InvalidVariation { entry, .. } => at(Slug::InvalidRequest, &Pointers::entry("/vary", entry)),
            E::KernelNotPositiveDefinite { .. } => {
                let remedy = format!("{detail}; choose another family");
                Self::of_field(Slug::KernelNotPositiveDefinite, format!("{}/family", pointers.kernel), remedy)
            }
            E::KernelNotSmooth { query, .. } => {
                let remedy = format!(
                    "{detail}; use laplace with epsilon > 0 or matern with nu of 1.5 or more, query elsewhere, or ask for the \
                     geometry of surface offset, which needs no gradient"
                );
                Self::of_field(Slug::KernelNotSmooth, Pointers::entry(pointers.queries, query), remedy)
            }
            E::DerivativesVary { .. } => {
                let remedy = format!("{detail}; use matern with nu of 2.5 or more, or another smooth kernel");
                Self::of_field(Slug::KernelNotSmooth, format!("{}/family", pointers.kernel), remedy)
            }
            E::DuplicatePoints { points } => Self::duplicates(points, &detail, pointers),
            E::NotPositiveDefinite { reason, minimum_alpha } => {
                Self::not_positive_definite(reason, minimum_alpha, &detail, pointers)
            }
            E::OpenSurface { .. } => at(Slug::InvalidRequest, "/open"),
            E::TooManyNodes { .. } => at(Slug::InvalidRequest, "/step"),
            E::Unsupported { .. } => at(Slug::UnsupportedBySolver, "/solver"),
            E::RankTooLarge { .. } => {
                let remedy = "take a smoother kernel or a longer length scale, set a larger alpha, or set \"solver\" to \
                              \"iterative\", \"dense\" or \"local\"";
                at(Slug::UnsupportedBySolver, "/solver").with_remedy(remedy)
            }
            E::NotConverged { .. } => {
                let remedy = "set a larger tolerance or alpha, take a rougher kernel or a shorter length scale, or set \
                              \"solver\" to \"landmark\" or \"dense\"";
                at(Slug::NotConverged, "/tolerance").with_remedy(remedy)
            }
            E::Overflow { .. } => {
                Self::new(Slug::InvalidRequest, format!("{detail}; scale the values or the length scale"))
            }
            E::OutOfMemory { .. } => {
                let problem =
                    Self::new(Slug::Overloaded, format!("{detail}; try again when less is computed"));
                problem.retry_after(RETRY_AFTER_MEMORY_SECONDS)
            }
            E::MeanNotDetermined => at(Slug::InvalidRequest, "/mean"),
            E::WeightsOverflow => at(Slug::InvalidRequest, "/values"),
            // The client that cancelled is gone and reads no answer. The deadline has an answer of its own.
            E::Cancelled => Self::new(Slug::DeadlineExceeded, detail),
        }
    }

    /// The refusal of a matrix without a factor, with the alpha that would be enough.
    fn not_positive_definite(
        reason: NotDefinite,
        minimum_alpha: f64,
        detail: &str,
        pointers: Pointers,
    ) -> Self {
        // Rounded up, so that the remedy works when it is typed in.
        let enough = 1.01 * minimum_alpha;
        let remedy = format!("{detail}; set alpha to {enough:.2e} or more, or use a rougher kernel");
        let mut problem = Self::of_field(Slug::NotPositiveDefinite, pointers.regularization, remedy);
        problem.members.minimum_alpha = Some(minimum_alpha).filter(|alpha| alpha.is_finite());
        if let NotDefinite::NeedsCholesky { point } = reason {
            problem.members.point_indices = vec![point];
        }
        problem
    }

    fn duplicates(points: Vec<usize>, detail: &str, pointers: Pointers) -> Self {
        let remedy = format!(
            "{detail}; set alpha (or their noise_variances) above 0, or alpha to 0 and \"duplicates\" to \"merge\" to \
             average their values"
        );
        let mut problem = Self::new(Slug::DuplicatePoints, remedy);
        for point in points.iter().take(10) {
            let pointer = Pointers::entry(pointers.points, *point);
            let detail = "coincides with another point".to_owned();
            problem.members.errors.push(FieldError { pointer, detail });
        }
        // A cloud given by its id has one pointer for all its points.
        problem.members.errors.dedup_by(|a, b| a.pointer == b.pointer);
        problem.members.point_indices = points.into_iter().take(MAX_POINT_INDICES).collect();
        problem
    }

    /// Returns the problem document for a request.
    pub fn document<'a>(&'a self, request_id: &'a str) -> ProblemDocument<'a> {
        ProblemDocument {
            r#type: format!("/problems/{}", self.slug.as_str()),
            title: self.slug.title(),
            status: self.slug.status().as_u16(),
            detail: &self.detail,
            instance: request_id,
            errors: &self.members.errors,
            minimum_alpha: self.members.minimum_alpha,
            point_indices: &self.members.point_indices,
            limit: self.members.limit,
            required: self.members.required,
        }
    }

    /// Returns the full response, once the id of the request is known.
    pub fn to_response(&self, request_id: &str) -> Response {
        let body = serde_json::to_vec(&self.document(request_id)).unwrap_or_default();
        let mut response = (self.slug.status(), body).into_response();
        let headers = response.headers_mut();
        headers.insert(header::CONTENT_TYPE, HeaderValue::from_static("application/problem+json"));
        if let Some(seconds) = self.members.retry_after_seconds {
            headers.insert(header::RETRY_AFTER, seconds.into());
        }
        if self.slug.status() == StatusCode::UNAUTHORIZED {
            headers.insert(header::WWW_AUTHENTICATE, HeaderValue::from_static("Bearer"));
        }
        response
    }
}

impl IntoResponse for Problem {
    /// Returns an empty response that carries the problem. The middleware writes the document, because it
    /// knows the request id.
    fn into_response(self) -> Response {
        let mut response = self.slug.status().into_response();
        response.extensions_mut().insert(self);
        response
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pointers_lead_into_the_fit_that_failed() {
        let error = NumericsError::RaggedPoints { point: 17, expected: 3, found: 2 };
        let problem = Problem::from_numerics(error.clone(), Pointers::REQUEST);
        assert_eq!(problem.members.errors[0].pointer, "/cloud/points/17");
        let elsewhere = Pointers { points: "/geometry/cloud/points", ..Pointers::REQUEST };
        let problem = Problem::from_numerics(error.clone(), elsewhere);
        assert_eq!(problem.members.errors[0].pointer, "/geometry/cloud/points/17");
        let by_id = Pointers { points: "/cloud/id", ..Pointers::REQUEST };
        assert_eq!(Problem::from_numerics(error, by_id).members.errors[0].pointer, "/cloud/id");
    }

    #[test]
    fn absent_members_are_left_out_of_the_document() {
        let document = serde_json::to_value(Problem::internal().document("id-1")).unwrap();
        let members: Vec<&String> = document.as_object().unwrap().keys().collect();
        assert_eq!(members, ["type", "title", "status", "detail", "instance"]);
    }
}
