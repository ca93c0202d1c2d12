//! Claims of jobs to the `Idempotency-Key` of their requests.
//!
//! A claim is the object `<owner>/claims/<hash of the key>/<generation>`, which names a job. Creating it is
//! exclusive, so one of several equal requests claims the key. A job is written before it claims its key. So
//! a claim to an unknown job is left over from a deleted one, and the next generation replaces it. The object
//! `key-<hash of the key>-<generation>` of a job names its claim, which is removed with the job.

use std::collections::HashSet;
use std::time::SystemTime;

use bytes::Bytes;
use object_store::path::Path;
use object_store::{ObjectStoreExt, PutPayload};
use serde::{Deserialize, Serialize};

use super::super::pieces::{sealed, unsealed};
use super::super::retention::AT_WORK;
use super::super::{Objects, OwnerName, Unavailable, Verb};
use super::{JobId, JobObjects, line_of};

const FOLDER: &str = "claims";
const KEY: &str = "key-";

/// Hash of an idempotency key, used as part of object names.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct KeyHash(String);

impl KeyHash {
    pub fn of(key: &[u8]) -> Self {
        Self(blake3::hash(key).to_hex().to_string())
    }
}

/// Name of a claim.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct ClaimName {
    pub key: KeyHash,
    pub generation: u32,
}

impl ClaimName {
    /// Parses the name of a claim from the name of an object of its job.
    pub(super) fn parse(part: &str) -> Option<Self> {
        let (key, generation) = part.strip_prefix(KEY)?.split_once('-')?;
        Some(Self { key: KeyHash(key.to_owned()), generation: generation.parse().ok()? })
    }

    fn part(&self) -> String {
        format!("{KEY}{}-{}", self.key.0, self.generation)
    }
}

/// The job that claims a key, and the fingerprint of the request that began it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Claim {
    job: String,
    pub fingerprint: String,
}

impl Claim {
    pub fn new(job: JobId, fingerprint: String) -> Self {
        Self { job: job.to_string(), fingerprint }
    }

    /// Returns the id of the job, if it is well-formed.
    pub fn job(&self) -> Option<JobId> {
        JobId::parse(&self.job)
    }
}

impl Objects {
    /// Finds the last claim to a key, with its generation. The claim is `None` if it cannot be read.
    ///
    /// # Errors
    /// [`Unavailable`].
    pub async fn find_claim(
        &self,
        owner: &OwnerName,
        key: &KeyHash,
    ) -> Result<Option<(u32, Option<Claim>)>, Unavailable> {
        let found = self.objects_in(owner, &[FOLDER, &key.0]).await?;
        let generations = found.iter().filter_map(|object| object.location.filename()?.parse().ok());
        let Some(generation) = generations.max() else { return Ok(None) };
        let claim = self.get_claim(owner, &ClaimName { key: key.clone(), generation }).await?;
        Ok(Some((generation, claim)))
    }

    /// Claims a key for a job that was written. Returns false if another job has this claim.
    ///
    /// # Errors
    /// [`Unavailable`].
    pub async fn claim_key(
        &self,
        owner: &OwnerName,
        name: &ClaimName,
        claim: &Claim,
    ) -> Result<bool, Unavailable> {
        let Some(id) = claim.job() else { return Ok(false) };
        self.put(&self.job(owner, id, &name.part()), PutPayload::default()).await?;
        self.create(&self.claim(owner, name), sealed(line_of(claim))).await
    }

    /// Removes a claim if it belongs to this job.
    pub(super) async fn drop_claim(
        &self,
        owner: &OwnerName,
        name: &ClaimName,
        id: JobId,
    ) -> Result<(), Unavailable> {
        let claim = self.get_claim(owner, name).await?;
        if claim.is_some_and(|claim| claim.job() == Some(id)) {
            self.delete(&self.claim(owner, name)).await?;
        }
        Ok(())
    }

    /// Removes claims that belong to none of `jobs`, which are all jobs of the owner. Interrupted deletions
    /// leave such claims behind.
    ///
    /// # Errors
    /// [`Unavailable`].
    pub async fn sweep_claims(
        &self,
        owner: &OwnerName,
        jobs: &[JobObjects],
        now: SystemTime,
    ) -> Result<(), Unavailable> {
        let claimed = jobs.iter().filter_map(|job| Some(self.claim(owner, job.claim.as_ref()?)));
        let claimed: HashSet<Path> = claimed.collect();
        for object in self.objects_in(owner, &[FOLDER]).await? {
            let age = now.duration_since(object.last_modified.into()).unwrap_or_default();
            if age > AT_WORK && !claimed.contains(&object.location) {
                self.delete(&object.location).await?;
            }
        }
        Ok(())
    }

    async fn get_claim(&self, owner: &OwnerName, name: &ClaimName) -> Result<Option<Claim>, Unavailable> {
        let name = self.claim(owner, name);
        let found = async { self.store.get(&name).await?.bytes().await };
        let found: Option<Bytes> = self.counted(Verb::Read, &name, found.await)?;
        Ok(found.and_then(|bytes| serde_json::from_slice(unsealed(&bytes).ok()?).ok()))
    }

    pub(super) fn claim(&self, owner: &OwnerName, ClaimName { key, generation }: &ClaimName) -> Path {
        self.path(&[&owner.0, FOLDER, &key.0, &generation.to_string()])
    }
}
