//! The catalogue of problem types.

use axum::http::StatusCode;

/// Every kind of problem the service answers with; part of the contract, added to and never renamed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Slug {
    MalformedRequest,
    MalformedJson,
    MalformedBody,
    InvalidRequest,
    InvalidCloud,
    DuplicatePoints,
    DimensionMismatch,
    LengthMismatch,
    KernelNotSmooth,
    KernelNotPositiveDefinite,
    NotPositiveDefinite,
    UnknownCloud,
    NotFound,
    MethodNotAllowed,
    NotAcceptable,
    UnsupportedMediaType,
    RequestTimeout,
    BodyTooLarge,
    ProblemTooLarge,
    Unauthorized,
    Overloaded,
    DeadlineExceeded,
    Internal,
}

impl Slug {
    pub const ALL: [Slug; 23] = [
        Self::MalformedRequest,
        Self::MalformedJson,
        Self::MalformedBody,
        Self::InvalidRequest,
        Self::InvalidCloud,
        Self::DuplicatePoints,
        Self::DimensionMismatch,
        Self::LengthMismatch,
        Self::KernelNotSmooth,
        Self::KernelNotPositiveDefinite,
        Self::NotPositiveDefinite,
        Self::UnknownCloud,
        Self::NotFound,
        Self::MethodNotAllowed,
        Self::NotAcceptable,
        Self::UnsupportedMediaType,
        Self::RequestTimeout,
        Self::BodyTooLarge,
        Self::ProblemTooLarge,
        Self::Unauthorized,
        Self::Overloaded,
        Self::DeadlineExceeded,
        Self::Internal,
    ];

    pub fn parse(text: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|slug| slug.as_str() == text)
    }

    /// The last segment of the problem's `type`.
    pub fn as_str(self) -> &'static str {
        self.entry().0
    }

    pub fn status(self) -> StatusCode {
        self.entry().1
    }

    pub fn title(self) -> &'static str {
        self.entry().2
    }

    /// What it means and what to do, for the page behind the `type`.
    pub fn explanation(self) -> &'static str {
        self.entry().3
    }

    fn entry(self) -> (&'static str, StatusCode, &'static str, &'static str) {
        match self {
            Self::MalformedRequest => (
                "malformed-request",
                StatusCode::BAD_REQUEST,
                "The head of the request is ambiguous",
                "There is no Host or more than one, Host and target disagree, there is a Transfer-Encoding beside a \
                 Content-Length or another one than chunked, or a line does not end in CR LF. Two programs may understand \
                 such a request differently, so it is refused and the connection is closed.",
            ),
            Self::MalformedJson => (
                "malformed-json",
                StatusCode::BAD_REQUEST,
                "The body is not JSON",
                "The body ends early, has a syntax error, or holds a number that JSON or float64 does not have, such as NaN \
                 or 1e400. The detail names line and column.",
            ),
            Self::MalformedBody => (
                "malformed-body",
                StatusCode::BAD_REQUEST,
                "The body is not what its headers say",
                "The body is not safetensors or npy as its Content-Type says, cannot be decompressed as its Content-Encoding \
                 says, or ends early.",
            ),
            Self::InvalidRequest => (
                "invalid-request",
                StatusCode::UNPROCESSABLE_ENTITY,
                "The request does not have the documented form",
                "A field has the wrong type, is null, unknown, missing, or out of its range. Each entry of errors points to \
                 one. Optional fields are left out, not null.",
            ),
            Self::InvalidCloud => (
                "invalid-cloud",
                StatusCode::UNPROCESSABLE_ENTITY,
                "The points do not form a cloud",
                "A cloud has at least one point, and all its points have the same number of finite coordinates. The geometry \
                 of a hypersurface needs at least two coordinates.",
            ),
            Self::DuplicatePoints => (
                "duplicate-points",
                StatusCode::UNPROCESSABLE_ENTITY,
                "Points coincide and alpha is 0",
                "No function takes two values at one point. Set alpha above 0 to treat them as repeated observations, or set \
                 duplicates to merge to average their values. point_indices lists them.",
            ),
            Self::DimensionMismatch => (
                "dimension-mismatch",
                StatusCode::UNPROCESSABLE_ENTITY,
                "Points of different dimension",
                "Queries, normals and the cloud of the geometry have the dimension of the cloud.",
            ),
            Self::LengthMismatch => (
                "length-mismatch",
                StatusCode::UNPROCESSABLE_ENTITY,
                "One entry per point is needed",
                "values, noise_variances and normals have one entry per point of their cloud, in the order of the points.",
            ),
            Self::KernelNotSmooth => (
                "kernel-not-smooth",
                StatusCode::UNPROCESSABLE_ENTITY,
                "The kernel has no derivatives here",
                "The Laplace kernel with epsilon 0 and the Matérn kernel with nu 0.5 have a kink at every point of the cloud. \
                 Use laplace with epsilon above 0 or matern with nu of 1.5 or more, or query other places.",
            ),
            Self::KernelNotPositiveDefinite => (
                "kernel-not-positive-definite",
                StatusCode::UNPROCESSABLE_ENTITY,
                "The kernel is not positive definite in this dimension",
                "Wendland kernels are positive definite up to dimension 3. Choose another family.",
            ),
            Self::NotPositiveDefinite => (
                "not-positive-definite",
                StatusCode::UNPROCESSABLE_ENTITY,
                "The Gram matrix is not positive definite in float64",
                "The kernel is too smooth or too wide for this cloud at this alpha: no honest answer exists in float64. Set \
                 alpha to minimum_alpha or more, shorten the length_scale, or use a rougher kernel.",
            ),
            Self::UnknownCloud => (
                "unknown-cloud",
                StatusCode::NOT_FOUND,
                "No such cloud",
                "The cloud was never posted with this key, was deleted, or was dropped as the least recently used. Post its \
                 points again: the id stays the same.",
            ),
            Self::NotFound => (
                "not-found",
                StatusCode::NOT_FOUND,
                "No such path",
                "The path is not part of the interface. /openapi.json lists every path.",
            ),
            Self::MethodNotAllowed => (
                "method-not-allowed",
                StatusCode::METHOD_NOT_ALLOWED,
                "The path does not have this method",
                "The Allow header lists the methods it has.",
            ),
            Self::NotAcceptable => (
                "not-acceptable",
                StatusCode::NOT_ACCEPTABLE,
                "No acceptable media type",
                "Answers come as application/json, those of requests that compute also as application/x-safetensors, and single \
                 matrices as application/x-npy. Add one of them, or */*, to the Accept header.",
            ),
            Self::UnsupportedMediaType => (
                "unsupported-media-type",
                StatusCode::UNSUPPORTED_MEDIA_TYPE,
                "The body has an unknown media type or encoding",
                "Send application/json or application/x-safetensors, clouds also as application/x-npy, and say so in the \
                 Content-Type header. Content-Encoding may be gzip or zstd.",
            ),
            Self::RequestTimeout => (
                "request-timeout",
                StatusCode::REQUEST_TIMEOUT,
                "The body came too slowly",
                "A body must come at 16 KiB a second but for GRAMIAN_BODY_SECONDS. Send it again over a connection that keeps \
                 up, compress it, or send tensors instead of JSON.",
            ),
            Self::BodyTooLarge => (
                "body-too-large",
                StatusCode::PAYLOAD_TOO_LARGE,
                "The body is too large",
                "The body has more bytes than GRAMIAN_MAX_BODY_BYTES, or than the part of GRAMIAN_MEMORY_BYTES that one request \
                 may have, or the header of its tensors more than 64 KiB. Register the cloud once and refer to it by id, split \
                 the queries, and send lists of numbers as tensors.",
            ),
            Self::ProblemTooLarge => (
                "problem-too-large",
                StatusCode::PAYLOAD_TOO_LARGE,
                "The problem is too large",
                "Points, dimension, queries, the size of the answer or the memory for it are over this server's limits. limit \
                 and required are in the unit that the detail names. Thin the cloud or register fewer points; split queries \
                 over several requests, which share one factorization.",
            ),
            Self::Unauthorized => (
                "unauthorized",
                StatusCode::UNAUTHORIZED,
                "No valid API key",
                "Send Authorization: Bearer <key> with one of the configured keys.",
            ),
            Self::Overloaded => (
                "overloaded",
                StatusCode::SERVICE_UNAVAILABLE,
                "The server has all it can do",
                "More requests wait for a thread than the server queues, the memory for requests is taken, all its connections \
                 are in use, or it is shutting down. Try again after the seconds in Retry-After.",
            ),
            Self::DeadlineExceeded => (
                "deadline-exceeded",
                StatusCode::GATEWAY_TIMEOUT,
                "The answer took too long",
                "The answer was not ready within GRAMIAN_DEADLINE_SECONDS and its computation was cancelled. Fewer points cost \
                 the cube, fewer queries proportionally less.",
            ),
            Self::Internal => (
                "internal",
                StatusCode::INTERNAL_SERVER_ERROR,
                "Internal error",
                "This is a bug. The request id in instance identifies it in the logs.",
            ),
        }
    }
}
