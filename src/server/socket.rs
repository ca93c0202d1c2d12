//! The socket beneath hyper, plain or with TLS: notes when its client does not read, looks at heads, and ends as the last answer deserves.

use std::io;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll};
use std::time::Duration;

use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::net::TcpStream;
use tokio::time::{Instant, Sleep, sleep};
use tokio_rustls::server::TlsStream;

use super::activity::Activity;
use super::head::HeadScanner;

/// What comes from a client and goes to it.
pub enum Wire {
    Plain(TcpStream),
    Tls(Box<TlsStream<TcpStream>>),
}

impl Wire {
    fn tcp(&self) -> &TcpStream {
        match self {
            Self::Plain(tcp) => tcp,
            Self::Tls(tls) => tls.get_ref().0,
        }
    }
}

/// Calls a method of whichever stream it is.
macro_rules! of_either {
    ($self:expr, $stream:ident => $call:expr) => {
        match &mut $self.inner {
            Wire::Plain($stream) => $call,
            Wire::Tls($stream) => $call,
        }
    };
}

pub struct Socket {
    inner: Wire,
    activity: Arc<Activity>,
    scanner: HeadScanner,
    /// The last answer is sent and the client knows that none follows.
    is_shut_down: bool,
    /// Once the client has ended its side: when it is looked at whether it may have left.
    half_closed: Option<Pin<Box<Sleep>>>,
}

impl Socket {
    /// The end of what the client sends. hyper takes it for the end of the client, so it learns of it only
    /// when no answer is waited for: see [`Activity::half_close`].
    fn poll_end(&mut self, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        let timer = self.half_closed.get_or_insert_with(|| Box::pin(sleep(Duration::ZERO)));
        while self.scanner.is_between_requests()
            && let Some(left) = self.activity.half_close(cx.waker())
        {
            timer.as_mut().reset(Instant::now() + left);
            if timer.as_mut().poll(cx).is_pending() {
                return Poll::Pending;
            }
        }
        Poll::Ready(Ok(()))
    }

    pub fn new(inner: Wire, activity: Arc<Activity>) -> Self {
        Self { inner, activity, scanner: HeadScanner::new(), is_shut_down: false, half_closed: None }
    }

    /// Counts the time in which the client does not take what is written.
    fn note(&self, outcome: Poll<io::Result<usize>>) -> Poll<io::Result<usize>> {
        match &outcome {
            Poll::Pending => self.activity.pace.wait(),
            Poll::Ready(written) => {
                if self.activity.pace.is_waiting() {
                    self.activity.stir();
                }
                let n_taken = *written.as_ref().unwrap_or(&0);
                self.activity.pace.took(n_taken);
                if n_taken > 0 {
                    self.activity.take();
                }
            }
        }
        outcome
    }
}

impl AsyncRead for Socket {
    fn poll_read(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        if self.half_closed.is_some() {
            return self.poll_end(cx);
        }
        let n_before = buffer.filled().len();
        let has_room = buffer.remaining() > 0;
        let outcome = of_either!(self, stream => Pin::new(stream).poll_read(cx, buffer));
        let received = &buffer.filled()[n_before..];
        if has_room && received.is_empty() && matches!(outcome, Poll::Ready(Ok(()))) {
            return self.poll_end(cx);
        }
        if let Err(fault) = self.scanner.scan(received) {
            self.activity.distrust(fault);
        }
        self.activity.receive(self.scanner.is_between_requests());
        outcome
    }
}

impl AsyncWrite for Socket {
    fn poll_write(mut self: Pin<&mut Self>, cx: &mut Context<'_>, bytes: &[u8]) -> Poll<io::Result<usize>> {
        let outcome = of_either!(self, stream => Pin::new(stream).poll_write(cx, bytes));
        self.note(outcome)
    }

    fn poll_write_vectored(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        slices: &[io::IoSlice<'_>],
    ) -> Poll<io::Result<usize>> {
        let outcome = of_either!(self, stream => Pin::new(stream).poll_write_vectored(cx, slices));
        self.note(outcome)
    }

    fn is_write_vectored(&self) -> bool {
        match &self.inner {
            Wire::Plain(tcp) => tcp.is_write_vectored(),
            Wire::Tls(tls) => tls.is_write_vectored(),
        }
    }

    fn poll_flush(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        let outcome = of_either!(self, stream => Pin::new(stream).poll_flush(cx));
        // What TLS has taken it may still hold: the end of an answer, to a client that does not read.
        match self.inner {
            Wire::Tls(_) => self.note(outcome.map_ok(|()| 0)).map_ok(|_| ()),
            Wire::Plain(_) => outcome,
        }
    }

    /// Ends the answers. If the last one came before its request was read, what the client still sends is read and thrown
    /// away for a while: closing on unread bytes would reset the connection, and take the answer from a client that only
    /// reads after sending.
    fn poll_shutdown(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        if !self.is_shut_down {
            std::task::ready!(of_either!(self, stream => Pin::new(stream).poll_shutdown(cx)))?;
            self.is_shut_down = true;
        }
        if !self.activity.is_answered_early() {
            return Poll::Ready(Ok(()));
        }
        self.activity.linger();
        let mut scratch = [0; 16 << 10];
        // A few at a time, so that one fast client does not keep a thread.
        for _ in 0..16 {
            let mut buffer = ReadBuf::new(&mut scratch);
            let outcome = of_either!(self, stream => Pin::new(stream).poll_read(cx, &mut buffer));
            let outcome = std::task::ready!(outcome);
            if outcome.is_err() || buffer.filled().is_empty() {
                return Poll::Ready(Ok(()));
            }
            self.activity.hear_out();
        }
        cx.waker().wake_by_ref();
        Poll::Pending
    }
}

impl Drop for Socket {
    /// An answer that is cut ends in a reset: to a client of HTTP/1.0 the orderly end of a connection is the end of an answer.
    fn drop(&mut self) {
        if self.activity.has_half_an_answer() {
            // It fails if the client has gone, which is as well.
            let _ = self.inner.tcp().set_zero_linger();
        }
    }
}
