//! A registered cloud: its points, what is known of their positions, and where it is kept.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::{Duration, Instant, SystemTime};

use crate::store::key::CloudId;
use crate::store::objects::cloud_object::{CloudHead, StoredCloud};
use gramian_numerics::machine::heap::{arc_payload, block_bytes, vec_bytes};
use gramian_numerics::points::cloud::Cloud;
use gramian_numerics::points::duplicates::count_duplicates;
use gramian_numerics::points::sampling::{Sampling, Scales};

/// A cloud with facts about its positions, once they were asked for.
///
/// The cells are only read and set here. Their values are computed by `CloudStore::sampling` and
/// `CloudStore::noise`.
pub struct RegisteredCloud {
    pub id: CloudId,
    pub cloud: Arc<Cloud>,
    /// The client's normals, `[n, d]`, not normalised.
    pub normals: Option<Arc<Cloud>>,
    /// Number of points that coincide with an earlier one.
    pub n_duplicates: usize,
    /// The least and the greatest value of each coordinate.
    pub bounding_box: (Vec<f64>, Vec<f64>),
    record: Mutex<Record>,
    pub(super) sampling: OnceLock<Arc<Sampling>>,
    pub(super) noise: OnceLock<f64>,
    /// Number of landmarks that kernels need, if these are few, by the key of kernel and noise.
    landmarks: Mutex<HashMap<[u8; 32], Option<usize>>>,
}

/// Largest number of kernels whose landmarks are remembered.
const MOST_KERNELS: usize = 64;

/// Time of registration, and where the cloud is kept.
#[derive(Clone, Copy)]
struct Record {
    created_at: SystemTime,
    standing: Standing,
}

/// Place where a cloud is kept. The transitions are in durable.rs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Standing {
    /// Memory alone: there is no store, or the request that brought the cloud has not written it yet.
    Unwritten,
    /// Memory alone although acknowledged: the store failed to take the cloud, and is offered it again.
    Pending,
    /// The store, where it was last seen at this moment. `None`: it must be looked for before it is used.
    Stored { seen_at: Option<Instant> },
    /// Deleted before it was written, so it will not be written.
    Deleted,
}

impl std::fmt::Debug for RegisteredCloud {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("RegisteredCloud").field("id", &self.id).finish_non_exhaustive()
    }
}

impl RegisteredCloud {
    pub(super) fn new(id: CloudId, cloud: Cloud, normals: Option<Cloud>) -> Self {
        let record = Record { created_at: SystemTime::now(), standing: Standing::Unwritten };
        // Points are allocated before temporaries, which leaves less memory on the heap between blocks.
        let (cloud, normals) =
            (Arc::new(cloud.compact()), normals.map(|normals| Arc::new(normals.compact())));
        Self {
            id,
            n_duplicates: count_duplicates(&cloud),
            bounding_box: cloud.bounding_box(),
            cloud,
            normals,
            record: Mutex::new(record),
            sampling: OnceLock::new(),
            noise: OnceLock::new(),
            landmarks: Mutex::default(),
        }
    }

    /// Creates a cloud that was read from the store.
    pub fn restored(id: CloudId, stored: StoredCloud) -> Self {
        let standing = Standing::Stored { seen_at: Some(Instant::now()) };
        let StoredCloud { head, points: cloud, normals } = stored;
        Self {
            id,
            n_duplicates: head.n_duplicates,
            bounding_box: head.bounding_box,
            cloud,
            normals,
            record: Mutex::new(Record { created_at: head.created_at, standing }),
            sampling: OnceLock::new(),
            noise: OnceLock::new(),
            landmarks: Mutex::default(),
        }
    }

    /// Returns how many landmarks a kernel needs, `Some(None)` if these are many, and `None` if that is not
    /// known.
    pub fn landmarks(&self, key: [u8; 32]) -> Option<Option<usize>> {
        self.lock_landmarks().get(&key).copied()
    }

    pub(super) fn set_landmarks(&self, key: [u8; 32], found: Option<usize>) {
        let mut known = self.lock_landmarks();
        if known.len() >= MOST_KERNELS {
            known.clear();
        }
        known.insert(key, found);
    }

    #[expect(clippy::disallowed_methods, reason = "a look-up or an insertion")]
    fn lock_landmarks(&self) -> MutexGuard<'_, HashMap<[u8; 32], Option<usize>>> {
        self.landmarks.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns its entry in the list of clouds.
    pub fn head(&self) -> CloudHead {
        CloudHead {
            created_at: self.created_at(),
            n_points: self.cloud.n_points(),
            dimension: self.cloud.dimension(),
            has_normals: self.normals.is_some(),
            n_duplicates: self.n_duplicates,
            bounding_box: self.bounding_box.clone(),
        }
    }

    /// Returns its content as the store keeps it.
    pub fn stored(&self) -> StoredCloud {
        StoredCloud { head: self.head(), points: self.cloud.clone(), normals: self.normals.clone() }
    }

    /// Time of registration.
    pub fn created_at(&self) -> SystemTime {
        self.record().created_at
    }

    /// Returns whether the store has it, as far as this process knows.
    pub fn is_stored(&self) -> bool {
        matches!(self.standing(), Standing::Stored { .. })
    }

    /// Returns whether it may be used without asking the store: it is in memory alone, or was seen in the
    /// store less than `most` ago.
    pub fn is_trusted(&self, most: Duration) -> bool {
        match self.standing() {
            Standing::Unwritten | Standing::Pending | Standing::Deleted => true,
            Standing::Stored { seen_at } => seen_at.is_some_and(|seen_at| seen_at.elapsed() < most),
        }
    }

    /// Returns whether it was acknowledged and is in memory alone.
    pub(super) fn is_pending(&self) -> bool {
        self.standing() == Standing::Pending
    }

    pub(super) fn standing(&self) -> Standing {
        self.record().standing
    }

    /// Marks it as deleted. Returns whether it existed in memory alone.
    pub(super) fn set_deleted(&self) -> bool {
        let mut record = self.record();
        match record.standing {
            Standing::Unwritten => record.standing = Standing::Deleted,
            Standing::Pending => {}
            // Memory only believed this one to be in the store. Another process deleted it.
            Standing::Stored { .. } | Standing::Deleted => return false,
        }
        true
    }

    /// Records that the store has lost it. It counts as registered anew, now.
    pub(super) fn set_unwritten(&self) {
        *self.record() = Record { created_at: SystemTime::now(), standing: Standing::Unwritten };
    }

    /// Records that the store failed to take it.
    pub(super) fn set_pending(&self) {
        self.record().standing = Standing::Pending;
    }

    /// Records that the store has it, as a cloud registered at `since`.
    pub(super) fn set_stored(&self, since: SystemTime) {
        *self.record() =
            Record { created_at: since, standing: Standing::Stored { seen_at: Some(Instant::now()) } };
    }

    /// Records whether it was just seen in the store, or must be looked for there before it is used.
    pub(super) fn set_seen(&self, is_seen: bool) {
        let mut record = self.record();
        if let Standing::Stored { seen_at } = &mut record.standing {
            *seen_at = is_seen.then(Instant::now);
        }
    }

    #[expect(
        clippy::disallowed_methods,
        reason = "two words are read or written, and nothing else meanwhile"
    )]
    fn record(&self) -> MutexGuard<'_, Record> {
        self.record.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Sampling of the points, once it was asked for.
    pub fn sampling(&self) -> Option<&Arc<Sampling>> {
        self.sampling.get()
    }

    /// Lengths that kernels are chosen by, once the sampling was asked for.
    pub fn scales(&self) -> Option<&Scales> {
        self.sampling().map(|sampling| sampling.scales())
    }

    /// Standard deviation of the points across the surface that they sample, unit L, once it was asked for.
    pub fn noise(&self) -> Option<f64> {
        self.noise.get().copied()
    }

    /// Bytes held on the heap.
    pub fn n_bytes(&self) -> usize {
        let own = block_bytes(arc_payload::<Self>()) + block_bytes(arc_payload::<Cloud>());
        let (min, max) = &self.bounding_box;
        let bounding_box = vec_bytes(min) + vec_bytes(max);
        let sampling = self.sampling().map_or(0, |s| block_bytes(arc_payload::<Sampling>()) + s.n_bytes());
        let of_normals = |normals: &Arc<Cloud>| block_bytes(arc_payload::<Cloud>()) + normals.n_bytes();
        own + bounding_box + sampling + self.cloud.n_bytes() + self.normals.as_ref().map_or(0, of_normals)
    }
}
