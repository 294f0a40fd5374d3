//! What the symbols of a chart mean.
//!
//! The standard ones follow the Craft Yarn Council's knit chart symbols as far as a keyboard has them: `|` knit, `-` purl,
//! `o` yarn over, `/` k2tog, `\` ssk, `V` slip. A square that is left blank there (knit) is `.` here.

use crate::design::stitch::Stitch;
use std::collections::BTreeMap;

/// Stitch and colour of a symbol; `None` stands for no stitch.
pub type Meaning = Option<(Stitch, Option<[u8; 3]>)>;

/// Symbols that need no key.
const STANDARD: &[(&str, Option<Stitch>)] = &[
    (".", Some(Stitch::Knit)),
    ("|", Some(Stitch::Knit)),
    ("-", Some(Stitch::Purl)),
    ("o", Some(Stitch::YarnOver)),
    ("O", Some(Stitch::YarnOver)),
    ("/", Some(Stitch::KnitTogether)),
    ("\\", Some(Stitch::SlipSlipKnit)),
    ("^", Some(Stitch::SlipKnitTwoPass)),
    ("A", Some(Stitch::SlipKnitTwoPass)),
    ("Q", Some(Stitch::KnitTwisted)),
    ("M", Some(Stitch::MakeLeft)),
    ("V", Some(Stitch::Slip)),
    ("x", None),
    ("X", None),
];

/// The key of a chart.
#[derive(Clone, Debug, Default)]
pub struct Key {
    own: BTreeMap<String, Meaning>,
    colours: BTreeMap<String, [u8; 3]>,
}

/// Words of a row, each with its byte.
pub fn words(text: &str) -> Vec<(usize, &str)> {
    let base = text.as_ptr() as usize;
    text.split_whitespace().map(|w| (w.as_ptr() as usize - base, w)).collect()
}

/// `#rrggbb`
pub fn colour(text: &str) -> Option<[u8; 3]> {
    let digits = text.strip_prefix('#').filter(|d| d.len() == 6)?;
    if !digits.bytes().all(|b| b.is_ascii_hexdigit()) {
        return None;
    }
    let [_, r, g, b] = u32::from_str_radix(digits, 16).ok()?.to_be_bytes();
    Some([r, g, b])
}

impl Key {
    /// What a symbol or the name of a stitch means.
    pub fn meaning(&self, word: &str) -> Option<Meaning> {
        if let Some(own) = self.own.get(word) {
            return Some(*own);
        }
        let standard = STANDARD.iter().find(|(symbol, _)| *symbol == word);
        if let Some((_, stitch)) = standard {
            return Some(stitch.map(|s| (s, None)));
        }
        Stitch::named(&word.to_lowercase()).map(|s| Some((s, None)))
    }

    /// Whether a word as a whole means something.
    pub fn knows(&self, word: &str) -> bool {
        self.meaning(word).is_some()
    }

    /// All symbols, for messages.
    pub fn symbols(&self) -> String {
        let own = self.own.keys().map(String::as_str);
        let standard = STANDARD.iter().map(|(s, _)| *s).filter(|s| !self.own.contains_key(*s));
        own.chain(standard).collect::<Vec<_>>().join(" ")
    }

    /// Names a colour.
    ///
    /// # Errors
    /// What was found and what was expected.
    pub fn name_colour(&mut self, name: &str, rgb: &str) -> Result<(), (String, String)> {
        let rgb = colour(rgb).ok_or_else(|| (format!("'{rgb}'"), "a colour such as #c0392b".to_string()))?;
        if self.colours.insert(name.into(), rgb).is_some() {
            return Err((format!("the colour '{name}' a second time"), "each colour once".into()));
        }
        Ok(())
    }

    /// Gives a symbol its meaning: a stitch, a colour, or both; or `none`.
    ///
    /// # Errors
    /// Which word, by its byte in `text`; what was found and what was expected.
    pub fn define(&mut self, symbol: &str, text: &str) -> Result<(), (usize, String, String)> {
        if symbol.is_empty() || symbol.contains(char::is_whitespace) || symbol.contains('=') {
            return Err((0, format!("'{symbol}'"), "a symbol: a sign or a short word, not '='".into()));
        }
        let (mut stitch, mut rgb, mut none) = (None, None, false);
        let words = words(text);
        for &(at, word) in &words {
            let named = Stitch::named(&word.to_lowercase());
            let found = colour(word).or_else(|| self.colours.get(word).copied());
            match (named, found) {
                // A colour may be called as a stitch is: the first word is the stitch.
                (_, Some(found)) if rgb.is_none() && (named.is_none() || stitch.is_some()) => {
                    rgb = Some(found);
                }
                (Some(named), _) if stitch.is_none() && rgb.is_none() => stitch = Some(named),
                _ if word == "none" && words.len() == 1 => none = true,
                _ => {
                    let expected = format!("a stitch ({}), a colour, or none", Stitch::NAMES);
                    return Err((at, format!("'{word}'"), expected));
                }
            }
        }
        if words.is_empty() {
            return Err((0, "nothing".into(), "a stitch, a colour, or none".into()));
        }
        let meaning = (!none).then_some((stitch.unwrap_or(Stitch::Knit), rgb));
        if self.own.insert(symbol.into(), meaning).is_some() {
            return Err((0, format!("'{symbol}' a second time"), "each symbol once".into()));
        }
        Ok(())
    }
}
