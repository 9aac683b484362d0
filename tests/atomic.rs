//! Files appear whole or not at all, whoever else writes to them, and whoever is killed in the middle.

use luxel::image_io::{check_writable, write_atomic};
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::thread;
use std::time::{Duration, Instant, SystemTime};

/// An empty folder of its own.
fn folder(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("atomic-{name}"));
    let _ = fs::remove_dir_all(&path);
    fs::create_dir_all(&path).unwrap();
    path
}

fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let names = entries.map(|e| e.unwrap().file_name().into_string().unwrap());
    let mut names: Vec<String> = names.collect();
    names.sort();
    names
}

/// Makes a file look as if nobody had written to it for long.
fn age(path: &Path) {
    let file = File::options().write(true).open(path).unwrap();
    let then = SystemTime::now() - Duration::from_secs(3600);
    file.set_modified(then).unwrap();
}

#[test]
fn only_what_nobody_writes_any_more_is_cleared_away() {
    let folder = folder("clear");
    let forgotten = folder.join(".luxel-1-0.tmp");
    let alive = folder.join(".luxel-2-0.tmp");
    for checked_only in [true, false] {
        fs::write(&forgotten, "half of a pic").unwrap();
        age(&forgotten);
        let lock = File::create(&alive).unwrap();
        lock.lock().unwrap();
        age(&alive);
        // Where no lock is seen, being written to is enough.
        fs::write(folder.join(".luxel-4-0.tmp"), "young").unwrap();
        fs::write(folder.join(".luxel-notes.txt"), "of the user").unwrap();
        fs::create_dir_all(folder.join(".luxel-3-0.tmp")).unwrap();
        let target = folder.join("a.txt");
        match checked_only {
            true => check_writable(&target).unwrap(),
            false => write_atomic(&target, b"whole").unwrap(),
        }
        let kept = [2, 3, 4].map(|n| format!(".luxel-{n}-0.tmp"));
        let mut expected = Vec::from(kept);
        expected.push(".luxel-notes.txt".to_string());
        expected.extend((!checked_only).then(|| "a.txt".to_string()));
        assert_eq!(names(&folder), expected);
        drop(lock);
    }
    // Its writer is gone.
    write_atomic(&folder.join("b.txt"), b"whole").unwrap();
    assert!(!alive.exists());
}

/// All bytes alike; how many says which.
fn content(byte: u8) -> Vec<u8> {
    vec![byte; 20_000 + 3_000 * usize::from(byte)]
}

#[test]
fn many_writers_of_one_file_do_not_disturb_each_other() {
    let folder = folder("many");
    let target = folder.join("picture");
    write_atomic(&target, &content(0)).unwrap();
    thread::scope(|scope| {
        for byte in 1..=6 {
            let target = &target;
            scope.spawn(move || {
                (0..150).for_each(|_| write_atomic(target, &content(byte)).unwrap())
            });
        }
        for _ in 0..300 {
            let read = fs::read(&target).unwrap();
            assert!(read == content(read[0]), "a part of a file was seen");
        }
    });
    assert_eq!(names(&folder), ["picture"]);
}

/// Where the process that is to be killed writes.
const VICTIM: &str = "LUXEL_TEST_ATOMIC_TARGET";

/// Does nothing unless it is the process that is to be killed.
#[test]
fn victim() {
    let Some(target) = std::env::var_os(VICTIM) else {
        return;
    };
    let bytes = vec![1; 8 << 20];
    // An end, should nobody kill it.
    for _ in 0..10_000 {
        write_atomic(Path::new(&target), &bytes).unwrap();
    }
}

#[test]
fn a_killed_writer_leaves_nothing_for_long() {
    let folder = folder("killed");
    let target = folder.join("picture");
    let half_written = || names(&folder).iter().any(|n| n.ends_with(".tmp"));
    let mut left = 0;
    // A kill hits the writing nearly always, for nothing else is done; a few tries make that sure.
    for _ in 0..10 {
        let mut victim = Command::new(std::env::current_exe().unwrap())
            .args(["--exact", "victim"])
            .env(VICTIM, &target)
            .stdout(Stdio::null())
            .spawn()
            .unwrap();
        let start = Instant::now();
        while !half_written() && start.elapsed() < Duration::from_secs(20) {
            thread::sleep(Duration::from_millis(1));
        }
        victim.kill().unwrap();
        victim.wait().unwrap();
        left += u32::from(half_written());
        if target.exists() {
            assert_eq!(fs::metadata(&target).unwrap().len(), 8 << 20);
        }
        let entries = fs::read_dir(&folder).unwrap();
        entries.for_each(|entry| age(&entry.unwrap().path()));
        write_atomic(&target, b"next").unwrap();
        assert_eq!(names(&folder), ["picture"]);
        fs::remove_file(&target).unwrap();
        if left >= 2 {
            return;
        }
    }
    panic!("no kill left a temporary file: the test tests nothing");
}
