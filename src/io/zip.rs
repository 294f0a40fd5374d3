//! ZIP archives as NumPy uses them: stored entries are written, stored and deflated ones are read, both with
//! 64-bit sizes. Sizes are held against the file's before anything is allocated.

use super::output::Output;
use crate::{Error, Result};
use flate2::Crc;
use flate2::read::DeflateDecoder;
use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

const LOCAL: &[u8; 4] = b"PK\x03\x04";
const CENTRAL: &[u8; 4] = b"PK\x01\x02";
const END: &[u8; 4] = b"PK\x05\x06";
const END_64: &[u8; 4] = b"PK\x06\x06";
const LOCATOR_64: &[u8; 4] = b"PK\x06\x07";
/// 1980-01-01, so that equal input gives equal files.
const DATE: u16 = 0x21;

/// Writes stored entries one after the other.
pub struct ZipWriter {
    out: Output,
    position: u64,
    entries: Vec<Written>,
    /// The entry being written: checksum and bytes still to come.
    crc: Crc,
    left: u64,
}

struct Written {
    name: String,
    crc: u32,
    size: u64,
    at: u64,
}

impl ZipWriter {
    /// An archive without entries.
    pub fn new(out: Output) -> Self {
        Self { out, position: 0, entries: Vec::new(), crc: Crc::new(), left: 0 }
    }

    fn put(&mut self, bytes: &[u8]) -> Result<()> {
        self.position += bytes.len() as u64;
        self.out.put(bytes)
    }

    /// Starts an entry of `size` bytes; the one before must be complete.
    pub fn begin(&mut self, name: &str, size: u64) -> Result<()> {
        let at = self.position;
        self.entries.push(Written { name: name.into(), crc: 0, size, at });
        (self.crc, self.left) = (Crc::new(), size);
        let mut head = LOCAL.to_vec();
        head.extend(version(size).to_le_bytes());
        head.extend([0; 6]); // flags, method, time
        head.extend(DATE.to_le_bytes());
        head.extend([0; 4]); // the checksum comes later
        let big = size >= u32::MAX as u64;
        let short = if big { u32::MAX } else { size as u32 };
        head.extend(short.to_le_bytes());
        head.extend(short.to_le_bytes());
        head.extend((name.len() as u16).to_le_bytes());
        head.extend(if big { 20u16 } else { 0 }.to_le_bytes());
        head.extend(name.as_bytes());
        if big {
            head.extend([1, 0, 16, 0]);
            head.extend(size.to_le_bytes());
            head.extend(size.to_le_bytes());
        }
        self.put(&head)
    }

    /// Writes a piece of the entry.
    pub fn write(&mut self, bytes: &[u8]) -> Result<()> {
        self.left = self.left.checked_sub(bytes.len() as u64).ok_or_else(|| self.size_error("too many"))?;
        self.crc.update(bytes);
        self.put(bytes)
    }

    fn size_error(&self, found: &str) -> Error {
        let (name, size) = self.entries.last().map_or(("", 0), |e| (&e.name, e.size));
        let path = self.out.path().display();
        Error::invalid(format_args!("{path}: found {found} bytes for the entry '{name}', expected {size}"))
    }

    /// Completes the entry.
    pub fn end(&mut self) -> Result<()> {
        if self.left > 0 {
            return Err(self.size_error("too few"));
        }
        if let Some(entry) = self.entries.last_mut() {
            entry.crc = self.crc.sum();
            self.out.patch(entry.at + 14, &entry.crc.to_le_bytes())?;
        }
        Ok(())
    }

    /// Writes the directory and gives the archive its name.
    pub fn finish(mut self) -> Result<()> {
        let begin = self.position;
        let mut directory = Vec::new();
        for e in &self.entries {
            let mut extra = Vec::new();
            let mut short = |value: u64| {
                if value < u32::MAX as u64 {
                    return value as u32;
                }
                extra.extend(value.to_le_bytes());
                u32::MAX
            };
            let sizes = [short(e.size), short(e.size)];
            let at = short(e.at);
            directory.extend(CENTRAL);
            directory.extend(45u16.to_le_bytes());
            directory.extend(version(e.size.max(e.at)).to_le_bytes());
            directory.extend([0; 6]);
            directory.extend(DATE.to_le_bytes());
            directory.extend(e.crc.to_le_bytes());
            directory.extend(sizes.map(u32::to_le_bytes).as_flattened());
            directory.extend((e.name.len() as u16).to_le_bytes());
            let extra_length = if extra.is_empty() { 0 } else { extra.len() as u16 + 4 };
            directory.extend(extra_length.to_le_bytes());
            directory.extend([0; 10]); // comment, disk, attributes
            directory.extend(at.to_le_bytes());
            directory.extend(e.name.as_bytes());
            if !extra.is_empty() {
                directory.extend([1, 0]);
                directory.extend((extra.len() as u16).to_le_bytes());
                directory.extend(extra);
            }
        }
        self.put(&directory)?;
        let (size, count) = (directory.len() as u64, self.entries.len() as u64);
        let end = self.position;
        let mut tail = Vec::new();
        if begin >= u32::MAX as u64 {
            tail.extend(END_64);
            tail.extend(44u64.to_le_bytes());
            tail.extend([45, 0, 45, 0, 0, 0, 0, 0, 0, 0, 0, 0]);
            for value in [count, count, size, begin] {
                tail.extend(value.to_le_bytes());
            }
            tail.extend(LOCATOR_64);
            tail.extend([0; 4]);
            tail.extend(end.to_le_bytes());
            tail.extend([1, 0, 0, 0]);
        }
        tail.extend(END);
        tail.extend([0; 4]);
        tail.extend((count as u16).to_le_bytes());
        tail.extend((count as u16).to_le_bytes());
        tail.extend((size as u32).to_le_bytes());
        tail.extend((begin.min(u32::MAX as u64) as u32).to_le_bytes());
        tail.extend([0; 2]);
        self.put(&tail)?;
        self.out.commit()
    }
}

/// Version needed to read an entry: 4.5 knows 64-bit sizes.
fn version(size: u64) -> u16 {
    if size >= u32::MAX as u64 { 45 } else { 20 }
}

/// An entry of an archive that is read.
#[derive(Clone, Debug)]
pub struct Entry {
    /// Its name.
    pub name: String,
    /// Its bytes when unpacked, as the directory says.
    pub size: u64,
    /// Where its header starts in the file.
    pub at: u64,
    packed: u64,
    deflated: bool,
    crc: u32,
}

/// Reads the entries of an archive.
pub struct ZipReader {
    path: PathBuf,
    file: BufReader<File>,
    /// The directory.
    pub entries: Vec<Entry>,
}

fn u16_at(bytes: &[u8], at: usize) -> usize {
    u16::from_le_bytes([bytes[at], bytes[at + 1]]) as usize
}

fn u32_at(bytes: &[u8], at: usize) -> u64 {
    u32::from_le_bytes(std::array::from_fn(|i| bytes[at + i])) as u64
}

fn u64_at(bytes: &[u8], at: usize) -> u64 {
    u64::from_le_bytes(std::array::from_fn(|i| bytes[at + i]))
}

impl ZipReader {
    /// Reads the directory of an archive.
    pub fn open(path: &Path) -> Result<Self> {
        let failed = |e| Error::io(path, e);
        let mut file = File::open(path).map_err(failed)?;
        let length = file.seek(SeekFrom::End(0)).map_err(failed)?;
        let mut read = |at: u64, size: u64| -> Result<Vec<u8>> {
            let mut bytes = vec![0; size as usize];
            file.seek(SeekFrom::Start(at)).and_then(|_| file.read_exact(&mut bytes)).map_err(failed)?;
            Ok(bytes)
        };
        let start = read(0, length.min(4))?;
        if start.as_slice() != LOCAL && start.as_slice() != END {
            return Err(Error::binary(path, 0, "other bytes", "'PK', the start of a ZIP archive"));
        }
        // The end record is 22 bytes and a comment of up to 65535.
        let tail_at = length.saturating_sub(22 + 65535);
        let tail = read(tail_at, length - tail_at)?;
        let end = tail
            .len()
            .checked_sub(22)
            .and_then(|last| (0..=last).rev().find(|&i| tail[i..].starts_with(END)));
        let Some(end) = end else {
            return Err(Error::binary(
                path,
                length as usize,
                "the end of the file",
                "the directory of a ZIP archive",
            ));
        };
        let end_at = tail_at + end as u64;
        let mut count = u16_at(&tail, end + 10) as u64;
        let (mut size, mut begin) = (u32_at(&tail, end + 12), u32_at(&tail, end + 16));
        if end >= 20 && tail[end - 20..].starts_with(LOCATOR_64) {
            let at = u64_at(&tail, end - 12);
            if at > end_at.saturating_sub(56) {
                return Err(Error::binary(
                    path,
                    end_at as usize - 12,
                    at,
                    "the place of the 64-bit end record",
                ));
            }
            let record = read(at, 56)?;
            if !record.starts_with(END_64) {
                return Err(Error::binary(path, at as usize, "other bytes", "the 64-bit end record"));
            }
            (count, size, begin) = (u64_at(&record, 32), u64_at(&record, 40), u64_at(&record, 48));
        }
        if size > end_at || begin > end_at - size {
            let found = format!("a directory of {size} bytes at {begin}");
            return Err(Error::binary(
                path,
                end_at as usize + 12,
                found,
                format_args!("one within {end_at} bytes"),
            ));
        }
        let directory = read(begin, size)?;
        let mut entries = Vec::new();
        let mut at = 0;
        for _ in 0..count {
            let place = begin as usize + at;
            let record = directory.get(at..).filter(|r| r.len() >= 46 && r.starts_with(CENTRAL));
            let Some(record) = record else {
                let found = format!("{} entries in the directory", entries.len());
                return Err(Error::binary(path, place, found, format_args!("{count}")));
            };
            let (name, extra, comment) = (u16_at(record, 28), u16_at(record, 30), u16_at(record, 32));
            if record.len() < 46 + name + extra + comment {
                return Err(Error::binary(path, place, "a directory entry that is cut off", "a whole one"));
            }
            let entry = parse_entry(path, place, record, name, extra, length)?;
            entries.push(entry);
            at += 46 + name + extra + comment;
        }
        Ok(Self { path: path.into(), file: BufReader::with_capacity(1 << 16, file), entries })
    }

    /// Turns the reader to an entry's unpacked bytes.
    pub fn entry(self, entry: &Entry) -> Result<EntryReader> {
        let failed = |e| Error::io(&self.path, e);
        let mut file = self.file;
        let mut head = [0; 30];
        file.seek(SeekFrom::Start(entry.at)).and_then(|_| file.read_exact(&mut head)).map_err(failed)?;
        if !head.starts_with(LOCAL) {
            return Err(Error::binary(
                &self.path,
                entry.at as usize,
                "other bytes",
                "the header of an entry",
            ));
        }
        let data = entry.at + 30 + (u16_at(&head, 26) + u16_at(&head, 28)) as u64;
        let length = file.seek(SeekFrom::End(0)).map_err(failed)?;
        if data > length || entry.packed > length - data {
            let found = format!("{} bytes of '{}'", entry.packed, entry.name);
            return Err(Error::binary(
                &self.path,
                entry.at as usize,
                found,
                "at most what is left of the file",
            ));
        }
        file.seek(SeekFrom::Start(data)).map_err(failed)?;
        let packed = file.take(entry.packed);
        let source = if entry.deflated {
            Source::Deflated(DeflateDecoder::new(packed))
        } else {
            Source::Stored(packed)
        };
        Ok(EntryReader {
            path: self.path,
            entries: self.entries,
            source,
            left: entry.size,
            crc: Crc::new(),
            entry: entry.clone(),
        })
    }
}

fn parse_entry(
    path: &Path,
    place: usize,
    record: &[u8],
    name: usize,
    extra: usize,
    length: u64,
) -> Result<Entry> {
    let text = String::from_utf8_lossy(&record[46..46 + name]).into_owned();
    let mut entry = Entry {
        name: text,
        size: u32_at(record, 24),
        at: u32_at(record, 42),
        packed: u32_at(record, 20),
        deflated: u16_at(record, 10) == 8,
        crc: u32_at(record, 16) as u32,
    };
    if u16_at(record, 8) & 1 != 0 || !matches!(u16_at(record, 10), 0 | 8) {
        let found =
            format!("the entry '{}', encrypted or packed by method {}", entry.name, u16_at(record, 10));
        return Err(Error::binary(path, place, found, "stored or deflated entries"));
    }
    let mut extras = &record[46 + name..46 + name + extra];
    while extras.len() >= 4 {
        let (id, size) = (u16_at(extras, 0), u16_at(extras, 2));
        let data = &extras[4..(4 + size).min(extras.len())];
        if id == 1 {
            // 64-bit values follow for those fields that are full, in this order.
            let mut values = data.chunks_exact(8).map(|v| u64_at(v, 0));
            for field in [&mut entry.size, &mut entry.packed, &mut entry.at] {
                if *field == u32::MAX as u64 {
                    *field = values.next().unwrap_or(*field);
                }
            }
        }
        extras = &extras[4 + data.len()..];
    }
    // Deflate packs at most about 1032 to 1.
    let most =
        if entry.deflated { entry.packed.saturating_mul(1040).saturating_add(64) } else { entry.packed };
    let sizes_fit = if entry.deflated { entry.size <= most } else { entry.size == most };
    if entry.packed > length || entry.at > length.saturating_sub(30) || !sizes_fit {
        let found = format!(
            "the entry '{}' of {} bytes, {} packed, at {}",
            entry.name, entry.size, entry.packed, entry.at
        );
        return Err(Error::binary(
            path,
            place,
            found,
            format_args!("sizes that fit the file's {length} bytes"),
        ));
    }
    Ok(entry)
}

enum Source {
    Stored(std::io::Take<BufReader<File>>),
    Deflated(DeflateDecoder<std::io::Take<BufReader<File>>>),
}

/// The unpacked bytes of one entry, read from front to back.
pub struct EntryReader {
    path: PathBuf,
    entries: Vec<Entry>,
    source: Source,
    left: u64,
    crc: Crc,
    entry: Entry,
}

impl EntryReader {
    /// Bytes not read yet.
    pub fn left(&self) -> u64 {
        self.left
    }

    /// Fills `bytes`. The last byte's arrival compares the checksum.
    pub fn read_exact(&mut self, bytes: &mut [u8]) -> Result<()> {
        let done = self.entry.size - self.left;
        let broken = |found: &dyn std::fmt::Display, expected: &dyn std::fmt::Display| {
            let found = format!("{found} in the entry '{}'", self.entry.name);
            Error::binary(&self.path, self.entry.at as usize, found, expected)
        };
        if bytes.len() as u64 > self.left {
            return Err(broken(
                &format_args!("only {} bytes", self.entry.size),
                &format_args!("at least {}", done + bytes.len() as u64),
            ));
        }
        let read = match &mut self.source {
            Source::Stored(source) => source.read_exact(bytes),
            Source::Deflated(source) => source.read_exact(bytes),
        };
        read.map_err(|e| broken(&format_args!("damaged data ({e})"), &"data that can be unpacked"))?;
        self.crc.update(bytes);
        self.left -= bytes.len() as u64;
        if self.left == 0 && self.crc.sum() != self.entry.crc {
            return Err(broken(&"a wrong checksum", &format_args!("{:08x}", self.entry.crc)));
        }
        Ok(())
    }

    /// Reads the rest, which may be at most `limit` bytes.
    pub fn read_rest(&mut self, limit: u64) -> Result<Vec<u8>> {
        if self.left > limit {
            let found = format!("{} bytes in the entry '{}'", self.entry.size, self.entry.name);
            return Err(Error::binary(
                &self.path,
                self.entry.at as usize,
                found,
                format_args!("at most {limit}"),
            ));
        }
        // Grown as data arrives: a deflated entry's size is only a claim.
        let mut bytes = Vec::new();
        while self.left > 0 {
            let begin = bytes.len();
            bytes.resize(begin + self.left.min(1 << 20) as usize, 0);
            self.read_exact(&mut bytes[begin..])?;
        }
        Ok(bytes)
    }

    /// Back to the archive.
    pub fn close(self) -> ZipReader {
        let file = match self.source {
            Source::Stored(source) => source.into_inner(),
            Source::Deflated(source) => source.into_inner().into_inner(),
        };
        ZipReader { path: self.path, file, entries: self.entries }
    }
}
