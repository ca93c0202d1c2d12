//! What the operating system says about this process. Linux alone says it in files, so others have none.

use std::fs;

use rustix::param::{clock_ticks_per_second, page_size};
use rustix::process::{Resource, getrlimit};

/// Use of the machine by this process, under the names that clients of Prometheus agree on.
#[derive(Debug)]
pub struct Usage {
    /// Processor time of all threads, in seconds.
    pub cpu_seconds: f64,
    pub n_open_files: usize,
    /// `None` if there is no limit.
    pub max_open_files: Option<u64>,
    pub virtual_bytes: u64,
    pub resident_bytes: u64,
    /// Seconds since 1970.
    pub started: u64,
    pub n_threads: u64,
}

impl Usage {
    /// Reads `/proc` (proc(5)). `None` where there is none.
    pub fn read() -> Option<Self> {
        let stat = fs::read_to_string("/proc/self/stat").ok()?;
        let of_machine = fs::read_to_string("/proc/stat").ok()?;
        let boot = of_machine.lines().find_map(|line| line.strip_prefix("btime "))?;
        let n_open_files = fs::read_dir("/proc/self/fd").ok()?.count();
        Self::parse(&stat, boot.trim().parse().ok()?, n_open_files)
    }

    /// Parses the line of `/proc/self/stat`. The second field is the name of the program in parentheses, and
    /// may contain spaces and parentheses.
    fn parse(stat: &str, boot: u64, n_open_files: usize) -> Option<Self> {
        let fields: Vec<&str> = stat.rsplit_once(')')?.1.split_whitespace().collect();
        // proc(5) counts from 1, and two fields are behind.
        let field = |number: usize| fields.get(number - 3)?.parse::<u64>().ok();
        let ticks = clock_ticks_per_second();
        Some(Self {
            cpu_seconds: (field(14)? + field(15)?) as f64 / ticks as f64,
            n_open_files,
            max_open_files: getrlimit(Resource::Nofile).current,
            virtual_bytes: field(23)?,
            resident_bytes: field(24)? * page_size() as u64,
            started: boot + field(22)? / ticks,
            n_threads: field(20)?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_name_of_a_program_may_hold_anything() {
        let stat = "7 (a) b (c)) S 1 7 7 0 -1 4194560 9 0 0 0 150 50 0 0 20 0 3 0 1000 4096 2 0";
        let usage = Usage::parse(stat, 100, 5).unwrap();
        let ticks = clock_ticks_per_second();
        assert_eq!(usage.cpu_seconds, 200.0 / ticks as f64);
        assert_eq!((usage.n_threads, usage.virtual_bytes), (3, 4096));
        assert_eq!(usage.resident_bytes, 2 * page_size() as u64);
        assert_eq!((usage.started, usage.n_open_files), (100 + 1000 / ticks, 5));
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn this_process_has_memory_threads_and_files() {
        let usage = Usage::read().unwrap();
        assert!(usage.resident_bytes > 1 << 20 && usage.virtual_bytes >= usage.resident_bytes);
        assert!(usage.n_threads >= 1 && usage.n_open_files >= 3);
        let age = std::time::SystemTime::UNIX_EPOCH.elapsed().unwrap().as_secs().abs_diff(usage.started);
        assert!(age < 24 * 3600, "{age}");
    }
}
