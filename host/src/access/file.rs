//! The TOML file of keys:
//!
//! ```toml
//! [[key]]
//! name = "scanner-lab"
//! hash = "blake3:…"             # of the key, 64 hexadecimal digits
//! view = "lab"                  # whose clouds the key sees; default: the name of the key
//! requests_per_minute = 600     # default: unlimited
//! burst = 50                    # requests at once after a pause; default: a tenth of requests_per_minute
//! concurrent_requests = 8       # default: unlimited
//! ```

use std::num::NonZeroU32;

use serde::Deserialize;
use uuid::Uuid;

use super::Digest;
use super::limits::Rule;

/// Prefix of every generated key, so that a leaked key can be found by a text search.
const PREFIX: &str = "gramian_";

#[derive(Debug, Default, PartialEq, Eq)]
pub(super) struct KeysFile {
    pub keys: Vec<KeyEntry>,
}

#[derive(Debug, PartialEq, Eq)]
pub(super) struct KeyEntry {
    pub name: String,
    pub digest: Digest,
    view: Option<String>,
    pub rule: Rule,
}

/// The file as deserialized, before its values are checked.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Written {
    #[serde(default)]
    key: Vec<WrittenKey>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct WrittenKey {
    name: String,
    hash: String,
    view: Option<String>,
    requests_per_minute: Option<NonZeroU32>,
    burst: Option<NonZeroU32>,
    concurrent_requests: Option<NonZeroU32>,
}

impl KeyEntry {
    /// Name of the view whose clouds the key sees.
    pub(super) fn view(&self) -> &str {
        self.view.as_deref().unwrap_or(&self.name)
    }
}

impl KeysFile {
    /// Parses the text of a file.
    ///
    /// # Errors
    /// Tells the line or the key name and what is wrong, but never quotes a value, which may be a key.
    pub(super) fn parse(text: &str) -> Result<Self, String> {
        let written: Written = toml::from_str(text).map_err(|error| {
            let before = error.span().and_then(|span| text.get(..span.start)).unwrap_or_default();
            let line = 1 + before.matches('\n').count();
            // The message of the TOML error may quote a value.
            format!("line {line} does not have the form that docs/operations.md describes")
        })?;
        let keys = written.key.into_iter().map(KeyEntry::try_from).collect::<Result<Vec<_>, _>>()?;
        for (index, key) in keys.iter().enumerate() {
            if keys[..index].iter().any(|other| other.digest == key.digest) {
                return Err(format!("the key {} is listed twice", key.name));
            }
        }
        Ok(Self { keys })
    }
}

impl TryFrom<WrittenKey> for KeyEntry {
    type Error = String;

    fn try_from(written: WrittenKey) -> Result<Self, String> {
        let WrittenKey { name, hash, view, requests_per_minute, burst, concurrent_requests } = written;
        for (what, text) in [("name", Some(&name)), ("view", view.as_ref())] {
            if text.is_some_and(|text| !is_plain(text)) {
                return Err(format!("a {what} is not 1 to 64 letters, digits, '-' and '_'"));
            }
        }
        let digest = hash.strip_prefix("blake3:").and_then(|hex| blake3::Hash::from_hex(hex).ok());
        let digest =
            digest.ok_or_else(|| format!("the hash of {name} is not blake3: and 64 hexadecimal digits"))?;
        if burst.is_some() && requests_per_minute.is_none() {
            return Err(format!("{name} has a burst but no requests_per_minute"));
        }
        let rule = Rule { requests_per_minute, burst, concurrent_requests };
        Ok(Self { name, digest: digest.into(), view, rule })
    }
}

/// Whether a name is safe: it becomes part of file names.
fn is_plain(name: &str) -> bool {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_');
    (1..=64).contains(&name.len()) && name.chars().all(is_plain)
}

/// Generates a key. Returns the key and its lines for the file.
///
/// # Errors
/// Refuses a name that is not 1 to 64 letters, digits, '-' and '_'.
pub fn generate(name: &str) -> Result<(String, String), String> {
    if !is_plain(name) {
        return Err("a name has 1 to 64 letters, digits, '-' and '_'".to_owned());
    }
    // 244 random bits, 122 from each UUID.
    let key = format!("{PREFIX}{}{}", Uuid::new_v4().simple(), Uuid::new_v4().simple());
    let hash = blake3::hash(key.as_bytes()).to_hex();
    Ok((key, format!("[[key]]\nname = \"{name}\"\nhash = \"blake3:{hash}\"\n")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_generated_key_is_read_back() {
        let (key, lines) = generate("lab").unwrap();
        let file = KeysFile::parse(&format!("{lines}requests_per_minute = 60\nview = \"all\"\n")).unwrap();
        let [entry] = &file.keys[..] else { panic!() };
        assert_eq!((entry.digest, entry.view()), (blake3::hash(key.as_bytes()).into(), "all"));
        assert_eq!(entry.rule.requests_per_minute, NonZeroU32::new(60));
        assert!(generate("a b").is_err() && generate("").is_err() && key.len() == PREFIX.len() + 64);
        assert_eq!(KeysFile::parse("").unwrap(), KeysFile::default());
    }

    #[test]
    fn what_is_wrong_is_named_by_its_line_and_never_shown() {
        let (_, lines) = generate("lab").unwrap();
        for (text, is_told) in [
            ("[[key]]\nname = \"lab\"\nhash = \"gramian_secret\"", "hash of lab"),
            ("[[key]]\nname = \"lab\"\nkey = \"gramian_secret\"", "line 3"),
            ("gramian_secret", "line 1"),
            ("[[key]]\nname = \"a/b\"\nhash = \"\"", "a name"),
            (&format!("{lines}burst = 5"), "burst"),
            (&format!("{lines}requests_per_minute = 0"), "line"),
            (&format!("{lines}{lines}"), "twice"),
        ] {
            let error = KeysFile::parse(text).unwrap_err();
            assert!(error.contains(is_told) && !error.contains("secret"), "{error}");
        }
    }
}
