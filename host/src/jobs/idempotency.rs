//! `Idempotency-Key`: a request that a client or proxy repeats is answered with the job that it began.

use axum::http::{HeaderMap, HeaderName};

use super::look::{JobView, look};
use crate::memory::Owner;
use crate::problem::Problem;
use crate::problem::catalogue;
use crate::state::host::Host;
use crate::store::changes::unavailable;
use crate::store::jobs::{JobRequest, KeyHash, Register};

pub const IDEMPOTENCY_KEY: HeaderName = HeaderName::from_static("idempotency-key");

/// Longest key in bytes.
const MAX_KEY_BYTES: usize = 255;

/// Bytes of a body that are hashed at a time.
const PIECE: usize = 1 << 20;

/// The state of a key.
pub(super) enum KeyState {
    /// The key belongs to this job.
    Job(Box<JobView>),
    /// The key has no job. The next job claims it in this register, as it was read.
    Free(Register),
}

/// The hash of the key in the head of a request, if there is one.
///
/// # Errors
/// 422 if there are several keys, or a key is empty, too long or not visible ASCII.
pub(super) fn key_of(headers: &HeaderMap) -> Result<Option<KeyHash>, Problem> {
    let mut keys = headers.get_all(IDEMPOTENCY_KEY).iter();
    let Some(key) = keys.next() else { return Ok(None) };
    let bytes = key.as_bytes();
    let is_plain = !bytes.is_empty() && bytes.iter().all(u8::is_ascii_graphic);
    if keys.next().is_some() || !is_plain || bytes.len() > MAX_KEY_BYTES {
        let detail = format!(
            "send one Idempotency-Key of 1 to {MAX_KEY_BYTES} visible ASCII characters without spaces, such as a UUID"
        );
        return Err(Problem::new(catalogue::INVALID_REQUEST, detail));
    }
    Ok(Some(KeyHash::of(bytes)))
}

/// A hash of the path, the headers with these names and the body. Equal requests have equal fingerprints.
pub(super) async fn fingerprint(request: &JobRequest, names: &[HeaderName], body: &[u8]) -> String {
    let mut hasher = blake3::Hasher::new();
    let mut add = |bytes: &[u8]| {
        hasher.update(&(bytes.len() as u64).to_le_bytes());
        hasher.update(bytes);
    };
    add(request.path.as_bytes());
    for name in names {
        let values = request.headers.iter().filter(|(other, _)| other == name.as_str());
        add(name.as_str().as_bytes());
        values.for_each(|(_, value)| add(value.as_bytes()));
    }
    add(&[]);
    for piece in body.chunks(PIECE) {
        hasher.update(piece);
        // Hashing a body of hundreds of megabytes at once would keep other requests on this thread waiting.
        tokio::task::yield_now().await;
    }
    hasher.finalize().to_hex().to_string()
}

/// Looks up the job of a key. The key is free if no job claimed it, or if the job that did is unknown by now.
///
/// # Errors
/// 422 if the job was begun by a request with another fingerprint. 503 if the store does not answer.
pub(super) async fn known(
    host: &Host,
    owner: Owner,
    key: &KeyHash,
    fingerprint: &str,
) -> Result<KeyState, Problem> {
    let register = host.jobs.objects.register(&host.keys.name_of(owner), key).await;
    let register = register.map_err(|error| unavailable(&error))?;
    let claim = register.claim(key);
    let Some((id, claim)) = claim.and_then(|claim| Some((claim.job()?, claim))) else {
        return Ok(KeyState::Free(register));
    };
    match look(host, owner, id).await {
        Ok(_) if claim.fingerprint != fingerprint => {
            let detail =
                "this Idempotency-Key was sent with another request: send each request with a key of its own";
            Err(Problem::new(catalogue::INVALID_REQUEST, detail))
        }
        Ok(view) => Ok(KeyState::Job(Box::new(view))),
        Err(problem) if problem.slug() == catalogue::UNKNOWN_JOB => Ok(KeyState::Free(register)),
        Err(problem) => Err(problem),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use axum::http::header;

    #[tokio::test]
    async fn requests_that_differ_in_anything_have_other_fingerprints() {
        let request = |path: &str, headers: &[(&str, &str)]| JobRequest {
            path: path.to_owned(),
            headers: headers.iter().map(|(name, value)| ((*name).to_owned(), (*value).to_owned())).collect(),
        };
        let names = [header::ACCEPT, header::CONTENT_TYPE];
        let of = async |request: JobRequest, body: &[u8]| fingerprint(&request, &names, body).await;
        let one = of(request("/a", &[("accept", "x")]), b"body").await;
        assert_eq!(one, of(request("/a", &[("gramian-cloud", "y"), ("accept", "x")]), b"body").await);
        for other in [
            of(request("/a", &[("accept", "x")]), b"other"),
            of(request("/b", &[("accept", "x")]), b"body"),
            of(request("/a", &[("accept", "y")]), b"body"),
            of(request("/a", &[("content-type", "x")]), b"body"),
            of(request("/a", &[]), b"body"),
        ] {
            assert_ne!(one, other.await);
        }
    }
}
