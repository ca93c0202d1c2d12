//! What is refused before anybody looks at the request itself: heads that cannot be trusted, and requests that come while the
//! server drains.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

use axum::extract::{MatchedPath, Request};
use axum::http::uri::Authority;
use axum::http::{HeaderMap, HeaderValue, Method, Version, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};

use crate::http::problem::Problem;
use crate::http::problem::slug::Slug;
use crate::http::state::app::App;

/// What makes the head of an HTTP/1 request ambiguous: two programs may take it for two different requests.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum HeadFault {
    /// Content-Length and Transfer-Encoding.
    TwoFramings = 1,
    /// Several lengths, or one that is no number.
    Length,
    /// Another Transfer-Encoding than `chunked`, or several.
    Coding,
    /// A line that does not end in CR LF.
    LineEnd,
    /// A header that goes on in the next line.
    Folded,
    /// Chunks that are not framed as they should be.
    Chunks,
}

impl HeadFault {
    const ALL: [Self; 6] =
        [Self::TwoFramings, Self::Length, Self::Coding, Self::LineEnd, Self::Folded, Self::Chunks];

    /// Of [`u8::from`]; 0 is no fault.
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
            Self::Chunks => "frame chunks as RFC 9112, section 7.1, has them",
        }
    }
}

impl From<HeadFault> for u8 {
    fn from(fault: HeadFault) -> Self {
        fault as Self
    }
}

/// What the connection knows of a request; the server puts it into the extensions.
#[derive(Debug, Clone, Default)]
pub struct Arrival {
    /// On this connection, in the head of this request or near it.
    pub fault: Option<HeadFault>,
    is_read: Arc<AtomicBool>,
}

impl Arrival {
    pub fn new(fault: Option<HeadFault>) -> Self {
        Self { fault, is_read: Arc::default() }
    }

    /// The body of the request has been read to its end.
    pub fn set_read(&self) {
        self.is_read.store(true, Relaxed);
    }

    pub fn is_read(&self) -> bool {
        self.is_read.load(Relaxed)
    }
}

/// Answers 400 to a head that a proxy in front may understand differently, and 503 while the server drains, else as the service
/// does. Not a layer of its own: every layer costs each request a microsecond or two.
pub async fn answer(app: &App, request: Request, next: Next) -> Response {
    let version = request.version();
    let arrival = request.extensions().get::<Arrival>();
    let fault = arrival.and_then(|arrival| arrival.fault).map(HeadFault::detail);
    if let Some(detail) = fault.or_else(|| host_fault(&request)).or_else(|| field_fault(request.headers())) {
        // What follows on this connection may be a request that somebody else has smuggled in.
        return close(version, Problem::new(Slug::MalformedRequest, detail).into_response());
    }
    // The layer for browsers answers OPTIONS of any path.
    if request.method() == Method::OPTIONS && request.extensions().get::<MatchedPath>().is_none() {
        return Problem::not_found().into_response();
    }
    // Probes and metrics are there for whoever waits for the end.
    if request.uri().path().starts_with("/health/") || request.uri().path() == "/metrics" {
        return next.run(request).await;
    }
    let arrival = arrival.filter(|arrival| !arrival.is_read()).cloned();
    tokio::select! {
        biased;
        () = is_refused(app, arrival) => {
            close(version, Problem::draining().into_response())
        }
        response = next.run(request) => response,
    }
}

/// Resolves if the server drains before this request, whose body is still to be read if there is an `arrival`, has been read. What is
/// being computed goes on.
async fn is_refused(app: &App, arrival: Option<Arrival>) {
    if app.draining.is_cancelled() {
        return;
    }
    if let Some(arrival) = arrival {
        app.draining.cancelled().await;
        if !arrival.is_read() {
            return;
        }
    }
    std::future::pending().await
}

/// What is wrong with the name of the host: there is exactly one, in the target or in `Host` (RFC 9112, section 3.2), but for
/// HTTP/1.0, which knows none.
fn host_fault(request: &Request) -> Option<&'static str> {
    let mut hosts = request.headers().get_all(header::HOST).iter();
    let (host, second) = (hosts.next(), hosts.next());
    if second.is_some() {
        return Some("send one Host");
    }
    let target = request.uri().authority();
    // RFC 9110, section 4.2.4: what is before the @ disguises the host.
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

/// The fault of other fields, if any: two keys, of which programs may take either, or an expectation that is
/// not met.
fn field_fault(headers: &HeaderMap) -> Option<&'static str> {
    if headers.get_all(header::AUTHORIZATION).iter().nth(1).is_some() {
        return Some("send one Authorization");
    }
    let is_met = |expected: &HeaderValue| expected.as_bytes().eq_ignore_ascii_case(b"100-continue");
    let are_met = headers.get_all(header::EXPECT).iter().all(is_met);
    (!are_met).then_some("100-continue is the only expectation that is met")
}

/// Ends the connection with this answer; a connection of HTTP/2 ends otherwise.
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
