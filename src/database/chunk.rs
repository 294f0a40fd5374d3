//! What is done with chunks of points, on lanes: strains, displacements, places.

use super::fabric::Homes;
use super::forms::FaceFrame;
use super::lookup::Lookup;
use super::shell::{FaceMap, Place, followed, lifted, shifted, strain};
use super::skip;
use super::strain::Axes;
use crate::backend::Scatter;
use crate::math::{Real, Scalar, V3, Wide};
use std::sync::atomic::{AtomicUsize, Ordering};

/// Points worked on as one, and room for lanes beyond them.
const BLOCK: usize = 128;
const ROOM: usize = BLOCK + MOST_LANES;
/// No processor has more numbers side by side.
const MOST_LANES: usize = 16;
/// Points that one task works on.
pub(super) const CHUNK: usize = 32 * BLOCK;

/// A vertex of the pattern.
#[derive(Clone, Copy, Debug)]
pub(super) struct Row<T> {
    pub(super) vertex: u32,
    pub(super) height: T,
    pub(super) twist: T,
}

/// What all chunks share.
pub(super) struct Shared<'a, T> {
    pub(super) homes: &'a Homes,
    pub(super) axes: &'a Axes<T>,
    pub(super) lookup: &'a Lookup<T>,
    pub(super) rows: &'a [Row<T>],
    pub(super) maps: &'a [FaceMap<T>],
    pub(super) frames: &'a [FaceFrame<T>],
    /// None where all faces changed.
    pub(super) changes: Option<&'a [u8]>,
    pub(super) points: &'a Scatter<'a, V3<T>>,
    pub(super) twists: &'a Scatter<'a, T>,
    /// Points left alone, carried, hidden; points outside the table.
    pub(super) counts: &'a [AtomicUsize; 4],
}

/// Some points, and what is kept of them.
pub struct Chunk<'a, 'b, T> {
    pub(super) shared: &'b Shared<'a, T>,
    pub(super) begin: usize,
    pub(super) places: &'b mut [Place<T>],
    pub(super) outside: &'b mut [bool],
}

/// A few points on their way, number beside number.
struct Block<T> {
    /// Faces, and which points of the block lie in them.
    pieces: [(u32, u8, u8); BLOCK],
    piece_count: usize,
    len: usize,
    /// First home.
    begin: usize,
    barycentric: [[T; ROOM]; 2],
    height: [T; ROOM],
    /// Strains, then fractions of cells.
    strain: [[T; ROOM]; 3],
    node: [T; ROOM],
    /// Along u, v, height and twist.
    displacement: [[T; 4]; ROOM],
}

impl<T: Scalar> Wide<T> for Chunk<'_, '_, T> {
    type Output = ();

    #[inline(always)]
    fn run<R: Real<Scalar = T>>(mut self) {
        let shared = self.shared;
        let mut counts = [0usize; 4];
        let zero = [T::zero(); ROOM];
        let mut block = Block {
            pieces: [(0, 0, 0); BLOCK],
            piece_count: 0,
            len: 0,
            begin: 0,
            barycentric: [zero; 2],
            height: zero,
            strain: [zero; 3],
            node: zero,
            displacement: [[T::zero(); 4]; ROOM],
        };
        let range = self.begin..self.begin + self.places.len();
        for (face, homes) in shared.homes.runs(range) {
            if let Some(changes) = shared.changes {
                let change = changes[face as usize];
                if change & skip::HIDDEN != 0 {
                    counts[2] += homes.len();
                    continue;
                }
                if change & skip::STRAIN == 0 {
                    self.carry(homes, change, changes, &mut counts);
                    continue;
                }
            }
            let mut left = homes;
            while !left.is_empty() {
                // Homes of a block follow each other.
                if block.len == BLOCK || block.begin + block.len != left.start {
                    self.displace::<R>(&mut block);
                    (block.begin, block.len, block.piece_count) = (left.start, 0, 0);
                }
                let count = left.len().min(BLOCK - block.len);
                block.pieces[block.piece_count] = (face, block.len as u8, count as u8);
                block.piece_count += 1;
                block.len += count;
                left.start += count;
            }
        }
        self.displace::<R>(&mut block);
        counts[3] = self.outside.iter().filter(|o| **o).count();
        for (count, all) in counts.iter().zip(shared.counts) {
            all.fetch_add(*count, Ordering::Relaxed);
        }
    }
}

impl<T: Scalar> Chunk<'_, '_, T> {
    /// Lifts points again whose strain is known, where their surface moved.
    #[inline(always)]
    fn carry(&self, homes: std::ops::Range<usize>, change: u8, changes: &[u8], counts: &mut [usize; 4]) {
        let shared = self.shared;
        for home in homes {
            let place = &self.places[home - self.begin];
            if (change | changes[place.face as usize]) & skip::FRAME == 0 {
                counts[0] += 1;
                continue;
            }
            counts[1] += 1;
            let [b, c] = place.barycentric;
            shared.put(home, lifted(&shared.frames[place.face as usize], b, c, place.height), None);
        }
    }

    #[inline(always)]
    fn displace<R: Real<Scalar = T>>(&mut self, block: &mut Block<T>) {
        let (shared, n, begin) = (self.shared, block.len, block.begin);
        let homes = shared.homes;
        for i in 0..n {
            block.height[i] = shared.rows[homes.rows[begin + i] as usize].height;
        }
        for (all, given) in block.barycentric.iter_mut().zip(&homes.barycentric) {
            for (b, given) in all.iter_mut().zip(&given[begin..begin + n]) {
                *b = T::of((*given).into());
            }
        }
        for &(face, first, count) in &block.pieces[..block.piece_count] {
            let frame = &shared.frames[face as usize];
            let (first, count) = (usize::from(first), usize::from(count));
            for at in (first..first + count).step_by(R::LANES) {
                let [b, c] = block.barycentric.each_ref().map(|b| R::load(&b[at..]));
                let strain = strain(frame, b, c, R::load(&block.height[at..]));
                for (strain, all) in strain.iter().zip(&mut block.strain) {
                    strain.store(&mut all[at..]);
                }
            }
        }
        for at in (0..n).step_by(R::LANES) {
            let strain = block.strain.each_ref().map(|s| R::load(&s[at..]));
            let (cell, out) = shared.axes.find(shared.axes.strains(shared.axes.clamp(strain)));
            cell.node.store(&mut block.node[at..]);
            for k in 0..3 {
                cell.fraction[k].store(&mut block.strain[k][at..]);
            }
            let outside = &mut self.outside[begin - self.begin + at..];
            let mut flags = [T::zero(); MOST_LANES];
            R::select(out, R::one(), R::zero()).store(&mut flags);
            for (flag, outside) in flags[..R::LANES.min(n - at)].iter().zip(outside) {
                *outside = *flag != T::zero();
            }
        }
        for i in 0..n {
            let row = &shared.rows[homes.rows[begin + i] as usize];
            let fraction = [0, 1, 2].map(|k| block.strain[k][i]);
            let by = shared.lookup.at(row.vertex as usize, block.node[i].to_f64() as usize, fraction);
            block.displacement[i] = by;
            block.displacement[i][3] += row.twist;
        }
        for piece in 0..block.piece_count {
            self.place::<R>(block, piece);
        }
    }

    /// Puts the points of a face where they are displaced to.
    #[inline(always)]
    fn place<R: Real<Scalar = T>>(&mut self, block: &Block<T>, piece: usize) {
        let shared = self.shared;
        let (face, first, count) = block.pieces[piece];
        let (first, end) = (usize::from(first), usize::from(first) + usize::from(count));
        let (map, frame) = (&shared.maps[face as usize], &shared.frames[face as usize]);
        for at in (first..end).step_by(R::LANES) {
            let [b, c] = block.barycentric.each_ref().map(|b| R::load(&b[at..]));
            let mut by = [R::zero(); 3];
            for (lane, given) in block.displacement[at..at + R::LANES].iter().enumerate() {
                for k in 0..3 {
                    by[k].set_lane(lane, given[k]);
                }
            }
            let [u, v, h] = by;
            let all = shifted(&map.inverse, b, c, u, v);
            let height = R::load(&block.height[at..]) + h;
            let point = lifted(frame, all[1], all[2], height);
            let zero = R::zero();
            let left = R::or(R::or(all[0].lt(zero), all[1].lt(zero)), all[2].lt(zero));
            let mut out = [[T::zero(); MOST_LANES]; 7];
            let left = R::select(left, R::one(), zero);
            for (out, value) in out.iter_mut().zip([point.x, point.y, point.z, all[1], all[2], height, left])
            {
                value.store(out);
            }
            for lane in 0..R::LANES.min(end - at) {
                let home = block.begin + at + lane;
                let [x, y, z, b, c, height, left] = out.each_ref().map(|values| values[lane]);
                let mut point = V3::new(x, y, z);
                let mut place = Place { face, barycentric: [b, c], height };
                if left != T::zero() {
                    let (there, all) = followed(shared.maps, face, [T::one() - b - c, b, c]);
                    if there != face {
                        (place.face, place.barycentric) = (there, [all[1], all[2]]);
                        point = lifted(&shared.frames[there as usize], all[1], all[2], height);
                    }
                }
                self.places[home - self.begin] = place;
                shared.put(home, point, Some(block.displacement[at + lane][3]));
            }
        }
    }
}

impl<T: Scalar> Shared<'_, T> {
    /// Puts a point where its yarn has it.
    #[inline(always)]
    #[allow(unsafe_code)]
    fn put(&self, home: usize, point: V3<T>, twist: Option<T>) {
        let at = self.homes.points[home] as usize;
        // SAFETY: each point has one home, and each home one chunk.
        unsafe {
            self.points.write(at, point);
            if let Some(twist) = twist {
                self.twists.write(at, twist);
            }
        }
    }
}
