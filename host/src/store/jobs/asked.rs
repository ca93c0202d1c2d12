//! Requests of jobs.

use bytes::Bytes;
use futures_util::stream::BoxStream;
use serde::{Deserialize, Serialize};

use super::super::pieces::{BrokenOff, OpenObject};
use super::super::room::Room;
use super::super::{DamagedObject, Objects, OwnerName, Unavailable};
use super::{JobId, REQUEST, line_of};

/// The request of a job, without its secrets.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct JobRequest {
    pub path: String,
    pub headers: Vec<(String, String)>,
}

/// A request in the store, with its body as a stream.
pub struct FoundRequest {
    pub request: JobRequest,
    pub n_body_bytes: u64,
    pub body: BoxStream<'static, Result<Bytes, BrokenOff>>,
}

/// A job that begins with its request.
pub struct NewJob<'a> {
    pub id: JobId,
    pub request: &'a JobRequest,
    pub body: Bytes,
}

impl Objects {
    /// Writes a request within its room, and marks its job as open.
    ///
    /// # Errors
    /// [`Unavailable`].
    pub async fn put_job(
        &self,
        owner: &OwnerName,
        job: NewJob<'_>,
        room: &mut Room,
    ) -> Result<(), Unavailable> {
        let NewJob { id, request, body } = job;
        let line = line_of(request);
        let mut hasher = blake3::Hasher::new();
        hasher.update(&line);
        hasher.update(&body);
        let pieces = vec![line, body, Bytes::copy_from_slice(hasher.finalize().as_bytes())];
        let payload = if self.in_memory { room.sealed(pieces) } else { pieces.into_iter().collect() };
        self.put(&self.job(owner, id, REQUEST), payload).await?;
        self.mark_open(owner, id).await
    }

    /// Opens the request of a job, if it exists. The inner error tells why its first line cannot be read.
    ///
    /// # Errors
    /// [`Unavailable`].
    pub async fn open_job(
        &self,
        owner: &OwnerName,
        id: JobId,
    ) -> Result<Option<Result<FoundRequest, DamagedObject>>, Unavailable> {
        let found = self.open_pieces(&self.job(owner, id, REQUEST)).await?;
        let read = |found: OpenObject| {
            let request = serde_json::from_slice(&found.line);
            let request = request.map_err(|_| DamagedObject("its first line is not a request"))?;
            Ok(FoundRequest { request, n_body_bytes: found.n_body_bytes, body: found.body })
        };
        Ok(found.map(|found| found.and_then(read)))
    }

    /// Counts and logs a damaged request, whose job then fails.
    pub fn report_job(&self, owner: &OwnerName, id: JobId) {
        let name = self.job(owner, id, REQUEST);
        self.report(&name, DamagedObject("its checksum does not match"));
    }
}
