//! The problems that operations can answer, as sets for the document. Never constructed: [`Problem`] is what handlers return.
//!
//! [`Problem`]: super::problem::Problem
#![expect(dead_code, reason = "only their schemas are used")]

use utoipa::IntoResponses;

use super::problem::ProblemDocument;

/// One set of statuses with their descriptions.
macro_rules! problem_set {
    ($(#[$meta:meta])* $name:ident { $($status:literal $variant:ident $description:literal,)* }) => {
        $(#[$meta])*
        #[derive(IntoResponses)]
        pub enum $name {
            $(
                #[response(status = $status, description = $description, content_type = "application/problem+json")]
                $variant(ProblemDocument<'static>),
            )*
        }
    };
}

problem_set! {
    /// Operations with a body that compute.
    ComputeProblems {
        400 Malformed "`malformed-json` or `malformed-body`: the body is not what its headers say",
        401 Unauthorized "`unauthorized`: no valid API key",
        404 UnknownCloud "`unknown-cloud`: no cloud is registered under the id",
        406 NotAcceptable "`not-acceptable`: Accept names no media type that this operation answers with",
        413 TooLarge "`body-too-large` or `problem-too-large`: over a limit of this server",
        415 UnsupportedMediaType "`unsupported-media-type`: the body is announced as another media type or coding than this operation reads",
        422 Refused "`invalid-request`, `invalid-cloud`, `duplicate-points`, `dimension-mismatch`, `length-mismatch`, `kernel-not-smooth`, `kernel-not-positive-definite` or `not-positive-definite`: the body is readable, but cannot be answered",
        500 Internal "`internal`: a bug",
        503 Overloaded "`overloaded`: the queue is full; `Retry-After` says when to come back",
        504 DeadlineExceeded "`deadline-exceeded`: the answer took too long",
    }
}

problem_set! {
    /// Operations on one cloud.
    LookUpProblems {
        401 Unauthorized "`unauthorized`: no valid API key",
        404 UnknownCloud "`unknown-cloud`: no cloud is registered under the id",
        406 NotAcceptable "`not-acceptable`: answers come as application/json",
        500 Internal "`internal`: a bug",
        503 Overloaded "`overloaded`: the queue is full; `Retry-After` says when to come back",
        504 DeadlineExceeded "`deadline-exceeded`: the answer took too long",
    }
}

problem_set! {
    /// The list of clouds.
    ListProblems {
        401 Unauthorized "`unauthorized`: no valid API key",
        406 NotAcceptable "`not-acceptable`: answers come as application/json",
        422 Refused "`invalid-request`: a query parameter is out of its range or unknown",
        500 Internal "`internal`: a bug",
        503 Overloaded "`overloaded`: the queue is full; `Retry-After` says when to come back",
        504 DeadlineExceeded "`deadline-exceeded`: the answer took too long",
    }
}

problem_set! {
    /// Operations that only read what is built in.
    ReadProblems {
        401 Unauthorized "`unauthorized`: no valid API key",
        406 NotAcceptable "`not-acceptable`: answers come as application/json",
    }
}

problem_set! {
    /// The readiness probe.
    ReadyProblems {
        503 Overloaded "`overloaded`: the queue is full, or the server is shutting down",
    }
}

problem_set! {
    /// Pages of problems.
    ProblemPageProblems {
        404 NotFound "`not-found`: no such problem type",
    }
}
