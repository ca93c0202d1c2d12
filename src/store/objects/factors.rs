//! Factorizations as objects: a line of JSON, the weights of the constant 1 and the factor as little-endian
//! float64, and the BLAKE3 of all.
//!
//! NAMES. `<owner>/factors/<cloud id>/<fit>`: `fit` is the hash of everything else that a factorization
//! depends on.
//!
//! RETENTION. Factors are deleted with their cloud. The oldest are deleted when all together have too many
//! bytes. Every factor can be recomputed.

use std::collections::HashSet;
use std::ops::Range;
use std::time::SystemTime;

use bytes::Bytes;
use object_store::path::Path;
use object_store::{ObjectMeta, ObjectStoreExt};
use serde::{Deserialize, Serialize};

use super::CloudObjects;
use crate::store::key::CloudId;
use gramian_host::store::AT_WORK;
use gramian_host::store::room::Room;
use gramian_host::store::{DamagedObject, OwnerName, Unavailable, Verb};

const FOLDER: &str = "factors";

/// Most bytes of a first line.
const MAX_LINE: u64 = 4096;

/// Version of the format. Another version of the service may compute another factor, or lay it out
/// differently.
const FORMAT: &str = concat!("gramian factor 1 ", env!("CARGO_PKG_VERSION"));

/// Facts about a factor beside its numbers. Floats are stored as bits, so they are read back exactly.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct FactorHead {
    format: String,
    pub n_points: usize,
    norm1: u64,
    reciprocal_condition: u64,
}

/// Identity of a factor.
#[derive(Debug, Clone)]
pub struct FactorName {
    pub owner: OwnerName,
    pub cloud: CloudId,
    /// Hexadecimal digits.
    pub fit: String,
}

/// A factor in the store, read as far as its first line.
pub struct FoundFactor {
    pub head: FactorHead,
    /// The first line.
    pub line: Bytes,
    /// Size of the object in bytes.
    pub n_bytes: u64,
}

impl FactorHead {
    pub fn new(n_points: usize, norm1: f64, reciprocal_condition: f64) -> Self {
        let [norm1, reciprocal_condition] = [norm1, reciprocal_condition].map(f64::to_bits);
        Self { format: FORMAT.to_owned(), n_points, norm1, reciprocal_condition }
    }

    pub fn norm1(&self) -> f64 {
        f64::from_bits(self.norm1)
    }

    pub fn reciprocal_condition(&self) -> f64 {
        f64::from_bits(self.reciprocal_condition)
    }
}

impl CloudObjects {
    /// Writes a factor atomically. Returns the bytes written.
    ///
    /// # Errors
    /// [`Unavailable`].
    pub async fn put_factor(
        &self,
        name: &FactorName,
        head: &FactorHead,
        pieces: impl Iterator<Item = Bytes>,
    ) -> Result<u64, Unavailable> {
        let mut line = serde_json::to_vec(head).unwrap_or_default();
        line.push(b'\n');
        let pieces = futures_util::stream::iter(pieces.map(Ok));
        self.put_pieces(&self.factor(name), line.into(), pieces, &mut Room::unlimited()).await
    }

    /// Finds a factor of this version.
    ///
    /// # Errors
    /// [`Unavailable`].
    pub async fn find_factor(&self, name: &FactorName) -> Result<Option<FoundFactor>, Unavailable> {
        let path = self.factor(name);
        let found = self.counted(Verb::Find, &path, self.backend().head(&path).await)?;
        // An empty object has no range that could be read. It counts as absent and is written again.
        let Some(ObjectMeta { size: n_bytes @ 1.., .. }) = found else { return Ok(None) };
        let Some(first) = self.factor_range(name, 0..MAX_LINE.min(n_bytes)).await? else { return Ok(None) };
        let head = first.iter().position(|&byte| byte == b'\n').and_then(|end| {
            let line = first.slice(..=end);
            let head: FactorHead = serde_json::from_slice(&line).ok()?;
            Some(FoundFactor { head, line, n_bytes })
        });
        Ok(head.filter(|found| found.head.format == FORMAT))
    }

    /// Reads a range of bytes of a factor, if it still exists.
    ///
    /// # Errors
    /// [`Unavailable`].
    pub async fn factor_range(
        &self,
        name: &FactorName,
        range: Range<u64>,
    ) -> Result<Option<Bytes>, Unavailable> {
        let path = self.factor(name);
        self.counted(Verb::Read, &path, self.backend().get_range(&path, range).await)
    }

    /// Deletes a damaged factor.
    pub async fn drop_factor(&self, name: &FactorName, damaged: DamagedObject) {
        let path = self.factor(name);
        self.count_damaged();
        let is_gone = self.delete(&path).await.is_ok();
        tracing::error!(object = %path, reason = damaged.0, is_gone, "a stored factor is damaged and is computed again");
    }

    /// Deletes all factors of a cloud.
    ///
    /// # Errors
    /// [`Unavailable`].
    pub async fn delete_factors(&self, owner: &OwnerName, cloud: CloudId) -> Result<(), Unavailable> {
        for object in self.objects_in(owner, &[FOLDER, &cloud.to_string()]).await? {
            self.delete(&object.location).await?;
        }
        Ok(())
    }

    /// Deletes factors of clouds that are not `there`, unless their writers may still be at work. Then
    /// deletes the oldest until all have at most `most` bytes. Returns the bytes left.
    ///
    /// # Errors
    /// [`Unavailable`].
    pub(super) async fn sweep_factors(
        &self,
        there: &[(OwnerName, HashSet<CloudId>)],
        most: u64,
        now: SystemTime,
    ) -> Result<u64, Unavailable> {
        let mut found = Vec::new();
        for (owner, clouds) in there {
            for object in self.objects_in(owner, &[FOLDER]).await? {
                let folder = object.location.parts().nth_back(1);
                let cloud = folder.and_then(|folder| CloudId::parse(folder.as_ref()));
                let is_wanted = cloud.is_some_and(|cloud| clouds.contains(&cloud));
                let age = now.duration_since(object.last_modified.into()).unwrap_or_default();
                if is_wanted || age <= AT_WORK {
                    found.push(object);
                } else {
                    self.delete(&object.location).await?;
                }
            }
        }
        found.sort_by_key(|object| object.last_modified);
        let mut n_bytes: u64 = found.iter().map(|object| object.size).sum();
        for object in found {
            if n_bytes <= most {
                break;
            }
            self.delete(&object.location).await?;
            n_bytes -= object.size;
        }
        Ok(n_bytes)
    }

    pub(super) fn factor(&self, name: &FactorName) -> Path {
        self.path(&[&name.owner.0, FOLDER, &name.cloud.to_string(), &name.fit])
    }
}
