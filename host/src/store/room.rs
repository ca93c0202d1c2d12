//! Bytes that an object may take, of memory or of the store. They are reserved before the object is written.

use bytes::Bytes;
use object_store::PutPayload;

use crate::memory::Owner;
use crate::memory::budget::{Budget, Reservation};

/// Bytes charged for each object beside its content: its name, and smaller objects of the same job.
const OVERHEAD: usize = 2048;

/// Reserved bytes for one object. An object in memory takes the reservation over, and holds it until its last
/// slice is dropped.
pub struct Room {
    reservation: Option<Reservation>,
    is_exceeded: bool,
}

/// The bytes of an object in memory with their reservation.
struct Paid {
    bytes: Vec<u8>,
    _reservation: Option<Reservation>,
}

impl AsRef<[u8]> for Paid {
    fn as_ref(&self) -> &[u8] {
        &self.bytes
    }
}

impl Room {
    /// Creates room without a bound.
    pub fn unlimited() -> Self {
        Self { reservation: None, is_exceeded: false }
    }

    /// Reserves room for an object of `n_bytes`, if the owner may have so many bytes of the budget now.
    pub fn of(budget: &Budget, owner: Owner, n_bytes: usize) -> Option<Self> {
        let reservation = budget.try_reserve(owner, n_bytes.saturating_add(OVERHEAD))?;
        Some(Self { reservation: Some(reservation), is_exceeded: false })
    }

    /// Returns whether an object was refused because it needed more.
    pub fn is_exceeded(&self) -> bool {
        self.is_exceeded
    }

    /// Returns the reservation, unless an object in memory took it over.
    pub fn into_reservation(self) -> Option<Reservation> {
        self.reservation
    }

    /// Reserves `n_bytes` more. Returns whether there were as many.
    pub(super) fn try_grow(&mut self, n_bytes: usize) -> bool {
        self.is_exceeded |= self.reservation.as_mut().is_some_and(|held| !held.try_grow(n_bytes));
        !self.is_exceeded
    }

    /// Joins the pieces of an object in memory. The store hands out slices of the result, which share its
    /// reservation.
    pub(super) fn sealed(&mut self, pieces: Vec<Bytes>) -> PutPayload {
        let bytes = pieces.concat();
        let mut reservation = self.reservation.take();
        if let Some(held) = &mut reservation {
            held.shrink_to(bytes.len() + OVERHEAD);
        }
        Bytes::from_owner(Paid { bytes, _reservation: reservation }).into()
    }
}
