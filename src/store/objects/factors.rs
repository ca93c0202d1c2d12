//! Factorizations as objects: a line of JSON, the weights of 1 and the factor as little-endian float64, and the BLAKE3 of all of it.
//!
//! NAMES. `<owner>/factors/<cloud id>/<fit>`: the fit is the hash of everything else that a factorization depends on. They go with their cloud,
//! and the oldest when there are too many bytes of them. All of them can be made again.

use std::collections::HashSet;
use std::ops::Range;
use std::time::SystemTime;

use bytes::Bytes;
use object_store::path::Path;
use object_store::{ObjectMeta, ObjectStoreExt};
use serde::{Deserialize, Serialize};

use super::retention::AT_WORK;
use super::room::Room;
use super::{CloudId, Damaged, Objects, OwnerName, Unavailable, Verb};

const FOLDER: &str = "factors";

/// Bytes that a first line may have.
const MAX_LINE: u64 = 4096;

/// How a factor is written down; another version of the service may compute another one, or lay it out otherwise.
const FORMAT: &str = concat!("gramian factor 1 ", env!("CARGO_PKG_VERSION"));

/// What is known of a factor beside its numbers, which are read back to the same bits.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct FactorHead {
    format: String,
    pub n_points: usize,
    norm1: u64,
    reciprocal_condition: u64,
}

/// Which factor is meant.
#[derive(Debug, Clone)]
pub struct FactorName {
    pub owner: OwnerName,
    pub cloud: CloudId,
    /// Hexadecimal digits.
    pub fit: String,
}

/// A factor that is there, as far as its first line.
pub struct FoundFactor {
    pub head: FactorHead,
    /// The first line.
    pub line: Bytes,
    /// Of the object.
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

impl Objects {
    /// Writes a factor, whole or not at all; says how many bytes that took.
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

    /// A factor, if it is there and of this version.
    ///
    /// # Errors
    /// [`Unavailable`].
    pub async fn find_factor(&self, name: &FactorName) -> Result<Option<FoundFactor>, Unavailable> {
        let path = self.factor(name);
        let found = self.counted(Verb::Find, &path, self.store.head(&path).await)?;
        // One without bytes has no range that could be read, and is written again.
        let Some(ObjectMeta { size: n_bytes @ 1.., .. }) = found else { return Ok(None) };
        let Some(first) = self.factor_range(name, 0..MAX_LINE.min(n_bytes)).await? else { return Ok(None) };
        let head = first.iter().position(|&byte| byte == b'\n').and_then(|end| {
            let line = first.slice(..=end);
            let head: FactorHead = serde_json::from_slice(&line).ok()?;
            Some(FoundFactor { head, line, n_bytes })
        });
        Ok(head.filter(|found| found.head.format == FORMAT))
    }

    /// Some bytes of a factor, if it is still there.
    ///
    /// # Errors
    /// [`Unavailable`].
    pub async fn factor_range(
        &self,
        name: &FactorName,
        range: Range<u64>,
    ) -> Result<Option<Bytes>, Unavailable> {
        let path = self.factor(name);
        self.counted(Verb::Read, &path, self.store.get_range(&path, range).await)
    }

    /// Lets go of a factor that is not what was written.
    pub async fn drop_factor(&self, name: &FactorName, damaged: Damaged) {
        let path = self.factor(name);
        self.n_damaged.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
        let is_gone = self.delete(&path).await.is_ok();
        tracing::error!(object = %path, reason = damaged.0, is_gone, "a factor is damaged, and made again");
    }

    /// Forgets all factors of a cloud.
    ///
    /// # Errors
    /// [`Unavailable`].
    pub async fn delete_factors(&self, owner: &OwnerName, cloud: CloudId) -> Result<(), Unavailable> {
        for object in self.objects_in(owner, &[FOLDER, &cloud.to_string()]).await? {
            self.delete(&object.location).await?;
        }
        Ok(())
    }

    /// Lets go of the factors of clouds that are not `there`, unless their writers may still be at them, and of the oldest until there are no
    /// more bytes of them than may be; says how many there are.
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
