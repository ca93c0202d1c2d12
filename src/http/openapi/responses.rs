//! Sets of problems that operations can answer with, for the `OpenAPI` document. Handlers return [`Problem`].
//!
//! Every set includes what any request may meet: an ambiguous head, a bug, and a server that drains or has no
//! free connection.
//!
//! [`Problem`]: crate::http::problem::Problem

use std::collections::BTreeMap;

use utoipa::IntoResponses;
use utoipa::openapi::{ContentBuilder, Ref, RefOr, Response, ResponseBuilder};

use super::examples::problem_example;
use crate::http::problem::catalogue;
use gramian_host::problem::slug::Slug;

/// Declares a set of problems.
macro_rules! problem_set {
    ($(#[$meta:meta])* $name:ident: $($slug:ident),* $(,)?) => {
        $(#[$meta])*
        pub struct $name;

        impl IntoResponses for $name {
            fn responses() -> BTreeMap<String, RefOr<Response>> {
                responses_of(&[$(catalogue::$slug),*])
            }
        }
    };
}

problem_set! {
    /// Problems of operations that compute.
    ComputeProblems:
    MALFORMED_REQUEST, MALFORMED_JSON, MALFORMED_BODY, UNAUTHORIZED, RATE_LIMITED, UNKNOWN_CLOUD, NOT_ACCEPTABLE, REQUEST_TIMEOUT, BODY_TOO_LARGE,
    PROBLEM_TOO_LARGE,
    UNSUPPORTED_MEDIA_TYPE, INVALID_REQUEST, INVALID_CLOUD, DUPLICATE_POINTS, DIMENSION_MISMATCH, LENGTH_MISMATCH,
    KERNEL_NOT_SMOOTH, KERNEL_NOT_POSITIVE_DEFINITE, NOT_POSITIVE_DEFINITE, NOT_CONVERGED, UNSUPPORTED_BY_SOLVER, INTERNAL, OVERLOADED,
    DEADLINE_EXCEEDED
}

problem_set! {
    /// Problems of the registration of a cloud.
    RegisterProblems:
    MALFORMED_REQUEST, MALFORMED_JSON, MALFORMED_BODY, UNAUTHORIZED, RATE_LIMITED, NOT_ACCEPTABLE, REQUEST_TIMEOUT, BODY_TOO_LARGE, PROBLEM_TOO_LARGE,
    UNSUPPORTED_MEDIA_TYPE,
    INVALID_REQUEST, INVALID_CLOUD, DIMENSION_MISMATCH, LENGTH_MISMATCH, INTERNAL, OVERLOADED, DEADLINE_EXCEEDED
}

problem_set! {
    /// Problems of the description of a cloud. A path that is not UTF-8 is not found.
    DescribeProblems: MALFORMED_REQUEST, UNAUTHORIZED, RATE_LIMITED, UNKNOWN_CLOUD, NOT_FOUND, NOT_ACCEPTABLE, INTERNAL, OVERLOADED, DEADLINE_EXCEEDED
}

problem_set! {
    /// Problems of operations that only look a cloud up and answer without a body.
    LookUpProblems: MALFORMED_REQUEST, UNAUTHORIZED, RATE_LIMITED, UNKNOWN_CLOUD, NOT_FOUND, INTERNAL, OVERLOADED
}

problem_set! {
    /// Problems of operations that describe a job.
    JobProblems: MALFORMED_REQUEST, UNAUTHORIZED, RATE_LIMITED, UNKNOWN_JOB, NOT_FOUND, NOT_ACCEPTABLE, INTERNAL, OVERLOADED, DEADLINE_EXCEEDED
}

problem_set! {
    /// Problems of operations on a job that need no media type in common.
    AnyJobProblems: MALFORMED_REQUEST, UNAUTHORIZED, RATE_LIMITED, UNKNOWN_JOB, NOT_FOUND, INTERNAL, OVERLOADED
}

problem_set! {
    /// Problems of fetching the result of a job, which include those of the request that became the job.
    JobResultProblems:
    MALFORMED_REQUEST, MALFORMED_JSON, MALFORMED_BODY, UNAUTHORIZED, RATE_LIMITED, UNKNOWN_CLOUD, UNKNOWN_JOB, NOT_FOUND, NOT_ACCEPTABLE,
    BODY_TOO_LARGE, PROBLEM_TOO_LARGE, UNSUPPORTED_MEDIA_TYPE, INVALID_REQUEST, INVALID_CLOUD, DUPLICATE_POINTS, DIMENSION_MISMATCH,
    LENGTH_MISMATCH, KERNEL_NOT_SMOOTH, KERNEL_NOT_POSITIVE_DEFINITE, NOT_POSITIVE_DEFINITE, NOT_CONVERGED, UNSUPPORTED_BY_SOLVER, INTERNAL, OVERLOADED,
    DEADLINE_EXCEEDED
}

problem_set! {
    /// Problems of the list of clouds.
    ListProblems: MALFORMED_REQUEST, UNAUTHORIZED, RATE_LIMITED, NOT_ACCEPTABLE, INVALID_REQUEST, INTERNAL, OVERLOADED, DEADLINE_EXCEEDED
}

problem_set! {
    /// Problems of operations that only read built-in information.
    ReadProblems: MALFORMED_REQUEST, UNAUTHORIZED, RATE_LIMITED, NOT_ACCEPTABLE, INTERNAL, OVERLOADED
}

problem_set! {
    /// Problems of probes and pages, which are only refused with their connection or its head.
    ProbeProblems: MALFORMED_REQUEST, INTERNAL, OVERLOADED
}

problem_set! {
    /// Problems of the readiness probe.
    ReadyProblems: MALFORMED_REQUEST, INTERNAL, OVERLOADED
}

problem_set! {
    /// Problems of the page of a problem type.
    PageProblems: MALFORMED_REQUEST, NOT_FOUND, INTERNAL, OVERLOADED
}

/// Returns a response for each status, with its problems and an example of each.
fn responses_of(slugs: &[Slug]) -> BTreeMap<String, RefOr<Response>> {
    let mut by_status: BTreeMap<String, Vec<Slug>> = BTreeMap::new();
    for &slug in slugs {
        by_status.entry(slug.status().as_str().to_owned()).or_default().push(slug);
    }
    by_status.into_iter().map(|(status, slugs)| (status, RefOr::T(response_of(&slugs)))).collect()
}

fn response_of(slugs: &[Slug]) -> Response {
    let describe = |slug: &Slug| format!("`{}`: {}", slug.as_str(), slug.title());
    let description = slugs.iter().map(describe).collect::<Vec<_>>().join("; ");
    let examples = slugs.iter().map(|&slug| (slug.as_str(), problem_example(slug)));
    let problem = Ref::from_schema_name("Problem");
    let content = ContentBuilder::new().schema(Some(problem)).examples_from_iter(examples).build();
    ResponseBuilder::new().description(description).content("application/problem+json", content).build()
}
