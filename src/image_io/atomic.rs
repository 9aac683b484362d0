//! Files that appear complete or not at all.

use std::fs::{self, OpenOptions};
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use super::ImageError;

/// Replaces the file at `path` by `bytes` in one step: readers see the old content or the new one.
///
/// The bytes go to a temporary file in the same folder, which is then renamed; on a failure it is
/// removed and the old file stays as it was. A symbolic link keeps pointing to its file, which is
/// replaced. What is not a regular file (a device, a pipe) is written to directly: a rename would
/// put a file in its place. A file marked read-only is refused although a rename could replace it.
///
/// # Errors
/// [`ImageError::Write`] with the path as given and the reason.
pub fn write_atomic(path: &Path, bytes: &[u8]) -> Result<(), ImageError> {
    replace(path, bytes).map_err(|e| ImageError::write(path, reason(&e)))
}

fn replace(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let target = match fs::canonicalize(path) {
        Ok(existing) => existing,
        Err(e) if e.kind() == ErrorKind::NotFound => path.to_path_buf(),
        Err(e) => return Err(e),
    };
    match fs::metadata(&target) {
        Ok(m) if m.is_dir() => return Err(ErrorKind::IsADirectory.into()),
        Ok(m) if !m.is_file() => {
            return OpenOptions::new()
                .write(true)
                .open(&target)?
                .write_all(bytes);
        }
        Ok(m) if m.permissions().readonly() => {
            return Err(io::Error::new(
                ErrorKind::PermissionDenied,
                "the file is marked read-only",
            ));
        }
        _ => {}
    }
    let (temporary, mut file) = create_beside(&target)?;
    let written = file.write_all(bytes);
    drop(file);
    let done = written.and_then(|()| fs::rename(&temporary, &target));
    if done.is_err() {
        // The first error is the one worth telling.
        let _ = fs::remove_file(&temporary);
    }
    done
}

/// Whether [`write_atomic`] to `path` can be expected to work, found out by writing nothing that stays:
/// better before a long rendering than after it.
///
/// # Errors
/// As [`write_atomic`].
pub fn check_writable(path: &Path) -> Result<(), ImageError> {
    let check = || -> io::Result<()> {
        match fs::metadata(path) {
            Ok(m) if m.is_dir() => Err(ErrorKind::IsADirectory.into()),
            Ok(m) if !m.is_file() => Ok(()),
            Ok(m) if m.permissions().readonly() => Err(io::Error::new(
                ErrorKind::PermissionDenied,
                "the file is marked read-only",
            )),
            _ => {
                let (temporary, file) = create_beside(path)?;
                drop(file);
                fs::remove_file(temporary)
            }
        }
    };
    check().map_err(|e| ImageError::write(path, reason(&e)))
}

/// A new file in the folder of `target`, under a name that no other writer uses. The name does not
/// contain the target's, which may already be as long as the file system allows.
fn create_beside(target: &Path) -> io::Result<(PathBuf, fs::File)> {
    static COUNT: AtomicU64 = AtomicU64::new(0);
    loop {
        let count = COUNT.fetch_add(1, Ordering::Relaxed);
        let name = format!(".luxel-{}-{count}.tmp", std::process::id());
        let temporary = target.with_file_name(name);
        match OpenOptions::new()
            .write(true)
            .create_new(true)
            .open(&temporary)
        {
            Ok(file) => return Ok((temporary, file)),
            Err(e) if e.kind() == ErrorKind::AlreadyExists => {}
            Err(e) => return Err(e),
        }
    }
}

/// What went wrong, in the words of a user.
pub(super) fn reason(e: &io::Error) -> String {
    let words = match e.kind() {
        ErrorKind::NotFound => "no such file or folder",
        ErrorKind::IsADirectory => "it is a folder",
        ErrorKind::NotADirectory => "a part of the path is not a folder",
        ErrorKind::StorageFull => "the disk is full",
        ErrorKind::QuotaExceeded => "the disk quota is used up",
        ErrorKind::ReadOnlyFilesystem => "the file system is read-only",
        ErrorKind::PermissionDenied if e.get_ref().is_none() => "permission denied",
        _ => return e.to_string(),
    };
    words.to_string()
}
