//! Refusals that precede routing: ambiguous request heads, and requests that arrive while the server drains.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

use axum::extract::{MatchedPath, Request};
use axum::http::uri::Authority;
use axum::http::{HeaderMap, HeaderValue, Method, Version, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};

use crate::problem::Problem;
use crate::problem::catalogue;
use crate::state::host::Host;

/// A defect of an HTTP/1 message that makes it ambiguous: two programs may read it as different requests.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum HeadFault {
    /// Content-Length together with Transfer-Encoding.
    TwoFramings = 1,
    /// Several lengths, or a length that is not a number.
    Length,
    /// A Transfer-Encoding other than `chunked`, or several.
    Coding,
    /// A line that does not end in CR LF.
    LineEnd,
    /// A header folded over several lines.
    Folded,
    /// Malformed chunk framing.
    Chunks,
}

impl HeadFault {
    const ALL: [Self; 6] =
        [Self::TwoFramings, Self::Length, Self::Coding, Self::LineEnd, Self::Folded, Self::Chunks];

    /// Converts back from [`u8::from`]. 0 means no fault.
    pub fn from_code(code: u8) -> Option<Self> {
        Self::ALL.into_iter().find(|fault| u8::from(*fault) == code)
    }

    fn detail(self) -> &'static str {
        match self {
            Self::TwoFramings => "send Content-Length or Transfer-Encoding, not both",
            Self::Length => "send one Content-Length, a whole number",
            Self::Coding => "chunked is the only Transfer-Encoding",
            Self::LineEnd => "end every line of the head with CR LF",
            Self::Folded => "send every header in one line",
            Self::Chunks => "frame chunks as RFC 9112, section 7.1, describes",
        }
    }
}

impl From<HeadFault> for u8 {
    fn from(fault: HeadFault) -> Self {
        fault as Self
    }
}

/// State of a request on its connection. The server adds it to the extensions of the request.
#[derive(Debug, Clone, Default)]
pub struct Arrival {
    /// Fault found on this connection, in or near the head of this request.
    pub fault: Option<HeadFault>,
    is_read: Arc<AtomicBool>,
}

impl Arrival {
    pub fn new(fault: Option<HeadFault>) -> Self {
        Self { fault, is_read: Arc::default() }
    }

    /// Records that the body of the request has been read to its end.
    pub fn set_read(&self) {
        self.is_read.store(true, Relaxed);
    }

    pub fn is_read(&self) -> bool {
        self.is_read.load(Relaxed)
    }
}

/// Answers 400 to a head that a proxy may interpret differently, and 503 while the server drains. Otherwise
/// passes the request on.
///
/// This is not a layer of its own, because every layer costs each request a microsecond or two.
pub async fn answer(host: &Host, request: Request, next: Next) -> Response {
    let version = request.version();
    let arrival = request.extensions().get::<Arrival>();
    let fault = arrival.and_then(|arrival| arrival.fault).map(HeadFault::detail);
    if let Some(detail) = fault.or_else(|| host_fault(&request)).or_else(|| field_fault(request.headers())) {
        // The rest of this connection may be a request smuggled in by somebody else.
        return close(version, Problem::new(catalogue::MALFORMED_REQUEST, detail).into_response());
    }
    // Without this check, the CORS layer would answer OPTIONS of any path.
    if request.method() == Method::OPTIONS && request.extensions().get::<MatchedPath>().is_none() {
        return Problem::not_found().into_response();
    }
    // Probes and metrics are also answered while the server drains.
    if request.uri().path().starts_with("/health/") || request.uri().path() == "/metrics" {
        return next.run(request).await;
    }
    let arrival = arrival.filter(|arrival| !arrival.is_read()).cloned();
    tokio::select! {
        biased;
        () = is_refused(host, arrival) => {
            close(version, Problem::draining().into_response())
        }
        response = next.run(request) => response,
    }
}

/// Resolves if the server starts to drain before the body of this request has been read.
///
/// Without `arrival`, the body has already been read. Requests that are being computed continue.
async fn is_refused(host: &Host, arrival: Option<Arrival>) {
    if host.draining.is_cancelled() {
        return;
    }
    if let Some(arrival) = arrival {
        host.draining.cancelled().await;
        if !arrival.is_read() {
            return;
        }
    }
    std::future::pending().await
}

/// Returns the fault of the host name, if any.
///
/// There must be exactly one, in the target or in `Host` (RFC 9112, section 3.2). HTTP/1.0 may do without.
fn host_fault(request: &Request) -> Option<&'static str> {
    let mut hosts = request.headers().get_all(header::HOST).iter();
    let (host, second) = (hosts.next(), hosts.next());
    if second.is_some() {
        return Some("send one Host");
    }
    let target = request.uri().authority();
    // RFC 9110, section 4.2.4: text before an @ could disguise the host.
    if target.is_some_and(|target| target.as_str().contains('@')) {
        return Some("send no user in the target");
    }
    let Some(host) = host else {
        let may_be_absent = match request.version() {
            Version::HTTP_11 => false,
            Version::HTTP_2 | Version::HTTP_3 => target.is_some(),
            _ => true,
        };
        return (!may_be_absent).then_some("send a Host");
    };
    let name = host.to_str().ok().and_then(|host| host.parse::<Authority>().ok());
    let Some(name) = name.filter(|name| !name.as_str().contains('@')) else {
        return Some("send a host, and its port if there is one, as Host");
    };
    target.is_some_and(|target| *target != name).then_some("Host and the target of the request disagree")
}

/// Returns the fault of other fields, if any: two keys, of which programs may take either, or an unsupported
/// expectation.
fn field_fault(headers: &HeaderMap) -> Option<&'static str> {
    if headers.get_all(header::AUTHORIZATION).iter().nth(1).is_some() {
        return Some("send one Authorization");
    }
    let is_met = |expected: &HeaderValue| expected.as_bytes().eq_ignore_ascii_case(b"100-continue");
    let are_met = headers.get_all(header::EXPECT).iter().all(is_met);
    (!are_met).then_some("100-continue is the only expectation that is met")
}

/// Closes the connection after this answer. HTTP/2 ends its connections in another way.
fn close(version: Version, mut response: Response) -> Response {
    if version < Version::HTTP_2 {
        response.headers_mut().insert(header::CONNECTION, HeaderValue::from_static("close"));
    }
    response
}

#[cfg(test)]
mod tests {
    use super::*;
    use axum::body::Body;

    fn fault(version: Version, target: &str, hosts: &[&str]) -> Option<&'static str> {
        let mut request = axum::http::Request::builder().version(version).uri(target);
        for host in hosts {
            request = request.header(header::HOST, *host);
        }
        host_fault(&request.body(Body::empty()).unwrap())
    }

    #[test]
    fn there_is_one_host_and_it_agrees_with_the_target() {
        let (one, two) = (Version::HTTP_11, Version::HTTP_2);
        for (version, target, hosts) in [
            (one, "/", &["a.example:8080"][..]),
            (one, "/", &["[::1]:80"]),
            (one, "http://a.example/", &["A.example"]),
            (two, "http://a.example/", &[]),
            (two, "http://a.example/", &["a.example"]),
            (Version::HTTP_10, "/", &[]),
        ] {
            assert_eq!(fault(version, target, hosts), None, "{version:?} {target} {hosts:?}");
        }
        for (version, target, hosts) in [
            (one, "/", &[][..]),
            (one, "http://a.example/", &[]),
            (one, "/", &["a.example", "a.example"]),
            (one, "/", &[""]),
            (one, "/", &["a b"]),
            (one, "/", &["me@a.example"]),
            (one, "http://a.example/", &["b.example"]),
            (one, "http://me@a.example/", &["a.example"]),
            (two, "/", &[]),
            (two, "http://me:pw@a.example/", &[]),
            (two, "http://a.example/", &["b.example"]),
            (Version::HTTP_10, "/", &["a.example", "b.example"]),
        ] {
            assert!(fault(version, target, hosts).is_some(), "{version:?} {target} {hosts:?}");
        }
    }

    #[test]
    fn there_is_one_key_and_no_expectation_but_one() {
        let fault = |fields: &[(header::HeaderName, &'static str)]| {
            let fields = fields.iter().map(|(name, value)| (name.clone(), HeaderValue::from_static(value)));
            let mut headers = HeaderMap::new();
            fields.for_each(|(name, value)| _ = headers.append(name, value));
            field_fault(&headers)
        };
        let (key, expect) = (header::AUTHORIZATION, header::EXPECT);
        assert_eq!(fault(&[(key.clone(), "Bearer a"), (expect.clone(), "100-Continue")]), None);
        assert!(fault(&[(key.clone(), "Bearer a"), (key, "Bearer a")]).is_some());
        for expected in ["200-ok", "", "100-continue, 200-ok"] {
            assert!(fault(&[(expect.clone(), expected)]).is_some(), "{expected}");
        }
        assert!(fault(&[(expect.clone(), "100-continue"), (expect, "200-ok")]).is_some());
    }

    #[test]
    fn every_fault_has_a_code() {
        assert_eq!(HeadFault::from_code(0), None);
        for fault in HeadFault::ALL {
            assert_eq!(HeadFault::from_code(fault.into()), Some(fault));
        }
    }
}
