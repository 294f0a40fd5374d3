// What each residual adds to the normal equations and to the curvature. Twin of src/knot/sums.rs.

// A = sum J J^T and C = sum r H_r as lower triangles, row-major, and b = sum J r.
var<private> a_sum: array<f32, ROOM_MATRIX>;
var<private> c_sum: array<f32, ROOM_MATRIX>;
var<private> b_sum: array<f32, ROOM_UNKNOWNS>;

fn clear_sums() {
    for (var i = 0u; i < UNKNOWNS * UNKNOWNS; i++) {
        a_sum[i] = 0.0;
        c_sum[i] = 0.0;
    }
    for (var i = 0u; i < UNKNOWNS; i++) {
        b_sum[i] = 0.0;
    }
}

fn add_own(knot: u32, count: f32, w: f32, r: f32, slope: f32, second: f32) -> f32 {
    let i = 2u * knot + 1u;
    let at = i * UNKNOWNS + i;
    let row = w * slope;
    let counted = count * row;
    b_sum[i] += counted * r;
    a_sum[at] += counted * row;
    if SAFE {
        c_sum[at] += count * r * (w * second);
    }
    return count * (r * r);
}

fn add_own_length(i: u32) -> f32 {
    let own = stencil.own_lengths[i];
    let w = settings.weight_length;
    let l = at_knots[own.knot].half_length;
    let inverse = own_now[i].inverse;
    let r = w * (own_now[i].length - own.rest);
    let slope = l * inverse;
    let second = (1.0 - slope * slope) * inverse;
    return add_own(own.knot, own.count, w, r, slope, second);
}

fn add_own_cosine(i: u32) -> f32 {
    let own = stencil.own_cosines[i];
    let square = stencil.own_lengths[own.length].square;
    let knot = stencil.own_lengths[own.length].knot;
    let w = settings.weight_angle;
    let l = at_knots[knot].half_length;
    let inverse = own_now[own.length].inverse;
    let ll = l * l;
    let m = inverse * inverse;
    let r = w * ((own.sign * ll + own.offset) * m - own.rest);
    let half = (own.sign * square - own.offset) * (m * m);
    let g = half + half;
    let second = g * (square - (ll + ll + ll)) * m;
    return add_own(knot, own.count, w, r, g * l, second);
}

// How a term's points move with their knots: codes, places relative to the knot's centre, signed directions of contacts.
struct Moves {
    codes: array<u32, 3>,
    offsets: array<vec2<f32>, 3>,
    lengthen: array<vec2<f32>, 3>,
}

// A movement, if there is one.
struct Move {
    there: bool,
    by: vec2<f32>,
}

var<private> moves: Moves;

fn find_moves(term: Term, count: u32) {
    for (var i = 0u; i < 3u; i++) {
        let code = select(0u, term.codes[i], i < count);
        moves.codes[i] = code;
        if code == 0u {
            continue;
        }
        let point = term.point + i;
        moves.offsets[i] = offsets[point];
        if code % 2u == 1u {
            let p = stencil.points[point];
            moves.lengthen[i] = at_knots[p.knot].direction * p.sign;
        }
    }
}

// How point i moves with the term's unknown j.
fn point_move(i: u32, j: u32) -> Move {
    let code = moves.codes[i];
    if code == 0u || (code - 1u) / 2u != j / 2u {
        return Move(false, vec2<f32>(0.0));
    }
    if j % 2u == 0u {
        return Move(true, turned(moves.offsets[i]));
    }
    if code % 2u == 1u {
        return Move(true, moves.lengthen[i]);
    }
    return Move(false, vec2<f32>(0.0));
}

// How segment s of the term moves with its unknown j.
fn segment_move(s: u32, j: u32) -> Move {
    let end = point_move(s + 1u, j);
    let begin = point_move(s, j);
    if end.there && begin.there {
        return Move(true, end.by - begin.by);
    }
    if end.there {
        return end;
    }
    if begin.there {
        return Move(true, -begin.by);
    }
    return Move(false, vec2<f32>(0.0));
}

// Adds to C what point i's own second derivatives bring; `g` is the derivative of a residual by the point, times the
// residual.
fn add_turning(term: Term, i: u32, g: vec2<f32>) {
    let code = moves.codes[i];
    if code == 0u {
        return;
    }
    let k = term.knots[(code - 1u) / 2u];
    c_sum[2u * k * UNKNOWNS + 2u * k] -= dot2(g, moves.offsets[i]);
    if code % 2u == 1u {
        c_sum[(2u * k + 1u) * UNKNOWNS + 2u * k] += dot2(g, turned(moves.lengthen[i]));
    }
}

// Where the entry of a term's unknowns i and j stands in a lower triangle.
fn entry(term: Term, i: u32, j: u32) -> u32 {
    let p = 2u * term.knots[i / 2u] + i % 2u;
    let q = 2u * term.knots[j / 2u] + j % 2u;
    return max(p, q) * UNKNOWNS + min(p, q);
}

// How many unknowns a term has, of three knots at most.
fn unknowns_of(term: Term) -> u32 {
    return 2u * min(term.knot_count, 3u);
}

// Derivatives by a term's unknowns, where there are any.
var<private> row: array<f32, 6>;
var<private> row_there: array<bool, 6>;

// Adds a residual with the derivatives `row`.
fn add_first(term: Term, r: f32) {
    let n = unknowns_of(term);
    for (var i = 0u; i < n; i++) {
        if !row_there[i] {
            continue;
        }
        let x = row[i];
        b_sum[2u * term.knots[i / 2u] + i % 2u] += x * r;
        for (var j = 0u; j <= i; j++) {
            if row_there[j] {
                a_sum[entry(term, i, j)] += x * row[j];
            }
        }
    }
}

// Adds the residual r of a segment's length.
fn add_length(index: u32, r: f32) {
    let term = stencil.lengths[index];
    let w = settings.weight_length;
    let segment = segments[index];
    find_moves(term, 2u);
    var by: array<Move, 6>;
    var along: array<f32, 6>;
    let n = unknowns_of(term);
    for (var i = 0u; i < n; i++) {
        by[i] = segment_move(0u, i);
        row_there[i] = by[i].there;
        if by[i].there {
            along[i] = dot2(segment.unit, by[i].by);
            row[i] = w * along[i];
        }
    }
    add_first(term, r);
    if SAFE {
        let rw = r * w;
        let share = rw * segment.inverse;
        for (var i = 0u; i < n; i++) {
            for (var j = 0u; j <= i; j++) {
                if by[i].there && by[j].there {
                    c_sum[entry(term, i, j)] += share * (dot2(by[i].by, by[j].by) - along[i] * along[j]);
                }
            }
        }
        let g = segment.unit * rw;
        add_turning(term, 0u, -g);
        add_turning(term, 1u, g);
    }
}

// How one segment of a cosine moves with an unknown, measured by its length: the movement, what it does to the cosine
// and to the length.
struct Part {
    there: bool,
    by: vec2<f32>,
    turn: f32,
    along: f32,
}

fn part(moved: Move, segment: Segment, slope: vec2<f32>) -> Part {
    let by = moved.by * segment.inverse;
    return Part(moved.there, by, dot2(slope, by), dot2(segment.unit, by));
}

// With u, v the segments' directions: du . dv.
fn mixed(e: Part, f: Part, cosine: f32) -> f32 {
    return dot2(e.by, f.by) - (e.turn + cosine * e.along) * f.along - e.along * f.turn;
}

// What the second derivatives of a segment's direction add.
fn square(a: Part, b: Part, cosine: f32) -> f32 {
    return cosine * (a.along * b.along - dot2(a.by, b.by)) - a.along * b.turn - a.turn * b.along;
}

// Adds the residual r of the cosine of two segments.
fn add_cosine(index: u32, cosine: f32, r: f32) {
    let term = stencil.cosines[index];
    let w = settings.weight_angle;
    let e = segments[term.segment];
    let f = segments[term.segment + 1u];
    // d cos / d e and d cos / d f, in the plane, times the lengths.
    let p = f.unit - e.unit * cosine;
    let q = e.unit - f.unit * cosine;
    find_moves(term, 3u);
    var de: array<Part, 6>;
    var df: array<Part, 6>;
    let n = unknowns_of(term);
    for (var i = 0u; i < n; i++) {
        de[i] = part(segment_move(0u, i), e, p);
        df[i] = part(segment_move(1u, i), f, q);
        row_there[i] = de[i].there || df[i].there;
        if de[i].there && df[i].there {
            row[i] = w * (de[i].turn + df[i].turn);
        } else if de[i].there {
            row[i] = w * de[i].turn;
        } else {
            row[i] = w * df[i].turn;
        }
    }
    add_first(term, r);
    if SAFE {
        let share = r * w;
        for (var i = 0u; i < n; i++) {
            for (var j = 0u; j <= i; j++) {
                var there = false;
                var second = 0.0;
                if de[i].there && df[j].there {
                    second = mixed(de[i], df[j], cosine);
                    there = true;
                }
                if de[j].there && df[i].there {
                    let more = mixed(de[j], df[i], cosine);
                    second = select(more, second + more, there);
                    there = true;
                }
                if de[i].there && de[j].there {
                    let more = square(de[i], de[j], cosine);
                    second = select(more, second + more, there);
                    there = true;
                }
                if df[i].there && df[j].there {
                    let more = square(df[i], df[j], cosine);
                    second = select(more, second + more, there);
                    there = true;
                }
                if there {
                    c_sum[entry(term, i, j)] += share * second;
                }
            }
        }
        let ge = p * (share * e.inverse);
        let gf = q * (share * f.inverse);
        add_turning(term, 0u, -ge);
        add_turning(term, 1u, ge - gf);
        add_turning(term, 2u, gf);
    }
}
