//! Choice of the next step in a run: at random, or every alternative in turn.

use super::random::Random;

/// A source of choices between `n` alternatives.
pub trait Choose {
    fn below(&mut self, n: usize) -> usize;
}

impl Choose for Random {
    fn below(&mut self, n: usize) -> usize {
        (self.uniform() * n as f64) as usize
    }
}

/// An enumeration of all sequences of choices. A digit is a choice with the number of its alternatives. The
/// last digit changes first.
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
    /// Advances to the next sequence. Returns whether there is one.
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
