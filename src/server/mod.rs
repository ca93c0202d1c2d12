//! Listening and draining.

mod accept;
mod activity;
mod body;
mod connection;
mod head;
mod pace;
mod probe;
mod socket;
#[cfg(test)]
mod tests;

use std::future::Future;
use std::io;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

use axum::Router;
use tokio::net::TcpListener;

use crate::http::router;
use crate::http::serve::app::App;
use accept::{Acceptor, Connections, Door};
use activity::Activity;
use connection::Patience;
pub use probe::is_ready;

/// How often a draining server looks whether requests are still being computed.
const DRAINING_INTERVAL: Duration = Duration::from_millis(20);

/// Serves until `stop` resolves, then drains and returns.
///
/// DRAINING. Nobody is accepted any more. Requests whose body has not been read are refused (503), those being computed are
/// finished, each within its deadline. Then the readers of answers have `drain_seconds`; whoever has not read its answer by
/// then finds its connection broken, never an answer that looks complete and is not.
///
/// # Errors
/// None so far: failures to accept are logged, and pass.
pub async fn serve(
    app: Arc<App>,
    listener: TcpListener,
    stop: impl Future<Output = ()> + Send + 'static,
) -> io::Result<()> {
    let config = &app.config;
    let patience = Patience { idle: config.idle(), sending: config.sending() };
    let listening = Listening { router: router(app.clone()), patience, limit: config.max_connections };
    let mut connections = listening.until(listener, stop).await;
    tracing::info!(n_connections = connections.len(), "draining");
    app.draining.cancel();
    connections.drain();
    let over = async {
        while app.n_requests.load(Ordering::Relaxed) > 0 {
            tokio::time::sleep(DRAINING_INTERVAL).await;
        }
        tokio::time::sleep(app.config.drain()).await;
    };
    tokio::select! {
        () = connections.all_ended() => {}
        () = over => {}
    }
    if connections.len() > 0 {
        tracing::warn!(n_connections = connections.len(), "connections are cut, their answers are not read");
    }
    connections.cut().await;
    Ok(())
}

/// What every connection is served with.
struct Listening {
    router: Router,
    patience: Patience,
    /// Connections at once.
    limit: usize,
}

impl Listening {
    /// Serves newcomers until `stop` resolves; what is left are the connections under way.
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
            // Nobody: files may have run out, which connections that are idle hold as well.
            let has_room = if is_full || newcomer.is_none() { connections.evict().await } else { true };
            match newcomer {
                Some(socket) if has_room => {
                    let activity = Activity::new();
                    let router = self.router.clone();
                    let served = connection::serve(socket, router, self.patience, activity.clone());
                    connections.add(activity, served);
                }
                Some(socket) => door.turn_away(socket),
                None => {}
            }
        }
    }
}
