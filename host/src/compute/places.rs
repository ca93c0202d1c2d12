//! Places of admitted requests, with a prediction of when the next one becomes free.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use super::calibration::{Calibration, Work};
use super::progress::Progress;
use crate::memory::{Owner, share_of_one};

/// A bounded number of places. If there are several owners, each may hold at most half.
pub(super) struct Places {
    n_places: usize,
    share: usize,
    deadline: Duration,
    state: Mutex<State>,
}

struct State {
    admitted: HashMap<u64, AdmittedRequest>,
    by_owner: HashMap<Owner, usize>,
    n_admissions: u64,
    calibration: Calibration,
}

struct AdmittedRequest {
    owner: Owner,
    since: Instant,
    /// Cost and expected seconds. `None` until the request is planned.
    work: Option<(Work, f64)>,
    /// Time of the first turn after planning.
    begun: Option<Instant>,
    /// Time in turns since planning, without waits for them.
    worked: Duration,
}

/// A place among the admitted requests, held until the answer is ready. Work that outlives its client holds
/// the place too.
pub struct Admission {
    places: Arc<Places>,
    id: u64,
    pub owner: Owner,
    /// Progress of the request, if it is watched.
    pub(super) progress: Option<Arc<Progress>>,
}

impl Places {
    pub(super) fn new(
        n_places: usize,
        n_owners: usize,
        deadline: Duration,
        calibration: Calibration,
    ) -> Arc<Self> {
        let state =
            State { admitted: HashMap::new(), by_owner: HashMap::new(), n_admissions: 0, calibration };
        Arc::new(Self {
            n_places,
            share: share_of_one(n_places, n_owners),
            deadline,
            state: Mutex::new(state),
        })
    }

    /// Takes a place. On failure, returns the seconds until one is expected to be free.
    pub(super) fn take(self: &Arc<Self>, owner: Owner) -> Result<Admission, u64> {
        let mut state = self.state();
        self.check(&state, owner)?;
        let id = state.n_admissions;
        state.n_admissions += 1;
        *state.by_owner.entry(owner).or_default() += 1;
        let admitted =
            AdmittedRequest { owner, since: Instant::now(), work: None, begun: None, worked: Duration::ZERO };
        state.admitted.insert(id, admitted);
        Ok(Admission { places: self.clone(), id, owner, progress: Progress::of_this_task() })
    }

    /// Returns the number of taken places and the number of all places.
    pub(super) fn load(&self) -> (usize, usize) {
        (self.state().admitted.len(), self.n_places)
    }

    /// Checks that an owner could take a place. On failure, returns the seconds until one is expected to be
    /// free.
    pub(super) fn look(&self, owner: Owner) -> Result<(), u64> {
        self.check(&self.state(), owner)
    }

    /// Checks that there is a free place, whoever the owner.
    pub(super) fn look_for_any(&self) -> Result<(), u64> {
        let state = self.state();
        if state.admitted.len() < self.n_places { Ok(()) } else { Err(self.seconds_until_free(&state, None)) }
    }

    fn check(&self, state: &State, owner: Owner) -> Result<(), u64> {
        let of_owner = state.by_owner.get(&owner).copied().unwrap_or(0);
        if of_owner >= self.share {
            return Err(self.seconds_until_free(state, Some(owner)));
        }
        if state.admitted.len() >= self.n_places { Err(self.seconds_until_free(state, None)) } else { Ok(()) }
    }

    /// Seconds until the first of the running requests is expected to end, as an integer for Retry-After.
    pub(super) fn seconds_until_any_is_free(&self) -> u64 {
        self.seconds_until_free(&self.state(), None)
    }

    fn seconds_until_free(&self, state: &State, owner: Option<Owner>) -> u64 {
        let now = Instant::now();
        let meant =
            state.admitted.values().filter(|admitted| owner.is_none_or(|owner| admitted.owner == owner));
        let left = meant.filter_map(|admitted| {
            let (_, seconds) = admitted.work?;
            let until_deadline = (admitted.since + self.deadline).saturating_duration_since(now);
            let elapsed = now.saturating_duration_since(admitted.begun?).as_secs_f64();
            Some((seconds - elapsed).clamp(0.0, until_deadline.as_secs_f64()))
        });
        left.reduce(f64::min).unwrap_or(0.0).round().clamp(1.0, 600.0) as u64
    }

    #[expect(clippy::disallowed_methods, reason = "counters, for as long as it takes to count")]
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Admission {
    /// Sets the total cost of the request. Returns the expected seconds.
    pub fn set_work(&self, work: Work) -> f64 {
        let mut state = self.places.state();
        let seconds = state.calibration.seconds(self.owner, work);
        if let Some(admitted) = state.admitted.get_mut(&self.id) {
            admitted.work = Some((work, seconds));
        }
        if let Some(progress) = &self.progress {
            progress.expect(seconds);
        }
        seconds
    }

    /// Whether the request is a job, whose answer nobody waits for.
    pub fn is_job(&self) -> bool {
        self.progress.is_some()
    }

    /// Expected seconds of some work, once its turn has come.
    pub fn expected_seconds(&self, work: Work) -> f64 {
        self.places.state().calibration.seconds(self.owner, work)
    }

    /// Excludes this request from the calibration, because its duration is not representative.
    pub fn forget_work(&self) {
        if let Some(admitted) = self.places.state().admitted.get_mut(&self.id) {
            admitted.work = None;
        }
    }

    /// Records that the turn of the request has come.
    pub(super) fn begin(&self) {
        if let Some(admitted) = self.places.state().admitted.get_mut(&self.id)
            && admitted.work.is_some()
        {
            admitted.begun.get_or_insert_with(Instant::now);
        }
        if let Some(progress) = &self.progress {
            progress.begin();
        }
    }

    /// Adds the time of a turn that has ended.
    pub(super) fn worked(&self, took: Duration) {
        if let Some(admitted) = self.places.state().admitted.get_mut(&self.id)
            && admitted.work.is_some()
        {
            admitted.worked += took;
        }
    }

    /// Records that the request was computed to its end. Its time in turns calibrates later predictions. The
    /// waits between them measure the load of the server.
    pub fn finish(&self) {
        let mut state = self.places.state();
        let admitted = state.admitted.get(&self.id);
        let Some(AdmittedRequest { work: Some((work, _)), begun: Some(_), worked, .. }) = admitted else {
            return;
        };
        let (work, seconds) = (*work, worked.as_secs_f64());
        state.calibration.learn(self.owner, work, seconds);
    }

    /// Calibrates with work that was done at once, in the turn that planned it.
    pub fn did_at_once(&self, work: Work, took: Duration) {
        self.places.state().calibration.learn(self.owner, work, took.as_secs_f64());
    }
}

impl Drop for Admission {
    fn drop(&mut self) {
        let mut state = self.places.state();
        state.admitted.remove(&self.id);
        if let Some(n) = state.by_owner.get_mut(&self.owner) {
            *n -= 1;
            if *n == 0 {
                state.by_owner.remove(&self.owner);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const A: Owner = Owner(0);
    const B: Owner = Owner(1);
    const DEADLINE: Duration = Duration::from_secs(100);

    #[test]
    fn one_owner_leaves_half_of_the_places_to_the_others() {
        let places = Places::new(4, 2, DEADLINE, Calibration::new(1));
        let of_a: Vec<_> = (0..2).map(|_| places.take(A).ok().unwrap()).collect();
        assert_eq!(places.look(A), Err(1));
        let of_b: Vec<_> = (0..2).map(|_| places.take(B).ok().unwrap()).collect();
        assert!(places.take(B).is_err() && places.look_for_any().is_err());
        drop(of_a);
        assert!(places.look(A).is_ok() && places.look_for_any().is_ok() && places.look(B).is_err());
        drop(of_b);
        assert!(places.state().by_owner.is_empty() && places.state().admitted.is_empty());
    }

    #[test]
    fn a_place_is_free_when_the_first_of_those_who_began_has_ended() {
        let places = Places::new(3, 1, DEADLINE, Calibration::new(1));
        let work = |flops| Work { operation: "", is_cached: false, flops };
        let [long, short, _waiting] = [1e12, 4e11, 1e9].map(|flops| {
            let admission = places.take(A).ok().unwrap();
            admission.set_work(work(flops));
            admission
        });
        long.begin();
        short.begin();
        // At 20 Gflop/s. Requests that have not begun end later than those that have.
        assert_eq!(places.look(A), Err(20));
        drop(short);
        assert!(places.look(A).is_ok());
        assert_eq!(places.seconds_until_any_is_free(), 50);
        // No request lasts beyond its deadline.
        long.set_work(work(1e15));
        assert_eq!(places.seconds_until_any_is_free(), 100);
    }
}
