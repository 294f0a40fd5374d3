//! What is said of patterns that cannot be followed: where, what, and what would be right.

use super::from_text;
use knotmesh::design::Settings;

const CASES: &[(&str, &str)] = &[("", "1:1: x")];

/// Seen red with each row's place instead of the instruction's.
#[test]
fn messages() {
    for (text, expected) in CASES {
        let error = from_text(text, &Settings::default()).err();
        let found = error.map_or("nothing is wrong".to_string(), |e| e.to_string());
        assert_eq!(found, format!("a.knit:{expected}"), "\n{text}");
    }
}
