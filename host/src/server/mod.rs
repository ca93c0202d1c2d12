//! The HTTP server: listening and draining.

mod accept;
mod activity;
mod address;
mod body;
mod connection;
mod head;
mod pace;
mod probe;
mod socket;
#[cfg(test)]
mod tests;
mod tls;

use std::future::Future;
use std::io::{self, IsTerminal};
use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

use axum::Router;
use tokio::net::TcpListener;

use crate::jobs::Runner;
use crate::state::host::Host;
use accept::{Acceptor, Connections, Door};
use activity::Activity;
use connection::ConnectionTimeouts;
pub use probe::is_ready;
use tls::Tls;
pub use tls::install_provider;

/// Interval at which a draining server looks whether requests are still being computed.
const DRAINING_INTERVAL: Duration = Duration::from_millis(20);

/// Serves until `stop` resolves, then drains and returns.
///
/// DRAINING. No connection is accepted any more. Requests whose body has not been read are refused (503).
/// Requests being computed are finished, each within its deadline. Then clients have `drain_seconds` to read
/// their answers. The connection of a client that is slower is reset, so its answer never looks complete.
///
/// # Errors
/// Returns an error if TLS is configured and its files are wrong. Failures to accept are logged and do not
/// end the server.
pub async fn serve(
    runner: Runner,
    router: Router,
    listener: TcpListener,
    stop: impl Future<Output = ()> + Send + 'static,
) -> io::Result<()> {
    let host = runner.host.clone();
    let config = &host.settings;
    let timeouts = ConnectionTimeouts { idle: config.idle(), sending: config.sending() };
    let tls = match (&config.tls_certificate, &config.tls_key) {
        (Some(certificate), Some(key)) => {
            Some(Arc::new(Tls::new(certificate, key).map_err(io::Error::other)?))
        }
        _ => None,
    };
    let following = tls.clone().map(|tls| tokio::spawn(tls.follow_files()));
    tokio::spawn(runner.go_round());
    announce(&host, listener.local_addr()?, tls.is_some());
    let listening = Listening { router, tls, timeouts, limit: config.max_connections };
    let mut connections = listening.until(listener, stop).await;
    tracing::info!(n_connections = connections.len(), "draining");
    host.draining.cancel();
    connections.drain();
    let over = async {
        while host.n_requests.load(Ordering::Relaxed) > 0 {
            tokio::time::sleep(DRAINING_INTERVAL).await;
        }
        tokio::time::sleep(host.settings.drain()).await;
    };
    tokio::select! {
        () = connections.all_ended() => {}
        () = over => {}
    }
    // Jobs are released in order, so that another process continues them at once.
    host.jobs.all_left().await;
    if connections.len() > 0 {
        tracing::warn!(
            n_connections = connections.len(),
            "connections are closed because their answers are not read"
        );
    }
    connections.cut().await;
    if let Some(following) = following {
        following.abort();
    }
    Ok(())
}

/// Logs that connections are accepted from now on, and on a terminal shows the address to open. The log is
/// for programs.
fn announce(host: &Host, address: SocketAddr, speaks_tls: bool) {
    let url = address::url(address, speaks_tls);
    let (threads, n_api_keys) = (host.settings.n_threads(), host.keys.n_keys());
    tracing::info!(%address, url, threads, n_api_keys, "listening");
    if io::stdout().is_terminal() {
        println!("gramian serves {url} until Ctrl-C");
    }
}

/// Settings shared by all connections.
struct Listening {
    router: Router,
    tls: Option<Arc<Tls>>,
    timeouts: ConnectionTimeouts,
    /// Most connections at once.
    limit: usize,
}

impl Listening {
    /// Serves new connections until `stop` resolves. Returns the connections under way.
    async fn until(self, listener: TcpListener, stop: impl Future<Output = ()>) -> Connections {
        let (mut acceptor, mut connections, door) =
            (Acceptor::default(), Connections::default(), Door::new());
        let mut stop = std::pin::pin!(stop);
        loop {
            let newcomer = tokio::select! {
                () = stop.as_mut() => return connections,
                () = connections.ended() => continue,
                newcomer = acceptor.accept(&listener) => newcomer,
            };
            let is_full = connections.len() >= self.limit;
            // Accepting failed if there is no newcomer: file descriptors may have run out, and idle
            // connections hold some.
            let has_room = if is_full || newcomer.is_none() { connections.evict().await } else { true };
            match newcomer {
                Some(socket) if has_room => {
                    let activity = Activity::new();
                    let (tls, router) = (self.tls.clone(), self.router.clone());
                    let served = connection::serve(socket, tls, router, self.timeouts, activity.clone());
                    connections.add(activity, served);
                }
                // A plain-text refusal would not be understood by a TLS client.
                Some(_) if self.tls.is_some() => {}
                Some(socket) => door.turn_away(socket),
                None => {}
            }
        }
    }
}
