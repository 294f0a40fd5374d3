//! Tables of displacements as a folder of two files: `axes.txt` and `data.npy`.
//!
//! `axes.txt`: three lines, the nodes of sx, sa and sy, rising. `data.npy`: floats, C order, of shape
//! `[vertex * sy * sa * sx, 4]` or `[vertex, sy, sa, sx, 4]`: displacement along u, v and height (metres) and of the twist
//! (radians).

use super::npy::{self, header_bytes};
use super::text::{Lines, read_bytes};
use crate::pattern::{AXES, StrainTable};
use crate::{Error, Result};
use std::fmt::Write;
use std::io::{Read, Seek, SeekFrom};
use std::path::Path;

/// Names of the files.
pub const FILES: [&str; 2] = ["axes.txt", "data.npy"];

/// Reads a table from its folder.
///
/// # Errors
/// Files that cannot be read, and what [`read_axes`] and [`read_values`] refuse.
pub fn read(folder: &Path) -> Result<StrainTable> {
    let [axes, data] = FILES.map(|name| folder.join(name));
    let axes = read_axes(&axes, &read_bytes(&axes)?)?;
    let values = read_values(&data, &axes)?;
    StrainTable::new(axes, values).map_err(|e| Error::invalid(format_args!("{}: {e}", data.display())))
}

/// Reads the nodes of all axes from memory; `path` is only for messages.
///
/// # Errors
/// By line and column: lines too many or too few, nodes that are no finite numbers, do not rise or are more than
/// [`StrainTable::MOST_NODES`].
pub fn read_axes(path: &Path, bytes: &[u8]) -> Result<[Vec<f32>; 3]> {
    let mut axes: [Vec<f32>; 3] = Default::default();
    let mut count = 0;
    let mut lines = Lines::new(path, bytes, true);
    for mut line in lines.by_ref() {
        let Some(mut word) = line.word()? else { continue };
        let Some(axis) = axes.get_mut(count) else {
            return Err(line.unexpected(word, "three lines: sx, sa and sy"));
        };
        let name = AXES[count];
        loop {
            // Read as f32 at once, for by way of f64 it would be rounded twice.
            let x = word.text.parse::<f32>().ok().filter(|x| x.is_finite());
            let Some(x) = x else {
                return Err(line.unexpected(word, &format!("a node of {name}, a finite number")));
            };
            if let Some(last) = axis.last()
                && x <= *last
            {
                return Err(line.unexpected(word, &format!("a node of {name} above {last:?}")));
            }
            if axis.len() == StrainTable::MOST_NODES {
                let expected = format!("at most {} nodes of {name}", StrainTable::MOST_NODES);
                return Err(line.unexpected(word, &expected));
            }
            axis.push(x);
            match line.word()? {
                Some(next) => word = next,
                None => break,
            }
        }
        count += 1;
    }
    if count < axes.len() {
        let expected = format!("a line with the nodes of {}", AXES[count]);
        return Err(Error::input(path, lines.number().max(1), 1, "the end of the file", expected));
    }
    Ok(axes)
}

/// Reads the displacements of a `.npy` file for a table with these axes: `[vertex][sy][sa][sx]`.
///
/// # Errors
/// A file that cannot be read; one of another kind, shape or length; numbers that are not finite as f32.
pub fn read_values(path: &Path, axes: &[Vec<f32>; 3]) -> Result<Vec<[f32; 4]>> {
    let io = |e| Error::io(path, e);
    let (mut file, header) = npy::open(path)?;
    let [x, a, y] = axes.each_ref().map(|axis| axis.len() as u64);
    let nodes = x * a * y;
    if header.kind != b'f' || header.fortran_order {
        let order = if header.fortran_order { "Fortran" } else { "C" };
        let found = format!("numbers of kind '{}' in {order} order", char::from(header.kind));
        return Err(Error::binary(path, 0, found, "floats in C order"));
    }
    let fits = match *header.shape {
        [rows, 4] => rows > 0 && rows % nodes == 0,
        [pixels, sy, sa, sx, 4] => pixels > 0 && [sx, sa, sy] == [x, a, y],
        _ => false,
    };
    if !fits {
        let found = format!("an array of shape {:?}", header.shape);
        let expected = format!("[vertex * {nodes}, 4] or [vertex, {y}, {a}, {x}, 4] as the axes have nodes");
        return Err(Error::binary(path, 0, found, expected));
    }
    let length = file.seek(SeekFrom::End(0)).map_err(io)?;
    let begin = header.data_offset as u64;
    let end = header.count().and_then(|n| n.checked_mul(header.size as u64)?.checked_add(begin));
    if end != Some(length) {
        let found = format!("{} bytes of numbers", length.saturating_sub(begin));
        let expected = format!("as many as the shape {:?} has", header.shape);
        return Err(Error::binary(path, length as usize, found, expected));
    }
    let mut bytes = Vec::with_capacity((length - begin) as usize);
    file.seek(SeekFrom::Start(begin)).map_err(io)?;
    file.take(length - begin).read_to_end(&mut bytes).map_err(io)?;
    let size = header.size;
    let mut values = Vec::with_capacity(bytes.len() / (4 * size));
    for (row, bytes) in bytes.chunks_exact(4 * size).enumerate() {
        let value: [f32; 4] = std::array::from_fn(|k| header.number(&bytes[k * size..]) as f32);
        if let Some(bad) = value.iter().position(|x| !x.is_finite()) {
            let at = header.data_offset + (4 * row + bad) * size;
            let found = format!("{} in row {row}", value[bad]);
            return Err(Error::binary(path, at, found, "a finite displacement"));
        }
        values.push(value);
    }
    Ok(values)
}

/// The content of both files, in the order of [`FILES`]; it reads back to the bit.
pub fn write(table: &StrainTable) -> [Vec<u8>; 2] {
    let mut axes = String::new();
    for axis in table.axes() {
        for (i, x) in axis.iter().enumerate() {
            // Writing to a string cannot fail.
            let _ = write!(axes, "{}{x:?}", if i > 0 { " " } else { "" });
        }
        axes.push('\n');
    }
    let values = table.values();
    let mut data = header_bytes("<f4", &[values.len() as u64, 4]);
    data.reserve(size_of_val(values));
    data.extend(values.iter().flatten().flat_map(|x| x.to_le_bytes()));
    [axes.into_bytes(), data]
}
