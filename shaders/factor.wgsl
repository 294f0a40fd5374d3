// L D L^T factorisation of small symmetric matrices. Twin of src/knot/factor.rs.

var<private> factors: array<f32, ROOM_MATRIX>;
var<private> step: array<f32, ROOM_UNKNOWNS>;
var<private> frozen: array<bool, ROOM_UNKNOWNS>;

// Factorises A + mu diag A, and + C where `newton` is set; says whether all unknowns but the frozen had a usable pivot.
fn factorise(newton: bool, mu: f32) -> bool {
    let n = UNKNOWNS;
    let damp = 1.0 + mu;
    var largest = 0.0;
    for (var i = 0u; i < n; i++) {
        largest = larger(largest, a_sum[i * n + i] * damp);
    }
    let smallest = largest * 1e-12;
    var positive = true;
    for (var j = 0u; j < n; j++) {
        var pivot = a_sum[j * n + j] * damp + select(0.0, c_sum[j * n + j], newton);
        for (var k = 0u; k < j; k++) {
            let l = factors[j * n + k];
            pivot -= l * l * factors[k * n + k];
        }
        positive = positive && (smallest < pivot || frozen[j]);
        let usable = smallest < pivot && !frozen[j];
        let inverse = select(0.0, 1.0 / select(1.0, pivot, usable), usable);
        factors[j * n + j] = inverse;
        for (var i = j + 1u; i < n; i++) {
            var value = a_sum[i * n + j] + select(0.0, c_sum[i * n + j], newton);
            for (var k = 0u; k < j; k++) {
                value -= factors[i * n + k] * factors[j * n + k] * factors[k * n + k];
            }
            factors[i * n + j] = value;
        }
    }
    return positive;
}

// Solves for the step x in (the matrix factorised) x = -b.
fn solve_factors() {
    let n = UNKNOWNS;
    for (var i = 0u; i < n; i++) {
        var y = -b_sum[i];
        for (var k = 0u; k < i; k++) {
            y -= factors[i * n + k] * factors[k * n + k] * step[k];
        }
        step[i] = y;
    }
    for (var m = 0u; m < n; m++) {
        let i = n - 1u - m;
        let inverse = factors[i * n + i];
        var y = step[i] * inverse;
        for (var k = i + 1u; k < n; k++) {
            y -= factors[k * n + i] * inverse * step[k];
        }
        step[i] = y;
    }
}
