//! Settings of the host, each with a flag and an environment variable of the same name.
//!
//! A setting that is blank, not a number or out of range ends the process at the start, with its name. A
//! service that interprets a setting differently from its operator is worse than one that does not start.

use std::net::{Ipv4Addr, SocketAddr};
use std::path::PathBuf;
use std::str::FromStr;
use std::time::Duration;

use axum::http::Uri;
use parse_size::Config as Sizes;

use crate::process::machine;
use crate::store::Place;

/// The settings of the host, read once at the start and passed down.
#[derive(Debug, Clone, clap::Args)]
pub struct Settings {
    /// Address and port to listen on, such as localhost:8080, or 0.0.0.0:8080 for all networks.
    #[arg(long, env = "GRAMIAN_BIND", default_value = "127.0.0.1:8080", value_parser = address)]
    pub bind: SocketAddr,

    /// Compute threads, 0 for one per core.
    #[arg(long, env = "GRAMIAN_THREADS", default_value_t = 0, value_parser = whole::<0, 4096>)]
    pub threads: usize,

    /// Bytes of memory for everything, such as 4G: bodies, clouds, factorizations, work and answers. Absent:
    /// three quarters of the memory of the machine or the container.
    #[arg(long, env = "GRAMIAN_MEMORY_BYTES", value_parser = enough_bytes)]
    pub memory_bytes: Option<usize>,

    /// Bytes a request body may have.
    #[arg(long, env = "GRAMIAN_MAX_BODY_BYTES", default_value = "256MiB", value_parser = bytes::<1, usize>)]
    pub max_body_bytes: usize,

    /// Compute requests that may wait for a thread. The next one is answered 503.
    #[arg(long, env = "GRAMIAN_MAX_QUEUE", default_value_t = 256, value_parser = whole::<0, MAX_COUNT>)]
    pub max_queue: usize,

    /// Connections at once. A newcomer beyond it replaces the one without a request for longest, or is
    /// answered 503.
    #[arg(long, env = "GRAMIAN_MAX_CONNECTIONS", default_value_t = 1000, value_parser = whole::<1, MAX_COUNT>)]
    pub max_connections: usize,

    /// Seconds from the arrival of a request to its answer. Later it is answered 504.
    #[arg(long, env = "GRAMIAN_DEADLINE_SECONDS", default_value_t = 120.0, value_parser = positive_seconds)]
    pub deadline_seconds: f64,

    /// Seconds by which a body may lag behind 16 KiB per second. A slower one is answered 408.
    #[arg(long, env = "GRAMIAN_BODY_SECONDS", default_value_t = 10.0, value_parser = positive_seconds)]
    pub body_seconds: f64,

    /// Seconds a connection may be without a request: between two of them, or with an incomplete head.
    #[arg(long, env = "GRAMIAN_IDLE_SECONDS", default_value_t = 60.0, value_parser = positive_seconds)]
    pub idle_seconds: f64,

    /// Seconds that a client may leave an answer unread, or lag behind a reader of 64 KiB per second. Then it
    /// is cut.
    #[arg(long, env = "GRAMIAN_SEND_SECONDS", default_value_t = 30.0, value_parser = positive_seconds)]
    pub send_seconds: f64,

    /// Seconds for clients to read their answers after the server was told to end and all computations ended.
    #[arg(long, env = "GRAMIAN_DRAIN_SECONDS", default_value_t = 30.0, value_parser = positive_seconds)]
    pub drain_seconds: f64,

    /// Seconds that a job may take. Then it fails.
    #[arg(long, env = "GRAMIAN_JOB_SECONDS", default_value_t = 86400.0, value_parser = positive_seconds)]
    pub job_seconds: f64,

    /// Seconds for which the result of a job is kept.
    #[arg(long, env = "GRAMIAN_JOB_RESULT_SECONDS", default_value_t = 3600.0, value_parser = positive_seconds)]
    pub job_result_seconds: f64,

    /// Jobs that are kept with their results. One of several keys may have half of them. The next job is
    /// answered 503.
    #[arg(long, env = "GRAMIAN_MAX_JOBS", default_value_t = 10_000, value_parser = whole::<1, MAX_COUNT>)]
    pub max_jobs: usize,

    /// A certificate with the authorities up to a root, in PEM. With it, only TLS is served. Read again when
    /// it changes.
    #[arg(long, env = "GRAMIAN_TLS_CERTIFICATE", requires = "tls_key")]
    pub tls_certificate: Option<PathBuf>,

    /// The private key of the certificate, in PEM.
    #[arg(long, env = "GRAMIAN_TLS_KEY", requires = "tls_certificate")]
    pub tls_key: Option<PathBuf>,

    /// Bearer keys, separated by commas. Without keys the service is open.
    #[arg(long, env = "GRAMIAN_API_KEYS", value_delimiter = ',', hide_env_values = true, value_parser = api_key)]
    pub api_keys: Vec<String>,

    /// A file of hashes of bearer keys with their names and limits, read again when it changes. `gramian key`
    /// makes its lines.
    #[arg(long, env = "GRAMIAN_KEYS_FILE")]
    pub keys_file: Option<PathBuf>,

    /// Whether to serve everyone on an address beyond this machine without keys, which is refused otherwise.
    #[arg(long, env = "GRAMIAN_ALLOW_ANONYMOUS", default_value_t = false, action = clap::ArgAction::Set, value_parser = flag)]
    pub allow_anonymous: bool,

    /// Store of clouds that outlive the process: a directory, or `s3://bucket/prefix`, `gs://…`, `az://…`.
    /// Absent: memory alone.
    #[arg(long, env = "GRAMIAN_STORE")]
    pub store: Option<Place>,

    /// Bytes of jobs and their results in the store. One of several keys may have half of them. Results
    /// beyond them are refused.
    #[arg(long, env = "GRAMIAN_STORE_JOB_BYTES", default_value = "16GiB", value_parser = bytes::<1, usize>)]
    pub store_job_bytes: usize,

    /// Origins that browsers may call from, separated by commas, or `*`.
    #[arg(long, env = "GRAMIAN_CORS_ORIGINS")]
    pub cors_origins: Option<Origins>,
}

impl Settings {
    /// Compute threads, at least one.
    pub fn n_threads(&self) -> usize {
        match self.threads {
            0 => std::thread::available_parallelism().map_or(1, usize::from),
            n => n,
        }
    }

    /// Bytes of memory for everything.
    pub fn memory_bytes(&self) -> usize {
        self.memory_bytes.unwrap_or_else(machine::default_bytes)
    }

    /// Time by which a body may be late.
    pub fn body_timeout(&self) -> Duration {
        Duration::from_secs_f64(self.body_seconds)
    }

    /// The deadline as a duration.
    pub fn deadline(&self) -> Duration {
        Duration::from_secs_f64(self.deadline_seconds)
    }

    /// [`Settings::idle_seconds`] as a duration.
    pub fn idle(&self) -> Duration {
        Duration::from_secs_f64(self.idle_seconds)
    }

    /// [`Settings::send_seconds`] as a duration.
    pub fn sending(&self) -> Duration {
        Duration::from_secs_f64(self.send_seconds)
    }

    /// [`Settings::drain_seconds`] as a duration.
    pub fn drain(&self) -> Duration {
        Duration::from_secs_f64(self.drain_seconds)
    }

    /// Time for which the result of a job is kept.
    pub fn job_result(&self) -> Duration {
        Duration::from_secs_f64(self.job_result_seconds)
    }

    /// Times after which jobs of removed keys are deleted: since their end, or since the last work on an
    /// unfinished one.
    pub fn job_retention(&self) -> (Duration, Duration) {
        (self.job_result(), self.job_result() + Duration::from_secs_f64(self.job_seconds))
    }

    /// Returns whether the service runs without keys.
    pub fn is_open(&self) -> bool {
        self.api_keys.is_empty() && self.keys_file.is_none()
    }

    /// Number of owners that share memory and queue. A file of keys counts as at least two.
    pub fn n_owners(&self) -> usize {
        if self.keys_file.is_some() { self.api_keys.len().max(2) } else { self.api_keys.len().max(1) }
    }

    /// Returns whether other machines reach the service and need no key.
    pub fn is_exposed(&self) -> bool {
        self.is_open() && !self.bind.ip().to_canonical().is_loopback()
    }
}

/// Parses a number of bytes, at least as many as the process needs to answer at all.
fn enough_bytes(text: &str) -> Result<usize, String> {
    match bytes::<1, _>(text)? {
        bytes if bytes >= machine::LEAST_BYTES => Ok(bytes),
        _ => Err(format!("must be at least {}MiB, such as 4G", machine::LEAST_BYTES.div_ceil(1 << 20))),
    }
}

/// Bounds beyond any real machine. Sums of products of settings within them fit 64 bits.
pub const MAX_COUNT: u64 = 1 << 30;
pub const MAX_BYTES: u64 = 1 << 50;

/// Parses a whole number within bounds.
///
/// # Errors
/// Tells the bounds.
pub fn whole<const MIN: u64, const MAX: u64>(text: &str) -> Result<usize, String> {
    let number = text.parse::<u64>().ok().filter(|number| (MIN..=MAX).contains(number));
    let number = number.and_then(|number| usize::try_from(number).ok());
    number.ok_or_else(|| format!("must be a whole number from {MIN} to {MAX}"))
}

/// Parses a number of bytes with or without a unit, of which K, M, G and T are powers of 1024.
///
/// # Errors
/// Tells the bounds, with an example.
pub fn bytes<const MIN: u64, T: TryFrom<u64>>(text: &str) -> Result<T, String> {
    let bytes = Sizes::new().with_binary().parse_size(text).ok();
    let bytes = bytes.filter(|bytes| (MIN..=MAX_BYTES).contains(bytes));
    let bytes = bytes.and_then(|bytes| T::try_from(bytes).ok());
    bytes.ok_or_else(|| format!("must be a number of bytes from {MIN} to {MAX_BYTES}, such as 512MiB or 4G"))
}

/// Parses an IP address, or `localhost`, with a port. Other names are not resolved: they may be those of
/// several addresses, and others the next day.
fn address(text: &str) -> Result<SocketAddr, String> {
    let port = text.strip_prefix("localhost:").and_then(|port| port.parse().ok());
    let address =
        port.map(|port| SocketAddr::from((Ipv4Addr::LOCALHOST, port))).or_else(|| text.parse().ok());
    address.ok_or_else(|| {
        "must be an IP address and a port, such as 127.0.0.1:8080 or localhost:8080 for this machine alone, or \
         0.0.0.0:8080 for all networks"
            .to_owned()
    })
}

/// Parses `1` and `0` as well as `true` and `false`.
///
/// # Errors
/// For any other text.
pub fn flag(text: &str) -> Result<bool, String> {
    match text {
        "1" | "true" => Ok(true),
        "0" | "false" => Ok(false),
        _ => Err("must be 1 or 0".to_owned()),
    }
}

/// Parses seconds up to ten years, so that instants that far ahead are representable.
fn positive_seconds(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(seconds) if seconds > 0.0 && seconds <= 3e8 => Ok(seconds),
        _ => Err("must be a positive number of seconds, at most 3e8, such as 30 or 0.5".to_owned()),
    }
}

/// Parses one key. A blank one is refused: a variable meant to hold keys that holds none would leave the
/// service open.
fn api_key(text: &str) -> Result<String, String> {
    match text.trim() {
        "" => Err("a key is blank; unset GRAMIAN_API_KEYS to run without keys".to_owned()),
        key => Ok(key.to_owned()),
    }
}

/// Origins that browsers may call from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Origins {
    /// Every origin.
    Any,
    /// Listed origins, as browsers write them: `scheme://host[:port]`.
    Listed(Vec<String>),
}

impl FromStr for Origins {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let entries: Vec<&str> = text.split(',').map(str::trim).collect();
        match entries[..] {
            ["*"] => Ok(Self::Any),
            _ if entries.contains(&"*") => Err("* stands alone: it means every origin".to_owned()),
            _ => entries.into_iter().map(origin).collect::<Result<_, _>>().map(Self::Listed),
        }
    }
}

/// Checks the form of an origin. Browsers send origins in lower case, without a path and without the port
/// that the scheme implies. An origin written otherwise would never match.
fn origin(text: &str) -> Result<String, String> {
    let refused = || format!("{text:?} is no origin such as https://app.example or http://localhost:3000");
    let uri: Uri = text.parse().map_err(|_| refused())?;
    let (Some(scheme), Some(authority)) = (uri.scheme(), uri.authority()) else { return Err(refused()) };
    let is_implied = |port| matches!((scheme.as_str(), port), ("http", 80) | ("https", 443));
    let is_plain = text == format!("{scheme}://{authority}") && !text.contains('@');
    let is_canonical = text == text.to_ascii_lowercase() && !authority.port_u16().is_some_and(is_implied);
    let is_port = authority.port().is_some() || !authority.as_str().ends_with(':');
    (is_plain && is_canonical && is_port && !authority.host().is_empty())
        .then(|| text.to_owned())
        .ok_or_else(refused)
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;

    #[derive(Parser)]
    struct Flags {
        #[command(flatten)]
        settings: Settings,
    }

    fn settings(flags: &[&str]) -> Result<Settings, String> {
        let flags = Flags::try_parse_from(["gramian"].iter().chain(flags));
        flags.map(|flags| flags.settings).map_err(|error| error.to_string())
    }

    #[test]
    fn origins_are_written_as_browsers_send_them() {
        assert_eq!("*".parse(), Ok(Origins::Any));
        let listed = |text: &str| text.parse::<Origins>().unwrap();
        let two = Origins::Listed(vec!["https://a.example".into(), "http://localhost:3000".into()]);
        assert_eq!(listed("https://a.example, http://localhost:3000"), two);
        assert_eq!(listed("http://[::1]:8080"), Origins::Listed(vec!["http://[::1]:8080".into()]));
        for bad in [
            "",
            " ",
            ",",
            "https://a.example,",
            "https://a.example, *",
            "*,*",
            "null",
            "a.example",
            "a.example:80",
            "https://",
            "https://a.example/",
            "https://a.example/path",
            "https://a.example?q",
            "https://A.example",
            "HTTPS://a.example",
            "https://a.example:443",
            "http://a.example:80",
            "https://a.example:",
            "https://me@a.example",
            "https://a b.example",
            "//a.example",
            "https://a.example https://b.example",
            "https://ä.example",
        ] {
            assert!(bad.parse::<Origins>().is_err(), "{bad:?} is taken");
        }
    }

    #[test]
    fn sizes_have_units_and_localhost_is_an_address() {
        let body = |text: &str| {
            settings(&[&format!("--max-body-bytes={text}")]).map(|settings| settings.max_body_bytes)
        };
        for (text, expected) in
            [("4G", 4 << 30), ("512MiB", 512 << 20), ("1.5k", 1536), ("2 GB", 2 << 30), ("17", 17)]
        {
            assert_eq!(body(text), Ok(expected), "{text}");
        }
        for bad in ["", " ", "0", "-1", "4 apples", "1e30", "9999P"] {
            assert!(body(bad).unwrap_err().contains("such as 512MiB or 4G"), "{bad:?}");
        }
        let bind =
            |text: &str| settings(&[&format!("--bind={text}")]).map(|settings| settings.bind.to_string());
        assert_eq!(bind("localhost:9000").as_deref(), Ok("127.0.0.1:9000"));
        for bad in ["localhost", "8080", ":8080", "example.org:80", "localhost:99999"] {
            assert!(bind(bad).unwrap_err().contains("localhost:8080"), "{bad:?}");
        }
    }

    #[test]
    fn a_blank_key_is_refused_wherever_it_stands() {
        for bad in ["", " ", ",", "a,", ",a", "a,,b", "a, ,b"] {
            let error = settings(&["--api-keys", bad]).unwrap_err();
            assert!(error.contains("GRAMIAN_API_KEYS") && error.contains("--api-keys"), "{error}");
        }
        assert_eq!(settings(&["--api-keys", " a ,b"]).unwrap().api_keys, ["a", "b"]);
        assert!(settings(&[]).unwrap().api_keys.is_empty());
    }

    #[test]
    fn a_service_without_keys_is_exposed_beyond_the_loopback() {
        for (bind, is_exposed) in [
            ("127.0.0.1:0", false),
            ("127.8.8.8:0", false),
            ("[::1]:0", false),
            ("[::ffff:127.0.0.1]:0", false),
            ("0.0.0.0:0", true),
            ("[::]:0", true),
            ("192.0.2.1:0", true),
        ] {
            assert_eq!(settings(&["--bind", bind]).unwrap().is_exposed(), is_exposed, "{bind}");
            assert!(!settings(&["--bind", bind, "--api-keys", "a"]).unwrap().is_exposed());
        }
    }
}
