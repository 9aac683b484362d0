//! Files that appear complete or not at all.

use std::fs::{self, OpenOptions, TryLockError};
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use super::ImageError;

/// Replaces the file at `path` by `bytes` in one step: readers see the old content or the new one.
///
/// The bytes go to a temporary file in the same folder, which is then renamed; on a failure it is
/// removed and the old file stays as it was. A symbolic link keeps pointing to its file, which is
/// replaced. What is not a regular file (a device, a pipe) is written to directly: a rename would
/// put a file in its place. A file marked read-only is refused although a rename could replace it.
///
/// Any number of programs may write to the same path at once: the last to finish wins, whole. A
/// writer that is killed leaves its temporary file, `.luxel-*.tmp`, which a later writer in that
/// folder removes; it is told from that of a living writer by its lock and its age.
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
    clear_beside(&target);
    /// Somebody else would have to clear away this many files of ours, each in the moment between writing and renaming.
    const TRIES: u32 = 4;
    for _ in 1..TRIES {
        match put(&target, bytes) {
            // Where locks are not seen by other machines, one of them may have taken our file for a forgotten one.
            Err(e) if e.kind() == ErrorKind::NotFound && has_folder(&target) => {}
            done => return done,
        }
    }
    put(&target, bytes)
}

/// Writes beside the target, and renames.
fn put(target: &Path, bytes: &[u8]) -> io::Result<()> {
    let (temporary, mut file) = create_beside(target)?;
    // The file stays open, and so locked, until it has its name.
    let done = file
        .write_all(bytes)
        .and_then(|()| fs::rename(&temporary, target));
    if done.is_err() {
        // The first error is the one worth telling.
        let _ = fs::remove_file(&temporary);
    }
    done
}

fn has_folder(target: &Path) -> bool {
    fs::metadata(folder_of(target)).is_ok_and(|m| m.is_dir())
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
                clear_beside(path);
                let (temporary, _file) = create_beside(path)?;
                match fs::remove_file(temporary) {
                    // As in `replace`: somebody else did so.
                    Err(e) if e.kind() == ErrorKind::NotFound => Ok(()),
                    removed => removed,
                }
            }
        }
    };
    check().map_err(|e| ImageError::write(path, reason(&e)))
}

/// What temporary files are called: the number of the process and its count stand between.
const PREFIX: &str = ".luxel-";
const SUFFIX: &str = ".tmp";

/// A new file in the folder of `target`, under a name that no other writer uses. The name does not
/// contain the target's, which may already be as long as the file system allows.
///
/// It is locked, where the file system knows locks: the lock ends with the writer, however that
/// ends, and tells others whether the file is forgotten.
fn create_beside(target: &Path) -> io::Result<(PathBuf, fs::File)> {
    static COUNT: AtomicU64 = AtomicU64::new(0);
    loop {
        let count = COUNT.fetch_add(1, Ordering::Relaxed);
        let name = format!("{PREFIX}{}-{count}{SUFFIX}", std::process::id());
        let temporary = target.with_file_name(name);
        match OpenOptions::new()
            .write(true)
            .create_new(true)
            .open(&temporary)
        {
            // Between the two steps another writer may have found it without a lock, and is removing it.
            Ok(file) => match file.try_lock() {
                Err(TryLockError::WouldBlock) => {}
                Ok(()) if !temporary.exists() => {}
                Ok(()) | Err(TryLockError::Error(_)) => return Ok((temporary, file)),
            },
            Err(e) if e.kind() == ErrorKind::AlreadyExists => {}
            Err(e) => return Err(e),
        }
    }
}

/// Time since the last byte was written, from which on a temporary file may be a forgotten one: locks are not all there is
/// to tell by, since some file systems that machines share do not show a lock to the others.
const FORGOTTEN: Duration = Duration::from_secs(600);

/// Removes temporary files in the folder of `target` whose writers were killed: those that nobody has locked, nor written
/// to for a while.
/// Nothing depends on it, so what fails is left as it is. Where the file system knows no locks, all stay.
fn clear_beside(target: &Path) {
    let Ok(entries) = fs::read_dir(folder_of(target)) else {
        return;
    };
    for entry in entries.flatten() {
        let name = entry.file_name();
        let ours = (name.to_str()).is_some_and(|n| n.starts_with(PREFIX) && n.ends_with(SUFFIX));
        if !ours || !entry.metadata().is_ok_and(|m| m.is_file() && is_old(&m)) {
            continue;
        }
        // A lock across machines wants a file that is open for writing. If its writer ends in this very moment, the
        // lock is had on the finished file, but the name to be removed is gone by then.
        let opened = OpenOptions::new().write(true).open(entry.path());
        if opened.is_ok_and(|file| file.try_lock().is_ok()) {
            let _ = fs::remove_file(entry.path());
        }
    }
}

fn is_old(file: &fs::Metadata) -> bool {
    let age = file.modified().ok().and_then(|time| time.elapsed().ok());
    age.is_some_and(|age| age >= FORGOTTEN)
}

fn folder_of(target: &Path) -> &Path {
    match target.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
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
