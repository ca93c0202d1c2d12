//! Settings of the process, each with a flag and an environment variable of the same name.

use std::time::Duration;

use clap::Args;

use crate::store::objects::Retention;
use gramian_host::state::settings::{MAX_COUNT, Settings, bytes, flag, whole};

/// The configuration, read once in `main` and passed down.
#[derive(Debug, Clone, clap::Args)]
pub struct Config {
    #[command(flatten)]
    pub host: Settings,

    /// Bytes of this memory for cached factorizations and weights, an eighth of them for the next
    /// factorization. Less where work needs them.
    #[arg(long, env = "GRAMIAN_CACHE_BYTES", default_value = "4GiB", value_parser = bytes::<0, usize>)]
    pub cache_bytes: usize,

    /// Bytes of this memory for registered clouds, at most an eighth of all.
    #[arg(long, env = "GRAMIAN_CLOUD_BYTES", default_value = "512MiB", value_parser = bytes::<0, usize>)]
    pub cloud_bytes: usize,

    /// Points a cloud may have, with any solver.
    #[arg(long, env = "GRAMIAN_MAX_POINTS", default_value_t = 2_000_000, value_parser = whole::<1, MAX_COUNT>)]
    pub max_points: usize,

    /// Points that are factorized densely, which takes 4 n² bytes and n³/3 flops.
    #[arg(long, env = "GRAMIAN_MAX_DENSE_POINTS", default_value_t = 20_000, value_parser = whole::<1, MAX_COUNT>)]
    pub max_dense_points: usize,

    /// Queries a request may have.
    #[arg(long, env = "GRAMIAN_MAX_QUERIES", default_value_t = 2_000_000, value_parser = whole::<1, MAX_COUNT>)]
    pub max_queries: usize,

    /// Coordinates a point may have.
    #[arg(long, env = "GRAMIAN_MAX_DIMENSION", default_value_t = 16, value_parser = whole::<1, MAX_COUNT>)]
    pub max_dimension: usize,

    /// Bytes an answer may have, estimated at 25 bytes per number before anything is computed.
    #[arg(long, env = "GRAMIAN_MAX_RESPONSE_BYTES", default_value = "1GiB", value_parser = bytes::<1, usize>)]
    pub max_response_bytes: usize,

    /// Whether the service is ready only while the store takes all clouds.
    #[arg(long, env = "GRAMIAN_STORE_REQUIRED", default_value_t = false, action = clap::ArgAction::Set, value_parser = flag)]
    pub store_required: bool,

    /// Days that a cloud stays in the store after it was written. Absent: forever.
    #[arg(long, env = "GRAMIAN_STORE_DAYS", value_parser = positive_days)]
    pub store_days: Option<f64>,

    /// Bytes of clouds in the store. Beyond them the oldest are deleted. Absent: unlimited.
    #[arg(long, env = "GRAMIAN_STORE_BYTES", value_parser = bytes::<1, u64>)]
    pub store_bytes: Option<u64>,

    /// Bytes of factorizations in the store. Beyond them the oldest are deleted. 0 keeps none.
    #[arg(long, env = "GRAMIAN_STORE_FACTOR_BYTES", default_value = "16GiB", value_parser = bytes::<0, u64>)]
    pub store_factor_bytes: u64,
}

impl Config {
    /// Limits on the age and the bytes of the store.
    pub fn retention(&self) -> Retention {
        let age = self.store_days.map(|days| Duration::from_secs_f64(days * 86400.0));
        Retention { age, n_bytes: self.store_bytes, n_factor_bytes: self.store_factor_bytes }
    }

    /// Returns the names that look like settings but are none, usually because of a typing error, each with
    /// the nearest setting if one is near.
    pub fn unknown_variables(names: impl Iterator<Item = String>) -> Vec<UnknownVariable> {
        let command = Self::augment_args(clap::Command::new("gramian"));
        let settings: Vec<&str> =
            command.get_arguments().filter_map(|arg| arg.get_env().and_then(|name| name.to_str())).collect();
        let unknown = names.filter(|name| name.starts_with(PREFIX) && !settings.contains(&name.as_str()));
        unknown.map(|name| UnknownVariable { nearest: nearest(&name, &settings), name }).collect()
    }
}

/// Beginning of the names of all settings in the environment.
const PREFIX: &str = "GRAMIAN_";

/// Least similarity (Jaro) of a mistyped name to the meant one, as clap has it for options.
const LEAST_SIMILARITY: f64 = 0.7;

/// A variable that looks like a setting and is none.
#[derive(Debug, PartialEq, Eq)]
pub struct UnknownVariable {
    pub name: String,
    /// The setting with the most similar name.
    pub nearest: Option<String>,
}

/// The setting that is most similar to a name. The common beginning does not count.
fn nearest(name: &str, settings: &[&str]) -> Option<String> {
    let own = |name: &str| name.trim_start_matches(PREFIX).to_owned();
    let similarity = |setting: &&str| (strsim::jaro(&own(name), &own(setting)), setting.to_string());
    let best = settings.iter().map(similarity).max_by(|(a, _), (b, _)| a.total_cmp(b));
    best.filter(|(similarity, _)| *similarity > LEAST_SIMILARITY).map(|(_, setting)| setting)
}

/// Parses days up to ten years, so that instants that far ahead are representable.
fn positive_days(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(days) if days > 0.0 && days <= 3650.0 => Ok(days),
        _ => Err("must be a positive number of days, at most 3650".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mistyped_variables_are_found() {
        let names =
            ["GRAMIAN_API_KEY", "GRAMIAN_API_KEYS", "GRAMIAN_BIND", "PATH", "GRAMIAN_QQ", "GRAMIAN_CACHE"];
        let found = Config::unknown_variables(names.map(str::to_owned).into_iter());
        let found: Vec<_> =
            found.iter().map(|found| (found.name.as_str(), found.nearest.as_deref())).collect();
        let expected = [
            ("GRAMIAN_API_KEY", Some("GRAMIAN_API_KEYS")),
            ("GRAMIAN_QQ", None),
            ("GRAMIAN_CACHE", Some("GRAMIAN_CACHE_BYTES")),
        ];
        assert_eq!(found, expected);
    }
}
