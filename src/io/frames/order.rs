//! Files that match a pattern, in natural order.

use crate::{Error, Result};
use std::cmp::Ordering;
use std::path::PathBuf;

/// The files that match `pattern`, at least one.
pub(super) fn matching(pattern: &str) -> Result<Vec<PathBuf>> {
    let found = glob::glob(pattern).map_err(|e| {
        Error::invalid(format_args!("the pattern '{pattern}' is wrong at character {}: {}", e.pos + 1, e.msg))
    })?;
    let mut paths = Vec::new();
    for path in found {
        let path = path.map_err(|e| {
            let path = e.path().to_path_buf();
            Error::io(&path, e.into())
        })?;
        if path.is_file() {
            paths.push(path);
        }
    }
    if paths.is_empty() {
        return Err(Error::invalid(format_args!("no file matches '{pattern}'")));
    }
    paths.sort_by(|a, b| {
        let [a, b] = [a, b].map(|path| path.as_os_str().as_encoded_bytes());
        natural(a, b).then_with(|| a.cmp(b))
    });
    Ok(paths)
}

/// Compares runs of digits as numbers and everything else byte by byte.
fn natural<'a>(mut a: &'a [u8], mut b: &'a [u8]) -> Ordering {
    loop {
        let [(a_number, a_rest), (b_number, b_rest)] = [a, b].map(leading_number);
        let order = if !a_number.is_empty() && !b_number.is_empty() {
            let [x, y] = [a_number, b_number].map(without_zeros);
            (a, b) = (a_rest, b_rest);
            x.len().cmp(&y.len()).then(x.cmp(y))
        } else {
            match (a.split_first(), b.split_first()) {
                (Some((x, a_rest)), Some((y, b_rest))) => {
                    (a, b) = (a_rest, b_rest);
                    x.cmp(y)
                }
                _ => return a.len().cmp(&b.len()),
            }
        };
        if order.is_ne() {
            return order;
        }
    }
}

fn leading_number(text: &[u8]) -> (&[u8], &[u8]) {
    text.split_at(text.iter().take_while(|b| b.is_ascii_digit()).count())
}

fn without_zeros(digits: &[u8]) -> &[u8] {
    &digits[digits.iter().take_while(|&&b| b == b'0').count()..]
}

#[cfg(test)]
mod tests {
    use super::natural;

    #[test]
    fn numbers_in_names_count_as_numbers() {
        let mut names = ["f10.obj", "f2.obj", "f02b.obj", "e3.obj", "f.obj", "f1/b2", "f1/b10", "f001/c"];
        names.sort_by(|a, b| natural(a.as_bytes(), b.as_bytes()));
        assert_eq!(names, ["e3.obj", "f.obj", "f1/b2", "f1/b10", "f001/c", "f2.obj", "f02b.obj", "f10.obj"]);
    }
}
