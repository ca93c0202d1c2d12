//! Parts of the service that a build may lack, because they take long to compile and few need them.

use std::fmt;

/// A feature of the build (`[features]` in Cargo.toml).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Feature {
    /// Stores in buckets.
    Buckets,
    /// Spans for an OpenTelemetry collector.
    Otlp,
}

impl Feature {
    pub fn name(self) -> &'static str {
        match self {
            Self::Buckets => "buckets",
            Self::Otlp => "otlp",
        }
    }

    pub fn is_present(self) -> bool {
        match self {
            Self::Buckets => cfg!(feature = "buckets"),
            Self::Otlp => cfg!(feature = "otlp"),
        }
    }

    /// # Errors
    /// Fails if this build lacks the feature. The message says where there is a build with it.
    pub fn require(self) -> Result<(), MissingFeature> {
        if self.is_present() { Ok(()) } else { Err(MissingFeature(self)) }
    }
}

/// A setting needs a feature that this build lacks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MissingFeature(Feature);

impl fmt::Display for MissingFeature {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = self.0.name();
        write!(
            f,
            "needs the feature `{name}`, which this build lacks: the container image and the Python wheel have it, and so \
             has `cargo build --release --features {name}`"
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_missing_feature_is_named_with_its_remedy() {
        for feature in [Feature::Buckets, Feature::Otlp] {
            assert_eq!(feature.require().is_ok(), feature.is_present());
            let text = MissingFeature(feature).to_string();
            assert!(text.contains(&format!("--features {}", feature.name())), "{text}");
        }
    }
}
