//! Leases: which process works on a job.

use object_store::ObjectStoreExt;
use serde::{Deserialize, Serialize};

use super::super::{Objects, OwnerName, Unavailable, Verb};
use super::{JobId, line_of};

/// Lease of a process on a job, with its progress.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Lease {
    /// Earlier attempts that ended with their process although it was not told to end.
    pub n_crashes: u32,
    /// Whether the process gave the job up in order. Any process may then continue at once.
    pub is_released: bool,
    pub stage: Option<String>,
    pub fraction: f64,
    pub residual: Option<f64>,
    pub seconds_left: Option<f64>,
}

impl Objects {
    /// Creates the lease of an attempt. Returns whether this process has it.
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

    /// Writes a lease again, which shows that its process is alive, and its progress.
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

    /// Reads the lease of an attempt. An unreadable lease is returned as the default one.
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
