//! What tells the process to end: signals, and the end of whoever holds its standard input.

use std::io;

use tokio::signal::unix::{Signal, SignalKind, signal};
use tokio::sync::oneshot;

/// SIGTERM and SIGINT, which no longer end the process by themselves.
pub struct Signals {
    terminate: Signal,
    interrupt: Signal,
}

impl Signals {
    /// Takes over the signals.
    ///
    /// # Errors
    /// If the operating system refuses that.
    pub fn new() -> io::Result<Self> {
        Ok(Self { terminate: signal(SignalKind::terminate())?, interrupt: signal(SignalKind::interrupt())? })
    }

    /// Resolves with the next of them.
    pub async fn next(&mut self) -> SignalKind {
        tokio::select! {
            _ = self.terminate.recv() => SignalKind::terminate(),
            _ = self.interrupt.recv() => SignalKind::interrupt(),
        }
    }
}

/// Resolves when standard input is closed, which happens to a pipe when the process that holds its other end
/// dies, however it dies.
///
/// What is read is ignored. A thread of its own reads: one of the runtime's would delay the end of the
/// process until standard input is closed.
///
/// # Errors
/// If the operating system gives no thread.
pub fn stdin_closed() -> io::Result<impl Future<Output = ()>> {
    let (sender, receiver) = oneshot::channel::<()>();
    std::thread::Builder::new().name("stdin".to_owned()).spawn(move || {
        // Input that cannot be read has ended too. Dropping the sender wakes the receiver.
        let _ = io::copy(&mut io::stdin().lock(), &mut io::sink());
        drop(sender);
    })?;
    Ok(async {
        let _ = receiver.await;
    })
}
