//! A strict scanner of the heads of HTTP/1 requests, against request smuggling.
//!
//! WHY. hyper removes the Content-Length of a request that also has a Transfer-Encoding, and accepts a bare
//! line feed as the end of a line. No service behind hyper can tell. A proxy in front that reads such a
//! request differently would take the bytes of one client for the request of another. So the bytes are
//! scanned on their way to hyper, and requests that two parsers may understand differently are refused.
//!
//! HOW. The scanner follows the framing: lines up to the empty one, then as many body bytes as the head says.
//! It is stricter than hyper. Where it finds no fault, both agree on where a request ends. After a fault it
//! stops for good: every later request is refused and the connection closed.

use crate::around::transport::HeadFault;

/// Bytes of a line that are kept. A longer line is no header that matters here, or has no good value.
const KEPT_BYTES: usize = 64;

/// First line of an HTTP/2 connection.
const HTTP_2: &[u8] = b"PRI * HTTP/2.0";

/// State of the scanner: what comes next.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    Line(Line),
    /// A number of bytes of a body or chunk to skip, then a line.
    Skip(u64, Line),
    /// Nothing to scan: HTTP/2, or a fault was found.
    Off,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Line {
    Request,
    Field,
    ChunkSize,
    ChunkEnd,
    Trailer,
}

/// Scanner of the requests of one connection.
pub struct HeadScanner {
    state: State,
    kept: [u8; KEPT_BYTES],
    /// Bytes of the line so far, its end included.
    n: usize,
    last: u8,
    /// Content-Length of the head so far.
    length: Option<u64>,
    is_chunked: bool,
}

impl HeadScanner {
    pub fn new() -> Self {
        Self {
            state: State::Line(Line::Request),
            kept: [0; KEPT_BYTES],
            n: 0,
            last: 0,
            length: None,
            is_chunked: false,
        }
    }

    /// Returns whether all requests so far are complete. Always false in HTTP/2 and after a fault.
    pub fn is_between_requests(&self) -> bool {
        self.state == State::Line(Line::Request) && self.n == 0
    }

    /// Scans received bytes, in portions of any size.
    ///
    /// # Errors
    /// Returns the first fault, once.
    pub fn scan(&mut self, mut bytes: &[u8]) -> Result<(), HeadFault> {
        while !bytes.is_empty() {
            match self.state {
                State::Off => return Ok(()),
                State::Skip(left, then) => {
                    let n = left.min(bytes.len() as u64);
                    bytes = &bytes[n as usize..];
                    self.state = if n == left { State::Line(then) } else { State::Skip(left - n, then) };
                }
                State::Line(line) => {
                    let end = bytes.iter().position(|&byte| byte == b'\n');
                    let (part, rest) = bytes.split_at(end.map_or(bytes.len(), |end| end + 1));
                    bytes = rest;
                    let before = if part.len() > 1 { part[part.len() - 2] } else { self.last };
                    self.keep(part);
                    if end.is_some() {
                        let outcome = self.end_line(line, before);
                        self.n = 0;
                        self.last = 0;
                        self.state = outcome.inspect_err(|_| self.state = State::Off)?;
                    }
                }
            }
        }
        Ok(())
    }

    fn keep(&mut self, part: &[u8]) {
        let start = self.n.min(KEPT_BYTES);
        let n_kept = part.len().min(KEPT_BYTES - start);
        self.kept[start..start + n_kept].copy_from_slice(&part[..n_kept]);
        self.n = self.n.saturating_add(part.len());
        self.last = part.last().copied().unwrap_or(self.last);
    }

    /// Returns the state after a line whose last byte but one was `before`.
    fn end_line(&mut self, line: Line, before: u8) -> Result<State, HeadFault> {
        if self.n < 2 || before != b'\r' {
            return Err(HeadFault::LineEnd);
        }
        let length = self.n - 2;
        let kept = self.kept;
        let text = &kept[..length.min(KEPT_BYTES)];
        let next = |line| Ok(State::Line(line));
        match line {
            // Empty lines before a request are skipped (RFC 9112, section 2.2).
            Line::Request if length == 0 => next(Line::Request),
            Line::Request if text == HTTP_2 => Ok(State::Off),
            Line::Request => {
                (self.length, self.is_chunked) = (None, false);
                next(Line::Field)
            }
            Line::Field if length == 0 => match (self.length, self.is_chunked) {
                (_, true) => next(Line::ChunkSize),
                (Some(n), false) => Ok(State::Skip(n, Line::Request)),
                (None, false) => next(Line::Request),
            },
            Line::Field => self.field(text, length).map(|()| State::Line(Line::Field)),
            Line::ChunkSize => match chunk_size(text, length).ok_or(HeadFault::Chunks)? {
                0 => next(Line::Trailer),
                n => Ok(State::Skip(n, Line::ChunkEnd)),
            },
            Line::ChunkEnd if length == 0 => next(Line::ChunkSize),
            Line::ChunkEnd => Err(HeadFault::Chunks),
            Line::Trailer if length == 0 => next(Line::Request),
            Line::Trailer => next(Line::Trailer),
        }
    }

    /// Checks a header, whose text may be cut.
    fn field(&mut self, text: &[u8], length: usize) -> Result<(), HeadFault> {
        if matches!(text[0], b' ' | b'\t') {
            return Err(HeadFault::Folded);
        }
        let Some(colon) = text.iter().position(|&byte| byte == b':') else { return Ok(()) };
        let (name, value) = (&text[..colon], text[colon + 1..].trim_ascii());
        let is_whole = length == text.len();
        if name.eq_ignore_ascii_case(b"content-length") {
            let value = str::from_utf8(value).ok().filter(|value| is_whole && is_digits(value));
            let n = value.and_then(|value| value.parse().ok()).ok_or(HeadFault::Length)?;
            if self.length.replace(n).is_some() {
                return Err(HeadFault::Length);
            }
        } else if name.eq_ignore_ascii_case(b"transfer-encoding") {
            if self.is_chunked || !is_whole || !value.eq_ignore_ascii_case(b"chunked") {
                return Err(HeadFault::Coding);
            }
            self.is_chunked = true;
        }
        if self.is_chunked && self.length.is_some() { Err(HeadFault::TwoFramings) } else { Ok(()) }
    }
}

fn is_digits(text: &str) -> bool {
    !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit())
}

/// Parses a chunk size: hexadecimal digits, and an optional extension after a semicolon.
fn chunk_size(text: &[u8], length: usize) -> Option<u64> {
    let end = text.iter().position(|&byte| byte == b';').unwrap_or(length);
    let digits = text.get(..end).filter(|digits| (1..=15).contains(&digits.len()))?;
    // `from_str_radix` would accept a sign.
    let digits = str::from_utf8(digits).ok().filter(|_| digits.iter().all(u8::is_ascii_hexdigit))?;
    u64::from_str_radix(digits, 16).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Scans a text in portions of this size.
    fn scan(text: &str, portion: usize) -> Result<(), HeadFault> {
        let mut scanner = HeadScanner::new();
        text.as_bytes().chunks(portion).try_for_each(|bytes| scanner.scan(bytes))
    }

    fn finds(expected: Result<(), HeadFault>, text: &str) {
        for portion in [1, 2, 3, 7, 64, 65, usize::MAX] {
            assert_eq!(scan(text, portion), expected, "{portion}: {text:?}");
        }
    }

    const BAD: &str = "POST / HTTP/1.1\r\nContent-Length: 1\r\nTransfer-Encoding: chunked\r\n\r\n";

    #[test]
    fn requests_of_one_framing_pass() {
        for good in [
            "GET / HTTP/1.1\r\nHost: x\r\n\r\n",
            "\r\n\r\nGET / HTTP/1.1\r\nHost: x\r\n\r\n",
            "POST / HTTP/1.1\r\nContent-Length: 5\r\n\r\na\nb\r\n",
            "POST / HTTP/1.1\r\nContent-Length:0\r\n\r\n",
            "POST / HTTP/1.1\r\nTransfer-Encoding: Chunked\r\n\r\n4;a=b\r\n\r\n\n\n\r\nA\r\n0123456789\r\n0\r\nTrailer: x\r\n\r\n",
        ] {
            finds(Ok(()), good);
            // The next request is scanned from its first byte, wherever the body ended.
            finds(Ok(()), &good.repeat(3));
            finds(Err(HeadFault::TwoFramings), &format!("{good}{BAD}"));
        }
    }

    #[test]
    fn what_two_parsers_may_understand_differently_is_found() {
        let long = "0".repeat(70);
        for (fault, fields) in [
            (HeadFault::TwoFramings, "Content-Length: 3\r\ntransfer-encoding: chunked\r\n"),
            (HeadFault::TwoFramings, "TRANSFER-ENCODING: chunked\r\nX: y\r\ncontent-length: 3\r\n"),
            (HeadFault::Length, "Content-Length: 3\r\nContent-Length: 3\r\n"),
            (HeadFault::Length, "Content-Length: 3, 3\r\n"),
            (HeadFault::Length, "Content-Length: +3\r\n"),
            (HeadFault::Length, "Content-Length:\r\n"),
            (HeadFault::Length, &format!("Content-Length: {long}\r\n")),
            (HeadFault::Length, "Content-Length: 99999999999999999999\r\n"),
            (HeadFault::Coding, "Transfer-Encoding: gzip, chunked\r\n"),
            (HeadFault::Coding, "Transfer-Encoding: identity\r\n"),
            (HeadFault::Coding, "Transfer-Encoding: chunked\r\nTransfer-Encoding: chunked\r\n"),
            (HeadFault::Coding, &format!("Transfer-Encoding: chunked{}x\r\n", " ".repeat(70))),
            (HeadFault::LineEnd, "X: y\nContent-Length: 3\r\n"),
            (HeadFault::Folded, "X: y\r\n Content-Length: 3\r\n"),
        ] {
            finds(Err(fault), &format!("POST / HTTP/1.1\r\nHost: x\r\n{fields}\r\nabc"));
        }
        finds(Err(HeadFault::LineEnd), "GET / HTTP/1.1\nHost: x\r\n\r\n");
        finds(Err(HeadFault::LineEnd), "GET / HTTP/1.1\r\nHost: x\r\n\nGET");
    }

    #[test]
    fn chunks_are_followed_strictly() {
        for chunks in [
            "+4\r\nabcd\r\n",
            " 4\r\nabcd\r\n",
            "4 \r\nabcd\r\n",
            "\r\n",
            "4\r\nabcde\r\n",
            "x\r\n",
            "ffffffffffffffff\r\n",
        ] {
            finds(
                Err(HeadFault::Chunks),
                &format!("POST / HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\n{chunks}"),
            );
        }
    }

    #[test]
    fn after_a_fault_and_in_http_2_nothing_is_looked_at() {
        let mut scanner = HeadScanner::new();
        assert_eq!(scanner.scan(b"\n"), Err(HeadFault::LineEnd));
        assert_eq!(scanner.scan(BAD.as_bytes()), Ok(()));
        finds(Ok(()), &format!("PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n{BAD}\n"));
    }
}
