//! Which frames are wanted: `A:B` half-open, either side may be left out, `A` alone is one frame, and
//! negative numbers count from the end.

use crate::{Error, Result};
use std::ops::Range;

/// The frames (counted from 0) that `text` names, of `frame_count` there are; never none.
pub fn frame_range(text: &str, frame_count: usize) -> Result<Range<usize>> {
    let error = |what: &str| {
        let quoted: String = text.chars().take(60).flat_map(char::escape_debug).collect();
        let many = if frame_count == 1 {
            "there is 1 frame".into()
        } else {
            format!("there are {frame_count} frames")
        };
        Error::invalid(format_args!("frames '{quoted}': {what}; {many}, counted from 0"))
    };
    let place = |part: &str, last: usize| -> Result<usize> {
        let n: i64 =
            part.trim().parse().map_err(|_| error("expected A:B, A:, :B, : or A with whole numbers"))?;
        let n = if n < 0 { n.checked_add(frame_count as i64) } else { Some(n) };
        n.and_then(|n| usize::try_from(n).ok())
            .filter(|&n| n <= last)
            .ok_or_else(|| error(&format!("{} is out of range", part.trim())))
    };
    let range = match text.split_once(':') {
        None => {
            let Some(last) = frame_count.checked_sub(1) else { return Err(error("out of range")) };
            let at = place(text, last)?;
            return Ok(at..at + 1);
        }
        Some((from, to)) => {
            let from = if from.trim().is_empty() { 0 } else { place(from, frame_count)? };
            let to = if to.trim().is_empty() { frame_count } else { place(to, frame_count)? };
            from..to
        }
    };
    if range.is_empty() { Err(error("no frame lies in this range")) } else { Ok(range) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_are_half_open_and_count_from_either_end() {
        for (text, expected) in [
            (":", 0..10),
            ("2:5", 2..5),
            ("3:", 3..10),
            (":4", 0..4),
            ("-3:", 7..10),
            (":-3", 0..7),
            ("-4:-2", 6..8),
            ("0", 0..1),
            ("-1", 9..10),
            (" 2 : 10 ", 2..10),
        ] {
            assert_eq!(frame_range(text, 10).unwrap(), expected, "{text}");
        }
    }

    #[test]
    fn what_is_out_of_range_is_named() {
        for (text, what) in [
            ("10", "10 is out of range"),
            ("-11", "-11 is out of range"),
            ("0:11", "11 is out of range"),
            ("-11:", "-11 is out of range"),
            ("9223372036854775807", "9223372036854775807 is out of range"),
            ("5:5", "no frame lies in this range"),
            ("6:2", "no frame lies in this range"),
            ("10:", "no frame lies in this range"),
            ("", "expected A:B, A:, :B, : or A with whole numbers"),
            ("1:2:3", "expected A:B, A:, :B, : or A with whole numbers"),
            ("1.5", "expected A:B, A:, :B, : or A with whole numbers"),
        ] {
            let message = frame_range(text, 10).unwrap_err().to_string();
            assert_eq!(message, format!("frames '{text}': {what}; there are 10 frames, counted from 0"));
        }
        assert!(
            frame_range("a\nb", 1).unwrap_err().to_string().ends_with("there is 1 frame, counted from 0")
        );
        assert!(!frame_range("a\nb", 1).unwrap_err().to_string().contains('\n'));
        assert!(frame_range(":", 0).is_err() && frame_range("0", 0).is_err());
    }
}
