//! Who is at a job.

use object_store::ObjectStoreExt;
use serde::{Deserialize, Serialize};

use super::super::{Objects, OwnerName, Unavailable, Verb};
use super::{JobId, line_of};

/// Who is at a job, and how far.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Lease {
    /// Attempts before that ended with their process, and not because it was told to end.
    pub n_crashes: u32,
    /// It was left in order: anybody may go on at once.
    pub is_released: bool,
    pub stage: Option<String>,
    pub fraction: f64,
    pub residual: Option<f64>,
    pub seconds_left: Option<f64>,
}

impl Objects {
    /// Makes the lease of an attempt; says whether this process has it.
    ///
    /// # Errors
    /// [`Unavailable`].
    pub async fn claim_job(
        &self,
        owner: &OwnerName,
        id: JobId,
        attempt: u32,
        lease: &Lease,
    ) -> Result<bool, Unavailable> {
        self.create(&self.lease(owner, id, attempt), line_of(lease).into()).await
    }

    /// Writes a lease again: its process is alive, and this far.
    ///
    /// # Errors
    /// [`Unavailable`].
    pub async fn renew_lease(
        &self,
        owner: &OwnerName,
        id: JobId,
        attempt: u32,
        lease: &Lease,
    ) -> Result<(), Unavailable> {
        self.put(&self.lease(owner, id, attempt), line_of(lease).into()).await
    }

    /// The lease of an attempt; one that cannot be read is that of nobody.
    ///
    /// # Errors
    /// [`Unavailable`].
    pub async fn get_lease(
        &self,
        owner: &OwnerName,
        id: JobId,
        attempt: u32,
    ) -> Result<Option<Lease>, Unavailable> {
        let name = self.lease(owner, id, attempt);
        let found = async { self.store.get(&name).await?.bytes().await };
        let found = self.counted(Verb::Read, &name, found.await)?;
        Ok(found.map(|bytes| serde_json::from_slice(&bytes).unwrap_or_default()))
    }
}
