//! The Pareto front.

/// The points that no other point beats: `[i]` (cost, error), both better when lower. A point is beaten by one
/// that is as low in both and lower in one; of equal points the first stays. Points with a coordinate that is
/// not finite never are on the front. Returns indices by ascending cost.
pub fn front(points: &[(f64, f64)]) -> Vec<usize> {
    let finite = |i: &usize| points[*i].0.is_finite() && points[*i].1.is_finite();
    let mut order: Vec<usize> = (0..points.len()).filter(finite).collect();
    order.sort_by(|a, b| {
        let (p, q) = (points[*a], points[*b]);
        p.0.total_cmp(&q.0).then(p.1.total_cmp(&q.1)).then(a.cmp(b))
    });
    let mut lowest = f64::INFINITY;
    order.retain(|i| {
        let better = points[*i].1 < lowest;
        lowest = lowest.min(points[*i].1);
        better
    });
    order
}
