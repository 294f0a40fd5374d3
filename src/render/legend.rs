//! Legends: what colours of a picture mean, in a strip at its right.

use super::colour::ramp;
use super::picture::Picture;
use crate::Result;
use crate::measure::picture::{FINER, FONT, font, pixels, undrawn};
use plotters::prelude::*;

/// What colours mean.
#[derive(Clone, Debug, PartialEq)]
pub struct Legend {
    /// In one or two words.
    pub title: String,
    /// What numbers are, below the title.
    pub unit: String,
    /// The colours.
    pub scale: Scale,
}

/// Colours and what they stand for.
#[derive(Clone, Debug, PartialEq)]
pub enum Scale {
    /// Numbers from low to high.
    Bar {
        /// Colours from low to high, evenly apart.
        stops: &'static [[u8; 3]],
        /// The lowest number.
        low: f64,
        /// The highest number.
        high: f64,
        /// Whether factors are evenly apart.
        logarithmic: bool,
    },
    /// Names and their colours.
    Swatches(Vec<(String, [u8; 3])>),
}

/// A text, the size of its letters, and its left upper corner.
type Text<'a> = (&'a str, i32, (i32, i32));

/// Where things go, pixels from the strip's left top.
struct Layout {
    /// Size of letters.
    size: i32,
    title: i32,
    margin: i32,
    /// A line of text.
    line: i32,
    /// Lines of the unit, each as wide as fits.
    unit: Vec<String>,
    /// Where the scale begins, downwards.
    top: i32,
}

impl Legend {
    /// How many pixels the strip takes of a picture's width.
    ///
    /// # Errors
    /// A font that cannot be read; there is none such.
    pub fn width(&self, picture: [u32; 2]) -> Result<u32> {
        let layout = self.layout(picture[1])?;
        let mut widest = width(&self.title, layout.title)?;
        for line in &layout.unit {
            widest = widest.max(width(line, layout.size)?);
        }
        match &self.scale {
            Scale::Bar { low, high, logarithmic, .. } => {
                for (_, label) in ticks(*low, *high, *logarithmic) {
                    widest = widest.max(bar_width(layout.size) + layout.size + width(&label, layout.size)?);
                }
            }
            Scale::Swatches(rows) => {
                for (name, _) in rows {
                    widest = widest.max(layout.size * 3 / 2 + width(name, layout.size)?);
                }
            }
        }
        let wanted = (widest + 2 * layout.margin).max(1) as u32;
        Ok(wanted.min(picture[0] / 2))
    }

    fn layout(&self, height: u32) -> Result<Layout> {
        let size = (height as f64 / 46.0).round().clamp(9.0, 64.0) as i32;
        let title = size * 5 / 4;
        let line = size * 3 / 2;
        let margin = size;
        let unit = wrapped(&self.unit, size, 9 * size)?;
        let top = margin + title * 3 / 2 + line * unit.len() as i32 + size / 2;
        Ok(Layout { size, title, margin, line, unit, top })
    }

    /// Draws the legend at the right of a picture, over what is there.
    ///
    /// # Errors
    /// A font that cannot be read; there is none such.
    pub fn draw(&self, picture: &mut Picture) -> Result<()> {
        let strip = self.width([picture.width, picture.height])?;
        if strip == 0 || picture.height == 0 {
            return Ok(());
        }
        let layout = self.layout(picture.height)?;
        let (m, s) = (layout.margin, layout.size);
        let ink = ink(picture, strip);
        let mut place = Strip { left: (picture.width - strip) as i32, picture };
        let mut texts: Vec<Text> = vec![(&self.title, layout.title, (m, m))];
        for (i, line) in layout.unit.iter().enumerate() {
            texts.push((line, s, (m, m + layout.title * 3 / 2 + layout.line * i as i32)));
        }
        let labels;
        let height = place.picture.height as i32;
        match &self.scale {
            Scale::Bar { stops, low, high, logarithmic } => {
                let (top, bar) = (layout.top + s / 2, bar_width(s));
                let length = (height - m - s / 2 - top).min(22 * s).max(2);
                for y in 0..length {
                    let t = 1.0 - (f64::from(y) + 0.5) / f64::from(length);
                    place.fill([m, top + y], [bar, 1], ramp(stops, t));
                }
                labels = ticks(*low, *high, *logarithmic);
                let part = |x: f64| {
                    if *logarithmic { (x / low).ln() / (high / low).ln() } else { (x - low) / (high - low) }
                };
                let thick = (s / 12).max(1);
                let mut last = i32::MAX;
                for (value, label) in &labels {
                    let y = top + ((1.0 - part(*value)) * f64::from(length - 1)).round() as i32;
                    place.fill([m + bar, y - thick / 2], [s / 3, thick], ink);
                    // Where there is little room, not every tick is named.
                    if last - y >= layout.line * 4 / 5 {
                        texts.push((label, s, (m + bar + s * 2 / 3, y - s * 5 / 16)));
                        last = y;
                    }
                }
            }
            Scale::Swatches(rows) => {
                let room = ((height - m - layout.top) / layout.line).max(1) as usize;
                // What there is no room for is said to be there.
                let shown = if rows.len() > room { room - 1 } else { rows.len() };
                for (i, (name, colour)) in rows.iter().take(shown).enumerate() {
                    let y = layout.top + layout.line * i as i32;
                    place.fill([m, y - s / 6], [s, s], *colour);
                    texts.push((name, s, (m + s * 3 / 2, y)));
                }
                labels = vec![(0.0, format!("and {} more", rows.len() - shown))];
                if shown < rows.len() {
                    texts.push((&labels[0].1, s, (m + s * 3 / 2, layout.top + layout.line * shown as i32)));
                }
            }
        }
        place.write(&texts, [strip, height as u32], ink)
    }
}

/// A picture's strip.
struct Strip<'a> {
    picture: &'a mut Picture,
    left: i32,
}

impl Strip<'_> {
    fn fill(&mut self, [x, y]: [i32; 2], [width, height]: [i32; 2], colour: [u8; 3]) {
        for y in y..y + height {
            for x in x..x + width {
                self.blend([x, y], colour, 255);
            }
        }
    }

    /// Lays a colour over a pixel.
    fn blend(&mut self, [x, y]: [i32; 2], colour: [u8; 3], cover: u8) {
        let x = x + self.left;
        let (Ok(x), Ok(y)) = (u32::try_from(x), u32::try_from(y)) else { return };
        if cover == 0 || x >= self.picture.width || y >= self.picture.height {
            return;
        }
        let pixel = &mut self.picture.pixels[y as usize * self.picture.width as usize + x as usize];
        let (over, under) = (f32::from(cover) / 255.0, f32::from(pixel[3]) / 255.0);
        let opacity = over + under * (1.0 - over);
        for c in 0..3 {
            let sum = f32::from(colour[c]) * over + f32::from(pixel[c]) * under * (1.0 - over);
            pixel[c] = (sum / opacity).round() as u8;
        }
        pixel[3] = (opacity * 255.0).round() as u8;
    }

    /// Writes texts in a colour.
    fn write(&mut self, texts: &[Text], size: [u32; 2], ink: [u8; 3]) -> Result<()> {
        font()?;
        let fine = FINER as i32;
        let cover = pixels((size[0], size[1]), |root| {
            for (text, size, at) in texts {
                let style = TextStyle::from((FONT, size * fine).into_font()).color(&WHITE);
                root.draw_text(text, &style, (at.0 * fine, at.1 * fine)).map_err(undrawn)?;
            }
            root.present().map_err(undrawn)
        })?;
        for (i, c) in cover.chunks_exact(3).enumerate() {
            let i = i as u32;
            self.blend([(i % size[0]) as i32, (i / size[0]) as i32], ink, c[0]);
        }
        Ok(())
    }
}

/// Dark on light, light on dark.
fn ink(picture: &Picture, strip: u32) -> [u8; 3] {
    let (mut light, mut count) = (0.0, 0.0);
    for y in 0..picture.height {
        let [r, g, b, a] = picture.at(picture.width - strip.div_ceil(2), y).map(f64::from);
        light += (0.3 * r + 0.6 * g + 0.1 * b) * a / 255.0 + (255.0 - a);
        count += 1.0;
    }
    if light / count > 120.0 { [38, 38, 42] } else { [236, 236, 232] }
}

fn bar_width(size: i32) -> i32 {
    size * 4 / 3
}

/// Width of a text in pixels.
fn width(text: &str, size: i32) -> Result<i32> {
    font()?;
    let large = (FONT, size * FINER as i32).into_font();
    let ((left, _), (right, _)) = large.layout_box(text).map_err(undrawn)?;
    Ok((right - left) / FINER as i32 + 1)
}

/// Breaks a text at blanks into lines that are no wider, where words let it.
fn wrapped(text: &str, size: i32, most: i32) -> Result<Vec<String>> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split(' ').filter(|w| !w.is_empty()) {
        match lines.last_mut() {
            Some(line) if width(&format!("{line} {word}"), size)? <= most => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.into()),
        }
    }
    Ok(lines)
}

/// Round numbers within a range, from the lowest, as they are written.
fn ticks(low: f64, high: f64, logarithmic: bool) -> Vec<(f64, String)> {
    let slack = 1e-6 * (high - low).abs();
    if logarithmic {
        let (a, b) = (low.log10().ceil() as i32, (high.log10() + 1e-9).floor() as i32);
        let step = ((b - a) / 6 + 1).max(1);
        let power = |d: i32| (10f64.powi(d), format!("1e{d}"));
        return (a..=b).step_by(step as usize).map(power).collect();
    }
    let rough = (high - low) / 5.0;
    let power = 10f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 2.5, 5.0, 10.0].into_iter().find(|s| s * power >= rough * 0.999).unwrap_or(10.0);
    let step = step * power;
    let digits = (0..9).find(|d| {
        let scaled = step * 10f64.powi(*d);
        (scaled - scaled.round()).abs() < 1e-6 * scaled
    });
    let digits = digits.unwrap_or(9) as usize;
    let first = ((low - slack) / step).ceil() as i64;
    let last = ((high + slack) / step).floor() as i64;
    (first..=last.min(first.saturating_add(20)))
        .map(|i| (i as f64 * step, format!("{:.digits$}", i as f64 * step)))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Seen red with steps of 3.
    #[test]
    fn ticks_are_round() {
        let labels = |low, high, log| ticks(low, high, log).into_iter().map(|t| t.1).collect::<Vec<_>>();
        assert_eq!(labels(0.9, 1.1, false), ["0.90", "0.95", "1.00", "1.05", "1.10"]);
        assert_eq!(labels(0.0, 0.015, false), ["0.000", "0.005", "0.010", "0.015"]);
        assert_eq!(labels(1e-6, 1e-2, true), ["1e-6", "1e-5", "1e-4", "1e-3", "1e-2"]);
        assert_eq!(labels(-40.0, 60.0, false).len(), 6);
    }

    /// Seen red with texts written at the picture's left.
    #[test]
    fn the_strip_alone_is_drawn_on() {
        let legend = Legend {
            title: "Tension".into(),
            unit: "length / rest".into(),
            scale: Scale::Bar {
                stops: super::super::colour::DIVERGING,
                low: 0.9,
                high: 1.1,
                logarithmic: false,
            },
        };
        for colour in [[255, 255, 255, 255], [20, 20, 30, 255], [0; 4]] {
            let mut picture = Picture::plain(200, 150, colour);
            legend.draw(&mut picture).unwrap();
            let strip = legend.width([200, 150]).unwrap();
            let changed = |x: u32| (0..150).any(|y| picture.at(x, y) != colour);
            assert!((0..200 - strip).all(|x| !changed(x)));
            let columns = (200 - strip..200).filter(|x| changed(*x)).count() as u32;
            assert!(2 * columns > strip, "{columns} of {strip}");
            assert!(!changed(199), "the text is cut off");
        }
    }
}
