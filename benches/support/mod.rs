//! What the benchmarks share: rounds and clouds.

use std::io::{BufRead, Write};
use std::time::{Duration, Instant};

use gramian::numerics::points::cloud::Cloud;

/// Rounds of a benchmark that runs by itself.
pub const ROUNDS: usize = 7;

/// The parts of a round in the order of their measurement, each with its time.
pub type Times = Vec<(&'static str, Duration)>;

/// The least time of each part, in seconds.
pub struct Bests(Vec<(&'static str, f64)>);

impl Bests {
    /// The best time of a part that was measured.
    #[allow(dead_code, reason = "not every benchmark derives figures")]
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

/// Runs [`ROUNDS`] rounds and answers with the best times.
///
/// With the argument `--lockstep` it runs a round for each line on standard input instead, prints it as lines
/// `part<TAB>seconds<TAB>s` and an empty line, and answers `None` at the end: so that another process can measure a reference
/// in turn, with warm memory on both sides.
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

/// What a piece of work answers, and its time.
pub fn timed<T>(work: impl FnOnce() -> T) -> (T, Duration) {
    let began = Instant::now();
    let result = work();
    (result, began.elapsed())
}

/// n points on the unit sphere: a Fibonacci spiral, turned by an angle.
pub fn sphere(n: usize, angle: f64) -> Cloud {
    let golden = std::f64::consts::PI * (1.0 + 5f64.sqrt());
    let point = |i: usize| {
        let z = 1.0 - (2 * i + 1) as f64 / n as f64;
        let (r, t) = ((1.0 - z * z).sqrt(), golden * i as f64 + angle);
        [r * t.cos(), r * t.sin(), z]
    };
    Cloud::new((0..n).flat_map(point).collect(), 3).unwrap()
}
