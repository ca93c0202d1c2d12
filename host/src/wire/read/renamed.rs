//! Refusals of words that have another name now.

/// A word of requests, a member or an entry of an enumeration, that has another name now.
#[derive(Debug, Clone, Copy)]
pub struct RenamedWord {
    pub old: &'static str,
    pub new: &'static str,
}

impl RenamedWord {
    /// Words a message of serde that refuses an unknown word anew, if it is the old name of one that serde
    /// expects there.
    pub(super) fn refusal(renamed: &[Self], message: &str) -> Option<String> {
        let unknown = message.strip_prefix("unknown field `").or(message.strip_prefix("unknown variant `"))?;
        let (old, expected) = unknown.split_once('`')?;
        let is_called = |of: &&Self| of.old == old && expected.contains(&format!("`{}`", of.new));
        renamed.iter().find(is_called).map(|of| format!("`{old}` is called `{}`", of.new))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_old_name_is_refused_with_the_new_one_where_that_is_expected() {
        let renamed =
            [RenamedWord { old: "height", new: "level" }, RenamedWord { old: "height", new: "altitude" }];
        let refusal = |message: &str| RenamedWord::refusal(&renamed, message);
        let of_field =
            refusal("unknown field `height`, expected one of `cloud`, `altitude` at line 1 column 9");
        assert_eq!(of_field.as_deref(), Some("`height` is called `altitude`"));
        let of_variant = refusal("unknown variant `height`, expected `level` or `slope`");
        assert_eq!(of_variant.as_deref(), Some("`height` is called `level`"));
        for other in
            ["unknown field `height`, expected `cloud`", "unknown field `depth`, expected `level`", "x"]
        {
            assert_eq!(refusal(other), None);
        }
    }
}
