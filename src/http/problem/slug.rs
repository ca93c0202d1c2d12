//! The catalogue of problem types.

use axum::http::StatusCode;

/// The catalogue entry of a problem type.
struct Entry {
    /// The last segment of the problem's `type`.
    name: &'static str,
    status: StatusCode,
    title: &'static str,
    /// Meaning and remedy, for the page behind the `type`.
    explanation: &'static str,
}

/// Declares the problem types: variant, name, status, title, and explanation of each.
macro_rules! catalogue {
    ($($variant:ident $name:literal $status:ident $title:literal $explanation:literal;)*) => {
        /// Every type of problem that the service answers with. Part of the contract: types are added, never
        /// renamed.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
        pub enum Slug {
            $($variant,)*
        }

        impl Slug {
            pub const ALL: [Slug; [$($name,)*].len()] = [$(Self::$variant,)*];

            fn entry(self) -> Entry {
                match self {
                    $(Self::$variant => Entry {
                        name: $name,
                        status: StatusCode::$status,
                        title: $title,
                        explanation: $explanation,
                    },)*
                }
            }
        }
    };
}

catalogue! {
    MalformedRequest "malformed-request" BAD_REQUEST "The head of the request is ambiguous"
        "There is no Host or more than one, Host and target disagree, there is a Transfer-Encoding beside a \
        Content-Length or another one than chunked, or a line does not end in CR LF. Two programs may understand \
        such a request differently, so it is refused and the connection is closed.";
    MalformedJson "malformed-json" BAD_REQUEST "The body is not JSON"
        "The body ends early, has a syntax error, or holds a number that JSON or float64 does not have, such as NaN \
        or 1e400. The detail names line and column.";
    MalformedBody "malformed-body" BAD_REQUEST "The body is not what its headers say"
        "The body is not safetensors, npy or PLY as its Content-Type says, cannot be decompressed as its \
        Content-Encoding says, or ends early.";
    InvalidRequest "invalid-request" UNPROCESSABLE_ENTITY "The request does not have the documented form"
        "A field has the wrong type, is null, unknown, missing, or out of its range. Each entry of errors points to \
        one. Optional fields are left out, not null.";
    InvalidCloud "invalid-cloud" UNPROCESSABLE_ENTITY "The points do not form a cloud"
        "A cloud has at least one point, and all its points have the same number of finite coordinates. The geometry \
        of a hypersurface needs at least two coordinates.";
    DuplicatePoints "duplicate-points" UNPROCESSABLE_ENTITY "Points coincide and alpha is 0"
        "No function takes two values at one point. Set alpha above 0 to treat them as repeated observations, or set \
        duplicates to merge to average their values. point_indices lists them.";
    DimensionMismatch "dimension-mismatch" UNPROCESSABLE_ENTITY "Points of different dimension"
        "Queries, normals and the cloud of the geometry have the dimension of the cloud.";
    LengthMismatch "length-mismatch" UNPROCESSABLE_ENTITY "One entry per point is needed"
        "values, noise_variances and normals have one entry per point of their cloud, in the order of the points.";
    KernelNotSmooth "kernel-not-smooth" UNPROCESSABLE_ENTITY "The kernel has no derivatives here"
        "The Laplace kernel with epsilon 0 and the Matérn kernel with nu 0.5 have a kink at every point of the cloud. \
        Use laplace with epsilon above 0 or matern with nu of 1.5 or more, or query other places.";
    KernelNotPositiveDefinite "kernel-not-positive-definite" UNPROCESSABLE_ENTITY "The kernel is not positive definite in this dimension"
        "Wendland kernels are positive definite up to dimension 3. Choose another family.";
    NotPositiveDefinite "not-positive-definite" UNPROCESSABLE_ENTITY "The Gram matrix is not positive definite in float64"
        "The kernel is too smooth or too wide for this cloud at this alpha: no honest answer exists in float64. Set \
        alpha to minimum_alpha or more, shorten the length_scale, or use a rougher kernel.";
    NotConverged "not-converged" UNPROCESSABLE_ENTITY "The iteration ended above the tolerance"
        "The solver iterative found no weights whose relative residual is within the tolerance; the detail has the one \
        that it reached. Set a larger tolerance or alpha, take a rougher kernel or a shorter length_scale, or take \
        another solver.";
    UnsupportedBySolver "unsupported-by-solver" UNPROCESSABLE_ENTITY "The solver does not serve what was asked for"
        "The local solver answers each query from the points nearest to it: values and their variances, and the geometry \
        of surfaces in dimensions 2 to 4, for which it chooses kernel and noise by itself. Covariance, likelihood and matrices \
        need the dense solver, or landmarks; the iterative solver has covariances too. The detail names what to leave out, or which solver to take.";
    UnknownCloud "unknown-cloud" NOT_FOUND "No such cloud"
        "The cloud was never posted with this key, was deleted, or was dropped as the least recently used. Post its \
        points again: the id stays the same.";
    UnknownJob "unknown-job" NOT_FOUND "No such job"
        "The job was never created with this key, was deleted, or its result expired after \
        GRAMIAN_JOB_RESULT_SECONDS. Send the request again.";
    NotFound "not-found" NOT_FOUND "No such path"
        "The path is not part of the interface. /openapi.json lists every path.";
    MethodNotAllowed "method-not-allowed" METHOD_NOT_ALLOWED "The path does not have this method"
        "The Allow header lists the methods it has.";
    NotAcceptable "not-acceptable" NOT_ACCEPTABLE "No acceptable media type"
        "Answers come as application/json, those of requests that compute also as application/x-safetensors, and single \
        matrices as application/x-npy. Add one of them, or */*, to the Accept header.";
    UnsupportedMediaType "unsupported-media-type" UNSUPPORTED_MEDIA_TYPE "The body has an unknown media type or encoding"
        "Send application/json or application/x-safetensors, clouds also as application/x-npy or model/ply, and say so in \
        the Content-Type header. Content-Encoding may be gzip or zstd.";
    RequestTimeout "request-timeout" REQUEST_TIMEOUT "The body came too slowly"
        "A body must arrive at 16 KiB a second or faster, apart from pauses of GRAMIAN_BODY_SECONDS in all. Send it again over a connection that keeps \
        up, compress it, or send tensors instead of JSON.";
    BodyTooLarge "body-too-large" PAYLOAD_TOO_LARGE "The body is too large"
        "The body has more bytes than GRAMIAN_MAX_BODY_BYTES, or than the part of GRAMIAN_MEMORY_BYTES that one request \
        may have, or the header of its tensors more than 64 KiB. Register the cloud once and refer to it by id, split \
        the queries, and send lists of numbers as tensors.";
    ProblemTooLarge "problem-too-large" PAYLOAD_TOO_LARGE "The problem is too large"
        "Points, dimension, queries, the size of the answer or the memory for it are over this server's limits. limit \
        and required are in the unit that the detail names. The dense solver takes fewer points than a cloud may have: \
        take the one that the detail names, or thin the cloud. Split queries over several requests, which share \
        one factorization.";
    Unauthorized "unauthorized" UNAUTHORIZED "No valid API key"
        "Send Authorization: Bearer <key> with one of the configured keys.";
    RateLimited "rate-limited" TOO_MANY_REQUESTS "Too many requests with this key"
        "A key has a limit of requests a minute and a limit of requests under way. The detail names the one that was \
        reached. Try again after the seconds in Retry-After.";
    Overloaded "overloaded" SERVICE_UNAVAILABLE "The server has all it can do"
        "More requests wait for a thread than the server queues, the memory for requests is taken, all its connections \
        are in use, or it is shutting down. Try again after the seconds in Retry-After.";
    DeadlineExceeded "deadline-exceeded" GATEWAY_TIMEOUT "The answer took too long"
        "The answer was not ready within GRAMIAN_DEADLINE_SECONDS and its computation was cancelled. Time grows with \
        the cube of the points and in proportion to the queries: ask for fewer of either.";
    Internal "internal" INTERNAL_SERVER_ERROR "Internal error"
        "This is a bug. The request id in instance identifies it in the logs.";
}

impl Slug {
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

    /// Meaning and remedy, for the page behind the `type`.
    pub fn explanation(self) -> &'static str {
        self.entry().explanation
    }
}
