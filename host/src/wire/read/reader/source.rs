//! Where a value comes from.

/// The tables of an object: a range of indices.
#[derive(Clone, Copy)]
pub(super) struct Tables {
    pub(super) start: usize,
    pub(super) end: usize,
}

impl Tables {
    pub(super) const NONE: Self = Self { start: 0, end: 0 };
}

/// Where a value comes from.
#[derive(Clone, Copy)]
pub(super) enum Source {
    /// The next value of the text.
    Text,
    /// The next value of the text, which is an object, and tables that belong into it.
    TextAndTables(Tables),
    /// An object that is not in the text and consists of tables.
    Tables(Tables),
    /// The next list of the table that is being read: its entries, and the numbers of each if they are rows.
    List { length: usize, width: Option<usize> },
    /// The next number of the table that is being read.
    Number,
}

impl Source {
    /// The source of an entry, if this is the source of a list.
    pub(super) fn of_entry(self) -> Self {
        match self {
            Self::Text | Self::TextAndTables(_) | Self::Tables(_) => Self::Text,
            Self::List { width: Some(length), .. } => Self::List { length, width: None },
            Self::List { width: None, .. } | Self::Number => Self::Number,
        }
    }

    /// Entries of a list, unless it is in the text.
    pub(super) fn length(self) -> Option<usize> {
        match self {
            Self::List { length, .. } => Some(length),
            Self::Text | Self::TextAndTables(_) | Self::Tables(_) | Self::Number => None,
        }
    }
}
