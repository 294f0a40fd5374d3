//! Patterns with mistakes in them: whatever is wrong, there is an answer, and soon.

use super::counts::PATTERNS;
use super::{from_text, settings, stitches};
use fastrand::Rng;
use knotmesh::design::Settings;
use std::time::{Duration, Instant};

/// To stand where others stood.
const NUMBERS: &[&str] = &[
    "0",
    "1 ",
    "7 ",
    "40 ",
    "99999 ",
    "10000000 ",
    "1000000000 ",
    "18446744073709551616 ",
    "1e400 ",
    "0.5 ",
    "-1 ",
    "{1/0}",
    "{0/0}",
];

/// Far more than any takes, on a machine that is busy with other things too.
const SLOWEST: Duration = Duration::from_secs(60);

fn texts() -> Vec<String> {
    PATTERNS
        .iter()
        .map(|(name, ..)| std::fs::read_to_string(stitches().join(format!("{name}.knit"))).unwrap())
        .collect()
}

/// Works it; says whether it was refused.
fn work(text: &str) -> bool {
    let settings = Settings { most_faces: Some(50_000), ..settings(Some((5.0, 7.0)), None) };
    let begun = Instant::now();
    let result = from_text(text, &settings);
    assert!(begun.elapsed() < SLOWEST, "{:?}:\n{text}", begun.elapsed());
    if let Err(error) = &result {
        let message = error.to_string();
        assert!(!message.contains('\n'), "{message}");
        let place = message.strip_prefix("a.knit:").unwrap_or_else(|| panic!("{message}"));
        let mut numbers = place.splitn(3, ':');
        let line: usize = numbers.next().and_then(|n| n.parse().ok()).unwrap_or_else(|| panic!("{message}"));
        assert!((1..=text.lines().count().max(1)).contains(&line), "{message}");
        assert!(numbers.next().is_some_and(|n| n.parse::<usize>().is_ok_and(|n| n > 0)), "{message}");
        assert!(message.contains(": found ") && message.contains(", expected "), "{message}");
    }
    result.is_err()
}

#[test]
fn changed_bytes() {
    let mut rng = Rng::with_seed(1);
    let texts = texts();
    let mut refused = 0;
    for _ in 0..3000 {
        let mut text: Vec<char> = texts[rng.usize(0..texts.len())].chars().collect();
        for _ in 0..rng.usize(1..4) {
            let at = rng.usize(0..text.len());
            match rng.usize(0..3) {
                0 => text[at] = char::from(rng.u8(32..127)),
                1 => {
                    text.remove(at);
                }
                _ => text
                    .insert(at, ['\n', '(', '*', '{', '9', '-', '"', '\u{e9}', '#', '/'][rng.usize(0..10)]),
            }
        }
        refused += usize::from(work(&text.iter().collect::<String>()));
    }
    assert!((300..3000).contains(&refused), "{refused} of 3000 were refused");
}

#[test]
fn changed_words() {
    let mut rng = Rng::with_seed(2);
    let texts = texts();
    // All words there are, for any to stand in any place.
    let mut words: Vec<&str> =
        texts.iter().flat_map(|t| t.split_inclusive([' ', '\n', ',', '{', '}', '(', ')'])).collect();
    words.extend(NUMBERS);
    for _ in 0..3000 {
        let text = &texts[rng.usize(0..texts.len())];
        let mut text: Vec<&str> = text.split_inclusive([' ', '\n', ',', '{', '}', '(', ')']).collect();
        for _ in 0..rng.usize(1..4) {
            let (at, other) = (rng.usize(0..text.len()), rng.usize(0..text.len()));
            match rng.usize(0..6) {
                0 => text.swap(at, other),
                1 => {
                    text.remove(at);
                }
                2 => text.insert(at, text[other]),
                3 => text[at] = words[rng.usize(0..words.len())],
                // Another number.
                _ => {
                    let at = (at..text.len()).find(|k| text[*k].starts_with(|c: char| c.is_ascii_digit()));
                    text[at.unwrap_or(0)] = NUMBERS[rng.usize(0..NUMBERS.len())];
                }
            }
        }
        work(&text.concat());
    }
}

/// Numbers beyond all measure are refused before anything is made of them. Seen red (it did not end) with the passes of a `for`
/// not counted.
#[test]
fn huge_numbers() {
    for text in [
        "co 1000000000\nbo\n",
        "co 19000000000000000000\nbo\n",
        "co 10\nRow: yo 1000000000, k\nbo\n",
        "co 10\nRow: co 1000000000, k\nbo\n",
        "co 10\nRow: k1, (yo) x 1000000000, k\nbo\n",
        "co 10\nRow: k1, ((yo) x 1000000) x 1000000, k\nbo\n",
        "co 10\nRow: k1, (pm, rm) x 1000000000, k\nbo\n",
        "co 10\nRow: k 1000000000\nbo\n",
        "co 10\nRows 1-1000000000: k\nbo\n",
        "co 10\nRow 1: k\nrep rows 1-1 1000000000 more times\nbo\n",
        "co 10\nRow 1: k\nrep rows 1-1 until 1000000000 rows\nbo\n",
        "for i = 1 to 1000000000000\nend\nco 5\nbo\n",
        "for i = 1 to 100000\nfor j = 1 to 100000\nlet a = 1\nend\nend\nco 5\nbo\n",
        "co {10 * 1000000000000}\nbo\n",
        "co {stitches(100000000 m)}\nbo\n",
        "co 10\nRow: inc 1000000000 evenly\nbo\n",
        "co 10\nRow: dec 1000000000 evenly\nbo\n",
        "co 10\nhold 1000000000 as a\nbo\n",
        "gauge 1000000000\nco 10\nbo\n",
    ] {
        assert!(work(text), "{text}");
    }
    let deep = |open: &str, close: &str| {
        format!("co 9\nRow: {}k1{}\nbo\n", open.repeat(100_000), close.repeat(100_000))
    };
    for text in [deep("(", ")"), deep("*", "; rep from *"), format!("let a = {}1\n", "(".repeat(100_000))] {
        assert!(from_text(&text, &Settings::default()).is_err());
    }
    assert!(
        from_text(&format!("let a = {}1\nco 3\nbo\n", "-".repeat(100_000)), &Settings::default()).is_ok()
    );
}
