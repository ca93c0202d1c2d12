//! Results of jobs.

use std::sync::Arc;
use std::time::SystemTime;

use bytes::Bytes;
use futures_util::stream::BoxStream;
use futures_util::{Stream, StreamExt};
use object_store::ObjectStoreExt;
use serde::{Deserialize, Serialize};

use super::super::pieces::{BrokenOff, sealed, unsealed};
use super::super::room::Room;
use super::super::{DamagedObject, Objects, OwnerName, Unavailable, Verb};
use super::{JobId, RESULT, line_of};

/// Head of the result of a job. The headers are those of the answer.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct JobResult {
    pub outcome: Outcome,
    pub status: u16,
    pub headers: Vec<(String, String)>,
}

/// Outcome of a job.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    Succeeded,
    Failed,
    Cancelled,
}

/// A result as it is written. Its body is in the answer of `attempt`, if it has one.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
struct ResultRecord {
    head: JobResult,
    attempt: Option<u32>,
}

/// The result of a job, with its body as a stream.
pub struct FoundResult {
    pub head: JobResult,
    pub ended_at: SystemTime,
    pub n_body_bytes: u64,
    pub body: BoxStream<'static, Result<Bytes, BrokenOff>>,
}

/// The answer of an attempt at a job, with its body as a stream.
pub struct Answer<S> {
    pub attempt: u32,
    pub head: JobResult,
    pub body: S,
}

impl Objects {
    /// Writes the answer of an attempt within its room, and publishes it as the result of the job. Returns
    /// whether it is the result.
    ///
    /// An answer is not published if the job has a result already or is unknown. Nothing is published before
    /// all of it is written.
    ///
    /// # Errors
    /// [`Unavailable`], also if the body breaks off or exceeds its room.
    pub async fn put_result<E: std::fmt::Display>(
        &self,
        owner: &OwnerName,
        id: JobId,
        Answer { attempt, head, body }: Answer<impl Stream<Item = Result<Bytes, E>>>,
        room: &mut Room,
    ) -> Result<bool, Unavailable> {
        let answer = self.answer(owner, id, attempt);
        let body = body.map(|piece| piece.map_err(|error| error.to_string()));
        self.put_pieces(&answer, line_of(&head), body, room).await?;
        let is_wanted = self.find_job(owner, id).await?.is_some_and(|job| job.is_known());
        let is_result = is_wanted && self.publish(owner, id, head, Some(attempt)).await?;
        if !is_result {
            self.delete(&answer).await?;
        }
        Ok(is_result)
    }

    /// Ends a job without an answer, unless it has a result or is unknown. Returns whether it was ended.
    ///
    /// # Errors
    /// [`Unavailable`].
    pub async fn cancel_job(&self, owner: &OwnerName, id: JobId) -> Result<bool, Unavailable> {
        let head = JobResult { outcome: Outcome::Cancelled, status: 0, headers: Vec::new() };
        self.publish(owner, id, head, None).await
    }

    /// Publishes the result of a job, unless it has one. A job that was deleted meanwhile does not come back.
    async fn publish(
        &self,
        owner: &OwnerName,
        id: JobId,
        head: JobResult,
        attempt: Option<u32>,
    ) -> Result<bool, Unavailable> {
        let result = sealed(line_of(&ResultRecord { head, attempt }));
        if !self.create(&self.job(owner, id, RESULT), result).await? {
            return Ok(false);
        }
        if !self.find_job(owner, id).await?.is_some_and(|job| job.is_known()) {
            // The rest is left to the deletion, which answers whether it removed a request.
            self.delete(&self.job(owner, id, RESULT)).await?;
            return Ok(false);
        }
        self.unmark_open(owner, id).await?;
        Ok(true)
    }

    /// Opens the result of a known job that has ended. A damaged result is deleted and reported, and the job
    /// is open again.
    ///
    /// # Errors
    /// [`Unavailable`].
    pub async fn get_result(
        self: &Arc<Self>,
        owner: &OwnerName,
        id: JobId,
    ) -> Result<Option<FoundResult>, Unavailable> {
        let name = self.job(owner, id, RESULT);
        let found = async {
            let found = self.store.get(&name).await?;
            Ok((SystemTime::from(found.meta.last_modified), found.bytes().await?))
        };
        let Some((ended_at, bytes)) = self.counted(Verb::Read, &name, found.await)? else { return Ok(None) };
        let read = unsealed(&bytes).and_then(|line| {
            serde_json::from_slice(line).map_err(|_| DamagedObject("its first line is not a result"))
        });
        let damaged = match read {
            Ok(ResultRecord { head, attempt: None }) => {
                let body = futures_util::stream::empty().boxed();
                return Ok(Some(FoundResult { head, ended_at, n_body_bytes: 0, body }));
            }
            Ok(ResultRecord { head, attempt: Some(attempt) }) => {
                match self.open_pieces(&self.answer(owner, id, attempt)).await? {
                    Some(Ok(found)) => {
                        let body = self.clone().reporting(owner.clone(), id, found.body);
                        return Ok(Some(FoundResult {
                            head,
                            ended_at,
                            n_body_bytes: found.n_body_bytes,
                            body,
                        }));
                    }
                    Some(Err(damaged)) => damaged,
                    None => DamagedObject("its body is missing"),
                }
            }
            Err(damaged) => damaged,
        };
        // Objects of a job that is being deleted are missing without being damaged.
        if self.find_job(owner, id).await?.is_some_and(|job| job.is_known()) {
            self.drop_result(owner, id, damaged).await;
        }
        Ok(None)
    }

    /// Wraps a body so that its result is deleted if the body turns out damaged.
    fn reporting(
        self: Arc<Self>,
        owner: OwnerName,
        id: JobId,
        body: BoxStream<'static, Result<Bytes, BrokenOff>>,
    ) -> BoxStream<'static, Result<Bytes, BrokenOff>> {
        let body = body.then(move |piece| {
            let (objects, owner) = (self.clone(), owner.clone());
            async move {
                if let Err(BrokenOff::Damaged) = piece {
                    objects.drop_result(&owner, id, DamagedObject("its checksum does not match")).await;
                }
                piece
            }
        });
        body.boxed()
    }

    /// Deletes a damaged result and opens its job again.
    async fn drop_result(&self, owner: &OwnerName, id: JobId, damaged: DamagedObject) {
        let name = self.job(owner, id, RESULT);
        self.report(&name, damaged);
        let is_gone = self.delete(&name).await.is_ok() && self.mark_open(owner, id).await.is_ok();
        tracing::error!(job = %id, is_gone, "the stored result of a job is damaged and is computed again");
    }
}
