//! Problems that any service over this host answers with.

use crate::catalogue;

catalogue! {
    MALFORMED_REQUEST "malformed-request" BAD_REQUEST "The head of the request is ambiguous"
        "There is no Host or more than one, Host and target disagree, there is a Transfer-Encoding beside a \
        Content-Length or another one than chunked, or a line does not end in CR LF. Two programs may understand \
        such a request differently, so it is refused and the connection is closed.";
    MALFORMED_JSON "malformed-json" BAD_REQUEST "The body is not JSON"
        "The body ends early, has a syntax error, or holds a number that JSON or float64 does not have, such as NaN \
        or 1e400. The detail names line and column.";
    MALFORMED_BODY "malformed-body" BAD_REQUEST "The body is not what its headers say"
        "The body is not safetensors, npy or PLY as its Content-Type says, cannot be decompressed as its \
        Content-Encoding says, or ends early.";
    INVALID_REQUEST "invalid-request" UNPROCESSABLE_ENTITY "The request does not have the documented form"
        "A field has the wrong type, is null, unknown, missing, or out of its range. Each entry of errors points to \
        one. Optional fields are left out, not null.";
    UNKNOWN_JOB "unknown-job" NOT_FOUND "No such job"
        "The job was never created with this key, was deleted, or its result expired after \
        GRAMIAN_JOB_RESULT_SECONDS. Send the request again.";
    NOT_FOUND "not-found" NOT_FOUND "No such path"
        "The path is not part of the interface. /openapi.json lists every path.";
    METHOD_NOT_ALLOWED "method-not-allowed" METHOD_NOT_ALLOWED "The path does not have this method"
        "The Allow header lists the methods it has.";
    NOT_ACCEPTABLE "not-acceptable" NOT_ACCEPTABLE "No acceptable media type"
        "Answers come as application/json, those of requests that compute also as application/x-safetensors, and single \
        matrices as application/x-npy. Add one of them, or */*, to the Accept header.";
    UNSUPPORTED_MEDIA_TYPE "unsupported-media-type" UNSUPPORTED_MEDIA_TYPE "The body has an unknown media type or encoding"
        "Send application/json or application/x-safetensors, clouds also as application/x-npy or model/ply, and say so in \
        the Content-Type header. Content-Encoding may be gzip or zstd.";
    REQUEST_TIMEOUT "request-timeout" REQUEST_TIMEOUT "The body came too slowly"
        "A body must arrive at 16 KiB a second or faster, apart from pauses of GRAMIAN_BODY_SECONDS in all. Send it again over a connection that keeps \
        up, compress it, or send tensors instead of JSON.";
    BODY_TOO_LARGE "body-too-large" PAYLOAD_TOO_LARGE "The body is too large"
        "The body has more bytes than GRAMIAN_MAX_BODY_BYTES, or than the part of GRAMIAN_MEMORY_BYTES that one request \
        may have, or the header of its tensors more than 64 KiB. Register the cloud once and refer to it by id, split \
        the queries, and send lists of numbers as tensors.";
    PROBLEM_TOO_LARGE "problem-too-large" PAYLOAD_TOO_LARGE "The problem is too large"
        "Points, dimension, queries, the size of the answer or the memory for it are over this server's limits. limit \
        and required are in the unit that the detail names. The dense solver takes fewer points than a cloud may have: \
        take the one that the detail names, or thin the cloud. Split queries over several requests, which share \
        one factorization.";
    UNAUTHORIZED "unauthorized" UNAUTHORIZED "No valid API key"
        "Send Authorization: Bearer <key> with one of the configured keys.";
    RATE_LIMITED "rate-limited" TOO_MANY_REQUESTS "Too many requests with this key"
        "A key has a limit of requests a minute and a limit of requests under way. The detail names the one that was \
        reached. Try again after the seconds in Retry-After.";
    OVERLOADED "overloaded" SERVICE_UNAVAILABLE "The server has all it can do"
        "More requests wait for a thread than the server queues, the memory for requests is taken, all its connections \
        are in use, or it is shutting down. Try again after the seconds in Retry-After.";
    DEADLINE_EXCEEDED "deadline-exceeded" GATEWAY_TIMEOUT "The answer took too long"
        "The answer was not ready within GRAMIAN_DEADLINE_SECONDS and its computation was cancelled. Time grows with \
        the cube of the points and in proportion to the queries: ask for fewer of either.";
    INTERNAL "internal" INTERNAL_SERVER_ERROR "Internal error"
        "This is a bug. The request id in instance identifies it in the logs.";
}
