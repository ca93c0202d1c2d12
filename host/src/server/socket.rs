//! The socket beneath hyper, plain or with TLS. It measures how its client reads, scans heads, and ends in
//! order or by reset, depending on the last answer.

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

/// The byte stream of a client.
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

/// Calls a method of the plain or the TLS stream.
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
    /// Whether the last answer is sent and the client knows that none follows.
    is_shut_down: bool,
    /// Timer after the client has closed its sending side: when to check whether it may have left.
    half_closed: Option<Pin<Box<Sleep>>>,
}

impl Socket {
    /// Handles the end of the client's input. hyper takes it for the end of the client. So it is withheld
    /// while an answer is awaited: see [`Activity::half_close`].
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

    /// Counts the time for which the client does not take written bytes.
    fn note(&self, outcome: Poll<io::Result<usize>>) -> Poll<io::Result<usize>> {
        match &outcome {
            Poll::Pending => self.activity.pace.wait(),
            Poll::Ready(written) => {
                if self.activity.pace.is_waiting() {
                    self.activity.reset_idle();
                }
                let n_taken = *written.as_ref().unwrap_or(&0);
                self.activity.pace.took(n_taken);
                if n_taken > 0 {
                    self.activity.extend_half_close();
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
        // TLS may still hold accepted bytes: the end of an answer, to a client that does not read.
        match self.inner {
            Wire::Tls(_) => self.note(outcome.map_ok(|()| 0)).map_ok(|_| ()),
            Wire::Plain(_) => outcome,
        }
    }

    /// Ends the answers.
    ///
    /// If the last answer came before its request was read, further input is read and discarded for a while.
    /// Closing on unread bytes would reset the connection. A client that reads only after sending would lose
    /// the answer.
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
        // A few reads at a time, so that one fast client does not occupy a thread.
        for _ in 0..16 {
            let mut buffer = ReadBuf::new(&mut scratch);
            let outcome = of_either!(self, stream => Pin::new(stream).poll_read(cx, &mut buffer));
            let outcome = std::task::ready!(outcome);
            if outcome.is_err() || buffer.filled().is_empty() {
                return Poll::Ready(Ok(()));
            }
            self.activity.note_heard();
        }
        cx.waker().wake_by_ref();
        Poll::Pending
    }
}

impl Drop for Socket {
    /// Resets the connection if an answer was cut: in HTTP/1.0 an orderly end would mark the answer complete.
    fn drop(&mut self) {
        if self.activity.has_unfinished_answer() {
            // It fails if the client has gone, which does no harm.
            let _ = self.inner.tcp().set_zero_linger();
        }
    }
}
