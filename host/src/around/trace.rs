//! The trace that a request belongs to (W3C Trace Context, 2021): the client's trace or a new one.

use std::fmt;

use axum::http::HeaderMap;

/// Ids of a trace and of the calling span.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TraceParent {
    pub trace_id: u128,
    pub span_id: u64,
    pub is_sampled: bool,
}

impl TraceParent {
    /// Parses `traceparent: 00-<32 digits>-<16 digits>-<2 digits>` in lower-case hexadecimal.
    ///
    /// Later versions may append further fields.
    pub fn of(headers: &HeaderMap) -> Option<Self> {
        let mut lines = headers.get_all("traceparent").iter();
        let (Some(line), None) = (lines.next(), lines.next()) else { return None };
        let mut parts = line.to_str().ok()?.split('-');
        let mut number = |n_digits: usize| {
            let part = parts.next().filter(|part| part.len() == n_digits)?;
            let is_plain = part.bytes().all(|c| matches!(c, b'0'..=b'9' | b'a'..=b'f'));
            u128::from_str_radix(part, 16).ok().filter(|_| is_plain)
        };
        let (version, trace_id, span_id, flags) = (number(2)?, number(32)?, number(16)?, number(2)?);
        let is_whole = version != 0xff && (version > 0 || parts.next().is_none());
        let span_id = u64::try_from(span_id).ok()?;
        (is_whole && trace_id != 0 && span_id != 0).then_some(Self {
            trace_id,
            span_id,
            is_sampled: flags & 1 == 1,
        })
    }
}

/// Formats the value of the header.
impl fmt::Display for TraceParent {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { trace_id, span_id, is_sampled } = self;
        write!(f, "00-{trace_id:032x}-{span_id:016x}-{:02x}", u8::from(*is_sampled))
    }
}

#[cfg(test)]
mod tests {
    use axum::http::HeaderValue;

    use super::*;

    fn of(lines: &[&str]) -> Option<TraceParent> {
        let mut headers = HeaderMap::new();
        for line in lines {
            headers.append("traceparent", HeaderValue::from_str(line).unwrap());
        }
        TraceParent::of(&headers)
    }

    #[test]
    fn trace_parents_are_read_as_the_recommendation_has_them() {
        let line = "00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01";
        let found = of(&[line]).unwrap();
        assert_eq!(found.trace_id, 0x4bf9_2f35_77b3_4da6_a3ce_929d_0e0e_4736);
        assert_eq!((found.span_id, found.is_sampled), (0x00f0_67aa_0ba9_02b7, true));
        assert_eq!(found.to_string(), line);
        assert!(of(&[&*line.replace("00-4b", "01-4b")]).is_some());
        assert!(of(&[&format!("{}-more", line.replace("00-4b", "01-4b"))]).is_some());
        for bad in [
            "",
            "00",
            &line.to_uppercase(),
            &format!("{line}-more"),
            &line.replace("00-4b", "ff-4b"),
            &line.replace("00-4b", "00-+b"),
            "00-00000000000000000000000000000000-00f067aa0ba902b7-01",
            "00-4bf92f3577b34da6a3ce929d0e0e4736-0000000000000000-01",
        ] {
            assert_eq!(of(&[bad]), None, "{bad}");
        }
        assert_eq!(of(&[line, line]), None);
    }
}
