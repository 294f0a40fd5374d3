// Stage 4: the per-stitch solve. Twin of src/knot/solve.rs.

struct Outcome {
    start: f32,
    end: f32,
    at_rest: bool,
    converged: bool,
    steps: u32,
    finite: bool,
}

fn place_state() {
    at_knots = state;
    place();
}

// Up to `settings.iterations` steps from `state`; `damping` is that of the first one.
fn run_solve(damping: f32, iterations: u32) -> Outcome {
    let shortest = stencil.yarn_radius * 0.5;
    if SAFE {
        for (var k = 0u; k < KNOTS; k++) {
            state[k].half_length = larger(state[k].half_length, shortest);
        }
    }
    for (var i = 0u; i < UNKNOWNS; i++) {
        frozen[i] = false;
    }
    var outcome = Outcome(0.0, 0.0, false, false, 0u, false);
    var done = false;
    var mu = select(0.0, damping, SAFE);
    for (var i = 0u; i < iterations; i++) {
        place_state();
        let energy = assemble();
        if i == 0u {
            outcome.start = energy;
            outcome.end = energy;
            trace_first(energy);
            if SAFE {
                outcome.at_rest = energy <= REST_ENERGY;
                done = outcome.at_rest;
            }
        }
        if done {
            break;
        }
        if SAFE {
            for (var k = 0u; k < KNOTS; k++) {
                // A half-length at its bound stays there while E falls towards shorter ones.
                frozen[2u * k + 1u] = state[k].half_length <= shortest && 0.0 < b_sum[2u * k + 1u];
            }
        }
        // Newton's matrix where it is positive definite, else that of Gauss-Newton.
        if !factorise(SAFE, mu) && SAFE {
            factorise(false, mu);
        }
        solve_factors();
        if i == 0u {
            trace_step();
        }
        for (var k = 0u; k < KNOTS; k++) {
            at_knots[k] = stepped(state[k], step[2u * k], step[2u * k + 1u]);
        }
        if !SAFE {
            state = at_knots;
            outcome.steps += 1u;
            continue;
        }
        for (var k = 0u; k < KNOTS; k++) {
            at_knots[k].half_length = larger(at_knots[k].half_length, shortest);
        }
        place();
        let tried = energy_now();
        let better = tried < outcome.end;
        let little = CONVERGED * outcome.end + CONVERGED_BELOW;
        let small = better && outcome.end - tried < little;
        // Not lower, but by no more than rounding: nothing is left to gain.
        let noise = sqrt(outcome.end * REST_ENERGY) * NOISE;
        let level = !better && tried - outcome.end <= noise;
        outcome.converged = small || level;
        mu = select(larger(mu, LEAST_DAMPING) * DAMPING_AFTER_FAILURE, mu * DAMPING_AFTER_SUCCESS, better);
        done = outcome.converged;
        if better {
            outcome.steps += 1u;
            outcome.end = tried;
            state = at_knots;
        }
    }
    place_state();
    if !ENERGIES && (!SAFE || iterations == 0u) {
        // The state's squares overflow where the energy's would, or nearly.
        var size = 0.0;
        for (var k = 0u; k < KNOTS; k++) {
            let l = state[k].half_length;
            let d = state[k].direction;
            size += settings.weight_length * settings.weight_length * (l * l) + dot2(d, d);
        }
        outcome.finite = finite(size);
        outcome.end = bitcast<f32>(settings.nan);
        if iterations == 0u {
            outcome.start = outcome.end;
        }
        return outcome;
    }
    if !SAFE || iterations == 0u {
        outcome.end = energy_now();
        if iterations == 0u {
            outcome.start = outcome.end;
        }
    }
    outcome.finite = finite(outcome.end);
    return outcome;
}
