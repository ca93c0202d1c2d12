//! How a run goes on where there are several ways: at random, or each way in turn.

use super::random::Random;

/// Where a run goes on, of several ways.
pub trait Choose {
    fn below(&mut self, n: usize) -> usize;
}

impl Choose for Random {
    fn below(&mut self, n: usize) -> usize {
        (self.uniform() * n as f64) as usize
    }
}

/// All ways, one after the other: choices and of how many, the last of which changes first.
#[derive(Default)]
pub struct Odometer {
    digits: Vec<(usize, usize)>,
    at: usize,
}

impl Choose for Odometer {
    fn below(&mut self, n: usize) -> usize {
        if self.at == self.digits.len() {
            self.digits.push((0, n));
        }
        let (digit, was) = self.digits[self.at];
        assert_eq!(was, n, "a run does not repeat itself");
        self.at += 1;
        digit
    }
}

impl Odometer {
    /// Turns to the next way; says whether there is one.
    pub fn turn(&mut self) -> bool {
        self.at = 0;
        while let Some((digit, n)) = self.digits.pop() {
            if digit + 1 < n {
                self.digits.push((digit + 1, n));
                return true;
            }
        }
        false
    }
}
