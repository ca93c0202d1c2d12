//! VTK XML `PolyData`, for `ParaView` and `PyVista`, with all numbers in full and their names.
//!
//! Arrays are appended raw, little-endian, each after its length as an unsigned integer of eight bytes.

use std::fmt::Write;

use super::table::Table;

/// The file in two parts, the XML and the numbers behind it.
#[derive(Default)]
struct File {
    xml: String,
    data: Vec<u8>,
}

impl File {
    fn line(&mut self, text: &str) {
        self.xml.push_str(text);
        self.xml.push('\n');
    }

    /// Adds an array of words of eight bytes.
    fn array(&mut self, description: &str, words: impl ExactSizeIterator<Item = [u8; 8]>) {
        let offset = self.data.len();
        // Writing to a string never fails.
        let _ = writeln!(self.xml, "<DataArray {description} format=\"appended\" offset=\"{offset}\"/>");
        self.data.extend((8 * words.len() as u64).to_le_bytes());
        words.for_each(|word| self.data.extend(word));
    }

    /// Adds cells: the vertices of all, one after another, and where each ends.
    fn cells(&mut self, element: &str, vertices: &[u32], size: usize) {
        self.line(&format!("<{element}>"));
        let integer = |n: usize| (n as i64).to_le_bytes();
        self.array(
            "type=\"Int64\" Name=\"connectivity\"",
            vertices.iter().map(|&vertex| integer(vertex as usize)),
        );
        let n_cells = vertices.len() / size;
        self.array("type=\"Int64\" Name=\"offsets\"", (0..n_cells).map(|cell| integer((cell + 1) * size)));
        self.line(&format!("</{element}>"));
    }
}

/// Writes points, or a mesh of segments or triangles, with all numbers at the vertices.
pub fn write(table: &Table) -> Vec<u8> {
    let (n, d) = (table.n_rows(), table.dimension);
    let has_cells = !table.cells.is_empty();
    let points: Vec<u32> = if has_cells { Vec::new() } else { (0..n as u32).collect() };
    let n_cells = table.cells.len() / d;
    let (n_lines, n_polys) = if d == 2 { (n_cells, 0) } else { (0, n_cells) };
    let mut file = File::default();
    file.line("<?xml version=\"1.0\"?>");
    file.line(
        "<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\n<PolyData>",
    );
    file.line(&format!(
        "<Piece NumberOfPoints=\"{n}\" NumberOfVerts=\"{}\" NumberOfLines=\"{n_lines}\" NumberOfStrips=\"0\" \
         NumberOfPolys=\"{n_polys}\">",
        points.len()
    ));
    write_point_data(&mut file, table);
    file.line("<Points>");
    let position = |entry: usize| table.positions.get(entry / 3 * d + entry % 3).filter(|_| entry % 3 < d);
    let positions = (0..3 * n).map(|entry| position(entry).copied().unwrap_or_default().to_le_bytes());
    file.array("type=\"Float64\" Name=\"Points\" NumberOfComponents=\"3\"", positions);
    file.line("</Points>");
    if !has_cells {
        file.cells("Verts", &points, 1);
    } else if d == 2 {
        file.cells("Lines", &table.cells, 2);
    } else {
        file.cells("Polys", &table.cells, 3);
    }
    file.line("</Piece>\n</PolyData>\n<AppendedData encoding=\"raw\">");
    let mut out = file.xml.into_bytes();
    out.push(b'_');
    out.extend(file.data);
    out.extend(b"\n</AppendedData>\n</VTKFile>\n");
    out
}

/// Normals and all columns. The active ones are those that programs colour and shade by.
fn write_point_data(file: &mut File, table: &Table) {
    let scalars = table.quality.as_ref().map(|name| format!(" Scalars=\"{}\"", escaped(name)));
    let normals = table.normals.as_ref().map(|_| " Normals=\"Normals\"");
    file.line(&format!("<PointData{}{}>", scalars.unwrap_or_default(), normals.unwrap_or_default()));
    if let Some(normals) = &table.normals {
        let description = "type=\"Float64\" Name=\"Normals\" NumberOfComponents=\"3\"";
        file.array(description, normals.iter().map(|x| x.to_le_bytes()));
    }
    for (name, numbers) in &table.columns {
        let description = format!("type=\"Float64\" Name=\"{}\"", escaped(name));
        file.array(&description, numbers.iter().map(|x| x.to_le_bytes()));
    }
    file.line("</PointData>");
}

/// A name within an attribute of XML.
fn escaped(name: &str) -> String {
    name.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
