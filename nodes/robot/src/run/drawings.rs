//! Drawings of the map that need no browser: files where options ask for them, and a small one in the terminal.

use std::fs;
use std::path::{Path, PathBuf};

use clap::Args;
use nalgebra::Vector3;
use report::{MapDrawing, PictureError, RunRecord, thumbnail};

use super::output::{MAP_PICTURE, OutputFolder, PAIR_PICTURE};
use super::terminal;
use crate::existing::refuse_to_replace;
use crate::failure::Failure;

/// The width of the map in the terminal, in characters.
const THUMBNAIL_COLUMNS: usize = 60;

/// Which drawings are made; `stillmap demo` has the same arguments.
#[derive(Args, Clone, Debug)]
pub(super) struct DrawingArgs {
    /// Draw the map from obliquely above, too: with what was removed in orange to map.png, and without and with removal to before_after.png
    #[arg(long)]
    png: bool,
    /// Draw the map while it forms, without and with removal, as a picture that moves (APNG)
    #[arg(long, value_name = "FILE")]
    animation: Option<PathBuf>,
    /// Draw the map and a table of the figures on stdout though it is no terminal
    #[arg(long, conflicts_with = "json")]
    thumbnail: bool,
}

impl DrawingArgs {
    /// The first of the options that was given.
    pub(super) fn given(&self) -> Option<&'static str> {
        let options = [
            ("--png", self.png),
            ("--animation", self.animation.is_some()),
            ("--thumbnail", self.thumbnail),
        ];
        options.into_iter().find(|(_, is_given)| *is_given).map(|(option, _)| option)
    }

    /// Refuses to replace a file, before any work is done.
    pub(super) fn refuse(&self, overwrite: bool) -> Result<(), Failure> {
        let is_png = |file: &PathBuf| {
            let extension = file.extension().unwrap_or_default().to_ascii_lowercase();
            extension == "png" || extension == "apng"
        };
        if let Some(file) = self.animation.as_ref().filter(|file| !is_png(file)) {
            return Err(Failure::new(format!(
                "--animation {}: the animation is a picture that moves in the form APNG, and no other",
                file.display()
            ))
            .fix("name it .png, or .apng; browsers show it, and ffmpeg makes a GIF or a video of it"));
        }
        refuse_to_replace(self.animation.clone(), overwrite, "--animation")
    }
}

/// The pictures of the map, as the bytes of PNG files.
pub(super) struct MapPng {
    pub(super) map: Vec<u8>,
    pub(super) before_after: Vec<u8>,
}

/// What was drawn.
pub(super) struct Drawings {
    /// The lines for the terminal; none where stdout is none.
    pub(super) thumbnail: Vec<String>,
    has_pictures: bool,
    animation: Option<PathBuf>,
}

impl Drawings {
    /// The files, for the user; none where there are none.
    pub(super) fn list(&self, folder: &Path) -> Option<String> {
        let folder = folder.display();
        let pictures = self.has_pictures.then(|| format!("{folder}/{MAP_PICTURE}, {PAIR_PICTURE}"));
        let animation = self.animation.as_ref().map(|file| file.display().to_string());
        let files: Vec<String> = pictures.into_iter().chain(animation).collect();
        (!files.is_empty()).then(|| files.join("; "))
    }
}

/// Makes the drawings of a run that are wanted, and removes the pictures that an earlier run has left in the folder.
pub(super) fn draw(
    args: &DrawingArgs,
    folder: &OutputFolder,
    record: &RunRecord,
    json: bool,
) -> Result<Drawings, Failure> {
    let has_thumbnail = !json && (args.thumbnail || terminal::is_watched());
    let mut drawings = Drawings {
        thumbnail: Vec::new(),
        has_pictures: args.png,
        animation: args.animation.clone(),
    };
    if !(has_thumbnail || args.png || args.animation.is_some()) {
        folder.write_pictures(None)?;
        return Ok(drawings);
    }
    let cannot_draw = |error: PictureError| Failure::new(format!("cannot draw the map: {error}"));
    let drawing = MapDrawing::of(record, &normals(record)).map_err(cannot_draw)?;
    let pictures = || -> Result<MapPng, PictureError> {
        Ok(MapPng { map: drawing.map_png()?, before_after: drawing.before_after_png()? })
    };
    let pictures = args.png.then(pictures).transpose().map_err(cannot_draw)?;
    folder.write_pictures(pictures.as_ref())?;
    if let Some(file) = &args.animation {
        let bytes = drawing.animation_png().map_err(cannot_draw)?;
        fs::write(file, bytes).map_err(|error| {
            Failure::new(format!("cannot write {}: {error}", file.display()))
                .fix("give a file that can be written with --animation")
        })?;
    }
    if has_thumbnail {
        drawings.thumbnail = thumbnail(&drawing, THUMBNAIL_COLUMNS, terminal::colours());
    }
    Ok(drawings)
}

/// The normals of the points of the map.
fn normals(record: &RunRecord) -> Vec<Vector3<f32>> {
    /// One normal for the points in a cube of two spacings: for which side is seen that is fine enough, and four times as fast.
    const CELL_IN_SPACINGS: f64 = 2.0;
    let spacing_m = record.map_edge_m.unwrap_or(record.voxel_edge_m);
    reconstruction::normals(&record.static_map, CELL_IN_SPACINGS * spacing_m)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Regression: an APNG was written to a file that was called a GIF, and no viewer of GIFs showed it.
    #[test]
    fn an_animation_of_another_form_is_refused() {
        let refusal = |file: &str| {
            let animation = Some(PathBuf::from(file));
            let args = DrawingArgs { png: false, animation, thumbnail: false };
            args.refuse(true).err().map(|failure| failure.to_string())
        };
        let said = refusal("/nowhere/drive.gif").unwrap();
        assert!(said.contains("APNG") && said.contains("name it .png"), "{said}");
        assert_eq!(refusal("/nowhere/drive.png"), None);
        assert_eq!(refusal("/nowhere/drive.APNG"), None);
    }
}
