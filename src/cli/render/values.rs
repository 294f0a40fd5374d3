//! Values of options: colours, places, ranges.

use glam::DVec3;
use knotmesh::render::Background;
use std::str::FromStr;

/// `#rrggbb`
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Colour(pub [u8; 3]);

impl FromStr for Colour {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let digits = text.strip_prefix('#').unwrap_or(text);
        let channel = |i: usize| digits.get(2 * i..2 * i + 2).and_then(|d| u8::from_str_radix(d, 16).ok());
        let hex = digits.len() == 6 && digits.bytes().all(|b| b.is_ascii_hexdigit());
        match (hex, channel(0), channel(1), channel(2)) {
            (true, Some(r), Some(g), Some(b)) => Ok(Self([r, g, b])),
            _ => Err(format!("found '{text}', expected a colour as #rrggbb")),
        }
    }
}

/// What is behind the yarn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Behind(pub Background);

impl FromStr for Behind {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let colour = |t: &str| {
            let wrong = |_| {
                format!("found '{t}', expected paper, white, transparent, or one or two colours as #rrggbb")
            };
            t.trim().parse::<Colour>().map(|c| c.0).map_err(wrong)
        };
        Ok(Self(match text {
            "paper" => Background::PAPER,
            "white" => Background::Gradient([255; 3], [255; 3]),
            "transparent" => Background::Transparent,
            _ => match text.split_once(',') {
                Some((top, bottom)) => Background::Gradient(colour(top)?, colour(bottom)?),
                None => colour(text).map(|c| Background::Gradient(c, c))?,
            },
        }))
    }
}

fn numbers<const N: usize>(text: &str) -> Option<[f64; N]> {
    let parts: Option<Vec<f64>> =
        text.split(',').map(|t| t.trim().parse().ok().filter(|x: &f64| x.is_finite())).collect();
    parts?.try_into().ok()
}

/// `LOW,HIGH`
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval(pub [f64; 2]);

impl FromStr for Interval {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || format!("found '{text}', expected two numbers, the lower first: 0.9,1.1");
        numbers(text).filter(|[low, high]| low < high).map(Self).ok_or_else(wrong)
    }
}

/// `X,Y,Z`
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place(pub DVec3);

impl FromStr for Place {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || format!("found '{text}', expected three numbers: 0,1.5,-2");
        numbers(text).map(|p| Self(DVec3::from_array(p))).ok_or_else(wrong)
    }
}
