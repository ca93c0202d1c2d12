//! Request bodies, received within their size limit, at a least rate, and in reserved memory.

use std::time::Duration;

use axum::body::Body;
use axum::http::{HeaderMap, header};
use http_body_util::BodyExt;
use serde::de::DeserializeOwned;
use tokio::time::{Instant, timeout_at};

use crate::memory::Owner;
use crate::memory::budget::Reservation;
use crate::problem::Problem;
use crate::problem::catalogue;
use crate::state::host::Host;
use crate::wire::compression::SMALLER_BODY;
use crate::wire::negotiation::{Announcement, BodyFormat};
use crate::wire::read::body::{RequestBody, UnpackedBody};
use gramian_observer::Observer;

/// Bytes reserved at first. The buffer doubles as bytes come, whatever length was announced.
const FIRST_BYTES: usize = 64 << 10;

/// Least rate of a body in bytes per second. The configured body timeout is added to the time that this rate
/// allows.
const LEAST_BYTES_PER_SECOND: f64 = 16384.0;

/// Time for which a body waits for memory before it is refused, because it holds memory that others wait for.
const MEMORY_TIMEOUT: Duration = Duration::from_secs(1);

/// A body with its reserved memory.
pub struct ReceivedBody {
    pub body: RequestBody,
    pub memory: Reservation,
}

impl ReceivedBody {
    /// Parses the body. Returns the result with the memory that it holds.
    ///
    /// A body that unpacks to more than usual takes the rest of its memory here, where it cannot wait for it.
    ///
    /// # Errors
    /// Returns the errors of [`ReceivedBody::unpack`] and [`UnpackedBody::parse`].
    pub fn parse<T: DeserializeOwned>(
        self,
        host: &Host,
        observer: &dyn Observer,
    ) -> Result<(T, Reservation), Problem> {
        let (body, memory) = self.unpack(host, observer)?;
        Ok((body.parse(&host.context(observer))?, memory))
    }

    /// Unpacks the body. Returns it with the memory that it holds.
    ///
    /// Memory beyond the usual is taken without waiting.
    ///
    /// # Errors
    /// Returns the errors of [`RequestBody::unpack`], and 503 if there is no memory for the unpacked body.
    pub fn unpack(
        self,
        host: &Host,
        observer: &dyn Observer,
    ) -> Result<(UnpackedBody, Reservation), Problem> {
        let Self { body, mut memory } = self;
        let (n_packed, parsing) = (body.n_bytes(), body.parsing());
        let make_room = |n_bytes_plain: usize| {
            let n_bytes = n_packed.saturating_add(parsing.n_bytes(n_bytes_plain, &host.guest.lists));
            let n_more = n_bytes.saturating_sub(memory.n_bytes());
            if n_more == 0 || memory.try_grow(n_more) { Ok(()) } else { Err(host.compute.out_of_memory()) }
        };
        let unpacked = body.unpack(&host.context(observer), make_room)?;
        Ok((unpacked, memory))
    }
}

/// Reads a body of at most `host.guest.shares.body` bytes, in one of the formats.
///
/// # Errors
/// - 415 unless the headers announce one of the formats, or no type for what begins as a JSON object.
/// - 413 beyond the limit.
/// - 400 if the connection breaks off.
/// - 408 if the body comes too slowly.
/// - 503 if there is no place for the request, or no memory.
///
/// Refusals that follow from the headers are sent before a byte is read.
pub async fn read_body(
    host: &Host,
    owner: Owner,
    headers: &HeaderMap,
    body: Body,
    formats: &[BodyFormat],
) -> Result<ReceivedBody, Problem> {
    let Announcement { format, coding, unless_object } = Announcement::of(headers, formats)?;
    let mut reader = Reader::begin(host, owner, headers)?;
    reader.unless_object = unless_object;
    let (bytes, mut memory) = reader.read(body).await?;
    let body = RequestBody::new(format, coding, bytes, host.guest.shares.body);
    // All memory for parsing is reserved before it begins, as far as it can be foreseen.
    let n_to_parse = body.parsing().n_bytes(body.n_bytes_expected(), &host.guest.lists);
    if !host.intake.grow(&mut memory, n_to_parse, MEMORY_TIMEOUT).await {
        return Err(host.compute.out_of_memory());
    }
    Ok(ReceivedBody { body, memory })
}

/// Reads a body of any content.
///
/// # Errors
/// Returns the errors of [`read_body`] except 415.
pub async fn read_bytes(
    host: &Host,
    owner: Owner,
    headers: &HeaderMap,
    body: Body,
) -> Result<(Vec<u8>, Reservation), Problem> {
    Reader::begin(host, owner, headers)?.read(body).await
}

fn announced_length(headers: &HeaderMap) -> Option<usize> {
    headers.get(header::CONTENT_LENGTH)?.to_str().ok()?.parse().ok()
}

fn too_large(limit: usize, required: Option<usize>) -> Problem {
    Problem::too_large(catalogue::BODY_TOO_LARGE, "bytes of body", limit, required).with_remedy(SMALLER_BODY)
}

struct Reader<'a> {
    host: &'a Host,
    began: Instant,
    memory: Reservation,
    bytes: Vec<u8>,
    /// Largest number of bytes that the body may have.
    most: usize,
    /// Refusal of a body that does not begin with `{`. `None` once its first character has come.
    unless_object: Option<Problem>,
}

impl<'a> Reader<'a> {
    /// Refuses what is too long by its headers, or finds no place.
    fn begin(host: &'a Host, owner: Owner, headers: &HeaderMap) -> Result<Self, Problem> {
        let limit = host.guest.shares.body;
        let length = announced_length(headers);
        // The refusal is immediate. The connection still reads on for a client that only listens after
        // sending.
        if let Some(required) = length.filter(|&length| length > limit) {
            return Err(too_large(limit, Some(required)));
        }
        host.compute.check_room(owner)?;
        let memory = host.intake.try_reserve(owner, 0).ok_or_else(Problem::internal)?;
        let most = length.unwrap_or(limit);
        Ok(Self { host, began: Instant::now(), memory, bytes: Vec::new(), most, unless_object: None })
    }

    /// Reads to the end.
    async fn read(mut self, mut body: Body) -> Result<(Vec<u8>, Reservation), Problem> {
        let limit = self.host.guest.shares.body;
        while let Some(data) = self.next(&mut body).await? {
            if self.bytes.len() + data.len() > limit {
                return Err(too_large(limit, None));
            }
            self.check_opening(&data)?;
            self.make_room(data.len()).await?;
            self.bytes.extend_from_slice(&data);
        }
        match self.unless_object {
            None => Ok((self.bytes, self.memory)),
            Some(refusal) => Err(refusal),
        }
    }

    /// Refuses a body without a type at its first character, unless it begins as a JSON object.
    fn check_opening(&mut self, data: &[u8]) -> Result<(), Problem> {
        let Some(first) = data.iter().find(|byte| !b" \t\r\n".contains(byte)) else { return Ok(()) };
        match self.unless_object.take() {
            Some(refusal) if *first != b'{' => Err(refusal),
            _ => Ok(()),
        }
    }

    /// Returns the next piece of the body, if it comes in time.
    async fn next(&self, body: &mut Body) -> Result<Option<bytes::Bytes>, Problem> {
        let in_time = Duration::from_secs_f64(self.bytes.len() as f64 / LEAST_BYTES_PER_SECOND);
        let until = self.began + in_time + self.host.settings.body_timeout();
        loop {
            let Ok(frame) = timeout_at(until, body.frame()).await else {
                let detail = format!(
                    "the body arrived too slowly: {} bytes in {:.0} s",
                    self.bytes.len(),
                    self.began.elapsed().as_secs_f64()
                );
                return Err(Problem::new(catalogue::REQUEST_TIMEOUT, detail));
            };
            let Some(frame) = frame else { return Ok(None) };
            let frame = frame.map_err(|_| Problem::new(catalogue::MALFORMED_BODY, "the body broke off"))?;
            // Frames without data are trailers.
            if let Ok(data) = frame.into_data() {
                return Ok(Some(data));
            }
        }
    }

    async fn make_room(&mut self, n_more: usize) -> Result<(), Problem> {
        let needed = self.bytes.len() + n_more;
        if needed <= self.bytes.capacity() {
            return Ok(());
        }
        let wanted = (2 * self.bytes.capacity()).max(FIRST_BYTES).min(self.most).max(needed);
        if !self.host.intake.grow(&mut self.memory, wanted - self.bytes.capacity(), MEMORY_TIMEOUT).await {
            return Err(self.host.compute.out_of_memory());
        }
        self.bytes.reserve_exact(wanted - self.bytes.len());
        Ok(())
    }
}
