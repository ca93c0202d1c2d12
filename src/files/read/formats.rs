//! The formats of clouds: names, endings, what is read of each, and how a file shows which it has.

/// A format of clouds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    Ply,
    Rows,
    Pcd,
    Las,
    Npy,
    Obj,
    Stl,
    Json,
}

/// Name and endings of a format, with a summary of its reader.
pub struct Description {
    pub format: Format,
    pub name: &'static str,
    pub endings: &'static [&'static str],
    /// Contents that are read, and those that are skipped.
    pub reads: &'static str,
}

/// All formats. The help of the subcommands and the table of docs/formats.md have these entries. The page and
/// the Python package have the same endings.
pub const FORMATS: [Description; 8] = [
    Description {
        format: Format::Ply,
        name: "PLY",
        endings: &["ply"],
        reads: "ascii and binary of both byte orders, with numbers of any type. Faces and lists are skipped",
    },
    Description {
        format: Format::Rows,
        name: "XYZ, CSV, TSV",
        endings: &["xyz", "csv", "tsv", "txt", "asc", "pts"],
        reads: "rows of numbers with or without names of the columns, and any other text",
    },
    Description {
        format: Format::Pcd,
        name: "PCD",
        endings: &["pcd"],
        reads: "ascii, binary and binary_compressed. Points without a position are left out and counted",
    },
    Description {
        format: Format::Las,
        name: "LAS, LAZ",
        endings: &["las", "laz"],
        reads: "versions 1.0 to 1.4, point formats 0 to 10, scaled and moved by the header. Extra bytes are skipped",
    },
    Description {
        format: Format::Npy,
        name: "npy",
        endings: &["npy"],
        reads: "float32 or float64 of shape [n, d], all columns coordinates",
    },
    Description {
        format: Format::Obj,
        name: "OBJ",
        endings: &["obj"],
        reads: "vertices with their colours. Normals, if each vertex has one. Faces are skipped",
    },
    Description {
        format: Format::Stl,
        name: "STL",
        endings: &["stl"],
        reads: "ascii and binary. Equal corners are one point, and normals of facets are skipped",
    },
    Description {
        format: Format::Json,
        name: "JSON",
        endings: &["json"],
        reads: "rows of coordinates, or an object with points, and maybe normals and values",
    },
];

/// The endings of all formats: ".ply, .xyz, …".
pub fn endings() -> String {
    let all = FORMATS.iter().flat_map(|format| format.endings);
    all.map(|ending| format!(".{ending}")).collect::<Vec<_>>().join(", ")
}

/// The help of an argument that names a file of points.
pub fn help() -> String {
    let line = |format: &Description| format!("- {}: {}", format.name, format.reads);
    let lines = FORMATS.iter().map(line).collect::<Vec<_>>().join("\n");
    format!("A file of points: {}\n\n{lines}", endings())
}

/// Formats that a file begins with, which then has no other.
const BEGINNINGS: [(Format, &[u8]); 5] = [
    (Format::Ply, b"ply\n"),
    (Format::Ply, b"ply\r\n"),
    (Format::Npy, b"\x93NUMPY"),
    (Format::Las, b"LASF"),
    (Format::Pcd, b"# .PCD"),
];

/// First words of OBJ files.
const OBJ_WORDS: [&str; 6] = ["v", "vn", "vt", "o", "g", "mtllib"];

/// Bytes that decide which format a text has, comments of its head included.
const MAX_HEAD_BYTES: usize = 4096;

impl Format {
    /// Decides on the format of a file.
    ///
    /// # Errors
    /// Refuses a file whose ending promises what its content is not, and bytes of no known format.
    pub fn of(name: &str, bytes: &[u8]) -> Result<Self, String> {
        let ending = name.rsplit_once('.').map(|(_, ending)| ending.to_lowercase()).unwrap_or_default();
        let known = FORMATS.iter().find(|format| format.endings.contains(&ending.as_str()));
        if let Some((format, _)) = BEGINNINGS.iter().find(|(_, beginning)| bytes.starts_with(beginning)) {
            return Ok(*format);
        }
        let head = String::from_utf8_lossy(&bytes[..bytes.len().min(MAX_HEAD_BYTES)]);
        let word = first_word(&head);
        match (known.map(|format| format.format), word) {
            (_, "VERSION") => Ok(Self::Pcd),
            (Some(promised @ (Self::Stl | Self::Obj | Self::Json)), _) => Ok(promised),
            (Some(Self::Ply), _) => Err("the file is not PLY: its first line is not \"ply\"".to_owned()),
            (Some(Self::Npy | Self::Las | Self::Pcd), _) => {
                let name = known.map(|format| format.name).unwrap_or_default();
                Err(format!("the file is not {name}: its first bytes are not those of this format"))
            }
            (_, word) if OBJ_WORDS.contains(&word) => Ok(Self::Obj),
            (_, "solid") if head.contains("facet") => Ok(Self::Stl),
            (_, word) if word.starts_with(['{', '[']) => Ok(Self::Json),
            _ if bytes.contains(&0) => Err(unknown()),
            _ => Ok(Self::Rows),
        }
    }
}

/// The first word of a text that is no comment.
fn first_word(head: &str) -> &str {
    let head = head.strip_prefix('\u{feff}').unwrap_or(head);
    let mut lines = head.lines().map(str::trim_start).filter(|line| !line.is_empty());
    let line = lines.find(|line| !line.starts_with('#')).unwrap_or_default();
    line.split_whitespace().next().unwrap_or_default()
}

fn unknown() -> String {
    let names = FORMATS.map(|format| format.name).join(", ");
    format!("the content is of no format that is read: {names}")
}
