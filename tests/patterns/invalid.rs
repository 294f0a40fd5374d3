//! Nothing makes a pattern panic or go on for ever.

use super::{folder, worked};
use fastrand::Rng;
use std::time::Instant;

/// Counts beyond reason end at once. Seen red with stars that go on without a step.
#[test]
fn nothing_goes_on_for_ever() {
    let sum = format!("co {{1{}}}\nbo", "+1".repeat(200_000));
    let lists: Vec<String> = (0..40).map(|k| format!("{}-{}", k * 500_000 + 1, (k + 1) * 500_000)).collect();
    let rows = format!("co 5\nRows {}: k\nbo", lists.join(", "));
    for text in [
        "co 5\nRow 1: *k0; rep from * 1000000000 more times, k5\nbo",
        &sum,
        &rows,
        "co 5\nRows 2-20000: as row 1\nRow 1: k\nhold as a",
    ] {
        let began = Instant::now();
        let _ = worked(text);
        assert!(began.elapsed().as_secs() < 20, "{}", &text[..40]);
    }
}

/// Samples with bytes, words and numbers changed: a mesh or one line, within seconds.
/// Seen red (as a panic) with an index in `take` that is not checked.
#[test]
fn mutated_patterns_never_panic() {
    let mut texts: Vec<String> = Vec::new();
    for entry in std::fs::read_dir(folder()).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|e| e == "knit") {
            // Coarse, so that each takes little.
            let text = std::fs::read_to_string(&path).unwrap();
            let lines = text.lines().map(|l| if l.starts_with("gauge") { "gauge 5 x 6" } else { l });
            texts.push(lines.collect::<Vec<_>>().join("\n"));
        }
    }
    texts.sort();
    let words = [
        "k",
        "p",
        "yo",
        "turn",
        "co 3",
        "bo",
        "bo 2",
        "pm",
        "sm",
        "hold 2 as a",
        "from a",
        "*",
        ";",
        ",",
        "(",
        ")",
        "{",
        "}",
        "-1",
        "1e9",
        "99999999999",
        "0",
        "0.5",
        "draw",
        "cut",
        "rep",
        "to",
        "last",
        "end",
        "for",
        "graft a with b",
        "piece z round",
        "k{9-99}",
        "\"",
        "\u{e9}",
        "k2tog",
        "sk2p",
        "tuck",
    ];
    let mut rng = Rng::with_seed(7);
    let (mut sound, mut refused) = (0, 0);
    for _ in 0..1500 {
        let mut text = texts[rng.usize(0..texts.len())].clone();
        for _ in 0..rng.usize(1..4) {
            let mut at = rng.usize(0..=text.len());
            while !text.is_char_boundary(at) {
                at -= 1;
            }
            match rng.usize(0..3) {
                0 => text.insert_str(at, words[rng.usize(0..words.len())]),
                1 => {
                    let mut end = (at + rng.usize(0..12)).min(text.len());
                    while !text.is_char_boundary(end) {
                        end -= 1;
                    }
                    text.replace_range(at..end.max(at), "");
                }
                _ => {
                    if let Some(digit) = text[at..].find(|c: char| c.is_ascii_digit()) {
                        text.insert_str(at + digit, words[rng.usize(0..words.len())]);
                    }
                }
            }
        }
        let began = Instant::now();
        match worked(&text) {
            Ok(knitted) => {
                sound += 1;
                assert_eq!(knitted.loose_loops, 0, "{text}");
            }
            Err(e) => {
                refused += 1;
                let message = e.to_string();
                assert!(message.starts_with("test.knit:") && !message.contains('\n'), "{message}");
            }
        }
        assert!(began.elapsed().as_secs() < 30, "{text}");
    }
    assert!(sound > 100 && refused > 300, "{sound} {refused}");
}
