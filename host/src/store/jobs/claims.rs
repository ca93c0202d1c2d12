//! Claims of jobs to the `Idempotency-Key` of their requests.
//!
//! REGISTERS. The claims of an owner are spread over 4,096 registers by the hash of the key. A register is a
//! folder, `<owner>/claims/<three digits of the hash>`. Its last generation, an object named by a number, has
//! all its claims. A change writes the next generation, and creating it is exclusive.
//!
//! THE LAST GENERATION is never deleted, but those before it are, so their numbers are free again. A request
//! that looked long ago may create one of them. So whoever has created a generation looks whether it is the
//! last one. If it is, its number was never taken before, and no claim was made since the request looked. If
//! it is not, the key belongs to the job that the last one names.
//!
//! DELETIONS of jobs leave claims alone. A job is written before it claims its key, so a claim to an unknown
//! job is left over from a deleted one, and may be replaced.

use std::collections::HashMap;
use std::time::SystemTime;

use object_store::ObjectStoreExt;
use object_store::path::Path;
use serde::{Deserialize, Serialize};

use super::super::pieces::{sealed, unsealed};
use super::super::sweep::AT_WORK;
use super::super::{DamagedObject, Objects, OwnerName, Unavailable, Verb};
use super::{JobId, line_of};

const FOLDER: &str = "claims";

/// Digits of the hash of a key that name its register.
const DIGITS: usize = 3;

/// Claims of a register from which on those of deleted jobs are left out. Each takes a look for its job.
const MANY: usize = 8;

/// Looks at a register whose generations are replaced while they are read.
const LOOKS: usize = 16;

/// Hash of an idempotency key, used as part of object names.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct KeyHash(String);

impl KeyHash {
    pub fn of(key: &[u8]) -> Self {
        Self(blake3::hash(key).to_hex().to_string())
    }

    fn register(&self) -> &str {
        &self.0[..DIGITS]
    }
}

/// The job that claims a key, and the fingerprint of the request that began it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Claim {
    key: KeyHash,
    job: String,
    pub fingerprint: String,
}

impl Claim {
    pub fn new(key: KeyHash, job: JobId, fingerprint: String) -> Self {
        Self { key, job: job.to_string(), fingerprint }
    }

    /// Returns the id of the job, if it is well-formed.
    pub fn job(&self) -> Option<JobId> {
        JobId::parse(&self.job)
    }
}

/// The claims of a register at one moment.
#[derive(Debug, Clone, Default)]
pub struct Register {
    /// Number of the generation. `None` before the first claim.
    last: Option<u64>,
    claims: Vec<Claim>,
}

impl Register {
    /// Returns the claim to a key, if there is one.
    pub fn claim(&self, key: &KeyHash) -> Option<&Claim> {
        self.claims.iter().find(|claim| claim.key == *key)
    }
}

impl Objects {
    /// Reads the register of a key. A damaged one is reported, and has no claims.
    ///
    /// # Errors
    /// [`Unavailable`].
    pub async fn register(&self, owner: &OwnerName, key: &KeyHash) -> Result<Register, Unavailable> {
        let folder = self.path(&[&owner.0, FOLDER, key.register()]);
        for _ in 0..LOOKS {
            let found = self.objects_in(owner, &[FOLDER, key.register()]).await?;
            let generations = found.iter().filter_map(|object| Some(place_of(&object.location)?.1));
            let Some(last) = generations.max() else { return Ok(Register::default()) };
            let name = self.generation(owner, key, last);
            let found = async { self.store.get(&name).await?.bytes().await };
            // A generation that is gone was replaced meanwhile.
            if let Some(bytes) = self.counted(Verb::Read, &name, found.await)? {
                let read = unsealed(&bytes).and_then(|line| {
                    serde_json::from_slice(line).map_err(|_| DamagedObject("its line is no list of claims"))
                });
                let claims = read.unwrap_or_else(|damaged| {
                    self.report(&name, damaged);
                    Vec::new()
                });
                return Ok(Register { last: Some(last), claims });
            }
        }
        let reason = "it is replaced too quickly".to_owned();
        Err(Unavailable { verb: Verb::Read, name: folder.to_string(), reason })
    }

    /// Claims a key for a job that was written, given the register as it was read. Returns false if the
    /// register was changed meanwhile.
    ///
    /// # Errors
    /// [`Unavailable`].
    pub async fn claim_key(
        &self,
        owner: &OwnerName,
        register: Register,
        claim: Claim,
    ) -> Result<bool, Unavailable> {
        let Register { last, claims } = register;
        let (is_long, key) = (claims.len() >= MANY, claim.key.clone());
        let mut kept = Vec::new();
        for other in claims.into_iter().filter(|other| other.key != key) {
            if !is_long || self.knows_job_of(owner, &other).await? {
                kept.push(other);
            }
        }
        kept.push(claim.clone());
        let number = last.map_or(0, |last| last + 1);
        let name = self.generation(owner, &key, number);
        if !self.create(&name, sealed(line_of(&kept))).await? {
            return Ok(false);
        }
        let newest = self.register(owner, &key).await?;
        let replaced = if newest.last == Some(number) { last } else { Some(number) };
        if let Some(replaced) = replaced {
            // A generation that stays is removed by a sweep.
            let _ = self.delete(&self.generation(owner, &key, replaced)).await;
        }
        Ok(newest.claims.contains(&claim))
    }

    async fn knows_job_of(&self, owner: &OwnerName, claim: &Claim) -> Result<bool, Unavailable> {
        let Some(id) = claim.job() else { return Ok(false) };
        Ok(self.find_job(owner, id).await?.is_some_and(|job| job.is_known()))
    }

    /// Removes generations that were replaced, and what is no generation.
    ///
    /// # Errors
    /// [`Unavailable`].
    pub async fn sweep_claims(&self, owner: &OwnerName) -> Result<(), Unavailable> {
        let found = self.objects_in(owner, &[FOLDER]).await?;
        let mut last = HashMap::new();
        for (register, generation) in found.iter().filter_map(|object| place_of(&object.location)) {
            let most = last.entry(register).or_insert(generation);
            *most = generation.max(*most);
        }
        let is_last = |name: &Path| {
            place_of(name).is_some_and(|(register, generation)| last.get(&register) == Some(&generation))
        };
        for object in found.iter().filter(|object| !is_last(&object.location)) {
            self.delete(&object.location).await?;
        }
        Ok(())
    }

    /// Removes the claims of an owner who has no jobs and makes none.
    pub(super) async fn forget_claims(&self, owner: &OwnerName, now: SystemTime) -> Result<(), Unavailable> {
        for object in self.objects_in(owner, &[FOLDER]).await? {
            if now.duration_since(object.last_modified.into()).is_ok_and(|age| age > AT_WORK) {
                self.delete(&object.location).await?;
            }
        }
        Ok(())
    }

    fn generation(&self, owner: &OwnerName, key: &KeyHash, number: u64) -> Path {
        self.path(&[&owner.0, FOLDER, key.register(), &number.to_string()])
    }
}

/// The register of a generation and its number, by its name.
fn place_of(name: &Path) -> Option<(String, u64)> {
    let name: &str = name.as_ref();
    let (folder, number) = name.rsplit_once('/')?;
    let register = folder.rsplit('/').next().filter(|register| register.len() == DIGITS)?;
    Some((register.to_owned(), number.parse().ok()?))
}
