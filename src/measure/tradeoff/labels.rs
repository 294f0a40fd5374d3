//! Places for labels in a plot: near their points, clear of each other, of all points and of the front's line.

/// A rectangle, pixels; y goes down.
#[derive(Clone, Copy, Debug)]
pub(super) struct Box2 {
    pub left: i32,
    pub right: i32,
    pub top: i32,
    pub bottom: i32,
}

impl Box2 {
    fn overlaps(&self, other: &Box2) -> bool {
        self.left < other.right
            && other.left < self.right
            && self.top < other.bottom
            && other.top < self.bottom
    }

    fn holds(&self, other: &Box2) -> bool {
        self.left <= other.left
            && other.right <= self.right
            && self.top <= other.top
            && other.bottom <= self.bottom
    }

    fn grown(&self, by: i32) -> Box2 {
        Box2 { left: self.left - by, right: self.right + by, top: self.top - by, bottom: self.bottom + by }
    }

    /// The nearest point of the box.
    fn nearest(&self, (x, y): (i32, i32)) -> (i32, i32) {
        (x.clamp(self.left, self.right), y.clamp(self.top, self.bottom))
    }
}

/// Where a label goes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Label {
    /// Its upper left corner.
    pub corner: (i32, i32),
    /// Where a line from the point to the label ends, if the label stands off.
    pub leader: Option<(i32, i32)>,
}

/// Labels placed one by one.
pub(super) struct Labels {
    frame: Box2,
    points: Vec<(i32, i32)>,
    /// Points along lines that labels had better not cross.
    line: Vec<(i32, i32)>,
    placed: Vec<Box2>,
}

/// Steps between samples of a line, pixels.
const STEP: i32 = 4;

impl Labels {
    /// Labels within `frame`, around `points`, off the polyline `line`.
    pub fn new(frame: Box2, points: &[(i32, i32)], line: &[(i32, i32)]) -> Self {
        let line = line.windows(2).flat_map(|pair| samples(pair[0], pair[1])).collect();
        Self { frame, points: points.to_vec(), line, placed: Vec::new() }
    }

    /// A place for a label of this size at a point.
    pub fn place(&mut self, (x, y): (i32, i32), (width, height): (i32, i32)) -> Label {
        let mut best = (i64::MAX, Box2 { left: x, right: x + width, top: y, bottom: y + height });
        for distance in [9, 22, 38, 58, 82, 110, 145, 185, 230] {
            for direction in 0..16 {
                let angle = f64::from(direction) * std::f64::consts::TAU / 16.0;
                let (dx, dy) = (angle.cos(), angle.sin());
                // The label's side that faces the point stands at the distance.
                let (cx, cy) =
                    (f64::from(x) + dx * f64::from(distance), f64::from(y) + dy * f64::from(distance));
                let left = (cx + (dx.signum() * dx.abs().sqrt() - 1.0) * f64::from(width) / 2.0) as i32;
                let top = (cy + (dy.signum() * dy.abs().sqrt() - 1.0) * f64::from(height) / 2.0) as i32;
                let label = Box2 { left, right: left + width, top, bottom: top + height };
                let cost = self.cost(&label, (x, y)) + i64::from(distance);
                if cost < best.0 {
                    best = (cost, label);
                }
            }
        }
        let label = best.1;
        let end = label.nearest((x, y));
        let far = (end.0 - x).abs().max((end.1 - y).abs()) > 14;
        if far {
            self.line.extend(samples((x, y), end));
        }
        self.placed.push(label.grown(2));
        Label { corner: (label.left, label.top), leader: far.then_some(end) }
    }

    fn cost(&self, label: &Box2, at: (i32, i32)) -> i64 {
        let inside = |points: &[(i32, i32)], label: &Box2| {
            let hit = |(x, y): &&(i32, i32)| {
                label.left <= *x && *x <= label.right && label.top <= *y && *y <= label.bottom
            };
            points.iter().filter(hit).count() as i64
        };
        let leader = samples(at, label.nearest(at));
        let crossed = self.placed.iter().map(|p| inside(&leader, p)).sum::<i64>();
        let overlaps = self.placed.iter().filter(|p| p.overlaps(label)).count() as i64;
        let out = i64::from(!self.frame.holds(label));
        100_000 * (overlaps + out)
            + 4_000 * crossed
            + 2_000 * inside(&self.points, &label.grown(6))
            + 30 * inside(&self.line, &label.grown(2))
    }
}

fn samples(a: (i32, i32), b: (i32, i32)) -> Vec<(i32, i32)> {
    let count = (b.0 - a.0).abs().max((b.1 - a.1).abs()) / STEP + 1;
    (0..=count).map(|i| (a.0 + (b.0 - a.0) * i / count, a.1 + (b.1 - a.1) * i / count)).collect()
}
