//! Tables of the stitch types of a scene: read from the cache, or built and put there.

use super::table_cache;
use crate::knot::table::{Grid, Table};
use crate::knot::tabulate::{Subject, tabulate};
use crate::knot::{Settings, Start};
use crate::scene::{Mode, Scene};
use std::path::Path;
use std::time::Instant;

/// Where a table came from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum TableSource {
    /// Built, for there is no cache, or nothing of use in it.
    Built,
    /// Read from the cache.
    Cached,
}

/// What became of a stitch type's table.
#[derive(Clone, Debug, serde::Serialize)]
pub struct TableReport {
    /// The stitch type's key.
    pub key: String,
    /// Built or read.
    pub source: TableSource,
    /// Wall-clock seconds that it took.
    pub seconds: f64,
    /// Bytes in memory, in f32.
    pub bytes: usize,
    /// Nodes of its grid.
    pub nodes: usize,
    /// Cells between them.
    pub cells: usize,
    /// Cells through which the branch of optima that is continuous from rest breaks.
    pub cells_broken: usize,
    /// The one nearest to rest: 2 (F11 - 1) / (F11 + 1), F12 / h and 2 (h - 1) / (h + 1), h = |F e_v|.
    pub nearest_break: Option<[f64; 3]>,
}

/// The tables of a scene.
#[derive(Clone, Debug, Default)]
pub struct Tables {
    /// `[stencil]`; none for a stitch type without knots.
    pub tables: Vec<Option<Table<f32>>>,
    /// One for each table.
    pub reports: Vec<TableReport>,
    /// Why the cache could not be written.
    pub note: Option<String>,
}

impl Tables {
    /// Reads or builds what the settings ask for, in rayon's current pool; `cache` is a folder, made if need be.
    /// Whatever is wrong with it, tables are built.
    pub fn new(scene: &Scene, settings: &Settings, cache: Option<&Path>) -> Self {
        let mut all = Self { tables: vec![None; scene.stencils.len()], ..Self::default() };
        if settings.start != Start::Table || scene.mode != Mode::Relax {
            return all;
        }
        let grid = Grid::default();
        for batch in &scene.batches {
            let (stencil, template) = (&scene.stencils[batch.stencil], &scene.templates[batch.stencil]);
            if stencil.knot_count() == 0 || all.tables[batch.stencil].is_some() {
                continue;
            }
            let began = Instant::now();
            let subject = Subject::new(stencil, &template.corners, settings);
            let place = cache.map(|folder| (folder, table_cache::key(&subject, &grid)));
            let cached = place.and_then(|(folder, key)| table_cache::read(folder, key, &subject, &grid));
            let source = if cached.is_some() { TableSource::Cached } else { TableSource::Built };
            let Some(table) = cached.or_else(|| tabulate(subject, &grid)) else { continue };
            if let (TableSource::Built, Some((folder, key)), None) = (source, place, &all.note) {
                all.note = table_cache::write(folder, key, &table).err().map(|e| e.to_string());
            }
            let gaps = table.gaps();
            all.reports.push(TableReport {
                key: template.key(),
                source,
                seconds: began.elapsed().as_secs_f64(),
                bytes: table.memory(),
                nodes: grid.node_count(),
                cells: grid.cell_count(),
                cells_broken: gaps.cells,
                nearest_break: gaps.nearest,
            });
            all.tables[batch.stencil] = Some(table);
        }
        all
    }
}
