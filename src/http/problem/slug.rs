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
    UnsupportedBySolver,
    UnknownCloud,
    UnknownJob,
    NotFound,
    MethodNotAllowed,
    NotAcceptable,
    UnsupportedMediaType,
    RequestTimeout,
    BodyTooLarge,
    ProblemTooLarge,
    Unauthorized,
    RateLimited,
    Overloaded,
    DeadlineExceeded,
    Internal,
}

/// What the catalogue says of a problem type.
struct Entry {
    /// The last segment of the problem's `type`.
    name: &'static str,
    status: StatusCode,
    title: &'static str,
    /// What it means and what to do, for the page behind the `type`.
    explanation: &'static str,
}

impl Slug {
    pub const ALL: [Slug; 26] = [
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
        Self::UnsupportedBySolver,
        Self::UnknownCloud,
        Self::UnknownJob,
        Self::NotFound,
        Self::MethodNotAllowed,
        Self::NotAcceptable,
        Self::UnsupportedMediaType,
        Self::RequestTimeout,
        Self::BodyTooLarge,
        Self::ProblemTooLarge,
        Self::Unauthorized,
        Self::RateLimited,
        Self::Overloaded,
        Self::DeadlineExceeded,
        Self::Internal,
    ];

    pub fn parse(text: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|slug| slug.as_str() == text)
    }

    /// The last segment of the problem's `type`.
    pub fn as_str(self) -> &'static str {
        self.entry().name
    }

    pub fn status(self) -> StatusCode {
        self.entry().status
    }

    pub fn title(self) -> &'static str {
        self.entry().title
    }

    /// What it means and what to do, for the page behind the `type`.
    pub fn explanation(self) -> &'static str {
        self.entry().explanation
    }

    /// The line of the catalogue.
    fn entry(self) -> Entry {
        match self {
            Self::MalformedRequest => Entry {
                name: "malformed-request",
                status: StatusCode::BAD_REQUEST,
                title: "The head of the request is ambiguous",
                explanation: "There is no Host or more than one, Host and target disagree, there is a Transfer-Encoding beside a \
                 Content-Length or another one than chunked, or a line does not end in CR LF. Two programs may understand \
                 such a request differently, so it is refused and the connection is closed.",
            },
            Self::MalformedJson => Entry {
                name: "malformed-json",
                status: StatusCode::BAD_REQUEST,
                title: "The body is not JSON",
                explanation: "The body ends early, has a syntax error, or holds a number that JSON or float64 does not have, such as NaN \
                 or 1e400. The detail names line and column.",
            },
            Self::MalformedBody => Entry {
                name: "malformed-body",
                status: StatusCode::BAD_REQUEST,
                title: "The body is not what its headers say",
                explanation: "The body is not safetensors, npy or PLY as its Content-Type says, cannot be decompressed as its \
                 Content-Encoding says, or ends early.",
            },
            Self::InvalidRequest => Entry {
                name: "invalid-request",
                status: StatusCode::UNPROCESSABLE_ENTITY,
                title: "The request does not have the documented form",
                explanation: "A field has the wrong type, is null, unknown, missing, or out of its range. Each entry of errors points to \
                 one. Optional fields are left out, not null.",
            },
            Self::InvalidCloud => Entry {
                name: "invalid-cloud",
                status: StatusCode::UNPROCESSABLE_ENTITY,
                title: "The points do not form a cloud",
                explanation: "A cloud has at least one point, and all its points have the same number of finite coordinates. The geometry \
                 of a hypersurface needs at least two coordinates.",
            },
            Self::DuplicatePoints => Entry {
                name: "duplicate-points",
                status: StatusCode::UNPROCESSABLE_ENTITY,
                title: "Points coincide and alpha is 0",
                explanation: "No function takes two values at one point. Set alpha above 0 to treat them as repeated observations, or set \
                 duplicates to merge to average their values. point_indices lists them.",
            },
            Self::DimensionMismatch => Entry {
                name: "dimension-mismatch",
                status: StatusCode::UNPROCESSABLE_ENTITY,
                title: "Points of different dimension",
                explanation: "Queries, normals and the cloud of the geometry have the dimension of the cloud.",
            },
            Self::LengthMismatch => Entry {
                name: "length-mismatch",
                status: StatusCode::UNPROCESSABLE_ENTITY,
                title: "One entry per point is needed",
                explanation: "values, noise_variances and normals have one entry per point of their cloud, in the order of the points.",
            },
            Self::KernelNotSmooth => Entry {
                name: "kernel-not-smooth",
                status: StatusCode::UNPROCESSABLE_ENTITY,
                title: "The kernel has no derivatives here",
                explanation: "The Laplace kernel with epsilon 0 and the Matérn kernel with nu 0.5 have a kink at every point of the cloud. \
                 Use laplace with epsilon above 0 or matern with nu of 1.5 or more, or query other places.",
            },
            Self::KernelNotPositiveDefinite => Entry {
                name: "kernel-not-positive-definite",
                status: StatusCode::UNPROCESSABLE_ENTITY,
                title: "The kernel is not positive definite in this dimension",
                explanation: "Wendland kernels are positive definite up to dimension 3. Choose another family.",
            },
            Self::NotPositiveDefinite => Entry {
                name: "not-positive-definite",
                status: StatusCode::UNPROCESSABLE_ENTITY,
                title: "The Gram matrix is not positive definite in float64",
                explanation: "The kernel is too smooth or too wide for this cloud at this alpha: no honest answer exists in float64. Set \
                 alpha to minimum_alpha or more, shorten the length_scale, or use a rougher kernel.",
            },
            Self::UnsupportedBySolver => Entry {
                name: "unsupported-by-solver",
                status: StatusCode::UNPROCESSABLE_ENTITY,
                title: "The solver does not serve what was asked for",
                explanation: "The local solver answers each query from the points nearest to it: values and their variances, and the geometry \
                 of surfaces in dimensions 2 to 4, for which it chooses kernel and noise by itself. Covariance, likelihood and matrices \
                 need the dense solver. The detail names what to leave out, or which solver to take.",
            },
            Self::UnknownCloud => Entry {
                name: "unknown-cloud",
                status: StatusCode::NOT_FOUND,
                title: "No such cloud",
                explanation: "The cloud was never posted with this key, was deleted, or was dropped as the least recently used. Post its \
                 points again: the id stays the same.",
            },
            Self::UnknownJob => Entry {
                name: "unknown-job",
                status: StatusCode::NOT_FOUND,
                title: "No such job",
                explanation: "The job was never asked for with this key, was deleted, or its result was kept as long as \
                 GRAMIAN_JOB_RESULT_SECONDS says. Ask again.",
            },
            Self::NotFound => Entry {
                name: "not-found",
                status: StatusCode::NOT_FOUND,
                title: "No such path",
                explanation: "The path is not part of the interface. /openapi.json lists every path.",
            },
            Self::MethodNotAllowed => Entry {
                name: "method-not-allowed",
                status: StatusCode::METHOD_NOT_ALLOWED,
                title: "The path does not have this method",
                explanation: "The Allow header lists the methods it has.",
            },
            Self::NotAcceptable => Entry {
                name: "not-acceptable",
                status: StatusCode::NOT_ACCEPTABLE,
                title: "No acceptable media type",
                explanation: "Answers come as application/json, those of requests that compute also as application/x-safetensors, and single \
                 matrices as application/x-npy. Add one of them, or */*, to the Accept header.",
            },
            Self::UnsupportedMediaType => Entry {
                name: "unsupported-media-type",
                status: StatusCode::UNSUPPORTED_MEDIA_TYPE,
                title: "The body has an unknown media type or encoding",
                explanation: "Send application/json or application/x-safetensors, clouds also as application/x-npy or model/ply, and say so in \
                 the Content-Type header. Content-Encoding may be gzip or zstd.",
            },
            Self::RequestTimeout => Entry {
                name: "request-timeout",
                status: StatusCode::REQUEST_TIMEOUT,
                title: "The body came too slowly",
                explanation: "A body must come at 16 KiB a second but for GRAMIAN_BODY_SECONDS. Send it again over a connection that keeps \
                 up, compress it, or send tensors instead of JSON.",
            },
            Self::BodyTooLarge => Entry {
                name: "body-too-large",
                status: StatusCode::PAYLOAD_TOO_LARGE,
                title: "The body is too large",
                explanation: "The body has more bytes than GRAMIAN_MAX_BODY_BYTES, or than the part of GRAMIAN_MEMORY_BYTES that one request \
                 may have, or the header of its tensors more than 64 KiB. Register the cloud once and refer to it by id, split \
                 the queries, and send lists of numbers as tensors.",
            },
            Self::ProblemTooLarge => Entry {
                name: "problem-too-large",
                status: StatusCode::PAYLOAD_TOO_LARGE,
                title: "The problem is too large",
                explanation: "Points, dimension, queries, the size of the answer or the memory for it are over this server's limits. limit \
                 and required are in the unit that the detail names. The dense solver takes fewer points than a cloud may have: \
                 take the one that the detail names, or thin the cloud. Split queries over several requests, which share \
                 one factorization.",
            },
            Self::Unauthorized => Entry {
                name: "unauthorized",
                status: StatusCode::UNAUTHORIZED,
                title: "No valid API key",
                explanation: "Send Authorization: Bearer <key> with one of the configured keys.",
            },
            Self::RateLimited => Entry {
                name: "rate-limited",
                status: StatusCode::TOO_MANY_REQUESTS,
                title: "Too many requests with this key",
                explanation: "The key may make so many requests a minute, or have so many under way, as the detail says. Try again after the \
                 seconds in Retry-After.",
            },
            Self::Overloaded => Entry {
                name: "overloaded",
                status: StatusCode::SERVICE_UNAVAILABLE,
                title: "The server has all it can do",
                explanation: "More requests wait for a thread than the server queues, the memory for requests is taken, all its connections \
                 are in use, or it is shutting down. Try again after the seconds in Retry-After.",
            },
            Self::DeadlineExceeded => Entry {
                name: "deadline-exceeded",
                status: StatusCode::GATEWAY_TIMEOUT,
                title: "The answer took too long",
                explanation: "The answer was not ready within GRAMIAN_DEADLINE_SECONDS and its computation was cancelled. Fewer points cost \
                 the cube, fewer queries proportionally less.",
            },
            Self::Internal => Entry {
                name: "internal",
                status: StatusCode::INTERNAL_SERVER_ERROR,
                title: "Internal error",
                explanation: "This is a bug. The request id in instance identifies it in the logs.",
            },
        }
    }
}
