//! Listening, draining, and asking a running server whether it is ready.

use std::future::Future;
use std::io::{self, Read, Write};
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr, TcpStream};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

use tokio::net::TcpListener;
use tokio::sync::oneshot;

use crate::app::App;
use crate::http::router;

/// Time for the last answers to reach their clients once no request is being computed any more.
const LAST_BYTES: Duration = Duration::from_secs(5);

/// How often a draining server looks whether requests are still being computed.
const DRAINING_INTERVAL: Duration = Duration::from_millis(20);

/// Serves until `stop` resolves, then finishes the requests under way, each within its deadline, and returns. Connections
/// that stall, with half a request sent or an answer unread, are not waited for beyond a few seconds.
///
/// # Errors
/// Those of the listener.
pub async fn serve(
    app: Arc<App>,
    listener: TcpListener,
    stop: impl Future<Output = ()> + Send + 'static,
) -> io::Result<()> {
    let draining = app.clone();
    let (began, has_begun) = oneshot::channel::<()>();
    let stop = async move {
        stop.await;
        draining.is_draining.store(true, Ordering::Relaxed);
        tracing::info!("draining");
        // The receiver is only gone if the server is.
        let _ = began.send(());
    };
    let idle = async {
        has_begun.await.ok();
        while app.n_requests.load(Ordering::Relaxed) > 0 {
            tokio::time::sleep(DRAINING_INTERVAL).await;
        }
        tokio::time::sleep(LAST_BYTES).await;
    };
    let router = router(app.clone());
    tokio::select! {
        outcome = axum::serve(listener, router).with_graceful_shutdown(stop) => outcome,
        () = idle => Ok(()),
    }
}

/// Whether a server at this address answers its readiness probe with 200, within two seconds.
///
/// # Errors
/// Those of the connection.
pub fn is_ready(bind: SocketAddr) -> io::Result<bool> {
    let timeout = Duration::from_secs(2);
    let mut stream = TcpStream::connect_timeout(&reachable(bind), timeout)?;
    stream.set_read_timeout(Some(timeout))?;
    stream.set_write_timeout(Some(timeout))?;
    write!(stream, "GET /health/ready HTTP/1.1\r\nHost: {bind}\r\nConnection: close\r\n\r\n")?;
    let mut status_line = [0; 12];
    stream.read_exact(&mut status_line)?;
    Ok(&status_line[9..] == b"200")
}

/// A server that listens on every address is asked on the loopback.
fn reachable(bind: SocketAddr) -> SocketAddr {
    let ip = match bind.ip() {
        IpAddr::V4(ip) if ip.is_unspecified() => IpAddr::V4(Ipv4Addr::LOCALHOST),
        IpAddr::V6(ip) if ip.is_unspecified() => IpAddr::V6(Ipv6Addr::LOCALHOST),
        ip => ip,
    };
    SocketAddr::new(ip, bind.port())
}
