//! Decimal numbers for text formats: a fixed count of significant digits, written fast.

/// Digits that carry any f32 through a text format unharmed, whatever the model's size.
pub const SINGLE: i32 = 9;
/// Digits for formats read in double precision: a micrometre in a thousand kilometres.
pub const DOUBLE: i32 = 13;

const POWERS: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18,
    1e19, 1e20, 1e21, 1e22,
];

/// Appends a finite number rounded to `digits` (up to 15) significant digits, without trailing zeros.
pub fn push_number(text: &mut Vec<u8>, x: f64, digits: i32) {
    let size = x.abs();
    if size == 0.0 {
        text.push(b'0');
        return;
    }
    // Powers of ten up to 1e22 are exact, so that one product is all the rounding there is.
    if !(1e-6..1e9).contains(&size) {
        use std::io::Write;
        // Writing to a vector cannot fail.
        let _ = write!(text, "{x:.*e}", (digits - 1) as usize);
        return;
    }
    let mut exponent = if size >= 1.0 {
        POWERS.iter().position(|&p| size < p).map_or(22, |p| p as i32 - 1)
    } else {
        -(POWERS.iter().position(|&p| size * p >= 1.0).map_or(22, |p| p as i32))
    };
    let scaled = |exponent: i32| {
        let shift = digits - 1 - exponent;
        if shift >= 0 { size * POWERS[shift as usize] } else { size / POWERS[-shift as usize] }
    };
    let mut mantissa = scaled(exponent).round() as u64;
    if mantissa as f64 >= POWERS[digits as usize] {
        exponent += 1;
        mantissa = scaled(exponent).round() as u64;
    }
    // Decimals after the point; the mantissa is value * 10^decimals.
    let mut decimals = digits - 1 - exponent;
    while decimals > 0 && mantissa.is_multiple_of(10) {
        mantissa /= 10;
        decimals -= 1;
    }
    while decimals < 0 {
        mantissa *= 10;
        decimals += 1;
    }
    if x < 0.0 {
        text.push(b'-');
    }
    let mut buffer = [b'0'; 40];
    let mut at = buffer.len();
    let mut left = decimals;
    loop {
        at -= 1;
        buffer[at] = b'0' + (mantissa % 10) as u8;
        mantissa /= 10;
        left -= 1;
        if left == 0 {
            at -= 1;
            buffer[at] = b'.';
        }
        if mantissa == 0 && left < 0 {
            break;
        }
    }
    text.extend_from_slice(&buffer[at..]);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text(x: f64, digits: i32) -> String {
        let mut text = Vec::new();
        push_number(&mut text, x, digits);
        String::from_utf8(text).unwrap()
    }

    #[test]
    fn plain_cases() {
        for (x, expected) in [
            (0.0, "0"),
            (-0.0, "0"),
            (1.0, "1"),
            (-1.5, "-1.5"),
            (0.1, "0.1"),
            (100.0, "100"),
            (123456789.0, "123456789"),
            (999999999.9, "1000000000"),
            (0.9999999999, "1"),
            (0.000123, "0.000123"),
            (9.9999999999e-4, "0.001"),
            (-1e30, "-1.00000000e30"),
            (5e-324, "4.94065646e-324"),
            (1.0 / 3.0, "0.333333333"),
        ] {
            assert_eq!(text(x, SINGLE), expected);
        }
    }

    #[test]
    fn carries_f32_and_nearly_f64() {
        let mut state = 1u64;
        for _ in 0..200_000 {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            let x = f32::from_bits((state >> 32) as u32);
            if x.is_finite() {
                let back: f64 = text(x as f64, SINGLE).parse().unwrap();
                assert_eq!(back as f32, x);
                let y = x as f64 * (1.0 + 1e-9 * (state % 1000) as f64);
                let back: f64 = text(y, DOUBLE).parse().unwrap();
                assert!((back - y).abs() <= y.abs() * 6e-13, "{y} {back}");
            }
        }
    }
}
