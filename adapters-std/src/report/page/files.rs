//! The files of a page, written so that the page never names one that is not there.

use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

use super::{Block, Page};
use crate::Error;
use crate::io::atomic;
use crate::io::mesh::{WriteOptions, gltf, ply};
use crate::mesh::Mesh;

/// A file in the folder of a page.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct File {
    /// Its name below the folder, of small letters, digits and `_ - . /`.
    pub name: String,
    /// What is in it; none: the file is already there, or the page has named it before.
    pub bytes: Option<Vec<u8>>,
}

impl File {
    /// A file that is written with the page.
    pub fn new(name: impl Into<String>, bytes: Vec<u8>) -> Self {
        File { name: name.into(), bytes: Some(bytes) }
    }

    /// A file that lies in the folder before the page is written, or that the page has named before.
    pub fn there(name: impl Into<String>) -> Self {
        File { name: name.into(), bytes: None }
    }

    /// A mesh as a GLB file.
    ///
    /// # Errors
    /// [`Error::Input`] for a mesh that the format cannot hold.
    pub fn glb(name: impl Into<String>, mesh: &Mesh) -> Result<Self, Error> {
        let written = gltf::format(&mesh.clone().into(), &WriteOptions::default()).map_err(Error::Input)?;
        Ok(File::new(name, written.bytes))
    }

    /// A mesh as a PLY file, binary.
    ///
    /// # Errors
    /// [`Error::Input`] for a mesh that the format cannot hold.
    pub fn ply(name: impl Into<String>, mesh: &Mesh) -> Result<Self, Error> {
        let written = ply::format(&mesh.clone().into(), &WriteOptions::default()).map_err(Error::Input)?;
        Ok(File::new(name, written.bytes))
    }
}

impl Page {
    /// Every file beside the page, in the order in which it names them.
    pub fn all_files(&self) -> impl Iterator<Item = &File> {
        let shown = self.sections.iter().flat_map(|section| &section.blocks).flat_map(|block| match block {
            Block::Strip(strip) => strip.pictures.iter().chain(&strip.legend).map(|picture| &picture.file).collect(),
            Block::Plots(plots) => plots.iter().map(|plot| &plot.file).collect::<Vec<_>>(),
            Block::Downloads(downloads) => downloads.iter().map(|download| &download.file).collect(),
            Block::Text(_) | Block::Table(_) => Vec::new(),
        });
        shown.chain(&self.files)
    }

    /// Writes the page into `folder`, which is made when it does not exist; other files in it stay as they are.
    ///
    /// Each file is there completely or not at all. An `index.html` of before goes first and the new one comes last, so that a page always
    /// finds its files.
    ///
    /// # Errors
    /// [`Error::Write`]; [`Error::Internal`] for names that are no names of files below the folder, or that occur twice.
    pub fn write(&self, folder: &Path) -> Result<(), Error> {
        let mut names = HashSet::from(["index.html"]);
        for file in self.all_files() {
            let is_letter = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || "_-./".contains(c);
            let is_part = |part: &str| !part.is_empty() && !part.starts_with('.');
            let is_new = names.insert(&file.name) || file.bytes.is_none();
            if !file.name.chars().all(is_letter) || !file.name.split('/').all(is_part) || !is_new {
                return Err(Error::Internal(format!("{:?} cannot be a file of a page", file.name)));
            }
        }
        let make = |folder: &Path| {
            std::fs::create_dir_all(folder).map_err(|source| Error::Write { path: folder.to_owned(), source })
        };
        make(folder)?;
        let index = folder.join("index.html");
        match std::fs::remove_file(&index) {
            Err(source) if source.kind() != std::io::ErrorKind::NotFound => {
                return Err(Error::Write { path: index, source });
            }
            _ => {}
        }
        let new: Vec<(PathBuf, &[u8])> =
            self.all_files().filter_map(|file| Some((folder.join(&file.name), file.bytes.as_deref()?))).collect();
        new.iter().filter_map(|(path, _)| path.parent()).try_for_each(make)?;
        written(&new)?;
        let mut sizes = HashMap::new();
        for file in self.all_files() {
            let path = folder.join(&file.name);
            let found = std::fs::metadata(&path).map_err(|source| Error::Write { path, source })?;
            sizes.insert(file.name.as_str(), found.len());
        }
        let size = |name: &str| sizes.get(name).copied().unwrap_or(0);
        atomic::write(&index, super::html::of(self, &size).as_bytes())
    }
}

/// Files that are on their way to the disk at the same time: each waits for it, and it takes many together as fast as one.
const WRITERS: usize = 16;

/// Writes all files, each completely or not at all.
fn written(files: &[(PathBuf, &[u8])]) -> Result<(), Error> {
    let next = AtomicUsize::new(0);
    let write_some = || loop {
        match files.get(next.fetch_add(1, Ordering::Relaxed)) {
            Some((path, bytes)) => atomic::write(path, bytes)?,
            None => return Ok(()),
        }
    };
    std::thread::scope(|scope| {
        let writers: Vec<_> = (0..WRITERS.min(files.len())).map(|_| scope.spawn(write_some)).collect();
        let panicked = || Err(Error::Internal("a writer of files panicked".into()));
        writers.into_iter().try_for_each(|writer| writer.join().unwrap_or_else(|_| panicked()))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::page::{Download, Section};

    fn page(names: &[&str]) -> Page {
        let download = |name: &&str| Download { file: File::new(*name, vec![1, 2]), text: "a".into() };
        let blocks = vec![Block::Downloads(names.iter().map(download).collect())];
        Page { sections: vec![Section { title: "files".into(), blocks }], ..Page::default() }
    }

    #[test]
    fn files_lie_beside_the_page_and_others_stay() {
        let folder = tempfile::tempdir().unwrap();
        let to = folder.path().join("new");
        page(&["a.png", "meshes/b.glb"]).write(&to).unwrap();
        std::fs::write(to.join("mine.txt"), "x").unwrap();
        let mut second = page(&["a.png"]);
        second.files.push(File::there("mine.txt"));
        second.write(&to).unwrap();
        for name in ["a.png", "meshes/b.glb", "mine.txt", "index.html"] {
            assert!(to.join(name).is_file(), "{name}");
        }
        let mut third = page(&[]);
        third.files.push(File::there("none.txt"));
        assert!(third.write(&to).unwrap_err().to_string().contains("none.txt"));
        assert!(!to.join("index.html").exists(), "a page that could not be written is not there");
    }

    #[test]
    fn names_stay_below_the_folder_and_occur_once() {
        let folder = tempfile::tempdir().unwrap();
        for names in
            [&["../a.png"][..], &["/a.png"], &["a b.png"], &["a.png", "a.png"], &["index.html"], &[""], &["a//b"]]
        {
            assert!(page(names).write(folder.path()).is_err(), "{names:?}");
        }
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    }
}
