//! Pictures to files: PNGs, numbered where there are several, or one GIF.

use super::Arguments;
use gif::{DisposalMethod, Encoder, Frame, Repeat};
use knotmesh::io::output::{FramePattern, Output};
use knotmesh::io::text::extension;
use knotmesh::render::Picture;
use knotmesh::{Error, Result};
use std::path::{Path, PathBuf};

/// Colours of a GIF are looked for in every tenth pixel: what is left is noise.
const SPEED: i32 = 10;

/// Where pictures go.
pub enum Pictures {
    Png { names: FramePattern, written: Vec<PathBuf> },
    Gif(Box<Gif>),
}

/// Refuses outputs of another kind, without a folder, or in an input's place, before anything is read.
pub fn check(arguments: &Arguments) -> Result<()> {
    let path = &arguments.output;
    if is_folder(path) {
        return Ok(());
    }
    match extension(path).as_str() {
        "png" | "gif" => {}
        "mp4" | "webm" | "mkv" | "mov" | "avi" => return Err(film(arguments)),
        _ => {
            return Err(Error::invalid(format_args!(
                "{0}: found another kind of output, expected .png, .gif or a folder (one that is to be made: {0}/)",
                path.display()
            )));
        }
    }
    let within = path.parent().filter(|f| !f.as_os_str().is_empty());
    if within.is_some_and(|f| !f.is_dir()) {
        return Err(Error::invalid(format_args!("{}: its folder does not exist", path.display())));
    }
    if path.is_file() && std::fs::canonicalize(path).ok() == std::fs::canonicalize(&arguments.input).ok() {
        return Err(Error::invalid(format_args!("{}: an output would replace an input", path.display())));
    }
    Ok(())
}

fn is_folder(path: &Path) -> bool {
    path.is_dir() || path.to_string_lossy().ends_with(['/', std::path::MAIN_SEPARATOR])
}

/// A GIF that is being written.
pub struct Gif {
    encoder: Encoder<Output>,
    path: PathBuf,
    /// Hundredths of a second.
    delay: u16,
}

impl Pictures {
    /// For so many pictures of what is called `stem`; `numbered`: they are some of a longer sequence.
    pub fn open(arguments: &Arguments, stem: &str, count: usize, numbered: bool) -> Result<Self> {
        let path = &arguments.output;
        let several = count > 1 || numbered;
        if is_folder(path) {
            std::fs::create_dir_all(path).map_err(|e| Error::io(path, e))?;
            // Percent signs of the name are no numbers.
            let name = path.join(format!("{}.png", stem.replace('%', "%%")));
            return Ok(Self::Png { names: FramePattern::new(&name, several)?, written: Vec::new() });
        }
        if extension(path) == "gif" {
            return Ok(Self::Gif(Box::new(Gif::create(arguments)?)));
        }
        Ok(Self::Png { names: FramePattern::new(path, several)?, written: Vec::new() })
    }

    /// Writes a picture.
    pub fn put(&mut self, number: usize, picture: &Picture) -> Result<()> {
        match self {
            Self::Png { names, written } => {
                let path = names.path(number);
                let mut out = Output::create(&path)?;
                picture.write_png(&mut out)?;
                out.commit()?;
                written.push(path);
                Ok(())
            }
            Self::Gif(gif) => gif.put(picture),
        }
    }

    /// Completes the files, and names them.
    pub fn finish(self) -> Result<Vec<PathBuf>> {
        match self {
            Self::Png { written, .. } => Ok(written),
            Self::Gif(gif) => {
                let out = gif.encoder.into_inner().map_err(|e| broken(&gif.path, e))?;
                out.commit()?;
                Ok(vec![gif.path])
            }
        }
    }
}

impl Gif {
    fn create(arguments: &Arguments) -> Result<Self> {
        let path = arguments.output.clone();
        let out = Output::create(&path)?;
        // Both go to 16384.
        let [width, height] = [arguments.width as u16, arguments.height as u16];
        let fault = |e| broken(&path, e);
        let mut encoder = Encoder::new(out, width, height, &[]).map_err(fault)?;
        encoder.set_repeat(Repeat::Infinite).map_err(fault)?;
        // Viewers take less than 2 hundredths for a mistake.
        let delay = (100.0 / arguments.fps).round().clamp(2.0, 6000.0) as u16;
        Ok(Self { encoder, path, delay })
    }

    fn put(&mut self, picture: &Picture) -> Result<()> {
        // A pixel is there or not.
        let mut bytes: Vec<u8> = Vec::with_capacity(4 * picture.pixels.len());
        for [r, g, b, a] in &picture.pixels {
            bytes.extend(if *a < 128 { [0; 4] } else { [*r, *g, *b, 255] });
        }
        let [width, height] = [picture.width as u16, picture.height as u16];
        let mut frame = Frame::from_rgba_speed(width, height, &mut bytes, SPEED);
        frame.delay = self.delay;
        frame.dispose = DisposalMethod::Background;
        self.encoder.write_frame(&frame).map_err(|e| broken(&self.path, e))
    }
}

fn broken(path: &Path, error: gif::EncodingError) -> Error {
    match error {
        gif::EncodingError::Io(error) => Error::io(path, error),
        other => Error::invalid(format_args!("{}: {other}", path.display())),
    }
}

/// Films are other programs' work: how.
fn film(arguments: &Arguments) -> Error {
    let path = &arguments.output;
    let numbered = path.with_extension("%04d.png");
    let first = arguments.frame_range.as_deref().and_then(|r| r.split(':').next()?.parse::<usize>().ok());
    let first = match (first, arguments.turntable) {
        (Some(first), None) if first > 0 => format!("-start_number {first} "),
        _ => String::new(),
    };
    let even = if arguments.width.is_multiple_of(2) && arguments.height.is_multiple_of(2) {
        ""
    } else {
        " -vf 'pad=ceil(iw/2)*2:ceil(ih/2)*2'"
    };
    let coding = match extension(path).as_str() {
        "webm" => "-c:v libvpx-vp9 -b:v 0 -crf 24",
        _ => "-c:v libx264 -crf 16",
    };
    Error::invalid(format_args!(
        "{0}: films are made of pictures: -o {1}, then 'ffmpeg -framerate {2} {first}-i {1}{even} {coding} -pix_fmt yuv420p {0}'",
        path.display(),
        numbered.display(),
        arguments.fps
    ))
}
