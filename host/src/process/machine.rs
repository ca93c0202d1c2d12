//! Memory limits of the machine and of the control groups around the process.

use std::path::Path;

/// Least memory in which the process can work: itself, and clouds of some hundred points.
pub const LEAST_BYTES: usize = 128 << 20;

/// Three quarters of the memory that the process may use: the least of the machine's and its control groups'
/// limits.
pub fn default_bytes() -> usize {
    let limit = usize::try_from(limit(Path::new("/"))).unwrap_or(usize::MAX);
    (limit / 4 * 3).max(LEAST_BYTES)
}

/// The least of the machine's memory and the limits of all control groups around the process, of either
/// version. Every ancestor binds. In a container the path of the group may not exist, but its ancestors do.
fn limit(root: &Path) -> u64 {
    let read = |path: &str| std::fs::read_to_string(root.join(path.trim_start_matches('/'))).ok();
    // Without a limit, the file says "max".
    let number = |path: &str| read(path)?.trim().parse::<u64>().ok();
    let machine = read("/proc/meminfo").and_then(|text| {
        let line = text.lines().find(|line| line.starts_with("MemTotal:"))?;
        line.split_whitespace().nth(1)?.parse::<u64>().ok()?.checked_mul(1024)
    });
    let mut least = machine.unwrap_or(FALLBACK_BYTES);
    for line in read("/proc/self/cgroup").unwrap_or_default().lines() {
        let mut fields = line.splitn(3, ':').skip(1);
        let (Some(controllers), Some(path)) = (fields.next(), fields.next()) else { continue };
        let (mount, file) = if controllers.is_empty() {
            ("/sys/fs/cgroup", "memory.max")
        } else if controllers.split(',').any(|controller| controller == "memory") {
            ("/sys/fs/cgroup/memory", "memory.limit_in_bytes")
        } else {
            continue;
        };
        for group in Path::new(path).ancestors() {
            let group = group.to_str().unwrap_or_default().trim_end_matches('/');
            least = least.min(number(&format!("{mount}{group}/{file}")).unwrap_or(u64::MAX));
        }
    }
    least
}

/// Memory assumed where the operating system does not report it.
const FALLBACK_BYTES: u64 = 4 << 30;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_least_limit_around_the_process_counts() {
        let root = std::env::temp_dir().join(format!("gramian-memory-{}", std::process::id()));
        let write = |path: &str, text: &str| {
            let path = root.join(path);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, text).unwrap();
        };
        assert_eq!(limit(&root), FALLBACK_BYTES);
        write("proc/meminfo", "MemFree: 7 kB\nMemTotal:       1000 kB\n");
        assert_eq!(limit(&root), 1000 << 10);
        write("proc/self/cgroup", "12:cpu,memory:/a/b\n3:pids:/c\n0::/d/e\n");
        write("sys/fs/cgroup/memory/a/memory.limit_in_bytes", "900000\n");
        write("sys/fs/cgroup/memory/a/b/memory.limit_in_bytes", "9223372036854771712\n");
        assert_eq!(limit(&root), 900_000);
        write("sys/fs/cgroup/d/e/memory.max", "max\n");
        write("sys/fs/cgroup/memory.max", "800000\n");
        assert_eq!(limit(&root), 800_000);
        std::fs::remove_dir_all(&root).unwrap();
    }
}
