//! What a session writes.

use super::session::Session;
use super::state::{Content, Kind};
use crate::curve::{CurveExtras, FrameCurves, UNIFORM_SUBDIVISION};
use crate::io::curves::{CurveFormat, WriteOptions, open_frame_writer};
use crate::io::output::Output;
use crate::io::result::ResultWriter;
use crate::io::smobj;
use crate::scene::Mode;
use crate::{Error, Result};
use std::path::Path;

/// Points between control points, as `knotmesh relax` writes them.
const SUBDIVIDE: usize = 4;

impl Session {
    /// Saves the pattern or chart.
    ///
    /// # Errors
    /// No name, a mesh, a file that cannot be written.
    pub fn save(&mut self) -> Result<()> {
        let content = self.state().content.clone();
        self.disk.save(&content)?;
        self.saved = content;
        Ok(())
    }

    /// The same under a name, which it then has.
    ///
    /// # Errors
    /// As [`Session::save`]; a name of another kind of file.
    pub fn save_as(&mut self, path: &Path) -> Result<()> {
        let kind = Kind::of(path)?;
        if kind != self.kind() || matches!(self.state().content, Content::Mesh(_)) {
            return Err(Error::invalid(format_args!(
                "{}: found a name of another kind of file than is open",
                path.display()
            )));
        }
        let before = self.disk.path.replace(path.into());
        let saved = self.save();
        if saved.is_err() {
            self.disk.path = before;
        }
        saved
    }

    /// Saves the yarn that is shown (of several modes, the relaxed one), in the format that the name says.
    ///
    /// # Errors
    /// No yarn yet, no such format, a file that cannot be written.
    pub fn save_yarn(&mut self, path: &Path) -> Result<()> {
        self.refuse_own(path)?;
        let format = CurveFormat::from_path(path)?;
        let solvers = self.solvers();
        let shown = solvers.iter().find(|s| s.mode == Mode::Relax).or(solvers.first());
        let Some((solver, fabric)) = shown.zip(self.fabric()) else {
            return Err(Error::invalid("found no yarn to save: the pattern is not whole yet"));
        };
        let least = if format.is_uniform_spline() { UNIFORM_SUBDIVISION } else { 0 };
        let subdivide = SUBDIVIDE.max(least);
        let extras = CurveExtras::new(&fabric.mesh, &solver.scene).subdivided(&solver.scene, subdivide);
        let curves = FrameCurves::new(&solver.scene, &solver.output, subdivide, Some(&extras));
        if format == CurveFormat::Npz {
            let mut writer = ResultWriter::create(path, &solver.scene, &solver.output, subdivide, 1)?;
            writer.frame(&solver.scene, &solver.output, &curves)?;
            writer.finish()?;
        } else {
            let mut writer = open_frame_writer(path, 1, &WriteOptions::default())?;
            writer.frame(0, &curves)?;
            writer.finish()?;
        }
        self.exported();
        Ok(())
    }

    /// Saves the mesh as it is shown, pulled corners and all.
    ///
    /// # Errors
    /// No mesh yet, another name than `.smobj`, a file that cannot be written.
    pub fn save_mesh(&mut self, path: &Path) -> Result<()> {
        self.refuse_own(path)?;
        if !path.extension().is_some_and(|e| e.eq_ignore_ascii_case("smobj")) {
            return Err(Error::invalid(format_args!(
                "{}: found another kind of output, expected .smobj",
                path.display()
            )));
        }
        let Some(fabric) = self.fabric().filter(|f| f.mesh.positions.len() == self.places().len()) else {
            return Err(Error::invalid("found no mesh to save: the pattern is not whole yet"));
        };
        let mut mesh = fabric.mesh.as_ref().clone();
        mesh.positions.copy_from_slice(self.places());
        let mut output = Output::create(path)?;
        smobj::write(&mesh, &mut output).map_err(|e| Error::io(path, e))?;
        output.commit()?;
        self.exported();
        Ok(())
    }

    /// An output never replaces what is open.
    fn refuse_own(&self, path: &Path) -> Result<()> {
        let real = |path: &Path| std::fs::canonicalize(path).unwrap_or_else(|_| path.to_path_buf());
        if self.path().is_some_and(|own| real(own) == real(path)) {
            return Err(Error::invalid(format_args!(
                "{}: an output would replace the input",
                path.display()
            )));
        }
        Ok(())
    }

    fn exported(&mut self) {
        let state = self.state();
        self.exported = (state.settings.clone(), state.pulls.clone());
    }
}
