//! A tree of boxes over triangles: the nearest point, and the first triangle that a segment enters.

use glam::DVec3;

/// Triangles in a leaf at most.
const LEAF: usize = 4;

/// A box and what it holds.
#[derive(Clone, Copy, Debug)]
struct Node {
    low: DVec3,
    high: DVec3,
    /// Of a leaf, where its triangles start in the order; else the second child (the first follows its parent).
    at: u32,
    /// Triangles in a leaf; 0 for the others.
    count: u32,
}

/// Triangles in boxes in boxes. Vertices may move ([`Bvh::refit`]); triangles stay.
#[derive(Clone, Debug)]
pub struct Bvh {
    nodes: Vec<Node>,
    order: Vec<u32>,
}

/// The point of a triangle mesh that is nearest to another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nearest {
    /// Its triangle.
    pub triangle: u32,
    /// Its weights over the corners.
    pub weights: [f64; 3],
    /// Where it is.
    pub point: DVec3,
    /// Squared distance.
    pub squared: f64,
}

impl Bvh {
    /// Sorts triangles into boxes: at the median of their middles along the longest side.
    pub fn new(vertices: &[DVec3], triangles: &[[u32; 3]]) -> Self {
        let middles: Vec<DVec3> =
            triangles.iter().map(|t| t.iter().map(|v| vertices[*v as usize]).sum::<DVec3>() / 3.0).collect();
        let mut bvh = Self { nodes: Vec::new(), order: (0..triangles.len() as u32).collect() };
        if !triangles.is_empty() {
            bvh.split(0, triangles.len(), &middles);
        }
        bvh.refit(vertices, triangles);
        bvh
    }

    fn split(&mut self, begin: usize, end: usize, middles: &[DVec3]) {
        let node = self.nodes.len();
        self.nodes.push(Node {
            low: DVec3::ZERO,
            high: DVec3::ZERO,
            at: begin as u32,
            count: (end - begin) as u32,
        });
        if end - begin <= LEAF {
            return;
        }
        let part = &mut self.order[begin..end];
        let of = |t: &u32| middles[*t as usize];
        let low = part.iter().map(of).fold(DVec3::INFINITY, DVec3::min);
        let high = part.iter().map(of).fold(DVec3::NEG_INFINITY, DVec3::max);
        let size = high - low;
        let axis = if size.x >= size.y && size.x >= size.z {
            0
        } else if size.y >= size.z {
            1
        } else {
            2
        };
        let middle = part.len() / 2;
        part.select_nth_unstable_by(middle, |a, b| of(a)[axis].total_cmp(&of(b)[axis]).then(a.cmp(b)));
        self.nodes[node].count = 0;
        self.split(begin, begin + middle, middles);
        self.nodes[node].at = self.nodes.len() as u32;
        self.split(begin + middle, end, middles);
    }

    /// Boxes around vertices that have moved.
    pub fn refit(&mut self, vertices: &[DVec3], triangles: &[[u32; 3]]) {
        for i in (0..self.nodes.len()).rev() {
            let node = self.nodes[i];
            let (low, high) = if node.count > 0 {
                let part = &self.order[node.at as usize..(node.at + node.count) as usize];
                let corners = part.iter().flat_map(|t| triangles[*t as usize]).map(|v| vertices[v as usize]);
                corners.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(l, h), p| (l.min(p), h.max(p)))
            } else {
                let (a, b) = (&self.nodes[i + 1], &self.nodes[node.at as usize]);
                (a.low.min(b.low), a.high.max(b.high))
            };
            self.nodes[i].low = low;
            self.nodes[i].high = high;
        }
    }

    /// The nearest point within a squared distance, beginning with a triangle that may be near (any will do, it only saves time).
    pub fn nearest(
        &self,
        vertices: &[DVec3],
        triangles: &[[u32; 3]],
        point: DVec3,
        within: f64,
        first: u32,
    ) -> Option<Nearest> {
        let mut best: Option<Nearest> = None;
        let mut bound = within;
        let mut visit = |triangle: u32, bound: &mut f64| {
            let corners = triangles[triangle as usize].map(|v| vertices[v as usize]);
            let weights = nearest_weights(point, corners);
            let at = corners[0] * weights[0] + corners[1] * weights[1] + corners[2] * weights[2];
            let squared = at.distance_squared(point);
            // The lowest number among equals, so that the answer does not depend on where the search begins.
            let better = match &best {
                None => squared <= *bound,
                Some(b) => squared < b.squared || (squared == b.squared && triangle < b.triangle),
            };
            if better {
                *bound = squared;
                best = Some(Nearest { triangle, weights, point: at, squared });
            }
        };
        if (first as usize) < triangles.len() {
            visit(first, &mut bound);
        }
        let mut stack = [0u32; 64];
        let mut depth = usize::from(!self.nodes.is_empty());
        while depth > 0 {
            depth -= 1;
            let node = stack[depth] as usize;
            let Node { at, count, .. } = self.nodes[node];
            if self.squared(node, point) > bound {
                continue;
            }
            if count > 0 {
                for t in &self.order[at as usize..(at + count) as usize] {
                    visit(*t, &mut bound);
                }
                continue;
            }
            let (a, b) = (node as u32 + 1, at);
            let nearer = self.squared(a as usize, point) <= self.squared(b as usize, point);
            // Medians halve: 64 levels hold any number of triangles.
            let pair = if nearer { [b, a] } else { [a, b] };
            stack[depth..depth + 2].copy_from_slice(&pair);
            depth += 2;
        }
        best
    }

    fn squared(&self, node: usize, point: DVec3) -> f64 {
        let Node { low, high, .. } = self.nodes[node];
        (point.clamp(low, high) - point).length_squared()
    }

    /// The first triangle that a segment crosses from its front, and how far along: `(triangle, 0 to 1)`.
    pub fn enters(
        &self,
        vertices: &[DVec3],
        triangles: &[[u32; 3]],
        from: DVec3,
        to: DVec3,
    ) -> Option<(u32, f64)> {
        let along = to - from;
        let mut best: Option<(u32, f64)> = None;
        let mut stack = [0u32; 64];
        let mut depth = usize::from(!self.nodes.is_empty());
        while depth > 0 {
            depth -= 1;
            let node = stack[depth] as usize;
            let Node { low, high, at, count } = self.nodes[node];
            if !meets(low, high, from, along, best.map_or(1.0, |b| b.1)) {
                continue;
            }
            if count == 0 {
                stack[depth..depth + 2].copy_from_slice(&[at, node as u32 + 1]);
                depth += 2;
                continue;
            }
            for t in &self.order[at as usize..(at + count) as usize] {
                let [a, b, c] = triangles[*t as usize].map(|v| vertices[v as usize]);
                let normal = (b - a).cross(c - a);
                let speed = along.dot(normal);
                if speed >= 0.0 {
                    continue;
                }
                let s = (a - from).dot(normal) / speed;
                if !(0.0..=1.0).contains(&s) {
                    continue;
                }
                let p = from + along * s;
                let inside = [(a, b), (b, c), (c, a)]
                    .iter()
                    .all(|(u, v)| (*v - *u).cross(p - *u).dot(normal) >= -1e-12 * normal.length_squared());
                let first = best.is_none_or(|(bt, bs)| s < bs || (s == bs && *t < bt));
                if inside && first {
                    best = Some((*t, s));
                }
            }
        }
        best
    }
}

/// Whether a segment meets a box before a share of its length.
fn meets(low: DVec3, high: DVec3, from: DVec3, along: DVec3, most: f64) -> bool {
    let (mut begin, mut end) = (0.0, most);
    for k in 0..3 {
        if along[k].abs() < 1e-300 {
            if from[k] < low[k] || from[k] > high[k] {
                return false;
            }
            continue;
        }
        let (a, b) = ((low[k] - from[k]) / along[k], (high[k] - from[k]) / along[k]);
        // A little wider, for what rounding takes.
        begin = f64::max(begin, a.min(b) - 1e-12);
        end = f64::min(end, a.max(b) + 1e-12);
    }
    begin <= end
}

/// Weights of the point of a triangle that is nearest to p: Ericson, Real-Time Collision Detection (2005), 5.1.5.
fn nearest_weights(p: DVec3, [a, b, c]: [DVec3; 3]) -> [f64; 3] {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return [1.0, 0.0, 0.0];
    }
    let bp = p - b;
    let (d3, d4) = (ab.dot(bp), ac.dot(bp));
    if d3 >= 0.0 && d4 <= d3 {
        return [0.0, 1.0, 0.0];
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        let s = d1 / (d1 - d3);
        return [1.0 - s, s, 0.0];
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(cp), ac.dot(cp));
    if d6 >= 0.0 && d5 <= d6 {
        return [0.0, 0.0, 1.0];
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        let s = d2 / (d2 - d6);
        return [1.0 - s, 0.0, s];
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        let s = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return [0.0, 1.0 - s, s];
    }
    let all = va + vb + vc;
    // Only a triangle without area gets here with nothing.
    if all <= 0.0 { [1.0, 0.0, 0.0] } else { [va / all, vb / all, vc / all] }
}
