//! Request and answer bodies, instrumented for the connection.

use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll};

use bytes::Bytes;
use http_body::{Body, Frame, SizeHint};
use hyper::body::Incoming;

use super::activity::InFlight;
use super::pace::Pace;
use crate::around::transport::Arrival;

/// Bytes given to hyper at a time: few system calls in HTTP/1, and as much as a stream holds in HTTP/2.
///
/// hyper takes another piece while it has less than its buffer unsent (`connection::BUFFER`,
/// `connection::SEND_BUFFER`). So at most the sum of piece and buffer is neither with the kernel nor in the
/// body.
const PIECE: usize = 128 << 10;
const STREAM_PIECE: usize = 32 << 10;

/// Bytes at the end of a frame that are copied. A slice that hyper has not sent yet would keep the whole
/// frame, perhaps hundreds of megabytes, long after the body that paid for it.
const COPIED_TAIL: usize = 256 << 10;

/// Frames up to this size are sent as slices throughout.
const SMALL_FRAME: usize = 2 * COPIED_TAIL;

/// The body of an answer. Its request is under way until it is dropped.
pub struct Sending<B> {
    body: B,
    /// Unsent part of the last frame.
    rest: Bytes,
    copies_tail: bool,
    /// Pace of one HTTP/2 stream, whose client may refuse to take an answer while it reads the socket.
    pace: Option<Arc<Pace>>,
    /// Bytes of the last piece.
    n_given: usize,
    /// Bytes of the announced length that are not given yet.
    n_announced: Option<u64>,
    is_ended: bool,
    in_flight: InFlight,
}

impl<B: Body<Data = Bytes> + Unpin> Sending<B> {
    /// Wraps the body of an answer.
    ///
    /// `pace` is `None` in HTTP/1, whose client is watched by its socket. `is_sent` is false for answers to
    /// HEAD, which are never sent and so never cut off. A body of an announced length ends with its last
    /// byte, because hyper does not ask for more.
    pub fn new(
        body: B,
        in_flight: InFlight,
        pace: Option<Arc<Pace>>,
        is_sent: bool,
        n_announced: Option<u64>,
    ) -> Self {
        let n_announced = n_announced.or_else(|| body.size_hint().exact());
        let is_ended = !is_sent || body.is_end_stream() || n_announced == Some(0);
        Self {
            body,
            rest: Bytes::new(),
            copies_tail: false,
            pace,
            n_given: 0,
            n_announced,
            is_ended,
            in_flight,
        }
    }

    /// Splits off the next piece of the frame. In HTTP/2 the last byte is a piece of its own.
    ///
    /// hyper hands a piece over as soon as the client has room for one byte. So a stream has handed over its
    /// whole answer, and is no longer watched, only when the client has room for all of it.
    fn next_piece(&mut self) -> Bytes {
        let left = self.rest.len();
        let most = if self.pace.is_some() { STREAM_PIECE } else { PIECE };
        let n = match left {
            n if n > most => most,
            n if n > 1 && self.pace.is_some() => n - 1,
            n => n,
        };
        let piece = self.rest.split_to(n);
        if self.copies_tail && left <= COPIED_TAIL { Bytes::copy_from_slice(&piece) } else { piece }
    }

    fn give(&mut self, piece: Bytes) -> Frame<Bytes> {
        self.n_given = piece.len();
        self.n_announced = self.n_announced.map(|n_bytes| n_bytes.saturating_sub(piece.len() as u64));
        self.is_ended = self.n_announced == Some(0) || self.is_end_stream();
        if let Some(pace) = &self.pace {
            pace.wait();
            self.in_flight.activity().stream_has_data();
        }
        Frame::data(piece)
    }
}

impl<B: Body<Data = Bytes> + Unpin> Body for Sending<B> {
    type Data = Bytes;
    type Error = B::Error;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, B::Error>>> {
        let this = &mut *self;
        if let Some(pace) = &this.pace {
            // hyper asks for more only after the client took what was given.
            let n_given = std::mem::take(&mut this.n_given);
            pace.took(n_given);
            if n_given > 0 {
                this.in_flight.activity().stream_was_read(n_given);
            }
        }
        if this.rest.is_empty() {
            let frame = match std::task::ready!(Pin::new(&mut this.body).poll_frame(cx)) {
                Some(Ok(frame)) => frame,
                outcome => {
                    this.is_ended = outcome.is_none();
                    return Poll::Ready(outcome);
                }
            };
            match frame.into_data() {
                Ok(data) => {
                    this.copies_tail = data.len() > SMALL_FRAME;
                    this.rest = data;
                }
                Err(trailers) => return Poll::Ready(Some(Ok(trailers))),
            }
        }
        let piece = this.next_piece();
        Poll::Ready(Some(Ok(this.give(piece))))
    }

    fn is_end_stream(&self) -> bool {
        self.rest.is_empty() && self.body.is_end_stream()
    }

    fn size_hint(&self) -> SizeHint {
        let (hint, rest) = (self.body.size_hint(), self.rest.len() as u64);
        let mut sum = SizeHint::new();
        sum.set_lower(hint.lower().saturating_add(rest));
        if let Some(upper) = hint.upper() {
            sum.set_upper(upper.saturating_add(rest));
        }
        sum
    }
}

impl<B> Drop for Sending<B> {
    fn drop(&mut self) {
        if self.pace.is_some() && self.n_given > 0 {
            self.in_flight.activity().stream_was_read(0);
        }
        // A stream of HTTP/2 has a reset of its own.
        if !self.is_ended && self.pace.is_none() {
            self.in_flight.activity().note_broken_answer();
        }
    }
}

/// The body of a request, which records when it is read to its end.
pub struct Receiving {
    pub body: Incoming,
    pub arrival: Arrival,
}

impl Body for Receiving {
    type Data = Bytes;
    type Error = hyper::Error;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, hyper::Error>>> {
        let outcome = Pin::new(&mut self.body).poll_frame(cx);
        if matches!(outcome, Poll::Ready(None)) || self.body.is_end_stream() {
            self.arrival.set_read();
        }
        outcome
    }

    fn is_end_stream(&self) -> bool {
        self.body.is_end_stream()
    }

    fn size_hint(&self) -> SizeHint {
        self.body.size_hint()
    }
}
