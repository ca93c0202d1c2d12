//! Limits of a key: requests per minute and concurrent requests.

use std::num::NonZeroU32;
use std::sync::Arc;

use governor::clock::{Clock, DefaultClock};
use governor::{DefaultDirectRateLimiter, Quota, RateLimiter};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};

/// Retry-After of a key that has reached its limit of concurrent requests.
const SECONDS_UNTIL_ONE_ENDS: u64 = 1;

/// The limits of a key. `None` is unlimited.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Rule {
    pub requests_per_minute: Option<NonZeroU32>,
    /// Requests at once after a pause. The default is a tenth of `requests_per_minute`.
    pub burst: Option<NonZeroU32>,
    pub concurrent_requests: Option<NonZeroU32>,
}

/// The limits of a key with their counters.
#[derive(Default)]
pub(super) struct Limits {
    pub rule: Rule,
    rate: Option<DefaultDirectRateLimiter>,
    under_way: Option<Arc<Semaphore>>,
}

/// A request in progress. It counts as concurrent until this is dropped, when its answer has been sent.
pub struct ConcurrencyPermit(Option<OwnedSemaphorePermit>);

/// A limit that was reached, and when to retry.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TooMany {
    pub limit: String,
    pub retry_after_seconds: u64,
}

impl Limits {
    pub(super) fn new(rule: Rule) -> Self {
        let rate = rule.requests_per_minute.map(|a_minute| {
            let a_tenth = NonZeroU32::new(a_minute.get() / 10).unwrap_or(NonZeroU32::MIN);
            RateLimiter::direct(Quota::per_minute(a_minute).allow_burst(rule.burst.unwrap_or(a_tenth)))
        });
        let under_way = rule.concurrent_requests.map(|n| Arc::new(Semaphore::new(n.get() as usize)));
        Self { rule, rate, under_way }
    }

    pub(super) fn enter(&self) -> Result<ConcurrencyPermit, TooMany> {
        let permit = self.under_way.as_ref().map(|under_way| under_way.clone().try_acquire_owned());
        let permit = permit.transpose().map_err(|_| {
            let n = self.rule.concurrent_requests.map_or(0, NonZeroU32::get);
            TooMany { limit: format!("{n} requests at once"), retry_after_seconds: SECONDS_UNTIL_ONE_ENDS }
        })?;
        if let Some(rate) = &self.rate {
            rate.check().map_err(|until| {
                let wait = until.wait_time_from(DefaultClock::default().now());
                let n = self.rule.requests_per_minute.map_or(0, NonZeroU32::get);
                let retry_after_seconds = wait.as_secs_f64().ceil().max(1.0) as u64;
                TooMany { limit: format!("{n} requests a minute"), retry_after_seconds }
            })?;
        }
        Ok(ConcurrencyPermit(permit))
    }
}

impl Drop for ConcurrencyPermit {
    /// Releases the permit.
    fn drop(&mut self) {
        self.0.take();
    }
}
