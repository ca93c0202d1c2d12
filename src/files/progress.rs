//! The progress of a computation on a terminal.
//!
//! indicatif draws bars of many kinds; one line that is written again needs none of its crates.

use std::io::{IsTerminal, Write, stderr};

use serde_json::Value;

const WIDTH: usize = 30;

/// A line on standard error, if that is a terminal and nobody asked for quiet. It is taken away when dropped.
pub struct Progress {
    is_shown: bool,
}

impl Progress {
    pub fn new(is_quiet: bool) -> Self {
        Self { is_shown: !is_quiet && stderr().is_terminal() }
    }

    /// Shows the `progress` of a job.
    pub fn show(&mut self, progress: &Value) {
        if !self.is_shown {
            return;
        }
        // A terminal that is gone is no reason to stop.
        let _ = write!(stderr(), "\r\x1b[K{}", line(progress));
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if self.is_shown {
            let _ = write!(stderr(), "\r\x1b[K");
        }
    }
}

/// A bar with the stage, and the seconds left if they are known.
fn line(progress: &Value) -> String {
    let fraction = progress["fraction"].as_f64().unwrap_or(0.0).clamp(0.0, 1.0);
    let n_full = (fraction * WIDTH as f64).round() as usize;
    let stage = progress["stage"].as_str().unwrap_or("waiting");
    let left = progress["seconds_left"].as_f64().map(|seconds| format!(", {seconds:.0} s left"));
    let bar = format!("{}{}", "#".repeat(n_full), ".".repeat(WIDTH - n_full));
    format!("[{bar}] {stage}{}", left.unwrap_or_default())
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn a_line_has_bar_stage_and_time() {
        let progress = json!({"stage": "factor", "fraction": 0.5, "seconds_left": 12.4});
        assert_eq!(line(&progress), format!("[{}{}] factor, 12 s left", "#".repeat(15), ".".repeat(15)));
        assert_eq!(line(&json!({})), format!("[{}] waiting", ".".repeat(30)));
    }
}
