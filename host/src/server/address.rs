//! Addresses of a server as its own machine reaches it.

use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr};

/// Returns the address to connect to. A server that listens on every address is asked on the loopback.
pub(super) fn reachable(bind: SocketAddr) -> SocketAddr {
    let ip = match bind.ip() {
        IpAddr::V4(ip) if ip.is_unspecified() => IpAddr::V4(Ipv4Addr::LOCALHOST),
        IpAddr::V6(ip) if ip.is_unspecified() => IpAddr::V6(Ipv6Addr::LOCALHOST),
        ip => ip,
    };
    SocketAddr::new(ip, bind.port())
}

/// Returns the address of the page of a server, for a browser on its machine.
pub(super) fn url(bind: SocketAddr, speaks_tls: bool) -> String {
    let scheme = if speaks_tls { "https" } else { "http" };
    format!("{scheme}://{}/", reachable(bind))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_server_on_every_address_is_reached_on_the_loopback() {
        let of = |bind: &str, speaks_tls| url(bind.parse().unwrap(), speaks_tls);
        assert_eq!(of("0.0.0.0:8080", false), "http://127.0.0.1:8080/");
        assert_eq!(of("[::]:80", true), "https://[::1]:80/");
        assert_eq!(of("192.0.2.1:8080", false), "http://192.0.2.1:8080/");
    }
}
