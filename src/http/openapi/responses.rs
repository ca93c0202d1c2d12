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
use crate::http::problem::slug::Slug;

/// Declares a set of problems.
macro_rules! problem_set {
    ($(#[$meta:meta])* $name:ident: $($slug:ident),* $(,)?) => {
        $(#[$meta])*
        pub struct $name;

        impl IntoResponses for $name {
            fn responses() -> BTreeMap<String, RefOr<Response>> {
                responses_of(&[$(Slug::$slug),*])
            }
        }
    };
}

problem_set! {
    /// Problems of operations that compute.
    ComputeProblems:
    MalformedRequest, MalformedJson, MalformedBody, Unauthorized, RateLimited, UnknownCloud, NotAcceptable, RequestTimeout, BodyTooLarge,
    ProblemTooLarge,
    UnsupportedMediaType, InvalidRequest, InvalidCloud, DuplicatePoints, DimensionMismatch, LengthMismatch,
    KernelNotSmooth, KernelNotPositiveDefinite, NotPositiveDefinite, NotConverged, UnsupportedBySolver, Internal, Overloaded,
    DeadlineExceeded
}

problem_set! {
    /// Problems of the registration of a cloud.
    RegisterProblems:
    MalformedRequest, MalformedJson, MalformedBody, Unauthorized, RateLimited, NotAcceptable, RequestTimeout, BodyTooLarge, ProblemTooLarge,
    UnsupportedMediaType,
    InvalidRequest, InvalidCloud, DimensionMismatch, LengthMismatch, Internal, Overloaded, DeadlineExceeded
}

problem_set! {
    /// Problems of the description of a cloud. A path that is not UTF-8 is not found.
    DescribeProblems: MalformedRequest, Unauthorized, RateLimited, UnknownCloud, NotFound, NotAcceptable, Internal, Overloaded, DeadlineExceeded
}

problem_set! {
    /// Problems of operations that only look a cloud up and answer without a body.
    LookUpProblems: MalformedRequest, Unauthorized, RateLimited, UnknownCloud, NotFound, Internal, Overloaded
}

problem_set! {
    /// Problems of operations that describe a job.
    JobProblems: MalformedRequest, Unauthorized, RateLimited, UnknownJob, NotFound, NotAcceptable, Internal, Overloaded, DeadlineExceeded
}

problem_set! {
    /// Problems of operations on a job that need no media type in common.
    AnyJobProblems: MalformedRequest, Unauthorized, RateLimited, UnknownJob, NotFound, Internal, Overloaded
}

problem_set! {
    /// Problems of fetching the result of a job, which include those of the request that became the job.
    JobResultProblems:
    MalformedRequest, MalformedJson, MalformedBody, Unauthorized, RateLimited, UnknownCloud, UnknownJob, NotFound, NotAcceptable,
    BodyTooLarge, ProblemTooLarge, UnsupportedMediaType, InvalidRequest, InvalidCloud, DuplicatePoints, DimensionMismatch,
    LengthMismatch, KernelNotSmooth, KernelNotPositiveDefinite, NotPositiveDefinite, NotConverged, UnsupportedBySolver, Internal, Overloaded,
    DeadlineExceeded
}

problem_set! {
    /// Problems of the list of clouds.
    ListProblems: MalformedRequest, Unauthorized, RateLimited, NotAcceptable, InvalidRequest, Internal, Overloaded, DeadlineExceeded
}

problem_set! {
    /// Problems of operations that only read built-in information.
    ReadProblems: MalformedRequest, Unauthorized, RateLimited, NotAcceptable, Internal, Overloaded
}

problem_set! {
    /// Problems of probes and pages, which are only refused with their connection or its head.
    ProbeProblems: MalformedRequest, Internal, Overloaded
}

problem_set! {
    /// Problems of the readiness probe.
    ReadyProblems: MalformedRequest, Internal, Overloaded
}

problem_set! {
    /// Problems of the page of a problem type.
    PageProblems: MalformedRequest, NotFound, Internal, Overloaded
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
