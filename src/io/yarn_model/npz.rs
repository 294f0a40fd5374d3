//! Yarn models as NumPy arrays (`.npz`).

use super::at;
use crate::io::npz::entry;
use crate::io::npz_arrays::Arrays;
use crate::io::output::Output;
use crate::io::zip::ZipWriter;
use crate::pattern::{AXES, Pattern, PatternEdge, StrainTable, YarnModel};
use crate::{Error, Result};
use glam::{DVec2, DVec3, IVec2};
use std::path::Path;

/// The arrays of a file, as [`write_npz`] lists them.
pub const ARRAYS: [&str; 12] = [
    "pattern_size",
    "radius",
    "places",
    "twists",
    "edges",
    "edge_tiles",
    "rest_lengths",
    "directors",
    "axis_sx",
    "axis_sa",
    "axis_sy",
    "displacements",
];

/// Most vertices of a pattern.
const MOST_VERTICES: u64 = 1 << 16;

/// Writes a model. It reads back to the bit.
///
/// | array | shape | meaning |
/// |---|---|---|
/// | `pattern_size`, `radius` | `[2]`, scalar, f64 | period along u and v, yarn radius, metres |
/// | `places` | `[vertex, 3]` f64 | u, v and height at rest, metres |
/// | `twists` | `[vertex]` f64 | twist of the edge that leaves the vertex, radians |
/// | `edges` | `[vertex, 2]` u32 | from and to, in any order |
/// | `edge_tiles` | `[vertex, 2]` i32 | so many periods along u and v from the one to the other, in the order of `edges` |
/// | `rest_lengths` | `[vertex]` f64 | of the edge that leaves the vertex, metres |
/// | `directors` | `[vertex, 3]` f64 | of the edge that leaves the vertex |
/// | `axis_sx`, `axis_sa`, `axis_sy` | `[node]` f32 | nodes of the strains, rising |
/// | `displacements` | `[vertex, sy, sa, sx, 4]` f32 | along u, v and height, metres, and of the twist, radians |
///
/// Arrays of other names are passed over, so that there is room for a table over bending too (appendix C of the paper): a
/// further array `[vertex, bending, sy, sa, sx, 4]`, named after its strain as `displacements_bu` is, and `axis_bu` for its
/// nodes.
///
/// # Errors
/// The system's; an output that is a device or a pipe.
pub fn write_npz(path: &Path, model: &YarnModel) -> Result<()> {
    let mut zip = ZipWriter::new(Output::create(path)?)?;
    let (pattern, table) = (&model.pattern, &model.table);
    let n = pattern.vertex_count() as u64;
    let doubles =
        |numbers: &mut dyn Iterator<Item = f64>| numbers.flat_map(f64::to_le_bytes).collect::<Vec<u8>>();
    let vectors = |list: &[DVec3]| doubles(&mut list.iter().flat_map(|p| p.to_array()));
    let edges = &pattern.edges;
    let ends: Vec<u8> = edges.iter().flat_map(|e| [e.from, e.to]).flat_map(u32::to_le_bytes).collect();
    let tiles: Vec<u8> = edges.iter().flat_map(|e| e.tile.to_array()).flat_map(i32::to_le_bytes).collect();
    let arrays: [(&str, &[u64], Vec<u8>); 8] = [
        ("<f8", &[2], doubles(&mut pattern.size.to_array().into_iter())),
        ("<f8", &[], doubles(&mut [pattern.radius].into_iter())),
        ("<f8", &[n, 3], vectors(&pattern.places)),
        ("<f8", &[n], doubles(&mut pattern.twists.iter().copied())),
        ("<u4", &[edges.len() as u64, 2], ends),
        ("<i4", &[edges.len() as u64, 2], tiles),
        ("<f8", &[n], doubles(&mut pattern.rest_lengths.iter().copied())),
        ("<f8", &[n, 3], vectors(&pattern.directors)),
    ];
    for (name, (kind, shape, bytes)) in ARRAYS.iter().zip(arrays) {
        entry(&mut zip, name, kind, shape, &bytes)?;
    }
    for (name, axis) in ARRAYS[8..].iter().zip(table.axes()) {
        let bytes: Vec<u8> = axis.iter().flat_map(|x| x.to_le_bytes()).collect();
        entry(&mut zip, name, "<f4", &[axis.len() as u64], &bytes)?;
    }
    let [sx, sa, sy] = table.axes().each_ref().map(|axis| axis.len() as u64);
    let bytes: Vec<u8> = table.values().iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
    entry(&mut zip, ARRAYS[11], "<f4", &[table.vertex_count() as u64, sy, sa, sx, 4], &bytes)?;
    zip.finish()
}

/// How long an axis of an array may be.
#[derive(Clone, Copy)]
enum Length {
    Is(u64),
    AtMost(u64),
}

use Length::{AtMost, Is};

impl std::fmt::Display for Length {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Is(n) => write!(f, "{n}"),
            AtMost(n) => write!(f, "1 to {n}"),
        }
    }
}

struct Reader<'a> {
    path: &'a Path,
    arrays: Arrays,
}

impl Reader<'_> {
    /// The numbers of an array of a certain shape, and where its entry starts.
    fn load(&mut self, name: &str, shape: &[Length]) -> Result<(Vec<f64>, usize)> {
        let fits = |found: &[u64]| {
            let fit = |(found, length): (&u64, &Length)| match length {
                Is(n) => found == n,
                AtMost(n) => (1..=*n).contains(found),
            };
            found.len() == shape.len() && found.iter().zip(shape).all(fit)
        };
        let lengths: Vec<_> = shape.iter().map(Length::to_string).collect();
        let expected = format!("[{}]", lengths.join(", "));
        // The shape is bounded, so that the bytes are; numbers have at most 8.
        let Some(array) = self.arrays.load(name, u64::MAX, fits, &expected)? else {
            let expected = format!("a yarn model, with {}", ARRAYS.join(", "));
            return Err(Error::binary(self.path, 0, format_args!("no array '{name}'"), expected));
        };
        Ok((array.numbers().collect(), array.at as usize))
    }

    fn vectors(&mut self, name: &str, count: Length) -> Result<Vec<DVec3>> {
        let (numbers, _) = self.load(name, &[count, Is(3)])?;
        Ok(numbers.as_chunks().0.iter().map(|p| DVec3::from_array(*p)).collect())
    }

    /// Pairs of whole numbers.
    fn pairs<T: TryFrom<i64>>(&mut self, name: &str, count: u64) -> Result<Vec<[T; 2]>> {
        let (numbers, at) = self.load(name, &[Is(count), Is(2)])?;
        let whole = |x: f64| (x.fract() == 0.0 && x.abs() < 1e15).then_some(x as i64);
        let pair = |(row, pair): (usize, &[f64; 2])| -> Result<[T; 2]> {
            let number = |k: usize| {
                whole(pair[k]).and_then(|x| T::try_from(x).ok()).ok_or_else(|| {
                    let found = format!("{} in row {row} of '{name}'", pair[k]);
                    Error::binary(self.path, at, found, "a whole number of 32 bits")
                })
            };
            Ok([number(0)?, number(1)?])
        };
        numbers.as_chunks().0.iter().enumerate().map(pair).collect()
    }
}

/// Reads a model.
pub(super) fn read(path: &Path) -> Result<YarnModel> {
    let mut reader = Reader { path, arrays: Arrays::open(path)? };
    let size = reader.load("pattern_size", &[Is(2)])?.0;
    let radius = reader.load("radius", &[])?.0;
    let places = reader.vectors("places", AtMost(MOST_VERTICES))?;
    let n = places.len() as u64;
    let twists = reader.load("twists", &[Is(n)])?.0;
    let ends = reader.pairs::<u32>("edges", n)?;
    let tiles = reader.pairs::<i32>("edge_tiles", n)?;
    let edges = ends.iter().zip(&tiles);
    let edges = edges.map(|(&[from, to], &tile)| PatternEdge { from, to, tile: IVec2::from_array(tile) });
    let pattern = Pattern {
        size: DVec2::new(size[0], size[1]),
        radius: radius[0],
        places,
        twists,
        edges: edges.collect(),
        rest_lengths: reader.load("rest_lengths", &[Is(n)])?.0,
        directors: reader.vectors("directors", Is(n))?,
    };
    let mut axes: [Vec<f32>; 3] = Default::default();
    for (axis, name) in axes.iter_mut().zip(AXES) {
        let most = AtMost(StrainTable::MOST_NODES as u64);
        *axis = reader.load(&format!("axis_{name}"), &[most])?.0.iter().map(|x| *x as f32).collect();
    }
    let [sx, sa, sy] = axes.each_ref().map(|axis| Is(axis.len() as u64));
    let (numbers, _) = reader.load("displacements", &[Is(n), sy, sa, sx, Is(4)])?;
    let values = numbers.as_chunks().0.iter().map(|v: &[f64; 4]| v.map(|x| x as f32)).collect();
    StrainTable::new(axes, values).and_then(|table| YarnModel::new(pattern, table)).map_err(|e| at(path, &e))
}
