//! Rounds, clouds and stopwatches shared by the benchmarks.

#![allow(dead_code, reason = "each benchmark takes what it needs")]
#![allow(clippy::disallowed_methods, reason = "nothing waits for a stopwatch")]

#[path = "../../tests/common/mod.rs"]
pub mod common;

use std::io::{BufRead, Write};
use std::sync::Mutex;
use std::time::{Duration, Instant};

use gramian_numerics::observer::{Observer, Stage};
use gramian_numerics::points::cloud::Cloud;

/// Rounds of a benchmark without `--lockstep`.
pub const ROUNDS: usize = 7;

/// Parts of a round in the order of their measurement, each with its time.
pub type Times = Vec<(&'static str, Duration)>;

/// The least time of each part, in seconds.
pub struct Bests(Vec<(&'static str, f64)>);

impl Bests {
    /// The best time of a measured part.
    pub fn seconds(&self, part: &str) -> f64 {
        self.0.iter().find(|entry| entry.0 == part).unwrap().1
    }

    /// Prints all parts, one a line.
    pub fn print(&self) {
        for (part, seconds) in &self.0 {
            println!("{part:24} {:10.2} ms", seconds * 1e3);
        }
    }
}

/// Runs [`ROUNDS`] rounds and returns the best times.
///
/// With the argument `--lockstep` it runs a round for each line on standard input instead. It prints each
/// round as lines `part<TAB>seconds<TAB>s` and an empty line, and returns `None` at the end. Another process
/// can then measure a reference in turn, with warm memory on both sides.
pub fn measure(mut round: impl FnMut() -> Times) -> Option<Bests> {
    if !std::env::args().any(|argument| argument == "--lockstep") {
        let mut bests = Bests(Vec::new());
        for _ in 0..ROUNDS {
            for (part, time) in round() {
                bests.offer(part, time.as_secs_f64());
            }
        }
        return Some(bests);
    }
    for _ in std::io::stdin().lock().lines() {
        let mut output = std::io::stdout().lock();
        for (part, time) in round() {
            writeln!(output, "{part}\t{:.9}\ts", time.as_secs_f64()).unwrap();
        }
        writeln!(output).unwrap();
        output.flush().unwrap();
    }
    None
}

impl Bests {
    fn offer(&mut self, part: &'static str, seconds: f64) {
        match self.0.iter_mut().find(|entry| entry.0 == part) {
            Some(entry) => entry.1 = entry.1.min(seconds),
            None => self.0.push((part, seconds)),
        }
    }
}

/// The size given as an argument.
pub fn size_argument(default: usize) -> usize {
    std::env::args().skip(1).find_map(|argument| argument.parse().ok()).unwrap_or(default)
}

/// Runs a piece of work and returns its result and its time.
pub fn timed<T>(work: impl FnOnce() -> T) -> (T, Duration) {
    let began = Instant::now();
    let result = work();
    (result, began.elapsed())
}

/// n points in the unit cube of R^d.
pub fn scattered(n: usize, d: usize, seed: u64) -> Cloud {
    Cloud::new(random(n * d, seed), d).unwrap()
}

/// n numbers in [0, 1) with 53 random bits.
///
/// The generator of the tests is not used, since the counts in
/// benches/instructions.tsv depend on these numbers.
pub fn random(n: usize, seed: u64) -> Vec<f64> {
    let mut state = seed;
    let mut next = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 53) as f64
    };
    (0..n).map(|_| next()).collect()
}

/// An observer that notes when each stage begins.
#[derive(Default)]
pub struct Stopwatch(Mutex<Vec<(Stage, Instant)>>);

impl Observer for Stopwatch {
    fn enter(&self, stage: Stage) {
        self.0.lock().unwrap().push((stage, Instant::now()));
    }

    fn is_cancelled(&self) -> bool {
        false
    }
}

impl Stopwatch {
    /// Time from the beginning of a stage to that of the next, or to `end` for the last stage.
    pub fn time(&self, stage: Stage, end: Instant) -> Duration {
        let entries = self.0.lock().unwrap();
        let at = entries.iter().position(|entry| entry.0 == stage).unwrap();
        entries.get(at + 1).map_or(end, |next| next.1) - entries[at].1
    }
}
