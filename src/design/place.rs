//! A rough place in space for every vertex, row by row: rounds become rings, rows lines, and short rows lie on top of
//! what they were worked on. Relaxation of the mesh does the rest.

use super::assemble::Corners;
use super::expression::Gauge;
use super::fabric::{Direction, Fabric, PieceRecord, RowRecord};
use glam::{DVec2, DVec3};
use std::f64::consts::TAU;

/// How much of a row's own shape goes over to the next: the rest is that of a ring or a line.
const KEPT: f64 = 0.5;
/// The same of heights, which carry heels and shoulders.
const KEPT_HEIGHT: f64 = 0.95;
/// How far a round moves in or out from the one below at most, in heights of a row: so much less it rises.
const MOST_ASIDE: f64 = 0.9;

/// Positions of all vertices, metres.
pub fn place(fabric: &Fabric, corners: &Corners, gauge: Gauge) -> Vec<DVec3> {
    let mut placing = Placing {
        fabric,
        corners,
        gauge,
        places: vec![None; corners.count],
        up: fabric.pieces.iter().map(|p| p.toward).collect(),
        right: fabric.pieces.iter().map(|p| p.start).collect(),
        begun: vec![false; fabric.pieces.len()],
        middle: fabric.pieces.iter().map(|p| p.at).collect(),
        short: vec![0; fabric.pieces.len()],
        borders: 0,
    };
    for row in &fabric.rows {
        placing.row(row);
        placing.borders(row.faces.end);
    }
    placing.borders(fabric.faces.len());
    let mut places = placing.rest();
    for (number, piece) in fabric.pieces.iter().enumerate().filter(|(_, p)| p.curled) {
        curl(fabric, corners, number, piece, &mut places);
    }
    places
}

/// Rolls a flat piece around an axis behind it until its sides meet.
fn curl(fabric: &Fabric, corners: &Corners, number: usize, piece: &PieceRecord, places: &mut [DVec3]) {
    let mut of_piece = vec![false; places.len()];
    for row in fabric.rows.iter().filter(|r| r.piece as usize == number) {
        for vertex in row.faces.clone().flat_map(|face| corners.face(face)) {
            of_piece[*vertex as usize] = true;
        }
    }
    let front = piece.start.cross(piece.toward);
    let along = |p: DVec3| (p - piece.at).dot(piece.start);
    let sides = of_piece.iter().zip(&*places).filter(|(of, _)| **of).map(|(_, p)| along(*p));
    let (least, most) = sides.fold((f64::MAX, f64::MIN), |(a, b), x| (a.min(x), b.max(x)));
    let radius = (most - least) / TAU;
    if radius <= 0.0 {
        return;
    }
    let middle = (least + most) / 2.0;
    for (_, p) in of_piece.iter().zip(places).filter(|(of, _)| **of) {
        let x = along(*p);
        let angle = (x - middle) / radius;
        let out = radius + (*p - piece.at).dot(front);
        let flat = *p - piece.start * x - front * (*p - piece.at).dot(front);
        *p = flat + piece.start * (middle + out * angle.sin()) + front * (out * angle.cos() - radius);
    }
}

struct Placing<'a> {
    fabric: &'a Fabric,
    corners: &'a Corners,
    gauge: Gauge,
    places: Vec<Option<DVec3>>,
    /// `[piece]` where it grows now.
    up: Vec<DVec3>,
    /// `[piece]` of flat ones: to the right.
    right: Vec<DVec3>,
    begun: Vec<bool>,
    /// `[piece]` of round ones: the middle of the last whole round.
    middle: Vec<DVec3>,
    /// `[piece]` stitches of the last short row since then.
    short: Vec<usize>,
    /// Borders before this face have a place, or wait in vain.
    borders: usize,
}

/// A row's upper vertices in the order of work, and where each comes from.
struct Chain {
    vertices: Vec<u32>,
    /// The place below, where there is one.
    feet: Vec<Option<DVec3>>,
    /// The vertex below, for rows that begin in the air.
    below: Vec<u32>,
}

impl Placing<'_> {
    fn chain(&self, row: &RowRecord) -> Chain {
        let mut chain = Chain { vertices: Vec::new(), feet: Vec::new(), below: Vec::new() };
        let mut sums: Vec<(DVec3, f64)> = Vec::new();
        for number in row.faces.clone() {
            let face = &self.fabric.faces[number];
            if !face.in_row {
                continue;
            }
            let vertices = self.corners.face(number);
            let (bottoms, tops) = (usize::from(face.bottoms), usize::from(face.tops));
            for k in 0..=tops {
                // From the right to the left, or the other way.
                let k = if row.direction == Direction::Left { k } else { tops - k };
                let vertex = vertices[(bottoms + 1 + k).min(vertices.len() - 1)];
                let along = if tops == 0 { 0.5 } else { k as f64 / tops as f64 };
                let at = (1.0 - along) * bottoms as f64;
                let (low, part) = ((at as usize).min(bottoms), at - at.floor());
                let ends = [vertices[low], vertices[(low + 1).min(bottoms)]];
                let foot = match ends.map(|v| self.places[v as usize]) {
                    [Some(a), Some(b)] => Some(a.lerp(b, part)),
                    _ => None,
                };
                if chain.vertices.last() != Some(&vertex) {
                    chain.vertices.push(vertex);
                    chain.below.push(ends[0]);
                    sums.push((DVec3::ZERO, 0.0));
                }
                if let (Some(foot), Some(sum)) = (foot, sums.last_mut()) {
                    *sum = (sum.0 + foot, sum.1 + 1.0);
                }
            }
        }
        chain.feet = sums.into_iter().map(|(sum, n)| (n > 0.0).then(|| sum / n)).collect();
        chain
    }

    fn row(&mut self, row: &RowRecord) {
        let chain = self.chain(row);
        let Some(piece) = self.fabric.pieces.get(row.piece as usize) else { return };
        let number = row.piece as usize;
        if chain.vertices.is_empty() {
            return;
        }
        let held = chain.feet.iter().flatten().count();
        if held < 2 && !self.begun[number] {
            self.begun[number] = true;
            return self.first_row(row, &chain, piece);
        }
        if !self.begun[number] {
            self.begun[number] = true;
            self.grow_from_feet(row, &chain, number);
        }
        if row.closed && chain.vertices.len() > 1 && held == chain.feet.len() {
            self.short[number] = 0;
            self.ring(&chain, number);
        } else {
            let up = self.growth(row, &chain, number, piece.round);
            self.line(row, &chain, number, piece.round, up);
        }
    }

    /// A cast-on: bottom and top in the air.
    fn first_row(&mut self, row: &RowRecord, chain: &Chain, piece: &PieceRecord) {
        let n = chain.vertices.len() - 1;
        let Gauge { width, height } = self.gauge;
        let across = piece.start.cross(piece.toward);
        for (j, (&top, &bottom)) in chain.vertices.iter().zip(&chain.below).enumerate() {
            let (place, rise) = if row.closed {
                let angle = TAU * j as f64 / n.max(1) as f64;
                let radius = n as f64 * width / TAU;
                let out = piece.start * angle.cos() + across * angle.sin();
                (piece.at + out * radius, height * j as f64 / n.max(1) as f64)
            } else {
                let from_right = match row.direction {
                    Direction::Left => j as f64,
                    Direction::Right => (n - j) as f64,
                };
                (piece.at + piece.start * width * (n as f64 / 2.0 - from_right), 0.0)
            };
            self.places[bottom as usize].get_or_insert(place + piece.toward * rise);
            self.places[top as usize].get_or_insert(place + piece.toward * (rise + height));
        }
        // The last stitch's left side.
        for number in row.faces.clone().filter(|f| self.fabric.faces[*f].in_row) {
            let vertices = self.corners.face(number);
            let (low, high) = ([vertices[0], vertices[1]], [vertices[3 % vertices.len()], vertices[2]]);
            for (low, high) in low.into_iter().zip(high) {
                if let (None, Some(place)) = (self.places[low as usize], self.places[high as usize]) {
                    self.places[low as usize] = Some(place - piece.toward * height);
                }
            }
        }
    }

    /// A piece that begins on other fabric grows away from it.
    fn grow_from_feet(&mut self, row: &RowRecord, chain: &Chain, number: usize) {
        let feet: Vec<DVec3> = chain.feet.iter().flatten().copied().collect();
        let along = (feet[feet.len() - 1] - feet[0]).normalize_or_zero();
        let mut away = DVec3::ZERO;
        for face in row.faces.clone().filter(|f| self.fabric.faces[*f].in_row) {
            let first = self.corners.offsets[face];
            for k in 0..u32::from(self.fabric.faces[face].bottoms) {
                let across = self.corners.across[(first + k) as usize];
                if across == u32::MAX {
                    continue;
                }
                let below = self.corners.face_of(across);
                let centre = self.centre(below);
                let ends =
                    [k, k + 1].map(|c| self.places[self.corners.vertices[(first + c) as usize] as usize]);
                if let ([Some(a), Some(b)], Some(centre)) = (ends, centre) {
                    away += ((a + b) / 2.0 - centre).normalize_or_zero();
                }
            }
        }
        if row.closed {
            let up = self.axis(&feet, self.up[number]);
            self.up[number] =
                if up.dot(away) < 0.0 && away.length() > 0.1 * feet.len() as f64 { -up } else { up };
            return;
        }
        let up = (away - along * away.dot(along)).normalize_or(self.up[number]);
        self.up[number] = up;
        let right = if row.direction == Direction::Left { -along } else { along };
        self.right[number] = right;
    }

    fn centre(&self, face: usize) -> Option<DVec3> {
        let placed: Vec<DVec3> =
            self.corners.face(face).iter().filter_map(|v| self.places[*v as usize]).collect();
        (!placed.is_empty()).then(|| placed.iter().sum::<DVec3>() / placed.len() as f64)
    }

    /// The direction that a ring of points faces: rounds run clockwise around it.
    fn axis(&self, ring: &[DVec3], otherwise: DVec3) -> DVec3 {
        let centre = ring.iter().sum::<DVec3>() / ring.len() as f64;
        let area: DVec3 =
            ring.iter().zip(ring.iter().cycle().skip(1)).map(|(a, b)| (*a - centre).cross(*b - centre)).sum();
        let size: f64 = ring.iter().map(|p| p.distance_squared(centre)).sum::<f64>() / ring.len() as f64;
        if area.length() > 0.2 * size { -area.normalize() } else { otherwise }
    }

    fn ring(&mut self, chain: &Chain, number: usize) {
        let n = chain.vertices.len() - 1;
        let Gauge { width, height } = self.gauge;
        let feet: Vec<DVec3> = chain.feet.iter().flatten().copied().collect();
        // A round is a turn of a helix, which climbs by a row: without that it is a ring, whose ends are one place.
        let climb = |j: usize| height * (j as f64 / n as f64 - 0.5);
        let level: Vec<DVec3> =
            feet.iter().enumerate().map(|(j, p)| *p - self.up[number] * climb(j)).collect();
        let up = self.axis(&level[..n], self.up[number]);
        self.up[number] = up;
        let centre = mean_of_round(&feet);
        self.middle[number] = centre;
        let first = up.any_orthonormal_vector();
        let second = first.cross(up);
        let flat = |p: DVec3| DVec2::new((p - centre).dot(first), (p - centre).dot(second));
        let radius = n as f64 * width / TAU;
        // The turn of the ring that lies nearest to what is below.
        let turn = feet
            .iter()
            .enumerate()
            .map(|(j, p)| DVec2::from_angle(-TAU * j as f64 / n as f64).rotate(flat(*p)))
            .sum::<DVec2>()
            .normalize_or(DVec2::X);
        for (j, &vertex) in chain.vertices.iter().enumerate() {
            if self.places[vertex as usize].is_some() {
                continue;
            }
            let foot = flat(feet[j]);
            let ideal = DVec2::from_angle(TAU * j as f64 / n as f64).rotate(turn) * radius;
            // No further aside than a stitch is high.
            let aside = ((ideal - foot) * (1.0 - KEPT)).clamp_length_max(MOST_ASIDE * height);
            let rise = (height.powi(2) - aside.length_squared()).sqrt();
            let spot = foot + aside;
            let above = (feet[j] - centre).dot(up);
            let above = climb(j) + KEPT_HEIGHT * (above - climb(j)) + rise;
            self.places[vertex as usize] = Some(centre + first * spot.x + second * spot.y + up * above);
        }
    }

    /// Where an open row grows. Short rows of a round that become longer again close a heel: they go inward.
    fn growth(&mut self, row: &RowRecord, chain: &Chain, number: usize, round: bool) -> DVec3 {
        let up = self.up[number];
        if !round || !row.short {
            return up;
        }
        let before = std::mem::replace(&mut self.short[number], chain.vertices.len());
        if before == 0 || chain.vertices.len() <= before {
            return up;
        }
        let feet: Vec<DVec3> = chain.feet.iter().flatten().copied().collect();
        let inward = self.middle[number] - feet.iter().sum::<DVec3>() / feet.len().max(1) as f64;
        (inward - up * inward.dot(up)).try_normalize().unwrap_or(up)
    }

    fn line(&mut self, row: &RowRecord, chain: &Chain, number: usize, round: bool, up: DVec3) {
        let Gauge { width, height } = self.gauge;
        let right = self.right[number];
        let forth = if row.direction == Direction::Left { -right } else { right };
        let mut spots: Vec<Option<DVec3>> = chain.feet.iter().map(|f| f.map(|f| f + up * height)).collect();
        if !round && spots.len() > 1 {
            let middle = (spots.len() - 1) as f64 / 2.0;
            let held: Vec<DVec3> = spots.iter().flatten().copied().collect();
            if held.len() == spots.len() {
                let centre = held.iter().sum::<DVec3>() / held.len() as f64;
                for (j, spot) in spots.iter_mut().enumerate() {
                    let even = centre + forth * width * (j as f64 - middle);
                    *spot = spot.map(|s| even.lerp(s, KEPT));
                }
            }
        }
        // What was cast on goes on from what is beside it.
        let first =
            (0..spots.len()).find(|j| spots[*j].or(self.places[chain.vertices[*j] as usize]).is_some());
        let mut last: Option<DVec3> = None;
        if let Some(first) = first {
            let begin = spots[first].or(self.places[chain.vertices[first] as usize]).unwrap_or_default();
            for j in (0..first).rev() {
                spots[j] = Some(begin - forth * width * (first - j) as f64);
            }
        }
        for (j, &vertex) in chain.vertices.iter().enumerate() {
            let place = self.places[vertex as usize].or(spots[j]);
            let place = place.unwrap_or_else(|| last.map_or(up * height, |l| l + forth * width));
            self.places[vertex as usize].get_or_insert(place);
            self.places[chain.below[j] as usize].get_or_insert(place - up * height);
            last = Some(place);
        }
        for face in row.faces.clone().filter(|f| self.fabric.faces[*f].in_row) {
            let vertices = self.corners.face(face);
            if vertices.len() == 4 {
                for (low, high) in [(vertices[0], vertices[3]), (vertices[1], vertices[2])] {
                    if let (None, Some(place)) = (self.places[low as usize], self.places[high as usize]) {
                        self.places[low as usize] = Some(place - up * height);
                    }
                }
            }
        }
    }

    /// Outer corners of borders, once the rows beside them have a place.
    fn borders(&mut self, end: usize) {
        for face in self.borders..end {
            if !self.fabric.faces[face].in_row {
                self.border(face);
            }
        }
        // The last rows' borders may still wait for the row above.
        self.borders = self.borders.max(end.saturating_sub(1));
        while self.borders > 0 {
            let face = self.borders - 1;
            let waits = !self.fabric.faces[face].in_row
                && self.corners.face(face).iter().any(|v| self.places[*v as usize].is_none());
            if !waits {
                break;
            }
            self.borders -= 1;
        }
    }

    fn border(&mut self, face: usize) {
        let vertices = self.corners.face(face).to_vec();
        let first = self.corners.offsets[face];
        let half = self.gauge.width / 2.0;
        // Away from the stitches beside it.
        let mut out = DVec3::ZERO;
        let mut edges = Vec::new();
        for k in 0..vertices.len() {
            let across = self.corners.across[first as usize + k];
            // What is picked up comes later, and lies outside.
            if across == u32::MAX || self.corners.face_of(across) > face + 1 && self.fabric.is_pick_up(face) {
                continue;
            }
            let ends = [vertices[k], vertices[(k + 1) % vertices.len()]];
            let [Some(a), Some(b)] = ends.map(|v| self.places[v as usize]) else { return };
            let Some(centre) = self.centre(self.corners.face_of(across)) else { return };
            out += ((a + b) / 2.0 - centre).normalize_or_zero();
            edges.push((a + b) / 2.0);
        }
        if edges.is_empty() {
            return;
        }
        let out = out.normalize_or(DVec3::X) * half;
        let middle = edges.iter().sum::<DVec3>() / edges.len() as f64;
        let n = vertices.len();
        let known: Vec<Option<DVec3>> = vertices.iter().map(|v| self.places[*v as usize]).collect();
        for (k, &vertex) in vertices.iter().enumerate() {
            if known[k].is_some() {
                continue;
            }
            // Beside the corner next to it that has a place; a tip beside the middle.
            let placed: Vec<DVec3> =
                [known[(k + 1) % n], known[(k + n - 1) % n]].into_iter().flatten().collect();
            let from = if placed.len() == 1 { placed[0] } else { middle };
            self.places[vertex as usize] = Some(from + out);
        }
    }

    /// Vertices that nothing gave a place lie in the middle of their faces' others.
    fn rest(mut self) -> Vec<DVec3> {
        for face in 0..self.fabric.faces.len() {
            let Some(centre) = self.centre(face) else { continue };
            for vertex in self.corners.face(face) {
                self.places[*vertex as usize].get_or_insert(centre);
            }
        }
        self.places.into_iter().map(Option::unwrap_or_default).collect()
    }
}

/// The middle of a round, whose first and last place are one.
fn mean_of_round(places: &[DVec3]) -> DVec3 {
    let n = (places.len() - 1) as f64;
    let ends = (places[0] + places[places.len() - 1]) / 2.0;
    (places[1..places.len() - 1].iter().sum::<DVec3>() + ends) / n
}
