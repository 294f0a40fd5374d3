//! Tables on disk: an accelerator that is checked as a whole before any of it is used.
//!
//! A file is named by its key and holds, little-endian: magic (16 bytes), version u32, key u128, grid (density, 3
//! counts below rest and 3 above, u32), knots u32, least half-length f32, blocks `[node][group][4][4]` f32, whole
//! cells `[node]` u8, and the XXH3 hash of all before, u64.

use crate::knot::table::{Block, GROUP, Grid, Table};
use crate::knot::tabulate::Subject;
use crate::scene::{Stencil, StencilPoint, Term, Terms};
use crate::{Error, Result};
use std::io::Write;
use std::path::{Path, PathBuf};
use xxhash_rust::xxh3::{xxh3_64, xxh3_128};

const MAGIC: &[u8; 16] = b"knotmesh table\r\n";
/// To be raised with every change of the format, or of what is put into tables.
const VERSION: u32 = 1;
const HEADER: usize = 16 + 4 + 16 + 7 * 4 + 4 + 4;
const HASH: usize = 8;
/// The variable that names another folder than the user's.
pub const VARIABLE: &str = "KNOTMESH_CACHE";

/// The folder of the user's cache: `KNOTMESH_CACHE`, or the system's place; an empty variable is none.
pub fn folder() -> Option<PathBuf> {
    match std::env::var_os(VARIABLE) {
        Some(path) => (!path.is_empty()).then(|| path.into()),
        None => {
            use etcetera::BaseStrategy;
            etcetera::choose_base_strategy().ok().map(|s| s.cache_dir().join("knotmesh"))
        }
    }
}

/// The hash of everything that a table depends on, this program's version included.
pub fn key(subject: &Subject, grid: &Grid) -> u128 {
    let mut bytes = Bytes::default();
    bytes.bytes(env!("CARGO_PKG_VERSION").as_bytes());
    bytes.int(VERSION as usize);
    bytes.grid(grid);
    let Subject { stencil, corners, beta, weights } = subject;
    bytes.stencil(stencil);
    bytes.floats(corners.iter().flat_map(|c| [c.x, c.y]));
    bytes.floats([*beta, weights.angle, weights.length]);
    xxh3_128(&bytes.0)
}

/// The file of a key.
pub fn path(folder: &Path, key: u128) -> PathBuf {
    folder.join(format!("{key:032x}.table"))
}

/// The table of a key; `None` if there is none or anything about it is wrong.
pub fn read(folder: &Path, key: u128, subject: &Subject, grid: &Grid) -> Option<Table<f32>> {
    let knots = subject.stencil.knot_count();
    let blocks = grid.node_count() * Table::<f32>::groups_of(knots);
    let size = HEADER + blocks * size_of::<Block<f32>>() + grid.node_count() + HASH;
    let path = path(folder, key);
    // Nothing of a wrong size is read into memory.
    let found = std::fs::metadata(&path).ok()?;
    if !found.is_file() || found.len() != size as u64 {
        return None;
    }
    let bytes = std::fs::read(&path).ok().filter(|b| b.len() == size)?;
    let (body, hash) = bytes.split_at(size - HASH);
    let shortest = (subject.stencil.yarn_radius * 0.5) as f32;
    if hash != xxh3_64(body).to_le_bytes() || body[..HEADER] != header(key, grid, knots, shortest)[..] {
        return None;
    }
    let (values, whole) = body[HEADER..].split_at(blocks * size_of::<Block<f32>>());
    let mut values = values.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    let mut finite = true;
    let mut next = || {
        let value = values.next().unwrap_or(f32::NAN);
        finite &= value.is_finite();
        value
    };
    let mut read = vec![Block::default(); blocks];
    for value in read.iter_mut().flat_map(|b| b.0.iter_mut().flatten()) {
        *value = next();
    }
    let fine = finite && whole.iter().all(|w| *w <= 1);
    let whole = whole.iter().map(|w| f32::from(*w)).collect();
    if fine { Table::new(*grid, knots, shortest, read, whole) } else { None }
}

/// Puts a table where it is found by its key, whole or not at all.
pub fn write(folder: &Path, key: u128, table: &Table<f32>) -> Result<()> {
    let mut bytes = header(key, table.grid(), table.knot_count(), table.shortest());
    for value in table.blocks().iter().flat_map(|b| b.0.iter().flatten()) {
        bytes.extend(value.to_le_bytes());
    }
    bytes.extend(table.whole().iter().map(|w| u8::from(*w > 0.5)));
    bytes.extend(xxh3_64(&bytes).to_le_bytes());
    let path = path(folder, key);
    let io = |e| Error::io(&path, e);
    std::fs::create_dir_all(folder).map_err(io)?;
    // Of two processes that build the same table, the last one's file stays.
    let mut file =
        tempfile::Builder::new().prefix(".knotmesh-").suffix(".tmp").tempfile_in(folder).map_err(io)?;
    file.write_all(&bytes).map_err(io)?;
    file.persist(&path).map_err(|e| io(e.error))?;
    Ok(())
}

fn header(key: u128, grid: &Grid, knots: usize, shortest: f32) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(HEADER);
    bytes.extend(MAGIC);
    bytes.extend(VERSION.to_le_bytes());
    bytes.extend(key.to_le_bytes());
    for number in [grid.density].iter().chain(&grid.below).chain(&grid.above) {
        bytes.extend(number.to_le_bytes());
    }
    bytes.extend((knots as u32).to_le_bytes());
    bytes.extend(shortest.to_le_bytes());
    bytes
}

/// What is hashed: numbers, each list with its length before it.
#[derive(Default)]
struct Bytes(Vec<u8>);

impl Bytes {
    fn bytes(&mut self, bytes: &[u8]) {
        self.int(bytes.len());
        self.0.extend(bytes);
    }
    fn int(&mut self, number: usize) {
        self.0.extend((number as u64).to_le_bytes());
    }
    fn floats(&mut self, numbers: impl IntoIterator<Item = f64>) {
        let before = self.0.len();
        for number in numbers {
            self.0.extend(number.to_le_bytes());
        }
        self.int(self.0.len() - before);
    }
    fn grid(&mut self, grid: &Grid) {
        let Grid { density, below, above } = grid;
        for number in [density].into_iter().chain(below).chain(above) {
            self.int(*number as usize);
        }
        self.int(GROUP);
    }

    /// Every field, so that a new one is not forgotten.
    fn stencil(&mut self, stencil: &Stencil<f64>) {
        let Stencil {
            corner_count,
            points,
            strand_offsets,
            weights,
            frame_gradients,
            knot_direction,
            knot_half_length,
            knot_weights,
            knot_gradients,
            rest_spread,
            yarn_radius,
            terms,
        } = stencil;
        // What else is in `terms` follows from its lengths and cosines.
        let Terms { lengths, cosines, .. } = terms;
        self.int(*corner_count);
        self.int(points.len());
        for StencilPoint { role, knot, sign, z } in points {
            self.int(role.code().into());
            self.int(*knot as usize);
            self.floats([*sign, *z]);
        }
        self.int(strand_offsets.len());
        strand_offsets.iter().for_each(|o| self.int(*o));
        for list in [weights, knot_half_length, knot_weights] {
            self.floats(list.iter().copied());
        }
        for list in [frame_gradients, knot_direction, knot_gradients] {
            self.floats(list.iter().flat_map(|v| [v.u, v.v]));
        }
        self.floats([*rest_spread, *yarn_radius]);
        for terms in [lengths, cosines] {
            self.int(terms.len());
            for Term { point, segment, rest, knots, knot_count, codes } in terms {
                for number in [point, segment, knot_count].into_iter().chain(knots).chain(codes) {
                    self.int(*number as usize);
                }
                self.floats([*rest]);
            }
        }
    }
}
