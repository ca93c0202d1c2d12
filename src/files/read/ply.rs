//! PLY, by the parser that reads PLY in bodies of requests.

use gramian_host::wire::read::ply::PlyError;
use gramian_host::wire::read::ply::data::Cursor;
use gramian_host::wire::read::ply::header::{Element, Encoding, Header, Kind};

use super::FileCloud;
use super::columns::{Columns, Gaps, Places};
use super::records::ends_early;

const VERTEX: &str = "vertex";

/// Reads the vertices with all properties that are numbers. Lists and other elements are skipped.
pub fn read(bytes: &[u8]) -> Result<FileCloud, String> {
    let (header, data) = Header::parse(bytes).map_err(refusal)?;
    let at = header.elements.iter().position(|element| element.name == VERTEX);
    let at = at.ok_or("the file has no element vertex")?;
    let mut cursor = Cursor::new(data, &header);
    header.elements[..at].iter().try_for_each(|element| cursor.skip(element)).map_err(refusal)?;
    vertices(cursor, &header, &header.elements[at])?.into_cloud(Gaps::Refused)
}

fn vertices(mut cursor: Cursor<'_>, header: &Header<'_>, element: &Element<'_>) -> Result<Columns, String> {
    let is_number = |at: &usize| matches!(element.properties[*at].kind, Kind::Number(_));
    let wanted: Vec<usize> = (0..element.properties.len()).filter(is_number).collect();
    if wanted.is_empty() {
        return Err("the element vertex has no scalar properties".to_owned());
    }
    let mut column_of = vec![0; element.properties.len()];
    wanted.iter().enumerate().for_each(|(column, &property)| column_of[property] = column);
    let mut numbers: Vec<Vec<f64>> = vec![Vec::new(); wanted.len()];
    let mut lines = Vec::new();
    for index in 0..element.count {
        let take = |property: usize, x| numbers[column_of[property]].push(x);
        cursor.record(element, index, take, |_| true).map_err(refusal)?;
        if header.encoding == Encoding::Text {
            lines.push(cursor.n_lines());
        }
    }
    let places = match header.encoding {
        Encoding::Text => Places::Lines(lines),
        Encoding::LittleEndian | Encoding::BigEndian => Places::Records(VERTEX),
    };
    let names = wanted.iter().map(|&property| element.properties[property].name.to_owned()).collect();
    Ok(Columns { names, numbers, places })
}

/// Translates an error of the body parser into words of files.
fn refusal(error: PlyError) -> String {
    match error {
        PlyError::NoMagic => "the file is not PLY: its first line is not \"ply\"".to_owned(),
        PlyError::Announced { element, announced, room } => ends_early(&element, room, announced),
        PlyError::EndsEarly { element, index, announced } => ends_early(&element, index, announced),
        PlyError::ListLength { element, index, length } => {
            format!("{element} {}: a list has {length} entries", index + 1)
        }
        PlyError::Text { line, reason, .. } => format!("line {line}: {reason}"),
        error @ (PlyError::EndlessHeader | PlyError::Header { .. }) => error.to_string(),
    }
}
