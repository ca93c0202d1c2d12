//! The memory budget of the process, divided into parts by purpose.
//!
//! Everything that a request can make the process hold is reserved from a part before it is allocated. The
//! parts hold bodies that are read, unpacked and parsed, clouds in memory, and factors and weights, cached or
//! in use. They also hold work with these, and answers until their last byte is sent. Fixed costs of threads,
//! allocator and the program itself have a part as well.

use crate::config::Config;
use gramian_host::state::host::Shares;

/// Bytes that the process takes without any request: the program, and stacks and scratch space of two
/// threads.
const OWN_BYTES: usize = 48 << 20;

/// Stacks and packing buffers of a further thread of each lane.
const BYTES_PER_THREAD: usize = 20 << 20;

/// Divisor of the budget left by the process, clouds and spare: the part for requests that are read,
/// unpacked, parsed or wait.
const INTAKE_SHARE: usize = 4;

/// Divisor of the budget left by the process, clouds and spare: the part for jobs and their results, if they
/// are in memory.
const JOBS_SHARE: usize = 32;

/// Divisor of the intake that gives the limit of one body. A body takes at most six times its limit: itself,
/// its unpacked form, and four times that as numbers. One body may reserve seven eighths of the intake, which
/// is seven times its limit.
const BODIES_PER_REQUEST: usize = 8;

/// Divisor of the intake for several owners. One owner may reserve half of it, which is seven times the
/// limit.
const BODIES_PER_REQUEST_OF_MANY: usize = 14;

/// Bytes of each part.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Memory {
    /// Parts of the host. Factors and weights, cached or in use, are in that for work.
    pub shares: Shares,
    /// Registered clouds.
    pub clouds: usize,
    /// Cached factors and weights, a part of `work`.
    pub cache: usize,
    /// Reserve for the next factorization.
    pub spare: usize,
}

impl Memory {
    /// Divides the budget. The settings for single parts are upper bounds.
    pub fn of(config: &Config) -> Self {
        let total = config.host.memory_bytes();
        let own = (OWN_BYTES + BYTES_PER_THREAD * config.host.n_threads()).min(total / 3);
        let clouds = config.cloud_bytes.min(total / 8);
        let spare = (config.cache_bytes / 8).min(total / 16);
        let rest = total - own - clouds - spare;
        let intake = rest / INTAKE_SHARE;
        let n_bodies =
            if config.host.n_owners() > 1 { BODIES_PER_REQUEST_OF_MANY } else { BODIES_PER_REQUEST };
        let jobs = if config.host.store.is_none() { rest / JOBS_SHARE } else { 0 };
        let work = rest - intake - jobs;
        let body = config.host.max_body_bytes.min(intake / n_bodies);
        let cache = (config.cache_bytes - config.cache_bytes / 8).min(work);
        Self { shares: Shares { intake, body, jobs, work }, clouds, cache, spare }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gramian_host::memory::budget::Budget;
    use gramian_host::process::machine::LEAST_BYTES;

    fn config(flags: &[&str]) -> Config {
        #[derive(clap::Parser)]
        struct Flags {
            #[command(flatten)]
            config: Config,
        }
        use clap::Parser;
        Flags::parse_from(["gramian"].iter().chain(flags)).config
    }

    #[test]
    fn the_parts_never_exceed_the_whole() {
        for bytes in [LEAST_BYTES, 512 << 20, 1 << 30, 64 << 30] {
            for threads in ["1", "2", "64"] {
                let bytes_text = bytes.to_string();
                for (keys, n_owners) in [(&[][..], 1), (&["--api-keys", "a,b"][..], 2)] {
                    let config =
                        config(&[&["--memory-bytes", &bytes_text, "--threads", threads][..], keys].concat());
                    let memory = Memory::of(&config);
                    let sum = memory.shares.intake
                        + memory.shares.jobs
                        + memory.clouds
                        + memory.shares.work
                        + memory.spare;
                    assert!(sum < bytes && sum > bytes / 2, "{bytes} {threads}: {memory:?}");
                    let largest = Budget::new(memory.shares.intake, n_owners).largest();
                    assert!(
                        memory.cache <= memory.shares.work && 6 * memory.shares.body <= largest,
                        "{memory:?}"
                    );
                }
            }
        }
        // With enough memory, each part is as large as its setting.
        let memory = Memory::of(&config(&["--memory-bytes", "68719476736", "--threads", "2"]));
        assert_eq!(
            (memory.clouds, memory.shares.body, memory.cache + memory.spare),
            (512 << 20, 256 << 20, 4 << 30)
        );
    }

    #[test]
    fn a_million_points_are_served_by_default_where_there_are_eight_gigabytes() {
        const N: usize = 1_000_000;
        // Coordinates as JSON writes them at their longest, and space that some writers leave between them.
        const JSON_BYTES: usize = N * 3 * 25;
        let bytes = (8_usize << 30) / 4 * 3;
        for (keys, n_owners) in [(&[][..], 1), (&["--api-keys", "a,b"][..], 2)] {
            let flags = ["--memory-bytes", &bytes.to_string(), "--threads", "8"];
            let config = config(&[&flags[..], keys].concat());
            let memory = Memory::of(&config);
            assert!(
                config.max_points >= N && config.max_queries >= N && memory.shares.body >= JSON_BYTES,
                "{memory:?}"
            );
            // Points, normals and data on their neighbours.
            assert!(memory.clouds >= N * (24 + 24 + 60), "{memory:?}");
            // Curvatures with deviations: 20 numbers per point as text, and twice as numbers while they are
            // assembled.
            assert!(config.max_response_bytes >= 2 * N * 20 * 25);
            assert!(Budget::new(memory.shares.work, n_owners).largest() >= 2 * N * 20 * 8);
        }
    }
}
